//! Pictures through a LUT, and LUTs that are refused.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use strandlight_formats::content_hash;
use strandlight_scene::tone::{aces2, level, srgb_from_linear};
use strandlight_tests::luts::grid_cube;
use strandlight_tests::{assert_done, assert_refused, strandlight, strandview};

use super::render_command::scene_in;
use super::render_files::header;

/// The levels of a PNG, and the hash of the LUT that it was shown by.
fn shown(path: &Path) -> (Vec<u8>, Option<String>) {
    let bytes = fs::read(path).expect("written");
    let mut reader = png::Decoder::new(Cursor::new(bytes))
        .read_info()
        .expect("a PNG");
    let texts = &reader.info().uncompressed_latin1_text;
    let lut = texts.iter().find(|text| text.keyword == "strandlight/lut");
    let lut = lut.map(|text| text.text.clone());
    let mut pixels = vec![0; reader.output_buffer_size().expect("of a size")];
    reader.next_frame(&mut pixels).expect("whole");
    (pixels, lut)
}

/// The bits of the linear values of an OpenEXR picture of 60x40.
fn linear(path: &Path) -> Vec<[u32; 4]> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| vec![[0_u32; 4]; size.area()],
        |pixels: &mut Vec<[u32; 4]>, at, (r, g, b, a): (f32, f32, f32, f32)| {
            pixels[at.y() * 60 + at.x()] = [r, g, b, a].map(f32::to_bits);
        },
    );
    image
        .expect("an OpenEXR file")
        .layer_data
        .channel_data
        .pixels
}

/// Draws `a.toml` in `folder` with the keys `set`.
fn draw(folder: &Path, backend: &str, out: &str, set: &[&str]) {
    let mut command = strandlight();
    command.current_dir(folder).args(["render", "a.toml"]);
    command.args(["-o", out, "--size", "60x40", "--samples", "4"]);
    command.args(["--backend", backend]);
    assert_done(command.args(set.iter().flat_map(|value| ["--set", value])));
}

/// Largest difference of levels, and how many differ.
fn apart(a: &[u8], b: &[u8]) -> (u8, usize) {
    assert_eq!(a.len(), b.len());
    let apart = || a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
    let most = apart().max().expect("pixels");
    (most, apart().filter(|&x| x > 0).count())
}

/// A LUT that changes nothing, one that swaps red and blue, and the scene, in a folder.
fn folder_with_luts() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    fs::create_dir(at.join("looks")).expect("a folder");
    let same = grid_cube(9, |v| v);
    fs::write(at.join("looks/same.cube"), same).expect("written");
    let swapped = grid_cube(9, |[r, g, b]| [b, g, r]);
    fs::write(at.join("looks/swapped.cube"), swapped).expect("written");
    folder
}

fn lut_shows_what_it_should(backend: &str) {
    let folder = folder_with_luts();
    let at = folder.path();
    let input = "render.lut_input=\"srgb\"";
    draw(at, backend, "none.png", &["render.tone_map=\"none\""]);
    let same = "render.lut=\"looks/same.cube\"";
    // The tone map has no say.
    draw(
        at,
        backend,
        "same.png",
        &[same, input, "render.tone_map=\"agx\""],
    );
    let swapped = "render.lut=\"looks/swapped.cube\"";
    draw(at, backend, "swapped.png", &[swapped, input]);
    draw(at, backend, "log.png", &[same]);
    let [none, same, swapped, log] =
        ["none", "same", "swapped", "log"].map(|name| shown(&at.join(format!("{name}.png"))));
    let (most, others) = apart(&none.0, &same.0);
    assert!(most <= 1 && others * 100 < none.0.len(), "{most} {others}");
    let back: Vec<u8> = swapped
        .0
        .chunks(3)
        .flat_map(|rgb| [rgb[2], rgb[1], rgb[0]])
        .collect();
    assert!(apart(&none.0, &back).0 <= 1);
    assert!(apart(&none.0, &swapped.0).0 > 10, "the light is not grey");
    assert!(apart(&none.0, &log.0).0 > 10, "an encoding of its own");
    let hash = content_hash(&fs::read(at.join("looks/same.cube")).expect("there"));
    assert_eq!((none.1, same.1), (None, Some(hash)));
}

#[test]
fn a_lut_takes_the_place_of_the_tone_map() {
    lut_shows_what_it_should("cpu");
}

#[test]
fn gpu_a_lut_takes_the_place_of_the_tone_map() {
    lut_shows_what_it_should("gpu");
}

fn aces_2_shows_what_it_should(backend: &str) {
    let folder = folder_with_luts();
    let at = folder.path();
    let tone_map = "render.tone_map=\"aces2\"";
    draw(at, backend, "aces2.png", &[tone_map]);
    draw(at, backend, "agx.png", &["render.tone_map=\"agx\""]);
    draw(at, backend, "linear.exr", &[tone_map]);
    let (found, lut) = shown(&at.join("aces2.png"));
    assert_eq!(lut, None, "of no file");
    let wanted: Vec<u8> = linear(&at.join("linear.exr"))
        .into_iter()
        .flat_map(|pixel| {
            let [r, g, b, alpha] = pixel.map(f32::from_bits);
            assert!(alpha > 0.999, "the sky is behind the hair");
            aces2([r, g, b]).map(|x| level(srgb_from_linear(x), 0.0))
        })
        .collect();
    // Dither and the grid's error.
    let (most, _) = apart(&found, &wanted);
    assert!(most <= 2, "{most}");
    assert!(apart(&found, &shown(&at.join("agx.png")).0).0 > 10);
}

