//! `groom import`, `inspect` and `export` from the outside.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{BakedFile, LightSet, SrbfLight};
use strandlight_tests::samples::{hair_file, real_file};
use strandlight_tests::{assert_refused, strandlight};

/// Runs `strandlight ARGS` in `folder`, which must do it, and answers its stdout.
pub(super) fn done(folder: &Path, args: &[&str]) -> String {
    let output = strandlight()
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {stderr}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

pub(super) fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&done(folder, &["inspect", file, "--json"])).expect("one JSON document")
}

/// Two strands, the first in a corner: 2 + 3 points with a thickness array, in inches.
pub(super) fn small_hair() -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    for word in [2u32, 5, 1 | 2 | 4, 9] {
        bytes.extend(word.to_le_bytes());
    }
    for default in [0.5f32, 0.25, 0.1, 0.2, 0.3] {
        bytes.extend(default.to_le_bytes());
    }
    bytes.extend([b'x'; 88]);
    bytes.extend([1u8, 0, 2, 0]);
    for value in [
        0.0f32, 0.0, 0.0, 1.0, 2.0, 3.0, -1.0, 0.0, 0.0, -1.0, 1.0, 4.0, -2.0, 2.0, 5.0,
    ] {
        bytes.extend(value.to_le_bytes());
    }
    for value in [0.01f32, 0.02, 0.03, 0.04, 0.05] {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}

#[test]
fn hair_in_and_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("a.hair"), small_hair()).expect("written");
    let said = done(at, &["groom", "import", "a.hair", "-o", "a.groom"]);
    assert!(
        said.contains("a.groom: groom 1.1, 2 strands, 5 points"),
        "{said}"
    );
    let info = json(at, "a.groom");
    assert_eq!(info["strands"], 2);
    assert_eq!(info["points"], 5);
    assert_eq!(info["unit"], "cm");
    // z up: y of the groom is z of the file.
    assert_eq!(info["bounds"]["min"], serde_json::json!([-2.0, 0.0, -2.0]));
    assert_eq!(info["bounds"]["max"], serde_json::json!([1.0, 5.0, 0.0]));
    let names: Vec<_> = info["attributes"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|a| a["name"].clone())
        .collect();
    assert_eq!(names, ["thickness", "transparency", "color", "diameter"]);
    done(at, &["export", "a.groom", "-o", "b.hair"]);
    assert!(fs::read(at.join("b.hair")).expect("written") == small_hair());

    done(
        at,
        &[
            "groom", "import", "a.hair", "-o", "in.groom", "--unit", "in", "--up", "y",
        ],
    );
    let info = json(at, "in.groom");
    assert_eq!(info["source_cm_per_unit"], 2.54);
    let top = info["bounds"]["max"][1].as_f64().expect("a number");
    assert!((top - 2.0 * 2.54).abs() < 1e-6, "{top}");
    // The .hair file itself can be looked at.
    assert_eq!(json(at, "a.hair")["kind"], "hair");
    for unit in ["furlong", "0", "-1", "nan", "inf", "1e9"] {
        let flag = format!("--unit={unit}");
        let args = ["groom", "import", "a.hair", "-o", "c.groom", &flag];
        assert_refused(strandlight().current_dir(at).args(args), &["--unit"]);
        assert!(!at.join("c.groom").exists());
    }
}

/// Runs `strandlight ARGS` in `folder`, which must do it, and answers its stderr.
fn said(folder: &Path, args: &[&str]) -> String {
    let output = strandlight()
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{args:?}: {stderr}");
    stderr
}

