//! What the CPU renderer shows at first, after an edit and from another view, is close to what it shows in the end.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;

use strandlight_cpu::InteractiveRenderer;
use strandlight_formats::{Background, ProxySection, Scene, SrbfLight};
use strandlight_runtime::Session;
use strandlight_runtime::script::Script;
use strandlight_scene::paint::{Paint, PaintedPoint};
use strandlight_scene::{Backend, PreparedScene};
use strandlight_tests::scenes::{curtain, key_and_sky, write_scene, write_small_scene};

use super::cpu_edits::{finish, interactive, shown};

const SIZE: [u32; 2] = [96, 64];

/// A scene of hair that is as dense, and as finely sampled, as hair is: points lie a quarter of a centimetre apart.
fn write_dense_hair(folder: &Path, lights: Vec<SrbfLight>) -> PathBuf {
    let mut hair = curtain(100, 48, 0.04, 4.0);
    for [_, y, z] in &mut hair.points {
        (*y, *z) = (0.25 * *y, 0.1 * *z);
    }
    write_small_scene(folder, &hair, lights, |scene| {
        scene.hair.diameter_cm = Some(0.05);
        scene.render.background = Background::Color([0.0; 3]);
        scene.render.size = SIZE;
    })
}

/// The same over a ground that sends light back.
fn dense_hair_over_a_ground() -> PreparedScene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let mut description = Scene::read(&at).expect("a scene");
    description.proxies = vec![ProxySection::Ground {
        height: -1.5,
        albedo: [0.9; 3],
    }];
    let scene = PreparedScene::load(&description).expect("hair");
    assert!(scene.has_bounce());
    scene
}

/// The first picture after an edit of the hair, of one in five points, hardly differs from the last beside what the
/// edit changes: shadows are where they were.
#[test]
fn first_pictures_after_edits_are_close_to_the_last() {
    first_pictures_are_close(Vec::new(), 0.015);
}

/// The same of hair over a ground, which fills most of the picture and whose light is found at fewer points yet.
#[test]
fn first_pictures_after_edits_have_the_light_of_proxies() {
    let ground = ProxySection::Ground {
        height: -1.5,
        albedo: [0.95, 0.6, 0.3],
    };
    first_pictures_are_close(vec![ground], 1e-3);
}

fn first_pictures_are_close(proxies: Vec<ProxySection>, least: f64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut lights = key_and_sky();
    lights.push(SrbfLight {
        direction: [0.6, 0.64, 0.48],
        lambda: 0.02,
        rgb: [90.0, 85.0, 80.0],
    });
    let at = write_dense_hair(folder.path(), lights);
    let mut scene = Scene::read(&at).expect("a scene");
    scene.proxies = proxies;
    let at = write_scene(folder.path(), "a.toml", &scene);
    let mut viewer = interactive(Session::open(&at).expect("a scene"));
    viewer.set_window(SIZE).expect("a size");
    finish(&mut viewer);
    let mut n_drafts = 0;
    for keys in [
        json!({"hair.sigma_a": [1.0, 2.0, 4.0]}),
        json!({"hair.eta": 1.35}),
        json!({"hair.density_back": 0.3}),
        json!({"hair.width_deg": {"r": 10, "tt": 5, "trt": 14}}),
    ] {
        let before = shown(&viewer).pixels.to_vec();
        let script = Script::from_json(&json!([{"set": keys}]).to_string()).expect("valid");
        let done = script.run(&mut viewer, |_, _| {
            Ok::<(), strandlight_runtime::ScriptError>(())
        });
        done.expect("a valid step");
        while !viewer.advance(Duration::ZERO).expect("a step").is_shaded {}
        let first = shown(&viewer).pixels.to_vec();
        finish(&mut viewer);
        let last = shown(&viewer).pixels.to_vec();
        let (step, edit) = (distance(&first, &last), distance(&before, &last));
        println!("{keys}: {step:.4} of {edit:.4}");
        assert!(
            step < f64::max(least, 0.02 * edit),
            "{keys}: {step} of {edit}"
        );
        n_drafts += usize::from(first != last);
    }
    assert!(
        n_drafts >= 3,
        "{n_drafts}: first pictures are not the last ones"
    );
}

/// After lights were turned the first picture in the shadows of shadow maps comes before all of these are drawn, and is close to the
/// last one: nearly all points have single scattering of their own, in the shadows of one in two maps and of all of a sun's.
#[test]
fn turned_lights_have_shadows_before_all_maps_are_drawn() {
    // With many threads all maps are drawn in one step.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    for varies in [false, true] {
        one.install(|| turn_lights(dense_hair_in_sun_and_sky(varies)));
    }
}

