//! What frames cost after an edit on a GPU, beside one another on the same device.
//!
//! A frame goes from the edit to a picture that is lit as it should be, without samples as in a window.
//! Frames that are compared take turns, so that both see the same machine.

use std::slice::from_ref;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use strandlight_formats::{SrbfLight, WindSection};
use strandlight_render::gpu::Context;
use strandlight_render::{Backend, ProgressiveRenderer};
use strandlight_scene::interactive::RenderReport;
use strandlight_scene::motion::{Wind, wind};
use strandlight_scene::paint::{Paint, PaintedPoint};
use strandlight_scene::volume;
use strandlight_scene::{PreparedScene, RenderError};

use super::edits::{self, median, stroke};

/// Radians that lights and views turn by.
const TURN: f32 = 0.02;

/// The cost of one kind of frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameCost {
    /// What it is compared with: frames of the same group.
    pub group: &'static str,
    /// What is drawn or edited.
    pub name: String,
    /// Median milliseconds.
    pub milliseconds: f64,
    /// The same over those of the group's first frame.
    pub ratio: f64,
    /// Each stage that ran.
    pub stages: Vec<StageCost>,
    /// What the last frame took.
    pub work: FrameWork,
}

/// The cost of a stage of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageCost {
    /// Its name.
    pub name: &'static str,
    /// Median milliseconds until its results were there; a share of the time of stages that were waited for together.
    pub milliseconds: f64,
    /// Median milliseconds by the device's time stamps, where it has them.
    pub gpu_milliseconds: Option<f64>,
}

/// What the device did for a frame, and for what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameWork {
    /// Submissions of commands.
    pub submissions: u64,
    /// Workgroups of compute shaders.
    pub workgroups: u64,
    /// Bytes written to the device.
    pub written_bytes: u64,
    /// Points that were shaded.
    pub points: u64,
    /// Pairs of a pixel and a segment of the visibility list; none with samples.
    pub list_entries: u64,
    /// Products of a point and a light of all terms, where points were shaded.
    pub products: u64,
}

impl FrameWork {
    fn of(report: &RenderReport) -> FrameWork {
        let is_shaded = report.runs("shade") > 0;
        let if_shaded = |n: u64| if is_shaded { n } else { 0 };
        let stats = &report.stats;
        let points = match stats.list_entries {
            0 => stats.points as u64,
            _ => stats.visible_points,
        };
        FrameWork {
            submissions: report.counts.submissions,
            workgroups: report.counts.workgroups,
            written_bytes: report.counts.written_bytes,
            points: if_shaded(points),
            list_entries: stats.list_entries,
            products: if_shaded(stats.terms.iter().map(|term| term.products).sum()),
        }
    }
}

impl FrameCost {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let stage = |stage: &StageCost| {
            json!({
                "name": stage.name,
                "milliseconds": stage.milliseconds,
                "gpu_milliseconds": stage.gpu_milliseconds,
            })
        };
        json!({
            "group": self.group,
            "name": self.name,
            "milliseconds": self.milliseconds,
            "ratio": self.ratio,
            "stages": self.stages.iter().map(stage).collect::<Vec<_>>(),
            "submissions": self.work.submissions,
            "workgroups": self.work.workgroups,
            "written_bytes": self.work.written_bytes,
            "shaded_points": self.work.points,
            "list_entries": self.work.list_entries,
            "products": self.work.products,
        })
    }
}

/// One kind of frame: a renderer, and an edit that makes it draw; its argument says whether to edit
/// there or back.
struct Kind {
    name: String,
    renderer: usize,
    /// Samples a pixel; none where a list takes their place.
    samples: Option<u32>,
    edit: Box<Edit>,
}

type Edit = dyn Fn(&mut ProgressiveRenderer, &Base, bool) -> Result<(), RenderError>;

/// Milliseconds of a frame, its stages, and what it took.
type Run = (f64, Vec<StageCost>, FrameWork);

/// What edits start from.
struct Base {
    scene: PreparedScene,
    points: Vec<[f32; 4]>,
}

