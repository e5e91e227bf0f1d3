//! What a window shows after an edit, and when: pictures on the CPU that are drawn in steps.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use strandlight_cpu::InteractiveRenderer;
use strandlight_formats::Scene;
use strandlight_scene::{PreparedScene, RenderError};

use super::cpu_frames::{Options, edits};
use super::edits::median;
use super::process_clock::{core_seconds, since};

/// What the window gives the renderer at a time.
const BUDGET: Duration = Duration::from_millis(8);

/// From one kind of edit to its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowCost {
    /// What was edited.
    pub name: &'static str,
    /// Median milliseconds to the first picture of every light and term.
    pub first_milliseconds: f64,
    /// Mean seconds of all cores together to that one, where the system tells.
    pub first_core_seconds: Option<f64>,
    /// Median milliseconds to the last one.
    pub settled_milliseconds: f64,
    /// Longest time for which the window got no answer, milliseconds.
    pub longest_milliseconds: f64,
}

impl WindowCost {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "first_milliseconds": self.first_milliseconds,
            "first_core_seconds": self.first_core_seconds,
            "settled_milliseconds": self.settled_milliseconds,
            "longest_milliseconds": self.longest_milliseconds,
        })
    }
}

/// One edit.
struct Run {
    first: f64,
    first_core_seconds: Option<f64>,
    settled: f64,
    longest: f64,
}

/// Edits `scene` there and back in a window, as [`scene_costs`](super::cpu_frames::scene_costs) does.
///
/// # Errors
/// As there.
pub fn window_costs(
    scene: &Scene,
    options: &Options,
    drawn: &dyn Fn(),
) -> Result<Vec<WindowCost>, RenderError> {
    let mut base = PreparedScene::load(scene)?;
    base.size = options.size.unwrap_or(base.size);
    let mut live = InteractiveRenderer::new(base.clone());
    let mut costs = Vec::new();
    for (name, edit) in edits(&base) {
        let mut runs = Vec::new();
        for round in 0..=options.repetitions {
            for there in [true, false] {
                let run = watch(&mut live, |live| edit(live, &base, there))?;
                if round > 0 {
                    runs.push(run);
                }
                drawn();
            }
        }
        let seconds: Option<Vec<f64>> = runs.iter().map(|run| run.first_core_seconds).collect();
        let mean = |seconds: Vec<f64>| seconds.iter().sum::<f64>() / seconds.len() as f64;
        costs.push(WindowCost {
            name,
            first_milliseconds: median(runs.iter().map(|run| run.first)),
            first_core_seconds: seconds.map(mean),
            settled_milliseconds: median(runs.iter().map(|run| run.settled)),
            longest_milliseconds: runs.iter().fold(0.0, |most, run| run.longest.max(most)),
        });
    }
    Ok(costs)
}

/// Edits, and draws until nothing is left to do.
fn watch(
    live: &mut InteractiveRenderer,
    edit: impl FnOnce(&mut InteractiveRenderer) -> Result<(), RenderError>,
) -> Result<Run, RenderError> {
    let milliseconds = |since: Instant| 1e3 * since.elapsed().as_secs_f64();
    let (before, start) = (core_seconds(), Instant::now());
    edit(live)?;
    let mut longest = milliseconds(start);
    let mut first = None;
    loop {
        let step = Instant::now();
        let progress = live.advance(BUDGET)?;
        longest = milliseconds(step).max(longest);
        if progress.is_shown && progress.is_shaded && first.is_none() {
            first = Some((milliseconds(start), since(before)));
        }
        if progress.is_done {
            let settled = milliseconds(start);
            let (first, first_core_seconds) = first.unwrap_or((settled, since(before)));
            return Ok(Run {
                first,
                first_core_seconds,
                settled,
                longest,
            });
        }
    }
}
