//! Lighting of all points: taking up what was set, and going through the steps of a cycle.

use super::Live;
use super::cycle::{Cycle, Dirt};
use crate::passes::deform::Deform;
use strandlight_scene::RenderError;
use strandlight_scene::camera::{ViewUniform, view_uniform};

/// Share of a side of the picture around it where points are lit too: they are there when the view
/// turns.
const MARGIN: f32 = 0.15;

/// Points that the first cycle lights at a time.
const FIRST_CHUNK: f64 = 4096.0;

impl Live {
    /// Takes up what was set since the last cycle began, and what one that is given up had taken.
    pub(super) fn begin(&mut self, given_up: Dirt, is_second_try: bool) -> Result<(), RenderError> {
        let mut dirt = std::mem::take(&mut self.wanted);
        dirt.add(&given_up);
        let (context, scene) = (&self.context, &self.scene);
        let mut steps = Vec::new();
        if dirt.points {
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
            let stamp = self.clock.stamp("voxelise");
            self.volume.fill(context, stamp);
            self.has_volume = true;
            self.report.ran("voxelise");
            let lighting = &mut self.lighting;
            lighting.set_points(context, scene, &self.volume, &self.strands, is_other);
            self.picture.is_projected = false;
        }
        if dirt.lights {
            let lighting = &mut self.lighting;
            lighting.set_lights(context, scene, &self.volume, &self.strands);
        } else if dirt.colors && self.lighting.set_colors(context, scene, &self.strands) {
            steps.extend(self.lighting.map_steps());
        }
        if dirt.proxies {
            let (volume, strands) = (&self.volume, &self.strands);
            self.lighting.set_proxies(context, scene, volume, strands)?;
        }
        if dirt.points || dirt.lights || dirt.shadows || dirt.proxies {
            steps = self.lighting.shadow_steps();
        }
        if let Some(range) = &dirt.paint {
            let lighting = &mut self.lighting;
            lighting.set_paint(context, scene, &scene.hair, range.clone());
        }
        if let Some(report) = &dirt.hair {
            let hair = &scene.hair;
            self.lighting.set_hair(context, scene, hair, report);
        }
        if dirt.densities {
            self.lighting.set_densities(scene);
        }
        if dirt.kind {
            self.lighting.set_kind(context, scene)?;
        }
        let mut view = view_uniform(
            &scene.camera,
            &scene.strands,
            scene.size,
            scene.radiance_scale(),
        );
        view.margin_px += MARGIN * scene.size[0].max(scene.size[1]) as f32;
        self.lighting.begin(context, &view);
        steps.extend(self.lighting.through_steps(view.forward));
        steps.extend(self.lighting.shade_steps(self.chunk()));
        self.cycle = Some(Cycle {
            dirt,
            view,
            n_steps: steps.len(),
            steps: steps.into(),
            is_second_try,
        });
        Ok(())
    }

    /// Lights all points by a guess, so that there is something to see.
    pub(super) fn take_first_look(&mut self) -> Result<(), RenderError> {
        let Some(cycle) = &self.cycle else {
            return Ok(());
        };
        self.has_first_look = false;
        self.front_scale = Some(cycle.view.radiance_scale);
        let stamp = self.clock.stamp("first look");
        let (context, scene, strands) = (&self.context, &self.scene, &self.strands);
        self.lighting
            .take_first_look(context, scene, strands, self.front, stamp)?;
        self.submitted("first look", 1.0)
    }

    /// Points to light at a time: what takes some milliseconds.
    fn chunk(&self) -> u32 {
        let (_, n_lights) = self.lighting.lit();
        let a_point = self
            .pacer
            .rate("shade")
            .map(|rate| rate * f64::from(n_lights.max(1)));
        let n = a_point.map_or(FIRST_CHUNK, |a_point| 4e-3 / a_point);
        n.clamp(1024.0, f64::from(1_u32 << 20)) as u32
    }

    /// Takes the next step of the cycle, or ends it.
    pub(super) fn light(&mut self) -> Result<(), RenderError> {
        let Some(cycle) = &mut self.cycle else {
            return Ok(());
        };
        if self.wanted.is_edited() && cycle.may_restart() {
            let dirt = std::mem::take(&mut cycle.dirt);
            self.lighting.forget_through();
            return self.begin(dirt, true);
        }
        if !self.has_volume {
            // After the first look, which needs none.
            self.has_volume = true;
            self.volume
                .fill(&self.context, self.clock.stamp("voxelise"));
            self.report.ran("voxelise");
        }
        let Some(step) = cycle.steps.pop_front() else {
            let view = cycle.view;
            if cycle.dirt.proxies {
                self.ribbons.set_proxies(&self.context, &self.lighting);
            }
            self.cycle = None;
            let counters = self.lighting.counters();
            if self.counters.0.send(&self.context, counters, 80, |_| ()) {
                self.counters.1 = self.lighting.n_batches();
            }
            self.swap(&view);
            return Ok(());
        };
        let stage = step.stage();
        let units = self.lighting.units(&step);
        let stamp = self.clock.stamp(stage);
        let (strands, volume) = (&self.strands, &self.volume);
        let back = 1 - self.front;
        self.lighting
            .submit(&self.context, strands, volume, &step, back, stamp);
        self.submitted(stage, units)
    }

    /// Shows the radiance that was found for `view`.
    fn swap(&mut self, view: &ViewUniform) {
        self.front = 1 - self.front;
        self.front_scale = Some(view.radiance_scale);
        if self.picture.is_projected {
            let view = self.drawn_view();
            self.ribbons.set_view(&self.context, &view);
        }
        self.restart_samples();
        self.report.device_bytes = self.device_bytes();
        self.report.stats.scattering = self.scene.scattering().name();
        self.report.stats.skipped = self.scene.skipped();
        self.report.shadings += 1;
    }
}
