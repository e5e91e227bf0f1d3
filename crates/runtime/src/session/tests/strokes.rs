//! Strokes, and the hair that they leave.

use super::*;

#[test]
fn strokes_are_steps_between_others() {
    let mut session = session();
    assert!(session.paint().is_none(), "nothing painted, nothing kept");
    let none = Paint::unpainted(4);
    assert!(session.stroke(Stroke::default()).is_empty());
    assert!(session.paint().is_none() && !session.can_undo());
    let change = session.stroke(dyed(1..3, &none));
    assert_eq!(change, Change::painted(1..3));
    assert_eq!(weights(&session), [0.0, 1.0, 1.0, 0.0]);
    edit(&mut session, "paint", |s| s.hair.eta = 1.6);
    edit(&mut session, "rotate", |s| s.lights.rotate_deg = 10.0);
    let paint = session.paint().cloned().expect("painted");
    session.stroke(dyed(3..4, &paint));
    assert_eq!(weights(&session), [0.0, 1.0, 1.0, 1.0]);
    assert_eq!(session.undo(), Some(Change::painted(3..4)));
    assert!(session.undo().expect("a step").has(Edits::LIGHTS));
    assert_eq!(
        weights(&session),
        [0.0, 1.0, 1.0, 0.0],
        "lights are not paint"
    );
    assert!(session.undo().expect("a step").has(Edits::HAIR));
    assert!(session.is_modified());
    assert_eq!(session.undo(), Some(Change::painted(1..3)));
    assert_eq!(weights(&session), [0.0; 4]);
    assert!(!session.is_modified());
    for _ in 0..4 {
        assert!(session.redo().is_some());
    }
    assert_eq!(weights(&session), [0.0, 1.0, 1.0, 1.0]);
    // Another groom has its own paint, and the first one gets its back.
    edit(&mut session, "groom", |s| {
        s.groom.file = "taller.groom".into()
    });
    assert!(session.paint().is_none());
    session.undo();
    assert_eq!(weights(&session), [0.0, 1.0, 1.0, 1.0]);
}

#[test]
fn painted_hair_is_saved_beside_its_scene() {
    let mut session = session();
    session
        .files()
        .write(Path::new("/s/a-painted.groom"), b"another program's")
        .expect("written");
    let none = Paint::unpainted(4);
    session.stroke(dyed(0..2, &none));
    edit(&mut session, "eta", |s| s.hair.eta = 1.6);
    let saved = session.save().expect("written");
    let groom = Path::new("/s/a-painted-2.groom");
    assert_eq!(
        saved.files,
        [groom, Path::new("/s/a.toml")],
        "no other file is replaced"
    );
    assert_eq!(session.scene().groom.file, Path::new("a-painted-2.groom"));
    let again = Session::open_in(Path::new("/s/a.toml"), session.files().clone());
    let mut again = again.expect("readable");
    assert_eq!(again.scene(), session.scene());
    assert_eq!(again.paint(), session.paint());
    // The next saves, of this session and of one that reads the file, write the same one.
    session.undo();
    assert_eq!(session.scene().groom.file, Path::new("a-painted-2.groom"));
    session.undo();
    assert!(session.is_modified());
    assert_eq!(
        session.save().expect("written").files,
        [groom, Path::new("/s/a.toml")]
    );
    let original = session
        .files()
        .groom(Path::new("/s/a.groom"))
        .expect("as it was");
    assert!(original.attributes.is_empty());
    let paint = again.paint().cloned().expect("painted");
    again.stroke(dyed(2..3, &paint));
    assert_eq!(again.save().expect("written").files[0], groom);
    // An edit of the scene alone leaves the groom.
    edit(&mut again, "eta", |s| s.hair.eta = 1.7);
    assert_eq!(
        again.save().expect("written").files,
        [Path::new("/s/a.toml")]
    );
    // A copy has a groom of its own, and the person may name it.
    let paint = again.paint().cloned().expect("painted");
    again.stroke(dyed(3..4, &paint));
    let saved = again.save_as(Path::new("/s/b.toml")).expect("written");
    assert_eq!(saved.files[0], Path::new("/s/b-painted.groom"));
    let saved = again.save_with_groom(Path::new("/t/c.toml"), Path::new("/s/c.groom"));
    assert_eq!(saved.expect("written").files[0], Path::new("/s/c.groom"));
    assert_eq!(again.scene().groom.file, Path::new("../s/c.groom"));
    assert!(!again.is_modified());
    let copy = Session::open_in(Path::new("/t/c.toml"), again.files().clone());
    assert_eq!(weights(&copy.expect("readable")), [1.0; 4]);
}

