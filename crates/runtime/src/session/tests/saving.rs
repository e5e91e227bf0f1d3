//! What is saved, and what others save.

use super::*;

/// The files of [`SCENE`] in a folder, the lights beside the rest; `more` ends the scene.
pub(crate) fn files_in(folder: &Path, more: &str) {
    let scene = SCENE.replace("../b", "b") + more;
    for (name, bytes) in [
        ("a.toml", scene.into_bytes()),
        ("a.groom", groom(1.0)),
        ("taller.groom", groom(2.0)),
        ("b.lights", lights()),
    ] {
        std::fs::write(folder.join(name), bytes).expect("written");
    }
}

/// Makes a file so much younger than now.
pub(crate) fn touch(path: &Path, seconds: u64) {
    let file = std::fs::File::options().write(true).open(path);
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(seconds);
    file.expect("opened").set_modified(later).expect("set");
}

#[test]
fn saving_and_reopening_gives_the_same_document() {
    let mut session = session();
    edit(&mut session, "all", |s| {
        s.hair.melanin = Some(Melanin::default());
        s.lights.adjust_mut(1).intensity = 0.5;
        s.lights.muted = vec![0];
        s.render.exposure = 0.1;
    });
    assert!(session.is_modified());
    let saved = session.save().expect("written");
    assert_eq!(saved.files, [Path::new("/s/a.toml")]);
    assert!(!session.is_modified());
    let again = Session::open_in(Path::new("/s/a.toml"), session.files().clone());
    assert_eq!(again.expect("readable").scene(), session.scene());
    session.undo();
    assert!(session.is_modified());
    session.redo();
    assert!(!session.is_modified());
}

#[test]
fn a_scene_saved_elsewhere_names_the_same_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    for name in ["s", "t", "t/u"] {
        std::fs::create_dir(at.join(name)).expect("made");
    }
    std::fs::write(at.join("s/a.toml"), SCENE).expect("written");
    std::fs::write(at.join("s/a.groom"), groom(1.0)).expect("written");
    std::fs::write(at.join("b.lights"), lights()).expect("written");
    let mut session = Session::open(&at.join("s/a.toml")).expect("readable");
    edit(&mut session, "exposure", |s| s.render.exposure = 1.0);
    session.save_as(&at.join("t/u/c.toml")).expect("written");
    assert_eq!(session.scene().groom.file, Path::new("../../s/a.groom"));
    assert_eq!(session.scene().lights.file, Path::new("../../b.lights"));
    let again = Session::open(&at.join("t/u/c.toml")).expect("readable");
    assert_eq!(again.scene(), session.scene());
    // What can be undone moved along.
    let change = session.undo().expect("a step");
    assert_eq!(change.names(), ["grade"]);
    session.save().expect("written");
    assert!(Session::open(&at.join("t/u/c.toml")).is_ok());
    let original = std::fs::read_to_string(at.join("s/a.toml")).expect("read");
    assert_eq!(original, SCENE, "the old file is as it was");
    let error = session
        .save_as(&at.join("none/c.toml"))
        .expect_err("no folder");
    assert!(error.to_string().contains("c.toml"), "{error}");
    // A write by another program is noticed, and taken by reloading.
    assert!(!session.is_changed_on_disk());
    let path = at.join("t/u/c.toml");
    let text = std::fs::read_to_string(&path).expect("read");
    let text = format!("{text}\n[hair]\neta = 1.7 # thicker\n");
    std::fs::write(&path, text).expect("written");
    let later = std::time::SystemTime::now() + std::time::Duration::from_secs(5);
    let file = std::fs::File::options()
        .write(true)
        .open(&path)
        .expect("opened");
    file.set_modified(later).expect("set");
    assert!(session.is_changed_on_disk());
    assert!(session.reload().expect("readable").has(Edits::GEOMETRY));
    assert_eq!(session.scene().hair.eta, 1.7);
    assert!(!session.is_modified() && !session.is_changed_on_disk());
    // Saving keeps comments beside the values.
    edit(&mut session, "eta", |s| s.hair.eta = 1.65);
    session.save().expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    assert!(text.contains("eta = 1.65 # thicker"), "{text}");
    // Written again as it was, it is no change and no step.
    std::fs::write(&path, &text).expect("written");
    let later = later + std::time::Duration::from_secs(5);
    let file = std::fs::File::options().write(true).open(&path);
    file.expect("opened").set_modified(later).expect("set");
    assert!(session.is_changed_on_disk());
    assert!(session.reload().expect("readable").is_empty());
    assert!(!session.is_changed_on_disk());
    // Also of a file that is gone.
    std::fs::remove_file(&path).expect("removed");
    session.save().expect("written");
    assert_eq!(std::fs::read_to_string(&path).expect("read"), text);
    session.undo();
    session.undo();
    assert_eq!(session.scene().hair.eta, 1.55);
}