/// A head of a person who stands, in metres, y up: 60 strands of 3 points of which the last ones
/// hang, and the thickness given as default.
fn head_in_metres(thickness: f32) -> Vec<u8> {
    let mut bytes = b"HAIR".to_vec();
    for word in [60u32, 180, 2, 2] {
        bytes.extend(word.to_le_bytes());
    }
    for default in [thickness, 0.0, 0.1, 0.2, 0.3] {
        bytes.extend(default.to_le_bytes());
    }
    bytes.extend([0; 88]);
    for ix in 0..60 {
        let y = 1.0 - ix as f32 / 50.0;
        let (ring, turn) = ((1.0 - y * y).sqrt(), 2.4 * ix as f32);
        let root = [
            0.08 * ring * turn.sin(),
            1.7 + 0.11 * y,
            0.1 * ring * turn.cos(),
        ];
        for down in [0.0, 0.1, 0.3] {
            for value in [root[0], root[1] - down, root[2]] {
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    bytes
}

#[test]
fn a_groom_in_metres_is_doubted_wherever_it_goes() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("a.hair"), head_in_metres(1.0)).expect("written");
    // Taken as centimetres with z up, as .hair files are.
    let notes = said(at, &["groom", "import", "a.hair", "-o", "cm.groom"]);
    let thick = "the groom is 0.43 cm large";
    for needle in [
        thick,
        "--unit m?",
        "--up y?",
        "1 above 0.05 cm",
        "drawn 0.008 cm thick",
    ] {
        assert!(notes.contains(needle), "{notes}");
    }
    for args in [
        &["inspect", "cm.groom"],
        &["inspect", "a.hair"],
        &["verify", "cm.groom"],
    ] {
        let notes = said(at, args);
        for needle in [args[1], thick, "--unit m?"] {
            assert!(notes.contains(needle), "{args:?}: {notes}");
        }
    }
    let info = json(at, "cm.groom");
    assert_eq!(info["guess"]["unit"], "m");
    assert_eq!(info["guess"]["up"], "y");
    assert_eq!(info["notes"].as_array().map(Vec::len), Some(3));

    // As a scene; thin strands, so that it is drawn at once.
    fs::write(at.join("thin.hair"), head_in_metres(0.008)).expect("written");
    said(at, &["groom", "import", "thin.hair", "-o", "thin.groom"]);
    let light = SrbfLight {
        direction: [0.0, 0.0, 1.0],
        lambda: 0.5,
        rgb: [1.0; 3],
    };
    let set = LightSet {
        lights: vec![light],
        ..LightSet::default()
    };
    set.write(&at.join("a.lights")).expect("written");
    let scene = "version = 1\n[groom]\nfile = 'thin.groom'\n[lights]\nfile = 'a.lights'\n";
    fs::write(at.join("a.toml"), scene).expect("written");
    let render = [
        "render",
        "a.toml",
        "-o",
        "a.png",
        "--size",
        "16x16",
        "--samples",
        "4",
        "--shadow-maps",
        "0",
        "--backend",
        "cpu",
    ];
    let notes = said(at, &render);
    for needle in ["thin.groom", "0.43 cm large", "--unit m?"] {
        assert!(notes.contains(needle), "{notes}");
    }
    let notes = said(
        at,
        &[&render[..], &["--set", "hair.diameter_cm=0.5"]].concat(),
    );
    assert!(notes.contains("strands are 0.5 cm thick"), "{notes}");

    // The flags that the notes name, and what auto finds by itself.
    for flags in [
        ["--unit", "m", "--up", "y"],
        ["--unit", "auto", "--up", "auto"],
    ] {
        let import = ["groom", "import", "thin.hair", "-o", "m.groom"];
        let notes = said(at, &[&import[..], &flags].concat());
        let is_auto = flags[1] == "auto";
        for needle in [
            "unit m (guessed: its roots span",
            "y up (guessed: its roots are 1.7",
        ] {
            assert_eq!(notes.contains(needle), is_auto, "{notes}");
        }
        assert!(!notes.contains('?'), "{notes}");
        let info = json(at, "m.groom");
        assert_eq!(info["source_cm_per_unit"], 100.0);
        assert_eq!(info["source_up"], "y");
        // 0.008 of a metre is too thick for a head, whoever wrote it.
        let thick = info["notes"][0].as_str().unwrap_or_default();
        assert!(thick.contains("1 above 0.43"), "{info}");
        assert_eq!(info["notes"].as_array().map(Vec::len), Some(1));
    }
}

#[test]
fn auto_is_refused_where_nothing_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("a.hair"), small_hair()).expect("written");
    for (flag, needles) in [
        ("--unit", ["a.hair", "--unit auto", "mm, cm, in, ft, m"]),
        ("--up", ["a.hair", "--up auto", "x, y or z"]),
    ] {
        let args = ["groom", "import", "a.hair", "-o", "a.groom", flag, "auto"];
        assert_refused(strandlight().current_dir(at).args(args), &needles);
        assert!(!at.join("a.groom").exists());
    }
    let args = [
        "groom", "import", "a.hair", "-o", "a.groom", "--unit", "furlong",
    ];
    let needles = [
        "furlong",
        "mm, cm, in, ft, m, a number of centimetres",
        "auto",
    ];
    assert_refused(strandlight().current_dir(at).args(args), &needles);
}

