//! Lighting of all points: the steps of a shading job, in the time that there is.

use super::ProgressiveRenderer;
use crate::hair_renderer::{DirtyFlags, Stepped};
use crate::invalidation::Inputs;
use crate::passes::lighting::{COUNTER_BYTES, POINT_CHUNK};
use strandlight_scene::RenderError;

/// Points that the first job lights at a time.
const FIRST_CHUNK: f64 = 4096.0;

impl ProgressiveRenderer {
    /// Begins a job with what was set.
    pub(super) fn begin(&mut self) -> Result<(), RenderError> {
        let chunk = self.chunk();
        if self.is_by_list() {
            // Listing may wait for the device: not for what others submitted.
            self.flush()?;
        }
        self.hair.begin(DirtyFlags::default(), false, chunk)?;
        self.submitted_list()?;
        self.has_begun();
        Ok(())
    }

    /// A list of other points is drawn; there may be room for one now.
    fn has_begun(&mut self) {
        let Some(job) = &self.hair.job else {
            return;
        };
        let moved = job.dirty.has(Inputs::POINTS);
        let was_sampled = !self.is_by_list();
        if !self.is_still && job.dirty.has(Inputs::POINTS | Inputs::PROXIES) {
            self.picture.is_sampled = false;
        }
        if self.is_by_list() && (moved || was_sampled) {
            self.restart_samples();
        }
    }

    /// Lights all points by a guess, so that there is something to see.
    pub(super) fn preview(&mut self) -> Result<(), RenderError> {
        self.has_preview = false;
        self.hair.preview()?;
        self.submitted("first look", 1.0)
    }

    /// Points to light at a time: what takes some milliseconds.
    fn chunk(&self) -> u32 {
        if self.is_still {
            return POINT_CHUNK;
        }
        let (_, n_lights) = self.hair.lighting.lit();
        let seconds_per_point = self
            .pacer
            .rate("shade")
            .map(|rate| rate * f64::from(n_lights.max(1)));
        let n = seconds_per_point.map_or(FIRST_CHUNK, |seconds| 4e-3 / seconds);
        n.clamp(1024.0, f64::from(1_u32 << 20)) as u32
    }

    /// Takes the next step of the job, or ends it.
    pub(super) fn light(&mut self) -> Result<(), RenderError> {
        let chunk = self.chunk();
        let stepped = self.hair.step(chunk)?;
        self.submitted_list()?;
        match stepped {
            None | Some(Stepped::Listed) => Ok(()),
            Some(Stepped::AwaitsList) => {
                self.is_listing = true;
                Ok(())
            }
            Some(Stepped::Restarted) => {
                self.has_begun();
                Ok(())
            }
            Some(Stepped::Ran {
                stage,
                units,
                is_counted: true,
            }) => self.submitted(stage, units),
            Some(Stepped::Ran { stage, units, .. }) => self.submitted_uncounted(stage, units),
            Some(Stepped::Done(job)) => {
                let hair = &self.hair;
                if job.dirty.has(Inputs::PROXIES) {
                    self.film
                        .set_proxies(&hair.context, &hair.ribbons, &hair.lighting);
                }
                let counters = hair.lighting.counters();
                if self
                    .counters
                    .0
                    .send(&hair.context, counters, COUNTER_BYTES, |_| ())
                {
                    self.counters.1 = hair.lighting.n_batches();
                }
                if self.hair.is_projected {
                    let view = self.drawn_view();
                    self.hair.ribbons.set_view(&self.hair.context, &view);
                }
                self.restart_samples();
                self.hair.report.device_bytes = self.device_bytes();
                Ok(())
            }
        }
    }
}
