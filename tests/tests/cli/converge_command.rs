//! `strandlight render --converge` and `strandlight bench converge` from the outside.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use strandlight_formats::{AddedLight, Background, CameraSection, Scene};
use strandlight_reference::compare::{Layer, compare};
use strandlight_tests::panoramas::striped_map;
use strandlight_tests::scenes::{curtain, key_and_sky, write_scene, write_small_scene};
use strandlight_tests::{assert_done, strandlight};

/// A curtain of hair with something behind it.
fn scene_in(folder: &Path) {
    let groom = curtain(60, 8, 0.1, 0.0);
    write_small_scene(folder, &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.05);
        scene.render.size = [96, 64];
    });
}

fn output(folder: &Path, line: &str) -> Output {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split(' '));
    command.output().expect("runs")
}

fn json(folder: &Path, line: &str) -> Value {
    let output = output(folder, line);
    assert!(output.status.success(), "{line}: {output:?}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn refused(folder: &Path, line: &str, needle: &str) {
    let output = output(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {stderr}");
    assert!(stderr.contains(needle), "{line}: {stderr}");
}

const CONVERGE: &str = "render a.toml --converge --backend cpu --json --quiet -o";

#[test]
fn pictures_without_a_background_can_be_divided_by_alpha() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let line = format!("{CONVERGE} a.exr --until 3 --size 48x32 --set render.background=none");
    json(folder.path(), &line);
    let picture = Layer::read(&folder.path().join("a.exr"), None).expect("written");
    let (mut n_hair, mut n_empty) = (0, 0);
    for (rgb, &alpha) in picture.rgb.iter().zip(&picture.alpha) {
        assert!((0.0..=1.0).contains(&alpha), "{alpha}");
        assert!(rgb.iter().all(|&value| value >= 0.0), "{rgb:?}");
        assert!(alpha > 0.0 || *rgb == [0.0; 3], "{rgb:?}");
        n_hair += u32::from(alpha > 0.0);
        n_empty += u32::from(alpha == 0.0);
    }
    assert!(n_hair > 100 && n_empty > 100, "{n_hair} {n_empty}");
}

#[test]
fn slow_pictures_go_to_the_truth_and_say_how_far_they_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let layer = |name: &str, layer: Option<&str>| {
        Layer::read(&at.join(name), layer).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let off = |a: &Layer, b: &Layer| {
        let [a, b] = [a, b].map(|layer| layer.clone().boxed(4));
        compare(&a, &b).expect("comparable").hair.relative_rmse
    };
    let truth = "reference a.toml --method path --samples 1000 --seed 5 --quiet -o truth.exr";
    assert!(output(at, truth).status.success());
    assert!(
        output(at, "render a.toml --backend cpu --quiet -o fast.exr")
            .status
            .success()
    );
    let truth = layer("truth.exr", None);
    let fast = off(&layer("fast.exr", None), &truth);
    let mut errors = Vec::new();
    for samples in [8, 200] {
        let line = format!("{CONVERGE} c.exr --until {samples}");
        let report = json(at, &line);
        let converge = &report["converge"];
        assert_eq!(converge["samples"], samples);
        let expected = converge["relative_error"].as_f64().expect("a number");
        let found = off(&layer("c.exr", None), &truth);
        println!("{samples}: fast {fast:.4}, found {found:.4}, expected {expected:.4}");
        assert!(
            (0.4..2.5).contains(&(found / expected)),
            "{found} {expected}"
        );
        errors.push(found);
    }
    assert!(
        errors[0] < fast && errors[1] < 0.5 * errors[0],
        "{fast} {errors:?}"
    );
    // What is behind the hair is there, and errors where the hair is.
    let picture = layer("c.exr", None);
    assert!(picture.alpha.iter().all(|alpha| *alpha == 1.0));
    for name in ["error", "tile_error"] {
        let error = layer("c.exr", Some(name));
        let all = error.rgb.iter().flatten();
        assert!(all.clone().all(|x| x.is_finite() && *x >= 0.0), "{name}");
        assert!(all.clone().any(|x| *x > 0.0), "{name}");
    }
}

#[test]
fn slow_parts_of_the_light_go_to_their_truth() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let read = |name: &str, layer: Option<&str>| {
        let layer = Layer::read(&at.join(name), layer);
        layer
            .unwrap_or_else(|error| panic!("{name}: {error}"))
            .boxed(4)
    };
    let truth = "reference a.toml --method path --samples 1000 --seed 5 --quiet -o truth.exr";
    assert!(output(at, truth).status.success());
    for part in ["single", "global", "local"] {
        let more = format!("--scattering {part} --set render.background=none");
        json(at, &format!("{CONVERGE} c.exr --until 200 {more}"));
        let fast = format!("render a.toml --backend cpu --quiet -o fast.exr {more}");
        assert!(output(at, &fast).status.success());
        let truth = read("truth.exr", Some(part));
        let off = |name: &str| {
            let compared = compare(&read(name, None), &truth).expect("comparable");
            compared.hair.relative_rmse
        };
        let [fast, converged] = ["fast.exr", "c.exr"].map(off);
        println!("{part}: fast {fast:.4}, converged {converged:.4}");
        assert!(converged < 0.5 * fast, "{part}: {fast} {converged}");
    }
}