#[test]
fn what_others_wrote_is_known_before_it_is_replaced() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let scene = SCENE.replace("../b", "b");
    std::fs::write(at("a.toml"), &scene).expect("written");
    std::fs::write(at("other.toml"), &scene).expect("written");
    std::fs::write(at("a.groom"), groom(1.0)).expect("written");
    std::fs::write(at("b.lights"), lights()).expect("written");
    let mut session = Session::open(&at("a.toml")).expect("readable");
    edit(&mut session, "eta", |s| s.hair.eta = 1.7);
    // Another scene is another's; the own one, by whatever way, and a new name are not.
    assert!(session.replaces_other(&at("other.toml")));
    assert!(!session.replaces_other(&at("new.toml")));
    assert!(!session.replaces_other(&at("a.toml")));
    assert!(!session.replaces_other(&folder.path().join(".").join("a.toml")));
    // A scene is never written over what it is made of.
    for (name, needle) in [("a.groom", "groom"), ("b.lights", "light set")] {
        let before = std::fs::read(at(name)).expect("read");
        let error = session.save_as(&at(name)).expect_err(name).to_string();
        assert!(error.contains(name) && error.contains(needle), "{error}");
        assert_eq!(std::fs::read(at(name)).expect("read"), before);
    }
    // Files beside or below the scene are named from there.
    assert_eq!(session.path_in_scene(&at("c.groom")), Path::new("c.groom"));
    let above = folder.path().with_file_name("c.groom");
    assert_eq!(session.path_in_scene(&above), Path::new("../c.groom"));

    let touch = |name: &str, seconds: u64| {
        let file = std::fs::File::options().write(true).open(at(name));
        let later = std::time::SystemTime::now() + std::time::Duration::from_secs(seconds);
        file.expect("opened").set_modified(later).expect("set");
    };
    assert_eq!(session.conflict(), None);
    touch("b.lights", 5);
    assert!(session.is_changed_on_disk());
    assert_eq!(session.conflict(), None, "saving does not write the lights");
    touch("a.toml", 5);
    assert_eq!(session.conflict(), Some(&*at("a.toml")));
    session.keep_mine();
    assert_eq!(session.conflict(), None);
    touch("a.toml", 9);
    assert!(session.conflict().is_some(), "written once more");
    session.save().expect("written");
    assert_eq!(session.conflict(), None);
}

#[test]
fn values_laid_over_the_file_are_how_the_scene_was_opened() {
    let mut session = session();
    let path = Path::new("/s/a.toml");
    let values = |value: Value| match value {
        Value::Object(values) => values,
        other => panic!("{other}"),
    };
    let over = values(json!({ "render.samples": 64, "camera.fov_deg": 30.0 }));
    session.apply_cli_overrides(&over).expect("valid");
    assert!(!session.is_modified() && !session.can_undo());
    let wrong = values(json!({ "hair.eta": 9.0 }));
    assert!(session.apply_cli_overrides(&wrong).is_err());
    edit(&mut session, "eta", |s| s.hair.eta = 1.7);
    assert!(session.is_modified());
    session.undo();
    assert!(!session.is_modified());
    // They stay over a file that another program has written, until they are written themselves.
    let exposed = format!("{SCENE}[render]\nsamples = 8\nexposure = 1.5\n");
    let write = |session: &Session| session.files().write(path, exposed.as_bytes());
    write(&session).expect("written");
    session.reload().expect("readable");
    let render = &session.scene().render;
    assert_eq!((render.samples, render.exposure), (64, 1.5));
    assert!(!session.is_modified());
    session.save().expect("written");
    let saved = session.files().scene(path).expect("readable");
    assert_eq!(saved.render.samples, 64);
    assert_eq!(saved.camera.expect("written").fov_deg, 30.0);
    write(&session).expect("written");
    session.reload().expect("readable");
    assert_eq!(session.scene().render.samples, 8);
}

