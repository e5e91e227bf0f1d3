//! What complete pictures cost on the CPU: from nothing, and after an edit.
//!
//! Time is that of a clock on the wall and that of all cores together, which other programs on the
//! machine do not add to.

use std::time::Instant;

use serde_json::{Value, json};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Scene, WindSection};
use strandlight_reference::compare::compare;
use strandlight_scene::memory::peak_bytes;
use strandlight_scene::motion::Wind;
use strandlight_scene::paint::{Paint, PaintedPoint};
use strandlight_scene::progress::timed;
use strandlight_scene::{Backend, Picture, PreparedScene, RenderError, SceneError, Stats};

use super::edits::{self, median};
use super::process_clock::{core_seconds, since};
use super::truth::blocks;

/// Radians that lights and views turn by: 5 degrees.
const TURN: f32 = 0.087_266_46;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Width and height in pixels; the scene's without.
    pub size: Option<[u32; 2]>,
    /// Rounds of two pictures of each kind.
    pub repetitions: u32,
    /// Compare with a picture of that many samples a pixel.
    pub samples: Option<u32>,
}

/// What pictures of a scene cost.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCosts {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What the first picture counted; scene and renderer are the same in all.
    pub stats: Stats,
    /// Peak memory of the process so far, where the system tells.
    pub peak_bytes: Option<u64>,
    /// By kind of picture.
    pub pictures: Vec<PictureCost>,
    /// The picture by samples, if that was asked for.
    pub samples: Option<SamplesCost>,
}

/// What a kind of picture costs.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureCost {
    /// What was edited before, or `first picture`, or `everything`.
    pub name: &'static str,
    /// Median milliseconds by the clock.
    pub milliseconds: f64,
    /// Mean seconds of all cores together, where the system tells.
    pub core_seconds: Option<f64>,
    /// Median milliseconds of each stage that ran, `load` and `edit` among them.
    pub stages: Vec<(&'static str, f64)>,
    /// What the picture counted.
    pub stats: Stats,
}

/// The same picture by samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SamplesCost {
    /// Samples a pixel.
    pub samples: u32,
    /// Milliseconds by the clock.
    pub milliseconds: f64,
    /// Seconds of all cores together, where the system tells.
    pub core_seconds: Option<f64>,
    /// The same over those of `everything`.
    pub core_seconds_ratio: Option<f64>,
    /// Relative RMSE of the picture by its visibility list against this one, over means of 4x4
    /// pixels; none if it is black.
    pub relative_rmse: Option<f64>,
}

impl SceneCosts {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "size": self.size,
            "strands": self.stats.strands,
            "points": self.stats.points,
            "lights": self.stats.lights,
            "peak_bytes": self.peak_bytes,
            "frames": self.pictures.iter().map(PictureCost::to_json).collect::<Vec<_>>(),
            "samples": self.samples.map(|cost| json!({
                "samples": cost.samples,
                "milliseconds": cost.milliseconds,
                "core_seconds": cost.core_seconds,
                "core_seconds_ratio": cost.core_seconds_ratio,
                "relative_rmse": cost.relative_rmse,
            })),
        })
    }
}

impl PictureCost {
    /// Pictures a second.
    pub fn per_second(&self) -> f64 {
        1e3 / self.milliseconds
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let stage = |(name, milliseconds): &(&str, f64)| json!({ "name": name, "milliseconds": milliseconds });
        let [products, products_skipped] = self.stats.products();
        json!({
            "name": self.name,
            "milliseconds": self.milliseconds,
            "frames_per_second": self.per_second(),
            "core_seconds": self.core_seconds,
            "products": products,
            "products_skipped": products_skipped,
            "visible_points": self.stats.visible_points,
            "list_entries": self.stats.list_entries,
            "stages": self.stages.iter().map(stage).collect::<Vec<_>>(),
        })
    }
}

/// An edit of a scene that is drawn; its argument says whether to edit there or back.
pub(super) type Edit =
    Box<dyn Fn(&mut dyn Backend, &PreparedScene, bool) -> Result<(), RenderError>>;

/// Names of the edits of a uniform parameter of the hair, which Xu's frame rates are of.
pub const HAIR_EDITS: [&str; 3] = ["colour of the hair", "widths", "index of refraction"];