#[test]
fn slow_same_samples_give_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for (out, more) in [
        ("a.exr", "--threads 1"),
        ("b.exr", "--threads 3"),
        ("c.exr", "--seed 1"),
        ("d.png", "--threads 2"),
        ("e.exr", "--until 6,90% --set render.background=none"),
    ] {
        let until = if more.contains("--until") {
            ""
        } else {
            " --until 6"
        };
        json(at, &format!("{CONVERGE} {out}{until} {more}"));
    }
    let bytes = |name: &str| fs::read(at.join(name)).expect("written");
    assert!(bytes("a.exr") == bytes("b.exr"));
    assert!(bytes("a.exr") != bytes("c.exr"));
    assert!(bytes("d.png").starts_with(b"\x89PNG"));
    let open = Layer::read(&at.join("e.exr"), None).expect("read");
    assert!(open.alpha.contains(&0.0), "nothing is behind the hair");
}

#[test]
fn slow_goals_end_it_and_what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let report = json(at, &format!("{CONVERGE} a.exr --until 20%"));
    let error = report["converge"]["relative_error"].as_f64();
    assert!(error.is_some_and(|error| error <= 0.2), "{error:?}");
    // The time ends it, which is up before a step that would take longer: the error is far from there.
    let report = json(at, &format!("{CONVERGE} a.exr --until 0.0001%,1s"));
    let error = report["converge"]["relative_error"].as_f64();
    assert!(error.is_some_and(|error| error > 1e-3), "{error:?}");
    assert!(report["converge"]["seconds"].as_f64().is_some());
    for (more, needle) in [
        ("--until 0%", "an error like 1%"),
        ("--until 1", "an error like 1%"),
        ("--aov lights", "cannot be used with"),
        ("--turntable 4", "cannot be used with"),
        ("--map no.exr", "no.exr"),
        ("--size 8000x4000", "at most 16777216 pixels"),
    ] {
        refused(at, &format!("{CONVERGE} a.exr {more}"), needle);
    }
    refused(at, "render a.toml -o a.png --until 1%", "--converge");
    // Elliptic hair is traced as any other.
    let line = format!("{CONVERGE} a.exr --until 2 --set hair.eccentricity=0.9");
    assert_eq!(json(at, &line)["converge"]["samples"], 2);
}

