//! Opaque, matte things beside the hair: a head, the ground. Twin: `shaders/lib/proxy.wgsl`.
//!
//! - [`Proxy`]: one of them, as a scene has it; meshes are in [`crate::mesh`].
//! - [`ProxyRecords`]: all of a scene, as the passes read them.
//!
//! Light is blocked where a ray towards it meets a proxy. Strands grow from a head's surface, and
//! some of their points lie a little inside by rounding or by design: these count as if they lay
//! on the surface, so that they see the half of the sky above it, neither none nor all of it. The
//! voxels of the shadow volume, whose centres next to a head lie up to their own size inside, are
//! lifted in the same way.
//!
//! Being matte, a proxy looks alike from everywhere: its light is found once, at the texels of a
//! map spread over its surface, and not for every view.

use std::sync::Arc;

use glam::{Quat, Vec3, Vec4};
use strandlight_formats::{MAX_PROXIES, ProxySection};

use crate::mesh::{MeshProxy, MeshShape};
use crate::strands::Strands;

/// Kind of [`ProxyRecord`]: the ground.
#[doc(hidden)]
pub const GROUND: u32 = 1;

/// Texels along each side of a proxy's light map.
#[doc(hidden)]
pub const LIGHT_MAP_SIDE: u32 = 128;

/// What [`entry_distance`] answers where nothing is hit.
pub(crate) const NO_HIT: f32 = -1.0;

/// Something opaque and matte.
#[derive(Clone, Debug, PartialEq)]
pub enum Proxy {
    /// A head, about.
    Ellipsoid {
        /// Its centre, cm.
        centre: Vec3,
        /// Half axes, cm, above zero.
        radii: Vec3,
        /// Turns the axes x, y and z into those of the ellipsoid.
        turn: Quat,
        /// Share of light that it sends back, linear RGB, 0..=1.
        albedo: [f32; 3],
    },
    /// A plane without end. From below it is not there to the eye, but light is blocked.
    Ground {
        /// Its height, cm.
        height: f32,
        /// Share of light that it sends back, linear RGB, 0..=1.
        albedo: [f32; 3],
    },
    /// A head as modelled.
    Mesh(MeshProxy),
}

/// A proxy as the passes read it; mirrored by `Proxy` in `shaders/lib/proxy.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[doc(hidden)]
pub struct ProxyRecord {
    /// Rows of the map from world space to where the ellipsoid is the unit sphere, the shift in
    /// the fourth column. Of the ground: x and z over the width of its light map, y the height
    /// above it in cm.
    pub to_unit: [[f32; 4]; 3],
    /// Rows of the map back.
    pub from_unit: [[f32; 4]; 3],
    /// Linear RGB.
    pub albedo: [f32; 3],
    /// [`GROUND`] or not.
    pub kind: u32,
}

/// All proxies of a scene; mirrored by `Proxies` in `shaders/lib/proxy.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[doc(hidden)]
pub struct ProxyRecords {
    /// The first `n` of these.
    pub list: [ProxyRecord; MAX_PROXIES],
    /// How many there are.
    pub n: u32,
    /// Not used.
    pub pad: [u32; 3],
}

strandlight_scattering::mirrors! {
    ProxyRecord as "Proxy" in "lib/proxy" { to_unit, from_unit, albedo, kind }
    ProxyRecords as "Proxies" in "lib/proxy" { list, n, pad }
}

impl ProxyRecords {
    /// Of `proxies`, the first [`MAX_PROXIES`] that are no meshes. The ground's light map is finest
    /// below `strands`.
    pub fn new(proxies: &[Proxy], strands: &Strands) -> Self {
        let mut records: ProxyRecords = bytemuck::Zeroable::zeroed();
        let own = proxies.iter().filter_map(|proxy| proxy.record(strands));
        for (record, own) in records.list.iter_mut().zip(own) {
            *record = own;
            records.n += 1;
        }
        records
    }

    /// Those there are.
    pub fn list(&self) -> &[ProxyRecord] {
        &self.list[..self.n as usize]
    }
}

