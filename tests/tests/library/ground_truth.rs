//! A viewer whose finished picture goes on to ground truth.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use strandlight_cpu::levels;
use strandlight_formats::{AddedLight, Background, Scattering};
use strandlight_images::Map;
use strandlight_reference::converge::Convergence;
use strandlight_reference::environment::LightSampler;
use strandlight_reference::{Environment, TracedScene};
use strandlight_runtime::{
    BackendChoice, Chosen, CpuReason, Display, Inspection, Session, TruthProgress, Viewer,
};
use strandlight_scene::{Backend, Picture, PreparedScene};
use strandlight_tests::panoramas::striped_map;
use strandlight_tests::scenes::{curtain, light, write_small_scene};
use strandlight_tests::{assert_done, strandlight};

const SIZE: [u32; 2] = [40, 30];

fn viewer(folder: &std::path::Path) -> Viewer {
    let lights = vec![
        light([-0.6, 0.0, 0.8], 0.2, [20.0, 8.0, 2.0]),
        light([0.6, 0.0, -0.8], 0.5, [1.0, 2.0, 4.0]),
    ];
    let path = write_small_scene(folder, &curtain(80, 5, 0.05, 2.0), lights, |scene| {
        scene.hair.diameter_cm = Some(0.06);
        scene.render.size = SIZE;
        scene.render.background = Background::Color([0.1, 0.2, 0.3]);
    });
    let session = Session::open(&path).expect("a scene");
    let chosen = Chosen::Cpu(CpuReason::Asked);
    Viewer::choose(BackendChoice::Cpu, chosen, session).expect("the CPU draws it")
}

/// The pixels that are shown once the picture is finished.
fn finished(viewer: &mut Viewer) -> Vec<[u8; 4]> {
    while !viewer
        .advance(Duration::from_millis(5))
        .expect("drawn")
        .is_done
    {}
    shown(viewer)
}

fn shown(viewer: &Viewer) -> Vec<[u8; 4]> {
    match viewer.display() {
        Display::Pixels(display) => {
            assert_eq!(display.size, SIZE);
            display.pixels.to_vec()
        }
        Display::Texture(_) => panic!("the CPU has no textures"),
    }
}

fn version(viewer: &Viewer) -> u64 {
    match viewer.display() {
        Display::Pixels(display) => display.version,
        Display::Texture(_) => panic!("the CPU has no textures"),
    }
}

