//! Channels that keep the sums of samples exactly.
//!
//! Where a picture has one sum a pixel, its layers show it, and `bits.NAME` holds what f32 leaves out
//! of it. Otherwise `sums.K.NAME.high` and `.low` are the halves of the f64 that is sum number K, and
//! `sums.K.covered` and `sums.K.proxies.covered` count its samples that meet hair and proxies.

use exr::prelude::FlatSamples;
use strandlight_images::exr_file::Channel;

use super::file_error::FileError;
use super::film::{Film, Pixel};
use super::stored::{SUMS, Stored, missing_bits, sums, with_bits, with_sums};

/// Channels of a pixel's sum beside those of [`SUMS`].
const COVERED: &str = "covered";
const MATTE_COVERED: &str = "proxies.covered";

/// How many of [`SUMS`] a picture needs.
fn n_sums(has_proxies: bool) -> usize {
    if has_proxies { SUMS.len() } else { 12 }
}

fn bits_name(name: &str) -> String {
    format!("bits.{name}")
}

fn sum_name(k: usize, name: &str) -> String {
    format!("sums.{k}.{name}")
}

/// What f32 leaves out of the one sum of each pixel of `film`, which `stored` shows.
pub(super) fn bits(film: &Film, stored: &Stored, has_proxies: bool) -> Vec<Channel> {
    let mut bits = vec![Vec::with_capacity(film.n_pixels()); n_sums(has_proxies)];
    for (ix, pixel) in film.pixels().enumerate() {
        let (exact, rounded) = (sums(&pixel), sums(&stored.pixel(ix)));
        for (bits, (exact, rounded)) in bits.iter_mut().zip(exact.into_iter().zip(rounded)) {
            bits.push(missing_bits(exact, rounded));
        }
    }
    let named = SUMS.into_iter().zip(bits);
    let named = named.map(|(name, bits)| (bits_name(name), FlatSamples::U32(bits)));
    named.collect()
}

/// Every sum of every pixel of `film`.
pub(super) fn all_sums(film: &Film, has_proxies: bool) -> Vec<Channel> {
    let n = film.spans.len();
    let mut channels = Vec::new();
    for k in 0..n {
        let mut push = |name: &str, of: &dyn Fn(&Pixel) -> u32| {
            let values = film.sums.iter().skip(k).step_by(n).map(of).collect();
            channels.push((sum_name(k, name), FlatSamples::U32(values)));
        };
        for (ix, name) in SUMS.into_iter().enumerate().take(n_sums(has_proxies)) {
            let half = |pixel: &Pixel, shift: u32| (sums(pixel)[ix].to_bits() >> shift) as u32;
            push(&format!("{name}.high"), &|pixel| half(pixel, 32));
            push(&format!("{name}.low"), &|pixel| half(pixel, 0));
        }
        // Counts of at most 2^24 samples.
        push(COVERED, &|pixel| pixel.covered as u32);
        if has_proxies {
            push(MATTE_COVERED, &|pixel| pixel.matte_covered as u32);
        }
    }
    channels
}

/// Bytes that the channels of a pixel of `n_spans` sums take, those that show it among them.
pub(super) fn bytes_of_channels(n_spans: usize, has_proxies: bool) -> u64 {
    // Single, global, local, total, variance and all of it, of three each; alpha and coverage.
    let n_shown = if has_proxies { 24 } else { 20 };
    let n_counts = if has_proxies { 2 } else { 1 };
    let n_exact = match n_spans {
        1 => n_sums(has_proxies),
        n => n * (2 * n_sums(has_proxies) + n_counts),
    };
    ((n_shown + n_exact) * size_of::<u32>()) as u64
}

/// Most channels that a film of `n_spans` sums a pixel is kept in.
pub(super) fn most_channels(n_spans: usize) -> usize {
    n_spans * (2 * SUMS.len() + 2)
}

/// The values of the channel `name`, one for each pixel.
fn numbers<'a>(channels: &'a [Channel], name: &str, n_pixels: usize) -> Option<&'a [u32]> {
    let found = channels.iter().find(|(known, _)| known == name);
    match found.map(|(_, samples)| samples) {
        Some(FlatSamples::U32(values)) if values.len() == n_pixels => Some(values),
        _ => None,
    }
}

/// Whether the channels hold all sums, not bits.
pub(super) fn has_all_sums(channels: &[Channel]) -> bool {
    let first = sum_name(0, COVERED);
    channels.iter().any(|(name, _)| *name == first)
}

/// Fills the sums of `film`, whose spans are known, with what [`all_sums`] wrote.
///
/// # Errors
/// The first channel that is not there.
pub(super) fn read_all_sums(
    film: &mut Film,
    channels: &[Channel],
    has_proxies: bool,
) -> Result<(), FileError> {
    let (n, n_pixels) = (film.spans.len(), film.n_pixels());
    film.sums = vec![Pixel::default(); n * n_pixels];
    for k in 0..n {
        let channel = |name: &str| {
            let name = sum_name(k, name);
            numbers(channels, &name, n_pixels).ok_or(FileError::Missing(name))
        };
        let halves = |name: &str| -> Result<_, FileError> {
            Ok([
                channel(&format!("{name}.high"))?,
                channel(&format!("{name}.low"))?,
            ])
        };
        let names = SUMS.into_iter().take(n_sums(has_proxies));
        let halves: Vec<[&[u32]; 2]> = names.map(halves).collect::<Result<_, _>>()?;
        let covered = channel(COVERED)?;
        let matte_covered = has_proxies.then(|| channel(MATTE_COVERED)).transpose()?;
        for ix in 0..n_pixels {
            let mut exact = [0.0; SUMS.len()];
            for (sum, [high, low]) in exact.iter_mut().zip(&halves) {
                *sum = f64::from_bits((u64::from(high[ix]) << 32) | u64::from(low[ix]));
            }
            let counts = Pixel {
                covered: f64::from(covered[ix]),
                matte_covered: matte_covered.map_or(0.0, |counts| f64::from(counts[ix])),
                ..Pixel::default()
            };
            film.sums[ix * n + k] = with_sums(counts, exact);
        }
    }
    Ok(())
}

/// Fills the sums of `film`, whose spans are known, with the one sum a pixel that `stored` and
/// [`bits`] have. Files of earlier versions have one where there are several now: the first span
/// gets it, which changes the order of addition and nothing else.
pub(super) fn read_bits(film: &mut Film, channels: &[Channel], stored: &Stored) {
    let (n, n_pixels) = (film.spans.len(), film.n_pixels());
    let bits = SUMS.map(|name| numbers(channels, &bits_name(name), n_pixels));
    film.sums = vec![Pixel::default(); n * n_pixels];
    for (ix, pixel) in film.sums.iter_mut().step_by(n.max(1)).enumerate() {
        let mut exact = sums(&stored.pixel(ix));
        for (sum, bits) in exact.iter_mut().zip(&bits) {
            *sum = with_bits(*sum, bits.map_or(0, |bits| bits[ix]));
        }
        *pixel = with_sums(stored.pixel(ix), exact);
    }
}
