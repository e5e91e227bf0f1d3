//! Reference pictures as OpenEXR files, from which they can go on.
//!
//! Channels, f32: `R, G, B, A` the total over the scene's background, as `strandlight render`
//! writes it; layers `single`, `global`, `local`, `total` (`single.R`, ...) the hair's radiance
//! alone, times its coverage; `variance` that of each pixel's mean over the background, estimated
//! from its samples (low where samples are stratified and few); `coverage.Y`; of scenes with proxies
//! `proxies`, their radiance, and `proxies.Y`, their coverage. Attributes
//! `strandlightMethod`, `strandlightInputs` (a hash), `strandlightSeed`, `strandlightSamples`.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    ReadChannels, ReadLayers, SmallVec, Text, WritableImage, read,
};
use strandlight_runtime::PreparedScene;
use strandlight_runtime::camera::view_uniform;

use super::Method;
use super::film::{Film, MAX_SAMPLES, Pixel};
use crate::cpu::background_at;
use crate::lights::quietly;

/// A reference picture, and what it is of.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceFile {
    /// How it was made.
    pub method: Method,
    /// Hash of all that decides the picture but seed and number of samples.
    pub inputs: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The samples.
    pub film: Film,
}

/// Why a file cannot be gone on with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FileError {
    /// Not an OpenEXR file that can be read.
    #[error("not a readable OpenEXR file: {0}")]
    Damaged(String),
    /// Another kind of picture.
    #[error("not a reference picture of this program: no {0}")]
    Missing(String),
    /// A picture of something else.
    #[error("a picture of other inputs: its {0} differs")]
    Other(&'static str),
    /// It cannot be written.
    #[error("cannot be encoded: {0}")]
    Encoder(String),
}

const METHOD: &str = "strandlightMethod";
const INPUTS: &str = "strandlightInputs";
const SEED: &str = "strandlightSeed";
const SAMPLES: &str = "strandlightSamples";

/// Layers with the sums that they show.
type LayerOf = (&'static str, fn(&Pixel) -> [f64; 3]);
const LAYERS: [LayerOf; 3] = [
    ("single", |pixel| pixel.single),
    ("global", |pixel| pixel.global),
    ("local", |pixel| pixel.local),
];

impl ReferenceFile {
    /// The file's bytes; `scene` gives the background.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn encode(&self, scene: &PreparedScene) -> Result<Vec<u8>, FileError> {
        let film = &self.film;
        let n = f64::from(film.n_samples.max(1));
        let mut channels: Vec<AnyChannel<FlatSamples>> = Vec::new();
        let mut push = |name: String, values: Vec<f32>| {
            channels.push(AnyChannel::new(&*name, FlatSamples::F32(values)));
        };
        let mut push_rgb = |prefix: &str, values: Vec<[f64; 3]>| {
            for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
                let values = values.iter().map(|rgb| rgb[c] as f32).collect();
                push(format!("{prefix}{name}"), values);
            }
        };
        for (name, of) in LAYERS {
            let means = film.pixels.iter().map(|pixel| of(pixel).map(|x| x / n));
            push_rgb(&format!("{name}."), means.collect());
        }
        let hair = |pixel: &Pixel| pixel.total().map(|x| x / n);
        push_rgb("total.", film.pixels.iter().map(hair).collect());
        let backgrounds = self.backgrounds(scene);
        let composited = |(pixel, behind): (&Pixel, &Option<[f64; 3]>)| {
            let behind = behind.unwrap_or([0.0; 3]);
            let open = 1.0 - (pixel.covered + pixel.matte_covered) / n;
            std::array::from_fn(|c| hair(pixel)[c] + pixel.matte[c] / n + open * behind[c])
        };
        let total: Vec<[f64; 3]> = film
            .pixels
            .iter()
            .zip(&backgrounds)
            .map(composited)
            .collect();
        let variances = film.pixels.iter().zip(&total);
        let variances = variances.map(|(pixel, mean)| variance_of_mean(pixel.squares, *mean, n));
        push_rgb("variance.", variances.collect());
        push_rgb("", total);
        if !scene.proxies.is_empty() {
            let matte = film.pixels.iter().map(|pixel| pixel.matte.map(|x| x / n));
            push_rgb("proxies.", matte.collect());
        }
        let share = |covered: fn(&Pixel) -> f64| -> Vec<f32> {
            let pixels = film.pixels.iter();
            pixels.map(|pixel| (covered(pixel) / n) as f32).collect()
        };
        let whole = share(|pixel| pixel.covered + pixel.matte_covered);
        let behind = backgrounds.iter().zip(whole);
        let alpha = behind.map(|(behind, a)| if behind.is_some() { 1.0 } else { a });
        push("A".to_owned(), alpha.collect());
        push("coverage.Y".to_owned(), share(|pixel| pixel.covered));
        if !scene.proxies.is_empty() {
            push("proxies.Y".to_owned(), share(|pixel| pixel.matte_covered));
        }

        let mut attributes = LayerAttributes::default();
        for (name, value) in [
            (METHOD, self.method.name()),
            (INPUTS, &self.inputs),
            (SEED, &self.seed.to_string()),
            (SAMPLES, &film.n_samples.to_string()),
        ] {
            attributes
                .other
                .insert(Text::from(name), AttributeValue::Text(Text::from(value)));
        }
        let size = film.size.map(|n| n as usize);
        let layer = Layer::new(
            (size[0], size[1]),
            attributes,
            Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(SmallVec::from_vec(channels)),
        );
        let mut bytes = Cursor::new(Vec::new());
        Image::from_layer(layer)
            .write()
            .to_buffered(&mut bytes)
            .map_err(|error| FileError::Encoder(error.to_string()))?;
        Ok(bytes.into_inner())
    }

    /// What lies behind each pixel.
    fn backgrounds(&self, scene: &PreparedScene) -> Vec<Option<[f64; 3]>> {
        let [width, height] = self.film.size;
        let view = view_uniform(&scene.camera, &scene.strands, self.film.size, 1.0);
        let at = |x: u32, y: u32| [x as f32 + 0.5, y as f32 + 0.5];
        (0..height)
            .flat_map(|y| (0..width).map(move |x| at(x, y)))
            .map(|at| background_at(scene, &view, at).map(|rgb| rgb.map(f64::from)))
            .collect()
    }

    /// Reads what [`ReferenceFile::encode`] wrote, if it is a picture of `size` by `method` of
    /// `inputs`: no other file is decoded. Sums are good to f32's rounding of their means.
    ///
    /// # Errors
    /// What is not as asked for.
    pub fn decode(
        bytes: &[u8],
        method: Method,
        inputs: &str,
        size: [u32; 2],
    ) -> Result<ReferenceFile, FileError> {
        quietly(|| Ok(decode_unguarded(bytes, method, inputs, size)))
            .unwrap_or_else(|error| Err(FileError::Damaged(error)))
    }
}

