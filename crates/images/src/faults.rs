//! Samples that are no radiance: NaN, infinite, negative.

use std::fmt;

use rayon::prelude::*;

use crate::error::DecodeError;

/// One pixel in this many may hold a NaN or an infinity; a map with more of them is damaged.
const SOUND_PIXELS_PER_FAULT: usize = 1000;

/// So many are always replaced: a thousandth of a small map is less than a pixel.
const TOLERATED_FAULTS: usize = 4;

/// Pixels whose samples had to be replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct PixelFaults {
    /// Pixels with a NaN sample; the sample becomes 0.
    pub nan: u64,
    /// Pixels with an infinite sample; plus infinity becomes [`PixelFaults::infinite_as`] of its
    /// channel, minus infinity becomes 0.
    pub infinite: u64,
    /// Pixels with a finite negative sample (ringing of lossy compression, colours outside
    /// Rec.709); the sample becomes 0.
    pub negative: u64,
    /// The largest finite radiance of each channel, if there are infinite pixels. What the file
    /// meant is brighter than it could say, by an unknown factor; this adds nothing to the map
    /// that is not in it.
    pub infinite_as: Option<[f32; 3]>,
}

impl PixelFaults {
    /// Whether nothing had to be replaced.
    pub fn is_clean(&self) -> bool {
        *self == PixelFaults::default()
    }
}

impl fmt::Display for PixelFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} NaN, {} infinite", self.nan, self.infinite)?;
        if let Some([r, g, b]) = self.infinite_as {
            write!(f, " (taken as {r} {g} {b}, the largest finite radiance)")?;
        }
        write!(f, ", {} negative", self.negative)
    }
}

/// Replaces NaN and infinite samples (see [`PixelFaults`]) and counts the pixels concerned.
///
/// # Errors
/// [`DecodeError::NotFinite`] if there are too many.
pub(super) fn replace_non_finite(pixels: &mut [[f32; 3]]) -> Result<PixelFaults, DecodeError> {
    let mut faults = PixelFaults::default();
    let is_finite = |pixel: &[f32; 3]| pixel.iter().all(|x| x.is_finite());
    if pixels.par_iter().all(is_finite) {
        return Ok(faults);
    }
    let mut largest = [0.0f32; 3];
    let mut count = 0;
    for pixel in &*pixels {
        faults.nan += u64::from(pixel.iter().any(|x| x.is_nan()));
        faults.infinite += u64::from(pixel.iter().any(|x| x.is_infinite()));
        count += usize::from(!is_finite(pixel));
        for (largest, x) in largest.iter_mut().zip(pixel) {
            if x.is_finite() {
                *largest = largest.max(*x);
            }
        }
    }
    let limit = (pixels.len() / SOUND_PIXELS_PER_FAULT).max(TOLERATED_FAULTS);
    if count > limit {
        return Err(DecodeError::NotFinite {
            pixels: pixels.len(),
            nan: faults.nan,
            infinite: faults.infinite,
            most: limit,
            one_in: SOUND_PIXELS_PER_FAULT,
        });
    }
    if faults.infinite > 0 {
        faults.infinite_as = Some(largest);
    }
    for pixel in pixels {
        for (x, largest) in pixel.iter_mut().zip(largest) {
            if x.is_nan() {
                *x = 0.0;
            } else if x.is_infinite() {
                *x = if *x > 0.0 { largest } else { 0.0 };
            }
        }
    }
    Ok(faults)
}

/// Replaces negative samples by 0 and counts the pixels concerned.
pub(super) fn replace_negative(pixels: &mut [[f32; 3]]) -> u64 {
    pixels
        .par_iter_mut()
        .map(|pixel| {
            let is_negative = pixel.iter().any(|x| *x < 0.0);
            if is_negative {
                *pixel = pixel.map(|x| x.max(0.0));
            }
            u64::from(is_negative)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Map, MapSource};

    #[test]
    fn bad_samples_are_counted_and_clamped() {
        let mut pixels = vec![[1.0, 2.0, 3.0]; 8];
        pixels[0] = [f32::NAN, -1.0, 5.0];
        pixels[1] = [f32::INFINITY, 1e6, f32::NEG_INFINITY];
        pixels[2] = [-0.5, 0.0, -0.5];
        let map = Map::new(4, 2, pixels).unwrap();
        let expected = PixelFaults {
            nan: 1,
            infinite: 1,
            negative: 2,
            infinite_as: Some([1.0, 1e6, 5.0]),
        };
        assert_eq!(map.faults(), expected);
        assert_eq!(map.pixels()[0], [0.0, 0.0, 5.0]);
        assert_eq!(map.pixels()[1], [1.0, 1e6, 0.0], "its channel's largest");
        assert_eq!(map.pixels()[2], [0.0, 0.0, 0.0]);
        assert_eq!(map.pixels()[3], [1.0, 2.0, 3.0]);
        let recorded = map.parameters();
        assert!(
            recorded
                .iter()
                .any(|(name, value)| name == "map_clamped_pixels" && value.contains("1 infinite")),
            "{recorded:?}"
        );
    }

    #[test]
    fn infinite_samples_stay_in_their_channel_when_colours_are_converted() {
        // The matrix subtracts channels: infinity less infinity would be NaN.
        let matrix = [[1.5, -0.5, 0.0], [-0.2, 1.2, 0.0], [0.0, -0.1, 1.1]];
        let mut pixels = vec![[1.0, 1.0, 1.0]; 8];
        pixels[5] = [f32::INFINITY; 3];
        pixels[6] = [f32::MAX, 0.0, 0.0];
        let map = Map::from_decoded(4, 2, pixels, Some(matrix), MapSource::default()).unwrap();
        assert_eq!(map.faults().infinite, 1);
        assert_eq!(map.faults().nan, 0);
        assert!(map.pixels().iter().flatten().all(|x| x.is_finite()));
        assert_eq!(map.pixels()[6][0], f32::MAX);
    }

    #[test]
    fn a_map_with_too_many_non_finite_pixels_is_refused_with_their_number() {
        let with = |count: usize| {
            let mut pixels = vec![[1.0; 3]; 128 * 64];
            for pixel in pixels.iter_mut().take(count) {
                pixel[1] = f32::NAN;
            }
            pixels[count / 2][1] = f32::INFINITY;
            Map::new(128, 64, pixels)
        };
        // A thousandth of 8192 pixels.
        assert_eq!(with(8).unwrap().faults().nan, 7);
        let error = with(9).unwrap_err().to_string();
        for needle in ["damaged", "8 are NaN", "1 infinite", "at most 8"] {
            assert!(error.contains(needle), "{error}");
        }
    }
}