/// How far the work is.
#[derive(Clone, Copy, Debug)]
pub enum Progress<'a> {
    /// Another frame is drawn; there are [`n_frames`] in all, fewer of hair that cannot be painted.
    Frame,
    /// A group is done.
    Group {
        /// Its frames.
        costs: &'a [FrameCost],
        /// Seconds that it took,
        seconds: f64,
        /// of which its renderers took so many until their first picture.
        starting: f64,
    },
}

/// Progress callback.
type Observer<'a> = &'a dyn Fn(Progress);

/// Kinds of frames in all groups.
const N_KINDS: u64 = 8 + 2 + 3 + 3 + 4 + 4 + 2;

/// Frames that [`frame_costs`] draws with so many repetitions.
pub fn n_frames(repetitions: u32) -> u64 {
    2 * N_KINDS * (u64::from(repetitions) + 1)
}

/// Edits against a frame that recomputes everything; 10 lights against all of them; shadow maps step by step; the
/// visibility list and samples; painted hair and a stroke against hair that is not; wind against hair that
/// is moved otherwise. Medians of two frames a repetition; `observer` is called after each frame
/// and group.
///
/// # Errors
/// Whatever the device refuses.
pub fn frame_costs(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
    observer: &dyn Fn(Progress),
) -> Result<Vec<FrameCost>, RenderError> {
    let bench = Bench {
        context,
        repetitions,
        observer,
    };
    let mut costs = edits(&bench, scene)?;
    costs.extend(lights(&bench, scene)?);
    costs.extend(shadow_maps(&bench, scene)?);
    costs.extend(samples(&bench, scene)?);
    costs.extend(paint(&bench, scene)?);
    costs.extend(motion(&bench, scene)?);
    Ok(costs)
}

/// How groups are measured.
struct Bench<'a> {
    context: &'a Context,
    repetitions: u32,
    observer: Observer<'a>,
}

fn kind(
    name: &str,
    edit: impl Fn(&mut ProgressiveRenderer, &Base, bool) -> Result<(), RenderError> + 'static,
) -> Kind {
    Kind {
        name: name.to_owned(),
        renderer: 0,
        samples: None,
        edit: Box::new(edit),
    }
}

fn edits(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let everything = |renderer: &mut ProgressiveRenderer, base: &Base, there: bool| {
        let shift = if there { 0.01 } else { 0.0 };
        let shifted = |&[x, y, z, radius]: &[f32; 4]| [x + shift, y, z, radius];
        let points: Vec<_> = base.points.iter().map(shifted).collect();
        renderer.set_points(&points)?;
        turn_lights(renderer, base, there)
    };
    let kinds = [
        kind("everything", everything),
        kind("lights turned", turn_lights),
        kind("view", turn_camera),
        kind("index of refraction", |renderer, base, there| {
            edits::eta(renderer, &base.scene, there)
        }),
        kind("colour of the hair", color),
        kind("widths", |renderer, base, there| {
            edits::widths(renderer, &base.scene, there)
        }),
        kind("colour of the lights", |renderer, base, there| {
            edits::light_colors(renderer, &base.scene, there)
        }),
        kind("grade", |renderer, base, there| {
            let scene = &base.scene;
            let exposure = scene.exposure + if there { 0.5 } else { 0.0 };
            renderer.set_grade(exposure, scene.display.clone(), scene.background);
            Ok(())
        }),
    ];
    measure(bench, "edit", from_ref(scene), &kinds)
}

fn lights(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let n_all = scene.lights.len();
    let n_few = 10.min(n_all);
    let mut few = scene.clone();
    let power = |light: &SrbfLight| volume::power(light).iter().sum::<f64>();
    few.lights.sort_by(|a, b| power(b).total_cmp(&power(a)));
    few.lights.truncate(n_few);
    let of = |n: usize, renderer: usize| Kind {
        renderer,
        ..kind(&format!("{n} lights, colour of the hair"), color)
    };
    let kinds = [of(n_few, 0), of(n_all, 1)];
    let scenes = [few, scene.clone()];
    measure(bench, "lights", &scenes, &kinds)
}

