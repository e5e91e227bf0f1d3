//! Light that the proxies send back, and drawing them. Twin of `shaders/pass/proxy_light.wgsl` and
//! `shaders/pass/proxies.wgsl`.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::{UVec3, Vec3};
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, irradiance, unpack_record};
use strandlight_scene::PreparedScene;
use strandlight_scene::beside::{Beside, Places, Surface, Towards};
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::mesh::barycentric;
use strandlight_scene::proxy::{GROUND, LIGHT_MAP_SIDE, entry_distance, light_map_place};
use strandlight_scene::sampling::SAMPLE_POSITIONS;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::transmittance::mix;
use super::triangles::Triangles;
use super::voxelise::{grid_position, voxel_index};
use strandlight_scene::background::ray_direction;

/// Texels of a light map.
const N_TEXELS: usize = (LIGHT_MAP_SIDE * LIGHT_MAP_SIDE) as usize;

/// What directions at or below the horizon weigh, so that there is a mean where all of them are.
const LEAST_COSINE: f32 = 1e-3;

/// How far above the surface records are looked up where none beside it sees the light, voxels: a
/// wide light is seen a little beyond the horizon of its middle.
const HIGHER: f32 = 3.0;

/// Depths are kept off the far plane, which is the background.
const LARGEST_DEPTH: f32 = 0.999_999_9;

/// The proxies of a scene, and the light that they send back.
pub(super) struct Proxies {
    beside: Beside,
    /// First vertex of each mesh, after the texels of the light maps.
    first_vertices: Vec<usize>,
    /// `[proxy][row][column]`, then `[mesh][vertex]`: rgb, times the view's radiance scale.
    sent_back: Vec<[f32; 3]>,
    /// The meshes as the view of the last picture sees them.
    triangles: Option<Triangles>,
}

/// What the samples of a pixel meet.
pub(super) struct Covered {
    /// Bits of the samples.
    pub mask: u32,
    /// 0..1 between the near and far planes.
    pub depth: f32,
    /// Radiance and 1.
    pub color: [f32; 4],
}

impl Proxies {
    /// Those of `scene`, without light.
    pub fn new(scene: &PreparedScene) -> Self {
        Proxies::of(scene.beside())
    }

    /// No proxies.
    #[cfg(test)]
    pub fn none() -> Self {
        Proxies::of(Beside::none())
    }

    fn of(beside: Beside) -> Self {
        let mut n = beside.records().n as usize * N_TEXELS;
        let mut first_vertices = Vec::new();
        for mesh in beside.meshes() {
            first_vertices.push(n);
            n += mesh.shape.mesh.positions.len();
        }
        Proxies {
            beside,
            first_vertices,
            sent_back: vec![[0.0; 3]; n],
            triangles: None,
        }
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.beside.is_empty()
    }

    /// Takes the view that [`Proxies::cover`] and [`Proxies::sent_back`] are asked of.
    pub fn look(&mut self, view: &ViewUniform) {
        self.triangles = Some(Triangles::new(view, &self.beside));
    }

    /// Adds a batch of lights; `packed` are its records `[light][voxel]`, `voxels` the places of the
    /// voxels.
    pub fn light(
        &mut self,
        view: &ViewUniform,
        grid: &Grid,
        lights: &[LightRecord],
        sweeps: &[[f32; 4]],
        packed: &[PackedRecord],
        voxels: &Places,
    ) {
        let beside = &self.beside;
        let surfaces = beside.surfaces();
        let places = &beside.places(surfaces.iter().map(|surface| surface.position));
        let n_voxels = grid.n_voxels();
        let mut n_open: Vec<AtomicU8> = Vec::new();
        // Maps of all lights would be many bytes.
        for (light, packed) in lights.iter().zip(packed.chunks_exact(n_voxels)) {
            if light.power <= 0.0 {
                continue;
            }
            let first = light.first_sweep as usize;
            let directions = &sweeps[first..first + light.n_sweeps as usize];
            let towards: Vec<Towards> = directions
                .par_iter()
                .map(|d| beside.towards(Vec3::from_slice(d)))
                .collect();
            n_open.clear();
            n_open.resize_with(n_voxels, || AtomicU8::new(UNKNOWN));
            let from = From {
                grid,
                towards: &towards,
                packed,
                voxels,
                n_open: &n_open,
            };
            self.sent_back
                .par_iter_mut()
                .zip(&surfaces)
                .enumerate()
                .with_min_len(64)
                .for_each(|(ix, (sum, surface))| {
                    let left = from.share_of_light(surface, places, ix);
                    let cos = surface.normal.dot(Vec3::from(light.direction));
                    let arriving = irradiance(cos, light.lambda) * left;
                    for (channel, sum) in sum.iter_mut().enumerate() {
                        // 1 / pi
                        let sent_back = surface.albedo[channel] * 0.318_309_87;
                        *sum += sent_back * light.rgb[channel] * arriving * view.radiance_scale;
                    }
                });
        }
    }

