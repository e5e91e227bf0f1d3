//! Light of a map itself.

use std::f64::consts::PI;

use glam::Vec3;
use strandlight_scene::LatLong;

use super::cumulative::{Cumulative, mean};

/// A map, its pixels drawn by power.
pub struct MapSampler {
    pixels: Vec<[f32; 3]>,
    grid: LatLong,
    /// Running sums over the pixels of each row, rows one after another.
    powers: Cumulative,
    /// Cosine and sine of the map's turn about +Y.
    turn: (f32, f32),
}

impl MapSampler {
    /// The map with these `pixels`, the top row first, turned by `turn` radians about +Y, its radiance times
    /// `factor`, linear RGB.
    pub fn new(grid: LatLong, pixels: &[[f32; 3]], turn: f32, factor: [f32; 3]) -> Self {
        let pixels: Vec<[f32; 3]> = pixels
            .iter()
            .map(|pixel| [0, 1, 2].map(|channel| pixel[channel] * factor[channel]))
            .collect();
        let power =
            |(ix, pixel): (usize, &[f32; 3])| mean(*pixel) * grid.solid_angle(ix / grid.width);
        MapSampler {
            powers: Cumulative::new(pixels.iter().enumerate().map(power)),
            pixels,
            grid,
            turn: (turn.cos(), turn.sin()),
        }
    }

    pub(super) fn radiance(&self, omega: Vec3) -> ([f32; 3], f32) {
        let (cos, sin) = self.turn;
        let unturned = [
            cos * omega.x - sin * omega.z,
            omega.y,
            sin * omega.x + cos * omega.z,
        ];
        let [x, y] = self.grid.position(unturned.map(f64::from));
        let i = (x as usize).min(self.grid.width - 1);
        let j = (y as usize).min(self.grid.height - 1);
        let pixel = self.pixels[j * self.grid.width + i];
        let total = self.powers.total();
        let pdf = if total > 0.0 {
            mean(pixel) / total
        } else {
            0.0
        };
        (pixel, pdf as f32)
    }

    /// Mean of the channels, integrated over the sphere.
    pub(super) fn total(&self) -> f64 {
        self.powers.total()
    }

    pub(super) fn direction_at(&self, u: [f64; 3]) -> Option<Vec3> {
        let total = self.powers.total();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let ix = self.powers.pick(u[0]);
        let (i, j) = (ix % self.grid.width, ix / self.grid.width);
        let x = i as f64 + u[1];
        // Evenly in the sine of the latitude.
        let sin_at = |y: f64| (PI * (0.5 - y / self.grid.height as f64)).sin();
        let share = u[2];
        let sin = sin_at(j as f64) * (1.0 - share) + sin_at(j as f64 + 1.0) * share;
        let y = (0.5 - sin.clamp(-1.0, 1.0).asin() / PI) * self.grid.height as f64;
        let [a, b, c] = self.grid.direction(x, y).map(|x| x as f32);
        let (cos, sin) = self.turn;
        Some(Vec3::new(cos * a + sin * c, b, cos * c - sin * a).normalize())
    }
}
