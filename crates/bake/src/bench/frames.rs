//! What frames cost after an edit, beside one another on the same device.
//!
//! A frame goes from the edit to a picture of four samples a pixel that is lit as it should be.
//! Frames that are compared take turns, so that both see the same machine.

use std::slice::from_ref;
use std::time::{Duration, Instant};

use glam::{Quat, Vec3};
use serde_json::{Value, json};
use strandlight_formats::SrbfLight;
use strandlight_runtime::gpu::Context;
use strandlight_runtime::paint::{Paint, PaintedPoint};
use strandlight_runtime::{Camera, Live, PreparedScene, RenderError};

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
    /// Median milliseconds of each stage that ran.
    pub stages: Vec<(&'static str, f64)>,
}

impl FrameCost {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let stage = |(name, milliseconds): &(&str, f64)| json!({ "name": name, "milliseconds": milliseconds });
        json!({
            "group": self.group,
            "name": self.name,
            "milliseconds": self.milliseconds,
            "ratio": self.ratio,
            "stages": self.stages.iter().map(stage).collect::<Vec<_>>(),
        })
    }
}

/// One kind of frame: a renderer, and an edit that makes it draw; told whether to edit there or
/// back.
struct Kind {
    name: String,
    live: usize,
    samples: u32,
    edit: fn(&mut Live, &Base, bool) -> Result<(), RenderError>,
}

