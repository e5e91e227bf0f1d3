//! Shading of the points in steps, each small enough to be submitted on its own: shadow maps, one
//! by one; sweeps, direction by direction; tables of multiple scattering; points, slice by slice, for a batch of lights.
//!
//! What is edited is written into buffers that stay. Bind groups are made when they are first used
//! and again when one of their buffers had to grow.

use std::ops::Range;

use super::bounce::{self, BouncePass};
use super::meshes::{Light, Meshes};
use super::narrow::{NarrowLights, NarrowPass};
use super::preview::{self, Drafted};
use super::profile::{self, Profile};
use super::proxies::Proxies;
use super::resources::{
    StrandBuffers, bind, buffer_of, compute_pass, compute_with, groups_of_64, module_with, step,
    storage, submit, uniform, write,
};
use super::shadow_map::ShadowMaps;
use super::shadows::{Batch, Sweep, SweptLights};
use super::stamp::Stamp;
use super::step::Step;
use super::volume::Volume;
use crate::gpu::Context;
use strandlight_formats::SrbfLight;
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scattering::closed_form::PackedRecord;
use strandlight_scattering::closed_form::TERM_SINGLE;
use strandlight_scattering::closed_form::WidthProfile;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::{N_LOBES, PassedWeights, passed_weights};
use strandlight_scene::budget::LIGHT_BATCH;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::material::{EditReport, HairMaterial};
use strandlight_scene::paint::PaintKinds;
use strandlight_scene::scene::{LightRecord, PreparedScene};
use strandlight_scene::shadow_maps::{NO_SLOT, ShadowPlan};

/// Points shaded by one step by default: at most some seconds of work on a
/// software device.
pub(crate) const POINT_CHUNK: u32 = 1 << 15;

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
    /// Strands have a profile over their width.
    has_profile: bool,
}

