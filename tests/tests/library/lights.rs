//! Lights that a scene adds to its set, and parts of the light as a viewer shows them.

use std::time::{Duration, Instant};

use strandlight_cpu::{CpuRenderer, transmittance_seen};
use strandlight_formats::{AddedLight, Background, Groom, Scattering, Scene};
use strandlight_runtime::{
    BackendChoice, Chosen, CpuReason, Display, Inspection, LightLayer, Session, Viewer,
};
use strandlight_scattering::Lobe;
use strandlight_scene::{Backend, Picture, PreparedScene};
use strandlight_tests::scenes::{curtain, light, write_small_scene};

const SIZE: [u32; 2] = [40, 30];

/// A key light as scenes add it, and from where it shines alone.
const KEY: AddedLight = AddedLight {
    azimuth_deg: -40.0,
    elevation_deg: 25.0,
    width_deg: 6.0,
    intensity: 1.5,
    color: [1.0, 0.8, 0.5],
};

/// A curtain of hair under two lights; `change` has its way with the scene.
fn scene(folder: &std::path::Path, change: impl FnOnce(&mut Scene)) -> std::path::PathBuf {
    let lights = vec![
        light([-0.6, 0.0, 0.8], 0.2, [20.0, 8.0, 2.0]),
        light([0.6, 0.0, -0.8], 0.5, [1.0, 2.0, 4.0]),
    ];
    write_small_scene(folder, &curtain(80, 5, 0.05, 2.0), lights, |scene| {
        scene.hair.diameter_cm = Some(0.06);
        scene.render.size = SIZE;
        scene.render.background = Background::Color([0.1, 0.2, 0.3]);
        change(scene);
    })
}

fn viewer(folder: &std::path::Path, change: impl FnOnce(&mut Scene)) -> Viewer {
    let session = Session::open(&scene(folder, change)).expect("a scene");
    let chosen = Chosen::Cpu(CpuReason::Asked);
    Viewer::choose(BackendChoice::Cpu, chosen, session).expect("the CPU draws it")
}

/// The pixels of the finished picture and of what is inspected of it.
fn finished(viewer: &mut Viewer) -> Vec<[u8; 4]> {
    let start = Instant::now();
    loop {
        let progress = viewer.advance(Duration::from_millis(5)).expect("drawn");
        let is_waiting = viewer.inspection().is_some() && !viewer.is_inspection_shown();
        if progress.is_done && !is_waiting {
            break;
        }
        if progress.is_done {
            assert!(viewer.next_update().is_some(), "nothing more comes");
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(start.elapsed() < Duration::from_secs(120), "it never ends");
    }
    match viewer.display() {
        Display::Pixels(display) => display.pixels.to_vec(),
        Display::Texture(_) => panic!("the CPU has no textures"),
    }
}

fn drawn(scene: PreparedScene) -> Picture {
    let mut renderer = CpuRenderer::new(scene);
    renderer.render(SIZE, 1, &|_| ()).expect("drawn").0
}

/// Largest difference of a channel between `picture` and the sum of `parts`, against its mean.
fn difference(picture: &Picture, parts: &[Picture]) -> f32 {
    let mean = picture.rgba.iter().map(|rgba| rgba[1]).sum::<f32>() / picture.rgba.len() as f32;
    let mut worst = 0.0_f32;
    for (ix, rgba) in picture.rgba.iter().enumerate() {
        for (channel, value) in rgba[..3].iter().enumerate() {
            let sum: f32 = parts.iter().map(|part| part.rgba[ix][channel]).sum();
            worst = worst.max((sum - value).abs());
        }
    }
    worst / mean
}

#[test]
fn an_added_light_is_a_light_of_the_set() {
    let folder = tempfile::tempdir().expect("a folder");
    // The light as one more of the set: neither factor nor turn of the section is its own.
    let by_scene = scene(folder.path(), |scene| scene.lights.added = vec![KEY]);
    let by_scene = Scene::read(&by_scene).expect("valid");
    assert_eq!(by_scene.lights.added, [KEY]);
    let by_scene = PreparedScene::load(&by_scene).expect("a scene");
    let mut by_set = by_scene.clone();
    by_set.lights.truncate(2);
    let without = drawn(by_set.clone());
    by_set.lights.push(KEY.light());
    let picture = drawn(by_set);
    assert!(picture.rgba == drawn(by_scene.clone()).rgba);
    assert!(picture.rgba != without.rgba, "it adds nothing");

    let turned = scene(folder.path(), |scene| {
        (scene.lights.rotate_deg, scene.lights.intensity) = (70.0, 0.25);
        scene.lights.tint = [0.5, 1.0, 0.0];
        scene.lights.added = vec![KEY, KEY];
        scene.lights.muted = vec![3];
    });
    let turned = PreparedScene::load(&Scene::read(&turned).expect("valid")).expect("a scene");
    assert_eq!(turned.lights[2], KEY.light());
    assert_eq!(turned.lights[3].rgb, [0.0; 3]);
    assert_ne!(turned.lights[0], by_scene.lights[0]);

    // Numbers beyond the added ones are refused by name.
    let missing = scene(folder.path(), |scene| {
        scene.lights.added = vec![KEY];
        scene.lights.solo = vec![3];
    });
    let error = PreparedScene::load(&Scene::read(&missing).expect("valid")).expect_err("missing");
    assert!(error.to_string().contains("lights.solo"), "{error}");
}

#[test]
fn lights_are_added_moved_dimmed_and_taken_away_as_edits() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut edited = viewer(folder.path(), |_| ());
    let start = finished(&mut edited);
    edited
        .edit("Add light", |scene| scene.lights.added.push(KEY))
        .expect("valid");
    edited.commit();
    let added = finished(&mut edited);
    assert!(added != start);
    let moved = AddedLight {
        azimuth_deg: 120.0,
        ..KEY
    };
    edited
        .edit("Move light", |scene| scene.lights.added = vec![moved])
        .expect("valid");
    edited.commit();
    assert!(finished(&mut edited) != added);
    let dimmed = AddedLight {
        intensity: 0.5,
        ..moved
    };
    edited
        .edit("Intensity", |scene| scene.lights.added = vec![dimmed])
        .expect("valid");
    edited.commit();
    // As a scene that was opened so.
    let other = tempfile::tempdir().expect("a folder");
    let mut opened = viewer(other.path(), |scene| scene.lights.added = vec![dimmed]);
    assert!(finished(&mut edited) == finished(&mut opened));
    for _ in 0..3 {
        edited.undo().expect("drawn").expect("a step");
    }
    assert!(finished(&mut edited) == start);
}

