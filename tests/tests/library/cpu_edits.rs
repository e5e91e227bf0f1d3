//! The CPU renderer after edits of a document draws what it draws of the same document opened
//! afresh, bit for bit, and runs no stage that the edit does not touch.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value, json};

use strandlight_cpu::{CpuRenderer, InteractiveRenderer};
use strandlight_formats::{
    BakedFile, CameraSection, MotionSection, ProxySection, Scene, SrbfLight, WindSection,
};
use strandlight_runtime::script::Script;
use strandlight_runtime::{Display, InteractiveBackend, Session, Viewer};
use strandlight_scattering::HairParams;
use strandlight_scene::{Backend, PreparedScene};
use strandlight_tests::scenes::{curtain, ellipsoid, key_and_sky, write_small_scene};

const SIZE: [u32; 2] = [24, 16];

/// Beside the hair of [`curtain`], and in the picture.
fn head() -> ProxySection {
    ProxySection::ellipsoid([2.0, -2.0, 0.0], [1.0, 2.0, 1.0])
}

fn ground() -> ProxySection {
    ProxySection::Ground {
        height: -6.0,
        albedo: [0.5, 0.4, 0.3],
    }
}

/// Draws after each step of `script`, and of a fresh viewer of the same document at the same time.
fn check(session: &Session, script: Value) {
    let open = |session: Session| {
        let viewer = Viewer::on(session, |scene| Ok(Box::new(CpuRenderer::new(scene))));
        viewer.expect("a scene that can be drawn")
    };
    let mut viewer = open(session.clone());
    let steps = Script::from_json(&script.to_string()).expect("valid").steps;
    let (mut before, _) = viewer.frame(SIZE, 4).expect("a picture");
    for step in steps {
        let script = Script {
            steps: vec![step.clone()],
        };
        let done = script.run(&mut viewer, |_, _| {
            Ok::<(), strandlight_runtime::ScriptError>(())
        });
        done.expect("a valid step");
        let (found, stats) = viewer.frame(SIZE, 4).expect("a picture");
        assert_eq!(stats.device, None);
        let mut fresh = open(viewer.session().clone());
        fresh.set_time(viewer.time()).expect("a time");
        let (expected, _) = fresh.frame(SIZE, 4).expect("a picture");
        assert!(found == expected, "{step:?}");
        assert_eq!(viewer.renderer().name(), "cpu");
        assert!(found != before, "{step:?} changes nothing");
        before = found;
    }
}

/// Draws on until the picture is complete; answers how many pictures there were.
pub(super) fn finish(viewer: &mut Viewer) -> usize {
    let mut n = 0;
    loop {
        let before = version(viewer);
        // A step at a time.
        let progress = viewer.advance(Duration::ZERO).expect("a picture");
        n += usize::from(version(viewer) != before);
        if progress.is_done {
            assert!(progress.is_shaded && progress.is_shown);
            return n;
        }
    }
}

pub(super) fn shown<'a>(viewer: &'a Viewer) -> strandlight_cpu::DisplayPixels<'a> {
    match viewer.display() {
        Display::Pixels(pixels) => pixels,
        Display::Texture(_) => unreachable!("the CPU draws"),
    }
}

fn version(viewer: &Viewer) -> u64 {
    shown(viewer).version
}

pub(super) fn interactive(session: Session) -> Viewer {
    let viewer = Viewer::on(session, |scene| {
        Ok(Box::new(InteractiveRenderer::new(scene)) as Box<dyn InteractiveBackend>)
    });
    let mut viewer = viewer.expect("a scene that can be drawn");
    viewer.set_window(SIZE).expect("a size");
    viewer
}

