//! OpenEXR maps: scan lines or tiles, the largest level of mip and rip maps, every compression
//! that the `exr` crate decodes.

use std::collections::HashSet;
use std::io::Cursor;

use exr::block::{UncompressedBlock, chunk::Chunk};
use exr::meta::attribute::{
    ChannelDescription, Chromaticities, EnvironmentMap, IntegerBounds, LevelMode, SampleType,
};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use rayon::prelude::*;

use crate::decoder_panic::catch_decoder_panic;
use crate::error::{DecodeError, TRUNCATED};
use crate::exr_images::{Rgb, choose};
use crate::map::{MAX_WIDTH, Map, check_size};
use crate::primaries::Primaries;
use crate::source::{MapSelection, MapSource, MapWindows, Window};

/// First bytes of every OpenEXR file.
pub const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Blocks that are decoded at once take at most so many bytes, unless one alone takes more.
const BATCH_BYTES: usize = 64 << 20;

/// Most bytes of a decoded block; it holds all channels of its part. A block of the tallest kind,
/// 256 rows, of 16384 pixels and 128 half channels.
const MAX_BLOCK_BYTES: usize = 1 << 30;

/// Most pixels for which a byte of the file can stand. Deflate shrinks at most 1032:1, and PIZ,
/// B44, DWA less on anything but constants: a header that promises more is lying, and would only
/// buy an allocation.
const MAX_PIXELS_PER_BYTE: u64 = 2048;

/// A sphere of so many pixels is worth its memory for a crop of any size: 2048 x 1024.
const SMALL_SPHERE: u64 = 1 << 21;

/// Decodes a whole file, or rather the image in it that `selection` names: channels `R`, `G`, `B`
/// or `Y`, plain or with the name of a layer before them (`diffuse.R`).
///
/// The sphere is the display window. Pixels of it that the data window leaves out are black, and
/// pixels of the data window outside it are left out; [`MapSource::windows`] tells of both. (The
/// OpenEXR library takes the data window for the sphere; but programs crop that to what is not
/// black, and the display window is what the picture was before.) Chromaticities are converted to
/// Rec.709. Refused by name: deep data, cube maps, subsampled luminance/chroma, compressions that
/// `exr` cannot decode.
///
/// # Errors
/// What is wrong.
pub(super) fn decode(
    bytes: &[u8],
    hash: String,
    selection: &MapSelection,
) -> Result<Map, DecodeError> {
    catch_decoder_panic(|| decode_unguarded(bytes, hash, selection))
}

fn decode_unguarded(
    bytes: &[u8],
    hash: String,
    selection: &MapSelection,
) -> Result<Map, DecodeError> {
    // The headers alone: the crate's own reader refuses files with a deep part whatever is read.
    let mut start = Cursor::new(bytes);
    let meta_data = MetaData::read_from_buffered(&mut start, true)?;
    // No larger than the slice, which is in memory.
    let (headers, tables) = bytes.split_at(start.position() as usize);
    check_window_corners(headers)?;
    let (image, choice) = choose(&meta_data.headers, selection).map_err(DecodeError::NoImage)?;
    let header = &meta_data.headers[image.part];
    let is_multi_part = meta_data.headers.len() > 1;
    header.validate(is_multi_part, &mut false, false)?;
    let (windows, inside) = check_header(header, bytes.len())?;
    let matrix = match header.shared_attributes.chromaticities {
        Some(chromaticities) => primaries(chromaticities).to_rec_709()?,
        None => None,
    };

    let mut target = Target::new(windows);
    let blocks = block_offsets(&meta_data, image.part, tables, |block| {
        target.on_sphere(window(block)).is_some()
    })?;
    let batch = (BATCH_BYTES / block_bytes(header)).clamp(1, 64);
    for batch in blocks.chunks(batch) {
        let blocks: Vec<UncompressedBlock> = batch
            .par_iter()
            .map(|offset| {
                catch_decoder_panic(|| {
                    let mut chunk = usize::try_from(*offset)
                        .ok()
                        .and_then(|offset| bytes.get(offset..))
                        .ok_or_else(truncated)?;
                    let chunk = Chunk::read(&mut chunk, &meta_data)?;
                    if chunk.layer_index != image.part {
                        return Err(damaged("a block belongs to another part than its table"));
                    }
                    let block = UncompressedBlock::decompress_chunk(chunk, &meta_data, false)?;
                    Ok(block)
                })
            })
            .collect::<Result<_, DecodeError>>()?;
        for block in blocks {
            target.insert(&block, &header.channels.list, &image.channels)?;
        }
    }
    let missing = inside.area() - target.filled;
    if missing > 0 {
        return Err(damaged(format!(
            "the file is incomplete: {missing} of {} pixels are missing",
            inside.area()
        )));
    }
    let source = MapSource {
        hash,
        format: describe(header, &image.channels),
        image: choice,
        windows: (windows.data != windows.display).then_some(windows),
    };
    let [width, height] = windows.display.size;
    Map::from_decoded(width, height, target.pixels, matrix, source)
}

