//! Environment maps in memory: linear Rec.709 radiance on the latitude-longitude layout.

use std::borrow::Cow;
use std::f64::consts::PI;

use rayon::prelude::*;
use strandlight_formats::content_hash;

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

/// The latitude-longitude pixel grid (see [`Map`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LatLong {
    /// Pixels across, 360 degrees.
    pub width: usize,
    /// Pixels down, 180 degrees.
    pub height: usize,
}

impl LatLong {
    /// Unit direction at column `x`, row `y` in pixels; the centre of pixel (i, j) is
    /// (i + 0.5, j + 0.5).
    pub fn direction(self, x: f64, y: f64) -> [f64; 3] {
        let (sin_lat, cos_lat) = (PI * (0.5 - y / self.height as f64)).sin_cos();
        let (sin_lon, cos_lon) = (PI - 2.0 * PI * x / self.width as f64).sin_cos();
        [cos_lat * sin_lon, sin_lat, cos_lat * cos_lon]
    }

    /// Column and row (see [`LatLong::direction`]) of a unit direction; columns in 0..=width.
    pub fn position(self, direction: [f64; 3]) -> [f64; 2] {
        let lat = direction[1].clamp(-1.0, 1.0).asin();
        let lon = direction[0].atan2(direction[2]);
        [
            (PI - lon) / (2.0 * PI) * self.width as f64,
            (0.5 - lat / PI) * self.height as f64,
        ]
    }

    /// Integral over the sphere of the pixels of `rows`, top row first.
    pub fn energy<'a>(self, rows: impl Iterator<Item = &'a [[f32; 3]]>) -> [f64; 3] {
        let mut total = [0.0; 3];
        for (j, row) in rows.enumerate() {
            let mut sum = [0.0; 3];
            for pixel in row {
                for (sum, x) in sum.iter_mut().zip(pixel) {
                    *sum += f64::from(*x);
                }
            }
            let solid_angle = self.solid_angle(j);
            for (total, x) in total.iter_mut().zip(sum) {
                *total += x * solid_angle;
            }
        }
        total
    }

    /// Exact solid angle of a pixel of row `j`; all pixels sum to 4 pi.
    pub fn solid_angle(self, j: usize) -> f64 {
        // Difference of sin(lat) at the two edges, by the product formula: no cancellation.
        let step = PI / self.height as f64;
        let lat = PI * (0.5 - (j as f64 + 0.5) / self.height as f64);
        2.0 * PI / self.width as f64 * 2.0 * lat.cos() * (0.5 * step).sin()
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
    fn directions_follow_the_openexr_convention() {
        let grid = LatLong {
            width: 64,
            height: 32,
        };
        // Centre of the picture: lon = 0, +Z. A quarter from the left: lon = pi/2, +X. Top: +Y.
        let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-12);
        assert!(close(grid.direction(32.0, 16.0), [0.0, 0.0, 1.0]));
        assert!(close(grid.direction(16.0, 16.0), [1.0, 0.0, 0.0]));
        assert!(close(grid.direction(48.0, 16.0), [-1.0, 0.0, 0.0]));
        assert!(close(grid.direction(7.0, 0.0), [0.0, 1.0, 0.0]));
        for (x, y) in [(0.5, 0.5), (10.0, 20.0), (63.5, 31.5), (40.25, 3.0)] {
            let [x2, y2] = grid.position(grid.direction(x, y));
            assert!((x - x2).abs() < 1e-9 && (y - y2).abs() < 1e-9);
        }
    }

    #[test]
    fn solid_angles_sum_to_the_sphere() {
        for height in [2, 3, 64, 512] {
            let grid = LatLong {
                width: 2 * height,
                height,
            };
            let sum: f64 = (0..height)
                .map(|j| grid.solid_angle(j) * 2.0 * height as f64)
                .sum();
            assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-12, "{height}: {sum}");
        }
    }

    #[test]
    fn other_shapes_are_refused() {
        for (width, height) in [(1, 1), (2, 1), (0, 0), (100, 100), (65536, 32768)] {
            assert!(check_size(width, height).is_err(), "{width} x {height}");
        }
        assert!(check_size(4, 2).is_ok());
    }
}