/// Edits while a picture is drawn, every other one before there is any: in the end the picture is that of
/// a fresh window.
#[test]
fn interactive_pictures_end_as_fresh_ones() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    // More than two vectors of them.
    let lights = (0..20).map(|ix| {
        let turn = 0.7 * f64::from(ix);
        SrbfLight {
            direction: [0.8 * turn.cos(), 0.6, 0.8 * turn.sin()].map(|x| x as f32),
            // The first one is a sun.
            lambda: 0.02 + 0.04 * ix as f32,
            rgb: match ix {
                0 => [400.0, 380.0, 340.0],
                _ => [0.5, 0.4, 0.3],
            },
        }
    });
    let at = write_small_scene(folder.path(), &hair, lights.collect(), |scene| {
        scene.hair.diameter_cm = Some(0.1);
        scene.render.size = SIZE;
        scene.proxies = vec![head()];
    });
    let session = Session::open(&at).expect("a scene");
    let mut viewer = interactive(session.clone());
    // One without shadow maps, one of all light.
    assert!(finish(&mut viewer) >= 2);
    assert_eq!(finish(&mut viewer), 0);
    let brush = |dye: [f64; 3]| json!({"radius_cm": 1.5, "effect": {"dye": dye}});
    let script = json!([
        {"set": {"hair.eta": 1.7}},
        {"set": {"hair.sigma_a": [0.1, 0.4, 0.8]}},
        {"set": {"lights.muted": [1, 5, 6]}},
        {"set": {"lights.tint": [0.5, 0.5, 0.5]}},
        {"set": {"lights.muted": []}},
        {"set": {"camera.position": [1, -2, 12]}},
        {"set": {"camera.position": [2, -2, 12]}},
        {"set": {"lights.rotate_deg": 100}},
        {"set": {"camera.position": [3, -3, 13]}},
        {"stroke": {"brush": brush([0.1, 0.9, 2.0]), "path": [[8, 6], [14, 8]]}},
        {"stroke": {"brush": brush([2.0, 0.9, 0.1]), "path": [[8, 8], [14, 10]]}},
        {"set": {"camera.position": [1, -3, 13]}},
        {"undo": 1},
        {"undo": 1},
        {"set": {"render.background": [0.5, 0, 0]}},
        {"set": {"render.exposure": 1}},
        {"set": {"hair.diameter_cm": 0.05}},
        {"set": {"hair.eta": 1.4}}
    ]);
    let steps = Script::from_json(&script.to_string()).expect("valid").steps;
    let mut before = Vec::new();
    for (ix, step) in steps.into_iter().enumerate() {
        let script = Script { steps: vec![step] };
        let done = script.run(&mut viewer, |_, _| {
            Ok::<(), strandlight_runtime::ScriptError>(())
        });
        done.expect("a valid step");
        if ix % 2 == 0 {
            for _ in 0..ix {
                viewer.advance(Duration::ZERO).expect("a step");
            }
            continue;
        }
        finish(&mut viewer);
        let mut fresh = interactive(viewer.session().clone());
        finish(&mut fresh);
        let pixels = shown(&viewer).pixels.to_vec();
        assert!(pixels == shown(&fresh).pixels, "{ix}");
        assert!(pixels != before, "{ix} changes nothing");
        before = pixels;
    }
}

/// Strands that vary, and paint over them, whatever is edited first.
#[test]
fn edits_of_the_variation_end_as_fresh_scenes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_curtain(folder.path(), Vec::new());
    let brush = |dye: [f64; 3]| json!({"radius_cm": 1.5, "effect": {"dye": dye}});
    let script = json!([
        {"set": {"variation.melanin_strand": 0.5}},
        {"set": {"variation.seed": 3}},
        {"set": {"hair.sigma_a": [0.1, 0.4, 0.8]}},
        {"set": {"hair.eta": 1.7}},
        {"stroke": {"brush": brush([0.1, 0.9, 2.0]), "path": [[8, 6], [14, 8]]}},
        {"stroke": {"brush": brush([2.0, 0.9, 0.1]), "path": [[8, 8], [14, 10]]}},
        {"undo": 1},
        {"set": {"hair.sigma_a": [0.5, 0.4, 0.3]}},
        {"set": {"variation.roughness_lock": 0.5, "variation.lock_size_cm": 0.5}},
        {"set": {"variation.frizz": 0.5}},
        {"set": {"variation.grey": 0.5}},
        {"stroke": {"brush": brush([2.0, 0.9, 0.1]), "path": [[8, 8], [14, 10]]}},
        {"set": {"hair.diameter_cm": 0.05}},
        {"set": {"variation.roughness_lock": 0}},
        {"set": {"variation.clump": 0.7}},
        {"set": {"variation.grey": 0, "variation.melanin_strand": 0}},
        {"stroke": {"brush": brush([0.2, 0.2, 0.2]), "path": [[8, 2], [14, 2]]}},
        {"undo": 1},
        {"undo": 1},
        {"set": {"variation": null}}
    ]);
    check(&Session::open(&at).expect("a scene"), script);
    // Brushes that read the paint lie over the variation as well.
    let with = |effect: &str| json!({"radius_cm": 1.5, "effect": effect});
    let script = json!([
        {"set": {"variation.melanin_strand": 0.5}},
        {"stroke": {"brush": brush([0.1, 0.9, 2.0]), "path": [[8, 6], [14, 8]]}},
        {"stroke": {"brush": with("smear"), "path": [[12, 8], [14, 12]]}},
        {"stroke": {"brush": with("blur"), "path": [[8, 6], [14, 8]]}},
        {"flood": {"effect": "blur", "radius_cm": 3}},
        {"flood": {"effect": {"width_scale": 2}, "strength": 0.5, "mask": {"from": 0.5}}},
        {"undo": 1},
        {"redo": 1},
    ]);
    check(&Session::open(&at).expect("a scene"), script);
    // Without any paint: the painted path goes when the variation does.
    let script = json!([
        {"set": {"variation.roughness_strand": 0.5}},
        {"set": {"hair.sigma_a": [0.5, 0.4, 0.3]}},
        {"set": {"variation.roughness_strand": 0}},
        {"set": {"variation.melanin_lock": 0.5}},
        {"undo": 1},
    ]);
    check(&Session::open(&at).expect("a scene"), script);
}

