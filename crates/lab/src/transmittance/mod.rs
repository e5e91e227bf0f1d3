//! Ways to find what hair leaves of a light, behind one interface, to be measured side by side.
//!
//! [`Method::Sweep`] is what the renderer does. The others are baselines on the CPU; they answer
//! at the points where the renderer looks its records up. [`ShadowBuilder`] holds what does not
//! depend on the light, [`LightShadows`] what one light needs; every answer is a [`ShadowRecord`],
//! shares `E exp(-p tau)` at three exponents p, so all are shaded and measured alike.

mod convolution;
mod deep_opacity;
mod forward_map;
mod light_map;
mod optical_depth;
mod ray;

use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, ShadowRecord, pack_record};
use strandlight_scene::PreparedScene;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::strands::Strands;
use strandlight_scene::volume::{Grid, lobe_directions};

use convolution::ConvolutionMap;
use deep_opacity::DeepOpacityMap;
use forward_map::ForwardMap;
pub use ray::{Transmitted, ray_record, ray_shares};
use strandlight_cpu as cpu;
use strandlight_reference::rays::Rays;

/// How the transmittance of lights is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Shares swept through a voxel volume, as on the GPU.
    #[default]
    Sweep,
    /// Rays from every point along directions of the light's lobe.
    Ray,
    /// Zinke's forward scattering maps: rays from the light's centre, averaged in voxels.
    ForwardMap,
    /// Deep opacity maps from the light's centre (Yuksel and Keyser 2008).
    DeepOpacity,
    /// Ren's convolution optical depth map with summed-area tables.
    Codm,
}

impl Method {
    /// All of them.
    pub const ALL: [Method; 5] = [
        Method::Sweep,
        Method::Ray,
        Method::ForwardMap,
        Method::DeepOpacity,
        Method::Codm,
    ];

    /// Name on command lines and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Method::Sweep => "sweep",
            Method::Ray => "ray",
            Method::ForwardMap => "forward-map",
            Method::DeepOpacity => "deep-opacity",
            Method::Codm => "codm",
        }
    }
}

/// Rays of a lobe that [`Method::Ray`] shoots from each point.
const N_RAYS: u32 = 32;

/// Packed records of `lights` at every point of `scene`, `[light][point]`, by `method`.
///
/// `lights` are some of [`PreparedScene::light_records`]' answer.
pub fn point_shadows(
    method: Method,
    scene: &PreparedScene,
    lights: &[LightRecord],
) -> Vec<PackedRecord> {
    let (_, sweeps) = scene.light_records();
    let builder = ShadowBuilder::new(method, &scene.strands);
    let n_points = scene.strands.points.len();
    let mut result = vec![[0; 2]; n_points * lights.len()];
    result
        .par_chunks_mut(n_points)
        .zip(lights)
        .for_each(|(out, light)| {
            let light_shadows = builder.light_shadows(light, directions_of(light, &sweeps));
            out.par_iter_mut().enumerate().for_each(|(point, out)| {
                *out = pack_record(&light_shadows.record(point as u32));
            });
        });
    result
}

/// Directions of the light in the list of all sweeps.
pub(crate) fn directions_of<'a>(light: &LightRecord, sweeps: &'a [[f32; 4]]) -> &'a [[f32; 4]] {
    let first = light.first_sweep as usize;
    &sweeps[first..first + light.n_sweeps as usize]
}

/// What a method makes of the strands before it knows the lights.
pub struct ShadowBuilder<'a> {
    method: Method,
    strands: &'a Strands,
    grid: Grid,
    volume: Vec<[f32; 8]>,
    rays: Option<Rays>,
}

/// What a method makes of one light.
pub enum LightShadows<'a> {
    /// Records of the sweep's voxels.
    Sweep(&'a ShadowBuilder<'a>, Vec<PackedRecord>, [f32; 3]),
    /// Directions inside the lobe.
    Ray(&'a ShadowBuilder<'a>, &'a Rays, Vec<[f32; 3]>),
    /// Zinke's voxels.
    ForwardMap(&'a ShadowBuilder<'a>, ForwardMap),
    /// Layers that begin with the hair.
    DeepOpacity(&'a ShadowBuilder<'a>, DeepOpacityMap),
    /// Layers with summed-area tables.
    Codm(&'a ShadowBuilder<'a>, ConvolutionMap),
}

impl<'a> ShadowBuilder<'a> {
    /// `method` on the renderer's grid.
    pub fn new(method: Method, strands: &'a Strands) -> ShadowBuilder<'a> {
        ShadowBuilder::on_grid(method, strands, Grid::around(strands))
    }

    /// `method` on another grid, where it has one.
    pub(crate) fn on_grid(method: Method, strands: &'a Strands, grid: Grid) -> ShadowBuilder<'a> {
        let needs_rays = matches!(method, Method::Ray | Method::ForwardMap);
        ShadowBuilder {
            method,
            strands,
            grid,
            volume: match method {
                Method::Sweep => cpu::voxelise(strands, &grid),
                _ => Vec::new(),
            },
            rays: needs_rays.then(|| Rays::new(strands)),
        }
    }

    /// Prepares one light; `directions` (the fourth float is not read) are those of the sweep.
    pub(crate) fn light_shadows(
        &'a self,
        light: &LightRecord,
        directions: &[[f32; 4]],
    ) -> LightShadows<'a> {
        match (self.method, &self.rays) {
            (Method::Ray, Some(rays)) => LightShadows::Ray(self, rays, lobe_of(light, N_RAYS)),
            (Method::ForwardMap, Some(rays)) => {
                let map = ForwardMap::new(self.strands, rays, &self.grid, light.direction);
                LightShadows::ForwardMap(self, map)
            }
            (Method::DeepOpacity, _) => {
                LightShadows::DeepOpacity(self, DeepOpacityMap::new(self.strands, light.direction))
            }
            (Method::Codm, _) => {
                let map = ConvolutionMap::new(self.strands, light.direction, light.lambda);
                LightShadows::Codm(self, map)
            }
            _ => {
                let light = LightRecord {
                    first_sweep: 0,
                    n_sweeps: directions.len() as u32,
                    ..*light
                };
                let records = cpu::transmittance(&self.grid, &self.volume, &[light], directions);
                LightShadows::Sweep(self, records, light.direction)
            }
        }
    }
}

impl LightShadows<'_> {
    /// The record at point `point` of the strands.
    pub fn record(&self, point: u32) -> ShadowRecord {
        let place = |builder: &ShadowBuilder| builder.strands.points[point as usize];
        match self {
            LightShadows::Sweep(builder, records, towards) => {
                cpu::record_at_point(&builder.grid, records, &place(builder), *towards)
            }
            LightShadows::Ray(builder, rays, directions) => {
                ray_record(rays, builder.strands, point, directions)
            }
            LightShadows::ForwardMap(builder, map) => map.record(&builder.grid, place(builder)),
            LightShadows::DeepOpacity(builder, map) => map.record(place(builder)),
            LightShadows::Codm(builder, map) => map.record(place(builder)),
        }
    }
}

/// `n` directions inside the light's lobe, each for the same share of its radiance.
pub(crate) fn lobe_of(light: &LightRecord, n: u32) -> Vec<[f32; 3]> {
    let lobe = strandlight_formats::SrbfLight {
        direction: light.direction,
        lambda: light.lambda,
        rgb: light.rgb,
    };
    lobe_directions(&lobe, n)
}

#[cfg(test)]
mod tests;
