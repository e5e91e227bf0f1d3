//! The renderer as a state machine: its finished picture is the renderer's, after every edit that
//! of a fresh one, and an edit touches what it must and nothing else.

use std::time::Duration;

use glam::{Quat, Vec3};
use strandlight_formats::{Background, LutInput, Scattering};
use strandlight_render::gpu::{Context, ResourceCounts};
use strandlight_render::invalidation::{Inputs, STAGES, StageRule, stale_stages};
use strandlight_render::passes::DeviceBytes;
use strandlight_render::progressive::RenderReport;
use strandlight_render::{Backend, ProgressiveRenderer};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::proxy::Proxy;
use strandlight_scene::tone::ToneMap;
use strandlight_scene::{Camera, DisplayTransform, Picture, PreparedScene, RenderError};
use strandlight_tests::luts::{grid_cube, grid_rows, lut_of};
use strandlight_tests::render_common::{self, context, keep, picture_rmse, wig_scene};

/// A row of the display's texels is 512 bytes, as copies want it.
const SIZE: [u32; 2] = [128, 96];
const SAMPLES: u32 = 16;

fn scene() -> PreparedScene {
    let mut scene = wig_scene(300);
    scene.set_scattering(Scattering::Total);
    (scene.size, scene.samples) = (SIZE, SAMPLES);
    scene
}

fn fresh(context: &Context, scene: &PreparedScene) -> Picture {
    let mut progressive = ProgressiveRenderer::new(context, scene.clone()).unwrap();
    progressive.finish(SAMPLES).unwrap()
}

fn turned(camera: &Camera, degrees: f32) -> Camera {
    let turn = Quat::from_rotation_y(degrees.to_radians());
    Camera {
        eye: camera.target + turn * (camera.eye - camera.target),
        ..*camera
    }
}

/// Grids and curves, with ranges of their own or without, for each way to encode radiance.
fn luts() -> [DisplayTransform; 4] {
    let warm = |[r, g, b]: [f32; 3]| [r.sqrt(), g * (0.5 + 0.5 * r), 0.8 * b * b + 0.1 * r];
    let curves = "0 0.1 0\n0.3 0.2 0.6\n0.5 0.8 0.7\n1 1 0.9\n";
    let both = format!(
        "LUT_1D_SIZE 4\nLUT_1D_INPUT_RANGE 0 0.7\nLUT_3D_SIZE 5\n\
         LUT_3D_INPUT_RANGE -0.1 1.1\n{curves}{}",
        grid_rows(5, warm)
    );
    let wide = format!(
        "DOMAIN_MIN 0 -1 0\nDOMAIN_MAX 2 3 0.5\n{}",
        grid_cube(33, warm)
    );
    [
        lut_of(&grid_cube(17, warm), LutInput::Log2),
        lut_of(&format!("LUT_1D_SIZE 4\n{curves}"), LutInput::Srgb),
        lut_of(&both, LutInput::Linear),
        lut_of(&wide, LutInput::Linear),
    ]
}

/// With what is read without waiting.
fn report(context: &Context, progressive: &mut ProgressiveRenderer) -> RenderReport {
    context.wait("report").unwrap();
    progressive.advance(Duration::ZERO).unwrap();
    progressive.report().clone()
}