/// A scene that is replaced before its picture is complete shows one for each.
#[test]
fn every_scene_has_a_picture_though_another_follows() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |_| ());
    let mut viewer = interactive(Session::open(&at).expect("a scene"));
    finish(&mut viewer);
    for n in [8, 16, 32, 8] {
        let script = json!([{"set": {"render.shadow_maps": n}}]);
        let script = Script::from_json(&script.to_string()).expect("valid");
        let done = script.run(&mut viewer, |_, _| {
            Ok::<(), strandlight_runtime::ScriptError>(())
        });
        done.expect("a valid step");
        let before = version(&viewer);
        while version(&viewer) == before {
            let progress = viewer.advance(Duration::ZERO).expect("a step");
            assert!(!progress.is_done || version(&viewer) != before);
        }
    }
    // Away and back to a size without a step in between.
    finish(&mut viewer);
    viewer.set_window([0, 0]).expect("a size");
    viewer.set_window(SIZE).expect("a size");
    finish(&mut viewer);
    assert!(shown(&viewer).size == SIZE);
}

/// Stages that run for a picture after `keys` were set, but for the last one, which always does.
fn stages(viewer: &mut Viewer<dyn Backend>, keys: Value) -> Vec<&'static str> {
    let script = Script::from_json(&json!([{"set": keys}]).to_string()).expect("valid");
    let done = script.run(
        viewer,
        |_, _| Ok::<(), strandlight_runtime::ScriptError>(()),
    );
    done.expect("a valid step");
    let (_, stats) = viewer.frame(SIZE, 4).expect("a picture");
    let mut names: Vec<&str> = stats.stages.iter().map(|stage| stage.name).collect();
    assert_eq!(names.pop(), Some("composite"));
    names
}

#[test]
fn edits_run_only_the_stages_that_they_touch() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |_| ());
    let session = Session::open(&at).expect("a scene");
    let viewer = Viewer::on(session, |scene| {
        Ok(Box::new(CpuRenderer::new(scene)) as Box<dyn Backend>)
    });
    let mut viewer = viewer.expect("a scene that can be drawn");
    let (_, stats) = viewer.frame(SIZE, 4).expect("a picture");
    let all: Vec<&str> = stats.stages.iter().map(|stage| stage.name).collect();
    let expected = [
        "voxelise",
        "list",
        "through maps",
        "shadow maps",
        "transmittance",
        "tables",
        "shade",
        "composite",
    ];
    assert_eq!(all, expected);
    assert!(stats.visible_points > 0 && stats.list_entries > 0);
    for (keys, expected) in [
        (json!({"hair.eta": 1.7}), &["tables", "shade"][..]),
        (json!({"hair.density_back": 0.5}), &["shade"]),
        (json!({"lights.tint": [1, 0.5, 0.2]}), &["shade"]),
        (json!({"render.background": [0.5, 0, 0]}), &[]),
        (json!({"render.exposure": 1}), &[]),
        (
            json!({"lights.rotate_deg": 40}),
            &["shadow maps", "transmittance", "shade"],
        ),
        (
            json!({"camera.position": [1, -2, 12]}),
            &["list", "through maps", "shadow maps", "shade"],
        ),
        // The second view's shadow maps serve all views.
        (
            json!({"camera.position": [1, -3, 12]}),
            &["list", "through maps", "shade"],
        ),
        (
            json!({"variation.melanin_strand": 0.2}),
            &["tables", "shade"],
        ),
        // Tables of hair that varies serve any absorption.
        (json!({"hair.sigma_a": [0.27, 0.43, 0.84]}), &["shade"]),
        (json!({"hair.eta": 1.6}), &["tables", "shade"]),
        (json!({"render.scattering": "single"}), &["shade"]),
        (json!({"variation.melanin_strand": 0.3}), &["shade"]),
        (json!({"variation.melanin_strand": 0.4}), &["shade"]),
        (json!({"variation.seed": 1}), &["shade"]),
    ] {
        assert_eq!(stages(&mut viewer, keys.clone()), expected, "{keys}");
    }
}