/// Waits for `n` samples.
fn traced(viewer: &mut Viewer, n: u32) -> TruthProgress {
    let start = Instant::now();
    loop {
        let progress = viewer.advance(Duration::from_millis(5)).expect("drawn");
        let truth = viewer.ground_truth().expect("wanted").expect("traced");
        if truth.samples >= n {
            return truth;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{truth:?}");
        let is_more = !progress.is_done || viewer.next_update().is_some();
        assert!(is_more, "nothing more comes");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn finished_pictures_go_on_to_ground_truth_and_edits_go_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut viewer = viewer(folder.path());
    let fast = finished(&mut viewer);
    assert!(viewer.ground_truth().is_none() && viewer.next_update().is_none());

    viewer.set_ground_truth(true);
    let truth = traced(&mut viewer, 8);
    let of_fast = truth.relative_error_of_fast.expect("more than noise");
    assert!(truth.relative_error < of_fast);
    // What is shown are the same samples over the same fast picture, however they were cut up.
    let mut scene = viewer.prepared().clone();
    let mut of_fast = strandlight_cpu::CpuRenderer::new(scene.clone());
    of_fast.set_grade(scene.exposure, scene.display.clone(), Background::None);
    let (picture, _) = of_fast.render(SIZE, 1, &|_| ()).expect("drawn");
    let environment = Environment::Lights(LightSampler::new(&scene.lights));
    let expected = |scene: &PreparedScene, picture: &Picture, samples: u32, exposure: f32| {
        let traced = TracedScene::new(scene).expect("round fibres");
        let mut convergence = Convergence::new(picture.clone(), scene, 0);
        convergence.trace(scene, &traced.tracer(&environment), samples);
        let mut pixels = Vec::new();
        let grade = (exposure.exp2(), &scene.display);
        levels(&convergence.converged().picture, grade, &mut pixels);
        pixels
    };
    assert!(shown(&viewer) == expected(&scene, &picture, truth.samples, 0.0));
    assert!(shown(&viewer) != fast);

    // Another exposure is seen at once and traces nothing again.
    let brighter = viewer.edit("Exposure", |scene| scene.render.exposure = 1.0);
    brighter.expect("valid");
    let after = traced(&mut viewer, truth.samples);
    assert!(shown(&viewer) == expected(&scene, &picture, after.samples, 1.0));
    viewer
        .edit("Exposure", |scene| scene.render.exposure = 0.0)
        .expect("valid");

    // Another view has a fast picture first.
    let mut view = viewer.prepared().camera;
    view.eye.x += 1.0;
    viewer.set_view(view).expect("a view");
    let truth = viewer.ground_truth().expect("wanted").expect("traced");
    assert_eq!(truth.samples, 0);
    let turned = finished(&mut viewer);
    assert!(turned != fast);
    let truth = traced(&mut viewer, 4);
    scene.camera = view;
    of_fast.set_camera(view);
    let (picture, _) = of_fast.render(SIZE, 1, &|_| ()).expect("drawn");
    assert!(shown(&viewer) == expected(&scene, &picture, truth.samples, 0.0));
    // A part of the light goes to the truth of that part.
    viewer
        .edit("Single", |scene| {
            scene.render.scattering = Scattering::Single;
        })
        .expect("valid");
    let truth = traced(&mut viewer, 4);
    scene.set_scattering(Scattering::Single);
    of_fast.set_scattering(Scattering::Single);
    let (picture, _) = of_fast.render(SIZE, 1, &|_| ()).expect("drawn");
    assert!(shown(&viewer) == expected(&scene, &picture, truth.samples, 0.0));
    viewer.undo().expect("drawn");
    // And so has other hair.
    viewer
        .edit("Colour", |scene| scene.hair.sigma_a = [0.1, 0.5, 1.0])
        .expect("valid");
    let truth = viewer.ground_truth().expect("wanted").expect("traced");
    assert_eq!(truth.samples, 0);

    viewer.set_ground_truth(false);
    viewer.reset_view();
    viewer.undo().expect("drawn");
    assert!(finished(&mut viewer) == fast);
}

#[test]
fn inspections_are_of_the_picture_and_follow_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut viewer = viewer(folder.path());
    let picture = finished(&mut viewer);
    let mut versions = vec![version(&viewer)];
    for (inspection, name) in Inspection::ALL {
        viewer.set_inspection(Some(inspection));
        let pixels = finished(&mut viewer);
        if inspection != Inspection::Error {
            // Screens take up what has another version alone.
            assert!(!versions.contains(&version(&viewer)), "{name}");
            versions.push(version(&viewer));
        }
        if inspection == Inspection::Error {
            // Nothing tells it yet.
            assert!(pixels == picture, "{name}");
            continue;
        }
        assert!(pixels != picture, "{name}");
        let mut colors = pixels.clone();
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 1, "{name} shows nothing");
        assert_eq!(
            inspection.is_of_light(),
            viewer.readout([20.0, 15.0]).is_some()
        );
    }
    viewer.set_inspection(Some(Inspection::FalseColor));
    let colors = finished(&mut viewer);
    // Without hair there is the background: (0.1, 0.2, 0.3) is 0.047 stops above middle grey.
    let ([r, g, b, a], stops) = viewer.readout([0.5, 0.5]).expect("inspected");
    assert_eq!([r, g, b, a], [0.1, 0.2, 0.3, 1.0]);
    assert!((stops - 0.047).abs() < 0.001, "{stops}");
    assert!(viewer.readout([-1.0, 0.0]).is_none() && viewer.readout([40.0, 0.0]).is_none());
    viewer
        .edit("Exposure", |scene| scene.render.exposure = 2.0)
        .expect("valid");
    assert!(finished(&mut viewer) != colors);
    let (_, brighter) = viewer.readout([0.5, 0.5]).expect("inspected");
    assert!((brighter - stops - 2.0).abs() < 1e-4);
    viewer.undo().expect("drawn");
    assert!(finished(&mut viewer) == colors);
    // The error comes with ground truth.
    viewer.set_inspection(Some(Inspection::Error));
    viewer.set_ground_truth(true);
    traced(&mut viewer, 4);
    assert!(finished(&mut viewer) != picture);
    viewer.set_ground_truth(false);
    viewer.set_inspection(None);
    assert!(finished(&mut viewer) == picture);
}

#[test]
fn elliptic_hair_goes_to_its_truth() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut viewer = viewer(folder.path());
    viewer.set_ground_truth(true);
    for eccentricity in [1.2, 1.0] {
        viewer
            .edit("Eccentricity", |scene| {
                scene.hair.eccentricity = eccentricity
            })
            .expect("valid");
        traced(&mut viewer, 2);
    }
}

/// Is `strandlight`, which reads maps, in PATH? If not, `test` runs once more in a process where it is.
fn is_strandlight_in_path(test: &str) -> bool {
    const INNER: &str = "STRANDLIGHT_TEST_WITH_PATH";
    if std::env::var_os(INNER).is_some() {
        return true;
    }
    let program = strandlight();
    let folder = Path::new(program.get_program())
        .parent()
        .map(Path::to_owned);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = folder.into_iter().chain(std::env::split_paths(&path));
    let path = std::env::join_paths(path).expect("a list of folders");
    let mut again = Command::new(std::env::current_exe().expect("this program"));
    again.args(["--exact", test, "--nocapture"]);
    assert_done(again.env(INNER, "1").env("PATH", path));
    false
}