#[test]
fn thickness_goes_out_as_it_is_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let generate = [
        "groom",
        "generate",
        "--style",
        "bob",
        "--strands",
        "50",
        "--points-per-strand",
        "6",
        "-o",
        "a.groom",
    ];
    done(at, &generate);
    done(at, &["export", "a.groom", "-o", "a.hair"]);
    done(at, &["groom", "import", "a.hair", "-o", "b.groom"]);
    let (own, back) = (json(at, "a.groom"), json(at, "b.groom"));
    // Few strands are thick: 0.008 cm times 20.
    let (max, source) = (&own["diameter_cm"]["max"], &own["diameter_cm"]["source"]);
    let max = max.as_f64().expect("a number");
    assert!((max - 0.16).abs() < 1e-7 && source == "constant", "{own}");
    assert_eq!(own["diameter_cm"], back["diameter_cm"]);
    assert_eq!(own["bounds"], back["bounds"]);
    let text = done(at, &["inspect", "a.groom"]);
    assert!(text.contains("diameter 1600 \u{b5}m (constant)"), "{text}");
    assert!(
        text.contains("size ") && text.contains("lengths "),
        "{text}"
    );

    // An array stays an array.
    fs::write(at.join("c.hair"), small_hair()).expect("written");
    done(at, &["groom", "import", "c.hair", "-o", "c.groom"]);
    let expected =
        serde_json::json!({"min": 0.01, "median": 0.03, "max": 0.05, "source": "per point"});
    assert_eq!(json(at, "c.groom")["diameter_cm"], expected);
    let text = done(at, &["inspect", "c.groom"]);
    assert!(
        text.contains("diameter 100 to 500 \u{b5}m, median 300 (per point)"),
        "{text}"
    );
}

#[test]
fn what_import_cannot_draw_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut bytes = small_hair();
    let start = bytes.len() - 8;
    bytes[start..start + 4].copy_from_slice(&(-1f32).to_le_bytes());
    bytes[..4].copy_from_slice(b"hair");
    fs::write(at.join("a.hair"), bytes).expect("written");
    let notes = said(at, &["groom", "import", "a.hair", "-o", "a.groom"]);
    for needle in [
        "small letters",
        "1 of 5 values cannot be drawn (1 negative; first -1 at point 1 of strand 1)",
        "drawn 0.008 cm thick",
    ] {
        assert!(notes.contains(needle), "{notes}");
    }
    let info = json(at, "a.groom");
    assert_eq!(info["diameter_cm"]["source"], "default");
    let last = info["notes"].as_array().and_then(|notes| notes.last());
    let last = last.and_then(Value::as_str).unwrap_or_default();
    assert!(last.contains("1 negative"), "{info}");
}

#[test]
fn styles_are_listed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let help = done(at, &["groom", "generate", "--help"]);
    let args = ["groom", "generate", "--style", "curled", "-o", "a.groom"];
    let styles = ["straight", "wavy", "curly", "ponytail", "bob", "layered"];
    for style in styles {
        assert!(help.contains(style), "{help}");
    }
    assert_refused(strandlight().current_dir(at).args(args), &styles);
}

#[test]
fn hair_of_others_comes_back() {
    let mut files = vec![(hair_file(300, 16), 300, 4800)];
    if let Some(path) = real_file("hair/cyuksel_straight.hair") {
        files.push((fs::read(path).expect("readable"), 10_000, 160_000));
    }
    for (file, strands, points) in files {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        fs::write(at.join("a.hair"), &file).expect("written");
        done(at, &["groom", "import", "a.hair", "-o", "a.groom"]);
        let info = json(at, "a.groom");
        assert_eq!(
            (&info["strands"], &info["points"]),
            (&strands.into(), &points.into())
        );
        done(at, &["export", "a.groom", "-o", "b.hair"]);
        assert!(fs::read(at.join("b.hair")).expect("written") == file);
    }
}

/// Small formats by the same commands, and what they cannot hold.
#[test]
fn small_formats_in_and_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let text = "1 160 5 0.004 # linearcurve\n1 150 6 0.004\n1 140 6.5 0.002\n\n\
                2 160 5 0.004\n2 150 5 0.001\n";
    fs::write(at.join("a.txt"), text).expect("written");
    said(at, &["groom", "import", "a.txt", "-o", "a.groom"]);
    let info = json(at, "a.groom");
    assert_eq!((&info["strands"], &info["points"]), (&2.into(), &5.into()));
    assert_eq!(info["source_format"], "mitsuba");
    assert_eq!(info["bounds"]["max"], serde_json::json!([2.0, 160.0, 6.5]));
    done(at, &["export", "a.groom", "-o", "b.txt"]);
    assert_eq!(fs::read_to_string(at.join("b.txt")).expect("written"), text);
    let notes = said(at, &["export", "a.groom", "-o", "b.tfx"]);
    assert!(
        notes.contains("strands of 2 to 3 points are resampled to 4"),
        "{notes}"
    );
    // The numbers are those of the file.
    let printed = done(at, &["export", "a.groom", "-o", "b.tfx"]);
    assert!(printed.contains("2 strands, 8 points"), "{printed}");
    let notes = said(at, &["groom", "import", "b.tfx", "-o", "b.groom"]);
    assert!(notes.contains("all 2 strands are guides"), "{notes}");
    said(at, &["export", "a.groom", "-o", "b.pbrt"]);
    assert_eq!(json(at, "b.pbrt")["kind"], "pbrt");
    let args = ["export", "a.groom", "-o", "x.ply"];
    assert_refused(strandlight().current_dir(at).args(args), &["x.ply"]);
}

