//! The bundled painted script from the outside, on both backends.

use std::fs;
use std::path::Path;

use strandlight_formats::Scene;
use strandlight_reference::compare::Layer;
use strandlight_tests::scenes::write_scene;
use strandlight_tests::{assert_done, project_root, strandlight};

const SIZE: [usize; 2] = [120, 80];

/// The bundled scene in a small size, and the bundled strokes with one of widths behind them.
fn sample_in(folder: &Path) {
    let sample = project_root().join("data/sample");
    let run = |args: &str| {
        let mut command = strandlight();
        assert_done(command.current_dir(folder).args(args.split_whitespace()));
    };
    fs::copy(sample.join("studio.exr"), folder.join("studio.exr")).expect("copied");
    run("lights studio.exr -o studio.lights --count 8");
    run("groom generate --style layered --strands 800 --points-per-strand 24 -o layered.groom");
    let mut scene = Scene::read(sample.join("scene.toml")).expect("valid");
    scene.tables = None;
    // Strands that lie on a surface seen edge-on are before or behind it by rounding.
    scene.proxies.clear();
    scene.hair.diameter_cm = Some(0.04);
    scene.render.shadow_maps = 8;
    write_scene(folder, "scene.toml", &scene);
    let script = fs::read_to_string(sample.join("painted.json")).expect("readable");
    let frame = r#"{"frame": "painted.png", "size": [600, 400], "samples": 64}"#;
    let frames = r#"{"frame": "dyed", "size": [120, 80], "samples": 16},
        {"stroke": {"brush": {"what": {"width_scale": 2}, "radius_cm": 200}, "path": [[360, 240]]}},
        {"frame": "wide", "size": [120, 80], "samples": 16},
        {"undo": 4},
        {"frame": "bare", "size": [120, 80], "samples": 16}"#;
    assert!(script.contains(frame), "{script}");
    fs::write(folder.join("s.json"), script.replace(frame, frames)).expect("written");
}

/// Root of the mean squared difference over the root mean square of `b`.
fn relative(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let square = |x: f32| f64::from(x) * f64::from(x);
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let difference: f64 = pairs.map(|(a, b)| square(a - b)).sum();
    (difference / b.iter().flatten().map(|&b| square(b)).sum::<f64>()).sqrt()
}

#[test]
fn gpu_the_bundled_strokes_paint_alike_on_both_backends() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    sample_in(at);
    for backend in ["gpu", "cpu"] {
        let args = ["render", "scene.toml", "--script", "s.json", "-o", backend];
        let mut command = strandlight();
        // The same samples on both; the CPU draws none unless it is asked to.
        command.current_dir(at).args(args).args(["--samples", "16"]);
        assert_done(command.args(["--backend", backend]));
    }
    let read = |backend: &str, name: &str| {
        let path = at.join(backend).join(format!("{name}.exr"));
        Layer::read(&path, None).expect("a picture").rgb
    };
    for name in ["dyed", "wide", "bare"] {
        let error = relative(&read("gpu", name), &read("cpu", name));
        println!("{name}: {:.4} %", 100.0 * error);
        assert!(error < 0.003, "{name}: {error}");
    }
    let [dyed, wide, bare] = ["dyed", "wide", "bare"].map(|name| read("cpu", name));
    assert!(relative(&dyed, &bare) > 0.2 && relative(&wide, &dyed) > 0.05);
    // The streak left of the middle is blue, tips are lighter than roots beside it.
    let mean = |picture: &[[f32; 3]], x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
        let places = y.flat_map(|y| x.clone().map(move |x| y * SIZE[0] + x));
        places.fold([0.0; 3], |sum, ix| {
            [0, 1, 2].map(|c| sum[c] + picture[ix][c])
        })
    };
    let [red, _, blue] = mean(&dyed, 45..55, 25..55);
    let [red_before, _, blue_before] = mean(&bare, 45..55, 25..55);
    assert!(blue > red && blue_before < red_before, "{red} {blue}");
    let ratio = |x: std::ops::Range<usize>, y: std::ops::Range<usize>| {
        let [a, b] = [&dyed, &bare].map(|picture| mean(picture, x.clone(), y.clone())[1]);
        a / b
    };
    // Beside the parting, and where the hair ends on a shoulder.
    let (root, tip) = (ratio(62..80, 5..20), ratio(36..45, 53..62));
    assert!(root < 0.9 && tip > 1.3, "{root} {tip}");
}
