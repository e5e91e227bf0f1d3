//! Reference pictures as OpenEXR files, from which they can go on.
//!
//! Channels, f32: `R, G, B, A` the total over the scene's background, as `strandlight render`
//! writes it; layers `single`, `global`, `local`, `total` (`single.R`, ...) the hair's radiance
//! alone, times its coverage; `variance` that of each pixel's mean over the background, estimated
//! from its samples (low where samples are stratified and few); `coverage.Y`; of scenes with
//! proxies `proxies`, their radiance, and `proxies.Y`, their coverage. Channels `bits.*`, u32: what
//! f32 leaves out of the sums of samples, so that a picture made in parts is that made at once.
//! Attributes `strandlight/method`, `strandlight/inputs` (a hash of all that decides the picture
//! but seed and samples), `strandlight/seed`, `strandlight/samples`, and those of
//! [`strandlight_scene::provenance`]. Files of 0.1.0 have no `bits` and call these
//! `strandlightMethod` and so on; they are gone on with as well.

use std::io::Cursor;

use exr::meta::header::Header;
use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, Text, read};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::provenance::{GROOM, LIGHTS, Provenance, SCENE, TABLES, TIME};

use super::Method;
use super::film::{Film, MAX_SAMPLES, Pixel};
use strandlight_images::exr_file::{self, Channel, floats};
use strandlight_images::{DecoderPanic, catch_decoder_panic};
use strandlight_scene::background::background_at;

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