impl Proxy {
    /// As a scene file has it, its values within their ranges; of a mesh, with the `shape` that is in
    /// its file. `None` where that is needed and not there.
    pub fn from_section(section: &ProxySection, shape: Option<&Arc<MeshShape>>) -> Option<Proxy> {
        let vector = |v: &[f64; 3]| Vec3::from(v.map(|x| x as f32));
        Some(match section {
            ProxySection::Ellipsoid {
                centre,
                radii,
                tilt_deg,
                albedo,
            } => Proxy::Ellipsoid {
                centre: vector(centre),
                radii: vector(radii),
                turn: Quat::from_rotation_x(tilt_deg.to_radians() as f32),
                albedo: albedo.map(|x| x as f32),
            },
            ProxySection::Ground { height, albedo } => Proxy::Ground {
                height: *height as f32,
                albedo: albedo.map(|x| x as f32),
            },
            ProxySection::Mesh { offset, albedo, .. } => Proxy::Mesh(MeshProxy {
                shape: Arc::clone(shape?),
                offset: vector(offset),
                albedo: albedo.map(|x| x as f32),
            }),
        })
    }

    /// Share of light that it sends back, linear RGB, 0..=1.
    pub fn albedo(&self) -> [f32; 3] {
        match self {
            Proxy::Ellipsoid { albedo, .. } | Proxy::Ground { albedo, .. } => *albedo,
            Proxy::Mesh(mesh) => mesh.albedo,
        }
    }

    /// Share of light that it sends back, linear RGB, 0..=1.
    pub fn albedo_mut(&mut self) -> &mut [f32; 3] {
        match self {
            Proxy::Ellipsoid { albedo, .. } | Proxy::Ground { albedo, .. } => albedo,
            Proxy::Mesh(mesh) => &mut mesh.albedo,
        }
    }

    /// None of a mesh.
    fn record(&self, strands: &Strands) -> Option<ProxyRecord> {
        let with = |v: Vec3, w: f32| [v.x, v.y, v.z, w];
        Some(match *self {
            Proxy::Ellipsoid {
                centre,
                radii,
                turn,
                albedo,
            } => {
                let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| turn * axis);
                let row = |axis: usize| {
                    let row = axes[axis] / radii[axis];
                    with(row, -row.dot(centre))
                };
                let row_back = |axis: usize| {
                    let row = Vec3::new(axes[0][axis], axes[1][axis], axes[2][axis]);
                    with(row * radii, centre[axis])
                };
                ProxyRecord {
                    to_unit: [row(0), row(1), row(2)],
                    from_unit: [row_back(0), row_back(1), row_back(2)],
                    albedo,
                    kind: 0,
                }
            }
            Proxy::Ground { height, albedo } => {
                let width = strands.radius.max(1e-3);
                let [x, _, z] = strands.centre.to_array();
                ProxyRecord {
                    to_unit: [
                        [1.0 / width, 0.0, 0.0, -x / width],
                        [0.0, 1.0, 0.0, -height],
                        [0.0, 0.0, 1.0 / width, -z / width],
                    ],
                    from_unit: [
                        [width, 0.0, 0.0, x],
                        [0.0, 1.0, 0.0, height],
                        [0.0, 0.0, width, z],
                    ],
                    albedo,
                    kind: GROUND,
                }
            }
            Proxy::Mesh(_) => return None,
        })
    }
}

fn dot(row: &[f32; 4], v: Vec4) -> f32 {
    Vec4::from(*row).dot(v)
}

/// Where `position` lies seen from the proxy; see [`ProxyRecord::to_unit`].
#[doc(hidden)]
pub fn to_unit(proxy: &ProxyRecord, position: Vec3) -> Vec3 {
    let p = position.extend(1.0);
    Vec3::from(proxy.to_unit.map(|row| dot(&row, p)))
}

/// [`to_unit`] of a direction.
pub(crate) fn turned_to_unit(proxy: &ProxyRecord, direction: Vec3) -> Vec3 {
    let d = direction.extend(0.0);
    Vec3::from(proxy.to_unit.map(|row| dot(&row, d)))
}

/// The inverse of [`to_unit`].
#[doc(hidden)]
pub fn from_unit(proxy: &ProxyRecord, unit: Vec3) -> Vec3 {
    let p = unit.extend(1.0);
    Vec3::from(proxy.from_unit.map(|row| dot(&row, p)))
}