/// A sun and two wide lights, turned.
fn sun_and_sky(turn: f32) -> Vec<SrbfLight> {
    let light = |azimuth: f32, lambda: f32, rgb: f32| SrbfLight {
        direction: [
            0.8 * (azimuth + turn).cos(),
            0.6,
            0.8 * (azimuth + turn).sin(),
        ],
        lambda,
        rgb: [rgb, 0.9 * rgb, 0.8 * rgb],
    };
    vec![
        light(0.6, 0.02, 300.0),
        light(1.8, 0.6, 1.0),
        light(4.0, 0.9, 0.4),
    ]
}

/// Hair beside an ellipsoid in their light, of one absorption or of many.
fn dense_hair_in_sun_and_sky(varies: bool) -> PreparedScene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), sun_and_sky(0.0));
    let mut scene = Scene::read(&at).expect("a scene");
    scene.proxies = vec![ProxySection::ellipsoid([0.0, 0.0, -2.0], [2.0, 1.0, 1.0])];
    if varies {
        (scene.variation.melanin_strand, scene.variation.grey) = (0.4, 0.3);
    }
    PreparedScene::load(&scene).expect("hair")
}

fn turn_lights(scene: PreparedScene) {
    let first_maps = scene.shadow_plan().maps_for_first();
    assert!(first_maps.iter().filter(|is_first| !**is_first).count() > 2);
    let mut live = InteractiveRenderer::new(scene);
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    live.set_lights(sun_and_sky(0.7)).expect("lights");
    let version = live.display().version;
    while live.display().version == version {
        live.advance(Duration::ZERO).expect("a step");
    }
    let draft = live.display().pixels.to_vec();
    while !live.advance(Duration::ZERO).expect("a step").is_shaded {}
    let shadowed = live.display().pixels.to_vec();
    assert_eq!(live.report().stats.texels_visited, 0, "all maps are drawn");
    // Until the next picture.
    let mut n_texels = 0;
    while !live.advance(Duration::ZERO).expect("a step").is_done {
        n_texels = u64::max(n_texels, live.report().stats.texels_visited);
    }
    assert!(n_texels > 0);
    let last = live.display().pixels.to_vec();
    let [of_draft, of_shadowed] = [&draft, &shadowed].map(|picture| distance(picture, &last));
    println!("{of_draft:.4}, {of_shadowed:.4}");
    assert!(of_shadowed < 0.05 && of_draft > 5.0 * of_shadowed);
}

/// Edits that come while a picture in the shadows of some maps is being made leave nothing of it behind.
#[test]
fn edits_after_lights_turned_end_as_fresh_scenes() {
    for varies in [false, true] {
        edit_after_lights_turned(dense_hair_in_sun_and_sky(varies));
    }
}

fn edit_after_lights_turned(scene: PreparedScene) {
    let mut camera = scene.camera;
    camera.eye.x += 0.1 * camera.eye.distance(camera.target);
    let mut hair = *scene.hair.hair();
    hair.eta = 1.4;
    let modes = scene.hair.modes().to_vec();
    let colors = [[10.0, 20.0, 30.0], [1.0, 0.2, 0.5], [0.5; 3]];
    let n_points = scene.strands.n_groom_points();
    let mut paint = Paint::unpainted(n_points);
    paint.points[n_points / 3..n_points / 2].fill(PaintedPoint {
        sigma_a: [0.1, 0.4, 0.9],
        weight: 1.0,
        ..PaintedPoint::NONE
    });
    type Change<'a> = (&'a str, &'a dyn Fn(&mut InteractiveRenderer));
    let edits: [Change; 5] = [
        ("paint", &|live| {
            live.set_paint(&paint, 0..n_points).expect("as many");
        }),
        ("hair", &|live| {
            live.set_hair(&hair, &modes).expect("in range");
        }),
        ("view", &|live| live.set_camera(camera)),
        ("colours", &|live| {
            live.set_light_colors(&colors).expect("as many");
        }),
        ("lights", &|live| {
            live.set_lights(sun_and_sky(1.9)).expect("lights");
        }),
    ];
    for (name, edit) in edits {
        let mut fresh = InteractiveRenderer::new(scene.clone());
        fresh.set_lights(sun_and_sky(0.7)).expect("lights");
        edit(&mut fresh);
        while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
        let mut live = InteractiveRenderer::new(scene.clone());
        for n_steps in (4..120).step_by(13) {
            live.set_scene(scene.clone()).expect("a scene");
            while !live.advance(Duration::ZERO).expect("a step").is_shaded {}
            live.set_lights(sun_and_sky(0.7)).expect("lights");
            for _ in 0..n_steps {
                live.advance(Duration::ZERO).expect("a step");
            }
            edit(&mut live);
            while !live.advance(Duration::ZERO).expect("a step").is_done {}
            assert!(
                live.display().pixels == fresh.display().pixels,
                "{name} after {n_steps} steps"
            );
        }
    }
}

