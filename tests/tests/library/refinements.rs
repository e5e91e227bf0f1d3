//! What a window on the CPU shows of a still view does not jump from one picture to the next.

use std::path::Path;
use std::time::Duration;

use strandlight_bake::grooms::{GrowSpec, Style, bust, generate};
use strandlight_bake::scenes::PaperScene;
use strandlight_cpu::{BackgroundRenderer, InteractiveRenderer};
use strandlight_data::{SAMPLE_LIGHTS, SAMPLE_SCENE};
use strandlight_formats::{BakedFile, LightSet, Scene, SrbfLight};
use strandlight_runtime::{Display, InteractiveBackend};
use strandlight_scene::PreparedScene;
use strandlight_scene::progress::Progress;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};

/// Largest difference of consecutive pictures: relative RMS of their levels.
const MAX_STEP: f64 = 0.02;

/// Relative RMS difference of levels.
fn difference(a: &[[u8; 4]], b: &[[u8; 4]]) -> f64 {
    let rgb = |pixels: &[[u8; 4]]| -> Vec<f64> {
        let of = |pixel: &[u8; 4]| [0, 1, 2].map(|ix: usize| f64::from(pixel[ix]));
        pixels.iter().flat_map(of).collect()
    };
    let (a, b) = (rgb(a), rgb(b));
    let off: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    (off / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// Every picture that is shown until the last.
fn pictures(live: &mut dyn InteractiveBackend, budget: Duration) -> Vec<Vec<[u8; 4]>> {
    let mut found: Vec<Vec<[u8; 4]>> = Vec::new();
    let mut version = live.display().version();
    loop {
        let progress = live.advance(budget).expect("a picture");
        if live.display().version() != version {
            version = live.display().version();
            let Display::Pixels(shown) = live.display() else {
                panic!("a picture in memory");
            };
            found.push(shown.pixels.to_vec());
        }
        if progress.is_done {
            return found;
        }
    }
}

/// No step of these is large, though the first picture is not the last.
fn check(pictures: &[Vec<[u8; 4]>], least: f64) {
    let [Some(first), Some(last)] = [pictures.first(), pictures.last()] else {
        panic!("no picture");
    };
    let steps = pictures
        .windows(2)
        .map(|pair| difference(&pair[0], &pair[1]));
    let largest = steps.fold(0.0, f64::max);
    let all = difference(first, last);
    println!(
        "{} pictures, {all:.4} apart, a step {largest:.4} at most",
        pictures.len()
    );
    assert!(largest <= MAX_STEP, "a step of {largest}");
    assert!(all > least, "the first picture is {all} from the last");
}

/// The first pictures of a scene, of lights that were turned, and of another view.
fn check_scene(scene: &Scene) {
    let prepared = PreparedScene::load(scene).expect("a scene");
    let mut live = InteractiveRenderer::new(prepared.clone());
    check_edits(&prepared, &mut live, Duration::ZERO);
    let mut live = BackgroundRenderer::new(prepared.clone());
    check_edits(&prepared, &mut live, Duration::from_secs(1));
}

fn check_edits(scene: &PreparedScene, live: &mut dyn InteractiveBackend, budget: Duration) {
    let (lights, camera) = (scene.lights.clone(), scene.camera);
    check(&pictures(live, budget), MAX_STEP);
    let turned = |light: &SrbfLight| SrbfLight {
        direction: [
            0.8 * light.direction[0] + 0.6 * light.direction[2],
            light.direction[1],
            0.8 * light.direction[2] - 0.6 * light.direction[0],
        ],
        ..*light
    };
    live.set_lights(lights.iter().map(turned).collect())
        .expect("lights");
    check(&pictures(live, budget), MAX_STEP);
    let mut moved = camera;
    moved.eye.x += 0.1 * moved.eye.distance(moved.target);
    live.set_camera(moved);
    check(&pictures(live, budget), 0.0);
}

#[test]
fn refinements_do_not_jump() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = write_small_scene(
        folder.path(),
        &curtain(40, 8, 0.1, 0.0),
        key_and_sky(),
        |scene| {
            scene.hair.diameter_cm = Some(0.2);
            scene.render.size = [48, 32];
        },
    );
    check_scene(&Scene::read(&at).expect("a scene"));
}

/// Grows the hair of a scene beside its file, in the sample's lights, for small pictures.
fn scene_in(folder: &Path, (name, toml): (&str, &str), hair: &GrowSpec) -> Scene {
    let groom = generate(hair, &Progress::silent()).expect("a groom");
    let at = |end: &str| folder.join(format!("{name}.{end}"));
    groom.write(&at("groom")).expect("written");
    let lights = LightSet::from_bytes(SAMPLE_LIGHTS).expect("lights");
    lights.write(&at("lights")).expect("written");
    std::fs::write(at("toml"), toml).expect("written");
    let mut scene = Scene::read(at("toml")).expect("a scene");
    (scene.groom.file, scene.lights.file) = (
        format!("{name}.groom").into(),
        format!("{name}.lights").into(),
    );
    scene.tables = None;
    scene.render.size = [240, 160];
    scene
}

#[test]
fn slow_refinements_of_the_sample_do_not_jump() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    bust()
        .write(&folder.path().join("bust.mesh"))
        .expect("written");
    let hair = GrowSpec {
        style: Style::Layered,
        strands: 12_000,
        points_per_strand: 40,
        seed: 1,
    };
    check_scene(&scene_in(folder.path(), ("sample", SAMPLE_SCENE), &hair));
}

/// The paper's straight hair, of a tenth of the strands.
#[test]
fn slow_refinements_of_straight_hair_do_not_jump() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let straight = PaperScene::from_name("straight").expect("a scene");
    let scene = ("straight", &*straight.toml());
    check_scene(&scene_in(folder.path(), scene, &straight.groom(0.1)));
}
