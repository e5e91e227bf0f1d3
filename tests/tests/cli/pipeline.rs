//! The main job, from the outside: the bundled sample, and files that others made.

use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;

use exr::prelude::{Blocks, Compression};
use strandlight_tests::samples::{exr_map, hair_file, real_file};
use strandlight_tests::{assert_done, strandlight, strandview};

struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<[u8; 3]>,
}

fn read_png(path: &Path) -> Picture {
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("a size that fits")];
    let info = reader.next_frame(&mut bytes).expect("a whole PNG");
    assert_eq!(info.bit_depth, png::BitDepth::Eight);
    let channels = info.color_type.samples();
    let rgb = bytes[..info.buffer_size()]
        .chunks_exact(channels)
        .map(|texel| [texel[0], texel[1], texel[2]])
        .collect();
    Picture {
        width: info.width as usize,
        height: info.height as usize,
        rgb,
    }
}

/// Asserts that a picture on a dark, plain background shows something lit in its middle: neither
/// black nor burnt out, with structure, and only background in its upper corners.
fn assert_shows_hair(picture: &Picture) {
    let Picture { width, height, rgb } = picture;
    assert_eq!(rgb.len(), width * height);
    let luma = |rgb: &[u8; 3]| rgb.iter().map(|&value| f64::from(value)).sum::<f64>() / 3.0;
    let middle: Vec<f64> = (height / 4..3 * height / 4)
        .flat_map(|y| (3 * width / 8..5 * width / 8).map(move |x| (x, y)))
        .map(|(x, y)| luma(&rgb[y * width + x]))
        .collect();
    let mean = middle.iter().sum::<f64>() / middle.len() as f64;
    let variance = middle
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / middle.len() as f64;
    assert!((12.0..220.0).contains(&mean), "the middle has mean {mean}");
    assert!(
        variance.sqrt() > 4.0,
        "the middle is flat: deviation {}",
        variance.sqrt()
    );
    // Dither may round the same colour to either level beside it.
    let [left, right] = [rgb[0], rgb[width - 1]];
    let is_background = (0..3).all(|channel| left[channel].abs_diff(right[channel]) <= 1);
    assert!(is_background, "upper corners differ: {left:?} {right:?}");
}

#[test]
fn gpu_the_demo_bakes_verifies_and_renders() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let said = assert_done(
        strandlight()
            .current_dir(folder.path())
            .args(["demo", "--output", "d"]),
    );
    let at = folder.path().join("d");
    for name in [
        "studio.exr",
        "studio.lights",
        "studio.json",
        "studio.png",
        "default.tables",
        "layered.groom",
        "bust.mesh",
        "scene.toml",
        "demo.png",
    ] {
        assert!(at.join(name).is_file(), "{name} is missing");
    }
    assert!(said.contains("$ strandlight render"), "{said}");
    let picture = read_png(&at.join("demo.png"));
    assert_eq!((picture.width, picture.height), (720, 480));
    let mean = picture
        .rgb
        .iter()
        .flatten()
        .map(|&value| f64::from(value))
        .sum::<f64>()
        / (3 * picture.rgb.len()) as f64;
    assert!((20.0..200.0).contains(&mean), "mean {mean}");

    // The same scene by the viewer.
    let mut view = strandview();
    view.current_dir(&at)
        .args(["scene.toml", "--frame", "view.png", "--size", "240x160"]);
    assert_done(view.args(["--samples", "16"]));
    assert_shows_hair(&read_png(&at.join("view.png")));
}

#[test]
fn slow_files_of_others_become_a_picture() {
    let map = exr_map(Compression::PIZ, Blocks::Tiles(exr::prelude::Vec2(16, 16)));
    assert_become_a_picture(&map, &hair_file(800, 16));
    let real = [
        real_file("env/pmndrs_studio.exr"),
        real_file("hair/cyuksel_straight.hair"),
    ];
    if let [Some(map), Some(hair)] = real.map(|path| path.map(fs::read)) {
        assert_become_a_picture(&map.expect("readable"), &hair.expect("readable"));
    }
}

/// Lights of an OpenEXR map and a `.hair` file, from import to picture, and the hair back.
fn assert_become_a_picture(map: &[u8], hair: &[u8]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    fs::write(at.join("studio.exr"), map).expect("writable");
    fs::write(at.join("model.hair"), hair).expect("writable");
    let run = |command: &mut std::process::Command| assert_done(command.current_dir(at));
    run(strandlight().args(["lights", "studio.exr", "-o", "studio.lights"]));
    run(strandlight().args(["groom", "import", "model.hair", "-o", "model.groom"]));
    run(strandlight().args(["export", "model.groom", "-o", "again.hair"]));
    assert!(
        fs::read(at.join("again.hair")).expect("written") == hair,
        "import and export change the file"
    );
    let scene = "version = 1\n[groom]\nfile = \"model.groom\"\n[lights]\nfile = \"studio.lights\"\n\
                 [render]\nbackground = [0.0, 0.0, 0.0]\n";
    fs::write(at.join("scene.toml"), scene).expect("writable");
    let size = ["--size", "240x160", "--samples", "16"];
    run(strandlight()
        .args(["render", "scene.toml", "-o", "picture.png"])
        .args(size));
    assert_shows_hair(&read_png(&at.join("picture.png")));
    run(strandlight()
        .args(["render", "scene.toml", "-o", "picture.exr"])
        .args(size));
    assert!(at.join("picture.exr").is_file());
}
