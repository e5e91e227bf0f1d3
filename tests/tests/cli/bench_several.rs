//! `strandlight bench` of several scenes of which one fails, and of scenes at the ends of ranges.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use strandlight_tests::scenes::{curtain, key_and_sky, light, write_scene, write_small_scene};
use strandlight_tests::strandlight;

/// A folder with `a.toml`, and `dark.toml`, the same without light.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let groom = curtain(30, 5, 0.1, 0.0);
    let black = vec![light([0.0, 1.0, 0.0], 0.5, [0.0; 3])];
    let dark = write_small_scene(at, &groom, black, |_| ());
    let text = fs::read_to_string(&dark).expect("it was written");
    fs::rename(at.join("a.lights"), at.join("dark.lights")).expect("renamed");
    let text = text.replace("a.lights", "dark.lights");
    fs::write(at.join("dark.toml"), &text).expect("writable");
    let missing = text.replace("dark.lights", "missing.lights");
    fs::write(at.join("missing.toml"), missing).expect("writable");
    write_small_scene(at, &groom, key_and_sky(), |_| ());
    folder
}

fn bench(at: &Path, line: &str) -> Output {
    let mut command = strandlight();
    command.current_dir(at).arg("bench");
    let command = command.args(line.split_whitespace());
    command.output().expect("it runs")
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

#[test]
fn what_was_measured_before_a_failure_is_printed() {
    let folder = folder();
    let at = folder.path();
    let peers = "peers --size 16x16 --repetitions 1 --truth-samples 1024 --samples 1,4";
    let converge =
        "converge --size 16x16 --samples 2,4 --truth-samples 1024 --seeds 1 --svg converge.svg";
    for line in [peers, converge] {
        let both = bench(at, &format!("{line} a.toml dark.toml --json"));
        assert_eq!(both.status.code(), Some(2), "{both:?}");
        let stderr = String::from_utf8_lossy(&both.stderr);
        assert!(stderr.contains("dark.toml: "), "{stderr}");
        let document = json(&both);
        let scenes = document["scenes"].as_array().expect("scenes");
        assert_eq!(scenes.len(), 1, "{document}");
        assert_eq!(scenes[0]["scene"], "a.toml");
        // As tables they are printed one by one.
        let both = bench(at, &format!("{line} a.toml dark.toml"));
        assert_eq!(both.status.code(), Some(2), "{both:?}");
        assert!(String::from_utf8_lossy(&both.stdout).starts_with("a.toml: "));
        // Of none there is an error alone.
        let dark = bench(at, &format!("{line} dark.toml a.toml --json"));
        assert_eq!(dark.status.code(), Some(2), "{dark:?}");
        assert!(json(&dark)["error"].is_object(), "{dark:?}");
    }
    let svg = fs::read_to_string(at.join("converge.svg")).expect("the curves of the first");
    assert!(svg.contains("a.toml") && !svg.contains("dark.toml"));
}

#[test]
fn what_is_missing_is_told_before_anything_is_measured() {
    let folder = folder();
    let at = folder.path();
    for line in [
        "peers --truth-samples 65536 --size 720x480",
        "converge --truth-samples 1048576",
        "frames --repetitions 1000",
        "frames --repetitions 1000 --window",
    ] {
        let output = bench(at, &format!("{line} a.toml missing.toml --json"));
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let error = &json(&output)["error"]["message"];
        let message = error.as_str().expect("an error");
        assert!(message.contains("missing.lights"), "{line}: {message}");
    }
}

/// The edits of the hair that frames are measured after are of valid hair.
#[test]
fn hair_at_the_ends_of_its_ranges_is_edited() {
    let folder = folder();
    let at = folder.path();
    let text = fs::read_to_string(at.join("a.toml")).expect("it was written");
    let mut scene = strandlight_formats::Scene::from_toml(&text).expect("a scene");
    scene.hair.eta = 3.0;
    scene.hair.width_deg = scene.hair.width_deg.map(|_| 60.0);
    write_scene(at, "extreme.toml", &scene);
    let line = "frames extreme.toml --size 16x16 --repetitions 1 --json";
    for more in ["", " --window"] {
        let output = bench(at, &format!("{line}{more}"));
        assert!(output.status.success(), "{output:?}");
    }
}