/// A scene of a straight curtain of hair with these things beside it.
fn write_curtain(folder: &Path, proxies: Vec<ProxySection>) -> PathBuf {
    let hair = curtain(20, 6, 0.2, 0.0);
    write_small_scene(folder, &hair, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.1);
        scene.render.size = SIZE;
        scene.proxies = proxies;
    })
}

/// Does one step of a script.
fn step(viewer: &mut Viewer, step: Value) {
    let script = Script::from_json(&json!([step]).to_string()).expect("valid");
    let done = script.run(
        viewer,
        |_, _| Ok::<(), strandlight_runtime::ScriptError>(()),
    );
    done.expect("a valid step");
}

/// A light that is tinted or off is there at the first picture, with all light: what each light comes to is kept.
#[test]
fn other_colors_of_the_lights_show_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_curtain(folder.path(), vec![head()]);
    let mut viewer = interactive(Session::open(&at).expect("a scene"));
    finish(&mut viewer);
    check_colors_of_the_lights(&mut viewer);
}

/// The same of hair that varies, some strands being as the hair is; and where points are painted between such edits, whose own is kept then.
#[test]
fn other_colors_of_the_lights_show_at_once_on_painted_hair() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_curtain(folder.path(), vec![head()]);
    let brush = |dye: [f64; 3]| json!({"radius_cm": 1.5, "effect": {"dye": dye}});
    let stroke = |dye, path: Value| json!({"stroke": {"brush": brush(dye), "path": path}});
    let mut viewer = interactive(Session::open(&at).expect("a scene"));
    for edit in [
        stroke([0.1, 0.9, 2.0], json!([[8, 6], [14, 8]])),
        json!({"set": {"variation.melanin_strand": 0.5, "variation.grey": 0.2}}),
        stroke([2.0, 0.5, 0.1], json!([[12, 2], [14, 12]])),
        stroke([0.5, 0.5, 0.5], json!([[2, 2], [4, 12]])),
        json!({"set": {"hair.sigma_a": [0.1, 0.4, 0.8]}}),
        json!({"set": {"variation.grey": 0}}),
    ] {
        step(&mut viewer, edit);
        finish(&mut viewer);
        check_colors_of_the_lights(&mut viewer);
    }
    // Paint that came while that was being kept is in it as well.
    for n_steps in 0..12 {
        step(
            &mut viewer,
            json!({"set": {"hair.eta": 1.4 + 0.01 * f64::from(n_steps)}}),
        );
        for _ in 0..n_steps {
            viewer.advance(Duration::ZERO).expect("a step");
        }
        step(
            &mut viewer,
            stroke(
                [0.3 * f64::from(n_steps), 0.9, 0.2],
                json!([[8, 6], [14, 8]]),
            ),
        );
        for _ in 0..n_steps / 2 {
            viewer.advance(Duration::ZERO).expect("a step");
        }
        step(
            &mut viewer,
            stroke([0.1, 0.9, 0.2], json!([[4, 6], [10, 10]])),
        );
        finish(&mut viewer);
        check_colors_of_the_lights(&mut viewer);
    }
}

