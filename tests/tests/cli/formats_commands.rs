//! `groom import`, `inspect` and `export` from the outside.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{Axis, BakedFile, LightSet, Spacing, SrbfLight, Table, TableFile};
use strandlight_tests::samples::{hair_file, real_file};
use strandlight_tests::{assert_refused, strandlight};

/// Runs `strandlight ARGS` in `folder`, which must do it, and answers its stdout.
fn done(folder: &Path, args: &[&str]) -> String {
    let output = strandlight()
        .current_dir(folder)
        .args(args)
        .output()
        .expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{args:?}: {stderr}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&done(folder, &["inspect", file, "--json"])).expect("one JSON document")
}

/// Two strands, the first in a corner: 2 + 3 points with a thickness array, in inches.
fn small_hair() -> Vec<u8> {
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
fn files_of_other_kinds_are_called_by_their_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    LightSet {
        lights: vec![SrbfLight {
            direction: [0.0, 0.0, 1.0],
            lambda: 0.5,
            rgb: [1.0; 3],
        }],
        ..LightSet::default()
    }
    .write(&at.join("a.lights"))
    .expect("written");
    tables().write(&at.join("a.tables")).expect("written");
    fs::write(at.join("good.hair"), small_hair()).expect("written");
    done(at, &["groom", "import", "good.hair", "-o", "a.groom"]);
    let groom = fs::read(at.join("a.groom")).expect("written");
    let mut n_checked = 0;
    for (name, start, what) in [
        ("a.abc", &b"Ogawa\xff\0\x01"[..], "Alembic archive (Ogawa)"),
        ("a.usda", b"#usda 1.0\ndef", "USD file"),
        ("a.usdc", b"PXR-USDC\0\x08", "USD file"),
        ("a.usdz", b"PK\x03\x04\0\0", "zip archive"),
        ("a.tfx", b"version 2.0\nnumStrands 1\n", "TressFX .tfx file"),
        ("a.xml", b"<?xml version=\"1.0\"?>", "XML file"),
        ("a.obj", b"v 0 0 1\nv 0 1 1\n", "OBJ file"),
        ("a.ply", b"ply\nformat ascii 1.0\n", "PLY file of strands"),
        ("a.glb", b"glTF\x02\0\0\0", "glTF file"),
        ("a.bgeo", b"\x7fNSJb\0", "Houdini geometry"),
        ("a.exr", b"\x76\x2f\x31\x01\x02\0\0\0", "OpenEXR picture"),
        ("a.hdr", b"#?RADIANCE\n", "Radiance .hdr picture"),
        ("b.groom", &groom, "a groom"),
        ("b.hair", &small_hair(), "a .hair file"),
        (
            "b.lights",
            &fs::read(at.join("a.lights")).expect("written"),
            "a light set",
        ),
        (
            "b.tables",
            &fs::read(at.join("a.tables")).expect("written"),
            "a tables file",
        ),
    ] {
        fs::write(at.join(name), start).expect("written");
        let is_map = name == "a.exr" || name == "a.hdr";
        // Hair, if cut off: import says where it ends.
        let is_hair = ["a.abc", "a.usda", "a.usdc", "a.tfx", "a.ply", "b.hair"].contains(&name);
        let mut lines: Vec<Vec<&str>> = vec![vec!["render", name, "-o", "x.png"]];
        if !is_hair {
            lines.push(vec!["groom", "import", name, "-o", "x.groom"]);
        }
        if !is_map {
            lines.push(vec!["lights", name, "-o", "x.lights"]);
        }
        if name.starts_with("a.") && !is_hair {
            lines.push(vec!["inspect", name]);
        }
        if name.starts_with("a.") || is_hair {
            lines.push(vec!["verify", name]);
        }
        for args in lines {
            assert_refused(strandlight().current_dir(at).args(args), &[name, what]);
            n_checked += 1;
        }
        // The same as a scene's groom.
        let scene = format!("[groom]\nfile = '{name}'\n[lights]\nfile = 'a.lights'\n");
        fs::write(at.join("a.toml"), format!("version = 1\n{scene}")).expect("written");
        if name != "b.groom" {
            let args = ["render", "a.toml", "-o", "x.png"];
            assert_refused(strandlight().current_dir(at).args(args), &[name, what]);
            n_checked += 1;
        }
    }
    assert!(n_checked > 70, "{n_checked}");
    // A groom that is longer than any scene.
    let mut long = groom;
    long.resize(2 << 20, 0);
    fs::write(at.join("long.groom"), long).expect("written");
    let args = ["render", "long.groom", "-o", "x.png"];
    let needles = ["long.groom: not a scene: it is a groom", "groom.file"];
    assert_refused(strandlight().current_dir(at).args(args), &needles);
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
        notes.contains("1 strands of fewer than two points are kept"),
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

#[test]
fn light_set_as_json_and_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let light = |direction, lambda, rgb| SrbfLight {
        direction,
        lambda,
        rgb,
    };
    let set = LightSet {
        lights: vec![
            light([0.0, 0.0, 1.0], 0.5, [1.0, 2.0, 3.0]),
            light([0.0, 1.0, 0.0], 0.1, [0.1, 0.0, 0.0]),
        ],
        ..LightSet::default()
    };
    set.write(&at.join("a.lights")).expect("written");
    for document in [json(at, "a.lights"), {
        done(at, &["export", "a.lights", "-o", "a.json"]);
        serde_json::from_slice(&fs::read(at.join("a.json")).expect("written")).expect("JSON")
    }] {
        let expected = serde_json::json!([
            {"direction": [0.0, 0.0, 1.0], "lambda": 0.5, "rgb": [1.0, 2.0, 3.0]},
            {"direction": [0.0, 1.0, 0.0], "lambda": 0.1, "rgb": [0.1, 0.0, 0.0]},
        ]);
        let mut lights = document["lights"].clone();
        for (light, wanted) in lights
            .as_array_mut()
            .expect("a list")
            .iter_mut()
            .zip([8.0, 200.0])
        {
            let light = light.as_object_mut().expect("a light");
            let sharpness = light.remove("sharpness").and_then(|value| value.as_f64());
            assert!(sharpness.is_some_and(|value| (value / wanted - 1.0).abs() < 1e-6));
        }
        assert_eq!(lights, expected);
        assert_eq!(document["light_kind"], "srbf");
    }
    done(at, &["export", "a.lights", "-o", "a.exr", "--width", "64"]);
    let map = strandlight_images::Map::read(&at.join("a.exr")).expect("a map");
    assert_eq!((map.width(), map.height()), (64, 32));
    // Pixel (32, 16) looks along +Z but for half a pixel in both angles.
    let angle = 0.5 * std::f64::consts::PI / 32.0;
    let cosine = angle.cos() * angle.cos();
    let expected = 2.0 * (2.0 * (cosine - 1.0) / 0.25).exp();
    let green = f64::from(map.pixels()[16 * 64 + 32][1]);
    assert!((green / expected - 1.0).abs() < 1e-5, "{green} {expected}");
}