#[test]
fn the_finished_picture_is_the_renderers() {
    let context = context();
    let scene = scene();
    let mut renderer = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (expected, stats) = renderer
        .render_to_image(&scene.camera, SIZE, SAMPLES)
        .unwrap();
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let picture = progressive.finish(SAMPLES).unwrap();
    let error = picture_rmse(&picture, &expected);
    println!("{error:.2e}");
    assert!(error < 1e-6, "{error}");
    let after = report(&context, &mut progressive);
    assert_eq!(after.stats.terms, stats.terms);
    for name in ["shadow maps", "transmittance", "shade", "draw", "display"] {
        let stage = after.stage(name).unwrap();
        assert!(stage.runs > 0 && stage.milliseconds > 0.0, "{stage:?}");
    }
    if context.has_timestamps() {
        let measured = after
            .stages
            .iter()
            .filter_map(|stage| stage.gpu_milliseconds);
        let all: f64 = measured.clone().sum();
        println!("{all} ms by the device's clock");
        assert!(all > 0.0 && measured.count() >= 2, "{:?}", after.stages);
    }
    // A second frame of the same view needs no maps.
    let (again, _) = renderer
        .render_to_image(&scene.camera, SIZE, SAMPLES)
        .unwrap();
    assert!(picture_rmse(&again, &expected) < 1e-6);
}

#[test]
fn the_first_picture_comes_before_any_shadow_and_leaves_no_trace() {
    let context = context();
    for has_ground in [false, true] {
        let mut scene = scene();
        scene.background = Background::Color([0.0; 3]);
        if has_ground {
            let height = scene.strands.centre.y - scene.strands.radius;
            let albedo = [0.4; 3];
            scene.proxies = vec![Proxy::Ground { height, albedo }];
        }
        let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        // As little as a turn can do.
        let progress = progressive.advance(Duration::ZERO).unwrap();
        assert_eq!(progress.samples, 4);
        assert!(!progress.is_shaded && !progress.is_done, "{progress:?}");
        let first = progressive.report().clone();
        assert_eq!((first.runs("first look"), first.shadings), (1, 0));
        for stage in ["voxelise", "shadow maps", "transmittance", "shade"] {
            assert_eq!(first.runs(stage), 0, "{stage}");
        }
        let look = progressive.read_display().unwrap();
        while !progressive.advance(Duration::from_secs(1)).unwrap().is_done {}
        let after = progressive.report().clone();
        assert_eq!((after.runs("first look"), after.runs("voxelise")), (1, 1));
        let lit = progressive.read_display().unwrap();
        // About as bright.
        let sum = |pixels: &[[u8; 4]]| pixels.iter().map(|p| f64::from(p[1])).sum::<f64>();
        let ratio = sum(&look) / sum(&lit);
        println!("brightness of the first look: {ratio:.2} of the lit picture's");
        assert!((0.6..1.6).contains(&ratio), "{ratio}");
        // Nothing of it is left.
        let mut unseen = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
        let expected = unseen.finish(SAMPLES).unwrap();
        assert_eq!(unseen.report().runs("first look"), 0);
        assert_eq!(progressive.finish(SAMPLES).unwrap(), expected);
        assert_eq!(after.device_bytes, unseen.report().device_bytes);
    }
}

type Edit = fn(&mut ProgressiveRenderer, &mut PreparedScene);

/// An edit, and the inputs that it changes, which say what has to run and what must not.
struct Case {
    name: &'static str,
    inputs: Inputs,
    edit: Edit,
    /// Nothing is made on the device.
    is_free: bool,
}