fn decode_unguarded(
    bytes: &[u8],
    method: Method,
    inputs: &str,
    size: [u32; 2],
) -> Result<ReferenceFile, FileError> {
    let damaged = |error: exr::error::Error| FileError::Damaged(error.to_string());
    let missing = |what: &str| FileError::Missing(what.to_owned());
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(damaged)?;
    let header = reader.headers().first().ok_or_else(|| missing("layer"))?;
    let text = |name: &str| match header.own_attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => Ok(text.to_string()),
        _ => Err(missing(name)),
    };
    if text(METHOD)? != method.name() {
        return Err(FileError::Other("method"));
    }
    if (header.layer_size.width(), header.layer_size.height())
        != (size[0] as usize, size[1] as usize)
    {
        return Err(FileError::Other("size"));
    }
    if text(INPUTS)? != inputs {
        return Err(FileError::Other("scene or options"));
    }
    let seed = text(SEED)?.parse().map_err(|_| missing(SEED))?;
    let n_samples = text(SAMPLES)?.parse().ok();
    let n_samples = n_samples
        .filter(|n| (1..=MAX_SAMPLES).contains(n))
        .ok_or_else(|| missing(SAMPLES))?;
    let names = header.channels.list.len();
    if names > 32 {
        return Err(missing("such channels"));
    }

    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(damaged)?;
    let mut film = Film::new(size);
    film.n_samples = n_samples;
    let n = f64::from(n_samples);
    let list = &image.layer_data.channel_data.list;
    let channel = |name: &str| -> Result<&[f32], FileError> {
        let found = list.iter().find(|channel| channel.name.eq(name));
        match found.map(|channel| &channel.sample_data) {
            Some(FlatSamples::F32(values)) if values.len() == film.pixels.len() => Ok(values),
            _ => Err(missing(name)),
        }
    };
    let rgb = |prefix: &str| -> Result<[&[f32]; 3], FileError> {
        let [r, g, b] = ["R", "G", "B"].map(|name| channel(&format!("{prefix}{name}")));
        Ok([r?, g?, b?])
    };
    let (single, global, local) = (rgb("single.")?, rgb("global.")?, rgb("local.")?);
    let (total, variance, coverage) = (rgb("")?, rgb("variance.")?, channel("coverage.Y")?);
    let proxies = match channel("proxies.Y") {
        Ok(coverage) => Some((coverage, rgb("proxies.")?)),
        Err(_) => None,
    };
    let pixels = (0..film.pixels.len()).map(|ix| {
        let at = |layer: &[&[f32]; 3]| layer.map(|channel| f64::from(channel[ix]));
        let (mean, variance) = (at(&total), at(&variance));
        Pixel {
            covered: (f64::from(coverage[ix]) * n).round(),
            single: at(&single).map(|x| x * n),
            global: at(&global).map(|x| x * n),
            local: at(&local).map(|x| x * n),
            matte_covered: proxies
                .as_ref()
                .map_or(0.0, |(coverage, _)| (f64::from(coverage[ix]) * n).round()),
            matte: proxies
                .as_ref()
                .map_or([0.0; 3], |(_, matte)| at(matte).map(|x| x * n)),
            squares: std::array::from_fn(|c| n * (variance[c] * (n - 1.0) + mean[c] * mean[c])),
        }
    });
    let pixels: Vec<Pixel> = pixels.collect();
    if pixels.iter().any(|pixel| !pixel.is_finite()) {
        return Err(FileError::Damaged("values that are not finite".to_owned()));
    }
    film.pixels = pixels;
    Ok(ReferenceFile {
        method,
        inputs: inputs.to_owned(),
        seed,
        film,
    })
}

/// Variance of the mean of `n` samples from the sum of their squares; 0 for a single one.
fn variance_of_mean(squares: [f64; 3], mean: [f64; 3], n: f64) -> [f64; 3] {
    if n < 2.0 {
        return [0.0; 3];
    }
    std::array::from_fn(|c| ((squares[c] / n - mean[c] * mean[c]) / (n - 1.0)).max(0.0))
}