/// Pictures that [`scene_costs`] draws.
pub fn n_pictures(options: &Options) -> u64 {
    let kinds = 1 + N_EDITS;
    2 * kinds * (u64::from(options.repetitions) + 1) + u64::from(options.samples.is_some())
}

/// Edits that [`window_costs`](super::window_frames::window_costs) draws.
pub fn n_window_pictures(options: &Options) -> u64 {
    2 * N_EDITS * (u64::from(options.repetitions) + 1)
}

/// Edits of a scene whose hair can be painted.
const N_EDITS: u64 = 12;

/// All kinds of edits. Paint comes last: hair that was painted once is shaded as painted hair.
pub(super) fn edits(scene: &PreparedScene) -> Vec<(&'static str, Edit)> {
    let mut edits: Vec<(&'static str, Edit)> = vec![
        (
            "everything",
            Box::new(|live, base, _| live.set_scene(base.clone())),
        ),
        (HAIR_EDITS[0], Box::new(edits::color)),
        (HAIR_EDITS[1], Box::new(edits::widths)),
        (HAIR_EDITS[2], Box::new(edits::eta)),
        ("colour of the lights", Box::new(edits::light_colors)),
        ("tint of the lights", Box::new(edits::tint)),
        ("a light off", Box::new(edits::light_off)),
        (
            "exposure",
            Box::new(|live, base, there| {
                let exposure = base.exposure + if there { 0.5 } else { 0.0 };
                live.set_grade(exposure, base.display.clone(), base.background);
                Ok(())
            }),
        ),
        (
            "lights turned",
            Box::new(|live, base, there| {
                edits::turn_lights(live, base, if there { TURN } else { 0.0 })
            }),
        ),
        (
            "view",
            Box::new(|live, base, there| {
                edits::turn_camera(live, base, if there { TURN } else { 0.0 });
                Ok(())
            }),
        ),
        (
            "wind",
            Box::new(|live, base, there| {
                let wind = Wind::at(&WindSection::default(), &base.strands, 1.0);
                live.set_wind(there.then_some(wind))?;
                Ok(())
            }),
        ),
    ];
    let bare = Paint {
        points: vec![PaintedPoint::NONE; scene.strands.n_groom_points()],
    };
    // Elliptic fibres cannot be painted.
    if scene.clone().set_paint(Some(&bare)).is_ok() {
        let stroke = edits::stroke(scene, &bare);
        let paint = move |live: &mut dyn Backend, _: &PreparedScene, there: bool| {
            let mut paint = bare.clone();
            if there {
                paint.apply(&stroke);
            }
            live.set_paint(&paint, stroke.range().unwrap_or(0..0))
        };
        edits.push(("a stroke", Box::new(paint)));
    }
    edits
}

/// Loads and draws `scene` from nothing, then draws it after each kind of edit, there and back:
/// medians over all pictures but those of a first round. `drawn` is called after each picture.
///
/// # Errors
/// A scene that cannot be loaded, or a size out of range.
pub fn scene_costs(
    scene: &Scene,
    options: &Options,
    drawn: &dyn Fn(),
) -> Result<SceneCosts, RenderError> {
    let load = || -> Result<PreparedScene, SceneError> {
        let mut loaded = PreparedScene::load(scene)?;
        loaded.size = options.size.unwrap_or(loaded.size);
        Ok(loaded)
    };
    let base = load()?;
    let size = base.size;
    let mut live = CpuRenderer::new(base.clone());
    let first = measure("first picture", options.repetitions, drawn, |_| {
        let (loaded, seconds) = timed(load);
        live = CpuRenderer::new(loaded?);
        Ok((("load", 1e3 * seconds), draw(&mut live, size)?))
    })?;
    let mut pictures = vec![first];
    for edit in edits(&base) {
        pictures.push(after(edit, &mut live, &base, options.repetitions, drawn)?);
    }
    let peak_bytes = peak_bytes();
    let samples = match options.samples {
        Some(samples) => {
            let (picture, _) = draw(&mut CpuRenderer::new(base.clone()), size)?;
            let cost = by_samples(&base, &picture, samples, &pictures)?;
            drawn();
            Some(cost)
        }
        None => None,
    };
    Ok(SceneCosts {
        size,
        stats: pictures[0].stats.clone(),
        peak_bytes,
        pictures,
        samples,
    })
}