#[test]
fn slow_errors_are_measured_by_seeds() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let line = "bench converge a.toml --samples 8,2 --truth-samples 200 --seeds 2 --json --quiet --svg c.svg";
    let report = json(at, line);
    let scene = &report["scenes"][0];
    let measured = scene["measured"].as_array().expect("a list");
    let samples: Vec<u64> = measured
        .iter()
        .filter_map(|m| m["samples"].as_u64())
        .collect();
    assert_eq!(samples, [2, 8]);
    for point in measured {
        for key in ["plain", "converged", "expected", "inside", "mean_ratio"] {
            let value = point[key].as_f64();
            assert!(value.is_some_and(|x| x > 0.0 && x < 2.0), "{key}: {point}");
        }
        for key in ["mean_plain", "mean_converged"] {
            let number = |name: &str| point[key][name].as_f64().expect(name);
            let off = (number("ratio") - 1.0).abs();
            // Of two seeds, which say little of their own noise.
            assert!(off < 0.3 && number("standard_error") > 0.0, "{point}");
            assert!((0.0..=1.0).contains(&number("tiles_beyond")), "{point}");
        }
        // Null where noise hides them.
        for key in ["bias_plain", "bias_converged"] {
            let value = point.get(key).expect(key);
            assert!(value.as_f64().is_none_or(|x| x > 0.0 && x < 1.0), "{point}");
        }
    }
    let goals = scene["goals"].as_array().expect("a list");
    let errors = goals
        .iter()
        .filter_map(|goal| goal["relative_rmse"].as_f64());
    assert_eq!(errors.collect::<Vec<f64>>(), [0.05, 0.03, 0.01]);
    assert!(goals[0]["plain_core_seconds"].as_f64() > Some(0.0));
    let svg = fs::read_to_string(at.join("c.svg")).expect("written");
    assert!(svg.contains("core-seconds"));
    let mut text = strandlight();
    text.current_dir(at)
        .args("bench converge a.toml --samples 2 --truth-samples 20 --seeds 1".split(' '));
    assert_done(&mut text);
}

/// Samples of a strand far thinner than a pixel all miss it at first: that says nothing.
#[test]
fn a_lone_strand_stays_until_samples_have_met_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write_small_scene(at, &curtain(1, 8, 0.1, 4.0), key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.01);
        scene.render.size = [72, 48];
        scene.render.background = Background::None;
        scene.camera = Some(CameraSection::new([0.0, 0.0, 60.0], [0.0; 3]));
    });
    assert!(
        output(at, "render a.toml --backend cpu --quiet -o fast.exr")
            .status
            .success()
    );
    let sum = |name: &str| -> f64 {
        let layer = Layer::read(&at.join(name), None).expect("a picture");
        layer.rgb.iter().flatten().map(|x| f64::from(*x)).sum()
    };
    for seed in 0..3 {
        let report = json(at, &format!("{CONVERGE} c.exr --until 2 --seed {seed}"));
        let error = report["converge"]["relative_error"]
            .as_f64()
            .expect("a number");
        assert!(error > 0.3, "{seed}: {error}");
        let left = sum("c.exr") / sum("fast.exr");
        assert!((0.6..1.6).contains(&left), "{seed}: {left}");
    }
}

