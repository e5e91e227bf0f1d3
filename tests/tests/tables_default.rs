//! The bundled tables, and the commands that bake and verify tables.

use std::path::Path;
use std::process::Output;

use strandlight_bake::progress::Progress;
use strandlight_bake::tables::bake_tables;
use strandlight_formats::TableFile;
use strandlight_scattering::fresnel::Fresnel;
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
        let name = old.name.clone();
        let (was, is) = (old.max_interpolation_error, new.max_interpolation_error);
        assert!(
            (was - is).abs() < 1e-6 || name.starts_with("lobes_"),
            "{was} {is}"
        );
        old.max_interpolation_error = is;
        let (old, new) = (std::mem::take(&mut old.data), std::mem::take(&mut new.data));
        assert_eq!(old.len(), new.len());
        // A search may stop a little elsewhere where the last bit differs.
        let fitted = name.starts_with("lobes_");
        let tolerance = if fitted { 1e-3 } else { f32::EPSILON };
        for (ix, (old, new)) in old.iter().zip(&new).enumerate() {
            assert!(
                (old - new).abs() <= tolerance * if fitted { 1.0 } else { new.abs() },
                "data/default.tables is out of date at value {ix}, {old} for {new}: \
                 strandlight tables -o data/default.tables"
            );
        }
    }
    // What is measured on fitted lobes is printed to a hundredth of a per cent.
    let names = |file: &TableFile| -> Vec<String> {
        let parameters = file.info.parameters.iter();
        parameters.map(|(name, _)| name.clone()).collect()
    };
    assert_eq!(names(&bundled), names(&baked));
    bundled.info.parameters.clone_from(&baked.info.parameters);
    assert_eq!(bundled, baked);
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
fn baked_tables_verify_and_damaged_ones_do_not() {
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
