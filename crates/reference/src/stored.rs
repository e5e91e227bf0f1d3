//! What the channels of a reference picture tell of its sums: their means, rounded to f32.

use exr::prelude::FlatSamples;
use strandlight_images::exr_file::Channel;

use super::file_error::FileError;
use super::film::Pixel;

/// The sums of a pixel that f32 rounds, by name.
pub(super) const SUMS: [&str; 15] = [
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
pub(super) fn sums(pixel: &Pixel) -> [f64; 15] {
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
pub(super) fn with_sums(pixel: Pixel, sums: [f64; 15]) -> Pixel {
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
pub(super) fn missing_bits(exact: f64, rounded: f64) -> u32 {
    let steps = exact.to_bits().wrapping_sub(rounded.to_bits()) as i64;
    i32::try_from(steps).unwrap_or(0) as u32
}

/// What [`missing_bits`] was asked about.
pub(super) fn with_bits(rounded: f64, bits: u32) -> f64 {
    f64::from_bits(
        rounded
            .to_bits()
            .wrapping_add_signed(i64::from(bits as i32)),
    )
}

/// The channels of a file that sums are made from again.
pub(super) struct Stored<'a> {
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
    pub fn of(channels: &'a [Channel], n: f64, n_pixels: usize) -> Result<Self, FileError> {
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

    /// Are there proxies in the picture?
    pub fn has_proxies(&self) -> bool {
        self.proxies.is_some()
    }

    /// Pixel `ix`, its sums good to f32's rounding of their means.
    pub fn pixel(&self, ix: usize) -> Pixel {
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
