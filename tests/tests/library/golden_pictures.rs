//! Small pictures that guard what everything before them adds up to.
//!
//! `tests/golden/pictures/NAME.exr` were drawn by the CPU twin. A change that is meant to change
//! pictures renews them, and its commit says why and by how much:
//!
//! ```text
//! STRANDLIGHT_BLESS=1 cargo test -p strandlight-tests --test library golden_pictures
//! ```
//!
//! A missing picture is a failure. A picture that is off is left with its signed difference in
//! the target folder's `tmp/golden`, and `strandlight compare` tells more.

use std::fs;
use std::path::{Path, PathBuf};

use strandlight_bake::grooms::{GrowSpec, Style, generate};
use strandlight_cpu as cpu;
use strandlight_formats::{BakedFile, LightSet, Scene, SrbfLight};
use strandlight_images::picture::exr_file;
use strandlight_reference::compare::{Comparison, Layer, compare, signed_png};
use strandlight_scene::progress::Progress;
use strandlight_scene::{Picture, PreparedScene};
use strandlight_tests::project_root;

/// Largest accepted relative RMSE over the hair. The pictures do not depend on threads, and
/// differ between machines by the rounding of their sines alone.
const TOLERANCE: f64 = 2e-3;

/// Name, preset, style, and what is drawn of the scattering.
const PICTURES: [(&str, &str, Style, &str); 6] = [
    ("dark-single", "black", Style::Wavy, "single"),
    ("brown-single", "brown", Style::Straight, "single"),
    ("blond-single", "blond", Style::Bob, "single"),
    ("dark-total", "black", Style::Wavy, "total"),
    ("brown-total", "brown", Style::Straight, "total"),
    ("blond-total", "blond", Style::Bob, "total"),
];

const SIZE: [u32; 2] = [96, 64];
const SAMPLES: u32 = 16;

/// A hard key light, a coloured rim, a soft fill and a wide sky.
fn lights() -> LightSet {
    let light = |[x, y, z]: [f32; 3], lambda, rgb| {
        let length = (x * x + y * y + z * z).sqrt();
        SrbfLight {
            direction: [x / length, y / length, z / length],
            lambda,
            rgb,
        }
    };
    LightSet {
        lights: vec![
            light([0.6, 0.7, 0.5], 0.08, [60.0, 55.0, 45.0]),
            light([-0.7, 0.3, -0.6], 0.25, [8.0, 9.0, 14.0]),
            light([-0.8, 0.1, 0.7], 0.5, [0.9, 0.8, 0.7]),
            light([0.0, 1.0, 0.0], 1.4, [0.25, 0.3, 0.4]),
        ],
        ..LightSet::default()
    }
}

/// Draws a picture from files in `folder`, as a user would. The density factors are written out,
/// so that a better choice of their defaults leaves these pictures alone.
fn draw(folder: &Path, preset: &str, style: Style, scattering: &str) -> Picture {
    let spec = GrowSpec {
        style,
        strands: 300,
        points_per_strand: 24,
        seed: 11,
    };
    let groom = generate(&spec, &Progress::silent()).expect("in range");
    groom.write(&folder.join("a.groom")).expect("written");
    lights().write(&folder.join("a.lights")).expect("written");
    let text = format!(
        "version = 1\n\
         [groom]\nfile = 'a.groom'\n\
         [lights]\nfile = 'a.lights'\n\
         [hair]\npreset = '{preset}'\ndensity_forward = 0.7\ndensity_back = 0.7\n\
         [camera]\nposition = [66.0, 10.0, -30.0]\ntarget = [0.0, -3.5, -1.0]\n\
         [render]\nscattering = '{scattering}'\nbackground = 'none'\n"
    );
    fs::write(folder.join("a.toml"), text).expect("written");
    let scene = Scene::read(folder.join("a.toml")).expect("valid");
    let scene = PreparedScene::load(&scene).expect("valid");
    let (picture, _) = cpu::render(&scene, &scene.camera, SIZE, SAMPLES).expect("in range");
    picture
}

fn layer_of(picture: &Picture) -> Layer {
    let bytes = exr_file(picture).expect("an EXR");
    Layer::decode(&bytes, None).expect("finite")
}

fn golden(name: &str) -> PathBuf {
    project_root()
        .join("tests/golden/pictures")
        .join(name)
        .with_extension("exr")
}

/// Leaves what was drawn and its difference where a person finds them.
fn leave(name: &str, picture: &Picture, golden: &Layer) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("golden");
    fs::create_dir_all(&folder).expect("the target folder can be written");
    let drawn = folder.join(name).with_extension("exr");
    fs::write(&drawn, exr_file(picture).expect("an EXR")).expect("written");
    let png = signed_png(&layer_of(picture), golden, 0.1).expect("one size");
    fs::write(folder.join(name).with_extension("png"), png).expect("written");
    drawn
}

/// How far `picture` is from the golden one.
fn held(picture: &Picture, golden: &Layer) -> (bool, Comparison) {
    let result = compare(&layer_of(picture), golden).expect("one size");
    (result.hair.relative_rmse <= TOLERANCE, result)
}

#[test]
fn slow_pictures_are_the_golden_ones() {
    let bless = std::env::var_os("STRANDLIGHT_BLESS").is_some();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut faults = Vec::new();
    for (name, preset, style, scattering) in PICTURES {
        let picture = draw(folder.path(), preset, style, scattering);
        let path = golden(name);
        if bless {
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(&path, exr_file(&picture).expect("an EXR")).expect("written");
            continue;
        }
        let golden = Layer::read(&path, None).expect("golden pictures are part of the project");
        let (is_held, result) = held(&picture, &golden);
        println!("{name}: relative RMSE {:.2e}", result.hair.relative_rmse);
        assert!(result.hair.pixels > 500, "{name} shows hair");
        if !is_held {
            let left = leave(name, &picture, &golden);
            faults.push(format!("{}: {result:?}", left.display()));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// The comparison above sees a change of one percent, of one channel, and of a few pixels.
#[test]
fn a_small_change_is_noticed() {
    let (name, preset, style, scattering) = PICTURES[1];
    if std::env::var_os("STRANDLIGHT_BLESS").is_some() {
        return;
    }
    let golden = Layer::read(&golden(name), None).expect("part of the project");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let picture = draw(folder.path(), preset, style, scattering);
    assert!(held(&picture, &golden).0);
    let changed = |change: &dyn Fn(usize, &mut [f32; 4])| {
        let mut picture = picture.clone();
        for (ix, pixel) in picture.rgba.iter_mut().enumerate() {
            change(ix, pixel);
        }
        held(&picture, &golden).0
    };
    assert!(!changed(&|_, pixel| pixel[0] *= 1.01));
    assert!(!changed(&|ix, pixel| if ix.is_multiple_of(500) {
        pixel[1] += 0.1;
    }));
    assert!(changed(&|_, pixel| pixel[1] *= 1.0001));
}