const CASES: [Case; 9] = [
    Case {
        name: "hair",
        inputs: Inputs::HAIR,
        edit: |progressive, scene| {
            let hair = HairParams {
                sigma_a: [0.9, 0.6, 0.2],
                ..HairParams::default()
            };
            progressive.set_hair(&hair, &Lobe::ALL).unwrap();
            scene.hair.edit(&hair, &Lobe::ALL).unwrap();
        },
        is_free: true,
    },
    Case {
        name: "densities",
        inputs: Inputs::DENSITIES,
        edit: |progressive, scene| {
            progressive.set_densities([0.3, 0.9]);
            scene.densities = [0.3, 0.9];
        },
        is_free: true,
    },
    Case {
        name: "camera",
        inputs: Inputs::VIEW,
        edit: |progressive, scene| {
            scene.camera = turned(&scene.camera, 25.0);
            progressive.set_camera(scene.camera);
        },
        is_free: true,
    },
    Case {
        name: "grade",
        inputs: Inputs::GRADE,
        edit: |progressive, scene| {
            scene.background = Background::Color([0.1, 0.2, 0.3]);
            (scene.exposure, scene.display) = (0.7, ToneMap::None.into());
            progressive.set_grade(scene.exposure, scene.display.clone(), scene.background);
        },
        is_free: true,
    },
    Case {
        name: "light colours",
        inputs: Inputs::LIGHT_COLORS,
        edit: |progressive, scene| {
            // The same share of the whole for each, so the same maps.
            let rgb: Vec<[f32; 3]> = scene
                .lights
                .iter()
                .map(|light| light.rgb.map(|x| 0.3 * x))
                .collect();
            progressive.set_light_colors(&rgb).unwrap();
            for (light, rgb) in scene.lights.iter_mut().zip(rgb) {
                light.rgb = rgb;
            }
        },
        is_free: true,
    },
    Case {
        name: "lights",
        inputs: Inputs::LIGHTS,
        edit: |progressive, scene| {
            let turn = Quat::from_rotation_y(0.6);
            for light in &mut scene.lights {
                light.direction = (turn * Vec3::from(light.direction)).to_array();
            }
            progressive.set_lights(scene.lights.clone()).unwrap();
        },
        is_free: false,
    },
    Case {
        name: "points",
        inputs: Inputs::POINTS,
        edit: |progressive, scene| {
            let shear = |&[x, y, z, radius]: &[f32; 4]| [x + 0.2 * y, y, 1.1 * z, radius];
            let points: Vec<[f32; 4]> = scene.strands.points.iter().map(shear).collect();
            progressive.set_points(&points).unwrap();
            scene.strands = scene.strands.moved(&points).unwrap().into();
        },
        is_free: false,
    },
    Case {
        name: "modes",
        inputs: Inputs::TERMS.union(Inputs::HAIR),
        edit: |progressive, scene| {
            let hair = *scene.hair.hair();
            progressive.set_hair(&hair, &[Lobe::R, Lobe::Trt]).unwrap();
            scene.hair.edit(&hair, &[Lobe::R, Lobe::Trt]).unwrap();
        },
        is_free: false,
    },
    Case {
        name: "scattering",
        inputs: Inputs::TERMS.union(Inputs::HAIR),
        edit: |progressive, scene| {
            progressive.set_scattering(Scattering::Local);
            scene.set_scattering(Scattering::Local);
        },
        is_free: false,
    },
];

/// What was made on the device. Drawing submits, writes and runs shaders, whatever was edited.
fn made_by(report: &RenderReport) -> ResourceCounts {
    ResourceCounts {
        submissions: 0,
        workgroups: 0,
        written_bytes: 0,
        ..report.counts
    }
}

#[test]
fn every_edit_gives_the_picture_of_a_fresh_start_and_touches_what_it_must() {
    let context = context();
    let mut scene = scene();
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let mut before = progressive.finish(SAMPLES).unwrap();
    let made = progressive.report().counts;
    assert!(made.geometry_uploads > 0 && made.pipelines > 5, "{made:?}");
    // One after the other, each on top of those before it.
    for case in CASES {
        let name = case.name;
        (case.edit)(&mut progressive, &mut scene);
        let after = progressive.finish(SAMPLES).unwrap();
        let report = progressive.report().clone();
        let expected = fresh(&context, &scene);
        let (error, changed) = (
            picture_rmse(&after, &expected),
            picture_rmse(&after, &before),
        );
        println!("{name}: {error:.2e} of {changed:.2e}, {:?}", report.counts);
        assert!(error < 1e-6 && changed > 0.01, "{name}: {error} {changed}");
        let stale: Vec<_> = stale_stages(case.inputs).collect();
        for StageRule { name: stage, .. } in STAGES {
            // Another line of sight: the maps towards the eye alone.
            let turns = stage == "shadow maps" && case.inputs == Inputs::VIEW;
            let must_run = stale.contains(&stage) && stage != "list" || turns;
            assert_eq!(report.runs(stage) > 0, must_run, "{name}: {stage}");
        }
        if case.is_free {
            assert_eq!(made_by(&report), ResourceCounts::default(), "{name}");
        }
        let is_geometry = name == "points";
        assert_eq!(report.counts.geometry_uploads, u64::from(is_geometry));
        if name == "light colours" {
            keep("progressive-after", &after);
        }
        // There and back: the pipelines are still there.
        if name == "modes" {
            assert_eq!(report.counts.pipelines, 1);
            let hair = *scene.hair.hair();
            progressive.set_hair(&hair, &Lobe::ALL).unwrap();
            let back = progressive.finish(SAMPLES).unwrap();
            assert!(picture_rmse(&back, &before) < 1e-6);
            assert_eq!(progressive.report().counts.pipelines, 0);
            scene.hair.edit(&hair, &Lobe::ALL).unwrap();
            continue;
        }
        before = after;
    }
}

