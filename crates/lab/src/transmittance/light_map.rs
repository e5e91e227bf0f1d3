//! Strands as a light sees them: a square map across the light's direction, with optical depth.

use glam::Vec3;
use strandlight_scene::strands::Strands;

/// Texels along a side; more is worse for maps of opacity, which then see single fibres.
pub const SIDE: usize = 128;

/// A map around the strands, across a direction.
#[derive(Clone, Copy, Debug)]
pub struct LightMap {
    axes: [Vec3; 3],
    centre: Vec3,
    /// Half the map's side, cm; the strands lie inside.
    pub reach: f32,
    /// Side of a texel, cm.
    pub texel: f32,
}

/// A piece of a strand on the map.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Texels from the middle of texel (0, 0).
    pub at: [f32; 2],
    /// Distance from the plane that the light comes through, cm, >= 0.
    pub depth: f32,
    /// Optical depth it adds to one texel.
    pub tau: f64,
    /// sin^2 of the light's inclination.
    pub sin_2: f32,
}

impl LightMap {
    /// The map across `direction`, which points to the light.
    pub fn new(strands: &Strands, direction: [f32; 3]) -> LightMap {
        let towards = Vec3::from(direction);
        let (x, y) = towards.any_orthonormal_pair();
        let (low, high) = strands.bounds;
        // Two texels wider, so that bilinear taps stay inside.
        let reach = (0.5 * (high - low).length()).max(1e-3) * (1.0 + 4.0 / SIDE as f32);
        LightMap {
            axes: [x, y, -towards],
            centre: 0.5 * (low + high),
            reach,
            texel: 2.0 * reach / SIDE as f32,
        }
    }

    /// Place on the map (as [`Piece::at`]) and depth of a position.
    pub fn place(&self, position: Vec3) -> ([f32; 2], f32) {
        let from = position - self.centre;
        let at = [0, 1].map(|axis| (from.dot(self.axes[axis]) + self.reach) / self.texel - 0.5);
        (at, (from.dot(self.axes[2]) + self.reach).max(0.0))
    }

    /// Calls `found` with all strands in pieces of half a texel.
    pub fn pieces(&self, strands: &Strands, mut found: impl FnMut(Piece)) {
        for &first in &strands.segments {
            let [a, b] = [first, first + 1].map(|ix| strands.points[ix as usize]);
            let (from, to) = (Vec3::from_slice(&a), Vec3::from_slice(&b));
            let along = to - from;
            let length = along.length();
            let slope = along.dot(self.axes[2]);
            let across = (length * length - slope * slope).max(0.0).sqrt();
            let n = ((2.0 * length / self.texel).ceil()).clamp(1.0, 1024.0);
            let diameter = a[3] + b[3];
            let tau = f64::from(across * diameter / n) / f64::from(self.texel).powi(2);
            let sin_2 = (slope / length.max(1e-12)).powi(2).min(1.0);
            for ix in 0..n as u32 {
                let position = from + along * ((ix as f32 + 0.5) / n);
                let (at, depth) = self.place(position);
                found(Piece {
                    at,
                    depth,
                    tau,
                    sin_2,
                });
            }
        }
    }
}

/// The four texels around a place, with their weights.
pub fn taps(at: [f32; 2]) -> [(usize, f32); 4] {
    let limit = (SIDE - 2) as f32;
    let base = at.map(|x| x.floor().clamp(0.0, limit));
    let f = [0, 1].map(|axis| (at[axis] - base[axis]).clamp(0.0, 1.0));
    let corner = base[0] as usize + SIDE * base[1] as usize;
    [
        (corner, (1.0 - f[0]) * (1.0 - f[1])),
        (corner + 1, f[0] * (1.0 - f[1])),
        (corner + SIDE, (1.0 - f[0]) * f[1]),
        (corner + SIDE + 1, f[0] * f[1]),
    ]
}