impl Kind {
    fn of(scene: &PreparedScene, has_profile: bool) -> Kind {
        Kind {
            terms: scene.terms(),
            modes: scene.hair.optics().fibre.modes,
            paint: scene.hair.paint(),
            has_tables: scene.multiple().is_some(),
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

/// Pipelines and buffers of shading.
pub(crate) struct Lighting {
    sweep: Sweep,
    maps: ShadowMaps,
    /// The lights whose power shared out the maps: one that is black by now keeps its own.
    planned_lights: Vec<SrbfLight>,
    plan: ShadowPlan,
    /// The eye whose shares of TT are in the visibility buffer, and where it looks.
    through: Option<([f32; 3], [f32; 3])>,
    shades: Vec<Shade>,
    current: usize,
    scattering: super::scattering::Scattering,
    view: wgpu::Buffer,
    batch: wgpu::Buffer,
    counters: wgpu::Buffer,
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
            counters: storage(context, "counters", 80),
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
        };
        lighting.block_light(context)?;
        lighting.set_lights(context, scene, volume, strands);
        lighting.set_multiple(context, scene, None)?;
        lighting.set_kind(context, scene)?;
        Ok(lighting)
    }

    /// Shares out the shadow maps of the lights to come, [`Lighting::set_lights`], by the power of
    /// these, which differ from them in nothing else.
    pub fn plan_for(&mut self, lights: &[SrbfLight]) {
        self.planned_lights = lights.to_vec();
    }

    /// Takes the lights of `scene` for those there were; [`Lighting::shadow_steps`] finds their
    /// shadows.
    pub fn set_lights(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) {
        self.plan_maps(context, scene, strands);
        self.stale_bounce();
        let (records, directions) = scene.records_with(&self.plan);
        self.n_lights = records.len();
        self.n_directions = records.chunks(LIGHT_BATCH).map(most_directions).collect();
        write(context, &mut self.directions, &directions);
        write(context, &mut self.lights, &records);
        self.write_lit(context, scene, &records);
        self.hide(context, scene, volume, &directions);
        let lights = SweptLights {
            lights: &self.lights,
            directions: &self.directions,
            n_lights: self.n_lights,
        };
        self.sweep
            .fit(context, volume, &lights, scene.record_budget);
        self.forget_groups();
    }

    /// Takes other amplitudes of the same lights. Answers whether a light got so bright that it
    /// needs a shadow map which it has not: the maps are then replanned, and have to be drawn.
    pub fn set_colors(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        strands: &StrandBuffers,
    ) -> bool {
        self.stale_bounce();
        let wanted = scene.shadow_plan();
        let has_all = self
            .plan
            .slots
            .iter()
            .zip(&wanted.slots)
            .all(|(&has, &wants)| has != NO_SLOT || wants == NO_SLOT);
        if !has_all {
            self.planned_lights.clone_from(&scene.lights);
            self.plan_maps(context, scene, strands);
        }
        let (records, _) = scene.records_with(&self.plan);
        self.write_lit(context, scene, &records);
        !has_all
    }

    /// Takes the proxies of `scene` for those there were. [`Lighting::shadow_steps`] finds the
    /// shadows.
    pub fn set_proxies(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
    ) -> Result<(), RenderError> {
        let mut bounce = self.bounce.as_mut();
        if !bounce.as_mut().is_some_and(|it| it.refresh(context, scene)) {
            self.bounce = BouncePass::new(context, scene)?;
        }
        self.set_kind(context, scene)?;
        let records = scene.proxy_records();
        let has_meshes = !scene.beside().meshes().is_empty();
        if let Some(proxies) = &self.proxies
            && proxies.write(context, &records)
            && !has_meshes
        {
            return Ok(());
        }
        self.proxies = Proxies::new(context, scene, self.radiance.len())?;
        self.block_light(context)?;
        self.set_lights(context, scene, volume, strands);
        Ok(())
    }

    /// Has the shaders of the shadows know of the proxies.
    fn block_light(&mut self, context: &Context) -> Result<(), RenderError> {
        let blockers = self.proxies.as_ref().map(Proxies::blockers);
        let [of_maps, of_sweeps] = match blockers {
            Some(blockers) => blockers.map(Some),
            None => [None, None],
        };
        self.maps.set_proxies(context, of_maps)?;
        self.sweep.set_proxies(context, of_sweeps)
    }

    /// Finds what meshes hide of lights along `directions`. The sweep's groups are to be bound again.
    fn hide(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        directions: &[[f32; 4]],
    ) {
        if let Some(proxies) = &mut self.proxies
            && proxies.refresh(context, scene, &volume.grid, directions)
        {
            let [_, of_sweeps] = proxies.blockers();
            self.sweep.renew_blocker(of_sweeps);
        }
    }

    fn meshes(&self) -> Option<&Meshes> {
        self.proxies.as_ref().and_then(Proxies::meshes)
    }

    /// The proxies, if there are any.
    pub(super) fn proxies(&self) -> Option<&Proxies> {
        self.proxies.as_ref()
    }

    /// Takes strands that have moved within `volume`, and replans the maps.
    pub fn set_points(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        volume: &Volume,
        strands: &StrandBuffers,
        is_other_volume: bool,
    ) {
        if let Some(proxies) = &self.proxies {
            proxies.write(context, &scene.proxy_records());
        }
        if let Some(bounce) = &mut self.bounce {
            bounce.refresh(context, scene);
        }
        self.plan_maps(context, scene, strands);
        let is_hidden = self.meshes().is_some();
        if is_hidden {
            let (_, directions) = scene.records_with(&self.plan);
            self.hide(context, scene, volume, &directions);
        }
        let lights = SweptLights {
            lights: &self.lights,
            directions: &self.directions,
            n_lights: self.n_lights,
        };
        let budget = scene.record_budget;
        if is_hidden || is_other_volume || !self.sweep.has_room(&volume.grid, self.n_lights, budget)
        {
            self.sweep.fit(context, volume, &lights, budget);
            self.forget_groups();
        }
    }

    /// Takes the densities of `scene`.
    pub fn set_densities(&mut self, scene: &PreparedScene) {
        self.densities = scene.densities;
        self.max_local = scene.max_local(&scene.hair);
    }

    /// Writes what an edit of the hair recomputed.
    pub fn set_hair(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        hair: &HairMaterial,
        report: &EditReport,
    ) {
        self.max_local = scene.max_local(hair);
        if self.scattering.update(context, hair, report) {
            self.forget_groups();
        }
    }

    /// Writes the paint of `changed` points; all of it where there was none.
    pub fn set_paint(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        hair: &HairMaterial,
        changed: Range<usize>,
    ) {
        let points = scene.paint();
        if self.scattering.set_paint(context, points, hair, changed) {
            self.max_local = scene.max_local(hair);
            self.forget_groups();
        }
    }

    /// Makes room for the tables of multiple scattering where they serve `scene`, or writes what of
    /// them an edit recomputed; [`Lighting::table_steps`] fills them.
    pub fn set_multiple(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
        report: Option<&EditReport>,
    ) -> Result<(), RenderError> {
        if self.scattering.set_multiple(context, scene, report)? {
            self.forget_groups();
        }
        Ok(())
    }

    /// Takes the profile of wide strands, if there are some.
    pub fn set_profile(&mut self, context: &Context, profile: Option<WidthProfile>) {
        self.profile.set(context, profile);
    }

    /// Are there wide strands?
    pub fn has_profile(&self) -> bool {
        self.profile.is_there()
    }

    /// Compiles what the terms and modes of `scene` need, unless they were drawn before.
    pub fn set_kind(
        &mut self,
        context: &Context,
        scene: &PreparedScene,
    ) -> Result<(), RenderError> {
        let kind = Kind::of(scene, self.has_profile());
        if self.proxies.is_some() {
            let weights = passed_weights(scene);
            if weights != self.passed.1 {
                context.write(&self.passed.0, 0, bytemuck::bytes_of(&weights));
                self.passed.1 = weights;
                self.stale_bounce();
            }
        }
        self.current = match self.shades.iter().position(|shade| shade.kind == kind) {
            Some(ix) => ix,
            None => {
                let (module, pipeline) = kind.compile(context, &[])?;
                self.shades.push(Shade {
                    kind,
                    pipeline,
                    groups: Vec::new(),
                    narrow: None,
                    bounce: None,
                    module,
                });
                self.shades.len() - 1
            }
        };
        let shade = &mut self.shades[self.current];
        if self.bounce.is_some() && shade.bounce.is_none() {
            let (_, pipeline) = kind.compile(context, &[bounce::FEATURE])?;
            shade.bounce = Some(pipeline);
        }
        Ok(())
    }

    /// What finds the shadows of the lights: all but what depends on the view.
    pub fn shadow_steps(&mut self) -> Vec<Step> {
        let mut steps = self.map_steps();
        if self.sweep.is_kept() {
            let batches = 0..self.n_directions.len();
            steps.extend(batches.flat_map(|batch| self.sweeps_of(batch)));
        }
        steps
    }

    /// What draws the shadow maps of the lights.
    pub fn map_steps(&mut self) -> Vec<Step> {
        self.through = None;
        self.plan.views.iter().copied().map(Step::Map).collect()
    }

    /// What finds the shares of TT for an eye that looks along `forward`: nothing if they are those of the
    /// last one, and no maps if that one looked along it.
    pub fn through_steps(&mut self, eye: [f32; 3], forward: [f32; 3]) -> Vec<Step> {
        let before = self.through.replace((eye, forward));
        if before == Some((eye, forward)) || self.plan.n_slots == 0 {
            return Vec::new();
        }
        let is_turned = before.is_none_or(|(_, before)| before != forward);
        let views = match is_turned {
            true => self.plan.through(forward),
            false => Vec::new(),
        };
        let maps = views.into_iter().map(Step::Map);
        maps.chain([Step::Through { eye, forward }]).collect()
    }

    /// What fills the tables of multiple scattering: nothing if they are filled.
    pub fn table_steps(&self) -> Option<Step> {
        self.scattering.has_stale_tables().then_some(Step::Tables)
    }

    /// Discards the line-of-sight shadows.
    pub fn forget_through(&mut self) {
        self.through = None;
    }

    /// How much a step is of its stage's work: maps, sweeps of a light, products of points and
    /// lights.
    pub fn units(&self, step: &Step) -> f64 {
        match step {
            Step::Map(_) | Step::Through { .. } | Step::Tables => 1.0,
            Step::Sweep { batch, .. } => {
                let n = self.n_lights.saturating_sub(batch * LIGHT_BATCH);
                n.clamp(1, LIGHT_BATCH) as f64
            }
            Step::Shade { batch, points } => {
                f64::from(points.end - points.start) * f64::from(self.batches[*batch].n.max(1))
            }
            Step::Narrow { points } => {
                f64::from(points.end - points.start) * 3.0 * f64::from(self.narrow.n())
            }
            Step::Proxies { batch } => f64::from(self.batches[*batch].n.max(1)),
            Step::Bounce => 1.0,
            Step::ShadeBounce { points } => f64::from(points.end - points.start) * N_LOBES as f64,
        }
    }

    /// What lights all points, at most `chunk` at a time, after [`Lighting::begin`].
    pub fn shade_steps(&self, chunk: u32) -> Vec<Step> {
        let mut steps = Vec::new();
        for (batch, lit) in self.batches.iter().enumerate() {
            if lit.n == 0 && (batch > 0 || self.n_lit > 0) {
                continue;
            }
            if !self.sweep.is_kept() {
                steps.extend(self.sweeps_of(batch));
            }
            let chunks = (0..self.n_points).step_by(chunk.max(64) as usize);
            steps.extend(chunks.map(|first| Step::Shade {
                batch,
                points: first..(first + chunk.max(64)).min(self.n_points),
            }));
            if self.proxies.is_some() {
                steps.push(Step::Proxies { batch });
            }
        }
        if let Some(bounce) = self.bounce.as_ref().filter(|_| self.n_lit > 0) {
            steps.extend(bounce.is_stale.then_some(Step::Bounce));
            let chunks = (0..self.n_points).step_by(chunk.max(64) as usize);
            steps.extend(chunks.map(|first| Step::ShadeBounce {
                points: first..(first + chunk.max(64)).min(self.n_points),
            }));
        }
        // Without narrow lights by now it clears what others left.
        if self.narrow.have_room() {
            let chunks = (0..self.n_points).step_by(chunk.max(64) as usize);
            steps.extend(chunks.map(|first| Step::Narrow {
                points: first..(first + chunk.max(64)).min(self.n_points),
            }));
        }
        steps
    }

    fn sweeps_of(&self, batch: usize) -> impl Iterator<Item = Step> + use<> {
        let n = self.n_directions.get(batch).copied().unwrap_or(0);
        (0..n).map(move |k| Step::Sweep { batch, k })
    }

    /// Starts the shading for `view`.
    pub fn begin(&self, context: &Context, view: &ViewUniform) {
        let bytes = bytemuck::bytes_of(view);
        context.write(&self.view, 0, bytes);
        submit(context, |encoder| {
            encoder.clear_buffer(&self.counters, 0, None);
        });
    }

    /// Fills the radiance buffer `into` with a draft, after [`Lighting::begin`]: a look at the
    /// scene before there are shadows.
    pub fn take_preview(
        &self,
        context: &Context,
        scene: &PreparedScene,
        strands: &StrandBuffers,
        into: usize,
        stamp: Stamp,
    ) -> Result<(), RenderError> {
        self.narrow.clear(context, into);
        let drafted = Drafted {
            view: &self.view,
            radiance: &self.radiance[into],
            proxies: self.proxies.as_ref().map(|proxies| (proxies, into)),
        };
        preview::take(context, scene, strands, &drafted, stamp)
    }

    /// Makes all points black.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn clear(&self, context: &Context, into: usize) {
        submit(context, |encoder| {
            encoder.clear_buffer(&self.radiance[into], 0, None);
        });
    }