#[test]
fn muted_lights_are_not_looked_at_and_keep_their_shadows() {
    let context = context();
    let mut scene = scene();
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let all = progressive.finish(SAMPLES).unwrap();
    let products = |report: &RenderReport| report.stats.products().iter().sum::<u64>();
    let of_all = products(&report(&context, &mut progressive));
    let n_points = scene.strands.points.len() as u64;
    let skipped = progressive.report().stats.points_skipped;
    assert_eq!(of_all, 4 * 5 * (n_points - skipped));
    let colors: Vec<[f32; 3]> = scene.lights.iter().map(|light| light.rgb).collect();
    let mut some = colors.clone();
    some[0] = [0.0; 3];
    some[3] = [0.0; 3];
    progressive.set_light_colors(&some).unwrap();
    let muted = progressive.finish(SAMPLES).unwrap();
    assert_eq!(made_by(progressive.report()), ResourceCounts::default());
    let after = report(&context, &mut progressive);
    assert_eq!(5 * products(&after), 3 * of_all);
    assert_eq!(after.runs("shadow maps") + after.runs("transmittance"), 0);
    // The others alone, which share the maps among themselves: shadows differ a little.
    scene.lights.remove(3);
    scene.lights.remove(0);
    let error = picture_rmse(&muted, &fresh(&context, &scene));
    println!("muted against absent: {error:.2e}");
    assert!(error < 0.05 && picture_rmse(&muted, &all) > 0.1, "{error}");
    // No light at all: black, and no error.
    progressive.set_light_colors(&[[0.0; 3]; 5]).unwrap();
    let dark = progressive.finish(4).unwrap();
    assert!(dark.rgba.iter().all(|[r, g, b, _]| r + g + b == 0.0));
    assert_eq!(products(&report(&context, &mut progressive)), 0);
    progressive.set_light_colors(&colors).unwrap();
    assert!(picture_rmse(&progressive.finish(SAMPLES).unwrap(), &all) < 1e-6);
}