/// Why a file cannot be gone on with.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// Not an OpenEXR file that can be read.
    #[error("not a readable OpenEXR file: {0}")]
    OpenExr(#[source] exr::error::Error),
    /// The decoder panicked.
    #[error("not a readable OpenEXR file: {0}")]
    Decoder(#[from] DecoderPanic),
    /// Sums of samples that are NaN or infinite.
    #[error("not a readable OpenEXR file: values that are not finite")]
    NotFinite,
    /// Another kind of picture.
    #[error("not a reference picture of this program: no {0}")]
    Missing(String),
    /// A picture of something else.
    #[error("a picture of other inputs: its {what} {found}, not {expected}")]
    Other {
        /// What differs.
        what: &'static str,
        /// What the file has.
        found: String,
        /// What was asked for.
        expected: String,
    },
    /// A picture of something else, and it does not tell of what.
    #[error("a picture of other inputs: its scene or options differ")]
    OtherInputs,
    /// It cannot be written.
    #[error("cannot be encoded: {0}")]
    Encoder(#[source] exr::error::Error),
}

const METHOD: &str = "method";
const INPUTS: &str = "inputs";
const SEED: &str = "seed";
const SAMPLES: &str = "samples";

/// Name of the map that lights, and of the method's options, in a file's provenance.
pub const MAP: &str = "strandlight/map";
/// See [`MAP`].
pub const OPTIONS: &str = "strandlight/options";

/// What a refusal looks at, in this order, to say what differs; the scene holds all others.
const BLAMED: [(&str, &str); 7] = [
    (GROOM, "groom is"),
    (LIGHTS, "light set is"),
    (MAP, "map is"),
    (TABLES, "tables are"),
    (OPTIONS, "options are"),
    (TIME, "time is"),
    (SCENE, "scene is"),
];

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
        let mut channels: Vec<Channel> = Vec::new();
        let mut push = |name: String, values: Vec<f32>| channels.push(floats(name, values));
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

        let stored = Stored::of(&channels, n, film.pixels.len())?;
        let n_sums = if scene.proxies.is_empty() { 12 } else { 15 };
        let mut bits = vec![Vec::with_capacity(film.pixels.len()); n_sums];
        for (ix, pixel) in film.pixels.iter().enumerate() {
            let (exact, rounded) = (sums(pixel), sums(&stored.pixel(ix)));
            for (bits, (exact, rounded)) in bits.iter_mut().zip(exact.into_iter().zip(rounded)) {
                bits.push(missing_bits(exact, rounded));
            }
        }
        let bits = SUMS.into_iter().zip(bits);
        channels.extend(bits.map(|(name, bits)| (format!("bits.{name}"), FlatSamples::U32(bits))));
        let provenance = self.provenance.clone();
        let provenance = provenance
            .with(METHOD, self.method.name())
            .with(INPUTS, &self.inputs)
            .with(SEED, self.seed)
            .with(SAMPLES, film.n_samples);
        let size = film.size.map(|n| n as usize);
        exr_file::encode((size[0], size[1]), channels, provenance.entries())
            .map_err(FileError::Encoder)
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

/// The text of an attribute, in files of 0.1.0 by the name that it had there.
fn text_of(header: &Header, name: &str) -> Option<String> {
    let first = name.get(..1)?.to_uppercase();
    let names = [
        format!("strandlight/{name}"),
        format!("strandlight{first}{}", &name[1..]),
    ];
    names.into_iter().find_map(
        |name| match header.own_attributes.other.get(&Text::from(&*name)) {
            Some(AttributeValue::Text(text)) => Some(text.to_string()),
            _ => None,
        },
    )
}

/// Why a picture of other inputs is another.
fn other_inputs(header: &Header, provenance: &Provenance) -> FileError {
    let blamed = BLAMED.into_iter().find_map(|(name, what)| {
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
    let missing = |what: &str| FileError::Missing(what.to_owned());
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(FileError::OpenExr)?;
    let header = reader.headers().first().ok_or_else(|| missing("layer"))?;
    let text = |name: &str| text_of(header, name).ok_or_else(|| missing(name));
    let method = text(METHOD)?;
    if method != wanted.method.name() {
        return Err(other("method is", &method, &wanted.method.name()));
    }
    let shape = |[width, height]: [usize; 2]| format!("{width}x{height}");
    let found = shape([header.layer_size.width(), header.layer_size.height()]);
    let expected = shape(size.map(|n| n as usize));
    if found != expected {
        return Err(other("size is", &found, &expected));
    }
    if text(INPUTS)? != wanted.inputs {
        return Err(other_inputs(header, &wanted.provenance));
    }
    let seed = text(SEED)?;
    if seed != wanted.seed.to_string() {
        return Err(other("seed is", &seed, &wanted.seed));
    }
    let n_samples = text(SAMPLES)?.parse().ok();
    let n_samples = n_samples
        .filter(|n| (1..=MAX_SAMPLES).contains(n))
        .ok_or_else(|| missing(SAMPLES))?;
    let names = header.channels.list.len();
    if names > 64 {
        return Err(missing("such channels"));
    }

    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(FileError::OpenExr)?;
    let mut film = Film::new(size);
    film.n_samples = n_samples;
    let list = image.layer_data.channel_data.list;
    let channels = list.into_iter();
    let channels = channels.map(|channel| (channel.name.to_string(), channel.sample_data));
    let channels: Vec<Channel> = channels.collect();
    let stored = Stored::of(&channels, f64::from(n_samples), film.pixels.len())?;
    let bits = SUMS.map(|name| {
        let name = format!("bits.{name}");
        let found = channels.iter().find(|(known, _)| *known == name);
        match found.map(|(_, samples)| samples) {
            Some(FlatSamples::U32(bits)) if bits.len() == film.pixels.len() => Some(bits),
            _ => None,
        }
    });
    for (ix, pixel) in film.pixels.iter_mut().enumerate() {
        let mut exact = sums(&stored.pixel(ix));
        for (sum, bits) in exact.iter_mut().zip(&bits) {
            *sum = with_bits(*sum, bits.map_or(0, |bits| bits[ix]));
        }
        *pixel = with_sums(stored.pixel(ix), exact);
    }
    if film.pixels.iter().any(|pixel| !pixel.is_finite()) {
        return Err(FileError::NotFinite);
    }
    Ok(film)
}

/// The sums of a pixel that f32 rounds, by name.
const SUMS: [&str; 15] = [
    "single.R",
    "single.G",
    "single.B",
    "global.R",
    "global.G",
    "global.B",
    "local.R",
    "local.G",
    "local.B",
    "squares.R",
    "squares.G",
    "squares.B",
    "proxies.R",
    "proxies.G",
    "proxies.B",
];

/// The sums of `pixel` in the order of [`SUMS`].
fn sums(pixel: &Pixel) -> [f64; 15] {
    let parts = [
        pixel.single,
        pixel.global,
        pixel.local,
        pixel.squares,
        pixel.matte,
    ];
    std::array::from_fn(|ix| parts[ix / 3][ix % 3])
}

/// `pixel` with other sums.
fn with_sums(pixel: Pixel, sums: [f64; 15]) -> Pixel {
    let part = |ix: usize| [sums[3 * ix], sums[3 * ix + 1], sums[3 * ix + 2]];
    Pixel {
        single: part(0),
        global: part(1),
        local: part(2),
        squares: part(3),
        matte: part(4),
        ..pixel
    }
}

/// How far `exact` lies from `rounded`, in steps of f64; 0 where that is too far to be rounding to
/// f32: values that it cannot hold.
fn missing_bits(exact: f64, rounded: f64) -> u32 {
    let steps = exact.to_bits().wrapping_sub(rounded.to_bits()) as i64;
    i32::try_from(steps).unwrap_or(0) as u32
}

/// What [`missing_bits`] was asked about.
fn with_bits(rounded: f64, bits: u32) -> f64 {
    f64::from_bits(
        rounded
            .to_bits()
            .wrapping_add_signed(i64::from(bits as i32)),
    )
}

/// The channels of a file that sums are made from again.
struct Stored<'a> {
    n: f64,
    single: [&'a [f32]; 3],
    global: [&'a [f32]; 3],
    local: [&'a [f32]; 3],
    total: [&'a [f32]; 3],
    variance: [&'a [f32]; 3],
    coverage: &'a [f32],
    proxies: Option<(&'a [f32], [&'a [f32]; 3])>,
}

impl<'a> Stored<'a> {
    /// Finds the channels of a picture of `n` samples.
    fn of(channels: &'a [Channel], n: f64, n_pixels: usize) -> Result<Self, FileError> {
        let channel = |name: &str| -> Result<&'a [f32], FileError> {
            let found = channels.iter().find(|(known, _)| known == name);
            match found.map(|(_, samples)| samples) {
                Some(FlatSamples::F32(values)) if values.len() == n_pixels => Ok(values),
                _ => Err(FileError::Missing(name.to_owned())),
            }
        };
        let rgb = |prefix: &str| -> Result<[&'a [f32]; 3], FileError> {
            let [r, g, b] = ["R", "G", "B"].map(|name| channel(&format!("{prefix}{name}")));
            Ok([r?, g?, b?])
        };
        Ok(Stored {
            n,
            single: rgb("single.")?,
            global: rgb("global.")?,
            local: rgb("local.")?,
            total: rgb("")?,
            variance: rgb("variance.")?,
            coverage: channel("coverage.Y")?,
            proxies: match channel("proxies.Y") {
                Ok(coverage) => Some((coverage, rgb("proxies.")?)),
                Err(_) => None,
            },
        })
    }

    /// Pixel `ix`, its sums good to f32's rounding of their means.
    fn pixel(&self, ix: usize) -> Pixel {
        let n = self.n;
        let at = |layer: &[&[f32]; 3]| layer.map(|channel| f64::from(channel[ix]));
        let count = |share: &[f32]| (f64::from(share[ix]) * n).round();
        let (mean, variance) = (at(&self.total), at(&self.variance));
        let proxies = self.proxies.as_ref();
        Pixel {
            covered: count(self.coverage),
            single: at(&self.single).map(|x| x * n),
            global: at(&self.global).map(|x| x * n),
            local: at(&self.local).map(|x| x * n),
            matte_covered: proxies.map_or(0.0, |(coverage, _)| count(coverage)),
            matte: proxies.map_or([0.0; 3], |(_, matte)| at(matte).map(|x| x * n)),
            squares: std::array::from_fn(|c| n * (variance[c] * (n - 1.0) + mean[c] * mean[c])),
        }
    }
}

/// Variance of the mean of `n` samples from the sum of their squares; 0 for a single one.
fn variance_of_mean(squares: [f64; 3], mean: [f64; 3], n: f64) -> [f64; 3] {
    if n < 2.0 {
        return [0.0; 3];
    }
    std::array::from_fn(|c| ((squares[c] / n - mean[c] * mean[c]) / (n - 1.0)).max(0.0))
}