/// Of a finished picture.
fn check_colors_of_the_lights(viewer: &mut Viewer) {
    let mut before = shown(viewer).pixels.to_vec();
    for keys in [
        json!({"lights.tint": [1, 0.5, 0.2]}),
        json!({"lights.muted": [1]}),
        json!({"lights.muted": []}),
        json!({"lights.tint": [1, 1, 1]}),
    ] {
        step(viewer, json!({"set": keys}));
        // Until there is a picture.
        let progress = viewer.advance(Duration::from_secs(60)).expect("a step");
        assert!(
            progress.is_shown && progress.is_shaded && !progress.is_done,
            "{keys}"
        );
        let first = shown(viewer).pixels.to_vec();
        assert!(first != before, "{keys} changes nothing");
        finish(viewer);
        let last = shown(viewer).pixels.to_vec();
        let levels = first.as_flattened().iter().zip(last.as_flattened());
        let most = levels.map(|(a, b)| a.abs_diff(*b)).max();
        assert!(most <= Some(2), "{keys}: {most:?}");
        before = last;
    }
}

/// Maps are looked up for the view that is shown first. Then they are at all points, so that other views find them
/// ready; one that comes while they are under way waits for them, and is right.
#[test]
fn shadow_maps_serve_other_views_after_the_first_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_curtain(folder.path(), Vec::new());
    let mut scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    // Half of the hair is out of view.
    scene.camera.eye = scene.camera.eye.lerp(scene.camera.target, 0.7);
    let fresh = |scene: &PreparedScene| {
        let mut live = InteractiveRenderer::new(scene.clone());
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        live.display().pixels.to_vec()
    };
    let mut other = scene.clone();
    other.camera.eye.x -= 2.0;
    other.camera.target.x -= 2.0;
    // How many steps there are until the first complete picture, and until all is done.
    let mut live = InteractiveRenderer::new(scene.clone());
    let mut steps = [0, 0];
    loop {
        let progress = live.advance(Duration::ZERO).expect("a step");
        steps[0] += usize::from(!progress.is_shaded);
        steps[1] += 1;
        if progress.is_done {
            break;
        }
    }
    assert!(steps[1] > steps[0] + 3, "{steps:?}");
    assert!(live.display().pixels == fresh(&scene));
    live.set_camera(other.camera);
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    assert!(live.display().pixels == fresh(&other));
    let has_run = |name| live.report().stage(name).is_some();
    assert!(has_run("through maps") && !has_run("shadow maps"));
    for n in steps[0]..steps[1] {
        let mut live = InteractiveRenderer::new(scene.clone());
        for _ in 0..n {
            live.advance(Duration::ZERO).expect("a step");
        }
        live.set_camera(other.camera);
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        assert!(
            live.display().pixels == fresh(&other),
            "after {n} of {steps:?} steps"
        );
    }
}

/// Edits that come after any 17th step: a light goes off and on, the hair changes and back. The last picture is right;
/// those before are looked at in `cpu_first_pictures`.
#[test]
fn slow_edits_between_steps_end_as_fresh_scenes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_curtain(folder.path(), vec![head()]);
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let on: Vec<[f32; 3]> = scene.lights.iter().map(|light| light.rgb).collect();
    let mut off = on.clone();
    off[0] = [0.0; 3];
    let (hair, modes) = (*scene.hair.hair(), scene.hair.modes().to_vec());
    let other = HairParams {
        eta: hair.eta + 0.1,
        ..hair
    };
    let mut live = InteractiveRenderer::new(scene.clone());
    let mut n_steps = 1;
    while !live.advance(Duration::ZERO).expect("a step").is_done {
        n_steps += 1;
    }
    let fresh = live.display().pixels.to_vec();
    for n in (0..n_steps).step_by(17) {
        let mut live = InteractiveRenderer::new(scene.clone());
        let step = |live: &mut InteractiveRenderer, n: usize| {
            for _ in 0..n {
                live.advance(Duration::ZERO).expect("a step");
            }
        };
        step(&mut live, n);
        live.set_light_colors(&off).expect("as many lights");
        step(&mut live, 1 + n % 3);
        live.set_hair(&other, &modes).expect("in range");
        step(&mut live, 1 + n % 2);
        live.set_light_colors(&on).expect("as many lights");
        step(&mut live, 1);
        live.set_hair(&hair, &modes).expect("in range");
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        assert!(
            live.display().pixels == fresh,
            "after {n} of {n_steps} steps"
        );
    }
}