#[test]
fn small_budgets_and_devices_that_are_not_waited_for_give_the_same_picture() {
    let context = context();
    let mut scene = scene();
    scene.background = Background::Lights;
    let expected = fresh(&context, &scene);
    // Room for the records of one batch of lights only.
    scene.record_budget = 1;
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let (mut n_turns, mut samples) = (0, Vec::new());
    let progress = loop {
        let progress = progressive.advance(Duration::ZERO).unwrap();
        n_turns += 1;
        assert!(n_turns < 10_000);
        // Before there is light, a draft.
        if progress.is_shaded {
            samples.push(progress.samples);
        }
        assert_eq!(progress.is_done, progress.samples == SAMPLES);
        if progress.is_done {
            break progress;
        }
    };
    println!("{n_turns} turns, noise {:?}", progress.noise);
    assert!(n_turns > 20 && samples.is_sorted());
    assert!(picture_rmse(&progressive.finish(SAMPLES).unwrap(), &expected) < 1e-6);
    let shown = progressive.read_display().unwrap();
    let wanted = expected.to_srgb8(scene.exposure, &scene.display);
    assert_eq!(shown.len(), wanted.len());
    let apart = shown.iter().flatten().zip(wanted.iter().flatten());
    let apart = apart.map(|(a, b)| a.abs_diff(*b)).max();
    assert!(apart <= Some(1), "{apart:?}");
    for lut in luts() {
        progressive.set_grade(scene.exposure, lut.clone(), scene.background);
        while !progressive.advance(Duration::from_secs(1)).unwrap().is_done {}
        // Nothing is lit or drawn again.
        let report = progressive.report();
        let names: Vec<_> = report.stages.iter().map(|stage| stage.name).collect();
        assert_eq!(names, ["composite", "display"]);
        let shown = progressive.read_display().unwrap();
        let wanted = expected.to_srgb8(scene.exposure, &lut);
        let apart = shown.iter().flatten().zip(wanted.iter().flatten());
        let apart: Vec<u8> = apart.map(|(a, b)| a.abs_diff(*b)).collect();
        let others = apart.iter().filter(|&&x| x > 0).count();
        println!("{others} of {} levels are others", apart.len());
        assert!(apart.iter().all(|&x| x <= 1) && others * 100 < apart.len());
    }
    // Without a background the screen's colours are multiplied by alpha.
    let transforms = [ToneMap::None, ToneMap::Agx, ToneMap::Aces2].map(DisplayTransform::from);
    for transform in transforms.into_iter().chain(luts()) {
        progressive.set_grade(-1.0, transform.clone(), Background::None);
        let picture = progressive.finish(SAMPLES).unwrap();
        let shown = progressive.read_display().unwrap();
        let straight = picture.to_srgb8(-1.0, &transform);
        let mut n_covered = 0;
        for (shown, straight) in shown.iter().zip(straight) {
            let [.., alpha] = straight;
            n_covered += usize::from(alpha > 0 && alpha < 255);
            for channel in 0..3 {
                let wanted = f32::from(straight[channel]) * f32::from(alpha) / 255.0;
                let apart = (f32::from(shown[channel]) - wanted).abs();
                assert!(apart <= 2.1 && shown[3] == alpha, "{shown:?} {straight:?}");
            }
        }
        assert!(n_covered > 100, "{n_covered}");
    }

    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    progressive.set_waiting(false);
    let picture = progressive.finish(SAMPLES).unwrap();
    assert!(picture_rmse(&picture, &expected) < 1e-6);
}

#[test]
fn a_slider_that_is_dragged_is_followed() {
    let context = context();
    let mut progressive = ProgressiveRenderer::new(&context, scene()).unwrap();
    while !progressive.advance(Duration::from_secs(1)).unwrap().is_done {}
    let before = progressive.report().shadings;
    let mut hair = HairParams::default();
    let mut n_turns = 0;
    // Another value at every turn, which does one small step.
    while progressive.report().shadings < before + 5 {
        hair.sigma_a[0] += 0.01;
        progressive.set_hair(&hair, &Lobe::ALL).unwrap();
        progressive.advance(Duration::ZERO).unwrap();
        n_turns += 1;
        assert!(n_turns < 1000, "never lit");
    }
    // A camera that moves shows a draft at every turn.
    for step in 0..5 {
        let camera = turned(&progressive.scene().camera.clone(), 1.0 + step as f32);
        progressive.set_camera(camera);
        let progress = progressive.advance(Duration::ZERO).unwrap();
        assert!(progress.samples >= 4 && !progress.is_shaded && !progress.is_done);
    }
    let scene = progressive.scene().clone();
    let error = picture_rmse(
        &progressive.finish(SAMPLES).unwrap(),
        &fresh(&context, &scene),
    );
    assert!(error < 1e-6, "{error}");
}