    /// Submits a step; shading writes the radiance buffer `into`.
    pub fn submit(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        volume: &Volume,
        work: &Step,
        into: usize,
        stamp: Stamp,
    ) {
        match work {
            Step::Map(view) => {
                if let Some(meshes) = self.meshes() {
                    meshes.hide_points(context, view.towards.into());
                }
                self.maps.draw(context, view, stamp);
            }
            Step::Through { eye, forward } => {
                self.maps
                    .share(context, &self.plan, (*eye, *forward), stamp);
            }
            Step::Sweep { batch, k } => {
                self.sweep.sweep(context, &volume.grid, *batch, *k, stamp);
            }
            Step::Tables => self.scattering.fill_tables(context, stamp),
            Step::Shade { batch, points } => {
                self.bind(context, strands, volume, *batch);
                self.write_batch(context, *batch, points.clone());
                let shade = &self.shades[self.current];
                let places = &shade.groups;
                let found = places.iter().find(|(place, _)| *place == (*batch, into));
                let Some((_, group)) = found else {
                    return;
                };
                let [x, y] = groups_of_64(points.end - points.start);
                submit(context, |encoder| {
                    let mut pass = compute_pass(encoder, stamp);
                    step(&mut pass, &shade.pipeline, group, [x, y]);
                });
            }
            Step::Narrow { points } => {
                self.bind_narrow(context, strands);
                // None of them: black.
                let has_single = self.shades[self.current].kind.terms & TERM_SINGLE != 0;
                let n = match self.narrow.are_along && has_single {
                    true => self.narrow.n(),
                    false => 0,
                };
                self.write_lights(context, Lit { first: 0, n }, points.clone());
                let Some(narrow) = &self.shades[self.current].narrow else {
                    return;
                };
                narrow.run(context, points.end - points.start, into, stamp);
            }
            Step::Proxies { batch } => {
                let Some(proxies) = &self.proxies else {
                    return;
                };
                self.write_batch(context, *batch, 0..0);
                let light = Light {
                    view: &self.view,
                    batch: &self.batch,
                    grid: &volume.grid_buffer,
                    lit: &self.lit,
                    directions: &self.directions,
                    records: self.sweep.records(*batch),
                    passed: &self.passed.0,
                };
                proxies.light(context, &light, into, stamp);
            }
            Step::Bounce => {
                if let (Some(bounce), Some(proxies)) = (&mut self.bounce, &self.proxies) {
                    bounce.find(context, volume, proxies.light_map(into), stamp);
                }
            }
            Step::ShadeBounce { points } => {
                self.shade_bounce(context, strands, points.clone(), into, stamp);
            }
        }
    }

