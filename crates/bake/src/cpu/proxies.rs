//! Light that the proxies send back, and drawing them. Twin of `shaders/pass/proxy_light.wgsl` and
//! `shaders/pass/proxies.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_runtime::PreparedScene;
use strandlight_runtime::camera::ViewUniform;
use strandlight_runtime::proxy::{
    GROUND, LIGHT_MAP_SIDE, ProxyRecords, entry_distance, is_blocked_by, light_map_place,
    surface_normal, texel_position,
};
use strandlight_runtime::sampling::SAMPLE_POSITIONS;
use strandlight_runtime::scene::LightRecord;
use strandlight_runtime::volume::{Grid, SELF_LIFT};
use strandlight_scattering::closed_form::{PackedRecord, irradiance, unpack_record};

use super::composite::ray_direction;
use super::transmittance::mix;
use super::voxelise::{grid_position, voxel_index};

/// Texels of a light map.
const N_TEXELS: usize = (LIGHT_MAP_SIDE * LIGHT_MAP_SIDE) as usize;

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

    /// Bilinear.
    fn sent_back(&self, proxy: usize, position: Vec3) -> [f32; 3] {
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
        let open = |d: &Vec3| self.normal.dot(*d) > 0.0 && !self.is_behind_other(*d);
        let (mut above, mut n_open) = (0.0, 0.0);
        for d in directions.iter().map(|d| Vec3::from_slice(d)) {
            above += self.normal.dot(d).max(0.0);
            if open(&d) {
                n_open += 1.0;
            }
        }
        if n_open == 0.0 {
            return 0.0;
        }
        let lift = SELF_LIFT * grid.h;
        let mut arriving = 0.0;
        for d in directions.iter().map(|d| Vec3::from_slice(d)).filter(open) {
            let mut share = 1.0;
            if let Some(entry) = entry_of_volume(grid, self.position, d) {
                // Records hold the mean over all directions, none coming through proxies.
                let g = grid_position(grid, self.position + d * (entry + lift));
                let n = directions.len() as f32;
                share = (share_at(grid, packed, g) * n / n_open).min(1.0);
            }
            arriving += self.normal.dot(d) * share;
        }
        arriving / above
    }

    /// Whether another proxy stands before a light.
    fn is_behind_other(&self, direction: Vec3) -> bool {
        let mut others = self.records.list().iter().enumerate();
        others.any(|(ix, proxy)| ix != self.own && is_blocked_by(proxy, self.position, direction))
    }
}

/// Unblocked share in the records of one light.
fn share_at(grid: &Grid, packed: &[PackedRecord], g: Vec3) -> f32 {
    let base = g.as_uvec3();
    let f = g - base.as_vec3();
    let corner = voxel_index(grid, base.to_array());
    let row = grid.dims[0] as usize;
    let above = corner + row * grid.dims[1] as usize;
    let share_of = |at: usize| unpack_record(&packed[at]).shares[0];
    let along_x = |at: usize| mix(share_of(at), share_of(at + 1), f.x);
    mix(
        mix(along_x(corner), along_x(corner + row), f.y),
        mix(along_x(above), along_x(above + row), f.y),
        f.z,
    )
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
