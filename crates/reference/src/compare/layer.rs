//! One layer of a picture file as linear pixels.

use std::io::Cursor;
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::reader::ChunksReader;
use exr::meta::header::Header;
use strandlight_formats::{FileKind, read_file_of_kind};

use super::error::{CompareError, LayerError};
use strandlight_images::catch_decoder_panic;
use strandlight_images::exr_map::{MAGIC, read_samples};
use strandlight_scene::budget::MAX_TARGET_PIXELS;

/// Largest width and height of a picture.
pub const MAX_SIDE: usize = 16_384;
/// Most pixels: as many as are drawn at once.
pub const MAX_PIXELS: usize = MAX_TARGET_PIXELS as usize;
/// Longest file that is read.
const MAX_FILE_BYTES: u64 = 2 << 30;
/// First bytes of a PNG.
const PNG_MAGIC: &[u8] = b"\x89PNG";
/// Most channels of a part: a block holds all of them while it is decoded.
const MAX_CHANNELS: usize = 256;
/// The layer that holds the variance of each pixel's mean.
const VARIANCE: &str = "variance";
/// The layer that holds the share of each pixel that hair covers.
const COVERAGE: &str = "coverage";

/// One layer: linear colour multiplied by alpha, row 0 on top. Every value is finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear Rec.709, alpha multiplied in.
    pub rgb: Vec<[f32; 3]>,
    /// Share of the pixel that hair covers, as far as the file tells; 1 everywhere where it does
    /// not.
    pub alpha: Vec<f32>,
    /// Variance of each value of `rgb`, where the file tells it for this layer.
    pub variance: Option<Vec<[f32; 3]>>,
    /// Whether the file was 8- or 16-bit sRGB, tone mapped already.
    pub is_display: bool,
}

impl Layer {
    /// A linear layer without variance.
    ///
    /// # Panics
    /// If a vector has not `width * height` elements.
    pub fn new(width: usize, height: usize, rgb: Vec<[f32; 3]>, alpha: Vec<f32>) -> Self {
        assert_eq!(rgb.len(), width * height);
        assert_eq!(alpha.len(), width * height);
        Layer {
            width,
            height,
            rgb,
            alpha,
            variance: None,
            is_display: false,
        }
    }

    /// Reads the layer called `name` of an OpenEXR file (channels `name.R`, `name.G`, `name.B`, or
    /// plain ones in a part of that name), or without a name the plain channels `R`, `G`, `B`; or
    /// a PNG, which has no named layers. `alpha` is the channel `coverage.Y` of a reference, or
    /// else the layer's `A`, or the plain `A`. The layer `variance` goes with the plain channels
    /// and with `total`.
    ///
    /// # Errors
    /// What is wrong with the file, in one line.
    pub fn read(path: &Path, name: Option<&str>) -> Result<Layer, CompareError> {
        let is_picture = |kind| matches!(kind, FileKind::Map(_) | FileKind::Picture(_));
        let bytes = read_file_of_kind(path, MAX_FILE_BYTES, is_picture)?;
        Layer::decode(&bytes, name).map_err(|source| CompareError::File {
            path: path.to_owned(),
            source,
        })
    }

    /// [`Layer::read`] from the bytes of a file.
    ///
    /// # Errors
    /// What is wrong with them; its text is one line.
    pub fn decode(bytes: &[u8], name: Option<&str>) -> Result<Layer, LayerError> {
        let layer = if bytes.starts_with(&MAGIC) {
            catch_decoder_panic(|| decode_exr(bytes, name))?
        } else if bytes.starts_with(PNG_MAGIC) {
            if let Some(name) = name {
                return Err(LayerError::PngLayer(name.to_owned()));
            }
            decode_png(bytes)?
        } else {
            return Err(LayerError::NotThisKind);
        };
        layer.check_finite()?;
        Ok(layer)
    }