/// A rectangle of the `exr` crate.
fn window(bounds: IntegerBounds) -> Window {
    let (position, size) = (bounds.position, bounds.size);
    Window {
        position: [position.x(), position.y()].map(i64::from),
        size: [size.width(), size.height()],
    }
}

/// Refuses windows whose last pixel comes before their first, which the crate swaps in silence.
fn check_window_corners(headers: &[u8]) -> Result<(), DecodeError> {
    for name in ["dataWindow", "displayWindow"] {
        let attribute = format!("{name}\0box2i\0\x10\0\0\0");
        let attribute = attribute.as_bytes();
        for (at, _) in headers
            .windows(attribute.len())
            .enumerate()
            .filter(|(_, bytes)| *bytes == attribute)
        {
            let (corners, _) = headers[at + attribute.len()..].as_chunks::<4>();
            if let [x0, y0, x1, y1, ..] = corners {
                let [x0, y0, x1, y1] = [x0, y0, x1, y1].map(|bytes| i32::from_le_bytes(*bytes));
                if x1 < x0 || y1 < y0 {
                    return Err(damaged(format!(
                        "the {name} ({x0}, {y0}) to ({x1}, {y1}) is empty, it holds no pixel"
                    )));
                }
            }
        }
    }
    Ok(())
}

/// Bytes of the largest block.
fn block_bytes(header: &Header) -> usize {
    let (block, image) = (header.max_block_pixel_size(), header.layer_size);
    block.width().min(image.width())
        * block.height().min(image.height())
        * header.channels.bytes_per_pixel
}

fn truncated() -> DecodeError {
    damaged(TRUNCATED)
}

fn damaged(what: impl Into<String>) -> DecodeError {
    DecodeError::Damaged(what.into())
}

/// Where the blocks of the largest level of `part` begin in the file, those that are `wanted` by
/// their rectangle in the data window. `tables` are the bytes after the headers: for each part the
/// places of its blocks, level by level, row by row.
fn block_offsets(
    meta_data: &MetaData,
    part: usize,
    tables: &[u8],
    wanted: impl Fn(IntegerBounds) -> bool,
) -> Result<Vec<u64>, DecodeError> {
    let bytes_of = |header: &Header| header.chunk_count.checked_mul(8);
    let before = meta_data.headers[..part]
        .iter()
        .try_fold(0usize, |sum, header| sum.checked_add(bytes_of(header)?));
    let header = &meta_data.headers[part];
    let table = before
        .zip(bytes_of(header))
        .and_then(|(from, length)| tables.get(from..from.checked_add(length)?))
        .ok_or_else(truncated)?;
    let (entries, _) = table.as_chunks::<8>();
    let mut offsets = Vec::new();
    // No more blocks than entries, which the file holds.
    for (entry, tile) in entries.iter().zip(header.blocks_increasing_y_order()) {
        if !tile.location.is_largest_resolution_level() {
            continue;
        }
        let block = header.get_absolute_block_pixel_coordinates(tile.location)?;
        if wanted(block) {
            offsets.push(u64::from_le_bytes(*entry));
        }
    }
    Ok(offsets)
}

