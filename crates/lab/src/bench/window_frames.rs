//! What a window shows after an edit, and when: pictures on the CPU that are drawn in steps.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use strandlight_cpu::BackgroundRenderer;
use strandlight_formats::Scene;
use strandlight_scene::{PreparedScene, RenderError, png_file};

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
    /// How far that one is from the last one at most, as `shown_off`.
    pub first_off: f64,
    /// Mean seconds of all cores together to that one, where the system tells.
    pub first_core_seconds: Option<f64>,
    /// What ran until then, in the order of its first run, and its mean milliseconds. Some run beside each other.
    pub first_stages: Vec<(&'static str, f64)>,
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
            "first_off": self.first_off,
            "first_core_seconds": self.first_core_seconds,
            "first_stages": self.first_stages.iter().map(|(name, milliseconds)| {
                json!({ "name": name, "milliseconds": milliseconds })
            }).collect::<Vec<_>>(),
            "settled_milliseconds": self.settled_milliseconds,
            "longest_milliseconds": self.longest_milliseconds,
        })
    }
}

/// How many times larger differences are shown than they are.
const MAGNIFIED: u8 = 8;

/// What a window showed after an edit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EditPictures {
    /// Width and height of both.
    pub size: [u32; 2],
    /// The first new picture, sRGB over black.
    pub shown: Vec<[u8; 3]>,
    /// The last one.
    pub last: Vec<[u8; 3]>,
}

impl EditPictures {
    /// A PNG of the first new picture, the last one, and eight times the difference of their levels, side by side.
    ///
    /// # Errors
    /// What the encoder says.
    pub fn to_png(&self) -> Result<Vec<u8>, RenderError> {
        let [width, height] = self.size;
        let rows = |pixels: &[[u8; 3]], row: usize| {
            let width = width as usize;
            pixels[row * width..][..width].to_vec()
        };
        let off: Vec<[u8; 3]> = (self.shown.iter().zip(&self.last))
            .map(|(a, b)| std::array::from_fn(|c| a[c].abs_diff(b[c]).saturating_mul(MAGNIFIED)))
            .collect();
        let row = |row| {
            [&self.shown, &self.last, &off]
                .map(|pixels| rows(pixels, row))
                .concat()
        };
        let sheet: Vec<[u8; 3]> = (0..height as usize).flat_map(row).collect();
        Ok(png_file::encode([3 * width, height], &sheet, &[])?)
    }
}