#[test]
fn parts_of_the_light_add_up_to_the_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scene(folder.path(), |scene| {
        scene.render.background = Background::None;
        scene.lights.added = vec![KEY];
    });
    let scene = PreparedScene::load(&Scene::read(&path).expect("valid")).expect("a scene");
    let picture = drawn(scene.clone());
    let part = |layer: LightLayer| layer.draw(scene.clone(), SIZE).expect("drawn");
    let terms = [Scattering::Single, Scattering::Global, Scattering::Local];
    let terms = terms.map(LightLayer::Term).map(part);
    let modes = Lobe::ALL.map(LightLayer::Mode).map(part);
    let lights = [0, 1, 2].map(LightLayer::Light).map(part);
    let multiple = part(LightLayer::Multiple);
    let local = terms[2].clone();
    for (name, parts) in [
        ("terms", terms.to_vec()),
        ("lights", lights.to_vec()),
        ("modes and local", [&modes[..], &[local]].concat()),
        ("single and multiple", vec![terms[0].clone(), multiple]),
    ] {
        let error = difference(&picture, &parts);
        println!("{name}: {error:.1e}");
        assert!(error < 2e-3, "{name}: {error}");
        // Without one of them they do not.
        let error = difference(&picture, &parts[1..]);
        assert!(error > 0.1, "{name}: {error}");
    }
    // A mode that the scene does not draw adds nothing.
    let of_r = of_r_alone(folder.path());
    let of_tt = LightLayer::Mode(Lobe::Tt).draw(of_r.clone(), SIZE);
    let of_tt = of_tt.expect("drawn");
    assert!(of_tt.rgba.iter().all(|rgba| *rgba == [0.0; 4]));
    let single = LightLayer::Term(Scattering::Single).draw(of_r, SIZE);
    assert!(difference(&single.expect("drawn"), &[]) > 0.1);
}

/// The scene with R alone.
fn of_r_alone(folder: &std::path::Path) -> PreparedScene {
    let path = scene(folder, |scene| scene.hair.modes = vec![Lobe::R]);
    PreparedScene::load(&Scene::read(&path).expect("valid")).expect("a scene")
}