fn tables() -> TableFile {
    let axis = |name: &str, min, max, count, spacing| Axis {
        name: name.to_owned(),
        min,
        max,
        count,
        spacing,
    };
    let names = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    // All of C_0 in b_0 at the first texel, in b_8 at the others.
    let texel = |first: bool| {
        let mut texel = [0.0f32; 8];
        texel[7] = if first { 0.0 } else { 1.0 };
        texel
    };
    TableFile {
        fresnel: "schlick".to_owned(),
        tables: vec![
            Table {
                name: "C".to_owned(),
                axes: vec![
                    axis("kappa", 0.0, 2e6, 2, Spacing::InverseSqrt),
                    axis("cos_half_phi", 0.0, 1.0, 3, Spacing::RootSquare),
                ],
                channels: names("b1 b2 b3 b4 b5 b6 b7 b8"),
                data: (0..6).flat_map(|ix| texel(ix == 0)).collect(),
                max_interpolation_error: 0.0,
            },
            Table {
                name: "H_TT".to_owned(),
                axes: vec![
                    axis("eta", 1.0, 10.0, 2, Spacing::Reciprocal),
                    axis("cos_theta_d", 0.0, 1.0, 2, Spacing::Linear),
                ],
                channels: names("H0 H2 H4 H6"),
                data: (0..16).map(|ix| ix as f32).collect(),
                max_interpolation_error: 0.5,
            },
        ],
        ..TableFile::default()
    }
}

