//! Shading of all points, step by step.

use super::HairRenderer;
use super::job::{DirtyFlags, ShadingJob, Stepped};
use super::visible_list::list_view;
use crate::invalidation::Inputs;
use crate::passes::deform::Deform;
use crate::passes::step::Step;
use crate::passes::strand_pass::{StrandFeatures, StrandPass};
use strandlight_scene::RenderError;
use strandlight_scene::camera::{ViewUniform, view_uniform};

impl HairRenderer {
    /// Takes up what was set since the last job began, and what one that is given up had taken, and
    /// plans the next job, which shades at most `chunk` points in a step.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub(crate) fn begin(
        &mut self,
        given_up: DirtyFlags,
        is_second_try: bool,
        chunk: u32,
    ) -> Result<(), RenderError> {
        let mut dirty = std::mem::take(&mut self.dirty);
        dirty.add(&given_up);
        if dirty.has(Inputs::POINTS) {
            self.take_points()?;
        }
        if let Some(visible) = &mut self.visible
            && dirty.has(Inputs::POINTS | Inputs::PROXIES)
        {
            visible.forget();
        }
        let steps = self.take_lights(&dirty)?;
        self.take_hair(&dirty)?;
        let mut view = view_uniform(
            &self.scene.camera,
            &self.scene.strands,
            self.scene.size,
            self.scene.radiance_scale(),
        );
        self.take_widths(&view, &dirty)?;
        view.margin_px += self.margin * self.scene.size[0].max(self.scene.size[1]) as f32;
        self.lighting.begin(&self.context, &view);
        self.is_projected &= !dirty.has(Inputs::POINTS);
        let draws_by_list = self.draws_by_list && self.visible.is_some();
        self.job = Some(ShadingJob {
            dirty,
            view,
            n_steps: steps.len(),
            steps: steps.into(),
            chunk,
            awaited_list: draws_by_list.then(|| list_view(&view)),
            is_second_try,
        });
        if draws_by_list {
            self.take_list()?;
        } else {
            self.lighting.shade_listed(&self.context, None, chunk);
            self.plan_shading();
        }
        Ok(())
    }

    /// The strands are elsewhere.
    fn take_points(&mut self) -> Result<(), RenderError> {
        let (context, scene) = (&self.context, &self.scene);
        match &self.wind {
            Some(wind) => {
                let deform = match self.deform.take() {
                    Some(deform) => deform,
                    None => Deform::new(context, &scene.strands, &self.strands)?,
                };
                deform.run(context, wind, self.clock.stamp("deform"));
                self.deform = Some(deform);
                self.report.ran("deform");
            }
            None => self.strands.update(context, &scene.strands),
        }
        let is_other = self.volume.fit(context, &scene.strands, &self.strands);
        self.volume.fill(context, self.clock.stamp("voxelise"));
        self.has_volume = true;
        self.report.ran("voxelise");
        let lighting = &mut self.lighting;
        lighting.set_points(context, scene, &self.volume, &self.strands, is_other)
    }

    /// Sets what changed of lights and proxies; answers the steps of their shadows.
    fn take_lights(&mut self, dirty: &DirtyFlags) -> Result<Vec<Step>, RenderError> {
        let (context, scene) = (&self.context, &self.scene);
        let lighting = &mut self.lighting;
        let mut steps = Vec::new();
        if dirty.has(Inputs::LIGHTS) {
            lighting.set_lights(context, scene, &self.volume, &self.strands);
        } else if dirty.has(Inputs::LIGHT_COLORS)
            && lighting.set_colors(context, scene, &self.strands)
        {
            steps.extend(lighting.map_steps());
        }
        if dirty.has(Inputs::PROXIES) {
            lighting.set_proxies(context, scene, &self.volume, &self.strands)?;
        }
        if dirty.is_stale("transmittance") {
            steps = lighting.shadow_steps();
        }
        Ok(steps)
    }

    /// Sets what changed of the fibre, of paint and of multiple scattering.
    fn take_hair(&mut self, dirty: &DirtyFlags) -> Result<(), RenderError> {
        let (context, scene) = (&self.context, &self.scene);
        let lighting = &mut self.lighting;
        if let Some(range) = &dirty.paint {
            lighting.set_paint(context, scene, &scene.hair, range.clone());
        }
        if let Some(report) = &dirty.hair {
            lighting.set_hair(context, scene, &scene.hair, report);
        }
        if dirty.has(Inputs::DENSITIES) {
            lighting.set_densities(scene);
        }
        lighting.set_multiple(context, scene, dirty.hair.as_ref())
    }

    /// Sets how strands are drawn in a view: as wide ones, from near by, or along segments.
    fn take_widths(&mut self, view: &ViewUniform, dirty: &DirtyFlags) -> Result<(), RenderError> {
        let (context, scene) = (&self.context, &self.scene);
        let kept = self.lighting.profile().filter(|_| dirty.hair.is_none());
        let profile = scene.width_profile(view, kept);
        self.ribbons.even = profile.as_ref().map_or([0.0; 4], |profile| profile.even);
        self.lighting.set_profile(context, profile);
        self.lighting.set_kind(context, scene)?;
        let is_close_up = scene.is_close_up(view);
        self.ribbons
            .set_close_up(context, &self.strands, is_close_up)?;
        let drawn = StrandFeatures {
            is_narrow: self.strand_pass.drawn.is_narrow || self.lighting.narrow().have_room(),
            is_wide: self.lighting.has_profile(),
            is_close_up,
        };
        if self.strand_pass.drawn != drawn {
            let (options, lit) = (self.options.as_ref(), self.lighting.lit_points());
            self.strand_pass = StrandPass::new(context, options, &self.ribbons, &lit, drawn)?;
            self.is_projected = false;
        }
        Ok(())
    }

    /// Plans the steps of the job after those of shadows, once it is known which points are shaded.
    pub(super) fn plan_shading(&mut self) {
        let Some(job) = &mut self.job else {
            return;
        };
        let lighting = &mut self.lighting;
        let (eye, forward) = (job.view.eye, job.view.forward);
        let mut steps = lighting.through_steps(eye, forward);
        steps.extend(lighting.table_steps());
        steps.extend(lighting.shade_steps(job.chunk));
        job.n_steps += steps.len();
        job.steps.extend(steps);
    }

    /// Lights all points of the shown buffer by a guess, so that there is something to see before
    /// the first job is done.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub(crate) fn preview(&mut self) -> Result<(), RenderError> {
        let Some(job) = &self.job else {
            return Ok(());
        };
        self.front_scale = Some(job.view.radiance_scale);
        let stamp = self.clock.stamp("first look");
        self.lighting
            .take_preview(&self.context, &self.scene, &self.strands, self.front, stamp)
    }

    /// Runs the next step of the job, or ends it. [`None`] if there is no job.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub(crate) fn step(&mut self, chunk: u32) -> Result<Option<Stepped>, RenderError> {
        self.take_seen();
        let Some(job) = &mut self.job else {
            return Ok(None);
        };
        if self.dirty.is_edited() && job.may_restart() {
            let dirty = std::mem::take(&mut job.dirty);
            self.lighting.forget_through();
            self.begin(dirty, true, chunk)?;
            return Ok(Some(Stepped::Restarted));
        }
        if !self.has_volume {
            // After the preview, which needs none.
            self.has_volume = true;
            self.volume
                .fill(&self.context, self.clock.stamp("voxelise"));
            self.report.ran("voxelise");
        }
        let is_known = !job.awaits_list() || self.take_list()?;
        if self
            .visible
            .as_ref()
            .is_some_and(|visible| visible.has_submitted)
        {
            // Whoever times it does so before anything else is submitted.
            return Ok(Some(Stepped::Listed));
        }
        let Some(job) = &mut self.job else {
            return Ok(None);
        };
        if !is_known && job.steps.is_empty() {
            return Ok(Some(Stepped::AwaitsList));
        }
        let Some(step) = job.steps.pop_front() else {
            self.front = 1 - self.front;
            self.front_list = self.lighting.listed().map(|listed| listed.list);
            self.front_scale = Some(job.view.radiance_scale);
            self.report.stats.scattering = self.scene.scattering().name();
            self.report.stats.skipped = self.scene.skipped();
            self.report.shadings += 1;
            return Ok(self.job.take().map(|job| Stepped::Done(Box::new(job))));
        };
        let stage = step.stage();
        let units = self.lighting.units(&step);
        let is_counted = self.lighting.is_counted(&step);
        let stamp = self.clock.stamp(stage);
        let (strands, volume) = (&self.strands, &self.volume);
        let back = 1 - self.front;
        self.lighting
            .submit(&self.context, strands, volume, &step, back, stamp);
        Ok(Some(Stepped::Ran {
            stage,
            units,
            is_counted,
        }))
    }
}