    /// The light that comes from the proxies is another.
    fn stale_bounce(&mut self) {
        if let Some(bounce) = &mut self.bounce {
            bounce.is_stale = true;
        }
    }

    /// Adds bounce light to points.
    fn shade_bounce(
        &self,
        context: &Context,
        strands: &StrandBuffers,
        points: Range<u32>,
        into: usize,
        stamp: Stamp,
    ) {
        let shade = &self.shades[self.current];
        let (Some(pipeline), Some(bounce)) = (&shade.bounce, &self.bounce) else {
            return;
        };
        // Not the first, which overwrites what was there.
        let lobes = Lit {
            first: 1,
            n: N_LOBES as u32,
        };
        self.write_lights(context, lobes, points.clone());
        let [grid, bounced] = bounce.found();
        let mut resources = vec![
            (0, self.view.as_entire_binding()),
            (1, self.batch.as_entire_binding()),
            (2, grid.as_entire_binding()),
            (4, strands.points.as_entire_binding()),
            (5, strands.tangents.as_entire_binding()),
            (6, strands.normals.as_entire_binding()),
            (8, bounced.as_entire_binding()),
            (9, self.radiance[into].as_entire_binding()),
        ];
        resources.extend(self.scattering.bindings());
        let group = bind(context, &pipeline.get_bind_group_layout(0), &resources);
        submit(context, |encoder| {
            let mut pass = compute_pass(encoder, stamp);
            step(
                &mut pass,
                pipeline,
                &group,
                groups_of_64(points.end - points.start),
            );
        });
    }

