//! Light that the proxies send back, and drawing them. Twin of `shaders/pass/proxy_light.wgsl` and
//! `shaders/pass/proxies.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, irradiance, unpack_record};
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::proxy::{
    GROUND, LIGHT_MAP_SIDE, ProxyRecords, entry_distance, is_blocked, is_blocked_by,
    light_map_place, surface_normal, texel_position,
};
use strandlight_scene::sampling::SAMPLE_POSITIONS;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::{Grid, SELF_LIFT};

use super::transmittance::mix;
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
    records: ProxyRecords,
    /// `[proxy][row][column]` rgb, times the view's radiance scale.
    light_maps: Vec<[f32; 3]>,
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
        let records = scene.proxy_records();
        Proxies {
            light_maps: vec![[0.0; 3]; records.n as usize * N_TEXELS],
            records,
        }
    }

    /// No proxies.
    #[cfg(test)]
    pub fn none() -> Self {
        Proxies {
            records: bytemuck::Zeroable::zeroed(),
            light_maps: Vec::new(),
        }
    }

    /// Is there none?
    pub fn is_empty(&self) -> bool {
        self.records.n == 0
    }

    /// Adds a batch of lights; `packed` are its records `[light][voxel]`.
    pub fn light(
        &mut self,
        view: &ViewUniform,
        grid: &Grid,
        lights: &[LightRecord],
        sweeps: &[[f32; 4]],
        packed: &[PackedRecord],
    ) {
        let records = &self.records;
        self.light_maps
            .par_iter_mut()
            .enumerate()
            .for_each(|(ix, sum)| {
                let (own, texel) = (ix / N_TEXELS, (ix % N_TEXELS) as u32);
                let proxy = &records.list[own];
                let texel = [texel % LIGHT_MAP_SIDE, texel / LIGHT_MAP_SIDE];
                let position = texel_position(proxy, texel);
                let normal = surface_normal(proxy, position);
                let place = Place {
                    records,
                    own,
                    position,
                    normal,
                };
                let lights = lights.iter().zip(packed.chunks_exact(grid.n_voxels()));
                for (light, packed) in lights {
                    let left = place.share_of_light(grid, light, sweeps, packed);
                    let cos = normal.dot(Vec3::from(light.direction));
                    let arriving = irradiance(cos, light.lambda) * left;
                    for (channel, sum) in sum.iter_mut().enumerate() {
                        // 1 / pi
                        let sent_back = proxy.albedo[channel] * 0.318_309_87;
                        *sum += sent_back * light.rgb[channel] * arriving * view.radiance_scale;
                    }
                }
            });
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
        (0..self.records.n as usize).filter_map(move |proxy| {
            let (mut mask, mut n, mut way) = (0, 0.0, Vec3::ZERO);
            for (sample, &direction) in rays.iter().enumerate() {
                let distance = entry_distance(&self.records.list[proxy], eye, direction);
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
        })
    }

    /// Radiance that proxy number `proxy` sends back at a place on it, bilinear.
    pub fn sent_back(&self, proxy: usize, position: Vec3) -> [f32; 3] {
        let at = light_map_place(&self.records.list[proxy], position).map(|x| x - 0.5);
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

    fn texel(&self, proxy: usize, column: i32, row: i32) -> [f32; 3] {
        let side = LIGHT_MAP_SIDE as i32;
        // Around an ellipsoid; the ground's outermost texels are far away.
        let x = if self.records.list[proxy].kind == GROUND {
            column.clamp(0, side - 1)
        } else {
            (column + side) % side
        };
        let y = row.clamp(0, side - 1);
        self.light_maps[proxy * N_TEXELS + (y * side + x) as usize]
    }
}

/// A texel of a light map in the world.
struct Place<'a> {
    records: &'a ProxyRecords,
    own: usize,
    position: Vec3,
    normal: Vec3,
}

impl Place<'_> {
    /// How much of a light's irradiance in the open is there.
    fn share_of_light(
        &self,
        grid: &Grid,
        light: &LightRecord,
        sweeps: &[[f32; 4]],
        packed: &[PackedRecord],
    ) -> f32 {
        let first = light.first_sweep as usize;
        let directions = &sweeps[first..first + light.n_sweeps as usize];
        let lift = SELF_LIFT * grid.h;
        let mut inside = None;
        let (mut above, mut arriving) = (0.0, 0.0);
        for d in directions.iter().map(|d| Vec3::from_slice(d)) {
            let weight = self.normal.dot(d).max(LEAST_COSINE);
            above += weight;
            if self.is_behind_other(d) {
                continue;
            }
            let share_at = |position: Vec3| {
                let g = grid_position(grid, position);
                share_at(grid, self.records, directions, packed, g)
            };
            let share = match entry_of_volume(grid, self.position, d) {
                None => 1.0,
                // The same place for all directions.
                Some(0.0) => *inside.get_or_insert_with(|| {
                    [lift, HIGHER * grid.h]
                        .iter()
                        .find_map(|&height| share_at(self.position + self.normal * height))
                        .unwrap_or(0.0)
                }),
                Some(entry) => share_at(self.position + d * entry).unwrap_or(0.0),
            };
            arriving += weight * share;
        }
        arriving / above.max(LEAST_COSINE)
    }

    /// Whether another proxy stands before a light.
    fn is_behind_other(&self, direction: Vec3) -> bool {
        let mut others = self.records.list().iter().enumerate();
        others.any(|(ix, proxy)| ix != self.own && is_blocked_by(proxy, self.position, direction))
    }
}

/// Directions of a light that no proxy blocks at a place.
fn count_open(records: &ProxyRecords, directions: &[[f32; 4]], position: Vec3) -> f32 {
    let directions = directions.iter().map(|d| Vec3::from_slice(d));
    let open = directions.filter(|&d| !is_blocked(records.list(), position, d));
    open.count() as f32
}

/// Share that hair leaves of a light, by its records around `g`. They hold the mean over all
/// directions, none coming through proxies, and each voxel has a horizon of its own: voxels count
/// by the directions that are open there, those without any not at all.
fn share_at(
    grid: &Grid,
    records: &ProxyRecords,
    directions: &[[f32; 4]],
    packed: &[PackedRecord],
    g: Vec3,
) -> Option<f32> {
    let base = g.as_uvec3();
    let f = g - base.as_vec3();
    let (mut sum, mut weights) = (0.0, 0.0);
    for corner in 0..8_u32 {
        let offset = glam::UVec3::new(corner & 1, (corner >> 1) & 1, corner >> 2);
        let voxel = base + offset;
        let centre = Vec3::from(grid.origin) + (voxel.as_vec3() + 0.5) * grid.h;
        let n_open = count_open(records, directions, centre);
        if n_open > 0.0 {
            let w = Vec3::select(offset.cmpeq(glam::UVec3::ONE), f, 1.0 - f);
            let weight = w.x * w.y * w.z;
            let record = unpack_record(&packed[voxel_index(grid, voxel.to_array())]);
            sum += weight * record.shares[0] * (directions.len() as f32 / n_open);
            weights += weight;
        }
    }
    (weights > 0.0).then(|| (sum / f32::max(weights, 1e-20)).min(1.0))
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
