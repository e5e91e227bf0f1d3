//! Shading of the points in steps, each small enough to be submitted on its own: shadow maps, one
//! by one; sweeps, direction by direction; tables of multiple scattering; points, slice by slice, for a batch of lights.
//!
//! What is edited is written into buffers that stay. Bind groups are made when they are first used
//! and again when one of their buffers had to grow.

mod edits;
mod slices;
mod steps;

use super::bounce::{self, BouncePass};
use super::multiple;
use super::narrow::{NarrowLights, NarrowPass};
use super::profile;
use super::profile::Profile;
use super::proxies::Proxies;
use super::resources::{
    Groups, StrandBuffers, buffer_of, compute_with, groups_of_64, grow, module_with, storage,
    submit, uniform,
};
use super::shadow_map::ShadowMaps;
use super::shadows::{Batch, Sweep};
#[cfg(not(target_arch = "wasm32"))]
use super::stamp::Stamp;
use super::visibility::SeenPoints;
use super::volume::Volume;
use crate::gpu::Context;
use slices::{FIRST_SHADED, N_SHADED, SlicePass};
use std::ops::Range;
use std::sync::Arc;
use strandlight_formats::SrbfLight;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scattering::multiple_tables::MultipleSource;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::{PassedWeights, passed_weights};
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::paint::PaintKinds;
use strandlight_scene::scene::{LightRecord, PreparedScene};
use strandlight_scene::shadow_maps::ShadowPlan;
use strandlight_scene::strands::Strands;

pub(crate) use slices::LAYOUTS;

/// Points shaded by one step by default: at most some seconds of work on a
/// software device.
pub(crate) const POINT_CHUNK: u32 = 1 << 15;

/// Bytes of counters in their buffer, before the number of points that are shaded where these are listed.
pub(crate) const COUNTER_BYTES: u64 = 4 * N_SHADED as u64;

/// Bytes before these points.
const SHADED_BYTES: u64 = 4 * FIRST_SHADED as u64;

/// What a pipeline of shading is compiled for: what is not there is not in its code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Kind {
    /// Bits of the terms of scattering.
    terms: u32,
    /// Bits of the modes.
    modes: u32,
    /// What of the hair is painted.
    paint: Option<PaintKinds>,
    /// Multiple scattering is looked up.
    has_tables: bool,
    /// In tables of an elliptic fibre.
    are_elliptic: bool,
    /// Strands have a profile over their width.
    has_profile: bool,
}

impl Kind {
    fn of(scene: &PreparedScene, has_profile: bool) -> Kind {
        let source = scene.multiple();
        Kind {
            terms: scene.terms(),
            modes: scene.hair.optics().fibre.modes,
            paint: scene.hair.paint(),
            has_tables: source.is_some(),
            are_elliptic: source.is_some_and(MultipleSource::is_elliptic),
            has_profile,
        }
    }

    /// The shader with what it needs, and more `features`; its entry point.
    fn compile(
        &self,
        context: &Context,
        more: &[&'static str],
    ) -> Result<(wgpu::ShaderModule, wgpu::ComputePipeline), RenderError> {
        let mut features = self.paint.map_or(Vec::new(), PaintKinds::features);
        features.extend(self.has_tables.then_some("TABLES"));
        features.extend(self.are_elliptic.then_some(multiple::ELLIPTIC));
        // Light from proxies comes from all around.
        let is_wide = self.has_profile && !more.contains(&bounce::FEATURE);
        features.extend(is_wide.then_some(profile::FEATURE));
        features.extend(more);
        let module = module_with(context, "pass/shade", &features)?;
        let constants = [
            ("TERMS", f64::from(self.terms)),
            ("MODES", f64::from(self.modes)),
        ];
        let pipeline = compute_with(context, &module, "shade", &constants);
        Ok((module, pipeline))
    }
}

/// A compiled kind, and its bind groups by batch of lights and buffer of radiance.
struct Shade {
    kind: Kind,
    module: wgpu::ShaderModule,
    pipeline: wgpu::ComputePipeline,
    groups: Vec<((usize, usize), wgpu::BindGroup)>,
    /// Of narrow lights along segments, once there are some.
    narrow: Option<NarrowPass>,
    /// Of bounce light, if there is some.
    bounce: Option<wgpu::ComputePipeline>,
}

/// The lights of a batch that are not black, in the list of those.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Lit {
    first: u32,
    n: u32,
}

/// Points that alone are shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Listed {
    /// How many, once the device has answered.
    pub n: Option<u32>,
    /// Which list it is; no other has this number.
    pub list: u64,
}

/// What shares of TT were found for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ThroughShares {
    eye: [f32; 3],
    /// Where it looks.
    forward: [f32; 3],
    /// At the points of which list, unless it was all.
    list: Option<u64>,
}

