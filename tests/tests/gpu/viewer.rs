//! A document and its picture together, without a window.

use std::path::Path;
use std::time::Duration;

use serde_json::json;
use strandlight_formats::{BakedFile, CameraSection, Groom, LightSet, Scene};
use strandlight_render::invalidation::{Inputs, STAGES, StageRule, stale_stages};
use strandlight_runtime::session::{EDITS, Edits};
use strandlight_runtime::{Session, Viewer};
use strandlight_scene::files::Files;
use strandlight_scene::paint::{Brush, Paint};
use strandlight_tests::render_common::{context, lights, wig};

const SIZE: [u32; 2] = [120, 80];

/// A scene of `n_strands` strands of `n_points` points in memory.
fn files(n_strands: usize, n_points: usize) -> Files {
    let (points, strand_offsets) = wig(n_strands, n_points);
    let groom = Groom {
        points,
        strand_offsets,
        ..Groom::default()
    };
    let lights = LightSet {
        lights: lights(),
        ..LightSet::default()
    };
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.hair.diameter_cm = Some(0.06);
    scene.camera = Some(CameraSection {
        position: [0.0, 0.0, 52.0],
        target: [0.0, -1.0, 0.0],
        up: [0.0, 1.0, 0.0],
        fov_deg: 40.0,
    });
    scene.render.size = SIZE;
    scene.render.samples = 4;
    scene.render.shadow_maps = 0;
    Files::in_memory([
        (
            "a.toml",
            scene.to_toml_string().expect("valid").into_bytes(),
        ),
        ("a.groom", groom.to_bytes().expect("valid")),
        ("a.lights", lights.to_bytes().expect("valid")),
    ])
}

fn open(files: &Files) -> Session {
    Session::open_in(Path::new("a.toml"), files.clone()).expect("a scene")
}

/// Drags a brush over the middle of the picture, and leaves it down.
fn drag(viewer: &mut Viewer) {
    viewer.press(Brush::default()).expect("a brush");
    for x in [40.0, 60.0, 80.0] {
        viewer.drag([x, 40.0]).expect("painted");
    }
}

#[test]
fn a_stroke_ends_before_the_scene_is_saved_or_read_again() {
    let files = files(150, 8);
    let mut viewer = Viewer::new(&context(), open(&files)).expect("a picture");
    drag(&mut viewer);
    let painted = viewer.session().paint().cloned();
    assert!(painted.as_ref().is_some_and(Paint::is_painted));
    assert!(!viewer.session().can_undo(), "the brush is still down");
    let saved = viewer.save().expect("written");
    assert_eq!(saved.files.len(), 2, "{saved:?}");
    assert!(viewer.session().can_undo() && !viewer.session().is_modified());
    assert_eq!(open(&files).paint(), painted.as_ref());
    // What is left of the drag is ignored.
    viewer.drag([60.0, 60.0]).expect("nothing");
    viewer.release().expect("nothing");
    assert!(!viewer.session().is_modified());

    viewer.undo().expect("shown");
    viewer.save().expect("written");
    drag(&mut viewer);
    viewer.reload().expect("readable");
    let is_painted = |viewer: &Viewer| viewer.session().paint().is_some_and(Paint::is_painted);
    assert!(!is_painted(&viewer));
    viewer.undo().expect("shown");
    assert_eq!(viewer.session().undo_label(), Some("paint"));
    assert!(is_painted(&viewer));
}

#[test]
fn looking_around_is_no_edit() {
    let files = files(150, 8);
    let mut viewer = Viewer::new(&context(), open(&files)).expect("a picture");
    let own = viewer.prepared().camera;
    let mut view = own;
    view.eye.x += 7.5;
    viewer.set_view(view).expect("a view");
    assert_eq!(viewer.prepared().camera, view);
    assert!(viewer.is_view_moved());
    let session = viewer.session();
    assert!(!session.is_modified() && !session.can_undo());
    // Edits, undo and reading again leave it; another device too.
    viewer
        .edit("eta", |scene| scene.hair.eta = 1.7)
        .expect("shown");
    viewer.undo().expect("shown");
    viewer.reload().expect("readable");
    viewer.set_context(&context()).expect("shown");
    assert_eq!(viewer.prepared().camera, view);
    viewer.save().expect("written");
    let saved = open(&files).camera();
    assert_eq!(saved.position[0], f64::from(own.eye.x));
    viewer.reset_view();
    assert_eq!(viewer.prepared().camera, own);
    assert!(!viewer.is_view_moved());

    // The view becomes the scene's camera when that is asked for, as an edit.
    viewer.set_view(view).expect("a view");
    let change = viewer.save_view().expect("shown");
    assert_eq!(change.names(), ["camera"]);
    assert!(viewer.session().is_modified() && !viewer.is_view_moved());
    assert_eq!(viewer.session().undo_label(), Some("Save view"));
    viewer.save().expect("written");
    assert_eq!(open(&files).camera().position[0], 7.5);
    viewer.undo().expect("shown");
    assert_eq!(viewer.prepared().camera, own);
    // A key of the camera is looked at.
    viewer.set_view(view).expect("a view");
    let fov = [("camera.fov_deg".to_owned(), 20.0.into())];
    viewer.set(&fov.into_iter().collect()).expect("shown");
    assert_eq!(viewer.prepared().camera.eye, own.eye);
    // What no scene could have is refused.
    view.eye.x = f32::NAN;
    assert!(viewer.set_view(view).is_err());
    assert_eq!(viewer.prepared().camera.eye, own.eye);
}

