//! The bundled tables, and the commands that bake tables and verify files.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::{Value, json};
use strandlight_bake::tables::{REPORT_WIDTHS, bake_tables, same_figures};
use strandlight_formats::{BakedFile, FitReport, Groom, LightSet, TableFile};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::progress::Progress;
use strandlight_tests::{project_root, strandlight};

fn verify(path: &Path) -> (Output, serde_json::Value) {
    let output = strandlight()
        .arg("verify")
        .arg(path)
        .arg("--json")
        .output()
        .expect("strandlight runs");
    let document = serde_json::from_slice(&output.stdout).expect("one JSON document");
    (output, document)
}

/// Another system's libm may round a last bit of f64 the other way, and so one of f32 here and
/// there, also in the largest error between; all else is equal.
#[test]
fn bundled_tables_are_what_the_baker_makes() {
    let path = project_root().join("data/default.tables");
    let mut bundled = TableFile::read(&path).expect("data/default.tables is part of the project");
    let mut baked = bake_tables(Fresnel::Dielectric, &Progress::silent());
    assert_eq!(bundled.tables.len(), baked.tables.len());
    for (old, new) in bundled.tables.iter_mut().zip(&mut baked.tables) {
        // A search may stop a little elsewhere where the last bit differs.
        let fitted = new.name.starts_with("lobes_");
        let (was, is) = (old.max_interpolation_error, new.max_interpolation_error);
        assert!(is > 0.0 && is < 0.05, "{}: {is}", new.name);
        let tolerance = if fitted { 2e-2 * is } else { 1e-6 };
        assert!((was - is).abs() <= tolerance, "{}: {was} {is}", new.name);
        old.max_interpolation_error = is;
        let (old, new) = (std::mem::take(&mut old.data), std::mem::take(&mut new.data));
        assert_eq!(old.len(), new.len());
        let tolerance = if fitted { 1e-3 } else { f32::EPSILON };
        for (ix, (old, new)) in old.iter().zip(&new).enumerate() {
            assert!(
                (old - new).abs() <= tolerance * if fitted { 1.0 } else { new.abs() },
                "data/default.tables is out of date at value {ix}, {old} for {new}: \
                 strandlight tables -o data/default.tables"
            );
        }
    }
    // What is measured on fitted lobes is printed to a hundredth of a per cent, and may differ by
    // two of these.
    let mut n_figures = 0;
    assert_eq!(bundled.info.parameters.len(), baked.info.parameters.len());
    for (old, new) in bundled.info.parameters.iter().zip(&baked.info.parameters) {
        assert_eq!(old.0, new.0);
        assert!(same_figures(&old.1, &new.1, 0.0201), "{old:?} {new:?}");
        n_figures += usize::from(new.1.contains('%'));
    }
    assert_eq!(n_figures, 2 * REPORT_WIDTHS.len());
    bundled.info.parameters.clone_from(&baked.info.parameters);
    assert_eq!(bundled, baked);
}

/// Figures that a file records of its own errors, edited in a file that is whole otherwise.
#[test]
fn slow_edited_figures_of_tables_are_noticed() {
    let path = project_root().join("data/default.tables");
    let bundled = TableFile::read(&path).expect("part of the project");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("edited.tables");
    let judge = |file: &TableFile| {
        file.write(&path).expect("it can be written");
        let (output, report) = verify(&path);
        let failed: Vec<String> = report["files"][0]["checks"]
            .as_array()
            .expect("checks")
            .iter()
            .filter(|check| check["passed"] != true)
            .map(|check| format!("{} {}", check["table"], check["check"]))
            .collect();
        (output.status.code(), failed)
    };
    assert_eq!(judge(&bundled), (Some(0), Vec::new()));
    let mut edited = bundled.clone();
    let mut n_expected = 0;
    for table in &mut edited.tables {
        table.max_interpolation_error *= if n_expected % 2 == 0 { 0.9 } else { 1.1 };
        n_expected += 1;
    }
    let parameters = edited.info.parameters.iter_mut();
    for (_, text) in parameters.filter(|(name, _)| name.starts_with("lobes_TRT")) {
        *text = text.replace("median 0", "median 1");
    }
    assert_ne!(edited.info, bundled.info);
    let (code, failed) = judge(&edited);
    assert_eq!(code, Some(1));
    let count = |what: &str| failed.iter().filter(|check| check.contains(what)).count();
    assert_eq!(
        count("recorded max_interpolation_error"),
        n_expected,
        "{failed:?}"
    );
    assert_eq!(count("recorded parameters"), 1, "{failed:?}");
    assert_eq!(failed.len(), n_expected + 1, "{failed:?}");
}

/// A light set fitted to the sample's map, its path, and the folder that holds it.
fn fitted(folder: &Path, count: u32) -> (PathBuf, LightSet) {
    let path = folder.join(format!("{count}.lights"));
    let output = strandlight()
        .args(["lights", "--count", &count.to_string(), "-o"])
        .arg(&path)
        .arg(sample_map())
        .output()
        .expect("strandlight runs");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let set = LightSet::read(&path).expect("it was just written");
    (path, set)
}