/// A scene of files in memory over those of `folder`.
fn held_in(folder: &Path) -> Session {
    let files = Files::over_disk();
    files.hold(
        &folder.join("a.toml"),
        SCENE.replace("../b", "b").as_bytes(),
    );
    files.hold(&folder.join("a.groom"), groom(1.0));
    files.hold(&folder.join("b.lights"), lights());
    Session::open_in(&folder.join("a.toml"), files).expect("readable")
}

#[test]
fn a_copy_leaves_what_is_in_memory_to_the_document() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("copy")).expect("a folder");
    let session = held_in(folder.path());
    // As a job in another thread does.
    session
        .clone()
        .save_copy(&at("copy/scene.toml"))
        .expect("written");
    Session::open(&at("copy/scene.toml")).expect("all of it is there");
    std::fs::remove_dir_all(at("copy")).expect("removed");
    let mut session = session;
    assert!(session.is_unsaved());
    let saved = session.save().expect("written");
    assert_eq!(saved.files, ["a.groom", "b.lights", "a.toml"].map(at));
    Session::open(&at("a.toml")).expect("all of it is there");
}

#[test]
fn a_save_that_fails_can_be_tried_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("there")).expect("a folder");
    let mut session = held_in(folder.path());
    session.stroke(dyed(0..2, &Paint::unpainted(4)));
    // The light set is written, the groom cannot be.
    let scene = at("there/c.toml");
    let refused = session.save_with_groom(&scene, &at("nowhere/c.groom"));
    let error = refused.expect_err("no such folder").to_string();
    assert!(error.contains("c.groom"), "{error}");
    let left = std::fs::read_dir(at("there")).expect("a folder").count();
    assert_eq!(left, 0);
    assert!(session.is_modified() && session.is_unsaved());
    let saved = session.save_as(&scene).expect("written");
    let names = ["there/b.lights", "there/c-painted.groom", "there/c.toml"];
    assert_eq!(saved.files, names.map(at));
    let again = Session::open(&scene).expect("all of it is there");
    assert_eq!(again.paint(), session.paint());
}

#[test]
fn a_save_that_fails_leaves_files_as_they_were() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let mut session = held_in(folder.path());
    session.stroke(dyed(0..2, &Paint::unpainted(4)));
    session
        .save_with_groom(&at("c.toml"), &at("c.groom"))
        .expect("written");
    let before = std::fs::read(at("c.groom")).expect("read");
    session.stroke(dyed(2..4, &Paint::unpainted(4)));
    // The groom is written, the scene cannot be.
    std::fs::create_dir(at("d.toml")).expect("a folder");
    let refused = session.save_with_groom(&at("d.toml"), &at("c.groom"));
    let error = refused.expect_err("a folder").to_string();
    assert!(error.contains("d.toml"), "{error}");
    assert_eq!(std::fs::read(at("c.groom")).expect("read"), before);
    assert!(session.is_modified() && !session.is_changed_on_disk());
}

#[test]
fn a_write_protected_scene_is_left_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.toml");
    std::fs::write(&path, SCENE).expect("written");
    std::fs::write(folder.path().join("a.groom"), groom(1.0)).expect("written");
    std::fs::write(folder.path().join("b.lights"), lights()).expect("written");
    let scene = SCENE.replace("../b.lights", "b.lights");
    std::fs::write(&path, &scene).expect("written");
    let mut session = Session::open(&path).expect("readable");
    let mut permissions = path.metadata().expect("there").permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).expect("set");
    edit(&mut session, "exposure", |s| s.render.exposure = 1.0);
    let error = session.save().expect_err("it is write-protected");
    let wanted = format!("{}: is write-protected", path.display());
    assert!(error.to_string().ends_with(&wanted), "{error}");
    assert_eq!(std::fs::read_to_string(&path).expect("read"), scene);
    assert!(session.is_modified());
}