    /// Means of blocks of `side` x `side` pixels; blocks at the right and lower edge may be
    /// smaller. The variance becomes that of the block's mean.
    #[must_use]
    pub fn boxed(&self, side: usize) -> Layer {
        let side = side.max(1);
        let (width, height) = (self.width.div_ceil(side), self.height.div_ceil(side));
        let blocks = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = |(x, y): (usize, usize)| {
            let rows = y * side..((y + 1) * side).min(self.height);
            let columns = x * side..((x + 1) * side).min(self.width);
            rows.flat_map(move |y| columns.clone().map(move |x| y * self.width + x))
        };
        // `power` 1: the mean. 2: the variance of the mean, of independent pixels.
        let means = |values: &[[f32; 3]], power: i32| -> Vec<[f32; 3]> {
            blocks()
                .map(|block| {
                    let mut sum = [0.0_f64; 3];
                    let mut count = 0.0_f64;
                    for ix in pixels(block) {
                        for (sum, value) in sum.iter_mut().zip(values[ix]) {
                            *sum += f64::from(value);
                        }
                        count += 1.0;
                    }
                    sum.map(|sum| (sum / count.powi(power)) as f32)
                })
                .collect()
        };
        let alpha = blocks()
            .map(|block| {
                let count = pixels(block).count() as f64;
                let sum: f64 = pixels(block).map(|ix| f64::from(self.alpha[ix])).sum();
                (sum / count) as f32
            })
            .collect();
        Layer {
            width,
            height,
            rgb: means(&self.rgb, 1),
            alpha,
            variance: self.variance.as_ref().map(|variance| means(variance, 2)),
            is_display: self.is_display,
        }
    }

    fn check_finite(&self) -> Result<(), LayerError> {
        let variance = self.variance.as_deref().unwrap_or_default();
        let bad_rgb = |values: &[[f32; 3]]| {
            values
                .iter()
                .position(|rgb| rgb.iter().any(|x| !x.is_finite()))
        };
        let bad = bad_rgb(&self.rgb)
            .or_else(|| self.alpha.iter().position(|x| !x.is_finite()))
            .or_else(|| bad_rgb(variance));
        match bad {
            None => Ok(()),
            Some(ix) => Err(LayerError::NotFinite {
                x: ix % self.width,
                y: ix / self.width,
            }),
        }
    }
}

fn check_size(width: usize, height: usize) -> Result<(), LayerError> {
    let sides = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if sides && width * height <= MAX_PIXELS {
        return Ok(());
    }
    Err(LayerError::TooLarge {
        width,
        height,
        max_side: MAX_SIDE,
        max_pixels: MAX_PIXELS,
    })
}

/// Where a channel is: part and index in its list.
type Place = (usize, usize);

/// The channels of all parts by their full names, `layer.R`; those of the plain layer have no dot.
struct Names(Vec<(String, Place)>);

impl Names {
    fn of(headers: &[Header]) -> Names {
        let mut names = Vec::new();
        for (part, header) in headers.iter().enumerate() {
            for (ix, channel) in header.channels.list.iter().enumerate() {
                let name = channel.name.to_string();
                let of_part = header.own_attributes.layer_name.as_ref();
                // Plain channels of a part go by its name as well, and those of the first part
                // are the file's plain channels.
                if let (Some(of_part), false) = (of_part, name.contains('.')) {
                    names.push((format!("{of_part}.{name}"), (part, ix)));
                }
                if part == 0 || name.contains('.') {
                    names.push((name, (part, ix)));
                }
            }
        }
        Names(names)
    }

    fn find(&self, layer: Option<&str>, channel: &str) -> Option<Place> {
        let name = match layer {
            Some(layer) => format!("{layer}.{channel}"),
            None => channel.to_owned(),
        };
        let found = self.0.iter().find(|(other, _)| *other == name);
        found.map(|(_, place)| *place)
    }

    /// R, G, B of a layer; its `Y` three times if it has no colour, or the only channel of a layer with a name.
    fn rgb(&self, layer: Option<&str>) -> Option<[Place; 3]> {
        let find = |channel| self.find(layer, channel);
        match (find("R"), find("G"), find("B")) {
            (Some(r), Some(g), Some(b)) => Some([r, g, b]),
            _ => {
                let only = layer.and_then(|layer| match self.channels(layer)[..] {
                    [channel] => find(channel),
                    _ => None,
                });
                // With X it is an axis, as of tangents.
                let luminance = find("Y").filter(|_| find("X").is_none());
                luminance.or(only).map(|y| [y; 3])
            }
        }
    }

