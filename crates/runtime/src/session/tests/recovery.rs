//! Work that was not saved, when the program is ended.

use std::time::{Duration, SystemTime};

use super::*;

/// A scene with its files in a folder.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("a.toml"), SCENE.replace("../b", "b")).expect("written");
    std::fs::write(at("a.groom"), groom(1.0)).expect("written");
    std::fs::write(at("b.lights"), lights()).expect("written");
    folder
}

#[test]
fn unsaved_work_is_kept_beside_the_scene_and_replaces_nothing() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let before = std::fs::read(at("a.toml")).expect("read");
    let mut session = Session::open(&at("a.toml")).expect("readable");
    assert_eq!(session.newer_recovery(), None);
    for (eta, name) in [(1.7, "a-recovery.toml"), (1.8, "a-recovery-2.toml")] {
        session
            .edit("eta", |scene| scene.hair.eta = eta)
            .expect("valid");
        assert_eq!(session.write_recovery().expect("written"), at(name));
        // It is the document of before, changed still, under its own name.
        assert!(session.is_modified() && session.path() == at("a.toml"));
        assert_eq!(session.newer_recovery(), Some(at(name)));
    }
    assert_eq!(std::fs::read(at("a.toml")).expect("read"), before);
    for (eta, name) in [(1.7, "a-recovery.toml"), (1.8, "a-recovery-2.toml")] {
        let kept = Session::open(&at(name)).expect("whole");
        assert_eq!(kept.scene().hair.eta, eta, "{name}");
    }
    // Once the scene is saved after them, they are old.
    session.save().expect("written");
    let later = SystemTime::now() + Duration::from_secs(5);
    let file = std::fs::File::options().write(true).open(at("a.toml"));
    file.and_then(|file| file.set_modified(later)).expect("set");
    assert_eq!(session.newer_recovery(), None);
}

#[test]
fn painted_hair_is_kept_too() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let mut session = Session::open(&at("a.toml")).expect("readable");
    session.stroke(dyed(0..2, &Paint::unpainted(4)));
    let path = session.write_recovery().expect("written");
    let kept = Session::open(&path).expect("whole");
    assert_eq!(
        kept.scene().groom.file,
        Path::new("a-recovery-painted.groom")
    );
    assert_eq!(weights(&kept), [1.0, 1.0, 0.0, 0.0]);
    assert_eq!(std::fs::read(at("a.groom")).expect("read"), groom(1.0));
}

#[test]
fn what_cannot_be_written_beside_the_scene_is_kept_among_temporary_files() {
    let folder = folder();
    let mut session = Session::open(&folder.path().join("a.toml")).expect("readable");
    session
        .edit("eta", |scene| scene.hair.eta = 1.7)
        .expect("valid");
    // Its folder is gone; the files that it names are too, but the values are kept.
    folder.close().expect("removed");
    let path = session.write_recovery().expect("written");
    let kept = strandlight_formats::Scene::read(&path).expect("a scene");
    std::fs::remove_file(&path).expect("removed");
    assert!(path.starts_with(std::env::temp_dir()));
    assert_eq!(kept.hair.eta, 1.7);
}
