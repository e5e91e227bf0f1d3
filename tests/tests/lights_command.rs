//! `strandlight lights`: what it writes, what it says, and that it always says the same.

use std::fs;

use strandlight_bake::lights::{Map, evaluate};
use strandlight_formats::LightSet;
use strandlight_tests::{project_root, sample_data, strandlight};

#[test]
fn writes_lights_report_and_preview() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = project_root().join("data/sample/studio.exr");
    let run = |out: &str, extra: &[&str]| {
        let output = strandlight()
            .current_dir(folder.path())
            .args(["lights".as_ref(), map.as_os_str()])
            .args(["-o", out, "--count", "12"])
            .args(extra)
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let said = run("a.lights", &["--report", "r.json", "--preview", "p.png"]);
    assert!(said.lines().last().is_some_and(|line| {
        line.contains("a.lights") && line.contains("format 1.0") && line.contains("12 lights")
    }));
    let json = run("b.lights", &["--json"]);

    let read = |name: &str| fs::read(folder.path().join(name)).expect("it was written");
    assert_eq!(read("a.lights"), read("b.lights"), "same input, same bytes");
    assert!(read("p.png").starts_with(b"\x89PNG"));
    let set = LightSet::from_bytes(&read("a.lights")).expect("a readable light set");
    assert_eq!(set.lights.len(), 12);

    let printed: serde_json::Value = serde_json::from_str(&json).expect("one JSON document");
    let written: serde_json::Value =
        serde_json::from_slice(&read("r.json")).expect("a JSON report");
    let fitted = Map::read(&map).expect("the sample map");
    let again = evaluate(&set, &fitted);
    for report in [&printed, &written] {
        assert_eq!(report["count"], 12);
        assert!(report["seconds"].is_number());
        assert_eq!(report["rel_l2"], again.rel_l2);
        assert_eq!(report["irradiance_error"], again.irradiance_error);
        assert_eq!(report["fibre_error"], again.fibre_error);
        for c in 0..3 {
            let ratio = report["energy_ratio"][c].as_f64().expect("a number");
            assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
        }
    }
    assert_eq!(set.info.report, Some(again));
}

#[test]
fn bad_maps_are_refused() {
    for (name, needle) in [
        (
            "env/bad/comp_invalid_unknown.exr",
            "comp_invalid_unknown.exr",
        ),
        (
            "env/bad/comp_short_decode_piz.exr",
            "comp_short_decode_piz.exr",
        ),
    ] {
        let Some(path) = sample_data(name) else {
            continue;
        };
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = strandlight();
        command
            .current_dir(folder.path())
            .args(["lights".as_ref(), path.as_os_str()])
            .args(["-o", "out.lights"]);
        strandlight_tests::assert_refused(&mut command, &[needle]);
        assert!(!folder.path().join("out.lights").exists());
    }
}