#[test]
fn transmittance_is_that_of_the_lights_that_are_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    // Eight curtains, one behind the other.
    let mut groom = Groom::default();
    groom.strand_offsets.push(0);
    for layer in 0..8 {
        let one = curtain(80, 5, 0.05, 2.0);
        let first = groom.points.len() as u32;
        let behind = one
            .points
            .iter()
            .map(|&[x, y, z]| [x, y, z - 0.25 * layer as f32]);
        groom.points.extend(behind);
        let offsets = one.strand_offsets[1..].iter().map(|offset| first + offset);
        groom.strand_offsets.extend(offsets);
    }
    let lights = vec![light([0.0, 0.0, 1.0], 0.3, [1.0; 3])];
    let path = write_small_scene(folder.path(), &groom, lights, |scene| {
        scene.hair.diameter_cm = Some(0.06);
    });
    let scene = PreparedScene::load(&Scene::read(&path).expect("valid")).expect("a scene");
    let mean = |lights: Vec<strandlight_formats::SrbfLight>| {
        let mut scene = scene.clone();
        scene.lights = lights;
        let shares = transmittance_seen(&scene, &scene.camera, SIZE).expect("in range");
        assert!(shares.iter().any(Option::is_none), "hair fills the picture");
        let seen: Vec<f32> = shares.into_iter().flatten().collect();
        assert!(seen.iter().all(|share| (0.0..=1.0).contains(share)));
        seen.iter().sum::<f32>() / seen.len() as f32
    };
    let towards = (scene.camera.eye - scene.camera.target).normalize();
    let front = light(towards.to_array(), 0.3, [1.0; 3]);
    let back = light((-towards).to_array(), 0.3, [1.0; 3]);
    let off = light(towards.to_array(), 0.3, [0.0; 3]);
    let [of_front, of_back] = [front, back].map(|light| mean(vec![light]));
    println!("from the front {of_front:.3}, from the back {of_back:.3}");
    assert!(of_front > of_back + 0.3, "{of_front} {of_back}");
    // By power: as much from both sides is half of each, and what is off counts nothing.
    let both = mean(vec![front, back]);
    assert!((both - 0.5 * (of_front + of_back)).abs() < 0.01, "{both}");
    assert_eq!(mean(vec![front, off]), of_front);
    assert_eq!(mean(vec![off]), 0.0);
}

#[test]
fn parts_of_the_light_are_shown_and_follow_edits() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut viewer = viewer(folder.path(), |_| ());
    let picture = finished(&mut viewer);
    let mut shown: Vec<Vec<[u8; 4]>> = Vec::new();
    let of_light = Inspection::Layer(LightLayer::Light(1));
    for inspection in Inspection::of_arriving_light().chain([of_light]) {
        viewer.set_inspection(Some(inspection));
        let pixels = finished(&mut viewer);
        let name = inspection.name();
        assert!(pixels != picture && !shown.contains(&pixels), "{name}");
        let is_readable = inspection != Inspection::Transmittance;
        assert_eq!(
            viewer.readout([20.0, 15.0]).is_some(),
            is_readable,
            "{name}"
        );
        shown.push(pixels);
        assert!(viewer.next_update().is_none(), "{name}");
    }
    // Light 1 alone, brighter and then off.
    let of_one = finished(&mut viewer);
    viewer
        .edit("Exposure", |scene| scene.render.exposure = 1.0)
        .expect("valid");
    viewer.commit();
    assert!(finished(&mut viewer) != of_one);
    viewer.undo().expect("drawn");
    assert!(finished(&mut viewer) == of_one);
    viewer
        .edit("Mute", |scene| scene.lights.muted = vec![1])
        .expect("valid");
    let dark = finished(&mut viewer);
    assert!(dark.iter().all(|&[r, g, b, _]| [r, g, b] == [0; 3]));
    viewer.undo().expect("drawn");
    viewer.set_inspection(None);
    assert!(finished(&mut viewer) == picture);
}

#[test]
fn hair_without_any_light_is_black() {
    let folder = tempfile::tempdir().expect("a folder");
    for (eccentricity, roughness) in [(1.0, 0.0), (1.3, 0.0), (1.0, 0.3)] {
        let path = scene(folder.path(), |scene| {
            scene.hair.eccentricity = eccentricity;
            scene.variation.roughness_strand = roughness;
            scene.lights.intensity = 0.0;
            scene.render.background = Background::Color([0.0; 3]);
        });
        let prepared = Session::open(&path).expect("a scene").prepared();
        let prepared = prepared.expect("a scene");
        for renderer in [CpuRenderer::new, CpuRenderer::by_samples] {
            let mut renderer = renderer(prepared.clone());
            let (picture, _) = renderer.render(SIZE, 4, &|_| ()).expect("a picture");
            let is_black = |rgba: &[f32; 4]| rgba[..3] == [0.0; 3];
            assert!(
                picture.rgba.iter().all(is_black),
                "{eccentricity} {roughness}"
            );
            assert!(picture.rgba.iter().any(|rgba| rgba[3] > 0.0));
        }
    }
}