/// Milliseconds of a frame, and of its stages.
type Run = (f64, Vec<(&'static str, f64)>);

/// What edits start from.
struct Base {
    scene: PreparedScene,
    points: Vec<[f32; 4]>,
}

/// Edits against a frame that makes everything anew; 10 lights against all of them; shadow maps and
/// samples step by step; painted hair against hair that is not. Medians of `repetitions` frames each.
///
/// # Errors
/// Whatever the device refuses.
pub fn frame_costs(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let mut costs = edits(context, scene, repetitions)?;
    costs.extend(lights(context, scene, repetitions)?);
    costs.extend(shadow_maps(context, scene, repetitions)?);
    costs.extend(samples(context, scene, repetitions)?);
    costs.extend(paint(context, scene, repetitions)?);
    Ok(costs)
}

fn kind(name: &str, edit: fn(&mut Live, &Base, bool) -> Result<(), RenderError>) -> Kind {
    Kind {
        name: name.to_owned(),
        live: 0,
        samples: 4,
        edit,
    }
}

fn edits(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let everything = |live: &mut Live, base: &Base, there: bool| {
        let shift = if there { 0.01 } else { 0.0 };
        let shifted = |&[x, y, z, radius]: &[f32; 4]| [x + shift, y, z, radius];
        let points: Vec<_> = base.points.iter().map(shifted).collect();
        live.set_points(&points)?;
        live.set_lights(turned_lights(&base.scene.lights, there))
    };
    let kinds = [
        kind("everything", everything),
        kind("lights turned", |live, base, there| {
            live.set_lights(turned_lights(&base.scene.lights, there))
        }),
        kind("view", |live, base, there| {
            live.set_camera(turned_camera(&base.scene.camera, there));
            Ok(())
        }),
        kind("index of refraction", |live, base, there| {
            let mut hair = *base.scene.hair.hair();
            hair.eta += if there { 0.02 } else { 0.0 };
            set_hair(live, &hair)
        }),
        kind("colour of the hair", |live, base, there| {
            let mut hair = *base.scene.hair.hair();
            hair.sigma_a = hair.sigma_a.map(|x| if there { 0.9 * x + 0.01 } else { x });
            set_hair(live, &hair)
        }),
        kind("widths", |live, base, there| {
            let mut hair = *base.scene.hair.hair();
            hair.width = hair.width.map(|x| if there { 1.05 * x } else { x });
            set_hair(live, &hair)
        }),
        kind("colour of the lights", |live, base, there| {
            let factor = if there { 0.9 } else { 1.0 };
            let lights = base.scene.lights.iter();
            let rgb: Vec<_> = lights.map(|light| light.rgb.map(|x| x * factor)).collect();
            live.set_light_colors(&rgb)
        }),
        kind("grade", |live, base, there| {
            let scene = &base.scene;
            let exposure = scene.exposure + if there { 0.5 } else { 0.0 };
            live.set_grade(exposure, scene.tone_map, scene.background);
            Ok(())
        }),
    ];
    measure(context, "edit", from_ref(scene), &kinds, repetitions)
}

fn lights(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let n_all = scene.lights.len();
    let n_few = 10.min(n_all);
    let mut few = scene.clone();
    let power = |light: &SrbfLight| light.lambda.powi(2) * light.rgb.iter().sum::<f32>();
    few.lights.sort_by(|a, b| power(b).total_cmp(&power(a)));
    few.lights.truncate(n_few);
    let edit = |live: &mut Live, base: &Base, there: bool| {
        let mut hair = *base.scene.hair.hair();
        hair.sigma_a = hair.sigma_a.map(|x| if there { 0.9 * x + 0.01 } else { x });
        set_hair(live, &hair)
    };
    let of = |n: usize, live: usize| Kind {
        live,
        ..kind(&format!("{n} lights, colour of the hair"), edit)
    };
    let kinds = [of(n_few, 0), of(n_all, 1)];
    let scenes = [few, scene.clone()];
    measure(context, "lights", &scenes, &kinds, repetitions)
}

fn shadow_maps(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let (mut scenes, mut kinds) = (Vec::new(), Vec::new());
    for n in [96, 24, 0] {
        let mut of_budget = scene.clone();
        of_budget.shadow_maps = n;
        kinds.push(Kind {
            live: scenes.len(),
            ..kind(&format!("{n} maps, lights turned"), |live, base, there| {
                live.set_lights(turned_lights(&base.scene.lights, there))
            })
        });
        kinds.push(Kind {
            live: scenes.len(),
            ..kind(&format!("{n} maps, view"), |live, base, there| {
                live.set_camera(turned_camera(&base.scene.camera, there));
                Ok(())
            })
        });
        scenes.push(of_budget);
    }
    // Each kind of edit beside its own.
    kinds.sort_by_key(|kind| kind.name.ends_with("view"));
    let views = kinds.split_off(3);
    let mut costs = measure(context, "shadow maps", &scenes, &kinds, repetitions)?;
    costs.extend(measure(
        context,
        "shadow maps towards the eye",
        &scenes,
        &views,
        repetitions,
    )?);
    Ok(costs)
}

fn samples(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let kinds = [4, 16, 64].map(|samples| Kind {
        samples,
        ..kind(
            &format!("{samples} samples, colour of the hair"),
            |live, base, there| {
                let mut hair = *base.scene.hair.hair();
                hair.sigma_a = hair.sigma_a.map(|x| if there { 0.9 * x + 0.01 } else { x });
                set_hair(live, &hair)
            },
        )
    });
    measure(context, "samples", from_ref(scene), &kinds, repetitions)
}

/// The same hair without paint, all of it dyed, and with other widths and shifts as well; nothing
/// for hair that cannot be painted.
fn paint(
    context: &Context,
    scene: &PreparedScene,
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
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
    let edit = |live: &mut Live, base: &Base, there: bool| {
        let mut hair = *base.scene.hair.hair();
        hair.sigma_a = hair.sigma_a.map(|x| if there { 0.9 * x + 0.01 } else { x });
        set_hair(live, &hair)
    };
    let names = ["not painted", "dyed", "dyed, widths and shifts"];
    let of = |(live, name): (usize, &&str)| Kind {
        live,
        ..kind(&format!("{name}, colour of the hair"), edit)
    };
    let kinds: Vec<Kind> = names.iter().enumerate().map(of).collect();
    measure(context, "paint", &scenes, &kinds, repetitions)
}

fn set_hair(live: &mut Live, hair: &strandlight_scattering::HairParams) -> Result<(), RenderError> {
    let modes = live.scene().hair.modes().to_vec();
    match live.set_hair(hair, &modes) {
        Ok(_) => Ok(()),
        Err(error) => Err(RenderError::Gpu(error.to_string())),
    }
}

fn turned_lights(lights: &[SrbfLight], there: bool) -> Vec<SrbfLight> {
    let turn = Quat::from_rotation_y(if there { 0.02 } else { 0.0 });
    let turned = |light: &SrbfLight| SrbfLight {
        direction: (turn * Vec3::from(light.direction)).normalize().to_array(),
        ..*light
    };
    lights.iter().map(turned).collect()
}

fn turned_camera(camera: &Camera, there: bool) -> Camera {
    let turn = Quat::from_rotation_y(if there { 0.02 } else { 0.0 });
    Camera {
        eye: camera.target + turn * (camera.eye - camera.target),
        ..*camera
    }
}

/// Draws frames of all `kinds` in turn; the first round is not counted.
fn measure(
    context: &Context,
    group: &'static str,
    scenes: &[PreparedScene],
    kinds: &[Kind],
    repetitions: u32,
) -> Result<Vec<FrameCost>, RenderError> {
    let mut lives = Vec::with_capacity(scenes.len());
    for scene in scenes {
        let mut scene = scene.clone();
        scene.samples = 4;
        let mut live = Live::new(context, scene.clone())?;
        to_the_end(&mut live)?;
        let points = scene.strands.points.clone();
        lives.push((live, Base { scene, points }));
    }
    let mut runs: Vec<Vec<Run>> = vec![Vec::new(); kinds.len()];
    for round in 0..=repetitions {
        for (kind, runs) in kinds.iter().zip(&mut runs) {
            let (live, base) = &mut lives[kind.live];
            live.set_samples(kind.samples);
            to_the_end(live)?;
            let mut turn = |there| -> Result<(), RenderError> {
                let start = Instant::now();
                (kind.edit)(live, base, there)?;
                to_the_end(live)?;
                let milliseconds = 1e3 * start.elapsed().as_secs_f64();
                let stages = live.report().stages.iter();
                let stages = stages.map(|stage| (stage.name, stage.milliseconds));
                if round > 0 {
                    runs.push((milliseconds, stages.collect()));
                }
                Ok(())
            };
            turn(true)?;
            turn(false)?;
        }
    }
    let first = median(runs[0].iter().map(|run| run.0));
    let cost = |(kind, runs): (&Kind, &Vec<Run>)| {
        let milliseconds = median(runs.iter().map(|run| run.0));
        let stages = runs.first().map_or(Vec::new(), |(_, stages)| {
            let of = |name| {
                let stages = runs.iter().flat_map(|(_, stages)| stages);
                median(stages.filter(|stage| stage.0 == name).map(|stage| stage.1))
            };
            stages.iter().map(|&(name, _)| (name, of(name))).collect()
        });
        FrameCost {
            group,
            name: kind.name.clone(),
            milliseconds,
            ratio: milliseconds / first,
            stages,
        }
    };
    Ok(kinds.iter().zip(&runs).map(cost).collect())
}

/// Until the picture is finished.
fn to_the_end(live: &mut Live) -> Result<(), RenderError> {
    while !live.advance(Duration::from_secs(3600))?.is_done {}
    Ok(())
}

/// The middle value, the upper one of two; 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
