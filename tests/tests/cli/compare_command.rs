//! `strandlight compare` from the outside.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use strandlight_images::picture::exr_file;
use strandlight_scene::Picture;
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// A disc of hair on nothing, `gain` times as bright in red.
fn disc(width: u32, height: u32, gain: f32) -> Picture {
    let rgba = (0..width * height)
        .map(|ix| {
            let (x, y) = (ix % width, ix / width);
            let (dx, dy) = (x as f32 - 16.0, y as f32 - 12.0);
            let inside = dx * dx + dy * dy < 64.0;
            let shade = 0.2 + 0.02 * (x + y) as f32;
            if inside {
                [gain * shade, 0.5 * shade, 0.3 * shade, 1.0]
            } else {
                [0.0; 4]
            }
        })
        .collect();
    Picture {
        width,
        height,
        rgba,
    }
}

fn pictures_in(folder: &Path) {
    for (name, picture) in [
        ("b.exr", disc(32, 24, 1.0)),
        ("a.exr", disc(32, 24, 1.1)),
        ("small.exr", disc(24, 24, 1.0)),
        ("black.exr", disc(32, 24, 0.0)),
    ] {
        let mut picture = picture;
        if name == "black.exr" {
            picture.rgba.fill([0.0; 4]);
        }
        fs::write(folder.join(name), exr_file(&picture).expect("an EXR")).expect("written");
        let png = picture
            .to_png(0.0, &strandlight_scene::tone::ToneMap::None.into())
            .expect("a PNG");
        fs::write(folder.join(name).with_extension("png"), png).expect("written");
    }
}

fn compare(folder: &Path, args: &[&str]) -> Command {
    let mut command = strandlight();
    command.current_dir(folder).arg("compare").args(args);
    command
}

#[test]
fn numbers_pictures_and_tolerance() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    pictures_in(at);
    let args = ["a.exr", "b.exr", "--heatmap", "h.png", "--flip", "f.png"];
    let json = |more: &[&str]| -> Value {
        let text = assert_done(compare(at, &args).args(more).arg("--json"));
        serde_json::from_str(&text).expect("one document")
    };
    let result = json(&[]);
    let ratio = &result["hair"]["mean_ratio"];
    assert!(
        (ratio[0].as_f64().expect("red") - 1.1).abs() < 1e-5,
        "{ratio}"
    );
    assert_eq!(ratio[1], 1.0);
    // 0.1 of red, 1 : 0.5 : 0.3.
    let error = result["hair"]["relative_rmse"].as_f64().expect("a number");
    assert!((error - 0.1 / 1.34_f64.sqrt()).abs() < 1e-5, "{error}");
    assert_eq!(result["whole"]["pixels"], 32 * 24);
    assert!(result["hair"]["pixels"].as_u64() < Some(220));
    let flip = result["flip"]["mean"].as_f64().expect("a number");
    assert!(flip > 1e-3 && flip < 0.2, "{flip}");
    assert!(result["heatmap"]["red"].as_f64() > Some(0.05));
    for name in ["h.png", "f.png"] {
        assert!(
            fs::read(at.join(name))
                .expect("written")
                .starts_with(b"\x89PNG")
        );
    }
    assert_eq!(json(&["--box", "4"])["size"], serde_json::json!([8, 6]));
    assert_eq!(json(&["--tolerance", "0.09"])["passed"], true);
    // In the dark little is seen.
    let darker = json(&["--exposure", "-5"])["flip"]["mean"].as_f64();
    assert!(darker < Some(flip), "{darker:?} {flip}");
    // Another curve, other differences.
    let by_curve = |curve: &str| {
        let flip = &json(&["--tone-map", curve])["flip"];
        assert_eq!(flip["tone_map"], curve);
        flip["mean"].as_f64().expect("a number")
    };
    let mut found = ["filmic", "agx", "aces2", "none"].map(by_curve);
    assert_eq!(found[0], flip);
    found.sort_by(f64::total_cmp);
    let apart = found.windows(2).all(|pair| pair[1] - pair[0] > 1e-4);
    assert!(apart, "{found:?}");

    let output = compare(at, &args)
        .args(["--tolerance", "0.08"])
        .output()
        .expect("runs");
    assert_eq!(output.status.code(), Some(1));
    let png = assert_done(compare(at, &["a.png", "b.png"]).arg("--json"));
    let png: Value = serde_json::from_str(&png).expect("one document");
    let of_png = png["hair"]["relative_rmse"].as_f64().expect("a number");
    assert!((of_png - error).abs() < 0.01, "{of_png} {error}");
    let same = assert_done(compare(at, &["b.exr", "b.exr"]).args(["--tolerance", "0"]));
    assert!(same.contains("relative RMSE 0.00000"), "{same}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    pictures_in(at);
    fs::write(at.join("text.exr"), "no picture").expect("written");
    let cases: [(&[&str], &[&str]); 10] = [
        (&["a.exr", "small.exr"], &["32x24", "24x24"]),
        (&["a.exr", "b.png"], &["linear"]),
        (&["a.exr", "black.exr"], &["black"]),
        (
            &["a.exr", "b.exr", "--layer", "global"],
            &["a.exr", "global"],
        ),
        (
            &["a.png", "b.png", "--layer", "global"],
            &["a.png", "global"],
        ),
        (
            &["text.exr", "b.exr"],
            &["text.exr", "neither OpenEXR nor PNG"],
        ),
        (&["none.exr", "b.exr"], &["none.exr"]),
        (
            &["a.exr", "b.exr", "--heatmap", "h.exr"],
            &["h.exr", ".png"],
        ),
        (&["a.exr", "b.exr", "--box", "0"], &["0"]),
        (&["a.png", "b.png", "--flip", "b.png"], &["b.png"]),
    ];
    for (args, needles) in cases {
        assert_refused(&mut compare(at, args), needles);
    }
}
