//! What frames of a script cost, as JSON. Times differ from run to run: they have a file of their
//! own, so that all others are the same whenever they are made.

use serde_json::{Value, json};

use crate::session::Change;
use strandlight_render::progressive::{RenderReport, StageReport};
use strandlight_scene::material::PartReport;
use strandlight_scene::memory;
use strandlight_scene::stats::{Stage, Stats};

/// Times of a list of frames.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    frames: Vec<Value>,
}

/// A frame that was made.
#[derive(Clone, Debug)]
pub struct Made {
    /// File, as seen from the folder of the frames.
    pub file: String,
    /// Width and height.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub samples: u32,
    /// Seconds since the start of the scene's motion.
    pub time: f64,
    /// Until the picture was in memory.
    pub milliseconds: f64,
    /// What had to be made again since the frame before.
    pub changed: Change,
    /// What was done: see [`of_live`] and [`of_stats`].
    pub report: Value,
}

impl Timings {
    /// Adds a frame.
    pub fn push(&mut self, made: Made) {
        self.frames.push(json!({
            "file": made.file,
            "size": made.size,
            "samples": made.samples,
            "time": made.time,
            "milliseconds": made.milliseconds,
            "changed": made.changed.names(),
            "report": made.report,
            "peak_bytes": memory::peak_bytes(),
        }));
    }

    /// Number of frames.
    pub fn n_frames(&self) -> usize {
        self.frames.len()
    }

    /// The document: the scene's file, where it was rendered, milliseconds until it was open.
    pub fn document(&self, scene: &str, backend: &str, open_milliseconds: f64) -> Value {
        json!({
            "scene": scene,
            "backend": backend,
            "open_milliseconds": open_milliseconds,
            "frames": self.frames,
            "peak_bytes": memory::peak_bytes(),
        })
    }
}

/// What the live renderer did for a frame.
pub fn of_live(report: &RenderReport) -> Value {
    let stage = |stage: &StageReport| {
        json!({
            "name": stage.name,
            "runs": stage.runs,
            "milliseconds": stage.milliseconds,
            "gpu_milliseconds": stage.gpu_milliseconds,
        })
    };
    let part = |part: &PartReport| {
        json!({
            "part": part.name,
            "microseconds": part.microseconds,
            "gpu_bytes": part.gpu_bytes,
        })
    };
    let rebuilt = report.edit.iter().flat_map(|edit| edit.rebuilt());
    json!({
        "stages": report.stages.iter().map(stage).collect::<Vec<_>>(),
        "rebuilt": rebuilt.map(part).collect::<Vec<_>>(),
        "skipped": report.stats.skipped,
        "pipelines": report.counts.pipelines,
        "geometry_uploads": report.counts.geometry_uploads,
        "device_bytes": report.device_bytes,
    })
}

/// What a renderer that recomputes everything did for a frame.
pub fn of_stats(stats: &Stats) -> Value {
    let stage = |stage: &Stage| {
        json!({
            "name": stage.name,
            "milliseconds": stage.milliseconds,
            "bytes": stage.bytes,
        })
    };
    json!({
        "stages": stats.stages.iter().map(stage).collect::<Vec<_>>(),
        "skipped": stats.skipped,
    })
}
