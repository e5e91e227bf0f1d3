//! The proxies as pictures show them. Twin of `shaders/pass/proxies.wgsl`.

use glam::Vec3;
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scene::PreparedScene;
use strandlight_scene::background::ray_direction;
use strandlight_scene::beside::Beside;
use strandlight_scene::bounce::PassedWeights;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::proxy::{GROUND, LIGHT_MAP_SIDE, entry_distance, light_map_place};
use strandlight_scene::sampling::SAMPLE_POSITIONS;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::Grid;

use super::proxy_light::Surfaces;
use super::transmittance::mix;
use super::triangles::{Triangles, corner_shares, of_mesh};

/// Texels of a light map.
const N_TEXELS: usize = (LIGHT_MAP_SIDE * LIGHT_MAP_SIDE) as usize;

/// Depths are kept off the far plane, which is the background.
const LARGEST_DEPTH: f32 = 0.999_999_9;

/// The proxies of a scene, and the light that they send back.
#[derive(Clone)]
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

    /// What is sent back at each of [`Beside::surfaces`]: rgb, times the view's radiance scale.
    pub fn at_surfaces(&self) -> &[[f32; 3]] {
        &self.sent_back
    }

    /// [`Proxies::at_surfaces`], to be added to.
    pub fn at_surfaces_mut(&mut self) -> &mut [[f32; 3]] {
        &mut self.sent_back
    }

    /// The sum of it.
    pub fn total(&self) -> [f32; 3] {
        let mut sums = [0.0; 3];
        for sent_back in &self.sent_back {
            for (sum, value) in sums.iter_mut().zip(sent_back) {
                *sum += value;
            }
        }
        sums
    }

    /// Takes the view that [`Proxies::cover`] and [`Proxies::sent_back`] are asked of.
    pub fn look(&mut self, view: &ViewUniform) {
        self.triangles = Some(Triangles::new(view, &self.beside));
    }

    /// Adds a batch of lights; of voxels are its records and [from how many directions](super::transmittance::Swept::n_open) light
    /// comes, `[light][voxel]`.
    pub fn light(
        &mut self,
        (view, passed): (&ViewUniform, &PassedWeights),
        (grid, volume): (&Grid, &[[f32; 8]]),
        lights: &[LightRecord],
        sweeps: &[[f32; 4]],
        (packed, n_open): (&[PackedRecord], &[u8]),
    ) {
        if self.beside.is_empty() {
            return;
        }
        let surfaces = Surfaces::new(&self.beside, grid, volume);
        let n = grid.n_voxels();
        let of_lights = packed.chunks_exact(n).zip(n_open.chunks_exact(n));
        // Irradiance of all lights would be many bytes.
        for (light, of_voxels) in lights.iter().zip(of_lights) {
            if light.power > 0.0 {
                let of_light = (light, sweeps);
                let arriving = surfaces.irradiance((&self.beside, &[]), grid, of_light, of_voxels);
                self.add(&surfaces, (view, passed), light.rgb, &arriving);
            }
        }
    }

    /// Adds a light of which so much is arriving, by surface, for an amplitude of 1.
    pub fn add(
        &mut self,
        surfaces: &Surfaces,
        (view, passed): (&ViewUniform, &PassedWeights),
        rgb: [f32; 3],
        arriving: &[[f32; 3]],
    ) {
        let surfaces = surfaces.list().iter().zip(arriving);
        for (sum, (surface, arriving)) in self.sent_back.iter_mut().zip(surfaces) {
            for (channel, sum) in sum.iter_mut().enumerate() {
                // 1 / pi
                let sent_back = surface.albedo[channel] * 0.318_309_87;
                let [a, b, c, _] = passed[channel];
                let arriving = a * arriving[0] + b * arriving[1] + c * arriving[2];
                *sum += sent_back * rgb[channel] * arriving * view.radiance_scale;
            }
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
            let triangle = surface - n_records;
            let shares = corner_shares(&self.beside, triangle, position);
            return self.sent_back_by_triangle(triangle, shares);
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

    /// [`Proxies::sent_back`] where the [`corner_shares`] of a place on a triangle are known.
    pub fn sent_back_from(
        &self,
        surface: u32,
        position: Vec3,
        shares: impl FnOnce() -> [f32; 3],
    ) -> [f32; 3] {
        match surface.checked_sub(self.beside.records().n) {
            Some(triangle) => self.sent_back_by_triangle(triangle, shares()),
            None => self.sent_back(surface, position),
        }
    }

    fn sent_back_by_triangle(&self, triangle: u32, shares: [f32; 3]) -> [f32; 3] {
        let (mesh, triangle) = of_mesh(&self.beside, triangle);
        let first = self.first_vertices[mesh];
        let corners = self.beside.meshes()[mesh].shape.mesh.triangles[triangle];
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