/// Whether the proxy stands before a light in `direction`. Points inside it count as if they lay
/// on its surface.
#[doc(hidden)]
pub fn is_blocked_by(proxy: &ProxyRecord, position: Vec3, direction: Vec3) -> bool {
    if proxy.kind == GROUND {
        return direction.y < 0.0;
    }
    let q = to_unit(proxy, position);
    let e = turned_to_unit(proxy, direction);
    let b = q.dot(e);
    b < 0.0 && b * b > e.dot(e) * (q.dot(q) - 1.0)
}

/// Distance along a unit direction to the surface, from outside; `NO_HIT` where there is none.
#[doc(hidden)]
pub fn entry_distance(proxy: &ProxyRecord, origin: Vec3, direction: Vec3) -> f32 {
    let q = to_unit(proxy, origin);
    let e = turned_to_unit(proxy, direction);
    if proxy.kind == GROUND {
        let is_hit = q.y > 0.0 && e.y < 0.0;
        return if is_hit {
            q.y / (-e.y).max(1e-20)
        } else {
            NO_HIT
        };
    }
    let b = q.dot(e);
    let a = e.dot(e);
    // Not q^2 - 1: the part of q across the ray, which does not cancel far away.
    let across = q - e * (b / a);
    let square = (1.0 - across.dot(across)) * a;
    if q.dot(q) > 1.0 && b < 0.0 && square > 0.0 {
        (-b - square.sqrt()) / a
    } else {
        NO_HIT
    }
}

/// Unit normal, outwards, at a point on the surface.
#[doc(hidden)]
pub fn surface_normal(proxy: &ProxyRecord, position: Vec3) -> Vec3 {
    if proxy.kind == GROUND {
        return Vec3::Y;
    }
    let q = to_unit(proxy, position);
    let row = |ix: usize| Vec3::from_slice(&proxy.to_unit[ix]);
    (row(0) * q.x + row(1) * q.y + row(2) * q.z).normalize()
}

/// The point of the surface in the middle of a texel (column, row) of the light map. Rows go from
/// the top of an ellipsoid to its bottom, columns around it; the ground's go to infinity on all
/// sides.
#[doc(hidden)]
pub fn texel_position(proxy: &ProxyRecord, texel: [u32; 2]) -> Vec3 {
    let [x, y] = texel.map(|at| (at as f32 + 0.5) / LIGHT_MAP_SIDE as f32);
    if proxy.kind == GROUND {
        let far = [x, y].map(|at| {
            let w = 2.0 * at - 1.0;
            w / (1.0 - w.abs())
        });
        return from_unit(proxy, Vec3::new(far[0], 0.0, far[1]));
    }
    let (azimuth, polar) = (std::f32::consts::TAU * x, std::f32::consts::PI * y);
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    let (sin_polar, cos_polar) = polar.sin_cos();
    let unit = Vec3::new(sin_polar * sin_azimuth, cos_polar, sin_polar * cos_azimuth);
    from_unit(proxy, unit)
}

/// The place of a point of the surface in the light map, texels from the corner.
#[doc(hidden)]
pub fn light_map_place(proxy: &ProxyRecord, position: Vec3) -> [f32; 2] {
    let q = to_unit(proxy, position);
    if proxy.kind == GROUND {
        let place = |q: f32| (0.5 * q / (1.0 + q.abs()) + 0.5) * LIGHT_MAP_SIDE as f32;
        return [place(q.x), place(q.z)];
    }
    let azimuth = q.x.atan2(q.z) / std::f32::consts::TAU;
    let polar = (q.y / q.length()).clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
    [azimuth - azimuth.floor(), polar].map(|at| at * LIGHT_MAP_SIDE as f32)
}

/// Whether any of `proxies` stands before a light in `direction`.
#[doc(hidden)]
pub fn is_blocked(proxies: &[ProxyRecord], position: Vec3, direction: Vec3) -> bool {
    let mut proxies = proxies.iter();
    proxies.any(|proxy| is_blocked_by(proxy, position, direction))
}