fn sample_map() -> PathBuf {
    project_root().join("data/sample/studio.exr")
}

/// `verify --json` with these arguments: exit code, document, and the names of failed checks.
fn judged(args: &[&dyn AsRef<OsStr>]) -> (Option<i32>, Value, Vec<String>) {
    let mut command = strandlight();
    command
        .args(["verify", "--json"])
        .args(args.iter().map(AsRef::as_ref));
    let output = command.output().expect("strandlight runs");
    let document: Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
    let files = document["files"].as_array().expect("files");
    let checks = files
        .iter()
        .flat_map(|file| file["checks"].as_array().expect("checks"));
    let failed = checks.filter(|check| check["passed"] != true);
    let failed = failed.map(|check| check["check"].as_str().expect("a name").to_owned());
    let failed = failed.collect();
    (output.status.code(), document, failed)
}

/// A set is judged by limits of its judge, never by what it says of itself.
#[test]
fn slow_light_sets_are_judged_by_absolute_limits_and_their_figures_must_be_true() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let map = sample_map();
    let (path, set) = fitted(at, 40);
    let (code, _, failed) = judged(&[&path, &"--map", &map]);
    assert_eq!((code, failed), (Some(0), Vec::new()));
    let (code, _, failed) = judged(&[&path, &"--map", &map, &"--max-error", &"0.01%"]);
    assert_eq!((code, failed), (Some(1), vec!["fibre error".to_owned()]));

    // A bad set that owns up to it is bad; a few lights pass where their user says so.
    let (poor, few) = fitted(at, 1);
    let error = few.info.report.expect("recorded").fibre_error;
    assert!(error > 0.02, "{error}");
    let (code, document, failed) = judged(&[&poor, &"--map", &map]);
    assert_eq!((code, failed), (Some(1), vec!["fibre error".to_owned()]));
    let message = document["files"][0]["error"]["message"]
        .as_str()
        .expect("a message");
    assert!(message.contains("--max-error"), "{message}");
    let (code, _, failed) = judged(&[&poor, &"--map", &map, &"--max-error", &"100%"]);
    assert_eq!((code, failed), (Some(0), Vec::new()));

    let edited = at.join("edited.lights");
    let judge = |change: &dyn Fn(&mut LightSet)| {
        let mut set = set.clone();
        change(&mut set);
        set.write(&edited).expect("it can be written");
        let (code, _, failed) = judged(&[&edited, &"--map", &map]);
        assert_eq!(code, Some(i32::from(!failed.is_empty())));
        failed
    };
    let report = |set: &mut LightSet, change: &dyn Fn(&mut FitReport)| {
        change(set.info.report.as_mut().expect("recorded"));
    };
    assert_eq!(judge(&|_| ()), [""; 0]);
    for change in [
        (|report| report.fibre_error *= 0.5) as fn(&mut FitReport),
        |report| report.rel_l2 *= 1.01,
        |report| report.irradiance_error += 1e-4,
        |report| report.energy_ratio[1] += 0.01,
    ] {
        let failed = judge(&|set| report(set, &change));
        assert_eq!(failed, ["recorded figures"]);
    }
    let failed = judge(&|set| set.info.map_size[0] += 1);
    assert_eq!(failed, ["recorded size of the map"]);
    let failed = judge(&|set| set.info.map_hash = "0123456789abcdef".to_owned());
    assert_eq!(failed, ["fitted to this map"]);
    let failed = judge(&|set| set.info.map_hash = "not a hash".to_owned());
    assert_eq!(failed, ["hash of the map", "fitted to this map"]);
    let failed = judge(&|set| set.info.requested_count = 3);
    assert_eq!(failed, ["number of lights"]);
    // The same light in another order: only the order is wrong.
    let failed = judge(&|set| set.lights.swap(0, 7));
    assert_eq!(failed, ["lights by falling energy"]);
    // Half of one light is missing: the figures are no longer its own.
    let failed = judge(&|set| set.lights[0].rgb = set.lights[0].rgb.map(|x| 0.5 * x));
    assert!(
        failed.contains(&"recorded figures".to_owned()),
        "{failed:?}"
    );
    assert!(
        failed.contains(&"energy of a channel, relative".to_owned()),
        "{failed:?}"
    );
}

