//! Masks: what brushes leave alone.

use super::*;

/// Protects `points` from brushes.
fn protected(points: std::ops::Range<u32>) -> Stroke {
    Stroke {
        masked: points.map(|ix| (ix, 0.0, 1.0)).collect(),
        ..Stroke::default()
    }
}

fn mask(session: &Session) -> Vec<f32> {
    session
        .mask()
        .map_or(Vec::new(), |mask| mask.points.clone())
}

#[test]
fn mask_strokes_are_steps_and_no_paint() {
    let mut session = session();
    assert!(session.mask().is_none() && !session.is_masked());
    let change = session.stroke(protected(1..3));
    assert_eq!(change.edits, Edits::MASK);
    assert_eq!(change.names(), ["mask"]);
    assert_eq!(change.paint, None);
    assert!(change.inputs().is_empty(), "no picture shows a mask");
    assert_eq!(session.undo_label(), Some("mask"));
    assert_eq!(mask(&session), [0.0, 1.0, 1.0, 0.0]);
    assert!(session.is_masked() && session.is_modified());
    assert!(session.paint().is_none() && session.own_paint().is_none());
    assert!(!session.is_repainted());
    assert!(session.prepared().expect("drawable").paint().is_none());

    // Paint and mask have steps of their own.
    session.stroke(dyed(0..1, &Paint::unpainted(4)));
    assert_eq!(session.undo_label(), Some("paint"));
    assert_eq!(session.undo(), Some(Change::painted(0..1)));
    assert_eq!(mask(&session), [0.0, 1.0, 1.0, 0.0]);
    assert_eq!(session.undo().map(|change| change.edits), Some(Edits::MASK));
    assert!(!session.is_masked() && !session.is_modified());
    assert_eq!(session.redo().map(|change| change.edits), Some(Edits::MASK));
    assert_eq!(mask(&session), [0.0, 1.0, 1.0, 0.0]);
    assert!(session.redo().is_some());
    assert_eq!(weights(&session), [1.0, 0.0, 0.0, 0.0]);
    // Another groom has its own, and the first one gets its back.
    edit(&mut session, "groom", |s| {
        s.groom.file = "taller.groom".into()
    });
    assert!(session.mask().is_none());
    session.undo();
    assert_eq!(mask(&session), [0.0, 1.0, 1.0, 0.0]);
    edit(&mut session, "rotate", |s| s.lights.rotate_deg = 10.0);
    session.undo();
    assert_eq!(mask(&session), [0.0, 1.0, 1.0, 0.0]);
}

#[test]
fn masks_are_saved_with_the_groom() {
    let mut session = session();
    session.stroke(protected(2..4));
    let saved = session.save().expect("written");
    let groom = Path::new("/s/a-painted.groom");
    assert_eq!(saved.files, [groom, Path::new("/s/a.toml")]);
    assert!(!session.is_modified());
    let file = session.files().groom(groom).expect("readable");
    let names: Vec<&str> = file.attributes.iter().map(|it| &*it.name).collect();
    assert_eq!(names, ["mask"]);
    let again = Session::open_in(Path::new("/s/a.toml"), session.files().clone());
    let mut again = again.expect("readable");
    assert_eq!(mask(&again), [0.0, 0.0, 1.0, 1.0]);
    assert!(again.paint().is_none() && !again.is_modified());
    assert!(again.prepared().expect("drawable").paint().is_none());
    // What the file has can be taken away, and is gone from it then.
    again.stroke(Stroke {
        masked: vec![(2, 1.0, 0.0), (3, 1.0, 0.0)],
        ..Stroke::default()
    });
    assert_eq!(again.save().expect("written").files[0], groom);
    let file = again.files().groom(groom).expect("readable");
    assert!(file.attributes.is_empty());
    // Undoing what was saved is a change again.
    again.undo();
    assert!(again.is_modified() && again.is_masked());
}

#[test]
fn strokes_that_paint_nothing_leave_hair_bare() {
    let mut session = session();
    session.stroke(protected(0..4));
    session.paint_mut();
    assert!(session.stroke(Stroke::default()).is_empty());
    assert!(session.paint().is_none());
    session.stroke(dyed(0..1, &Paint::unpainted(4)));
    assert!(session.stroke(Stroke::default()).is_empty());
    assert_eq!(weights(&session), [1.0, 0.0, 0.0, 0.0]);
}
