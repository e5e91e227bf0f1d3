//! `strandlight scenes` from the outside.

use std::fs;

use serde_json::Value;
use strandlight_tests::{assert_done, assert_refused, strandlight};

#[test]
fn slow_a_scene_is_written_and_renders() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let run = |out: &str| {
        let args = ["--only", "ponytail", "--scale", "0.01", "--json", "-o", out];
        let text = assert_done(strandlight().current_dir(at).arg("scenes").args(args));
        serde_json::from_str::<Value>(&text).expect("one document")
    };
    let document = run("new/folder_one");
    let scenes = document["scenes"].as_array().expect("a list");
    assert_eq!(scenes.len(), 1);
    assert_eq!(scenes[0]["name"], "ponytail");
    assert_eq!(scenes[0]["strands"], 60);
    assert_eq!(scenes[0]["points"], 60 * 17);
    assert_eq!(scenes[0]["lights"], 42);
    assert!(scenes[0]["fibre_error"].as_f64() < Some(0.01));
    // The same bytes in another folder; only what is asked for.
    run("two");
    let mut names = Vec::new();
    for entry in fs::read_dir(at.join("two")).expect("made") {
        let path = entry.expect("readable").path();
        let name = path.file_name().expect("a name").to_os_string();
        let other = at.join("new/folder_one").join(&name);
        assert_eq!(
            fs::read(&path).expect("read"),
            fs::read(other).expect("read")
        );
        names.push(name);
    }
    names.sort();
    let expected = [
        "ponytail.groom",
        "ponytail.lights",
        "ponytail.toml",
        "sun.exr",
    ];
    assert_eq!(names, expected);

    let args = ["two/ponytail.toml", "-o", "p.png", "--size", "48x32"];
    let more = ["--samples", "4", "--backend", "cpu"];
    assert_done(
        strandlight()
            .current_dir(at)
            .arg("render")
            .args(args)
            .args(more),
    );
    // With a map of one's own no other is written.
    let args = [
        "--only",
        "ponytail",
        "--scale",
        "0.001",
        "--map",
        "two/sun.exr",
        "-o",
        "three",
    ];
    assert_done(strandlight().current_dir(at).arg("scenes").args(args));
    assert!(!at.join("three/sun.exr").exists());
    assert_eq!(
        fs::read(at.join("three/ponytail.lights")).expect("written"),
        fs::read(at.join("two/ponytail.lights")).expect("written")
    );
}

#[test]
fn bad_usage_is_refused_with_nothing_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    fs::write(at.join("file"), "in the way").expect("written");
    fs::write(at.join("map.exr"), "no map").expect("written");
    let cases: [(&[&str], &[&str]); 5] = [
        (&["-o", "a", "--only", "beard"], &["beard", "bob-cut"]),
        (&["-o", "a", "--scale", "2"], &["2"]),
        (&["-o", "a", "--map", "map.exr"], &["map.exr"]),
        (&["-o", "a", "--map", "none.exr"], &["none.exr"]),
        (&["-o", "file"], &["file"]),
    ];
    for (args, needles) in cases {
        let mut command = strandlight();
        assert_refused(command.current_dir(at).arg("scenes").args(args), needles);
        assert!(!at.join("a").exists(), "{args:?}");
    }
}
