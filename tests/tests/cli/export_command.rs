//! `export` and `inspect` of light sets and tables; files of the wrong kind and other requests that are refused.

use std::fs;
use std::path::Path;

use strandlight_formats::{Axis, BakedFile, LightSet, Spacing, SrbfLight, Table, TableFile};
use strandlight_images::Map;
use strandlight_tests::panoramas::striped_map;
use strandlight_tests::{assert_refused, strandlight};

use super::formats_commands::{done, json, small_hair};

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
    // Pixel (32, 16) starts at +Z, and holds its mean.
    let (mut sum, mut area) = (0.0, 0.0);
    for ix in 0..200 * 200 {
        let angle = |ix: usize| std::f64::consts::PI / 32.0 * (ix as f64 + 0.5) / 200.0;
        let (latitude, longitude) = (angle(ix / 200), angle(ix % 200));
        let cosine = latitude.cos() * longitude.cos();
        sum += latitude.cos() * 2.0 * (2.0 * (cosine - 1.0) / 0.25).exp();
        area += latitude.cos();
    }
    let expected = sum / area;
    let green = f64::from(map.pixels()[16 * 64 + 32][1]);
    assert!((green / expected - 1.0).abs() < 1e-5, "{green} {expected}");
    // The light of 0.1 is narrower than two pixels of it.
    let energies = [16, 64, 300].map(|width: u32| {
        let width = width.to_string();
        done(
            at,
            &["export", "a.lights", "-o", "a.exr", "--width", &width],
        );
        strandlight_images::Map::read(&at.join("a.exr"))
            .expect("a map")
            .energy()
    });
    let solid_angle = |lambda: f64| {
        std::f64::consts::PI * lambda * lambda * (1.0 - (-4.0 / (lambda * lambda)).exp())
    };
    let expected = [
        solid_angle(0.5) + 0.1 * solid_angle(0.1),
        2.0 * solid_angle(0.5),
        3.0 * solid_angle(0.5),
    ];
    for energy in energies {
        for (found, wanted) in energy.into_iter().zip(expected) {
            assert!((found / wanted - 1.0).abs() < 1e-5, "{found} {wanted}");
        }
    }
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
fn maps_as_arrays() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("sky.hdr"), striped_map(16)).expect("written");
    done(at, &["export", "sky.hdr", "-o", "sky.npy"]);
    let (header, values) = npy(&at.join("sky.npy"));
    assert!(header.contains("(8, 16, 3,)"), "{header}");
    let map = Map::read(&at.join("sky.hdr")).expect("a map");
    assert_eq!(values, map.pixels().as_flattened());
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
    let map = striped_map(16);
    fs::write(at.join("sky.hdr"), &map).expect("written");
    fs::write(at.join("cut.hdr"), &map[..100]).expect("written");
    let light = SrbfLight {
        direction: [0.0, 1.0, 0.0],
        lambda: 0.5,
        rgb: [1.0; 3],
    };
    let set = LightSet {
        lights: vec![light],
        ..LightSet::default()
    };
    set.write(&at.join("a.lights")).expect("written");
    fs::create_dir(at.join("folder.groom")).expect("a folder");
    fs::create_dir(at.join("out")).expect("a folder");
    let mut elsewhere = tables();
    elsewhere.tables[0].name = "../x".to_owned();
    elsewhere
        .write(&at.join("elsewhere.tables"))
        .expect("written");
    let before = fs::read_dir(at).expect("readable").count();
    for (args, needle) in [
        (&["export", "a.tables", "-o", "x.png"][..], "x.png"),
        (&["export", "broken.tables", "-o", "x.npy"], "damaged"),
        (&["export", "elsewhere.tables", "-o", "out"], "\"../x\""),
        (&["export", "elsewhere.tables", "-o", "x.npy"], "\"../x\""),
        (
            &["export", "a.lights", "-o", "x.json", "--width", "64"],
            "--width is for light sets that become .exr",
        ),
        (
            &["export", "a.tables", "-o", "x.exr", "--width", "64"],
            "--width is for light sets that become .exr",
        ),
        (
            &["export", "a.lights", "-o", "x.exr", "--width", "65"],
            "must be an even number in 4..=8192",
        ),
        (
            &["export", "a.lights", "-o", "x.exr", "--width", "2"],
            "must be an even number in 4..=8192",
        ),
        (
            &["export", "sky.hdr", "-o", "x.exr"],
            "a map can be exported to .npy",
        ),
        (
            &["export", "sky.hdr", "-o", "x.npy", "--width", "64"],
            "--width is for light sets that become .exr",
        ),
        (&["export", "cut.hdr", "-o", "x.npy"], "cut.hdr: "),
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
