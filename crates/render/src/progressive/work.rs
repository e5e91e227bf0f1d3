//! What is done next, and doing it: drawing here, lighting in `shading.rs`.

use std::time::Duration;

use web_time::Instant;

use super::{Drawn, PictureProgress, ProgressiveRenderer, pace};
use crate::hair_renderer::{DirtyFlags, ListDrawn};
use crate::invalidation::Inputs;
use crate::passes::noise::Noise;
use crate::passes::parts;
use crate::passes::resources::failed;
use crate::passes::stamp::Stamp;
use crate::passes::target::{PassSamples, band};
use strandlight_scene::RenderError;
use strandlight_scene::sampling::PASS_SAMPLES;

/// Passes of a draft: more are not drawn while points are being lit.
const DRAFT_PASSES: u32 = 4;

/// The next piece of work.
enum Work {
    Project,
    /// Draws the picture from the visibility list.
    Resolve,
    Pass,
    Begin,
    Preview,
    Light,
}

impl ProgressiveRenderer {
    /// Works at most about `budget` on the device, one step at least.
    ///
    /// # Errors
    /// [`RenderError::DeviceLost`], after which a new context and a new `ProgressiveRenderer` are
    /// needed, or whatever else the device refuses.
    pub fn advance(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        if !self.pacer.is_waiting() {
            return self.advance_step_by_step(budget);
        }
        let context = self.hair.context.clone();
        context.collect(|| self.advance_step_by_step(budget))
    }

    fn advance_step_by_step(&mut self, budget: Duration) -> Result<PictureProgress, RenderError> {
        // Lets callbacks run; a browser runs them anyway.
        let _ = self.hair.context.device.poll(wgpu::PollType::Poll);
        self.hair.context.check("advance").map_err(failed)?;
        self.is_listing = false;
        if !self.is_still {
            self.hair.set_draws_by_list(self.is_by_list());
        }
        self.take_counters();
        self.hair.take_seen();
        self.noise.take();
        let report = &mut self.hair.report;
        self.hair.clock.take(|name, ms| report.measured(name, ms));
        self.pacer.begin(budget, |(name, _, _, seconds)| {
            report.took(name, seconds);
        });
        if self.target.is_some() {
            let drafts = self.picture.passes;
            let mut is_first = true;
            while let Some(work) = self.next(drafts) {
                if !self.has_time(&work, is_first) {
                    break;
                }
                // Not worth a turn of their own.
                let is_small = matches!(work, Work::Project | Work::Begin | Work::Preview);
                // A turn has light besides a picture by list, or a view that turns would never be lit.
                is_first = (is_small || matches!(work, Work::Resolve)) && is_first;
                self.work(&work)?;
            }
            let is_finished = self.picture.passes >= self.n_passes();
            if self.picture.shown < self.picture.passes && (is_finished || !self.is_still) {
                self.show_passes()?;
            }
            self.hair.clock.start_reading(&self.hair.context);
            self.flush()?;
            self.hair.take_seen();
        }
        self.hair.report.counts = self.hair.context.counts().since(self.hair.counts_before);
        Ok(self.progress())
    }

    /// Waits for what was submitted, where anybody waits.
    pub(super) fn flush(&mut self) -> Result<(), RenderError> {
        let report = &mut self.hair.report;
        let took = |(name, _, _, seconds): pace::Finished| report.took(name, seconds);
        self.pacer.flush(&self.hair.context, took)
    }

    /// Notes the counts of products that the last shading left, once they are there.
    pub(super) fn take_counters(&mut self) {
        if let Some(counts) = self.counters.0.take::<u64>() {
            self.hair
                .report
                .stats
                .set_counters(&counts, self.counters.1);
        }
    }

    /// What is to be done next, `drafts` passes having been there when this turn began.
    fn next(&self, drafts: u32) -> Option<Work> {
        let is_resting = self.hair.job.is_none() && self.hair.dirty.is_clean();
        let drawing = match self.hair.front_scale.is_some() {
            true => self.next_drawing(is_resting, drafts),
            false => None,
        };
        match &self.hair.job {
            _ if drawing.is_some() => drawing,
            Some(_) if self.hair.front_scale.is_none() && self.has_preview => Some(Work::Preview),
            Some(job) if self.is_listing && job.awaits_list() && job.steps.is_empty() => None,
            Some(_) => Some(Work::Light),
            None if !is_resting => Some(Work::Begin),
            None => None,
        }
    }