/// Another view is shown at once, as what was shown is seen from there; then as its own points, in the light of the view before
/// where both show them.
#[test]
fn first_pictures_of_views_are_close_to_the_last() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let mut live = InteractiveRenderer::new(scene.clone());
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    for turn in [0.1, 0.25, 0.1] {
        let before = live.display().pixels.to_vec();
        let mut camera = scene.camera;
        camera.eye.x += turn * camera.eye.distance(camera.target);
        live.set_camera(camera);
        assert!(live.advance(Duration::ZERO).expect("a step").is_shown);
        let reprojected = live.display().pixels.to_vec();
        // What follows is faded in.
        let mut pictures = Vec::new();
        let mut version = live.display().version;
        while !live.advance(Duration::ZERO).expect("a step").is_done {
            if live.display().version != version {
                version = live.display().version;
                pictures.push(live.display().pixels.to_vec());
            }
        }
        let last = live.display().pixels.to_vec();
        let edit = distance(&before, &last);
        let steps: Vec<f64> = pictures.iter().map(|one| distance(one, &last)).collect();
        let step = distance(&reprojected, &last);
        println!("{turn}: {step:.4}, then {steps:.4?} of {edit:.4}");
        assert!(step > 0.0 && edit > 1.5 * step, "{turn}: {step} of {edit}");
        // The last but one is of its own points.
        assert!(steps.len() > 1, "{turn}: {steps:?}");
        let own = steps[steps.len() - 2];
        assert!(own < 0.02 && edit > 2.0 * own, "{turn}: {own} of {edit}");
        assert!(steps.iter().all(|one| *one <= step), "{turn}: {steps:?}");
    }
}

/// A view near the one before has all its light before maps look along its own line of sight; one far from it waits for these.
#[test]
fn views_near_the_one_before_are_complete_by_its_maps() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    for (turn, is_near) in [(0.1, true), (0.25, true), (0.6, false)] {
        let mut live = InteractiveRenderer::new(scene.clone());
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        let before = live.display().pixels.to_vec();
        let mut camera = scene.camera;
        camera.eye.x += turn * camera.eye.distance(camera.target);
        live.set_camera(camera);
        while !live.advance(Duration::ZERO).expect("a step").is_shaded {}
        let has_own_maps = live.report().stage("through maps").is_some();
        assert_eq!(has_own_maps, !is_near, "{turn}");
        let first = live.display().pixels.to_vec();
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        let last = live.display().pixels.to_vec();
        let (off, edit) = (distance(&first, &last), distance(&before, &last));
        println!("{turn}: {off:.4} of {edit:.4}");
        assert!(off < 0.02 && edit > 3.0 * off, "{turn}: {off} of {edit}");
        // Its own maps take their place.
        let mut fresh = scene.clone();
        fresh.camera = camera;
        let mut fresh = InteractiveRenderer::new(fresh);
        while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
        assert!(fresh.display().pixels == last, "{turn}");
    }
}

/// What one scene showed is not shown as another one's.
#[test]
fn another_scene_is_not_shown_as_the_last_view_of_the_one_before() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_small_scene(
        folder.path(),
        &curtain(20, 6, 0.2, 0.0),
        key_and_sky(),
        |_| (),
    );
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let mut live = InteractiveRenderer::new(scene.clone());
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let mut camera = scene.camera;
    camera.eye.x += 1.0;
    live.set_camera(camera);
    live.set_scene(scene).expect("a scene");
    assert!(!live.advance(Duration::ZERO).expect("a step").is_shown);
}

