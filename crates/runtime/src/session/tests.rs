//! The document without a device.

mod assets;
mod changes;
mod masks;
mod recovery;
pub(crate) mod saving;
mod strokes;

use serde_json::{Map, Value, json};
use strandlight_formats::{
    AddedLight, Background, BakedFile, CameraSection, Groom, LightAdjust, LightSet, LutInput,
    Melanin, MotionSection, Panorama, ProxySection, Scene, SrbfLight, TablesSection,
    VariationSection, WindSection,
};

use super::*;
use strandlight_data::DEFAULT_TABLES;
use strandlight_scene::paint::PaintedPoint;

fn groom(height: f32) -> Vec<u8> {
    let groom = Groom {
        points: vec![
            [0.0; 3],
            [0.0, height, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, height, 0.0],
        ],
        strand_offsets: vec![0, 2, 4],
        ..Groom::default()
    };
    groom.to_bytes().expect("valid")
}

fn lights() -> Vec<u8> {
    let light = |direction, rgb| SrbfLight {
        direction,
        lambda: 0.5,
        rgb,
    };
    let set = LightSet {
        lights: vec![
            light([0.0, 1.0, 0.0], [1.0; 3]),
            light([0.0, 0.0, 1.0], [2.0; 3]),
        ],
        ..LightSet::default()
    };
    set.to_bytes().expect("valid")
}

const SCENE: &str = "version = 1\n[groom]\nfile = 'a.groom'\n[lights]\nfile = '../b.lights'\n";

fn files() -> Files {
    Files::in_memory([
        ("/s/a.toml", SCENE.as_bytes().to_vec()),
        ("/s/a.groom", groom(1.0)),
        ("/s/taller.groom", groom(2.0)),
        ("/b.lights", lights()),
        ("/s/other.tables", DEFAULT_TABLES.to_vec()),
        ("/s/dark.cube", b"LUT_1D_SIZE 2\n0 0 0\n.5 .5 .5\n".to_vec()),
        (
            "/s/light.cube",
            b"LUT_1D_SIZE 2\n.5 .5 .5\n1 1 1\n".to_vec(),
        ),
        ("/s/bad.cube", b"LUT_1D_SIZE 2\n0 0 0\n0 nan 0\n".to_vec()),
    ])
}

pub(crate) fn session() -> Session {
    match Session::open_in(Path::new("/s/a.toml"), files()) {
        Ok(session) => session,
        Err(error) => panic!("{error}"),
    }
}

fn edit(session: &mut Session, label: &str, change: impl FnOnce(&mut Scene)) -> Change {
    session.edit(label, change).expect("valid")
}

#[test]
fn steps_are_undone_and_done_again() {
    let mut session = session();
    let start = session.scene().clone();
    assert!(!session.can_undo() && !session.is_modified());
    // A drag is one step.
    for step in 1..=10 {
        edit(&mut session, "eta", |s| {
            s.hair.eta = 1.5 + 0.01 * f64::from(step)
        });
    }
    edit(&mut session, "exposure", |s| s.render.exposure = 1.0);
    session.commit();
    edit(&mut session, "exposure", |s| s.render.exposure = 2.0);
    let end = session.scene().clone();
    assert_eq!(session.undo_label(), Some("exposure"));
    assert_eq!(session.undo().expect("a step").names(), ["grade"]);
    assert_eq!(session.scene().render.exposure, 1.0);
    assert_eq!(session.undo().expect("a step").names(), ["grade"]);
    assert_eq!(
        (session.undo_label(), session.redo_label()),
        (Some("eta"), Some("exposure"))
    );
    assert_eq!(session.undo().expect("a step").names(), ["hair"]);
    assert!(session.undo().is_none());
    assert_eq!(session.scene(), &start);
    assert!(!session.is_modified());
    for _ in 0..3 {
        assert!(session.redo().is_some());
    }
    assert!(session.redo().is_none());
    assert_eq!(session.scene(), &end);
    assert!(session.is_modified());
    // Another edit forgets what could be done again; the same label after an undo is a new step.
    session.undo();
    edit(&mut session, "exposure", |s| s.render.exposure = 3.0);
    assert!(!session.can_redo());
    session.undo();
    assert_eq!(session.scene().render.exposure, 1.0);
    // A drag that ends where it began is no step.
    session.commit();
    let label = session.undo_label().map(str::to_owned);
    edit(&mut session, "back", |s| s.hair.eta = 2.0);
    edit(&mut session, "back", |s| s.hair.eta = 1.6);
    assert_eq!(session.undo_label().map(str::to_owned), label);
}

#[test]
fn a_drag_that_passes_its_start_is_a_step_of_its_own() {
    let mut session = session();
    edit(&mut session, "eta", |s| s.hair.eta = 1.6);
    session.commit();
    for eta in [1.7, 1.6, 1.8] {
        edit(&mut session, "eta", |s| s.hair.eta = eta);
    }
    session.commit();
    session.undo();
    assert_eq!(session.scene().hair.eta, 1.6);
    session.undo();
    assert_eq!(session.scene().hair.eta, 1.55);
}

#[test]
fn history_is_bounded() {
    let mut session = session();
    for step in 0..MAX_STEPS + 20 {
        edit(&mut session, "size", |s| {
            s.render.size = [step as u32 % 1000 + 1, 10]
        });
        session.commit();
    }
    let mut n = 0;
    while session.undo().is_some() {
        n += 1;
    }
    assert_eq!(n, MAX_STEPS);
    assert_eq!(session.scene().render.size, [20, 10]);
}

#[test]
fn refused_edits_change_nothing() {
    let mut session = session();
    let before = session.scene().clone();
    for (key, value, needle) in [
        ("hair.eta", json!(9), "hair.eta"),
        ("groom.file", json!("none.groom"), "none.groom"),
        ("lights.file", json!("a.groom"), "a.groom"),
        ("tables", json!({"file": "a.groom"}), "a.groom"),
        ("lights.muted", json!([2]), "lights.muted"),
        ("render.lut", json!("none.cube"), "render.lut: "),
        (
            "render.lut",
            json!("bad.cube"),
            "bad.cube:3: row is 0 nan 0",
        ),
        ("render.size", json!([16_384, 16_384]), "render.size"),
    ] {
        let values: Map<String, Value> = [(key.to_owned(), value)].into_iter().collect();
        let error = session.set(&values).expect_err(key).to_string();
        assert!(error.contains(needle), "{key}: {error}");
        assert_eq!(session.scene(), &before);
        assert!(!session.can_undo());
    }
    // Of several keys all are set or none.
    let values = json!({"hair.eta": 1.6, "render.samples": 0});
    let Value::Object(values) = values else {
        panic!("an object")
    };
    assert!(session.set(&values).is_err());
    assert_eq!(session.scene(), &before);
}

fn dyed(points: std::ops::Range<u32>, before: &Paint) -> Stroke {
    let changed = points.map(|ix| {
        let before = before.points.get(ix as usize).copied().unwrap_or_default();
        let after = PaintedPoint {
            sigma_a: [0.5, 1.0, 2.0],
            weight: 1.0,
            ..before
        };
        (ix, before, after)
    });
    Stroke {
        changed: changed.collect(),
        ..Stroke::default()
    }
}

fn weights(session: &Session) -> Vec<f32> {
    let paint = session.paint().map_or(&[][..], |paint| &paint.points);
    paint.iter().map(|point| point.weight).collect()
}