/// A second format, without a signature: found by its content, in and out by the same commands.
#[test]
fn point_lists_in_and_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut bytes = 3u32.to_le_bytes().to_vec();
    for (n_points, aside) in [(2u32, 0.125f32), (1, 0.0), (3, 0.25)] {
        bytes.extend(n_points.to_le_bytes());
        for ix in 0..n_points {
            for value in [aside, 1.75 - 0.25 * ix as f32, 0.0] {
                bytes.extend(value.to_le_bytes());
            }
        }
    }
    fs::write(at.join("a.data"), &bytes).expect("written");
    let notes = said(at, &["groom", "import", "a.data", "-o", "a.groom"]);
    assert!(
        notes.contains("1 strand of fewer than two points is kept"),
        "{notes}"
    );
    let info = json(at, "a.groom");
    assert_eq!((&info["strands"], &info["points"]), (&2.into(), &5.into()));
    assert_eq!(info["source_format"], "usc");
    assert_eq!(info["single_point_strands"], 1);
    // In metres, y up, as the database has them.
    assert_eq!(info["source_cm_per_unit"], 100.0);
    assert_eq!(info["bounds"]["max"], serde_json::json!([25.0, 175.0, 0.0]));
    assert_eq!(json(at, "a.data")["kind"], "usc");
    let text = done(at, &["inspect", "a.groom"]);
    assert!(
        text.contains("source: usc, 100 cm per unit, y up"),
        "{text}"
    );

    // Back by the ending of the name, or by --format whatever it is.
    done(at, &["export", "a.groom", "-o", "b.data"]);
    done(
        at,
        &["export", "a.groom", "-o", "c.points", "--format", "usc"],
    );
    for name in ["b.data", "c.points"] {
        assert!(fs::read(at.join(name)).expect("written") == bytes, "{name}");
    }
    // In the other format.
    done(at, &["export", "a.groom", "-o", "b.hair"]);
    done(at, &["groom", "import", "b.hair", "-o", "b.groom"]);
    assert_eq!(json(at, "b.groom")["bounds"], info["bounds"]);
    assert_eq!(json(at, "b.groom")["source_format"], "hair");

    let formats = done(at, &["groom", "formats"]);
    let lines: Vec<&str> = formats.lines().collect();
    assert!(
        lines[0].starts_with("hair: .hair, in and out; 1 cm a unit and z up"),
        "{formats}"
    );
    assert!(
        lines[lines.len() - 1].starts_with("usc: .data, in and out; 100 cm a unit and y up"),
        "{formats}"
    );
    assert!(
        lines.iter().any(|line| line.starts_with("npy: .npy, in; ")),
        "{formats}"
    );
    for (args, needles) in [
        (
            &["export", "a.groom", "-o", "x.xyz"][..],
            &["x.xyz", ".hair, ", " or .data"][..],
        ),
        (
            &["export", "a.groom", "-o", "x.hair", "--format", "xyz"],
            &["--format", "hair, ", " or usc"],
        ),
        (
            &["export", "b.hair", "-o", "x.data"],
            &["b.hair", "only .tables, .lights and .groom"],
        ),
    ] {
        assert_refused(strandlight().current_dir(at).args(args), needles);
    }
    bytes.pop();
    fs::write(at.join("cut.data"), &bytes).expect("written");
    let args = ["groom", "import", "cut.data", "-o", "x.groom"];
    let needles = [
        "cut.data",
        "3 points of strand 2 take 36 bytes",
        "35 left (at byte 52)",
    ];
    assert_refused(strandlight().current_dir(at).args(args), &needles);
}

/// The exit code says that it failed where stderr takes nothing.
#[cfg(target_os = "linux")]
#[test]
fn a_full_stderr_does_not_change_the_exit_code() {
    for args in [&["inspect", "not-there"][..], &["inspect"]] {
        let full = fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("Linux has it");
        let status = strandlight().args(args).stderr(full).status();
        assert_eq!(status.expect("it starts").code(), Some(2), "{args:?}");
    }
}