    /// What the four samples of a pixel meet of each proxy, in order, with the picture shifted by
    /// `jitter` (1/256 px).
    pub fn cover(
        &self,
        view: &ViewUniform,
        pixel: [i32; 2],
        jitter: [i32; 2],
    ) -> impl Iterator<Item = Covered> {
        let eye = Vec3::from(view.eye);
        let rays = SAMPLE_POSITIONS.map(|at| {
            let [x, y] = [0, 1].map(|axis: usize| {
                pixel[axis] as f32 + at[axis] as f32 / 256.0 - jitter[axis] as f32 * (1.0 / 256.0)
            });
            ray_direction(view, x, y)
        });
        let analytic = (0..self.beside.records().n).filter_map(move |proxy| {
            let (mut mask, mut n, mut way) = (0, 0.0, Vec3::ZERO);
            let record = &self.beside.records().list[proxy as usize];
            for (sample, &direction) in rays.iter().enumerate() {
                let distance = entry_distance(record, eye, direction);
                if distance > 0.0 {
                    mask |= 1 << sample;
                    n += 1.0;
                    way += distance * direction;
                }
            }
            if mask == 0 {
                return None;
            }
            way /= n;
            let [r, g, b] = self.sent_back(proxy, eye + way);
            let z = (way.dot(Vec3::from(view.forward)) - view.near) / (view.far - view.near);
            Some(Covered {
                mask,
                depth: z.clamp(0.0, LARGEST_DEPTH),
                color: [r, g, b, 1.0],
            })
        });
        let n_records = self.beside.records().n;
        let of_meshes = (0..rays.len()).filter_map(move |sample| {
            let triangles = self.triangles.as_ref()?;
            let at = SAMPLE_POSITIONS[sample];
            let at = [0, 1].map(|axis: usize| {
                pixel[axis] as f32 + (at[axis] - jitter[axis]) as f32 * (1.0 / 256.0)
            });
            let hit = triangles.nearest(pixel.map(|n| n.max(0) as u32), at)?;
            let direction = rays[sample];
            let along = hit.depth / direction.dot(Vec3::from(view.forward));
            let [r, g, b] = self.sent_back(n_records + hit.triangle, eye + along * direction);
            let z = (hit.depth - view.near) / (view.far - view.near);
            Some(Covered {
                mask: 1 << sample,
                depth: z.clamp(0.0, LARGEST_DEPTH),
                color: [r, g, b, 1.0],
            })
        });
        analytic.chain(of_meshes)
    }

    /// Radiance that a proxy, or from their number on a triangle of the meshes, sends back at a
    /// place on it: bilinear over its light map, or linear over the triangle.
    pub fn sent_back(&self, surface: u32, position: Vec3) -> [f32; 3] {
        let n_records = self.beside.records().n;
        if surface >= n_records {
            return self.sent_back_by_triangle(surface - n_records, position);
        }
        let proxy = surface as usize;
        let at = light_map_place(&self.beside.records().list[proxy], position).map(|x| x - 0.5);
        let base = at.map(f32::floor);
        let f = [at[0] - base[0], at[1] - base[1]];
        let (x, y) = (base[0] as i32, base[1] as i32);
        let row = |y| {
            let [a, b] = [x, x + 1].map(|x| self.texel(proxy, x, y));
            [0, 1, 2].map(|channel: usize| mix(a[channel], b[channel], f[0]))
        };
        let (a, b) = (row(y), row(y + 1));
        [0, 1, 2].map(|channel: usize| mix(a[channel], b[channel], f[1]))
    }

    fn sent_back_by_triangle(&self, triangle: u32, position: Vec3) -> [f32; 3] {
        let (mesh, triangle) = of_mesh(&self.beside, triangle);
        let first = self.first_vertices[mesh];
        let mesh = &self.beside.meshes()[mesh];
        let shares = barycentric(mesh.corners(triangle), position);
        let corners = mesh.shape.mesh.triangles[triangle];
        let colors = corners.map(|corner| self.sent_back[first + corner as usize]);
        [0, 1, 2].map(|channel: usize| (0..3).map(|ix| shares[ix] * colors[ix][channel]).sum())
    }

    fn texel(&self, proxy: usize, column: i32, row: i32) -> [f32; 3] {
        let side = LIGHT_MAP_SIDE as i32;
        // Around an ellipsoid; the ground's outermost texels are far away.
        let x = if self.beside.records().list[proxy].kind == GROUND {
            column.clamp(0, side - 1)
        } else {
            (column + side) % side
        };
        let y = row.clamp(0, side - 1);
        self.sent_back[proxy * N_TEXELS + (y * side + x) as usize]
    }
}

