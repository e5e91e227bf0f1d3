//! The head: an ellipsoid, and the part of it where hair grows.

use std::f32::consts::TAU;

use glam::Vec3;
use strandlight_scattering::random::R2;

use super::noise::{Noise, Purpose};

/// Half axes of the head in cm: across the ears, up, and from the back to the face.
pub const HEAD_RADII: Vec3 = Vec3::new(7.5, 11.5, 9.5);

/// A place where a strand grows.
#[derive(Clone, Copy, Debug)]
pub struct Root {
    /// On the head, cm.
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// `position / HEAD_RADII`, a unit vector.
    pub unit: Vec3,
}

/// Lowest `unit.y` at which hair grows towards azimuth `unit.x, unit.z`: the hairline is high over
/// the forehead, comes down in front of the ears and lowest at the nape.
fn hairline(unit: Vec3) -> f32 {
    let horizontal = (unit.x * unit.x + unit.z * unit.z).sqrt().max(1e-6);
    // 1 at the face, 0 over the ears, -1 at the nape.
    let front = unit.z / horizontal;
    if front > 0.0 {
        let t = smooth(0.15, 0.75, front);
        -0.05 + 0.55 * t
    } else {
        -0.05 - 0.4 * smooth(0.0, 0.8, -front)
    }
}

/// Hermite step from 0 at `a` to 1 at `b`.
pub fn smooth(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Direction `ix` of the R2 sequence (Roberts 2018), which fills the sphere evenly for every prefix.
pub fn even_direction(ix: u32) -> Vec3 {
    let u = (0.5 + R2[0] * f64::from(ix)).fract() as f32;
    let v = (0.5 + R2[1] * f64::from(ix)).fract() as f32;
    let y = 1.0 - 2.0 * v;
    let radius = (1.0 - y * y).max(0.0).sqrt();
    let (sin, cos) = (TAU * u).sin_cos();
    Vec3::new(radius * sin, y, radius * cos)
}

/// `count` roots, evenly spread over the scalp.
///
/// Of a sequence that fills the sphere evenly for every prefix, the first `count`
/// points that lie on the scalp do so on the scalp; a little jitter hides the lattice, and
/// the hairline is frayed by it.
pub fn roots(count: u32, noise: Noise) -> Vec<Root> {
    let mut roots = Vec::with_capacity(count as usize);
    // Spacing of the roots on the unit sphere if they cover about 40 % of it.
    let spacing = (5.0 / count as f32).sqrt();
    let mut ix = 0_u32;
    while roots.len() < count as usize {
        let even = even_direction(ix);
        let jitter = Vec3::new(
            noise.signed(ix, Purpose::RootU, 0),
            noise.signed(ix, Purpose::RootU, 1),
            noise.signed(ix, Purpose::RootU, 2),
        );
        let unit = (even + 0.35 * spacing * jitter).normalize();
        let fray = 0.04 * noise.signed(ix, Purpose::RootV, 0);
        ix += 1;
        if unit.y > hairline(unit) + fray {
            roots.push(Root {
                position: unit * HEAD_RADII,
                normal: (unit / HEAD_RADII).normalize(),
                unit,
            });
        }
    }
    roots
}

/// Moves `point` out of the head grown by `shell` cm, if it is inside.
pub fn push_out(point: Vec3, shell: f32) -> Vec3 {
    let radii = HEAD_RADII + Vec3::splat(shell);
    let scaled = (point / radii).length();
    if scaled < 1.0 {
        point / scaled.max(1e-3)
    } else {
        point
    }
}
