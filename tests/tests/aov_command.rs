//! `strandlight render --aov`: layers that add up to the picture.

use std::path::Path;

use strandlight_bake::compare::Layer;
use strandlight_formats::{Background, Mode, Scene};
use strandlight_tests::scenes::{curtain, light, write_scene, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// A small scene on disk, with a light that is muted and one of hardly any power.
fn scene_in(folder: &Path) {
    let mut groom = curtain(80, 5, 0.05, 2.0);
    for (ix, point) in groom.points.iter_mut().enumerate() {
        point[2] += 0.05 * (ix / 5 % 7) as f32;
    }
    let lights = vec![
        light([-0.6, 0.0, 0.8], 0.2, [20.0, 8.0, 2.0]),
        light([0.6, 0.0, 0.8], 0.5, [1.0, 2.0, 4.0]),
        light([0.0, 1.0, 0.0], 1.2, [0.3, 0.4, 0.5]),
        light([0.0, 0.0, -1.0], 0.3, [9.0, 9.0, 9.0]),
        light([0.0, -1.0, 0.0], 0.3, [0.002, 0.002, 0.002]),
    ];
    write_small_scene(folder, &groom, lights, |scene| {
        scene.hair.diameter_cm = Some(0.06);
        scene.hair.sigma_a = [0.05, 0.1, 0.2];
        scene.lights.muted = vec![3];
        scene.render.size = [40, 30];
        scene.render.samples = 16;
        scene.render.shadow_maps = 8;
        scene.render.background = Background::Lights;
    });
}

fn layer(path: &Path, name: Option<&str>) -> Vec<[f32; 3]> {
    match Layer::read(path, name) {
        Ok(layer) => layer.rgb,
        Err(error) => panic!("{name:?}: {error}"),
    }
}

fn sum(layers: &[Vec<[f32; 3]>]) -> Vec<[f32; 3]> {
    let n_pixels = layers[0].len();
    let pixel = |ix: usize| [0, 1, 2].map(|c| layers.iter().map(|layer| layer[ix][c]).sum());
    (0..n_pixels).map(pixel).collect()
}

/// Root of the mean squared difference over the root mean square of `b`.
fn relative(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let square = |x: f32| f64::from(x) * f64::from(x);
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let difference: f64 = pairs.map(|(a, b)| square(a - b)).sum();
    let norm: f64 = b.iter().flatten().map(|&b| square(b)).sum();
    assert!(norm > 0.0, "nothing to compare with");
    (difference / norm).sqrt()
}

#[test]
fn layers_add_up_to_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for backend in ["gpu", "cpu"] {
        let file = format!("{backend}.exr");
        let plain = format!("{backend}-plain.exr");
        let render = |args: &[&str]| {
            let mut command = strandlight();
            command
                .current_dir(at)
                .args(["render", "a.toml", "--backend", backend]);
            assert_done(command.args(args))
        };
        let said = render(&["-o", &file, "--aov", "terms,modes,lights"]);
        assert!(said.contains("15 layers"), "{said}");
        render(&["-o", &plain]);
        let read = |name: &str| layer(&at.join(&file), Some(name));
        let beauty = layer(&at.join(&file), None);
        let total = read("total");
        let check = |what: &str, layers: &[&str], whole: &[[f32; 3]]| {
            let layers: Vec<_> = layers.iter().map(|name| read(name)).collect();
            let error = relative(&sum(&layers), whole);
            println!("{backend}: {what}: {error:.1e}");
            assert!(error < 1e-3, "{backend}: {what}: {error}");
        };
        check("background", &["total", "background"], &beauty);
        check("terms", &["single", "global", "local"], &total);
        check(
            "modes of single",
            &["single.R", "single.TT", "single.TRT"],
            &read("single"),
        );
        check(
            "modes of global",
            &["global.R", "global.TT", "global.TRT"],
            &read("global"),
        );
        check(
            "lights",
            &["light.000", "light.001", "light.002", "light.004"],
            &total,
        );
        assert!(
            Layer::read(&at.join(&file), Some("light.003")).is_err(),
            "muted"
        );
        // The picture is the one without layers.
        let alone = layer(&at.join(&plain), None);
        let error = relative(&beauty, &alone);
        println!("{backend}: with and without layers: {error:.1e}");
        assert!(error < 1e-3, "{error}");
        // Every layer has something of its own.
        let modes = [read("single.R"), read("single.TT"), read("single.TRT")];
        for (ix, mode) in modes.iter().enumerate() {
            assert!(relative(mode, &modes[(ix + 1) % 3]) > 0.1);
        }
    }
}

#[test]
fn groups_of_lights_and_fewer_modes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let mut scene = Scene::read(&at.join("a.toml")).expect("valid");
    scene.hair.modes = vec![Mode::R, Mode::Trt];
    scene.render.background = Background::None;
    scene.render.scattering = strandlight_formats::Scattering::Single;
    write_scene(at, "b.toml", &scene);
    let args = [
        "render",
        "b.toml",
        "-o",
        "b.exr",
        "--backend",
        "cpu",
        "--json",
    ];
    let said = assert_done(strandlight().current_dir(at).args(args).args([
        "--aov",
        "modes,lights",
        "--light-group",
        "warm=0,3",
    ]));
    let report: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    let expected = [
        "total",
        "single.R",
        "single.TRT",
        "light.warm",
        "light.rest",
    ];
    assert_eq!(report["layers"], serde_json::json!(expected));
    let read = |name: &str| layer(&at.join("b.exr"), Some(name));
    let total = read("total");
    assert!(relative(&sum(&[read("light.warm"), read("light.rest")]), &total) < 1e-3);
    assert!(relative(&sum(&[read("single.R"), read("single.TRT")]), &total) < 1e-3);
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for (args, needles) in [
        (
            &["-o", "a.png", "--aov", "terms"][..],
            &["a.png", ".exr"][..],
        ),
        (&["-o", "a.exr", "--aov", "colours"], &["colours"]),
        (&["-o", "a.exr", "--light-group", "a=0"], &["--aov"]),
        (
            &["-o", "a.exr", "--aov", "lights", "--light-group", "a=9"],
            &["group a", "light 9"],
        ),
        (
            &[
                "-o",
                "a.exr",
                "--aov",
                "lights",
                "--light-group",
                "a=0",
                "--light-group",
                "b=0",
            ],
            &["group b", "light 0", "two groups"],
        ),
        (
            &["-o", "a.exr", "--aov", "lights", "--light-group", "rest=0"],
            &["rest"],
        ),
        (
            &[
                "-o",
                "a.exr",
                "--aov",
                "terms,modes,lights",
                "--size",
                "8192x1024",
            ],
            &["layers", "bytes", "--size"],
        ),
    ] {
        let mut command = strandlight();
        assert_refused(
            command
                .current_dir(at)
                .args(["render", "a.toml", "--backend", "cpu"])
                .args(args),
            needles,
        );
        assert!(!at.join("a.exr").exists());
    }
}
