//! What rays meet: hair, and matte things beside it.

use glam::Vec3;
use strandlight_scene::proxy::{
    GROUND, ProxyRecord, entry_distance, from_unit, is_blocked, is_blocked_by, surface_normal,
    to_unit,
};

use crate::rays::{Crossing, Rays, Start};

/// Hair and what stands beside it, as the renderer has it: light from points of the hair inside a
/// proxy is blocked as if they lay on its surface, and the ground is not there to an eye below it.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// The hair.
    pub rays: &'a Rays,
    /// The rest.
    pub proxies: &'a [ProxyRecord],
}

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

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Met {
    /// Nothing.
    Nothing,
    /// A fibre.
    Hair(Crossing),
    /// A proxy.
    Matte(Surface),
}

impl World<'_> {
    /// What a ray from the eye meets.
    pub fn seen(&self, start: &Start, direction: Vec3) -> Met {
        self.first(start, direction, |proxy| {
            let t = entry_distance(proxy, start.position, direction);
            (t > 0.0).then_some(t)
        })
    }

    /// What a ray from a fibre or a surface meets.
    pub fn met(&self, start: &Start, direction: Vec3) -> Met {
        self.first(start, direction, |proxy| {
            // None from inside, where it is met at once.
            let t = entry_distance(proxy, start.position, direction).max(0.0);
            is_blocked_by(proxy, start.position, direction).then_some(t)
        })
    }

    /// Whether anything lies between a fibre or a surface and a light in `direction`.
    pub fn is_blocked(&self, start: &Start, direction: Vec3) -> bool {
        is_blocked(self.proxies, start.position, direction)
            || self.rays.is_blocked(start, direction)
    }

    fn first(
        &self,
        start: &Start,
        direction: Vec3,
        distance: impl Fn(&ProxyRecord) -> Option<f32>,
    ) -> Met {
        let crossing = self.rays.nearest(start, direction);
        let proxies = self.proxies.iter();
        let proxies = proxies.filter_map(|proxy| distance(proxy).map(|t| (t, proxy)));
        let proxy = proxies.min_by(|a, b| a.0.total_cmp(&b.0));
        match (crossing, proxy) {
            (None, None) => Met::Nothing,
            (Some(crossing), None) => Met::Hair(crossing),
            (Some(crossing), Some((t, _))) if crossing.t < t => Met::Hair(crossing),
            (_, Some((t, proxy))) => Met::Matte(surface(proxy, start.position + t * direction)),
        }
    }
}

/// The point of the surface at or above `position`.
fn surface(proxy: &ProxyRecord, position: Vec3) -> Surface {
    let unit = to_unit(proxy, position);
    let unit = if proxy.kind == GROUND {
        Vec3::new(unit.x, 0.0, unit.z)
    } else {
        unit.try_normalize().unwrap_or(Vec3::Y)
    };
    let position = from_unit(proxy, unit);
    Surface {
        position,
        normal: surface_normal(proxy, position),
        albedo: proxy.albedo.map(f64::from),
    }
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
