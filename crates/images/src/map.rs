//! Environment maps in memory: linear Rec.709 radiance on the latitude-longitude layout.

use std::borrow::Cow;

use rayon::prelude::*;
use strandlight_formats::content_hash;
use strandlight_scene::LatLong;

use crate::error::{DecodeError, MapError};
use crate::faults::{PixelFaults, replace_negative, replace_non_finite};
use crate::primaries::{Matrix, convert};
use crate::source::MapSource;

/// Largest width of a map in pixels; its height is at most half of it. 32768 x 16384 RGB floats
/// are 6 GiB: more than any published map, and a bound on what a lying header can ask for.
pub const MAX_WIDTH: usize = 32768;

/// An environment map: linear Rec.709 radiance, latitude-longitude layout, row 0 on top.
///
/// Pixel (column i, row j) of W x H lies at latitude `pi (0.5 - (j + 0.5) / H)` and longitude
/// `pi - 2 pi (i + 0.5) / W`, direction `(cos lat sin lon, sin lat, cos lat cos lon)`, +Y up:
/// OpenEXR's `latlong`. Every sample is finite and not negative.
#[derive(Clone, Debug)]
pub struct Map {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    faults: PixelFaults,
    source: MapSource,
}

impl Map {
    /// Makes a map from `pixels` (row by row, top row first), clamping and counting what is not
    /// a finite non-negative number (see [`PixelFaults`]).
    ///
    /// # Errors
    /// [`MapError::Pixels`] if the size is not 2:1, too large, or not the number of pixels, or if
    /// more than 0.1 % of the pixels (and more than 4) are NaN or infinite.
    pub fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Result<Map, MapError> {
        check_size(width, height)?;
        if pixels.len() != width * height {
            let pixels = pixels.len();
            let error = DecodeError::PixelCount {
                width,
                height,
                pixels,
            };
            return Err(error.into());
        }
        let hash = content_hash(bytemuck::cast_slice(&pixels));
        let source = MapSource {
            hash,
            format: "memory".to_owned(),
            ..MapSource::default()
        };
        Ok(Map::from_decoded(width, height, pixels, None, source)?)
    }

    /// As [`Map::new`] for a size that was checked before the pixels were decoded; `to_rec_709`
    /// converts their colours.
    pub(super) fn from_decoded(
        width: usize,
        height: usize,
        mut pixels: Vec<[f32; 3]>,
        to_rec_709: Option<Matrix>,
        source: MapSource,
    ) -> Result<Map, DecodeError> {
        // Before the colours are converted: that would spread infinities over the channels, and
        // make NaN of their differences.
        let mut faults = replace_non_finite(&mut pixels)?;
        if let Some(matrix) = to_rec_709 {
            pixels.par_iter_mut().for_each(|pixel| {
                *pixel = convert(&matrix, *pixel).map(|x| x.clamp(f32::MIN, f32::MAX));
            });
        }
        faults.negative = replace_negative(&mut pixels);
        Ok(Map {
            width,
            height,
            pixels,
            faults,
            source,
        })
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels down, half of [`Map::width`].
    pub fn height(&self) -> usize {
        self.height
    }

    /// Radiance, `width * height` pixels, top row first.
    pub fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// The pixels of row `j`.
    pub fn row(&self, j: usize) -> &[[f32; 3]] {
        &self.pixels[j * self.width..(j + 1) * self.width]
    }

    /// The map with each pixel cut into equal parts until it is at least `width` pixels wide, so
    /// that sums over pixel centres see areas, not points. Energies stay as they are.
    pub fn subdivided(&self, width: usize) -> Cow<'_, Map> {
        let factor = width.div_ceil(self.width);
        if factor <= 1 {
            return Cow::Borrowed(self);
        }
        let mut pixels = Vec::with_capacity(self.pixels.len() * factor * factor);
        for row in self.pixels.chunks_exact(self.width) {
            for _ in 0..factor {
                pixels.extend(row.iter().flat_map(|p| std::iter::repeat_n(*p, factor)));
            }
        }
        Cow::Owned(Map {
            width: self.width * factor,
            height: self.height * factor,
            pixels,
            faults: self.faults,
            source: self.source.clone(),
        })
    }

    /// What was clamped.
    pub fn faults(&self) -> PixelFaults {
        self.faults
    }

    /// Where the map came from.
    pub fn source(&self) -> &MapSource {
        &self.source
    }

    /// The layout of the pixels.
    pub fn grid(&self) -> LatLong {
        LatLong {
            width: self.width,
            height: self.height,
        }
    }

    /// What a light set that was fitted to this map records of it, beside hash and size: the
    /// format and, where there is something to say, image, windows and replaced pixels.
    pub fn parameters(&self) -> Vec<(String, String)> {
        let mut parameters = vec![("map_format".to_owned(), self.source.format.clone())];
        if let Some(image) = &self.source.image {
            parameters.extend(image.parameters());
        }
        if let Some(windows) = self.source.windows {
            parameters.push(("map_data_window".to_owned(), windows.data.to_string()));
            parameters.push(("map_display_window".to_owned(), windows.display.to_string()));
        }
        if !self.faults.is_clean() {
            parameters.push(("map_clamped_pixels".to_owned(), self.faults.to_string()));
        }
        parameters
    }

    /// Integral of radiance over the sphere, per channel.
    pub fn energy(&self) -> [f64; 3] {
        self.grid().energy(self.pixels.chunks_exact(self.width))
    }
}

/// Refuses sizes that are no latitude-longitude map, before anything is allocated.
pub(super) fn check_size(width: usize, height: usize) -> Result<(), DecodeError> {
    if width > MAX_WIDTH || height > MAX_WIDTH / 2 {
        Err(DecodeError::TooManyPixels {
            width,
            height,
            max_width: MAX_WIDTH,
        })
    } else if width != 2 * height || width < 4 {
        Err(DecodeError::NotLatLong { width, height })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_shapes_are_refused() {
        for (width, height) in [(1, 1), (2, 1), (0, 0), (100, 100), (65536, 32768)] {
            assert!(check_size(width, height).is_err(), "{width} x {height}");
        }
        assert!(check_size(4, 2).is_ok());
    }
}