    /// The channels of a layer; none of one that is not there.
    fn channels(&self, layer: &str) -> Vec<&str> {
        let names = self.0.iter();
        let channels = names.filter_map(|(name, _)| name.strip_prefix(layer)?.strip_prefix('.'));
        channels.filter(|channel| !channel.contains('.')).collect()
    }

    /// The names of layers, for a person who asked for another; without what files of samples keep to be gone
    /// on with.
    fn layers(&self) -> String {
        /// Most that are named.
        const MOST: usize = 12;
        let mut layers: Vec<&str> = Vec::new();
        for (name, _) in &self.0 {
            let layer = name.rfind('.').map_or("(plain)", |at| &name[..at]);
            let first = layer.split('.').next().unwrap_or(layer);
            if !layers.contains(&layer) && !["sums", "bits", "behind"].contains(&first) {
                layers.push(layer);
            }
        }
        let more = layers.len().saturating_sub(MOST);
        layers.truncate(MOST);
        match more {
            0 => layers.join(", "),
            _ => format!("{} and {more} more", layers.join(", ")),
        }
    }
}

fn damaged(what: impl Into<String>) -> LayerError {
    LayerError::Damaged(what.into())
}

fn decode_exr(bytes: &[u8], name: Option<&str>) -> Result<Layer, LayerError> {
    let reader = exr::block::read(Cursor::new(bytes), false)?;
    let names = Names::of(reader.headers());
    let rgb = names.rgb(name).ok_or_else(|| {
        let found = names.layers();
        let Some(layer) = name.map(str::to_owned) else {
            return LayerError::NoColor { found };
        };
        match names.channels(&layer) {
            channels if channels.is_empty() => LayerError::NoLayer { layer, found },
            channels => LayerError::LayerWithoutColor {
                layer,
                channels: channels.join(", "),
            },
        }
    })?;
    // A reference over a background is opaque, but tells the coverage of the hair.
    let alpha = names
        .find(Some(COVERAGE), "Y")
        .or_else(|| names.find(name, "A"))
        .or_else(|| names.find(None, "A"));
    let variance = match name {
        None | Some("total") => names.rgb(Some(VARIANCE)),
        Some(_) => None,
    };
    let mut planes: Vec<Place> = rgb.to_vec();
    planes.extend(alpha);
    planes.extend(variance.into_iter().flatten());

    let (width, height) = check_parts(reader.headers(), &planes, bytes.len())?;
    let parts: Vec<usize> = planes.iter().map(|place| place.0).collect();
    let mut chunks = reader.filter_chunks(false, |_, tile, block| {
        parts.contains(&block.layer) && tile.level_index.x() == 0 && tile.level_index.y() == 0
    })?;
    let mut values = vec![vec![0.0_f32; width * height]; planes.len()];
    let mut filled = 0;
    while let Some(chunk) = chunks.next() {
        let meta_data = chunks.meta_data();
        let block = UncompressedBlock::decompress_chunk(chunk?, meta_data, false)?;
        let part = block.index.layer;
        let list = &meta_data.headers[part].channels;
        let mut samples = Vec::new();
        for line in block.lines(list) {
            let place = (part, line.location.channel);
            if !planes.contains(&place) {
                continue;
            }
            let (x, y) = (line.location.position.x(), line.location.position.y());
            let count = line.location.sample_count;
            let sample_type = list.list[line.location.channel].sample_type;
            read_samples(line.value, sample_type, &mut samples);
            if x + count > width || y >= height || samples.len() != count {
                let what = format!("a block at ({x}, {y}) does not fit the picture");
                return Err(damaged(what));
            }
            let start = y * width + x;
            for (plane, values) in planes.iter().zip(&mut values) {
                if *plane == place {
                    values[start..start + count].copy_from_slice(&samples);
                    filled += count;
                }
            }
        }
    }
    if filled < width * height * planes.len() {
        return Err(damaged("the file is incomplete: pixels are missing"));
    }
    let triple = |at: usize| -> Vec<[f32; 3]> {
        (0..width * height)
            .map(|ix| [0, 1, 2].map(|c| values[at + c][ix]))
            .collect()
    };
    let after_alpha = if alpha.is_some() { 4 } else { 3 };
    let mut layer = Layer::new(
        width,
        height,
        triple(0),
        match alpha {
            Some(_) => values[3].clone(),
            None => vec![1.0; width * height],
        },
    );
    // That of a single sample is all 0: it tells nothing.
    layer.variance = variance
        .map(|_| triple(after_alpha))
        .filter(|variance| variance.iter().any(|of| *of != [0.0; 3]));
    Ok(layer)
}