/// Waits for what is wrong.
fn fault(viewer: &mut Viewer) -> String {
    let start = Instant::now();
    loop {
        viewer.advance(Duration::from_millis(5)).expect("drawn");
        if let Some(Err(error)) = viewer.ground_truth() {
            return error.to_string();
        }
        assert!(start.elapsed() < Duration::from_secs(120), "nothing is");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn the_map_of_a_scene_is_its_light() {
    let name = "ground_truth::the_map_of_a_scene_is_its_light";
    if !is_strandlight_in_path(name) {
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("sky.hdr"), striped_map(64)).expect("written");
    std::fs::write(at("even.hdr"), striped_map(16)).expect("written");
    let mut viewer = viewer(folder.path());
    let lit = viewer.edit("Lights", |scene| {
        let lights = &mut scene.lights;
        lights.map = Some("sky.hdr".into());
        (lights.rotate_deg, lights.intensity, lights.tint) = (40.0, 2.0, [1.0, 0.5, 0.8]);
        lights.muted = vec![0];
        lights.added = vec![AddedLight::default()];
    });
    lit.expect("valid");
    viewer.set_ground_truth(true);
    let scene = |viewer: &Viewer| viewer.prepared().clone();
    let expected = |viewer: &Viewer, map: Option<&str>, samples: u32| {
        let scene = scene(viewer);
        // Shadow maps are planned for the lights as they are before they are muted or coloured.
        let (assets, section) = (viewer.session().assets(), &viewer.session().scene().lights);
        let mut planned = scene.clone();
        planned.lights = assets.planned_lights(section);
        let mut of_fast = strandlight_cpu::CpuRenderer::new(planned);
        let colors = assets.light_colors(section);
        of_fast.set_light_colors(&colors).expect("as many");
        of_fast.set_grade(scene.exposure, scene.display.clone(), Background::None);
        let (fast, _) = of_fast.render(SIZE, 1, &|_| ()).expect("drawn");
        let environment = match map.map(|map| Map::read(&at(map)).expect("a map")) {
            Some(map) => Environment::of_map(map.grid(), map.pixels(), section, &scene.lights),
            None => Environment::Lights(LightSampler::new(&scene.lights)),
        };
        let traced = TracedScene::new(&scene).expect("round fibres");
        let mut convergence = Convergence::new(fast, &scene, 0);
        convergence.trace(&scene, &traced.tracer(&environment), samples);
        let mut pixels = Vec::new();
        let grade = (scene.exposure.exp2(), &scene.display);
        levels(&convergence.converged().picture, grade, &mut pixels);
        pixels
    };
    let truth = traced(&mut viewer, 4);
    let of_map = expected(&viewer, Some("sky.hdr"), truth.samples);
    assert!(shown(&viewer) == of_map);
    assert!(of_map != expected(&viewer, None, truth.samples));

    // Another map, or none, begins anew; another exposure does not.
    let set_map = |viewer: &mut Viewer, map: Option<&str>| {
        let change = viewer.edit("Map", |scene| scene.lights.map = map.map(Into::into));
        assert_eq!(change.expect("valid").names(), ["label"]);
    };
    for map in [Some("even.hdr"), None, Some("sky.hdr")] {
        set_map(&mut viewer, map);
        viewer.advance(Duration::ZERO).expect("drawn");
        let truth = viewer.ground_truth().expect("wanted").expect("traced");
        assert_eq!(truth.samples, 0, "{map:?}");
        let truth = traced(&mut viewer, 2);
        assert!(
            shown(&viewer) == expected(&viewer, map, truth.samples),
            "{map:?}"
        );
    }
    // So does one that another program writes, once the scene is read again.
    std::fs::write(at("sky.hdr"), striped_map(32)).expect("written");
    viewer.save().expect("written");
    viewer.reload().expect("readable");
    let truth = traced(&mut viewer, 2);
    assert!(shown(&viewer) == expected(&viewer, Some("sky.hdr"), truth.samples));
    // The scene keeps it wherever it is saved, and what is traced goes on.
    let below = at("below");
    std::fs::create_dir(&below).expect("made");
    viewer.save_as(&below.join("b.toml")).expect("written");
    let named = viewer.session().scene().lights.map.clone();
    assert_eq!(named, Some(Path::new("..").join("sky.hdr")));
    viewer.advance(Duration::ZERO).expect("drawn");
    let after = viewer.ground_truth().expect("wanted").expect("traced");
    assert!(after.samples >= truth.samples, "{after:?}");

    // One that is missing or broken is named, and nothing else is traced in its place.
    std::fs::write(at("cut.hdr"), &striped_map(64)[..200]).expect("written");
    for (map, needle) in [
        ("gone.hdr", "gone.hdr: "),
        ("a.lights", "a light set"),
        ("cut.hdr", "cut.hdr: "),
    ] {
        set_map(&mut viewer, Some(&format!("../{map}")));
        let error = fault(&mut viewer);
        let start = format!("{}: lights.map: ", below.join("b.toml").display());
        assert!(error.starts_with(&start), "{error}");
        assert!(error.contains(needle) && error.contains(map), "{error}");
        assert!(viewer.next_update().is_none(), "nothing more comes");
    }
    viewer.undo().expect("drawn");
    viewer
        .edit("Map", |scene| scene.lights.map = None)
        .expect("valid");
    traced(&mut viewer, 2);
}