/// The sphere while it is filled.
struct Target {
    pixels: Vec<[f32; 3]>,
    /// At (0, 0).
    sphere: Window,
    /// What is added to a place in the data window to be one on the sphere.
    offset: [i64; 2],
    /// Pixels that have their value.
    filled: u64,
    /// The first pixels of the blocks that were inserted.
    seen: HashSet<(usize, usize)>,
}

impl Target {
    fn new(MapWindows { data, display, .. }: MapWindows) -> Target {
        let size = display.size;
        Target {
            pixels: vec![[0.0; 3]; size[0] * size[1]],
            sphere: Window {
                position: [0; 2],
                size,
            },
            offset: [0, 1].map(|axis| data.position[axis] - display.position[axis]),
            filled: 0,
            seen: HashSet::new(),
        }
    }

    /// The part of a rectangle in the data window that lies on the sphere, in its pixels.
    fn on_sphere(&self, block: Window) -> Option<Window> {
        block.moved(self.offset).intersection(self.sphere)
    }

    /// Copies the colour channels of a block, as far as it lies on the sphere.
    fn insert(
        &mut self,
        block: &UncompressedBlock,
        channels: &[ChannelDescription],
        rgb: &Rgb,
    ) -> Result<(), DecodeError> {
        let (corner, size) = (block.index.pixel_position, block.index.pixel_size);
        let (x, y) = (corner.x(), corner.y());
        if block.index.level.x() != 0 || block.index.level.y() != 0 {
            return Err(damaged("a block belongs to another level than its table"));
        }
        if !self.seen.insert((x, y)) {
            return Err(damaged(format!("the block at ({x}, {y}) is there twice")));
        }
        let inside = self.on_sphere(Window {
            position: [x as i64, y as i64],
            size: [size.width(), size.height()],
        });
        let Some(inside) = inside else { return Ok(()) };
        // On the sphere: not negative. In the block likewise.
        let [first, top] = inside.position.map(|x| x as usize);
        let skipped = inside.position[0] - self.offset[0] - x as i64;
        let skipped_rows = inside.position[1] - self.offset[1] - y as i64;
        let (skipped, skipped_rows) = (skipped as usize, skipped_rows as usize);
        let mut samples = Vec::new();
        let mut at = 0;
        for row in 0..size.height() {
            for (ix, channel) in channels.iter().enumerate() {
                let from = at;
                at += size.width() * channel.sample_type.bytes_per_sample();
                let line = row.wrapping_sub(skipped_rows);
                if line >= inside.size[1] || !rgb.contains(&ix) {
                    continue;
                }
                let bytes = block.data.get(from..at);
                let bytes = bytes.ok_or_else(|| damaged("a block is too short"))?;
                read_samples(bytes, channel.sample_type, &mut samples);
                let start = (top + line) * self.sphere.size[0] + first;
                let pixels = &mut self.pixels[start..start + inside.size[0]];
                for c in (0..3).filter(|c| rgb[*c] == ix) {
                    for (pixel, sample) in pixels.iter_mut().zip(&samples[skipped..]) {
                        pixel[c] = *sample;
                    }
                }
            }
        }
        self.filled += inside.area();
        Ok(())
    }
}