    fn write_batch(&self, context: &Context, batch: usize, points: Range<u32>) {
        self.write_lights(context, self.batches[batch], points);
    }

    fn write_lights(&self, context: &Context, lit: Lit, points: Range<u32>) {
        let uniform = Batch {
            first_light: lit.first,
            n_lights: lit.n,
            first_point: points.start,
            end_point: points.end,
            min_power: self.min_power,
            density_forward: self.densities[0],
            density_back: self.densities[1],
            max_local: self.max_local,
            are_along: u32::from(self.narrow.are_along && self.narrow.have_room()),
            pad: [0; 3],
        };
        let bytes = bytemuck::bytes_of(&uniform);
        context.write(&self.batch, 0, bytes);
    }

    /// Makes the bind groups of a batch, one for each buffer of radiance, unless they are there.
    fn bind(&mut self, context: &Context, strands: &StrandBuffers, volume: &Volume, batch: usize) {
        let shade = &self.shades[self.current];
        if shade.groups.iter().any(|((of, _), _)| *of == batch) {
            return;
        }
        let layout = shade.pipeline.get_bind_group_layout(0);
        let groups: Vec<_> = (0..self.radiance.len())
            .map(|into| {
                let mut resources = vec![
                    (0, self.view.as_entire_binding()),
                    (1, self.batch.as_entire_binding()),
                    (2, volume.grid_buffer.as_entire_binding()),
                    (4, strands.points.as_entire_binding()),
                    (5, strands.tangents.as_entire_binding()),
                    (6, strands.normals.as_entire_binding()),
                    (7, self.lit.as_entire_binding()),
                    (8, self.sweep.records(batch).as_entire_binding()),
                    (9, self.radiance[into].as_entire_binding()),
                    (10, self.counters.as_entire_binding()),
                    (17, self.maps.visibility().as_entire_binding()),
                ];
                resources.extend(self.scattering.bindings());
                resources.extend(self.profile.binding());
                ((batch, into), bind(context, &layout, &resources))
            })
            .collect();
        self.shades[self.current].groups.extend(groups);
    }

