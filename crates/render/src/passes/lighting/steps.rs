//! Steps: which there are, and what each submits.

use super::super::meshes::Light;
use super::super::narrow::NarrowPass;
use super::super::preview;
use super::super::preview::Drafted;
use super::super::resources::{
    Groups, StrandBuffers, bind, compute_pass, groups_of_64, step_over, submit,
};
use super::super::shadows::Batch;
use super::super::stamp::Stamp;
use super::super::step::Step;
use super::super::volume::Volume;
use super::slices::slices;
use super::{COUNTER_BYTES, Lighting, Lit, ThroughShares};
use crate::gpu::Context;
use std::ops::Range;
use strandlight_scattering::closed_form::TERM_SINGLE;
use strandlight_scene::RenderError;
use strandlight_scene::bounce::N_LOBES;
use strandlight_scene::budget::LIGHT_BATCH;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::interreflection::N_ROUNDS;
use strandlight_scene::scene::PreparedScene;
use strandlight_scene::shadow_maps::ShadowView;

impl Lighting {
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
        let views = self.plan.views.clone();
        if let Some(meshes) = self.meshes_mut() {
            meshes.forget_directions();
        }
        self.maps_of(views).collect()
    }

    /// What draws the maps of `views`.
    fn maps_of(&mut self, views: Vec<ShadowView>) -> impl Iterator<Item = Step> + use<> {
        if let Some(meshes) = self.meshes_mut() {
            meshes.await_directions(views.iter().map(|view| view.towards.into()));
        }
        views.into_iter().map(Step::Map)
    }

    /// What finds the shares of TT for an eye that looks along `forward`: nothing if they are those of the
    /// last one, and no maps if that one looked along it.
    pub fn through_steps(&mut self, eye: [f32; 3], forward: [f32; 3]) -> Vec<Step> {
        let found = ThroughShares {
            eye,
            forward,
            list: self.listed.map(|listed| listed.list),
        };
        let before = self.through.replace(found);
        // All points are those of any list.
        let of_all = ThroughShares {
            list: None,
            ..found
        };
        if before.is_some_and(|before| before == found || before == of_all) {
            self.through = before;
            return Vec::new();
        }
        if self.plan.n_slots == 0 {
            return Vec::new();
        }
        let is_turned = before.is_none_or(|before| before.forward != forward);
        let views = match is_turned {
            true => self.plan.through(forward),
            false => Vec::new(),
        };
        let maps = self.maps_of(views);
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
        let n = step.points().map_or(0.0, |points| self.n_of(points));
        match step {
            Step::Map(_) | Step::Through { .. } | Step::Tables => 1.0,
            Step::Sweep { batch, .. } => {
                let n = self.n_lights.saturating_sub(batch * LIGHT_BATCH);
                n.clamp(1, LIGHT_BATCH) as f64
            }
            Step::Shade { batch, .. } => n * f64::from(self.batches[*batch].n.max(1)),
            Step::Narrow { .. } => n * 3.0 * f64::from(self.narrow.n()),
            Step::Proxies { batch } => f64::from(self.batches[*batch].n.max(1)),
            // As much as so many lights.
            Step::Interreflection => N_ROUNDS as f64,
            Step::Bounce => 1.0,
            Step::ShadeBounce { .. } => n * N_LOBES as f64,
        }
    }

    /// Does [`Lighting::units`] know how much a step is?
    pub fn is_counted(&self, step: &Step) -> bool {
        !self.is_blind() || step.points().is_none()
    }

    /// About how many points of the list, or of all, these are.
    fn n_of(&self, points: &Range<u32>) -> f64 {
        let mut end = points.end;
        if self.is_blind() && self.n_expected > points.start {
            end = end.min(self.n_expected);
        }
        f64::from(end - points.start)
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
            let shade = |points| Step::Shade { batch, points };
            steps.extend(self.chunks(chunk).map(shade));
            if self.proxies.is_some() {
                steps.push(Step::Proxies { batch });
            }
        }
        if let Some(bounce) = self.bounce.as_ref().filter(|_| self.n_lit > 0) {
            let is_between = bounce.has_interreflection();
            steps.extend(is_between.then_some(Step::Interreflection));
            steps.extend(bounce.is_stale.then_some(Step::Bounce));
            let shade = |points| Step::ShadeBounce { points };
            steps.extend(self.chunks(chunk).map(shade));
        }
        // Without narrow lights by now it clears what others left.
        if self.narrow.have_room() {
            let shade = |points| Step::Narrow { points };
            steps.extend(self.chunks(chunk).map(shade));
        }
        steps
    }

    /// The points that are shaded, at most `chunk` at a time; of a list whose number is not known as many as there may be.
    fn chunks(&self, chunk: u32) -> impl Iterator<Item = Range<u32>> + use<> {
        slices(self.n_listed().unwrap_or(self.n_points), chunk)
    }

    pub(super) fn sweeps_of(&self, batch: usize) -> impl Iterator<Item = Step> + use<> {
        let n = self.n_directions.get(batch).copied().unwrap_or(0);
        (0..n).map(move |k| Step::Sweep { batch, k })
    }

    /// Starts the shading for `view`.
    pub fn begin(&self, context: &Context, view: &ViewUniform) {
        let bytes = bytemuck::bytes_of(view);
        context.write(&self.view, 0, bytes);
        submit(context, |encoder| {
            encoder.clear_buffer(&self.counters, 0, Some(COUNTER_BYTES));
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
                if let Some(meshes) = self.meshes_mut() {
                    meshes.hide_points(context, view.towards.into());
                }
                self.maps.draw(context, view, stamp);
            }
            Step::Through { eye, forward } => {
                let groups = self.listed.map(|listed| match (listed.n, &self.slices) {
                    (None, Some(slices)) => slices.of_all(),
                    (n, _) => Groups::Known(groups_of_64(n.unwrap_or(self.n_points))),
                });
                let listed = (&self.counters, groups);
                let sight = (*eye, *forward);
                (self.maps).share(context, &self.plan, sight, strands, listed, stamp);
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
                let groups = self.groups_of(points);
                submit(context, |encoder| {
                    let mut pass = compute_pass(context, encoder, stamp);
                    step_over(&mut pass, &shade.pipeline, group, groups);
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
                narrow.run(context, self.groups_of(points), into, stamp);
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
                    volume: volume.buffer(),
                    passed: &self.passed.0,
                };
                proxies.light(context, &light, into, stamp);
            }
            Step::Interreflection => {
                if let (Some(bounce), Some(proxies)) = (&mut self.bounce, &self.proxies) {
                    let light = (proxies.light_map(into), &self.passed.0);
                    bounce.reflect(context, volume, light, stamp);
                }
            }
            Step::Bounce => {
                if let (Some(bounce), Some(proxies)) = (&mut self.bounce, &self.proxies) {
                    bounce.find(context, volume, proxies.light_map(into), stamp);
                }
            }
            Step::ShadeBounce { points } => {
                let of_hair = (strands, volume);
                self.shade_bounce(context, of_hair, points.clone(), into, stamp);
            }
        }
    }

    /// Adds bounce light to points.
    pub(super) fn shade_bounce(
        &self,
        context: &Context,
        (strands, volume): (&StrandBuffers, &Volume),
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
            (10, self.counters.as_entire_binding()),
            (26, wgpu::BindingResource::TextureView(volume.axis_shares())),
            (27, volume.grid_buffer.as_entire_binding()),
        ];
        resources.extend(self.scattering.bindings());
        let group = bind(context, &pipeline.get_bind_group_layout(0), &resources);
        submit(context, |encoder| {
            let mut pass = compute_pass(context, encoder, stamp);
            step_over(&mut pass, pipeline, &group, self.groups_of(&points));
        });
    }

    pub(super) fn write_batch(&self, context: &Context, batch: usize, points: Range<u32>) {
        self.write_lights(context, self.batches[batch], points);
    }

    pub(super) fn write_lights(&self, context: &Context, lit: Lit, points: Range<u32>) {
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
            are_listed: u32::from(self.listed.is_some()),
            pad: [0; 2],
        };
        let bytes = bytemuck::bytes_of(&uniform);
        context.write(&self.batch, 0, bytes);
    }

    /// Makes the bind groups of a batch, one for each buffer of radiance, unless they are there.
    pub(super) fn bind(
        &mut self,
        context: &Context,
        strands: &StrandBuffers,
        volume: &Volume,
        batch: usize,
    ) {
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
                    (26, wgpu::BindingResource::TextureView(volume.axis_shares())),
                ];
                resources.extend(self.scattering.bindings());
                resources.extend(self.profile.binding());
                ((batch, into), bind(context, &layout, &resources))
            })
            .collect();
        self.shades[self.current].groups.extend(groups);
    }

    /// Makes pipeline and bind groups of narrow lights, unless they are there.
    pub(super) fn bind_narrow(&mut self, context: &Context, strands: &StrandBuffers) {
        if self.shades[self.current].narrow.is_some() {
            return;
        }
        let mut bindings = vec![
            (0, self.view.as_entire_binding()),
            (1, self.batch.as_entire_binding()),
            (4, strands.points.as_entire_binding()),
            (5, strands.tangents.as_entire_binding()),
            (6, strands.normals.as_entire_binding()),
            (10, self.counters.as_entire_binding()),
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
}