/// Refuses what is no latitude-longitude map before anything is allocated for it; answers its
/// windows and the part of the sphere that the file holds.
fn check_header(header: &Header, file_bytes: usize) -> Result<(MapWindows, Window), DecodeError> {
    if header.own_attributes.environment_map == Some(EnvironmentMap::Cube) {
        let what = "a cube map (envmap attribute); only latitude-longitude maps are supported";
        return Err(DecodeError::Unsupported(what.to_owned()));
    }
    let channels = &header.channels.list;
    if channels.iter().any(|channel| channel.sampling.area() != 1) {
        let what = "subsampled channels (luminance/chroma) are not supported";
        return Err(DecodeError::Unsupported(what.to_owned()));
    }
    let data = window(header.data_window());
    let display = window(header.shared_attributes.display_window);
    let [width, height] = display.size;
    check_size(width, height).map_err(|error| {
        if data == display {
            error
        } else {
            let source = Box::new(error);
            DecodeError::DisplayWindow { data, source }
        }
    })?;
    let inside = display.intersection(data).ok_or_else(|| {
        damaged(format!(
            "no pixel of the data window, {data}, lies in the display window, {display}"
        ))
    })?;
    if data.size.iter().any(|size| *size > MAX_WIDTH) {
        return Err(DecodeError::TooLarge(format!(
            "the data window, {data}, is larger than {MAX_WIDTH} x {MAX_WIDTH}"
        )));
    }
    let most_pixels = MAX_PIXELS_PER_BYTE.saturating_mul(file_bytes as u64);
    if data.area() > most_pixels {
        return Err(damaged(format!(
            "the file is truncated: {file_bytes} bytes cannot hold {} x {} pixels",
            data.size[0], data.size[1]
        )));
    }
    let most_pixels = most_pixels.max(SMALL_SPHERE);
    if display.area() > most_pixels {
        return Err(DecodeError::TooLarge(format!(
            "the display window, {width} x {height} pixels, is too large for a file of \
             {file_bytes} bytes (at most {most_pixels} pixels); the data window is {data}"
        )));
    }
    let block = block_bytes(header);
    if block > MAX_BLOCK_BYTES {
        return Err(DecodeError::TooLarge(format!(
            "a block of {} channels takes {block} bytes, at most {MAX_BLOCK_BYTES}",
            channels.len()
        )));
    }
    let windows = MapWindows {
        data,
        display,
        black_pixels: display.area() - inside.area(),
        dropped_pixels: data.area() - inside.area(),
    };
    Ok((windows, inside))
}

/// Native-endian bytes of one channel's row as f32. Unsigned integers are taken as they are.
pub fn read_samples(bytes: &[u8], sample_type: SampleType, samples: &mut Vec<f32>) {
    samples.clear();
    match sample_type {
        SampleType::F16 => {
            let (words, _) = bytes.as_chunks::<2>();
            samples.extend(
                words
                    .iter()
                    .map(|word| half::f16::from_ne_bytes(*word).to_f32()),
            );
        }
        SampleType::F32 => {
            let (words, _) = bytes.as_chunks::<4>();
            samples.extend(words.iter().map(|word| f32::from_ne_bytes(*word)));
        }
        SampleType::U32 => {
            let (words, _) = bytes.as_chunks::<4>();
            samples.extend(words.iter().map(|word| u32::from_ne_bytes(*word) as f32));
        }
    }
}

fn primaries(chromaticities: Chromaticities) -> Primaries {
    let xy = |v: exr::math::Vec2<f32>| [f64::from(v.x()), f64::from(v.y())];
    Primaries {
        red: xy(chromaticities.red),
        green: xy(chromaticities.green),
        blue: xy(chromaticities.blue),
        white: xy(chromaticities.white),
    }
}

/// The layout in words.
fn describe(header: &Header, channels: &Rgb) -> String {
    let blocks = match header.blocks {
        BlockDescription::ScanLines => "scan lines",
        BlockDescription::Tiles(tiles) => match tiles.level_mode {
            LevelMode::Singular => "tiles",
            LevelMode::MipMap => "tiles, mip map",
            LevelMode::RipMap => "tiles, rip map",
        },
    };
    let sample = match header.channels.list[channels[0]].sample_type {
        SampleType::F16 => "half",
        SampleType::F32 => "float",
        SampleType::U32 => "uint",
    };
    let kind = if channels[0] == channels[1] {
        "Y"
    } else {
        "RGB"
    };
    format!("OpenEXR, {blocks}, {}, {sample} {kind}", header.compression)
}

#[cfg(test)]
#[path = "exr_map_tests.rs"]
mod tests;