/// Between pictures of [`SIZE`], in means over 4 x 4, over their brightness.
fn distance(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let means = |pixels: &[[u8; 4]]| {
        let mut sums = vec![0.0; 3 * 24 * pixels.len() / (4 * 96)];
        for (ix, pixel) in pixels.iter().enumerate() {
            let tile = ix % 96 / 4 + 24 * (ix / 96 / 4);
            for channel in 0..3 {
                sums[3 * tile + channel] += f64::from(pixel[channel]);
            }
        }
        sums
    };
    let (a, b) = (means(a), means(b));
    let off: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (off / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// While a slider is dragged each frame brings an edit, and may have time for a single step: there are pictures all the same.
#[test]
fn drags_show_pictures_however_short_frames_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let mut live = InteractiveRenderer::new(scene.clone());
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let colors = |share: f32| -> Vec<[f32; 3]> {
        let of_lights = scene.lights.iter();
        of_lights
            .map(|light| light.rgb.map(|x| x * share))
            .collect()
    };
    type Drag<'a> = (&'a str, &'a dyn Fn(&mut InteractiveRenderer, f32));
    let drags: [Drag; 3] = [
        ("exposure", &|live, share| {
            live.set_grade(share, scene.display.clone(), scene.background);
        }),
        ("colours of the lights", &|live, share| {
            live.set_light_colors(&colors(share)).expect("as many");
        }),
        ("absorption", &|live, share| {
            let mut hair = *live.scene().hair.hair();
            hair.sigma_a = [f64::from(0.2 + share); 3];
            let modes = live.scene().hair.modes().to_vec();
            live.set_hair(&hair, &modes).expect("in range");
        }),
    ];
    for (name, edit) in drags {
        let mut n_pictures = 0;
        for ix in 1..=200 {
            edit(&mut live, 1.0 - 0.001 * ix as f32);
            let version = live.display().version;
            live.advance(Duration::ZERO).expect("a step");
            n_pictures += usize::from(live.display().version != version);
        }
        println!("{name}: {n_pictures} pictures in 200 frames");
        assert!(n_pictures >= 5, "{name}: {n_pictures} pictures");
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
    }
}

/// Edits that waited for a picture are taken up with one that comes once it is there: lights are added, and coloured then.
#[test]
fn edits_that_waited_are_taken_up_with_later_ones() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let lights = |n: usize| {
        let mut lights = scene.lights.clone();
        let more = (0..n).map(|ix| SrbfLight {
            direction: [0.6, if ix % 2 == 0 { 0.64 } else { -0.64 }, 0.48],
            lambda: 0.2,
            rgb: [2.0, 1.0 + ix as f32, 3.0],
        });
        lights.extend(more);
        lights
    };
    let mut live = InteractiveRenderer::new(scene.clone());
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    live.set_lights(lights(1)).expect("lights");
    live.advance(Duration::ZERO).expect("a step");
    live.set_lights(lights(5)).expect("lights");
    let version = live.display().version;
    while live.display().version == version {
        live.advance(Duration::ZERO).expect("a step");
    }
    let mut coloured = lights(5);
    for light in &mut coloured {
        light.rgb = light.rgb.map(|x| 0.5 * x);
    }
    let colors: Vec<[f32; 3]> = coloured.iter().map(|light| light.rgb).collect();
    live.set_light_colors(&colors).expect("as many");
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let mut fresh = InteractiveRenderer::new(scene.clone());
    fresh.set_lights(coloured).expect("lights");
    while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
    assert!(live.display().pixels == fresh.display().pixels);
}

/// Lights are coloured while the light from proxies is being found for the colours before: pictures keep what was found of it.
#[test]
fn light_from_proxies_stays_while_lights_are_dragged() {
    let scene = dense_hair_over_a_ground();
    let colors = |share: f32| -> Vec<[f32; 3]> {
        let of_lights = scene.lights.iter();
        of_lights
            .map(|light| light.rgb.map(|x| x * share))
            .collect()
    };
    let mut live = InteractiveRenderer::new(scene.clone());
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let whole = live.display().pixels.to_vec();
    for n_steps in 1..60 {
        // Both are hardly another light.
        live.set_light_colors(&colors(1.001)).expect("as many");
        for _ in 0..n_steps {
            live.advance(Duration::ZERO).expect("a step");
        }
        live.set_light_colors(&colors(0.999)).expect("as many");
        loop {
            let progress = live.advance(Duration::ZERO).expect("a step");
            let off = distance(live.display().pixels, &whole);
            assert!(off < 0.005, "{off} after {n_steps} steps");
            if progress.is_done {
                break;
            }
        }
    }
}