#[test]
fn hair_without_paint_keeps_its_name_when_a_reload_is_undone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let session_with = |groom_in_memory: bool| {
        std::fs::write(at("a.toml"), SCENE.replace("../b", "b")).expect("written");
        std::fs::write(at("a.groom"), groom(1.0)).expect("written");
        std::fs::write(at("b.lights"), lights()).expect("written");
        let files = Files::over_disk();
        let mut session = Session::open_in(&at("a.toml"), files).expect("readable");
        if groom_in_memory {
            session.files().hold(&at("y.groom"), groom(2.0));
            edit(&mut session, "import", |s| s.groom.file = "y.groom".into());
        }
        session.reload().expect("readable");
        session.undo();
        session
    };
    let mut imported = session_with(true);
    let saved = imported.save().expect("written");
    assert_eq!(saved.files, ["y.groom", "a.toml"].map(at));
    assert_eq!(std::fs::read(at("y.groom")).expect("read"), groom(2.0));
    // What is on disk may be other hair by now.
    let mut read = session_with(false);
    std::fs::write(at("a.groom"), groom(3.0)).expect("written");
    let saved = read.save().expect("written");
    assert_eq!(saved.files, ["a-2.groom", "a.toml"].map(at));
    let mut painted = session_with(false);
    painted.stroke(dyed(0..2, &Paint::unpainted(4)));
    let saved = painted.save().expect("written");
    assert_eq!(saved.files, ["a-painted.groom", "a.toml"].map(at));
}

/// A LUT in a pipe, which is read after the scene, its groom and its lights: whoever reads it waits until `meanwhile` is
/// done.
#[cfg(unix)]
fn slow_lut(path: &Path, meanwhile: impl FnOnce() + Send + 'static) -> std::thread::JoinHandle<()> {
    use std::io::Write;
    let made = std::process::Command::new("mkfifo").arg(path).status();
    assert!(made.expect("mkfifo starts").success());
    let path = path.to_owned();
    std::thread::spawn(move || {
        let pipe = std::fs::File::options().write(true).open(path);
        let mut pipe = pipe.expect("opened with the reader");
        meanwhile();
        let text = b"LUT_1D_SIZE 2\n0 0 0\n1 1 1\n";
        pipe.write_all(text).expect("written");
    })
}

#[cfg(unix)]
#[test]
fn what_others_write_while_files_are_read_is_known() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    files_in(folder.path(), "[render]\nlut = 'one.cube'\n");
    let scene = at("a.toml");
    let written = slow_lut(&at("one.cube"), move || touch(&scene, 5));
    let mut session = Session::open(&at("a.toml")).expect("readable");
    written.join().expect("written");
    assert_eq!(session.conflict(), Some(&*at("a.toml")));
    // While they are read again.
    let text = std::fs::read_to_string(at("a.toml")).expect("read");
    std::fs::write(at("a.toml"), text.replace("one", "two")).expect("written");
    let groom = at("a.groom");
    let written = slow_lut(&at("two.cube"), move || touch(&groom, 5));
    session.reload().expect("readable");
    written.join().expect("written");
    assert_eq!(session.conflict(), None);
    assert!(session.is_changed_on_disk());
    session.reload().expect("readable");
    assert!(!session.is_changed_on_disk());
    // While an edit reads a file.
    let groom = at("taller.groom");
    let written = slow_lut(&at("three.cube"), move || touch(&groom, 5));
    edit(&mut session, "others", |s| {
        s.groom.file = "taller.groom".into();
        s.render.lut = Some("three.cube".into());
    });
    written.join().expect("written");
    assert!(session.is_changed_on_disk());
}

#[test]
fn saving_forgets_nothing_that_others_wrote_to_other_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("sub")).expect("made");
    files_in(folder.path(), "");
    let mut session = Session::open(&at("a.toml")).expect("readable");
    edit(&mut session, "eta", |s| s.hair.eta = 1.7);
    touch(&at("a.toml"), 5);
    touch(&at("b.lights"), 5);
    assert_eq!(session.conflict(), Some(&*at("a.toml")));
    session.overrule_conflicts();
    assert_eq!(session.conflict(), None);
    session.save().expect("written");
    assert!(session.conflict().is_none() && session.is_changed_on_disk());
    // Nor where the scene names them from elsewhere.
    session.save_as(&at("sub/c.toml")).expect("written");
    assert!(session.is_changed_on_disk());
    session.reload().expect("readable");
    assert!(!session.is_changed_on_disk());
    session.save_as(&at("d.toml")).expect("written");
    assert!(!session.is_changed_on_disk());
}
