//! Matte surfaces.

use glam::Vec3;

use crate::rays::Start;

/// A point of a proxy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// In the world, cm.
    pub position: Vec3,
    /// Unit vector outwards.
    pub normal: Vec3,
    /// Share of light that is sent back.
    pub albedo: [f64; 3],
}

impl Surface {
    /// Rays leave from here.
    pub fn start(&self) -> Start {
        Start::camera(self.position)
    }

    /// Radiance over the irradiance's radiance: `albedo / pi cos` towards a light, 0 behind the
    /// surface; and the density of [`Surface::draw`] there.
    pub fn sends(&self, towards: Vec3) -> ([f64; 3], f64) {
        let density = f64::from(self.normal.dot(towards)).max(0.0) * std::f64::consts::FRAC_1_PI;
        (self.albedo.map(|albedo| albedo * density), density)
    }

    /// A direction by the cosine, from two numbers in 0..1.
    pub fn draw(&self, [a, b]: [f64; 2]) -> Vec3 {
        let (sin, cos) = (std::f32::consts::TAU * b as f32).sin_cos();
        let (r, z) = (a.sqrt() as f32, (1.0 - a).sqrt() as f32);
        let (x, y) = self.normal.any_orthonormal_pair();
        (x * (r * cos) + y * (r * sin) + self.normal * z).normalize()
    }
}