#[test]
fn a_scene_converges_to_the_map_that_it_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let below = at.join("maps");
    fs::create_dir(&below).expect("made");
    for (name, width) in [("wide.hdr", 64), ("small.hdr", 16)] {
        fs::write(below.join(name), striped_map(width)).expect("written");
    }
    let plain = Scene::read(at.join("a.toml")).expect("a scene");
    let with_map = |name: &str, map: Option<&str>| {
        let mut scene = plain.clone();
        let lights = &mut scene.lights;
        lights.map = map.map(Into::into);
        (lights.rotate_deg, lights.intensity, lights.tint) = (40.0, 2.0, [1.0, 0.5, 0.8]);
        lights.muted = vec![0];
        lights.added = vec![AddedLight::default()];
        write_scene(at, name, &scene);
    };
    with_map("a.toml", Some("maps/wide.hdr"));
    with_map("plain.toml", None);
    let common = "--converge --backend cpu --json --quiet --until 3 --size 30x20 -o";
    let converged = |scene: &str, out: &str, more: &str| {
        let report = json(at, &format!("render {scene} {common} {out}{more}"));
        (fs::read(at.join(out)).expect("written"), report)
    };
    let (by_key, report) = converged("a.toml", "key.exr", "");
    let (by_flag, of_flag) = converged("plain.toml", "flag.exr", " --map maps/wide.hdr");
    assert!(by_key == by_flag, "the key is the flag");
    assert_eq!(report["inputs"], of_flag["inputs"]);
    assert!(report["inputs"]["strandlight/map"].is_string(), "{report}");
    // The flag takes precedence, and both can be left out.
    let (other, _) = converged("plain.toml", "other.exr", " --map maps/small.hdr");
    assert!(other != by_flag);
    let (over, _) = converged("a.toml", "over.exr", " --map maps/small.hdr");
    assert!(over == other, "the flag comes first");
    let (set, _) = converged("a.toml", "set.exr", " --set lights.map=\"maps/small.hdr\"");
    assert!(set == other);
    let (of_lights, report) = converged("a.toml", "lights.exr", " --set lights.map=null");
    assert!(of_lights == converged("plain.toml", "plain.exr", "").0);
    assert!(of_lights != by_key && report["inputs"]["strandlight/map"].is_null());

    // Ground truth is lit likewise, and so is what `bench` measures.
    let common = "--method path --json --quiet --samples 2 --size 30x20 -o";
    let traced = |scene: &str, more: &str| {
        let report = json(at, &format!("reference {scene} {common} t.exr{more}"));
        (fs::read(at.join("t.exr")).expect("written"), report)
    };
    let (by_key, report) = traced("a.toml", "");
    let (by_flag, of_flag) = traced("plain.toml", " --map maps/wide.hdr");
    assert!(by_key == by_flag, "the key is the flag");
    assert_eq!(report["inputs"], of_flag["inputs"]);
    assert!(traced("a.toml", " --map maps/small.hdr").0 != by_key);
    let of_lights = traced("a.toml", " --set lights.map=null").0;
    assert!(of_lights != by_key && of_lights == traced("plain.toml", "").0);
    let options = "--size 30x20 --samples 2 --truth-samples 4 --seeds 1 --json --quiet";
    let measured = json(at, &format!("bench converge a.toml plain.toml {options}"));
    let [of_map, of_lights] = [0, 1].map(|ix: usize| &measured["scenes"][ix]);
    assert!(of_map["map"].is_string() && of_lights["map"].is_null());
    assert_ne!(of_map["truth_noise"], of_lights["truth_noise"]);

    // Nothing else reads it, and what it is made from is what it was.
    with_map("gone.toml", Some("maps/gone.hdr"));
    let fast = "--backend cpu --quiet --size 30x20 -o";
    for (scene, out) in [("gone.toml", "a.exr"), ("plain.toml", "b.exr")] {
        let output = output(at, &format!("render {scene} {fast} {out}"));
        assert!(output.status.success(), "{output:?}");
    }
    let bytes = |name: &str| fs::read(at.join(name)).expect("written");
    assert!(bytes("a.exr") == bytes("b.exr"));
    for (name, needle) in [
        ("gone.hdr", "gone.hdr: "),
        ("../a.lights", "a.lights: neither OpenEXR"),
    ] {
        with_map("gone.toml", Some(&format!("maps/{name}")));
        let lines = [
            format!("render gone.toml --converge {fast} x.exr"),
            format!("reference gone.toml {common} x.exr"),
            "bench converge plain.toml gone.toml --quiet".to_owned(),
        ];
        for line in lines {
            refused(at, &line, "gone.toml: lights.map: ");
            refused(at, &line, needle);
        }
        assert!(!at.join("x.exr").exists());
    }
    // A file of the scene is not written over.
    fs::write(at.join("a.exr"), "a map").expect("written");
    with_map("gone.toml", Some("a.exr"));
    refused(
        at,
        &format!("render gone.toml {fast} a.exr"),
        "a file of the scene",
    );
}