    /// What of the picture is drawn before points are lit further.
    fn next_drawing(&self, is_resting: bool, drafts: u32) -> Option<Work> {
        let passes = self.picture.passes;
        let cycle = self.hair.job.as_ref().map(|job| &job.dirty);
        if self.is_by_list() {
            // Until a job is done its proxies are there and their light is not, but for a first look.
            let is_unlit = cycle.is_some_and(|dirty| dirty.has(Inputs::PROXIES));
            let may_draw =
                passes == 0 && !self.is_listing && !(is_unlit && self.hair.report.shadings > 0);
            return may_draw.then_some(Work::Resolve);
        }
        if self.hair.is_partly_lit() {
            return None;
        }
        if !self.hair.is_projected {
            return Some(Work::Project);
        }
        let moves = |dirty: &DirtyFlags| dirty.has(Inputs::VIEW | Inputs::POINTS);
        let is_draft = moves(&self.hair.dirty) || cycle.is_some_and(moves);
        // A first look is not worth more.
        let most = if self.hair.report.shadings == 0 {
            1
        } else {
            DRAFT_PASSES
        };
        // While points are being lit, a draft: one pass in a turn.
        let may_draw = match is_resting {
            true => passes < self.n_passes(),
            false => passes == 0 || is_draft && passes == drafts && passes < most,
        };
        may_draw.then_some(Work::Pass)
    }

    fn has_time(&self, work: &Work, is_first: bool) -> bool {
        let (stage, units) = match work {
            Work::Begin | Work::Preview => return true,
            Work::Project => ("project", 1.0),
            Work::Resolve => ("draw", 1.0),
            Work::Pass => ("draw", 1.0),
            Work::Light => {
                let next = self.hair.job.as_ref().and_then(|job| job.steps.front());
                let Some(step) = next else {
                    return true;
                };
                (step.stage(), self.hair.lighting.units(step))
            }
        };
        self.pacer.has_time(stage, units, is_first)
    }

    fn work(&mut self, work: &Work) -> Result<(), RenderError> {
        match work {
            Work::Begin => self.begin(),
            Work::Light => self.light(),
            Work::Preview => self.preview(),
            Work::Project => self.project_drawn(),
            Work::Resolve => self.draw_list(),
            Work::Pass => self.draw_band(),
        }
    }

    /// Projects the strands as the picture sees them.
    fn project_drawn(&mut self) -> Result<(), RenderError> {
        let view = self.drawn_view();
        self.hair.project(&view);
        self.picture.band_ends = parts::bands(&view, &self.hair.scene.strands, &self.parts);
        self.restart_samples();
        self.submitted("project", 1.0)
    }

    /// Draws the picture from the visibility list, or what may be shown until there is one.
    fn draw_list(&mut self) -> Result<(), RenderError> {
        if !self.hair.has_list(&self.drawn_view()) {
            // Listing may wait for the device: not for what others submitted.
            self.flush()?;
        }
        match self.resolve(true, &mut |_| ())? {
            ListDrawn::Of { is_asked, .. } => {
                self.picture.is_of_before = !is_asked;
                if is_asked {
                    self.picture.passes = 1;
                    return Ok(());
                }
                self.show_passes()
            }
            ListDrawn::NotYet => {
                self.is_listing = true;
                Ok(())
            }
            ListDrawn::NoRoom => {
                self.picture.is_sampled = true;
                self.hair.set_draws_by_list(false);
                Ok(())
            }
        }
    }