/// One file that cannot be read does not hide the others.
#[test]
fn every_file_is_judged_whatever_the_others_are() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let groom = |name: &str, points: Vec<[f32; 3]>| {
        let groom = Groom {
            strand_offsets: vec![0, 2, points.len() as u32],
            points,
            ..Groom::default()
        };
        let path = at.join(name);
        groom.write(&path).expect("it can be written");
        path
    };
    let points = vec![
        [0.0; 3],
        [0.0, 1.0, 0.0],
        [1.0; 3],
        [1.0, 2.0, 1.0],
        [1.0, 3.0, 1.0],
    ];
    let good = groom("good.groom", points.clone());
    let mut doubled = points;
    doubled[3] = doubled[2];
    let doubled = groom("doubled.groom", doubled);
    let cut = at.join("cut.groom");
    let bytes = std::fs::read(&good).expect("just written");
    std::fs::write(&cut, &bytes[..bytes.len() - 1]).expect("written");
    let missing = at.join("missing.groom");

    let kinds = |document: &Value| -> Vec<Value> {
        let files = document["files"].as_array().expect("files").iter();
        files.map(|file| file["error"]["kind"].clone()).collect()
    };
    let (code, document, failed) = judged(&[&missing, &cut, &doubled, &good]);
    assert_eq!(code, Some(2));
    assert_eq!(
        kinds(&document),
        ["unreadable", "damaged", "failed check", ""].map(|kind| if kind.is_empty() {
            Value::Null
        } else {
            json!(kind)
        })
    );
    assert_eq!(failed, ["neighbouring points apart"]);
    assert_eq!(document["passed"], false);
    let (code, document, _) = judged(&[&doubled, &good]);
    assert_eq!(
        (code, document["files"][1]["passed"].clone()),
        (Some(1), json!(true))
    );
    let message = document["files"][0]["error"]["message"]
        .as_str()
        .expect("a message");
    assert!(message.contains("points 0 and 1 of strand 1"), "{message}");
    let (code, document, _) = judged(&[&good, &good]);
    assert_eq!((code, document["passed"].clone()), (Some(0), json!(true)));

    // The same for people: what was judged on stdout, what could not be on stderr, in one line.
    let output = strandlight()
        .arg("verify")
        .args([&missing, &cut, &doubled, &good])
        .output()
        .expect("strandlight runs");
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stdout);
    for needle in ["doubled.groom: groom, FAILED", "good.groom: groom, ok"] {
        assert!(text.contains(needle), "{text}");
    }
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(message.lines().count(), 1, "{message}");
    for needle in ["missing.groom", "cut.groom", "doubled.groom"] {
        assert!(message.contains(needle), "{message}");
    }
    // A map that cannot be read is one more such file.
    let (code, document, _) = judged(&[&good, &"--map", &missing]);
    assert_eq!(
        (code, kinds(&document)),
        (Some(2), vec![json!("unreadable"), Value::Null])
    );
}

#[test]
fn the_tables_of_the_viewer_are_the_default_ones_without_the_papers() {
    let read = |name: &str| {
        TableFile::read(&project_root().join("data").join(name)).expect("part of the project")
    };
    let (lean, default) = (read("lean.tables"), read("default.tables"));
    assert_eq!(lean, strandlight_bake::tables::lean(default));
    let names: Vec<&str> = lean.tables.iter().map(|table| &*table.name).collect();
    let lobes = [
        "lobes_TT_shapes",
        "lobes_TT_shares",
        "lobes_TRT_shapes",
        "lobes_TRT_shares",
    ];
    assert_eq!(names[0], "C");
    assert_eq!(names[1..], lobes);
    let (output, report) = verify(&project_root().join("data/lean.tables"));
    assert_eq!(output.status.code(), Some(0), "{report}");
    assert_eq!(report["passed"], true);
}

#[test]
fn slow_baked_tables_verify_and_damaged_ones_do_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("schlick.tables");
    let output = strandlight()
        .args(["tables", "--fresnel", "schlick", "--json", "-o"])
        .arg(&path)
        .output()
        .expect("strandlight runs");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let report: serde_json::Value =
        serde_json::from_slice(&output.stdout).expect("one JSON document");
    assert_eq!(report["fresnel"], "schlick");
    assert_eq!(report["tables"].as_array().map(Vec::len), Some(7));

    let (output, report) = verify(&path);
    assert_eq!(output.status.code(), Some(0), "{report}");
    assert_eq!(report["passed"], true);

    // One value of 98,304, off by 1e-5 of itself, in a file that is whole otherwise.
    let mut tables = TableFile::read(&path).expect("it was just written");
    let ix = 4 * (128 * 30 + 80) + 2;
    tables.tables[2].data[ix] *= 1.0 + 1e-5;
    tables.write(&path).expect("it can be written");
    let (output, report) = verify(&path);
    assert_eq!(output.status.code(), Some(1), "{report}");
    assert_eq!(report["passed"], false);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        message.contains("H_TRT") && message.contains("H_4"),
        "{message}"
    );
    assert_eq!(message.trim_end().lines().count(), 1);
}

#[test]
fn what_is_no_baked_file_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = folder.path().join("a.tables");
    std::fs::write(&text, "hello").expect("it can be written");
    for path in [text.as_path(), folder.path(), Path::new("not-there.tables")] {
        let output = strandlight()
            .arg("verify")
            .arg(path)
            .output()
            .expect("strandlight runs");
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1);
    }
}