fn shadow_maps(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let (mut scenes, mut kinds) = (Vec::new(), Vec::new());
    for n in [96, 24, 0] {
        let mut of_budget = scene.clone();
        of_budget.shadow_maps = n;
        kinds.push(Kind {
            renderer: scenes.len(),
            ..kind(&format!("{n} maps, lights turned"), turn_lights)
        });
        kinds.push(Kind {
            renderer: scenes.len(),
            ..kind(&format!("{n} maps, view"), turn_camera)
        });
        scenes.push(of_budget);
    }
    // Each kind of edit beside its own.
    kinds.sort_by_key(|kind| kind.name.ends_with("view"));
    let views = kinds.split_off(3);
    let mut costs = measure(bench, "shadow maps", &scenes, &kinds)?;
    let towards_the_eye = measure(bench, "shadow maps towards the eye", &scenes, &views)?;
    costs.extend(towards_the_eye);
    Ok(costs)
}

fn samples(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let by_list = kind("no samples, colour of the hair", color);
    let sampled = [4, 16, 64].map(|samples| Kind {
        renderer: 1,
        samples: Some(samples),
        ..kind(&format!("{samples} samples, colour of the hair"), color)
    });
    let kinds: Vec<Kind> = [by_list].into_iter().chain(sampled).collect();
    measure(bench, "samples", &[scene.clone(), scene.clone()], &kinds)
}

/// The same hair without paint, all of it dyed, and with other widths and shifts as well; nothing
/// for hair that cannot be painted.
fn paint(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let dyed = PaintedPoint {
        sigma_a: [0.3, 0.1, 0.6],
        weight: 0.5,
        ..PaintedPoint::NONE
    };
    let reshaped = PaintedPoint {
        width_scale: 1.2,
        shift_scale: 0.8,
        ..dyed
    };
    let mut bare = scene.clone();
    bare.set_paint(None)?;
    let mut scenes = vec![bare];
    for point in [dyed, reshaped] {
        let mut painted = scene.clone();
        let points = vec![point; scene.strands.n_groom_points()];
        if painted.set_paint(Some(&Paint { points })).is_err() {
            return Ok(Vec::new());
        }
        scenes.push(painted);
    }
    let names = ["not painted", "dyed", "dyed, widths and shifts"];
    let of = |(renderer, name): (usize, &&str)| Kind {
        renderer,
        ..kind(&format!("{name}, colour of the hair"), color)
    };
    let mut kinds: Vec<Kind> = names.iter().enumerate().map(of).collect();
    let whole = Paint {
        points: vec![dyed; scene.strands.n_groom_points()],
    };
    let stroke = stroke(scene, &whole);
    kinds.push(Kind {
        renderer: 1,
        ..kind("dyed, a stroke", move |renderer, _, there| {
            let mut paint = whole.clone();
            let range = stroke.range().unwrap_or(0..0);
            if there {
                paint.apply(&stroke);
            }
            renderer.set_paint(&paint, range)
        })
    });
    measure(bench, "paint", &scenes, &kinds)
}

/// Hair bent by wind on the device against hair whose points come from elsewhere.
fn motion(bench: &Bench, scene: &PreparedScene) -> Result<Vec<FrameCost>, RenderError> {
    let mut scene = scene.clone();
    scene.strands = wind::with_room(&WindSection::default(), (*scene.strands).clone()).into();
    let kinds = [
        kind("points moved", |renderer, base, there| {
            let shift = if there { 0.01 } else { 0.0 };
            let shifted = |&[x, y, z, radius]: &[f32; 4]| [x + shift, y, z, radius];
            let points: Vec<_> = base.points.iter().map(shifted).collect();
            renderer.set_wind(None)?;
            renderer.set_points(&points)
        }),
        kind("wind", |renderer, base, there| {
            let seconds = if there { 1.0 } else { 1.1 };
            let wind = Wind::at(&WindSection::default(), &base.scene.strands, seconds);
            renderer.set_wind(Some(wind))?;
            Ok(())
        }),
    ];
    measure(bench, "motion", from_ref(&scene), &kinds)
}

fn color(renderer: &mut ProgressiveRenderer, base: &Base, there: bool) -> Result<(), RenderError> {
    edits::color(renderer, &base.scene, there)
}

fn turn_lights(
    renderer: &mut ProgressiveRenderer,
    base: &Base,
    there: bool,
) -> Result<(), RenderError> {
    edits::turn_lights(renderer, &base.scene, if there { TURN } else { 0.0 })
}