/// The first proxy along a unit direction from outside, and its distance.
#[doc(hidden)]
pub fn nearest(proxies: &[ProxyRecord], origin: Vec3, direction: Vec3) -> Option<(usize, f32)> {
    let hits = proxies.iter().enumerate().filter_map(|(ix, proxy)| {
        let t = entry_distance(proxy, origin, direction);
        (t > 0.0).then_some((ix, t))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head() -> ProxyRecord {
        let head = Proxy::Ellipsoid {
            centre: Vec3::new(1.0, -2.0, 3.0),
            radii: Vec3::new(7.5, 11.5, 9.5),
            turn: Quat::from_rotation_x(0.4),
            albedo: [0.3; 3],
        };
        head.record(&Strands::default()).expect("no mesh")
    }

    fn ground() -> ProxyRecord {
        let mut strands = Strands::default();
        strands.centre = Vec3::new(2.0, 0.0, -1.0);
        strands.radius = 20.0;
        let ground = Proxy::Ground {
            height: -30.0,
            albedo: [0.2; 3],
        };
        ground.record(&strands).expect("no mesh")
    }

    #[test]
    fn texels_lie_on_the_surface_and_find_their_place_again() {
        for proxy in [head(), ground()] {
            for (x, y) in (0..LIGHT_MAP_SIDE).flat_map(|x| (0..128).map(move |y| (x, y))) {
                let position = texel_position(&proxy, [x, y]);
                let q = to_unit(&proxy, position);
                if proxy.kind == GROUND {
                    assert!(q.y.abs() < 1e-5);
                } else {
                    assert!((q.length() - 1.0).abs() < 1e-5);
                }
                let place = light_map_place(&proxy, position);
                assert!((place[0] - x as f32 - 0.5).abs() < 2e-2, "{x} {place:?}");
                assert!((place[1] - y as f32 - 0.5).abs() < 2e-2, "{y} {place:?}");
            }
        }
    }

    #[test]
    fn points_on_and_in_a_head_see_the_half_of_the_sky_above_its_surface() {
        let proxy = head();
        for texel in [[3, 40], [64, 64], [100, 20]] {
            let on = texel_position(&proxy, texel);
            let normal = surface_normal(&proxy, on);
            let inside = Vec3::new(1.0, -2.0, 3.0).lerp(on, 0.9);
            for position in [on, inside] {
                let mut n_open = 0;
                for ix in 0..1000 {
                    let z = -1.0 + (ix as f32 + 0.5) / 500.0;
                    let (sin, cos) = (2.4 * ix as f32).sin_cos();
                    let r = (1.0 - z * z).sqrt();
                    let direction = Vec3::new(r * cos, r * sin, z);
                    let is_open = !is_blocked_by(&proxy, position, direction);
                    n_open += i32::from(is_open);
                    let cos = normal.dot(direction);
                    assert!(
                        cos.abs() < 1e-3 || is_open == (cos > 0.0),
                        "{cos} {is_open}"
                    );
                }
                assert!((n_open - 500).abs() < 5, "{n_open}");
            }
        }
    }

    #[test]
    fn rays_end_on_the_surface_or_are_not_blocked() {
        let proxies = [head(), ground()];
        let (mut n_hits, mut n_misses) = (0, 0);
        for ix in 0..2000 {
            let (sin, cos) = (2.4 * ix as f32).sin_cos();
            let eye = Vec3::new(60.0 * cos, 5.0, 60.0 * sin);
            let target = Vec3::new(0.01 * ix as f32 - 10.0, 20.0 - 0.02 * ix as f32, 0.0);
            let direction = (target - eye).normalize();
            match nearest(&proxies, eye, direction) {
                Some((ix, t)) => {
                    n_hits += 1;
                    let q = to_unit(&proxies[ix], eye + t * direction);
                    let off = if ix == 1 { q.y } else { q.length() - 1.0 };
                    assert!(off.abs() < 1e-4, "{off}");
                    assert!(is_blocked(&proxies, eye, direction));
                }
                None => {
                    n_misses += 1;
                    assert!(!is_blocked(&proxies, eye, direction));
                }
            }
        }
        assert!(n_hits > 500 && n_misses > 500, "{n_hits} {n_misses}");
        let from_below = entry_distance(&ground(), Vec3::new(0.0, -40.0, 0.0), Vec3::NEG_Y);
        assert_eq!(from_below, NO_HIT);
    }
}