/// One edit.
struct Run {
    shown: f64,
    off: f64,
    first: f64,
    first_off: f64,
    first_core_seconds: Option<f64>,
    first_stages: Vec<(&'static str, f64)>,
    settled: f64,
    longest: f64,
    /// None where it showed no new picture before the last one, of one size.
    pictures: Option<EditPictures>,
}

/// The first picture of every light and term.
struct First {
    milliseconds: f64,
    core_seconds: Option<f64>,
    stages: Vec<(&'static str, f64)>,
    pixels: Vec<[u8; 4]>,
}

/// Edits `scene` there and back in a window, as [`scene_costs`](super::cpu_frames::scene_costs) does. `seen` gets what it showed after
/// each kind of edit, there, in the last round.
///
/// # Errors
/// As there.
pub fn window_costs(
    scene: &Scene,
    options: &Options,
    drawn: &dyn Fn(),
    seen: &mut dyn FnMut(&'static str, EditPictures),
) -> Result<Vec<WindowCost>, RenderError> {
    let mut base = PreparedScene::load(scene)?;
    base.size = options.size.unwrap_or(base.size);
    let mut live = BackgroundRenderer::new(base.clone());
    let mut costs = Vec::new();
    for (name, edit) in edits(&base) {
        let mut runs = Vec::new();
        for round in 0..=options.repetitions {
            for there in [true, false] {
                let mut run = watch(&mut live, |live| edit(live, &base, there))?;
                if let Some(pictures) = run.pictures.take()
                    && there
                    && round == options.repetitions
                {
                    seen(name, pictures);
                }
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
            first_off: runs.iter().fold(0.0, |most, run| run.first_off.max(most)),
            first_core_seconds: seconds.map(mean),
            first_stages: mean_stages(&runs),
            settled_milliseconds: median(runs.iter().map(|run| run.settled)),
            longest_milliseconds: runs.iter().fold(0.0, |most, run| run.longest.max(most)),
        });
    }
    Ok(costs)
}

/// Means over all runs of what each stage took; of those that did not need it nothing.
fn mean_stages(runs: &[Run]) -> Vec<(&'static str, f64)> {
    let mut means: Vec<(&'static str, f64)> = Vec::new();
    for (name, milliseconds) in runs.iter().flat_map(|run| &run.first_stages) {
        let share = milliseconds / runs.len() as f64;
        match means.iter_mut().find(|(other, _)| other == name) {
            Some((_, mean)) => *mean += share,
            None => means.push((name, share)),
        }
    }
    means
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
            first = Some(First {
                milliseconds: milliseconds(start),
                core_seconds: since(before),
                stages: stages_of(live),
                pixels: live.display().pixels.to_vec(),
            });
        }
        if progress.is_done {
            let settled = milliseconds(start);
            let core_seconds = since(before);
            let last = live.display();
            let first = first.unwrap_or_else(|| First {
                milliseconds: settled,
                core_seconds,
                stages: stages_of(live),
                pixels: last.pixels.to_vec(),
            });
            let (shown, off, pictures) = match shown {
                Some((shown, pixels)) => (
                    shown,
                    difference(&pixels, last.pixels),
                    pictures_of(&pixels, last.pixels, last.size),
                ),
                None => (settled, 0.0, None),
            };
            return Ok(Run {
                pictures,
                shown,
                off,
                first: first.milliseconds,
                first_off: difference(&first.pixels, last.pixels),
                first_core_seconds: first.core_seconds,
                first_stages: first.stages,
                settled,
                longest,
            });
        }
    }
}

/// What the renderer did since the last edit.
fn stages_of(live: &BackgroundRenderer) -> Vec<(&'static str, f64)> {
    let stages = live.report().stages.iter();
    stages
        .map(|stage| (stage.name, stage.milliseconds))
        .collect()
}

fn pictures_of(shown: &[[u8; 4]], last: &[[u8; 4]], size: [u32; 2]) -> Option<EditPictures> {
    let over_black = |pixels: &[[u8; 4]]| pixels.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    (shown.len() == last.len()).then(|| EditPictures {
        size,
        shown: over_black(shown),
        last: over_black(last),
    })
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

    #[test]
    fn stages_are_means_over_all_runs() {
        let run = |stages: &[(&'static str, f64)]| Run {
            shown: 0.0,
            off: 0.0,
            first: 0.0,
            first_off: 0.0,
            first_core_seconds: None,
            first_stages: stages.to_vec(),
            settled: 0.0,
            longest: 0.0,
            pictures: None,
        };
        let runs = [
            run(&[("list", 4.0), ("shade", 1.0)]),
            run(&[("shade", 3.0)]),
        ];
        assert_eq!(mean_stages(&runs), [("list", 2.0), ("shade", 2.0)]);
        assert_eq!(mean_stages(&[]), []);
    }

    #[test]
    fn pictures_stand_beside_their_difference() {
        let [shown, last] = [[10, 90, 3, 255], [12, 10, 3, 0]].map(|pixel| [pixel; 2]);
        let pictures = pictures_of(&shown, &last, [1, 2]).expect("of one size");
        let png = pictures.to_png().expect("encoded");
        let mut reader = png::Decoder::new(std::io::Cursor::new(png))
            .read_info()
            .expect("a PNG");
        let mut bytes = vec![0; 3 * 3 * 2];
        let info = reader.next_frame(&mut bytes).expect("a picture");
        assert_eq!((info.width, info.height), (3, 2));
        let row = [10, 90, 3, 12, 10, 3, 16, 255, 0];
        assert_eq!(bytes, [row, row].concat());
        assert_eq!(pictures_of(&shown, &last[..1], [1, 1]), None);
    }
}