/// Shape text and floats of a float32 .npy.
fn npy(path: &Path) -> (String, Vec<f32>) {
    let bytes = fs::read(path).expect("written");
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let text = String::from_utf8_lossy(&bytes[10..10 + header]).into_owned();
    let floats = bytes[10 + header..]
        .chunks_exact(4)
        .map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]))
        .collect();
    (text, floats)
}

#[test]
fn tables_as_arrays_and_pictures() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    tables().write(&at.join("a.tables")).expect("written");
    let info = json(at, "a.tables");
    assert_eq!(info["tables"][1]["name"], "H_TT");
    assert_eq!(info["tables"][1]["format"], "rgba32float");
    assert_eq!(info["tables"][1]["max_interpolation_error"], 0.5);
    assert_eq!(info["tables"][0]["axes"][0]["spacing"], "inverse-sqrt");

    done(at, &["export", "a.tables", "-o", "x.npy"]);
    let (header, c) = npy(&at.join("x_C.npy"));
    assert!(header.contains("(7, 2, 3,)"), "{header}");
    // First row: kappa = 0, so C_0 is 2 pi. With all in b_0, C_k = 0 for k > 0; in b_8, C_k = C_0.
    let full = std::f32::consts::TAU;
    assert_eq!(c[..3], [full; 3]);
    assert_eq!(c[6..9], [0.0, full, full]);
    // Second row: lambda = 0.001, where C_0 = sqrt(2 pi / kappa) (1 + 1 / (8 kappa)).
    let narrow = (std::f64::consts::TAU / 2e6).sqrt();
    assert!(
        (f64::from(c[3]) / narrow - 1.0).abs() < 1e-6,
        "{} {narrow}",
        c[3]
    );
    let (header, h) = npy(&at.join("x_H_TT.npy"));
    assert!(header.contains("(4, 2, 2,)"), "{header}");
    assert_eq!(h[..8], [0.0, 4.0, 8.0, 12.0, 1.0, 5.0, 9.0, 13.0]);
    assert!(at.join("x_H_TT_eta.npy").exists());

    fs::create_dir(at.join("out")).expect("a folder");
    done(at, &["export", "a.tables", "-o", "out"]);
    assert_eq!(npy(&at.join("out/C.npy")).1, c);
    done(at, &["export", "a.tables", "-o", "y.exr"]);
    assert!(
        fs::read(at.join("y_H_TT.exr"))
            .expect("written")
            .starts_with(&[0x76, 0x2f, 0x31, 0x01])
    );
}

#[test]
fn wrong_requests_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    tables().write(&at.join("a.tables")).expect("written");
    fs::write(at.join("a.hair"), small_hair()).expect("written");
    let mut broken = fs::read(at.join("a.tables")).expect("written");
    let last = broken.len() - 1;
    broken[last] ^= 1;
    fs::write(at.join("broken.tables"), &broken).expect("written");
    fs::create_dir(at.join("folder.groom")).expect("a folder");
    let before = fs::read_dir(at).expect("readable").count();
    for (args, needle) in [
        (&["export", "a.tables", "-o", "x.png"][..], "x.png"),
        (&["export", "broken.tables", "-o", "x.npy"], "damaged"),
        (&["export", "a.hair", "-o", "x.hair"], "a.hair"),
        (&["export", "folder.groom", "-o", "x.hair"], "folder.groom"),
        (&["inspect", "folder.groom"], "directory"),
        (&["inspect", "broken.tables"], "DATA 1"),
        (
            &["groom", "import", "a.tables", "-o", "x.groom"],
            "a.tables",
        ),
        (
            &["groom", "generate", "--style", "mohawk", "-o", "x.groom"],
            "mohawk",
        ),
        (
            &[
                "groom",
                "generate",
                "--style",
                "bob",
                "--strands",
                "0",
                "-o",
                "x.groom",
            ],
            "strands",
        ),
    ] {
        assert_refused(strandlight().current_dir(at).args(args), &[needle]);
        assert_eq!(
            fs::read_dir(at).expect("readable").count(),
            before,
            "{args:?}"
        );
    }
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