/// Pipelines and buffers of shading.
pub(crate) struct Lighting {
    sweep: Sweep,
    maps: ShadowMaps,
    /// The lights whose power shared out the maps: one that is black by now keeps its own.
    planned_lights: Vec<SrbfLight>,
    plan: ShadowPlan,
    /// Whose shares of TT are in the visibility buffer.
    through: Option<ThroughShares>,
    shades: Vec<Shade>,
    current: usize,
    scattering: super::scattering::Scattering,
    view: wgpu::Buffer,
    batch: wgpu::Buffer,
    /// And the points that are shaded, where these are listed.
    counters: wgpu::Buffer,
    listed: Option<Listed>,
    /// Where lists are used.
    slices: Option<SlicePass>,
    /// As many points as the last list had whose number is known; all before that.
    n_expected: u32,
    radiance: Vec<wgpu::Buffer>,
    narrow: NarrowLights,
    proxies: Option<Proxies>,
    bounce: Option<BouncePass>,
    profile: Profile,
    /// What light on the proxies depends on of the fibre.
    passed: (wgpu::Buffer, PassedWeights),
    /// All lights, as the sweeps read them.
    lights: wgpu::Buffer,
    directions: wgpu::Buffer,
    /// Those that are not black.
    lit: wgpu::Buffer,
    batches: Vec<Lit>,
    n_lights: usize,
    n_lit: u32,
    /// Directions of the light that has most, by batch.
    n_directions: Vec<u32>,
    min_power: f32,
    densities: [f32; 2],
    max_local: f32,
    n_points: u32,
    /// The strands of the scene, at rest if the wind bends them on the device.
    strands: Arc<Strands>,
}

