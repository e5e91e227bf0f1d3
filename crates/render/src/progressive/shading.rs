//! Lighting of all points: the steps of a shading job, in the time that there is.

use super::ProgressiveRenderer;
use crate::device_scene::{DirtyFlags, Log, Stepped};
use crate::invalidation::Inputs;
use crate::passes::lighting::POINT_CHUNK;
use strandlight_scene::RenderError;

/// Points that the first job lights at a time.
const FIRST_CHUNK: f64 = 4096.0;

impl ProgressiveRenderer {
    /// Begins a job with what was set.
    pub(super) fn begin(&mut self) -> Result<(), RenderError> {
        let chunk = self.chunk();
        let log = &mut Log {
            clock: &mut self.clock,
            report: &mut self.report,
        };
        if self.core.begin(DirtyFlags::default(), false, chunk, log)? {
            self.picture.is_projected = false;
        }
        Ok(())
    }

    /// Lights all points by a guess, so that there is something to see.
    pub(super) fn preview(&mut self) -> Result<(), RenderError> {
        self.has_preview = false;
        let log = &mut Log {
            clock: &mut self.clock,
            report: &mut self.report,
        };
        self.core.preview(log)?;
        self.submitted("first look", 1.0)
    }

    /// Points to light at a time: what takes some milliseconds.
    fn chunk(&self) -> u32 {
        if self.is_still {
            return POINT_CHUNK;
        }
        let (_, n_lights) = self.core.lighting.lit();
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
        let log = &mut Log {
            clock: &mut self.clock,
            report: &mut self.report,
        };
        match self.core.step(chunk, log)? {
            None => Ok(()),
            Some(Stepped::Restarted) => {
                if self
                    .core
                    .job
                    .as_ref()
                    .is_some_and(|job| job.dirty.has(Inputs::POINTS))
                {
                    self.picture.is_projected = false;
                }
                Ok(())
            }
            Some(Stepped::Ran(stage, units)) => self.submitted(stage, units),
            Some(Stepped::Done(job)) => {
                let core = &self.core;
                if job.dirty.has(Inputs::PROXIES) {
                    self.draw
                        .set_proxies(&core.context, &core.ribbons, &core.lighting);
                }
                let counters = core.lighting.counters();
                if self.counters.0.send(&core.context, counters, 80, |_| ()) {
                    self.counters.1 = core.lighting.n_batches();
                }
                if self.picture.is_projected {
                    let view = self.drawn_view();
                    self.core.ribbons.set_view(&self.core.context, &view);
                }
                self.restart_samples();
                self.report.device_bytes = self.device_bytes();
                Ok(())
            }
        }
    }
}
