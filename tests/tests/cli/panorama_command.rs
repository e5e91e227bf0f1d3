//! `strandlight lights --panorama`, and pictures before the map that it writes.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{Background, BakedFile, Panorama, Scene, content_hash};
use strandlight_images::Map;
use strandlight_reference::compare::Layer;
use strandlight_tests::panoramas::striped;
use strandlight_tests::scenes::write_scene;
use strandlight_tests::{assert_done, assert_refused, project_root, strandlight};

use super::render_command::scene_in;

fn bake(folder: &Path, map: &Path, words: &[&str]) -> String {
    let mut command = strandlight();
    command.current_dir(folder).arg("lights").arg(map);
    command.args(["-o", "a.lights", "--count", "4", "--no-report"]);
    let output = command.args(words).output().expect("it runs");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn the_map_is_written_beside_its_lights() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let path = project_root().join("data/sample/studio.exr");
    let map = Map::read(&path).expect("the sample map");
    let said = bake(at, &path, &["--panorama", "sky.panorama"]);
    assert!(said.contains("wrote sky.panorama"), "{said}");
    let bytes = fs::read(at.join("sky.panorama")).expect("written");
    // No wider than the map.
    let whole = Panorama::from_bytes(&bytes).expect("a panorama");
    assert_eq!(whole.width() as usize, map.width());
    assert_eq!(whole.source.map_hash, map.source().hash);
    let largest = map.pixels().iter().flatten().copied().fold(0.0, f32::max);
    for (found, wanted) in whole.pixels().iter().zip(map.pixels()) {
        let most = wanted.iter().copied().fold(0.0, f32::max) / 512.0 + largest * 1e-9;
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() <= most, "{found} {wanted}");
        }
    }
    let narrow = ["--panorama", "b.panorama", "--panorama-width", "64"];
    bake(at, &path, &narrow);
    let small = Panorama::read(&at.join("b.panorama")).expect("a panorama");
    assert_eq!((small.width(), small.height()), (64, 32));
    let again = fs::read(at.join("b.panorama")).expect("written");
    bake(at, &path, &narrow);
    assert!(again == fs::read(at.join("b.panorama")).expect("written"));

    // It is a file like the others.
    let mut verify = strandlight();
    assert_done(verify.current_dir(at).args(["verify", "sky.panorama"]));
    let mut inspect = strandlight();
    inspect.current_dir(at);
    let output = inspect.args(["inspect", "b.panorama", "--json"]).output();
    let document: Value = serde_json::from_slice(&output.expect("it runs").stdout).expect("JSON");
    assert_eq!(document["kind"], "panorama");
    assert_eq!(document["size"], serde_json::json!([64, 32]));
    let mean = document["mean"][1].as_f64().expect("a number");
    let wanted = map.energy()[1] / (4.0 * std::f64::consts::PI);
    assert!((mean / wanted - 1.0).abs() < 2e-3, "{mean} {wanted}");
    let mut text = strandlight();
    let output = text
        .current_dir(at)
        .args(["inspect", "b.panorama"])
        .output();
    let text = String::from_utf8(output.expect("it runs").stdout).expect("UTF-8");
    assert!(
        text.contains("panorama 1.0") && text.contains("64 x 32 texels"),
        "{text}"
    );
}

#[test]
fn bad_panoramas_are_refused_before_the_work() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let map = project_root().join("data/sample/studio.exr");
    for (words, needles) in [
        (
            &["--panorama", "sky.exr"][..],
            &["sky.exr", ".panorama"][..],
        ),
        (&["--panorama", "none/sky.panorama"], &["none"]),
        (&["--panorama-width", "64"], &["--panorama"]),
        (
            &["--panorama", "a.panorama", "--panorama-width", "63"],
            &["63", "even"],
        ),
        (
            &["--panorama", "a.panorama", "--panorama-width", "8192"],
            &["8192", "4096"],
        ),
    ] {
        let mut command = strandlight();
        command.current_dir(at).arg("lights").arg(&map);
        assert_refused(command.args(["-o", "a.lights"]).args(words), needles);
    }
    let left: Vec<_> = fs::read_dir(at).expect("a folder").collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn pictures_and_their_layers_have_the_map_behind_the_hair() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    striped(64)
        .write(&at.join("sky.panorama"))
        .expect("written");
    let render = |out: &str, words: &[&str]| {
        let mut command = strandlight();
        command
            .current_dir(at)
            .args(["render", "a.toml", "-o", out]);
        command.args(["--size", "30x20", "--backend", "cpu"]);
        assert_done(command.args(words));
    };
    let set = |value: &'static str| ["--set", value];
    let [named, seen] = [
        set("lights.panorama=\"sky.panorama\""),
        set("render.background=\"panorama\""),
    ];
    let both = [&named[..], &seen].concat();
    render("map.exr", &[&both[..], &["--aov", "modes"]].concat());
    render("none.exr", &set("render.background=\"none\""));
    let layer =
        |name: &str, of: Option<&str>| Layer::read(&at.join(name), of).expect("a layer").rgb;
    let (whole, hair) = (layer("map.exr", None), layer("none.exr", None));
    let behind = layer("map.exr", Some("background"));
    let mut sum = 0.0;
    for ((whole, hair), behind) in whole.iter().zip(&hair).zip(&behind) {
        for c in 0..3 {
            let off = (whole[c] - hair[c] - behind[c]).abs();
            assert!(
                off < 1e-4 * (1.0 + whole[c]),
                "{whole:?} {hair:?} {behind:?}"
            );
            sum += behind[c];
        }
    }
    assert!(sum > 10.0, "{sum}");
    // The picture says what it was made from.
    let bytes = fs::read(at.join("map.exr")).expect("written");
    let hash = content_hash(&fs::read(at.join("sky.panorama")).expect("written"));
    let holds = |text: &str| {
        bytes
            .windows(text.len())
            .any(|part| part == text.as_bytes())
    };
    assert!(holds("strandlight/panorama") && holds(&hash));
    // So do traced ones, over the same map.
    let mut scene = Scene::read(at.join("a.toml")).expect("a scene");
    scene.lights.panorama = Some("sky.panorama".into());
    scene.render.background = Background::Panorama;
    write_scene(at, "b.toml", &scene);
    let mut traced = strandlight();
    traced
        .current_dir(at)
        .args(["reference", "b.toml", "-o", "traced.exr"]);
    assert_done(traced.args(["--method", "path", "--size", "30x20", "--spp", "1"]));
    let traced = layer("traced.exr", None);
    let mut n_empty = 0;
    for ((traced, whole), behind) in traced.iter().zip(&whole).zip(&behind) {
        // Pixels that show nothing else.
        if whole == behind {
            assert!((0..3).all(|c| (traced[c] - whole[c]).abs() < 1e-5 * (1.0 + whole[c])));
            n_empty += 1;
        }
    }
    assert!(n_empty > 50, "{n_empty}");
    let mut lone = strandlight();
    lone.current_dir(at)
        .args(["render", "a.toml", "-o", "x.png"])
        .args(seen);
    assert_refused(&mut lone, &["lights.panorama is absent", ".panorama"]);
}