/// Pictures that [`edit_costs`] draws for each of its names.
pub fn n_edit_pictures(repetitions: u32) -> u64 {
    2 * (u64::from(repetitions) + 1)
}

/// Draws `base` after the edits called `names`, as [`scene_costs`] does.
///
/// # Errors
/// As there.
pub fn edit_costs(
    base: &PreparedScene,
    names: &[&str],
    repetitions: u32,
    drawn: &dyn Fn(),
) -> Result<Vec<PictureCost>, RenderError> {
    let mut live = CpuRenderer::new(base.clone());
    // An edit is one of a scene that was drawn.
    draw(&mut live, base.size)?;
    let edits = edits(base).into_iter();
    edits
        .filter(|(name, _)| names.contains(name))
        .map(|edit| after(edit, &mut live, base, repetitions, drawn))
        .collect()
}

/// Pictures after one kind of edit.
fn after(
    (name, edit): (&'static str, Edit),
    live: &mut CpuRenderer,
    base: &PreparedScene,
    repetitions: u32,
    drawn: &dyn Fn(),
) -> Result<PictureCost, RenderError> {
    measure(name, repetitions, drawn, |there| {
        let (edited, seconds) = timed(|| edit(live, base, there));
        edited?;
        Ok((("edit", 1e3 * seconds), draw(live, base.size)?))
    })
}

fn draw(live: &mut CpuRenderer, size: [u32; 2]) -> Result<(Picture, Stats), RenderError> {
    live.render(size, 1, &|_| ())
}

/// Draws pictures by `make`, there and back; it answers with what it did before drawing and how
/// many milliseconds that took, and with what was drawn.
fn measure(
    name: &'static str,
    repetitions: u32,
    drawn: &dyn Fn(),
    mut make: impl FnMut(bool) -> Result<((&'static str, f64), (Picture, Stats)), RenderError>,
) -> Result<PictureCost, RenderError> {
    for there in [true, false] {
        make(there)?;
        drawn();
    }
    let before = core_seconds();
    let mut runs = Vec::new();
    for there in (0..repetitions).flat_map(|_| [true, false]) {
        let start = Instant::now();
        let (made_before, (_, stats)) = make(there)?;
        let milliseconds = 1e3 * start.elapsed().as_secs_f64();
        let of_picture = stats.stages.iter();
        let of_picture = of_picture.map(|stage| (stage.name, stage.milliseconds));
        let stages: Vec<_> = [made_before].into_iter().chain(of_picture).collect();
        runs.push((milliseconds, stages, stats));
        drawn();
    }
    let core_seconds = since(before).map(|seconds| seconds / runs.len() as f64);
    let of_stage = |name| {
        let stages = runs.iter().flat_map(|(_, stages, _)| stages);
        median(stages.filter(|stage| stage.0 == name).map(|stage| stage.1))
    };
    // All pictures have the same stages, and those that are there count the same.
    let (_, stages, stats) = &runs[0];
    Ok(PictureCost {
        name,
        milliseconds: median(runs.iter().map(|run| run.0)),
        core_seconds,
        stages: stages
            .iter()
            .map(|&(name, _)| (name, of_stage(name)))
            .collect(),
        stats: stats.clone(),
    })
}

/// The same picture by samples, and how far `picture` is from it.
fn by_samples(
    scene: &PreparedScene,
    picture: &Picture,
    samples: u32,
    pictures: &[PictureCost],
) -> Result<SamplesCost, RenderError> {
    let before = core_seconds();
    let (drawn, seconds) =
        timed(|| strandlight_cpu::render(scene, &scene.camera, scene.size, samples));
    let core_seconds = since(before);
    let (by_samples, _) = drawn?;
    let everything = pictures.iter().find(|cost| cost.name == "everything");
    let everything = everything.and_then(|cost| cost.core_seconds);
    let ratio = core_seconds.zip(everything).map(|(a, b)| a / b);
    let compared = compare(&blocks(picture), &blocks(&by_samples)).ok();
    Ok(SamplesCost {
        samples,
        milliseconds: 1e3 * seconds,
        core_seconds,
        core_seconds_ratio: ratio.filter(|ratio| ratio.is_finite()),
        relative_rmse: compared.map(|compared| compared.hair.relative_rmse),
    })
}