#[test]
fn the_painted_groom_of_another_scene_stays() {
    let mut first = session();
    first.stroke(dyed(0..2, &Paint::unpainted(4)));
    first.save().expect("written");
    let files = first.files().clone();
    let painted = Path::new("/s/a-painted.groom");
    let before = files.read(painted, 1 << 20).expect("there");
    // One that takes it up, and one that is a copy of the first.
    files
        .write(Path::new("/s/b.toml"), SCENE.as_bytes())
        .expect("written");
    let copy = files.read(Path::new("/s/a.toml"), 1 << 20).expect("there");
    files.write(Path::new("/s/c.toml"), &copy).expect("written");
    for (scene, expected) in [
        ("/s/b.toml", "/s/b-painted.groom"),
        ("/s/c.toml", "/s/c-painted.groom"),
    ] {
        let mut other = Session::open_in(Path::new(scene), files.clone()).expect("readable");
        edit(&mut other, "groom", |s| {
            s.groom.file = "a-painted.groom".into()
        });
        let paint = other.paint().cloned().expect("painted");
        other.stroke(dyed(2..3, &paint));
        let saved = other.save().expect("written");
        assert_eq!(saved.files[0], Path::new(expected));
        // This one is its own.
        let paint = other.paint().cloned().expect("painted");
        other.stroke(dyed(3..4, &paint));
        assert_eq!(other.save().expect("written").files[0], Path::new(expected));
    }
    assert_eq!(files.read(painted, 1 << 20).expect("there"), before);
    // Nor by the session that has made it, of a scene that it saves elsewhere.
    first.save_as(Path::new("/s/d.toml")).expect("written");
    let paint = first.paint().cloned().expect("painted");
    first.stroke(dyed(2..3, &paint));
    let saved = first.save().expect("written");
    assert_eq!(saved.files[0], Path::new("/s/d-painted.groom"));
    assert_eq!(files.read(painted, 1 << 20).expect("there"), before);
}

#[test]
fn strokes_that_were_saved_and_undone_are_changes_across_another_groom() {
    let mut session = session();
    session.stroke(dyed(0..2, &Paint::unpainted(4)));
    edit(&mut session, "groom", |s| {
        s.groom.file = "taller.groom".into()
    });
    session.undo();
    session.save().expect("written");
    session.redo();
    session.undo();
    assert!(!session.is_modified());
    // The file has the stroke that is gone now.
    session.undo();
    assert!(session.is_modified());
    session.save().expect("written");
    let again = Session::open_in(session.path(), session.files().clone());
    assert!(
        !again
            .expect("readable")
            .paint()
            .is_some_and(Paint::is_painted)
    );
}

/// Read again, the same file is another groom in memory.
#[test]
fn strokes_that_were_saved_and_undone_are_changes_across_the_same_groom() {
    let mut session = session();
    session.stroke(dyed(0..2, &Paint::unpainted(4)));
    for groom in ["taller.groom", "a.groom"] {
        edit(&mut session, groom, |s| s.groom.file = groom.into());
        session.commit();
    }
    session.stroke(dyed(2..3, &Paint::unpainted(4)));
    session.save().expect("written");
    // Before the first stroke.
    while session.undo().is_some() {}
    assert!(session.is_modified());
    session.save().expect("written");
    let again = Session::open_in(session.path(), session.files().clone()).expect("readable");
    assert!(!again.paint().is_some_and(Paint::is_painted));
}
