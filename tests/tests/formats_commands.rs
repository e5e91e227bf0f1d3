//! `groom import`, `inspect` and `export` from the outside.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{Axis, LightSet, Spacing, SrbfLight, Table, TableFile};
use strandlight_tests::{assert_refused, sample_data, strandlight};

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
        said.contains("a.groom: groom 1.0, 2 strands, 5 points"),
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

#[test]
fn genuine_sample_comes_back() {
    let Some(path) = sample_data("hair/cyuksel_straight.hair") else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let input = path.to_str().expect("UTF-8");
    done(at, &["groom", "import", input, "-o", "a.groom"]);
    let info = json(at, "a.groom");
    assert_eq!(
        (&info["strands"], &info["points"]),
        (&10_000.into(), &160_000.into())
    );
    done(at, &["export", "a.groom", "-o", "b.hair"]);
    assert!(fs::read(at.join("b.hair")).expect("written") == fs::read(path).expect("readable"));
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
        assert_eq!(document["lights"], expected);
    }
    done(at, &["export", "a.lights", "-o", "a.exr", "--width", "64"]);
    let map = strandlight_bake::lights::Map::read(&at.join("a.exr")).expect("a map");
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