/// Each edit of a document runs the stages that its rule in `EDITS` names, and no others.
#[test]
fn edits_run_the_stages_of_their_rules() {
    let mut viewer = Viewer::new(&context(), open(&files(150, 8))).expect("a picture");
    finish(&mut viewer);
    let mut covered = Edits::empty();
    for (key, value) in [
        ("render.shadow_maps", json!(6)),
        ("hair.eta", json!(1.7)),
        ("hair.modes", json!(["R", "TRT"])),
        ("hair.density_back", json!(0.4)),
        ("render.scattering", json!("single")),
        ("render.exposure", json!(1.0)),
        ("camera.fov_deg", json!(30.0)),
        ("lights.intensity", json!(0.5)),
        ("lights.rotate_deg", json!(30.0)),
        ("proxy", json!([{"kind": "ground", "height": -20.0}])),
        ("hair.diameter_cm", json!(0.05)),
        ("variation.melanin_strand", json!(0.3)),
        ("variation.seed", json!(1)),
        ("hair.sigma_a", json!([0.3, 0.6, 1.2])),
        ("render.size", json!([100, 80])),
    ] {
        let values = [(key.to_owned(), value)].into_iter().collect();
        let change = viewer.set(&values).expect(key);
        finish(&mut viewer);
        let stale: Vec<_> = stale_stages(change.inputs()).collect();
        let report = viewer.report();
        for StageRule { name: stage, .. } in STAGES {
            // Windows draw without samples; another list has points whose shares of the line of sight are not known.
            let must_run = match stage {
                "project" => false,
                "shadow maps" if change.inputs() == Inputs::VIEW => true,
                _ => stale.contains(&stage),
            };
            assert_eq!(report.runs(stage) > 0, must_run, "{key}: {stage}");
        }
        covered |= change.edits;
    }
    // Paint and mask are edited by strokes; the others put the whole scene on the device again.
    let others = EDITS
        .iter()
        .filter(|rule| !covered.contains(rule.edit) && !rule.inputs.is_all());
    let others: Vec<_> = others.map(|rule| rule.name).collect();
    assert_eq!(others, ["samples", "paint", "mask"]);
}

fn finish(viewer: &mut Viewer) {
    let is_done = |viewer: &mut Viewer| {
        viewer
            .advance(Duration::from_secs(10))
            .expect("drawn")
            .is_done
    };
    while !is_done(viewer) {}
}

/// Milliseconds that a stroke takes on the processor, for people to read:
/// `cargo test -p strandlight-tests --test gpu viewer -- --ignored --nocapture`.
#[test]
#[ignore = "measures, and asserts nothing that could fail on another machine"]
fn a_stroke_over_10_000_strands_is_timed() {
    use std::time::Instant;

    let files = files(10_000, 48);
    let mut viewer = Viewer::new(&context(), open(&files)).expect("a picture");
    viewer.set_window([932, 664]).expect("a size");
    let timed = |what: &str, start: Instant| {
        println!("{what}: {:.2} ms", 1e3 * start.elapsed().as_secs_f64());
    };
    let start = Instant::now();
    let hit = viewer.pick([466.0, 300.0]);
    timed(
        &format!("first pick, which sorts all points ({hit:?})"),
        start,
    );
    let start = Instant::now();
    for x in 0..100_u8 {
        viewer.pick([300.0 + 3.0 * f32::from(x), 300.0]);
    }
    timed("100 picks", start);
    for round in ["first stroke", "second stroke"] {
        let start = Instant::now();
        viewer.press(Brush::default()).expect("a brush");
        timed(&format!("{round}: press"), start);
        for x in 0..8_u8 {
            let start = Instant::now();
            viewer
                .drag([300.0 + 40.0 * f32::from(x), 300.0])
                .expect("painted");
            timed(&format!("{round}: drag by 40 px"), start);
        }
        let start = Instant::now();
        viewer.release().expect("painted");
        timed(&format!("{round}: release"), start);
        let start = Instant::now();
        viewer.undo().expect("shown");
        timed(&format!("{round}: undo"), start);
    }
}
