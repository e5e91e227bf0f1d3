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

/// How little a picture that is near the last one differs from it: relative RMS of their levels.
pub const NEAR: f64 = 0.05;

/// From one kind of edit to its pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct WindowCost {
    /// What was edited.
    pub name: &'static str,
    /// Median milliseconds to the first new picture from which on all are [`NEAR`] the last one.
    pub near_milliseconds: f64,
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
            "near_milliseconds": self.near_milliseconds,
            "first_milliseconds": self.first_milliseconds,
            "first_core_seconds": self.first_core_seconds,
            "settled_milliseconds": self.settled_milliseconds,
            "longest_milliseconds": self.longest_milliseconds,
        })
    }
}

/// One edit.
struct Run {
    near: f64,
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
            near_milliseconds: median(runs.iter().map(|run| run.near)),
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
    let mut version = live.display().version;
    edit(live)?;
    let mut longest = milliseconds(start);
    let mut first = None;
    let mut shown = Vec::new();
    loop {
        let step = Instant::now();
        let progress = live.advance(BUDGET)?;
        longest = milliseconds(step).max(longest);
        let display = live.display();
        if display.version != version {
            version = display.version;
            shown.push((milliseconds(start), display.pixels.to_vec()));
        }
        if progress.is_shown && progress.is_shaded && first.is_none() {
            first = Some((milliseconds(start), since(before)));
        }
        if progress.is_done {
            let settled = milliseconds(start);
            let (first, first_core_seconds) = first.unwrap_or((settled, since(before)));
            return Ok(Run {
                near: near(&shown).unwrap_or(settled),
                first,
                first_core_seconds,
                settled,
                longest,
            });
        }
    }
}

/// When the first of those at the end of `shown` was there that are near the last.
fn near(shown: &[(f64, Vec<[u8; 4]>)]) -> Option<f64> {
    let (_, last) = shown.last()?;
    let pictures = shown.iter().rev();
    let near = pictures.take_while(|(_, pixels)| difference(pixels, last) <= NEAR);
    near.last().map(|(milliseconds, _)| *milliseconds)
}

/// Relative RMS difference of the levels of a picture from those of `last`; none of pictures of one size
/// that are black, and infinite between sizes.
fn difference(pixels: &[[u8; 4]], last: &[[u8; 4]]) -> f64 {
    if pixels.len() != last.len() {
        return f64::INFINITY;
    }
    let square = |level: u8| u64::from(level) * u64::from(level);
    let levels = pixels.as_flattened().iter().zip(last.as_flattened());
    let (mut off, mut all) = (0, 0);
    for (a, b) in levels {
        off += square(a.abs_diff(*b));
        all += square(*b);
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
    fn pictures_are_near_from_the_first_that_stays_so() {
        let picture = |level: u8| vec![[level; 4]; 3];
        let shown = |levels: &[u8]| {
            let times = levels.iter().zip(1..);
            let shown: Vec<_> = times
                .map(|(level, at)| (f64::from(at), picture(*level)))
                .collect();
            near(&shown)
        };
        assert_eq!(shown(&[]), None);
        assert_eq!(shown(&[100]), Some(1.0));
        assert_eq!(shown(&[50, 96, 101, 100]), Some(2.0));
        assert_eq!(shown(&[100, 50, 104, 100]), Some(3.0));
        assert_eq!(shown(&[0, 1, 0]), Some(3.0));
        assert_eq!(difference(&picture(1), &[]), f64::INFINITY);
    }
}