#[test]
fn aces_2_is_a_tone_map() {
    aces_2_shows_what_it_should("cpu");
}

#[test]
fn gpu_aces_2_is_a_tone_map() {
    aces_2_shows_what_it_should("gpu");
}

#[test]
fn linear_pictures_are_not_touched_and_frames_of_the_viewer_are_the_same() {
    let folder = folder_with_luts();
    let at = folder.path();
    let lut = "render.lut=\"looks/swapped.cube\"";
    draw(at, "cpu", "plain.exr", &[]);
    draw(at, "cpu", "lut.exr", &[lut]);
    assert!(linear(&at.join("plain.exr")) == linear(&at.join("lut.exr")));
    assert!(
        header(&at.join("lut.exr"))
            .0
            .contains_key("strandlight/lut")
    );
    // Without samples, as the window draws.
    let mut command = strandlight();
    command
        .current_dir(at)
        .args(["render", "a.toml", "-o", "lut.png"]);
    command.args(["--size", "60x40", "--backend", "cpu", "--set", lut]);
    assert_done(&mut command);
    let mut view = strandview();
    view.current_dir(at).args(["a.toml", "--frame", "view.png"]);
    view.args(["--size", "60x40", "--backend", "cpu", "--set", lut]);
    assert_done(&mut view);
    assert!(shown(&at.join("lut.png")).0 == shown(&at.join("view.png")).0);
}

#[test]
fn luts_that_are_not_there_or_wrong_are_refused_in_one_line() {
    let folder = folder_with_luts();
    let at = folder.path();
    fs::write(at.join("nan.cube"), "LUT_1D_SIZE 2\n0 0 0\n0 nan 0\n").expect("written");
    fs::write(at.join("huge.cube"), "# a\nLUT_3D_SIZE 100000\n0 0 0\n").expect("written");
    fs::write(at.join("short.cube"), "LUT_3D_SIZE 33\n0 0 0\n").expect("written");
    for (file, needles) in [
        ("none.cube", &["render.lut", "none.cube"][..]),
        (
            "nan.cube",
            &["nan.cube:3: row is 0 nan 0", "finite numbers"],
        ),
        (
            "huge.cube",
            &["huge.cube:2: LUT_3D_SIZE is 100000", "2..=129"],
        ),
        (
            "short.cube",
            &["short.cube", "number of rows is 1", "35937"],
        ),
        ("a.lights", &["a.lights", "not a .cube file", "a light set"]),
        ("a.toml", &["not a .cube file", "a scene"]),
        ("looks", &["looks", "directory"]),
    ] {
        let set = format!("render.lut=\"{file}\"");
        for backend in ["cpu", "auto"] {
            let mut command = strandlight();
            command
                .current_dir(at)
                .args(["render", "a.toml", "-o", "x.png"]);
            command.args(["--backend", backend, "--set", &set]);
            assert_refused(&mut command, needles);
        }
        assert!(!at.join("x.png").exists());
    }
    let mut command = strandlight();
    command
        .current_dir(at)
        .args(["render", "a.toml", "-o", "x.png"]);
    command.args(["--set", "render.lut_input=\"log\""]);
    assert_refused(&mut command, &["render.lut_input", "log2"]);
}

#[test]
fn inspect_says_what_a_lut_holds() {
    let folder = folder_with_luts();
    let at = folder.path();
    let text =
        "\u{feff}TITLE \"film\"\r\nLUT_1D_SIZE 2\r\nLUT_1D_INPUT_RANGE 0 8\r\n0 0 0\r\n1 1 .5\r\n";
    fs::write(at.join("film.cube"), text).expect("written");
    let inspect = |args: &[&str]| {
        let mut command = strandlight();
        assert_done(command.current_dir(at).arg("inspect").args(args))
    };
    let said = inspect(&["film.cube"]);
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(
        lines,
        [
            "LUT (.cube) film",
            "1D: 2 samples, input [0.0, 0.0, 0.0] to [8.0, 8.0, 8.0]",
            "output [0.0, 0.0, 0.0] to [1.0, 1.0, 0.5]",
        ]
    );
    let json: serde_json::Value =
        serde_json::from_str(&inspect(&["looks/same.cube", "--json"])).expect("JSON");
    assert_eq!(
        (&json["kind"], &json["grid"]["size"]),
        (&"lut".into(), &9.into())
    );
    assert!(json["curves"].is_null() && json["title"].is_null());
    let mut export = strandlight();
    export
        .current_dir(at)
        .args(["export", "film.cube", "-o", "x.npy"]);
    assert_refused(&mut export, &["film.cube", "LUT"]);
}
