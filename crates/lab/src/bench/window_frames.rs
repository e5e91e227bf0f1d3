//! What a window shows after an edit, and when: pictures on the CPU that are drawn in steps.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use strandlight_cpu::BackgroundRenderer;
use strandlight_formats::Scene;
use strandlight_scene::{PreparedScene, RenderError};

use super::cpu_frames::{Options, edits};
use super::edits::median;
use super::process_clock::{core_seconds, since};

/// How long the window waits for the renderer's thread before it looks for input again.
const BUDGET: Duration = Duration::from_millis(4);

/// From one kind of edit to its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowCost {
    /// What was edited.
    pub name: &'static str,
    /// Median milliseconds to the first new picture, a draft perhaps.
    pub shown_milliseconds: f64,
    /// How far that one is from the last one at most: relative RMS difference of their levels.
    pub shown_off: f64,
    /// Median milliseconds to the first picture of every light and term.
    pub first_milliseconds: f64,
    /// Mean seconds of all cores together to that one, where the system tells.
    pub first_core_seconds: Option<f64>,
    /// Median milliseconds to the last one.
    pub settled_milliseconds: f64,
    /// Longest time that an edit, or the wait for something new after it, kept the window from input, milliseconds.
    pub longest_milliseconds: f64,
}

impl WindowCost {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "shown_milliseconds": self.shown_milliseconds,
            "shown_off": self.shown_off,
            "first_milliseconds": self.first_milliseconds,
            "first_core_seconds": self.first_core_seconds,
            "settled_milliseconds": self.settled_milliseconds,
            "longest_milliseconds": self.longest_milliseconds,
        })
    }
}

/// One edit.
struct Run {
    shown: f64,
    off: f64,
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
    let mut live = BackgroundRenderer::new(base.clone());
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
            shown_milliseconds: median(runs.iter().map(|run| run.shown)),
            shown_off: runs.iter().fold(0.0, |most, run| run.off.max(most)),
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
    live: &mut BackgroundRenderer,
    edit: impl FnOnce(&mut BackgroundRenderer) -> Result<(), RenderError>,
) -> Result<Run, RenderError> {
    let milliseconds = |since: Instant| 1e3 * since.elapsed().as_secs_f64();
    let (before, start) = (core_seconds(), Instant::now());
    let version = live.display().version;
    edit(live)?;
    let mut longest = milliseconds(start);
    let mut first = None;
    let mut shown = None;
    loop {
        let step = Instant::now();
        let progress = live.advance(BUDGET)?;
        longest = milliseconds(step).max(longest);
        let display = live.display();
        if display.version != version && shown.is_none() {
            shown = Some((milliseconds(start), display.pixels.to_vec()));
        }
        if progress.is_shown && progress.is_shaded && first.is_none() {
            first = Some((milliseconds(start), since(before)));
        }
        if progress.is_done {
            let settled = milliseconds(start);
            let (first, first_core_seconds) = first.unwrap_or((settled, since(before)));
            let (shown, off) = match shown {
                Some((shown, pixels)) => (shown, difference(&pixels, live.display().pixels)),
                None => (settled, 0.0),
            };
            return Ok(Run {
                shown,
                off,
                first,
                first_core_seconds,
                settled,
                longest,
            });
        }
    }
}

/// Relative RMS difference of the levels of a picture, without alpha, from those of `last`; none of pictures
/// of one size that are black, and infinite between sizes.
fn difference(pixels: &[[u8; 4]], last: &[[u8; 4]]) -> f64 {
    if pixels.len() != last.len() {
        return f64::INFINITY;
    }
    let square = |level: u8| u64::from(level) * u64::from(level);
    let (mut off, mut all) = (0, 0);
    for (a, b) in pixels.iter().zip(last) {
        for (a, b) in a.iter().zip(b).take(3) {
            off += square(a.abs_diff(*b));
            all += square(*b);
        }
    }
    match off {
        0 => 0.0,
        _ => (off as f64 / all as f64).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_differ_by_their_levels_without_alpha() {
        let picture = |level: u8| vec![[level, level, level, 255]; 3];
        assert_eq!(difference(&picture(100), &picture(100)), 0.0);
        assert!((difference(&picture(95), &picture(100)) - 0.05).abs() < 1e-12);
        assert_eq!(difference(&picture(0), &picture(0)), 0.0);
        assert_eq!(difference(&picture(1), &[]), f64::INFINITY);
    }
}