    /// Draws the next band of a pass of samples.
    fn draw_band(&mut self) -> Result<(), RenderError> {
        let samples = self.total_samples();
        let Drawn {
            band_ends,
            bands,
            passes,
            ..
        } = &mut self.picture;
        // Bands are not measured one by one.
        let stamp = match band_ends.len() {
            ..=1 => self.hair.clock.stamp("draw"),
            _ => Stamp::default(),
        };
        let (hair, film) = (&self.hair, &self.film);
        let Some(target) = &mut self.target else {
            return Ok(());
        };
        if *passes == 0 && *bands == 0 {
            target.clear(&hair.context);
        }
        let of_pass = PassSamples::of(*passes, samples);
        let band = band(band_ends, *bands);
        let (context, size) = (&hair.context, target.size());
        let drawn = (film, &hair.ribbons);
        target.pass(context, drawn, of_pass, &band, stamp, |pass| {
            film.draw(pass, size, hair.front);
            hair.draw(pass);
        });
        *bands += 1;
        if *bands < band_ends.len() {
            return self.submitted("draw", 1.0);
        }
        *bands = 0;
        *passes += 1;
        let passes = *passes;
        self.submitted("draw", 1.0)?;
        let is_whole = PASS_SAMPLES * passes <= samples;
        let is_due = !self.is_still && is_whole && Noise::is_due(passes);
        if let Some(target) = self.target.as_ref().filter(|_| is_due) {
            let stamp = self.hair.clock.stamp("noise");
            self.noise.look(&self.hair.context, target, passes, stamp);
            self.submitted("noise", 1.0)?;
        }
        Ok(())
    }

    /// Shows the passes that are drawn.
    fn show_passes(&mut self) -> Result<(), RenderError> {
        let passes = self.picture.passes;
        self.compose(match self.is_by_list() {
            true => 1,
            false => self.samples_of(passes),
        })?;
        let Some(target) = self.target.as_ref().filter(|_| self.tile.is_none()) else {
            // Tiles are not shown.
            self.picture.shown = passes;
            return Ok(());
        };
        let (context, ribbons) = (&self.hair.context, &self.hair.ribbons);
        let stamp = self.hair.clock.stamp("display");
        let grade = (self.hair.scene.exposure, &self.hair.scene.display);
        if let Some(next) = self.next_screen.take() {
            self.screen = next;
        }
        let from = (ribbons, target);
        self.screen
            .show(context, &mut self.show, from, grade, stamp);
        self.picture.shown = self.picture.passes;
        self.submitted("display", 1.0)
    }

    /// Tells the pacer of what was submitted for a list, whose run the report has. To be called before anything else is
    /// submitted, whose time that would be.
    pub(super) fn submitted_list(&mut self) -> Result<(), RenderError> {
        if !self.hair.has_submitted_list() {
            return Ok(());
        }
        let report = &mut self.hair.report;
        let took = |(name, _, _, seconds): pace::Finished| report.took(name, seconds);
        self.pacer
            .submitted(&self.hair.context, "list", (1.0, true), took)
    }

    /// Draws the sums of the target from the visibility list, if one is there.
    pub(super) fn resolve(
        &mut self,
        may_be_draft: bool,
        observer: &mut dyn FnMut(f64),
    ) -> Result<ListDrawn, RenderError> {
        let Some(target) = &self.target else {
            return Ok(ListDrawn::NoRoom);
        };
        let (view, sums) = (self.drawn_view(), target.sums().clone());
        let drawn = self.hair.find_list(&view)?;
        self.submitted_list()?;
        if let ListDrawn::Of { view, .. } = drawn {
            let start = Instant::now();
            self.hair.draw_list(&sums, may_be_draft, observer)?;
            self.hair.ribbons.set_view(&self.hair.context, &view);
            self.pacer.began(start);
            self.submitted("draw", 1.0)?;
        }
        Ok(drawn)
    }

    /// Puts the background behind sums of so many samples.
    pub(super) fn compose(&mut self, samples: u32) -> Result<(), RenderError> {
        let Some(target) = &mut self.target else {
            return Ok(());
        };
        let (context, scene) = (&self.hair.context, &self.hair.scene);
        self.film.set_behind(context, scene)?;
        let (film, ribbons) = (&self.film, &self.hair.ribbons);
        let lit = self.hair.lighting.lit();
        let stamp = self.hair.clock.stamp("composite");
        target.composite(context, film, ribbons, (scene, samples), lit, stamp);
        self.hair.report.device_bytes = self.device_bytes();
        self.submitted("composite", 1.0)
    }
}