/// A light below the power from which on there are maps is lifted above it when another is off.
#[test]
fn a_light_that_is_off_draws_no_maps_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    let light = |x: f32, strength: f32| SrbfLight {
        direction: [x, 0.6, 0.8 - 0.2 * x.abs()],
        lambda: 0.2,
        rgb: [strength; 3],
    };
    let mut lights = vec![light(-0.5, 1.0), light(0.0, 1.0), light(0.5, 0.0036)];
    for light in &mut lights {
        let length = light.direction.iter().map(|x| x * x).sum::<f32>().sqrt();
        light.direction = light.direction.map(|x| x / length);
    }
    let at = write_small_scene(folder.path(), &hair, lights, |_| ());
    let viewer = Viewer::on(Session::open(&at).expect("a scene"), |scene| {
        Ok(Box::new(CpuRenderer::new(scene)) as Box<dyn Backend>)
    });
    let mut viewer = viewer.expect("a scene that can be drawn");
    viewer.frame(SIZE, 4).expect("a picture");
    assert_eq!(stages(&mut viewer, json!({"lights.muted": [0]})), ["shade"]);
    // Alone it has all of the power.
    let found = stages(&mut viewer, json!({"lights.muted": [0, 1]}));
    assert!(found.contains(&"shadow maps"), "{found:?}");
}

/// Light on what stands beside the hair is found for all colours and views at once.
#[test]
fn light_on_proxies_is_kept() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.proxies = vec![head(), ground()];
    });
    let viewer = Viewer::on(Session::open(&at).expect("a scene"), |scene| {
        Ok(Box::new(CpuRenderer::new(scene)) as Box<dyn Backend>)
    });
    let mut viewer = viewer.expect("a scene that can be drawn");
    viewer.frame(SIZE, 4).expect("a picture");
    for (keys, is_found) in [
        (json!({"hair.eta": 1.7}), false),
        (json!({"lights.tint": [1, 0.5, 0.2]}), false),
        (json!({"lights.muted": [1]}), false),
        (json!({"lights.muted": []}), false),
        (json!({"camera.position": [1, -2, 12]}), false),
        (json!({"lights.rotate_deg": 40}), true),
        (json!({"hair.diameter_cm": 0.05}), true),
        (json!({"proxy.0.albedo": [0.1, 0.1, 0.1]}), true),
    ] {
        let found = stages(&mut viewer, keys.clone());
        assert_eq!(found.contains(&"light on proxies"), is_found, "{keys}");
    }
}

#[test]
fn slow_edits_draw_what_a_fresh_scene_draws() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for has_wind in [false, true] {
        let at = write_small_scene(
            folder.path(),
            &curtain(20, 6, 0.2, 0.0),
            key_and_sky(),
            |scene| {
                scene.hair.diameter_cm = Some(0.1);
                scene.render.size = SIZE;
                scene.camera = Some(CameraSection {
                    position: [0.0, -2.0, 16.0],
                    target: [0.0, -2.0, 0.0],
                    up: [0.0, 1.0, 0.0],
                    fov_deg: 30.0,
                });
                scene.motion = has_wind.then(|| MotionSection {
                    wind: Some(WindSection::default()),
                    ..MotionSection::default()
                });
                scene.proxies = vec![head(), ground()];
            },
        );
        let session = Session::open(&at).expect("a scene");
        let brush = |dye: [f64; 3]| json!({"radius_cm": 1.5, "effect": {"dye": dye}});
        check(
            &session,
            json!([
                {"set": {"hair.eta": 1.7}},
                {"set": {"hair.modes": ["R", "TRT"]}},
                {"set": {"render.scattering": "single"}},
                {"set": {"render.scattering": "total", "hair.density_forward": 0.5}},
                {"set": {"lights.muted": [1]}},
                {"set": {"lights.rotate_deg": 100}},
                {"set": {"lights.tint": [1, 0.5, 0.2]}},
                {"set": {"render.shadow_maps": 2}},
                // Local scattering reads more of the volume than is found without it.
                {"set": {"hair.diameter_cm": 0.05, "render.scattering": "single"}},
                {"set": {"render.scattering": "total"}},
                {"set": {"render.background": [0.5, 0, 0]}},
                {"set": {"camera.position": [1, -2, 12]}},
                {"stroke": {"brush": brush([0.1, 0.9, 2.0]), "path": [[8, 6], [14, 8]]}},
                {"undo": 1},
                {"redo": 1},
                {"set": {"hair.melanin": {"eumelanin": 1.0}}},
                // Tables of painted points that other absorption needs, and that one term does not.
                {"set": {"hair.melanin": {"eumelanin": 0.02}}},
                {"set": {"render.scattering": "single"}},
                {"set": {"render.scattering": "total", "hair.melanin": {"eumelanin": 4.0}}},
                {"undo": 3},
                {"undo": 3},
                {"undo": 6}
            ]),
        );
        if has_wind {
            check(
                &session,
                json!([
                    {"time": 0.7},
                    {"stroke": {"brush": brush([2.0, 0.2, 0.1]), "path": [[8, 6], [14, 8]]}},
                    {"time": 1.5},
                    {"set": {"hair.eta": 1.7}}
                ]),
            );
        }
    }
}