#[test]
fn a_window_without_extent_draws_nothing() {
    let context = context();
    let mut progressive = ProgressiveRenderer::new(&context, scene()).unwrap();
    progressive.finish(4).unwrap();
    progressive.set_size([0, 0]).unwrap();
    assert!(progressive.advance(Duration::ZERO).unwrap().is_done);
    assert!(progressive.finish(4).is_err());
    progressive.set_size([0, 50]).unwrap();
    progressive.set_camera(turned(&progressive.scene().camera.clone(), 5.0));
    assert!(progressive.advance(Duration::ZERO).unwrap().is_done);
    progressive.set_size([64, 48]).unwrap();
    let mut scene = scene();
    scene.size = [64, 48];
    scene.camera = progressive.scene().camera;
    let error = picture_rmse(
        &progressive.finish(SAMPLES).unwrap(),
        &fresh(&context, &scene),
    );
    assert!(error < 1e-6, "{error}");
    assert!(progressive.set_size([9000, 2]).is_err());
    assert_eq!(progressive.display().texture().width(), 64);
}

#[test]
fn a_lost_device_is_an_error_that_says_so() {
    let lost = Context::new().unwrap();
    let mut progressive = ProgressiveRenderer::new(&lost, scene()).unwrap();
    progressive.advance(Duration::ZERO).unwrap();
    let copy = progressive.scene().clone();
    lost.device.destroy();
    let mut answers = (0..4).map(|_| progressive.advance(Duration::from_millis(1)));
    let error = answers.find_map(Result::err);
    assert!(
        matches!(error, Some(RenderError::DeviceLost(_))),
        "{error:?}"
    );
    // All that is needed is still here.
    let again = context();
    let mut progressive = ProgressiveRenderer::new(&again, copy).unwrap();
    assert!(progressive.finish(4).is_ok());
}

#[test]
fn the_least_limits_do_and_what_does_not_fit_is_named() {
    let scene = scene();
    let expected = fresh(&context(), &scene);
    let least = Context::with_least_limits().unwrap();
    assert!(!least.has_timestamps());
    let before = least.counts();
    let mut progressive = ProgressiveRenderer::new(&least, scene.clone()).unwrap();
    let picture = progressive.finish(SAMPLES).unwrap();
    assert!(picture_rmse(&picture, &expected) < 1e-6);
    // What was said beforehand is what was made, textures of the hair and small things apart.
    let said = DeviceBytes::new(&scene, SIZE).total() as f64;
    let made = least.counts().since(before).bytes as f64;
    println!("said {said:.3e}, made {made:.3e}");
    assert!((made / said - 1.0).abs() < 0.05, "{said} {made}");
    assert!((progressive.report().device_bytes as f64 / said - 1.0).abs() < 0.05);

    // Records of all lights do not fit, those of a batch do.
    let mut many = scene.clone();
    many.lights = (0..20).flat_map(|_| scene.lights.iter().copied()).collect();
    let mut small = many.clone();
    small.record_budget = 0;
    let budget = DeviceBytes::new(&small, SIZE).total();
    assert!(DeviceBytes::new(&many, SIZE).total() > budget);
    let progressive = ProgressiveRenderer::with_budget(&least, many.clone(), budget).unwrap();
    assert!(progressive.report().device_bytes as f64 <= 1.02 * budget as f64);
    let before = least.counts();
    let refused = ProgressiveRenderer::with_budget(&least, many, budget / 2).err();
    let text = refused.map(|error| error.to_string()).unwrap_or_default();
    assert!(
        text.contains("records") && text.contains("allowed"),
        "{text}"
    );
    assert_eq!(least.counts(), before);
}

