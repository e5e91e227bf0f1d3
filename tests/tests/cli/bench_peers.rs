//! `strandlight bench peers`: pictures beside brute force, and beside path tracing.

use serde_json::Value;
use strandlight_formats::{Scattering, SrbfLight};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// Brute force beside the picture of a scene: what was measured, and that the rest follows from it.
#[test]
fn pictures_are_compared_with_brute_force() {
    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(30, 5, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let bench = |extra: &[&str]| {
        let mut command = strandlight();
        command.args(["bench", "peers", "--size", "48x32", "--repetitions", "1"]);
        command
            .args(["--truth-samples", "256"])
            .args(extra)
            .arg(&scene);
        command
    };
    let samples = ["--samples", "1,16,64"];
    let document = |extra: &[&str]| -> Value {
        let text = assert_done(bench(extra).args(samples).arg("--json"));
        serde_json::from_str(&text).unwrap()
    };
    let found = document(&[]);
    let path = scene.display().to_string();
    assert_eq!(found["truth_samples"], 256);
    let found = &found["scenes"][0];
    assert_eq!(found["scene"], path);
    assert_eq!(found["size"], serde_json::json!([48, 32]));
    assert_eq!(
        (&found["strands"], &found["lights"]),
        (&30.into(), &2.into())
    );
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{found}"));

    let brute = &found["brute_force"];
    assert_eq!(brute["rays"], 24);
    let measured = brute["measured"].as_array().unwrap();
    let errors: Vec<f64> = measured
        .iter()
        .map(|p| number(&p["relative_rmse"]))
        .collect();
    let counts: Vec<&Value> = measured.iter().map(|point| &point["samples"]).collect();
    assert_eq!(counts, [1, 16, 64]);
    // Independent samples: a quarter of the error with 16 times as many, then half of it.
    let falls = |a: f64, b: f64, by: f64| (a / b / by - 1.0).abs() < 0.3;
    assert!(falls(errors[0], errors[1], 4.0), "{errors:?}");
    assert!(falls(errors[1], errors[2], 2.0), "{errors:?}");
    assert!((number(&brute["exponent"]) + 0.5).abs() < 0.08, "{brute}");
    let of_one = number(&brute["relative_rmse_of_one_sample"]);
    assert!((of_one / errors[0] - 1.0).abs() < 0.3, "{brute}");
    // The closed form is right to some percent in thin hair.
    let error = number(&found["ours"]["relative_rmse"]);
    assert!(error > 0.0 && error < 0.2, "{found}");
    let expected = (of_one / error).powi(2);
    assert!((number(&brute["samples"]) / expected - 1.0).abs() < 1e-9);
    let noise = number(&found["truth_noise"]);
    assert!(noise > 0.0 && noise < errors[1], "{found}");
    #[cfg(target_os = "linux")]
    for seconds in [
        &found["ours"]["core_seconds"],
        &found["ours"]["edit_core_seconds"],
        &brute["core_seconds"],
        &brute["edit_core_seconds"],
        &brute["hierarchy_core_seconds"],
    ] {
        assert!(number(seconds) >= 0.0, "{found}");
    }

    // The samples depend on the seed alone; the picture on nothing.
    let [again, other] = [document(&[]), document(&["--seed", "1"])];
    let [again, other] = [&again["scenes"][0], &other["scenes"][0]];
    let errors = |of: &Value| -> Vec<Value> {
        let measured = of["brute_force"]["measured"].as_array().unwrap().iter();
        measured
            .map(|point| point["relative_rmse"].clone())
            .collect()
    };
    assert_eq!(errors(again), errors(found));
    assert_ne!(errors(other), errors(found));
    // Of the same picture by another truth, as far as the noise of both lets tell.
    let other_error = number(&other["ours"]["relative_rmse"]);
    let apart = (other_error.powi(2) - error.powi(2)).abs();
    assert!(apart < 2.0 * noise.powi(2), "{error} {other_error} {noise}");

    let table = assert_done(&mut bench(&[]));
    for line in [
        "ours, edit of the hair, shadows kept",
        "brute force over ours",
    ] {
        assert!(table.contains(line), "{table}");
    }
    let black = vec![SrbfLight {
        direction: [0.0, 1.0, 0.0],
        lambda: 0.5,
        rgb: [0.0; 3],
    }];
    let dark = write_small_scene(folder.path(), &groom, black, |_| ());
    let mut command = strandlight();
    command.args(["bench", "peers", "--size", "8x8", "--truth-samples", "1"]);
    assert_refused(command.arg(&dark), &["a.toml"]);
}

/// The picture, `--converge` and plain paths: the errors fall, and the rest follows from what was measured.
#[test]
fn all_scattering_is_compared_with_path_tracing() {
    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(60, 8, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.05);
        // What is compared does not follow the scene.
        scene.render.scattering = Scattering::Single;
    });
    let bench = |extra: &[&str]| {
        let mut command = strandlight();
        command.args(["bench", "peers", "--scattering", "total", "--size", "48x32"]);
        command.args(["--repetitions", "1"]).args(extra).arg(&scene);
        command
    };
    let few = [
        "--samples",
        "32,2,8",
        "--truth-samples",
        "512",
        "--seeds",
        "4",
    ];
    let text = assert_done(bench(&few).arg("--json"));
    let document: Value = serde_json::from_str(&text).unwrap();
    for (key, value) in [
        ("truth_samples", 512),
        ("seeds", 4),
        ("repetitions", 1),
        ("seed", 0),
    ] {
        assert_eq!(document[key], value, "{document}");
    }
    let found = &document["scenes"][0];
    assert_eq!(found["scattering"], "total");
    assert!(found["map"].is_null(), "{found}");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{found}"));
    let list = |key: &str| -> Vec<Value> { found[key].as_array().unwrap().clone() };
    let errors = |key: &str| -> Vec<f64> {
        let points = list(key);
        let counts: Vec<&Value> = points.iter().map(|point| &point["samples"]).collect();
        assert_eq!(counts, [2, 8, 32], "{found}");
        points
            .iter()
            .map(|point| number(&point["relative_rmse"]))
            .collect()
    };
    // Half the error with four times the samples, or less: they are spread evenly over a pixel, which
    // strands as thick as these gain from.
    let paths = errors("path");
    for pair in paths.windows(2) {
        let by = pair[0] / pair[1];
        assert!(by > 1.4 && by < 4.0, "{paths:?}");
    }
    let exponent = (paths[0] / paths[2]).ln() / 16.0_f64.ln();
    let off = number(&found["exponent_of_path"]) + exponent;
    assert!(off.abs() < 1e-9, "{found}");
    let converged = errors("converge");
    for (converged, paths) in converged.iter().zip(&paths) {
        assert!(converged < paths, "{found}");
    }
    let ours = number(&found["ours"]["relative_rmse"]);
    assert!(ours < paths[0] && ours > converged[2], "{found}");
    #[cfg(target_os = "linux")]
    {
        let seconds = |key: &str| -> Vec<f64> {
            let points = list(key);
            points
                .iter()
                .map(|point| number(&point["core_seconds"]))
                .collect()
        };
        let before = number(&found["traced_core_seconds"]);
        let fast = number(&found["ours"]["core_seconds"]);
        assert!(seconds("path")[0] >= before, "{found}");
        assert!(seconds("converge")[0] >= before + fast, "{found}");
        assert!(seconds("path").is_sorted() && seconds("converge").is_sorted());
        for goal in list("goals").iter().chain([&found["to_ours"]]) {
            let error = number(&goal["relative_rmse"]);
            assert_eq!(goal["path_extrapolated"], paths[2] > error, "{goal}");
            // Null where samples took less than the clock can tell.
            let [of_paths, converged] =
                ["path", "converge"].map(|way| goal[format!("{way}_core_seconds")].as_f64());
            if let Some(of_paths) = of_paths {
                let expected = (paths[2] / error).powi(2) * (seconds("path")[2] - before) + before;
                assert!((of_paths / expected - 1.0).abs() < 1e-6, "{goal}");
            }
            let ratio = of_paths.zip(converged).map(|(paths, ours)| paths / ours);
            let found = goal["ratio"].as_f64();
            assert_eq!(found.is_some(), ratio.is_some(), "{goal}");
            if let Some((found, ratio)) = found.zip(ratio) {
                assert!((found / ratio - 1.0).abs() < 1e-6, "{goal}");
            }
        }
    }

    let quick = ["--samples", "2", "--truth-samples", "64", "--seeds", "1"];
    let table = assert_done(&mut bench(&quick));
    for words in [
        "total scattering",
        "paths, what they read included",
        "to 1 %: converged",
    ] {
        assert!(table.contains(words), "{table}");
    }
}

#[test]
fn options_of_the_other_scattering_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = write_small_scene(
        folder.path(),
        &curtain(6, 3, 0.1, 0.0),
        key_and_sky(),
        |_| (),
    );
    for (line, words) in [
        ("--seeds 2", ["--seeds", "--scattering total"]),
        ("--samples 4097", ["--samples 4097", "1..=4096"]),
        (
            "--scattering total --rays 4",
            ["--rays", "--scattering total"],
        ),
        (
            "--scattering total --samples 1,4",
            ["--samples 1", "2..=65536"],
        ),
        (
            "--scattering total --truth-samples 1",
            ["--truth-samples 1", "at least 2"],
        ),
        ("--scattering global", ["single", "total"]),
    ] {
        let mut command = strandlight();
        command.args(["bench", "peers"]).args(line.split(' '));
        assert_refused(command.arg(&scene), &words);
    }
}
