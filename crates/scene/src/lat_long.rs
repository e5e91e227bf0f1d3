//! Where the pixels of environment maps lie on the sphere.

use std::f64::consts::PI;

/// The pixel grid of an environment map: latitude-longitude, row 0 on top.
///
/// The centre of pixel (column i, row j) of W x H lies at latitude `pi (0.5 - (j + 0.5) / H)` and longitude
/// `pi - 2 pi (i + 0.5) / W`, direction `(cos lat sin lon, sin lat, cos lat cos lon)`, +Y up: OpenEXR's `latlong`.
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
}