impl Lighting {
    /// Uploads the lights of `scene` and makes room for what is found out about them. Radiance has
    /// `n_radiance` buffers.
    pub fn new(
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
        n_radiance: usize,
    ) -> Result<Self, RenderError> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let view: ViewUniform = bytemuck::Zeroable::zeroed();
        let batch: Batch = bytemuck::Zeroable::zeroed();
        let a_point = u64::from(strands.n_points) * 16;
        let lights = |label| buffer_of::<LightRecord>(context, label, &[], usage);
        let mut lighting = Lighting {
            sweep: Sweep::new(context)?,
            maps: ShadowMaps::new(context, strands)?,
            planned_lights: scene.lights.clone(),
            plan: ShadowPlan::default(),
            through: None,
            shades: Vec::new(),
            current: 0,
            scattering: super::scattering::Scattering::new(context, scene)?,
            view: uniform(context, "view", &view),
            batch: uniform(context, "batch", &batch),
            counters: storage(context, "counters", COUNTER_BYTES + 16),
            listed: None,
            slices: None,
            n_expected: strands.n_points,
            radiance: (0..n_radiance)
                .map(|_| storage(context, "radiance", a_point))
                .collect(),
            narrow: NarrowLights::new(context),
            proxies: Proxies::new(context, scene, n_radiance)?,
            bounce: BouncePass::new(context, scene)?,
            profile: Profile::default(),
            passed: {
                let weights = passed_weights(scene);
                (uniform(context, "passed", &weights), weights)
            },
            lights: lights("lights"),
            directions: buffer_of::<[f32; 4]>(context, "directions", &[], usage),
            lit: lights("lit lights"),
            batches: Vec::new(),
            n_lights: 0,
            n_lit: 0,
            n_directions: Vec::new(),
            min_power: 0.0,
            densities: scene.densities,
            max_local: scene.max_local(&scene.hair),
            n_points: strands.n_points,
            strands: Arc::clone(&scene.strands),
        };
        lighting.block_light(context)?;
        lighting.set_lights(context, scene, volume, strands);
        lighting.set_multiple(context, scene, None)?;
        lighting.set_kind(context, scene)?;
        Ok(lighting)
    }

    /// Narrow lights, which segments are shaded with.
    pub fn narrow(&mut self) -> &mut NarrowLights {
        &mut self.narrow
    }

    /// What strands are drawn with: see [`Lighting::radiance`], and of narrow lights along segments, once
    /// there are some.
    pub fn lit_points(&self) -> Vec<(&wgpu::Buffer, Option<&wgpu::Buffer>)> {
        let along = (0..).map(|ix: usize| self.narrow.along().get(ix));
        self.radiance.iter().zip(along).collect()
    }

    /// `[point]` (rgb, and the side of wide strands), times the view's radiance scale.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn radiance(&self, ix: usize) -> &wgpu::Buffer {
        &self.radiance[ix]
    }

    /// The lights that are not black, and how many.
    pub fn lit(&self) -> (&wgpu::Buffer, u32) {
        (&self.lit, self.n_lit)
    }

    /// As [`strandlight_scene::stats::Stats::set_counters`] reads them.
    pub fn counters(&self) -> &wgpu::Buffer {
        &self.counters
    }

    /// Lists of points are going to be shaded.
    pub fn use_lists(&mut self, context: &Context) -> Result<(), RenderError> {
        if self.slices.is_none() {
            self.slices = Some(SlicePass::new(context)?);
        }
        Ok(())
    }

    /// Shades the points of a list in the steps to come, in slices of `chunk`, or all points. Nobody needs to know how
    /// many the list has.
    pub fn shade_listed(
        &mut self,
        context: &Context,
        listed: Option<(SeenPoints, Listed)>,
        chunk: u32,
    ) {
        self.listed = listed.map(|(_, listed)| listed);
        let Some((seen, Listed { n, .. })) = listed else {
            return;
        };
        let bytes = SHADED_BYTES + 4 * u64::from(self.n_points);
        if grow(context, &mut self.counters, bytes) {
            self.forget_groups();
        }
        let counters = &self.counters;
        submit(context, |encoder| {
            let bytes = 4 * u64::from(n.unwrap_or(self.n_points));
            encoder.copy_buffer_to_buffer(seen.number, 0, counters, COUNTER_BYTES, 4);
            encoder.copy_buffer_to_buffer(seen.points, 0, counters, SHADED_BYTES, bytes);
        });
        if let (None, Some(slices)) = (n, &mut self.slices) {
            slices.find(context, &self.counters, self.n_points, chunk);
        }
    }

    /// The device has answered how many points a list has. Answers whether it is the one whose points are shaded.
    pub fn know_listed(&mut self, list: u64, n: u32) -> bool {
        self.n_expected = n;
        match &mut self.listed {
            Some(listed) if listed.list == list => {
                listed.n = Some(n);
                true
            }
            _ => false,
        }
    }

    /// Has the points that the steps to come do not shade into the buffer `into` look as in the buffer `before`, or
    /// black.
    pub fn begin_listed(&self, context: &Context, before: Option<usize>, into: usize) {
        let Some(before) = before else {
            self.clear(context, into);
            self.narrow.clear(context, into);
            return;
        };
        submit(context, |encoder| {
            for buffers in [&self.radiance[..], self.narrow.along()] {
                if let (Some(from), Some(to)) = (buffers.get(before), buffers.get(into)) {
                    encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
                }
            }
        });
    }

    /// The points that the last steps shade, unless they shade all.
    pub fn listed(&self) -> Option<Listed> {
        self.listed
    }

    /// How many that are at most.
    pub fn n_listed(&self) -> Option<u32> {
        self.listed.map(|listed| listed.n.unwrap_or(self.n_points))
    }

    /// Is it not known yet how many that are?
    fn is_blind(&self) -> bool {
        self.listed.is_some_and(|listed| listed.n.is_none())
    }

    /// Groups of 64 for a step that shades these points.
    fn groups_of(&self, points: &Range<u32>) -> Groups<'_> {
        match self.slices.as_ref().filter(|_| self.is_blind()) {
            Some(slices) => slices.of_slice(points),
            None => Groups::Known(groups_of_64(points.end - points.start)),
        }
    }

    /// Batches that shading ran over, each of which counted all points.
    pub fn n_batches(&self) -> u64 {
        let lit = self.batches.iter().filter(|lit| lit.n > 0);
        lit.count().max(1) as u64
    }

    /// Packed records of the first batch, `[light][voxel]`.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn first_records(
        &self,
        context: &Context,
        volume: &Volume,
    ) -> Result<Vec<PackedRecord>, RenderError> {
        if !self.sweep.is_kept() {
            for k in 0..self.n_directions.first().copied().unwrap_or(0) {
                self.sweep
                    .sweep(context, &volume.grid, 0, k, Stamp::default());
            }
        }
        self.sweep.read_first(context, &volume.grid)
    }

    /// Bytes by stage of [`Step::stage`].
    pub fn bytes(&self) -> [(&'static str, u64); 4] {
        let radiance = self.radiance.iter().chain(self.narrow.along());
        let radiance: u64 = radiance.map(wgpu::Buffer::size).sum();
        let proxies = self.proxies.as_ref().map_or(0, Proxies::bytes)
            + self.bounce.as_ref().map_or(0, BouncePass::bytes);
        [
            ("shadow maps", self.maps.bytes()),
            ("transmittance", self.sweep.bytes()),
            ("tables", self.scattering.table_bytes()),
            ("shade", radiance + proxies),
        ]
    }
}