#[test]
fn an_adapter_below_the_usual_limits_draws_the_same_and_says_what_it_cannot() {
    let scene = scene();
    let expected = fresh(&context(), &scene);
    let small = Context::within(|limits| {
        limits.max_texture_dimension_2d = 2048;
        limits.max_bind_groups = 2;
        limits.max_uniform_buffer_binding_size = 16 << 10;
        limits.max_storage_buffer_binding_size = 32 << 20;
        limits.max_buffer_size = 32 << 20;
        limits.max_color_attachments = 1;
        limits.max_inter_stage_shader_variables = 8;
    })
    .unwrap();
    assert_eq!(small.device.limits().max_texture_dimension_2d, 2048);
    let mut progressive = ProgressiveRenderer::new(&small, scene.clone()).unwrap();
    assert_eq!(progressive.finish(SAMPLES).unwrap(), expected);
    let refused = [
        progressive.set_size([2049, 8]),
        progressive.set_size([2048, 2048]),
    ];
    let text = refused.map(|answer| answer.unwrap_err().to_string());
    assert!(text[0].contains("2049x8") && text[0].contains("at most 2048"));
    assert!(
        text[1].contains("67108864") && text[1].contains("33554432"),
        "{text:?}"
    );
    let few = Context::within(|limits| limits.max_storage_buffers_per_shader_stage = 7);
    let text = few.unwrap_err().to_string();
    assert!(
        text.contains("max_storage_buffers_per_shader_stage is 7; 8"),
        "{text}"
    );
}

/// Steps of an orbit: how much of the noise is another from frame to frame. What the finished
/// pictures change is taken off in squares; what is left is compared with that of pictures that
/// have nothing in common, sqrt(2) times the noise.
#[test]
fn strands_do_not_crawl_while_orbiting() {
    let context = context();
    let mut scene = scene();
    scene.size = [96, 72];
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let mut frame = |degrees: f32, samples: u32| {
        progressive.set_camera(turned(&scene.camera, degrees));
        progressive.finish(samples).unwrap()
    };
    let converged = frame(0.0, 512);
    for (degrees, least, most) in [(0.05, 0.0, 0.2), (0.5, 0.0, 0.5), (20.0, 0.65, 1.2)] {
        let other = frame(degrees, 512);
        let truth = picture_rmse(&other, &converged);
        for samples in [4, 16, 64] {
            let start = frame(0.0, samples);
            let change = picture_rmse(&frame(degrees, samples), &start);
            let noise = picture_rmse(&start, &converged);
            let added = (change * change - truth * truth).sqrt() / (2.0_f64.sqrt() * noise);
            println!(
                "{degrees} degrees, {samples} samples: noise {noise:.3}, {added:.3} of it added; \
                 change {change:.4}, of finished pictures {truth:.4}"
            );
            assert!((least..most).contains(&added), "{degrees}: {added}");
        }
    }
}

#[test]
fn the_noise_that_is_left_is_known() {
    let context = context();
    let mut scene = scene();
    scene.size = [96, 72];
    let mut progressive = ProgressiveRenderer::new(&context, scene.clone()).unwrap();
    let converged = progressive.finish(2048).unwrap();
    let rgb = |picture: &Picture| -> Vec<f32> {
        let pixels = picture.rgba.iter();
        pixels.flat_map(|p| [p[0], p[1], p[2]]).collect()
    };
    for samples in [8, 32, 128] {
        progressive.set_camera(turned(&scene.camera, samples as f32));
        progressive.set_camera(scene.camera);
        progressive.set_samples(samples);
        let picture = progressive.finish(samples).unwrap();
        context.wait("noise").unwrap();
        let found = progressive.advance(Duration::ZERO).unwrap().noise;
        let error = render_common::relative_rmse(&rgb(&picture), &rgb(&converged));
        println!("{samples} samples: {found:?}, error {error:.4}");
        let ratio = f64::from(found.unwrap()) / error;
        assert!((0.7..2.5).contains(&ratio), "{samples}: {ratio}");
    }
}
