//! What windows and pages learn of a renderer that draws bit by bit: how far it has come, and what
//! it did.

use std::fmt;

use crate::material::EditReport;
use crate::stats::{DeviceStats, FrameStats, Stage, Stats, total};

/// How far the picture has come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureProgress {
    /// Samples a pixel in the picture that is shown; 0 where a visibility list takes their place.
    pub samples: u32,
    /// Samples a pixel that it will have.
    pub total_samples: u32,
    /// A picture of the view as it was last set is shown, a draft perhaps; or, where nobody waits for the device and
    /// the view keeps turning, one of a view that was set a little before.
    pub is_shown: bool,
    /// The light of all points is that of the scene and view as they were last set, in the shadows of shadow maps where there are such,
    /// if not of all of them yet; if not, the picture is a draft.
    pub is_shaded: bool,
    /// Nothing is left to do.
    pub is_done: bool,
    /// Estimate of the noise left in the picture: root mean square of the error over root mean
    /// square of the radiance. Unknown before there are two passes, and where there is none.
    pub noise: Option<f32>,
}

/// How much was made on a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ResourceCounts {
    /// Buffers.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// Pipelines compiled.
    pub pipelines: u64,
    /// Bind groups.
    pub bind_groups: u64,
    /// Times that points of the hair were written.
    pub geometry_uploads: u64,
    /// Bytes of all buffers and textures, those that are gone by now included.
    pub bytes: u64,
    /// Submissions to the queue.
    pub submissions: u64,
    /// Workgroups of compute shaders, of 64 to 256 threads each.
    pub workgroups: u64,
    /// Bytes written to buffers and textures from outside of the device.
    pub written_bytes: u64,
}

impl ResourceCounts {
    /// What came on top of `before`.
    pub fn since(self, before: ResourceCounts) -> ResourceCounts {
        ResourceCounts {
            buffers: self.buffers - before.buffers,
            textures: self.textures - before.textures,
            pipelines: self.pipelines - before.pipelines,
            bind_groups: self.bind_groups - before.bind_groups,
            geometry_uploads: self.geometry_uploads - before.geometry_uploads,
            bytes: self.bytes - before.bytes,
            submissions: self.submissions - before.submissions,
            workgroups: self.workgroups - before.workgroups,
            written_bytes: self.written_bytes - before.written_bytes,
        }
    }
}

/// One kind of work since the last edit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageReport {
    /// Its name, such as `voxelise`, `list`, `shadow maps`, `transmittance`, `tables`, `shade`, `display`.
    pub name: &'static str,
    /// How often it ran: maps, directions of light, slices of points, passes.
    pub runs: u32,
    /// Milliseconds until its results were there.
    pub milliseconds: f64,
    /// Milliseconds by the device's time stamps, where it has them: of the runs that were measured,
    /// as many as there were.
    pub gpu_milliseconds: Option<f64>,
    measured: u32,
    measured_milliseconds: f64,
}

/// What a renderer did since the last edit, and what the scene is.
#[derive(Clone, Debug, Default)]
pub struct RenderReport {
    /// Work by kind, in the order it first ran; what is not there was not needed.
    pub stages: Vec<StageReport>,
    /// Counts of the scene, and of the products of points and lights.
    pub stats: Stats,
    /// Which textures the last edit of the hair recomputed.
    pub edit: Option<EditReport>,
    /// What was made on the device since the last edit.
    pub counts: ResourceCounts,
    /// Bytes on the device; none on the CPU.
    pub device_bytes: u64,
    /// Times that all points were lit, since the start.
    pub shadings: u64,
}

impl RenderReport {
    /// The stage `name`, if it ran.
    pub fn stage(&self, name: &str) -> Option<&StageReport> {
        self.stages.iter().find(|stage| stage.name == name)
    }

    /// Runs of the stage `name`.
    pub fn runs(&self, name: &str) -> u32 {
        self.stage(name).map_or(0, |stage| stage.runs)
    }

    /// Milliseconds of all stages.
    pub fn milliseconds(&self) -> f64 {
        total(self.stages.iter().map(|stage| stage.milliseconds))
    }

    /// The same as statistics of a frame; `bytes` are those that a stage wrote, by its name.
    #[doc(hidden)]
    pub fn frame_stats(&self, bytes: impl Fn(&str) -> u64) -> Stats {
        let stage = |stage: &StageReport| Stage {
            name: stage.name,
            milliseconds: stage.milliseconds,
            bytes: bytes(stage.name),
            runs: stage.runs,
            gpu_milliseconds: stage.gpu_milliseconds,
        };
        let rebuilt = self.edit.iter().flat_map(EditReport::rebuilt);
        Stats {
            stages: self.stages.iter().map(stage).collect(),
            draws: self.runs("draw"),
            device: Some(DeviceStats {
                rebuilt: rebuilt.copied().collect(),
                pipelines: self.counts.pipelines,
                geometry_uploads: self.counts.geometry_uploads,
                bytes: self.device_bytes,
            }),
            ..self.stats.clone()
        }
    }

    fn stage_mut(&mut self, name: &'static str) -> &mut StageReport {
        let known = self.stages.iter().position(|stage| stage.name == name);
        let ix = known.unwrap_or(self.stages.len());
        if known.is_none() {
            self.stages.push(StageReport {
                name,
                ..StageReport::default()
            });
        }
        &mut self.stages[ix]
    }

    /// Counts a run that was submitted.
    #[doc(hidden)]
    pub fn ran(&mut self, name: &'static str) {
        self.stage_mut(name).runs += 1;
    }

    /// Adds time until results were there.
    #[doc(hidden)]
    pub fn took(&mut self, name: &'static str, seconds: f64) {
        self.stage_mut(name).milliseconds += 1e3 * seconds;
    }

    /// Adds the time of a run by the device's clock.
    #[doc(hidden)]
    pub fn measured(&mut self, name: &'static str, milliseconds: f64) {
        // Time stamps come late: of a stage that has not run they belong to the report before.
        let Some(stage) = self.stages.iter_mut().find(|stage| stage.name == name) else {
            return;
        };
        stage.measured += 1;
        stage.measured_milliseconds += milliseconds;
        let mean = stage.measured_milliseconds / f64::from(stage.measured);
        stage.gpu_milliseconds = Some(mean * f64::from(stage.runs.max(stage.measured)));
    }
}

impl fmt::Display for RenderReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        FrameStats(&self.frame_stats(|_| 0)).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_total_is_that_of_the_stages_and_never_below_zero() {
        let mut report = RenderReport::default();
        let text = report.to_string();
        assert!(text.contains(" 0.0 ms") && !text.contains('-'), "{text}");
        assert!(!Stats::default().to_string().contains('-'));
        report.ran("shade");
        report.took("shade", 0.25);
        report.ran("draw");
        report.took("draw", 1.0);
        let text = report.to_string();
        assert!(
            text.contains("250.0 ms") && text.contains("1250.0 ms"),
            "{text}"
        );
    }
}
