//! What frames of a script cost, as JSON. Times differ from run to run: they have a file of their
//! own, so that all others are the same whenever they are made.

use std::path::Path;
use strandlight_formats::counted;

use serde_json::{Value, json};

use strandlight_scene::material::PartReport;
use strandlight_scene::memory;
use strandlight_scene::stats::{Stage, Stats};
#[cfg(not(target_arch = "wasm32"))]
use strandlight_scene::{Backend, Picture, RenderError};
#[cfg(not(target_arch = "wasm32"))]
use web_time::Instant;

#[cfg(not(target_arch = "wasm32"))]
use crate::script::Frame;
use crate::session::Change;
#[cfg(not(target_arch = "wasm32"))]
use crate::viewer::Viewer;

/// Times of a list of frames.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    frames: Vec<Value>,
}

/// What a frame took.
#[derive(Clone, Debug)]
pub struct FrameTiming {
    /// File, as seen from the folder of the frames.
    pub file: String,
    /// Width and height.
    pub size: [u32; 2],
    /// Samples a pixel that were asked for.
    pub samples: u32,
    /// Seconds since the start of the scene's motion.
    pub time: f64,
    /// Until the picture was in memory.
    pub milliseconds: f64,
    /// What had to be made again since the frame before.
    pub changed: Change,
    /// What was done.
    pub stats: Stats,
}

#[cfg(not(target_arch = "wasm32"))]
impl FrameTiming {
    /// Draws a frame of a script for the file of this name.
    ///
    /// # Errors
    /// As [`Viewer::frame`].
    pub fn draw<B: Backend + ?Sized>(
        viewer: &mut Viewer<B>,
        frame: &Frame,
        file: String,
    ) -> Result<(Picture, FrameTiming), RenderError> {
        let start = Instant::now();
        let render = &viewer.session().scene().render;
        let size = frame.size.unwrap_or(render.size);
        let samples = frame.samples.unwrap_or(render.samples);
        let (picture, stats) = viewer.frame(size, samples)?;
        let timing = FrameTiming {
            file,
            size,
            samples,
            time: viewer.time(),
            milliseconds: 1e3 * start.elapsed().as_secs_f64(),
            changed: viewer.take_changes(),
            stats,
        };
        Ok((picture, timing))
    }
}

impl Timings {
    /// Adds a frame.
    pub fn push(&mut self, frame: FrameTiming) {
        self.frames.push(json!({
            "file": frame.file,
            "size": frame.size,
            "samples": frame.stats.samples,
            "time": frame.time,
            "milliseconds": frame.milliseconds,
            "changed": frame.changed.names(),
            "report": report(&frame.stats),
            "peak_bytes": memory::peak_bytes(),
        }));
    }

    /// What is said once they are written to `file`.
    pub fn line_about(&self, file: &Path) -> String {
        let frames = counted(self.frames.len(), "frame", "frames");
        format!("{}: {frames}", file.display())
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

/// What a renderer did for a frame: on a GPU, what it recomputed since the edit before.
fn report(stats: &Stats) -> Value {
    let Some(device) = &stats.device else {
        let stage = |stage: &Stage| {
            json!({
                "name": stage.name,
                "milliseconds": stage.milliseconds,
                "bytes": stage.bytes,
            })
        };
        return json!({
            "stages": stats.stages.iter().map(stage).collect::<Vec<_>>(),
            "skipped": stats.skipped,
        });
    };
    let stage = |stage: &Stage| {
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
    json!({
        "stages": stats.stages.iter().map(stage).collect::<Vec<_>>(),
        "rebuilt": device.rebuilt.iter().map(part).collect::<Vec<_>>(),
        "skipped": stats.skipped,
        "pipelines": device.pipelines,
        "geometry_uploads": device.geometry_uploads,
        "device_bytes": device.bytes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_as_people_do() {
        let mut timings = Timings::default();
        for said in ["t.json: 0 frames", "t.json: 1 frame", "t.json: 2 frames"] {
            assert_eq!(timings.line_about(Path::new("t.json")), said);
            timings.frames.push(json!({}));
        }
    }
}
