//! Hair whose strands vary: GPU against CPU, and edits against fresh scenes.

use std::path::Path;

use serde_json::{Value, json};
use strandlight_cpu as cpu;
use strandlight_formats::{BakedFile, Groom, LightSet, Scene};
use strandlight_render::ProgressiveRenderer;
use strandlight_runtime::{Session, Viewer};
use strandlight_scene::files::Files;
use strandlight_scene::proxy::Proxy;
use strandlight_tests::render_common::{context, keep, lights, picture_rmse, wig};

const SIZE: [u32; 2] = [120, 90];

/// A wig of 300 strands in memory, under the lights of the tests.
fn session(variation: &Value) -> Session {
    let (points, strand_offsets) = wig(300, 24);
    let groom = Groom {
        points,
        strand_offsets,
        ..Groom::default()
    };
    let lights = LightSet {
        lights: lights(),
        ..LightSet::default()
    };
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.hair.diameter_cm = Some(0.06);
    scene.render.shadow_maps = 8;
    scene.variation = serde_json::from_value(variation.clone()).expect("valid");
    let files = Files::in_memory([
        (
            "a.toml",
            scene.to_toml_string().expect("valid").into_bytes(),
        ),
        ("a.groom", groom.to_bytes().expect("valid")),
        ("a.lights", lights.to_bytes().expect("valid")),
    ]);
    Session::open_in(Path::new("a.toml"), files).expect("a scene")
}

#[test]
fn backends_agree() {
    let context = context();
    let plain = session(&json!({})).prepared().expect("a scene");
    let [bare, _] = both(&context, &plain);
    for variation in [
        json!({"melanin_strand": 0.4, "melanin_lock": 0.3, "redness_strand": 0.6, "grey": 0.2}),
        json!({"roughness_strand": 0.4, "melanin_lock": 0.4, "clump": 0.6, "frizz": 0.5}),
    ] {
        let scene = session(&variation).prepared().expect("a scene");
        let [gpu, cpu] = both(&context, &scene);
        let has_shape = variation.get("clump").is_some();
        keep(&format!("varied-{has_shape}-gpu"), &gpu);
        keep(&format!("varied-{has_shape}-cpu"), &cpu);
        let error = picture_rmse(&gpu, &cpu);
        let other = picture_rmse(&gpu, &bare);
        println!(
            "{variation}: {:.4} %, of other hair {other:.3}",
            100.0 * error
        );
        assert!(
            error < 0.003 && other > 0.05,
            "{variation}: {error} {other}"
        );
    }
}

/// What the hair passes on to a proxy is that of its fibre, whether strands vary or not.
#[test]
fn strands_that_hardly_vary_light_a_proxy_as_those_that_do_not() {
    let context = context();
    let drawn = |variation: Value, albedo: [f32; 3]| {
        let mut scene = session(&variation).prepared().expect("a scene");
        scene.proxies = vec![Proxy::Ellipsoid {
            centre: scene.strands.centre,
            radii: 0.6 * scene.strands.radius * glam::Vec3::ONE,
            turn: glam::Quat::IDENTITY,
            albedo,
        }];
        both(&context, &scene)
    };
    let grey = [0.8; 3];
    let [plain, on_cpu] = drawn(json!({}), grey);
    let [varied, varied_on_cpu] = drawn(json!({"melanin_strand": 0.001}), grey);
    let [black, _] = drawn(json!({}), [0.0; 3]);
    let error = picture_rmse(&varied, &plain);
    let [before, after] =
        [(&plain, &on_cpu), (&varied, &varied_on_cpu)].map(|(a, b)| picture_rmse(a, b));
    let other = picture_rmse(&black, &plain);
    println!("{error} {before} {after}, without light from it {other}");
    assert!(error < 0.003 && after < 0.003 && other > 0.05);
}

fn both(
    context: &strandlight_render::gpu::Context,
    scene: &strandlight_scene::PreparedScene,
) -> [strandlight_scene::Picture; 2] {
    let mut renderer = ProgressiveRenderer::new(context, scene.clone()).expect("a renderer");
    let (gpu, _) = renderer
        .render_to_image(&scene.camera, SIZE, 8)
        .expect("a picture");
    let (cpu, _) = cpu::render(scene, &scene.camera, SIZE, 8).expect("a picture");
    [gpu, cpu]
}

#[test]
fn edits_end_as_fresh_scenes() {
    let context = context();
    let mut viewer = Viewer::new(&context, session(&json!({}))).expect("shown");
    let (mut before, _) = viewer.frame(SIZE, 4).expect("a picture");
    for (key, value) in [
        ("variation.melanin_strand", json!(0.4)),
        ("hair.sigma_a", json!([0.2, 0.4, 0.9])),
        ("variation.grey", json!(0.3)),
        ("variation.roughness_lock", json!(0.4)),
        ("variation.frizz", json!(0.5)),
        ("variation.roughness_lock", json!(0)),
        ("variation", Value::Null),
    ] {
        let values = [(key.to_owned(), value.clone())].into_iter().collect();
        viewer.set(&values).expect(key);
        let (found, _) = viewer.frame(SIZE, 4).expect("a picture");
        let mut fresh = Viewer::new(&context, viewer.session().clone()).expect("shown");
        let (expected, _) = fresh.frame(SIZE, 4).expect("a picture");
        assert!(found == expected, "{key} = {value}");
        assert!(found != before, "{key} = {value} changes nothing");
        before = found;
    }
    assert!(viewer.prepared().paint().is_none());
}