/// Refuses parts that cannot be read before anything is allocated for them; answers their size.
fn check_parts(
    headers: &[Header],
    planes: &[Place],
    file_bytes: usize,
) -> Result<(usize, usize), LayerError> {
    let unsupported = |what: String| Err(LayerError::Unsupported(what));
    let size_of = |part: usize| {
        let size = headers[part].layer_size;
        (size.width(), size.height())
    };
    let (width, height) = size_of(planes[0].0);
    check_size(width, height)?;
    // See the maps' reader: deflate shrinks 1032:1 at most.
    if width * height / 2048 > file_bytes {
        return Err(damaged(format!(
            "the file is truncated: {file_bytes} bytes cannot hold {width} x {height} pixels"
        )));
    }
    for &(part, _) in planes {
        let header = &headers[part];
        if header.deep {
            return unsupported("deep data are not supported".to_owned());
        }
        if size_of(part) != (width, height) {
            return Err(damaged("its parts have different sizes"));
        }
        let channels = &header.channels.list;
        if channels.len() > MAX_CHANNELS {
            return unsupported(format!("more than {MAX_CHANNELS} channels in a part"));
        }
        if channels.iter().any(|channel| channel.sampling.area() != 1) {
            return unsupported("subsampled channels are not supported".to_owned());
        }
    }
    Ok((width, height))
}

/// 8- or 16-bit grey or colour, taken as sRGB whatever the file's chunks say.
fn decode_png(bytes: &[u8]) -> Result<Layer, LayerError> {
    let mut decoder = png::Decoder::new_with_limits(
        Cursor::new(bytes),
        png::Limits {
            bytes: 32 * MAX_PIXELS,
        },
    );
    decoder.set_transformations(png::Transformations::EXPAND);
    let header = decoder.read_header_info()?;
    let (width, height) = (header.width as usize, header.height as usize);
    check_size(width, height)?;
    if width * height / 2048 > bytes.len() {
        return Err(damaged("the file is truncated: too few bytes for its size"));
    }
    let mut reader = decoder.read_info()?;
    let size = reader.output_buffer_size();
    let size = size.ok_or_else(|| damaged("too large"))?;
    let mut data = vec![0; size];
    let info = reader.next_frame(&mut data)?;
    let samples: Vec<f32> = if info.bit_depth == png::BitDepth::Sixteen {
        let (words, _) = data.as_chunks::<2>();
        words
            .iter()
            .map(|word| f32::from(u16::from_be_bytes(*word)) / 65535.0)
            .collect()
    } else {
        data.iter().map(|byte| f32::from(*byte) / 255.0).collect()
    };
    let mut layer = Layer::new(
        width,
        height,
        vec![[0.0; 3]; width * height],
        vec![1.0; width * height],
    );
    layer.is_display = true;
    for (ix, pixel) in samples
        .chunks_exact(info.color_type.samples())
        .take(width * height)
        .enumerate()
    {
        let (rgb, alpha) = match *pixel {
            [y] => ([y; 3], 1.0),
            [y, a] => ([y; 3], a),
            [r, g, b] => ([r, g, b], 1.0),
            [r, g, b, a] => ([r, g, b], a),
            _ => return Err(damaged("a PNG with other than 1 to 4 samples a pixel")),
        };
        layer.rgb[ix] = rgb.map(|x| linear_from_srgb(x) * alpha);
        layer.alpha[ix] = alpha;
    }
    Ok(layer)
}

/// Inverse of the sRGB transfer curve (IEC 61966-2-1).
pub(super) fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
#[path = "layer_tests.rs"]
mod tests;