fn turn_camera(
    renderer: &mut ProgressiveRenderer,
    base: &Base,
    there: bool,
) -> Result<(), RenderError> {
    edits::turn_camera(renderer, &base.scene, if there { TURN } else { 0.0 });
    Ok(())
}

/// Draws frames of all `kinds` in turn; the first round is not counted.
fn measure(
    bench: &Bench,
    group: &'static str,
    scenes: &[PreparedScene],
    kinds: &[Kind],
) -> Result<Vec<FrameCost>, RenderError> {
    let start = Instant::now();
    let mut lives = Vec::with_capacity(scenes.len());
    for (ix, scene) in scenes.iter().enumerate() {
        let mut scene = scene.clone();
        scene.samples = 4;
        let mut renderer = ProgressiveRenderer::new(bench.context, scene.clone())?;
        let mut of_it = kinds.iter().filter(|kind| kind.renderer == ix);
        if of_it.all(|kind| kind.samples.is_none()) {
            renderer.draw_by_list()?;
        }
        to_the_end(&mut renderer)?;
        let points = scene.strands.points.clone();
        lives.push((renderer, Base { scene, points }));
    }
    let starting = start.elapsed().as_secs_f64();
    let mut runs: Vec<Vec<Run>> = vec![Vec::new(); kinds.len()];
    for round in 0..=bench.repetitions {
        for (kind, runs) in kinds.iter().zip(&mut runs) {
            let (renderer, base) = &mut lives[kind.renderer];
            renderer.set_samples(kind.samples.unwrap_or(4));
            to_the_end(renderer)?;
            let mut turn = |there| -> Result<(), RenderError> {
                let start = Instant::now();
                (kind.edit)(renderer, base, there)?;
                to_the_end(renderer)?;
                let milliseconds = 1e3 * start.elapsed().as_secs_f64();
                // Takes the counts that shading left.
                renderer.advance(Duration::ZERO)?;
                let stages = renderer.report().stages.iter();
                let stages = stages.map(|stage| StageCost {
                    name: stage.name,
                    milliseconds: stage.milliseconds,
                    gpu_milliseconds: stage.gpu_milliseconds,
                });
                if round > 0 {
                    let work = FrameWork::of(renderer.report());
                    runs.push((milliseconds, stages.collect(), work));
                }
                (bench.observer)(Progress::Frame);
                Ok(())
            };
            turn(true)?;
            turn(false)?;
        }
    }
    let first = median(runs[0].iter().map(|run| run.0));
    let cost = |(kind, runs): (&Kind, &Vec<Run>)| {
        let milliseconds = median(runs.iter().map(|run| run.0));
        let stages = runs.first().map_or(Vec::new(), |(_, stages, _)| {
            stages
                .iter()
                .map(|stage| median_stage(runs, stage.name))
                .collect()
        });
        FrameCost {
            group,
            name: kind.name.clone(),
            milliseconds,
            ratio: milliseconds / first,
            stages,
            work: runs
                .last()
                .map_or(FrameWork::default(), |(_, _, work)| *work),
        }
    };
    let costs: Vec<FrameCost> = kinds.iter().zip(&runs).map(cost).collect();
    (bench.observer)(Progress::Group {
        costs: &costs,
        seconds: start.elapsed().as_secs_f64(),
        starting,
    });
    Ok(costs)
}

/// The stage `name` of `runs`.
fn median_stage(runs: &[Run], name: &'static str) -> StageCost {
    let of_name = || {
        let stages = runs.iter().flat_map(|(_, stages, _)| stages);
        stages.filter(move |stage| stage.name == name)
    };
    let measured = || of_name().filter_map(|stage| stage.gpu_milliseconds);
    StageCost {
        name,
        milliseconds: median(of_name().map(|stage| stage.milliseconds)),
        gpu_milliseconds: measured().next().map(|_| median(measured())),
    }
}

/// Until the picture is finished.
fn to_the_end(renderer: &mut ProgressiveRenderer) -> Result<(), RenderError> {
    while !renderer.advance(Duration::from_secs(3600))?.is_done {}
    Ok(())
}
