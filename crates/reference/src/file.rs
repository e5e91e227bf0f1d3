//! Reference pictures as OpenEXR files, from which they can go on.
//!
//! Channels, f32: `R, G, B, A` the total over the scene's background, as `strandlight render`
//! writes it; layers `single`, `global`, `local`, `total` (`single.R`, ...) the hair's radiance
//! alone, times its coverage; `variance` that of each pixel's mean over the background, estimated
//! from its samples (low where samples are stratified and few); `coverage.Y`; of scenes with
//! proxies `proxies`, their radiance, and `proxies.Y`, their coverage. Channels `bits.*` or `sums.*`,
//! u32, keep the sums of samples exactly (see `exact`), so that a picture made in parts is that made at
//! once. Attributes `strandlight/method`, `strandlight/inputs` (a hash of all that decides the picture
//! but seed and samples), `strandlight/seed`, `strandlight/samples`, `strandlight/checksum` (of the
//! content), and those of [`strandlight_scene::provenance`]. Files of 0.1.0 have neither checksum nor
//! `bits` and call these `strandlightMethod` and so on; they are gone on with as well.

use std::ops::Range;

use exr::meta::header::Header;
use strandlight_images::catch_decoder_panic;
use strandlight_images::exr_file::{self, Channel, floats};
use strandlight_scene::provenance::{GROOM, LIGHTS, PANORAMA, Provenance, SCENE, TABLES, TIME};

use super::Method;
use super::backdrop::Backdrop;
use super::decode::{
    CHECKSUM, SAMPLES, checksum, film_of, header_of, need, number_of, size_of, text_of,
};
use super::exact::{all_sums, bits, bytes_of_channels};
use super::file_error::FileError;
use super::film::{Film, Pixel};
use super::spans::spans_of;
use super::stored::Stored;

/// A reference picture, and what it is of.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceFile {
    /// How it was made.
    pub method: Method,
    /// Hash of all that decides the picture but seed and number of samples.
    pub inputs: String,
    /// Seed of the random numbers.
    pub seed: u64,
    /// What it was made from, for whom reads the file.
    pub provenance: Provenance,
    /// The samples.
    pub film: Film,
}

pub(super) const METHOD: &str = "method";
pub(super) const INPUTS: &str = "inputs";
pub(super) const SEED: &str = "seed";
/// Attribute of parts, which number of how many: see [`super::ReferencePart`].
pub(super) const PART: &str = "part";

/// Name of the map that lights, and of the method's options, in a file's provenance.
pub const MAP: &str = "strandlight/map";
/// See [`MAP`].
pub const OPTIONS: &str = "strandlight/options";

/// What a refusal looks at, in this order, to say what differs between two pictures by `method`; the scene
/// holds all others.
pub(super) fn blamed(method: &str) -> [(&'static str, &'static str); 8] {
    let is_by = |other: Method| method == other.name();
    let options = if is_by(Method::Path) {
        "option --energy-safe is"
    } else if is_by(Method::Directional) {
        "number of --lights is"
    } else {
        "lights and densities are"
    };
    [
        (GROOM, "groom is"),
        (LIGHTS, "light set is"),
        (MAP, "map is"),
        (PANORAMA, "panorama is"),
        (TABLES, "tables are"),
        (OPTIONS, options),
        (TIME, "time is"),
        (SCENE, "scene is"),
    ]
}