#[test]
fn hair_whose_paint_was_taken_back_counts_as_bare() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_small_scene(
        folder.path(),
        &curtain(20, 6, 0.2, 0.0),
        key_and_sky(),
        |scene| {
            scene.hair.diameter_cm = Some(0.1);
            scene.render.size = SIZE;
        },
    );
    let session = Session::open(&at).expect("a scene");
    let dye = json!({"radius_cm": 1.5, "effect": {"dye": [0.1, 0.9, 2.0]}});
    let erase = json!({"radius_cm": 1.5, "effect": "erase"});
    for script in [
        // Painted hair is round and of model `marschner`.
        json!([
            {"stroke": {"brush": dye, "path": [[8, 6], [14, 8]]}},
            {"undo": 1},
            {"set": {"hair.eccentricity": 1.3}},
            {"undo": 1},
            {"redo": 1},
        ]),
        json!([
            {"flood": dye},
            {"flood": erase},
            {"set": {"hair.model": "energy"}},
            {"undo": 2},
            {"redo": 2},
        ]),
        json!([
            {"set": {"hair.eccentricity": 1.3}},
            {"set": {"hair.eccentricity": 1}},
            {"flood": dye},
            {"undo": 2},
            {"redo": 2},
        ]),
    ] {
        check(&session, script);
    }
}

/// A mesh that an edit brings is there, in the window as in a scene that is opened afresh.
#[test]
fn meshes_of_proxies_come_and_go_with_edits() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, radius) in [("small.mesh", 1.0), ("large.mesh", 1.8)] {
        let mesh = ellipsoid([radius, 2.0 * radius, radius], 12);
        mesh.write(&folder.path().join(name)).expect("written");
    }
    let hair = curtain(20, 6, 0.2, 0.0);
    let at = write_small_scene(folder.path(), &hair, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.1);
        scene.render.size = SIZE;
    });
    let opened = |viewer: &Viewer<dyn Backend>| {
        let copy = at.with_file_name("copy.toml");
        let text = viewer.session().scene().to_toml_string().expect("valid");
        std::fs::write(&copy, text).expect("written");
        let session = Session::open(&copy).expect("a scene");
        let fresh = Viewer::on(session, |scene| {
            Ok(Box::new(CpuRenderer::new(scene)) as Box<dyn Backend>)
        });
        let (picture, _) = fresh.expect("drawn").frame(SIZE, 4).expect("a picture");
        picture
    };
    let session = Session::open(&at).expect("a scene");
    let viewer = Viewer::on(session, |scene| {
        Ok(Box::new(CpuRenderer::new(scene)) as Box<dyn Backend>)
    });
    let mut viewer = viewer.expect("a scene that can be drawn");
    let mut pictures = vec![opened(&viewer)];
    let mesh = json!([{"kind": "mesh", "mesh": "small.mesh", "offset": [2, -2, 0], "albedo": [0.8, 0.8, 0.8]}]);
    for values in [
        json!({"proxy": mesh}),
        json!({"proxy.0.mesh": "large.mesh"}),
        json!({"proxy": []}),
    ] {
        viewer
            .set(values.as_object().expect("a table"))
            .expect("valid");
        let (found, _) = viewer.frame(SIZE, 4).expect("a picture");
        assert!(found == opened(&viewer), "{values}");
        assert!(found != pictures[pictures.len() - 1], "{values}");
        pictures.push(found);
    }
    for wanted in pictures.iter().rev().skip(1) {
        viewer.undo().expect("drawn").expect("a step");
        let (found, _) = viewer.frame(SIZE, 4).expect("a picture");
        assert!(found == *wanted);
    }
}