/// Mesh and triangle of it that are number `triangle` of all.
fn of_mesh(beside: &Beside, mut triangle: u32) -> (usize, usize) {
    for (ix, mesh) in beside.meshes().iter().enumerate() {
        let n = mesh.shape.mesh.triangles.len() as u32;
        if triangle < n {
            return (ix, triangle as usize);
        }
        triangle -= n;
    }
    (0, 0)
}

/// A light, and what it passes on its way to the proxies.
struct From<'a> {
    grid: &'a Grid,
    /// By direction of the light.
    towards: &'a [Towards<'a>],
    /// By voxel.
    packed: &'a [PackedRecord],
    voxels: &'a Places,
    /// By voxel, from how many directions light comes by the proxies; [`UNKNOWN`] until it is asked.
    n_open: &'a [AtomicU8],
}

/// More directions than a light has.
const UNKNOWN: u8 = u8::MAX;

impl From<'_> {
    /// How much of a light's irradiance in the open there is on `surface`, number `ix` of `places`.
    fn share_of_light(&self, surface: &Surface, places: &Places, ix: usize) -> f32 {
        let lift = SELF_LIFT * self.grid.h;
        let mut inside = None;
        let (mut above, mut arriving) = (0.0, 0.0);
        for towards in self.towards {
            let d = towards.direction();
            let weight = surface.normal.dot(d).max(LEAST_COSINE);
            above += weight;
            if towards.is_behind_other(surface, places, ix) {
                continue;
            }
            let share_at = |position: Vec3| self.share_at(grid_position(self.grid, position));
            let share = match entry_of_volume(self.grid, surface.position, d) {
                None => 1.0,
                // The same place for all directions.
                Some(0.0) => *inside.get_or_insert_with(|| {
                    [lift, HIGHER * self.grid.h]
                        .iter()
                        .find_map(|&height| share_at(surface.position + surface.normal * height))
                        .unwrap_or(0.0)
                }),
                Some(entry) => share_at(surface.position + d * entry).unwrap_or(0.0),
            };
            arriving += weight * share;
        }
        arriving / above.max(LEAST_COSINE)
    }

    /// Directions of the light that no proxy blocks at a voxel.
    fn n_open(&self, voxel: UVec3) -> f32 {
        let ix = voxel_index(self.grid, voxel.to_array());
        let known = self.n_open[ix].load(Ordering::Relaxed);
        if known != UNKNOWN {
            return f32::from(known);
        }
        let centre = self.grid.centre(voxel.to_array());
        let is_open = |towards: &&Towards| !towards.is_blocked(self.voxels, ix, centre);
        // Some at most: `MAX_DIRECTIONS`.
        let n = self.towards.iter().filter(is_open).count() as u8;
        self.n_open[ix].store(n, Ordering::Relaxed);
        f32::from(n)
    }

    /// Share that hair leaves of the light, by its records around `g`. They hold the mean over all
    /// directions, none coming through proxies, and each voxel has a horizon of its own: voxels count
    /// by the directions that are open there, those without any not at all.
    fn share_at(&self, g: Vec3) -> Option<f32> {
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        let (mut sum, mut weights) = (0.0, 0.0);
        for corner in 0..8_u32 {
            let offset = UVec3::new(corner & 1, (corner >> 1) & 1, corner >> 2);
            let voxel = base + offset;
            let n_open = self.n_open(voxel);
            if n_open > 0.0 {
                let w = Vec3::select(offset.cmpeq(UVec3::ONE), f, 1.0 - f);
                let weight = w.x * w.y * w.z;
                let record = unpack_record(&self.packed[voxel_index(self.grid, voxel.to_array())]);
                sum += weight * record.shares[0] * (self.towards.len() as f32 / n_open);
                weights += weight;
            }
        }
        (weights > 0.0).then(|| (sum / f32::max(weights, 1e-20)).min(1.0))
    }
}

/// How far along a ray the middles of the outer voxels are reached.
fn entry_of_volume(grid: &Grid, position: Vec3, direction: Vec3) -> Option<f32> {
    let tiny = direction.abs().cmplt(Vec3::splat(1e-8));
    let d = Vec3::select(tiny, Vec3::splat(1e-8), direction);
    let origin = Vec3::from(grid.origin);
    let dims = Vec3::from(grid.dims.map(|n| n as f32));
    let low = (origin + 0.5 * grid.h - position) / d;
    let high = (origin + (dims - 0.5) * grid.h - position) / d;
    let entry = low.min(high).max_element().max(0.0);
    (entry < low.max(high).min_element()).then_some(entry)
}