/// Layers with the sums that they show.
type LayerOf = (&'static str, fn(&Pixel) -> [f64; 3]);
const LAYERS: [LayerOf; 3] = [
    ("single", |pixel| pixel.single),
    ("global", |pixel| pixel.global),
    ("local", |pixel| pixel.local),
];

impl ReferenceFile {
    /// Most bytes that a picture of `samples` takes, until it is encoded, beside the scene, which `has_proxies` or
    /// not. Numbers of samples of which more than one sum is left take several times as many.
    pub fn peak_bytes(size: [u32; 2], samples: Range<u32>, has_proxies: bool) -> u64 {
        let n_pixels = size.map(u64::from).iter().product::<u64>();
        let spans = spans_of(samples);
        // As much again while the channels are encoded.
        let channels = 2 * bytes_of_channels(spans.len(), has_proxies);
        n_pixels * (std::mem::size_of::<Pixel>() as u64 * spans.len() as u64 + channels)
    }

    /// The file's bytes, over `backdrop`.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn encode(&self, backdrop: &Backdrop) -> Result<Vec<u8>, FileError> {
        let mut channels = self.layers(backdrop);
        channels.extend(match self.film.spans.len() {
            1 => {
                let n = f64::from(self.film.n_samples);
                let stored = Stored::of(&channels, n, self.film.n_pixels())?;
                bits(&self.film, &stored, backdrop.has_proxies)
            }
            _ => all_sums(&self.film, backdrop.has_proxies),
        });
        self.encode_channels(channels, self.provenance.clone())
    }

    /// A file of these channels; what `provenance` says beside method, inputs, seed and samples.
    ///
    /// # Errors
    /// What the encoder says.
    pub(super) fn encode_channels(
        &self,
        channels: Vec<Channel>,
        provenance: Provenance,
    ) -> Result<Vec<u8>, FileError> {
        let provenance = provenance
            .with(METHOD, self.method.name())
            .with(INPUTS, &self.inputs)
            .with(SEED, self.seed)
            .with(SAMPLES, self.film.n_samples);
        let entries = provenance.entries().iter();
        let nameless = |name: &str| name.strip_prefix("strandlight/").unwrap_or(name).to_owned();
        let entries: Vec<_> = entries
            .map(|(name, value)| (nameless(name), value.clone()))
            .collect();
        let provenance = provenance.with(CHECKSUM, checksum(&channels, &entries));
        let size = self.film.size.map(|n| n as usize);
        exr_file::encode((size[0], size[1]), channels, provenance.entries())
            .map_err(FileError::Encoder)
    }

    /// The channels that show the picture.
    pub(super) fn layers(&self, backdrop: &Backdrop) -> Vec<Channel> {
        let film = &self.film;
        let n = f64::from(film.n_samples.max(1));
        let mut channels: Vec<Channel> = Vec::new();
        let mut push = |name: String, values: Vec<f32>| channels.push(floats(name, values));
        let mut push_rgb = |prefix: &str, values: Vec<[f64; 3]>| {
            for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
                let values = values.iter().map(|rgb| rgb[c] as f32).collect();
                push(format!("{prefix}{name}"), values);
            }
        };
        for (name, of) in LAYERS {
            let means = film.pixels().map(|pixel| of(&pixel).map(|x| x / n));
            push_rgb(&format!("{name}."), means.collect());
        }
        let hair = |pixel: &Pixel| pixel.total().map(|x| x / n);
        push_rgb("total.", film.pixels().map(|pixel| hair(&pixel)).collect());
        let composited = |(pixel, behind): (Pixel, &Option<[f32; 3]>)| {
            let behind = behind.unwrap_or([0.0; 3]).map(f64::from);
            let open = 1.0 - (pixel.covered + pixel.matte_covered) / n;
            std::array::from_fn(|c| hair(&pixel)[c] + pixel.matte[c] / n + open * behind[c])
        };
        let total = film.pixels().zip(&backdrop.behind).map(composited);
        let total: Vec<[f64; 3]> = total.collect();
        let variances = film.pixels().zip(&total);
        let variances = variances.map(|(pixel, mean)| variance_of_mean(pixel.squares, *mean, n));
        push_rgb("variance.", variances.collect());
        push_rgb("", total);
        if backdrop.has_proxies {
            let matte = film.pixels().map(|pixel| pixel.matte.map(|x| x / n));
            push_rgb("proxies.", matte.collect());
        }
        let share = |covered: fn(&Pixel) -> f64| -> Vec<f32> {
            let pixels = film.pixels();
            pixels.map(|pixel| (covered(&pixel) / n) as f32).collect()
        };
        let whole = share(|pixel| pixel.covered + pixel.matte_covered);
        let behind = backdrop.behind.iter().zip(whole);
        let alpha = behind.map(|(behind, a)| if behind.is_some() { 1.0 } else { a });
        push("A".to_owned(), alpha.collect());
        push("coverage.Y".to_owned(), share(|pixel| pixel.covered));
        if backdrop.has_proxies {
            push("proxies.Y".to_owned(), share(|pixel| pixel.matte_covered));
        }
        channels
    }

    /// Reads the samples that [`ReferenceFile::encode`] wrote, if the file is a picture like this
    /// one, of as many samples as there may be: no other file is decoded.
    ///
    /// # Errors
    /// What is not as in this one, by name.
    pub fn resume(&mut self, bytes: &[u8]) -> Result<(), FileError> {
        self.film = catch_decoder_panic(|| decode(bytes, self))?;
        Ok(())
    }
}

/// Why a picture of other inputs is another.
pub(super) fn other_inputs(header: &Header, wanted: &ReferenceFile) -> FileError {
    let provenance = &wanted.provenance;
    let blamed = blamed(wanted.method.name())
        .into_iter()
        .find_map(|(name, what)| {
            let found = text_of(header, name.strip_prefix("strandlight/")?);
            let expected = provenance.get(name);
            let text = |value: Option<&str>| value.unwrap_or("none").to_owned();
            (found.as_deref() != expected).then(|| FileError::Other {
                what,
                found: text(found.as_deref()),
                expected: text(expected),
            })
        });
    // Files of 0.1.0 tell nothing.
    let tells = text_of(header, "scene").is_some();
    blamed.filter(|_| tells).unwrap_or(FileError::OtherInputs)
}

fn decode(bytes: &[u8], wanted: &ReferenceFile) -> Result<Film, FileError> {
    let size = wanted.film.size;
    let other = |what, found: &dyn ToString, expected: &dyn ToString| FileError::Other {
        what,
        found: found.to_string(),
        expected: expected.to_string(),
    };
    let header = &header_of(bytes)?;
    let method = need(header, METHOD)?;
    if method != wanted.method.name() {
        return Err(other("method is", &method, &wanted.method.name()));
    }
    if let Some(part) = text_of(header, PART) {
        return Err(FileError::IsAPart(part));
    }
    let shape = |[width, height]: [usize; 2]| format!("{width}x{height}");
    let found = shape(size_of(header));
    let expected = shape(size.map(|n| n as usize));
    if found != expected {
        return Err(other("size is", &found, &expected));
    }
    if need(header, INPUTS)? != wanted.inputs {
        return Err(other_inputs(header, wanted));
    }
    let seed = need(header, SEED)?;
    if seed != wanted.seed.to_string() {
        return Err(other("seed is", &seed, &wanted.seed));
    }
    let n_samples = number_of(header, SAMPLES)?;
    if n_samples == 0 {
        return Err(FileError::Missing(SAMPLES.to_owned()));
    }
    Ok(film_of(bytes, header, size, [0, n_samples])?.0)
}

/// Variance of the mean of `n` samples from the sum of their squares; 0 for a single one.
fn variance_of_mean(squares: [f64; 3], mean: [f64; 3], n: f64) -> [f64; 3] {
    if n < 2.0 {
        return [0.0; 3];
    }
    std::array::from_fn(|c| ((squares[c] / n - mean[c] * mean[c]) / (n - 1.0)).max(0.0))
}