/// Another view and, before anything is known of it, a light that was off: its first pictures have hair, and the last one the
/// light on proxies, though the view goes on changing.
#[test]
fn lights_switched_on_while_the_view_turns_show_hair_and_proxies() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let mut description = Scene::read(&at).expect("a scene");
    description.proxies = vec![ProxySection::ellipsoid([0.0, 0.0, -2.0], [2.0, 1.0, 1.0])];
    let mut scene = PreparedScene::load(&description).expect("hair");
    let on: Vec<[f32; 3]> = scene.lights.iter().map(|light| light.rgb).collect();
    let mut off = on.clone();
    off[0] = [0.0; 3];
    scene.set_light_colors(&off).expect("as many");
    let cameras = [0.002, 0.004].map(|turn: f32| {
        let mut camera = scene.camera;
        camera.eye.x += turn * camera.eye.distance(camera.target);
        camera
    });
    let mut fresh = InteractiveRenderer::new(scene.clone());
    fresh.set_camera(cameras[1]);
    fresh.set_light_colors(&on).expect("as many");
    while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
    for n_steps in (1..40).step_by(3) {
        let mut live = InteractiveRenderer::new(scene.clone());
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        let light = |live: &InteractiveRenderer| {
            let pixels = live.display().pixels.iter();
            pixels.map(|pixel| u64::from(pixel[1])).sum::<u64>()
        };
        let before = light(&live);
        live.set_camera(cameras[0]);
        live.set_light_colors(&on).expect("as many");
        for _ in 0..n_steps {
            live.advance(Duration::ZERO).expect("a step");
            assert!(2 * light(&live) > before, "after {n_steps} steps");
        }
        live.set_camera(cameras[1]);
        loop {
            let progress = live.advance(Duration::ZERO).expect("a step");
            assert!(2 * light(&live) > before, "after {n_steps} steps");
            if progress.is_done {
                break;
            }
        }
        assert!(
            live.display().pixels == fresh.display().pixels,
            "after {n_steps} steps"
        );
    }
}

/// Of hair that is painted all but for one point, that point may be among those that a first picture shades, and no other
/// finds the rest of the light from proxies: the last picture is that of a fresh scene all the same.
#[test]
fn nearly_all_painted_hair_ends_with_all_light_of_proxies() {
    let scene = dense_hair_over_a_ground();
    let n_points = scene.strands.n_groom_points();
    let dyed = PaintedPoint {
        sigma_a: [0.1, 0.4, 0.9],
        weight: 1.0,
        ..PaintedPoint::NONE
    };
    let modes = scene.hair.modes().to_vec();
    let mut hair = *scene.hair.hair();
    hair.eta = 1.5;
    // One in three of neighbours is shaded first.
    for plain in n_points / 2..n_points / 2 + 6 {
        let mut paint = Paint::unpainted(n_points);
        paint.points.fill(dyed);
        paint.points[plain] = PaintedPoint::NONE;
        let mut live = InteractiveRenderer::new(scene.clone());
        live.set_paint(&paint, 0..n_points).expect("as many");
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        live.set_hair(&hair, &modes).expect("in range");
        while !live.advance(Duration::ZERO).expect("a step").is_done {}
        let mut fresh = InteractiveRenderer::new(scene.clone());
        fresh.set_hair(&hair, &modes).expect("in range");
        fresh.set_paint(&paint, 0..n_points).expect("as many");
        while !fresh.advance(Duration::ZERO).expect("a step").is_done {}
        assert!(live.display().pixels == fresh.display().pixels, "{plain}");
    }
}

/// A stroke right after a turn of the view waits until all points are lit, so that it shades those alone that it touches.
#[test]
fn strokes_after_a_turn_wait_for_all_points() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_dense_hair(folder.path(), key_and_sky());
    let scene = PreparedScene::load(&Scene::read(&at).expect("a scene")).expect("hair");
    let n_points = scene.strands.n_groom_points();
    let mut paint = Paint::unpainted(n_points);
    let dyed = PaintedPoint {
        sigma_a: [0.1, 0.4, 0.9],
        weight: 1.0,
        ..PaintedPoint::NONE
    };
    let mut live = InteractiveRenderer::new(scene.clone());
    paint.points[..10].fill(dyed);
    live.set_paint(&paint, 0..10).expect("as many");
    while !live.advance(Duration::ZERO).expect("a step").is_done {}
    let mut camera = scene.camera;
    camera.eye.x += 0.1 * camera.eye.distance(camera.target);
    live.set_camera(camera);
    while !live.advance(Duration::ZERO).expect("a step").is_shaded {}
    assert!(live.report().stage("through maps").is_none());
    paint.points[10..20].fill(dyed);
    live.set_paint(&paint, 10..20).expect("as many");
    while !live.advance(Duration::ZERO).expect("a step").is_shaded {}
    assert!(live.report().stage("through maps").is_some());
}
