//! What rays meet: hair, and matte things beside it.

use glam::Vec3;
use strandlight_scene::proxy::{
    GROUND, ProxyRecord, entry_distance, from_unit, is_blocked, is_blocked_by, surface_normal,
    to_unit,
};

use crate::mesh_rays::MeshRays;
use crate::rays::{Crossing, Rays, Start};
use crate::surface::Surface;

/// Hair and what stands beside it, as the renderer has it: light from points of the hair inside a
/// proxy is blocked as if they lay on its surface, and the ground is not there to an eye below it.
#[derive(Clone, Copy)]
pub struct World<'a> {
    /// The hair.
    pub rays: &'a Rays,
    /// The rest, but for the meshes.
    pub proxies: &'a [ProxyRecord],
    /// The meshes.
    pub meshes: &'a [MeshRays],
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
        let of_proxy = |proxy: &ProxyRecord| {
            let t = entry_distance(proxy, start.position, direction);
            (t > 0.0).then_some(t)
        };
        let of_mesh = |mesh: &MeshRays| mesh.seen(start.position, direction);
        self.first(start, direction, of_proxy, of_mesh)
    }

    /// What a ray from a fibre or a surface meets.
    pub fn met(&self, start: &Start, direction: Vec3) -> Met {
        let of_proxy = |proxy: &ProxyRecord| {
            // None from inside, where it is met at once.
            let t = entry_distance(proxy, start.position, direction).max(0.0);
            is_blocked_by(proxy, start.position, direction).then_some(t)
        };
        let of_mesh = |mesh: &MeshRays| mesh.met(start.position, direction);
        self.first(start, direction, of_proxy, of_mesh)
    }

    /// Whether anything lies between a fibre or a surface and a light in `direction`.
    pub fn is_blocked(&self, start: &Start, direction: Vec3) -> bool {
        self.is_blocked_beside(start, direction) || self.rays.is_blocked(start, direction)
    }

    /// Whether a proxy does.
    pub fn is_blocked_beside(&self, start: &Start, direction: Vec3) -> bool {
        let mut meshes = self.meshes.iter();
        is_blocked(self.proxies, start.position, direction)
            || meshes.any(|mesh| mesh.is_blocked(start.position, direction))
    }

    fn first(
        &self,
        start: &Start,
        direction: Vec3,
        distance: impl Fn(&ProxyRecord) -> Option<f32>,
        of_mesh: impl Fn(&MeshRays) -> Option<(f32, Surface)>,
    ) -> Met {
        let crossing = self.rays.nearest(start, direction);
        let proxies = self.proxies.iter();
        let proxies = proxies.filter_map(|proxy| distance(proxy).map(|t| (t, proxy)));
        let proxy = proxies.min_by(|a, b| a.0.total_cmp(&b.0));
        let proxy = proxy.map(|(t, proxy)| (t, surface(proxy, start.position + t * direction)));
        let meshes = self.meshes.iter().filter_map(of_mesh);
        let matte = proxy.into_iter().chain(meshes);
        match (crossing, matte.min_by(|a, b| a.0.total_cmp(&b.0))) {
            (None, None) => Met::Nothing,
            (Some(crossing), None) => Met::Hair(crossing),
            (Some(crossing), Some((t, _))) if crossing.t < t => Met::Hair(crossing),
            (_, Some((_, surface))) => Met::Matte(surface),
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