    /// Makes pipeline and bind groups of narrow lights, unless they are there.
    fn bind_narrow(&mut self, context: &Context, strands: &StrandBuffers) {
        if self.shades[self.current].narrow.is_some() {
            return;
        }
        let mut bindings = vec![
            (0, self.view.as_entire_binding()),
            (1, self.batch.as_entire_binding()),
            (4, strands.points.as_entire_binding()),
            (5, strands.tangents.as_entire_binding()),
            (6, strands.normals.as_entire_binding()),
            (23, self.maps.answers().as_entire_binding()),
        ];
        bindings.extend(self.scattering.single_bindings());
        bindings.extend(self.profile.binding());
        let radiance = self.has_profile().then_some(&self.radiance[..]);
        let shade = &self.shades[self.current];
        let shader = (&shade.module, shade.kind.modes);
        let narrow = NarrowPass::new(context, shader, (&self.narrow, radiance), &bindings);
        self.shades[self.current].narrow = Some(narrow);
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

    fn plan_maps(&mut self, context: &Context, scene: &PreparedScene, strands: &StrandBuffers) {
        self.plan = ShadowPlan::new(&self.planned_lights, &scene.strands, scene.shadow_maps);
        self.through = None;
        if self.maps.fit(context, strands, &self.plan) {
            self.forget_groups();
        }
    }

    /// Writes the lights that are not black, batch by batch.
    fn write_lit(&mut self, context: &Context, scene: &PreparedScene, records: &[LightRecord]) {
        self.min_power = scene.min_power();
        let mut lit = Vec::with_capacity(records.len());
        self.batches.clear();
        for batch in records.chunks(LIGHT_BATCH) {
            let first = lit.len() as u32;
            lit.extend(batch.iter().filter(|light| light.power > 0.0).copied());
            let n = lit.len() as u32 - first;
            self.batches.push(Lit { first, n });
        }
        if self.batches.is_empty() {
            // Without lights all points are black.
            self.batches.push(Lit::default());
        }
        self.n_lit = lit.len() as u32;
        let room = (self.n_points, self.radiance.len());
        let has_grown = self.narrow.write(context, &lit, room);
        if write(context, &mut self.lit, &lit) | has_grown {
            self.forget_groups();
        }
    }

    fn forget_groups(&mut self) {
        for shade in &mut self.shades {
            shade.groups.clear();
            shade.narrow = None;
        }
    }
}

/// Directions of the light that has most.
fn most_directions(lights: &[LightRecord]) -> u32 {
    lights.iter().map(|light| light.n_sweeps).max().unwrap_or(0)
}
