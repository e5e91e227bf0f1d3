//! Files that a scene names.

use super::*;

#[test]
fn another_groom_comes_and_goes_with_its_step() {
    let mut session = session();
    let height = |session: &Session| session.groom().bounds().1[1];
    edit(&mut session, "groom", |s| {
        s.groom.file = "taller.groom".into()
    });
    assert_eq!(height(&session), 2.0);
    assert!(session.undo().expect("a step").has(Edits::GEOMETRY));
    assert_eq!(height(&session), 1.0);
    assert!(session.redo().expect("a step").has(Edits::GEOMETRY));
    assert_eq!(height(&session), 2.0);
    let strands = session.prepared().expect("drawable").strands;
    assert_eq!(strands.bounds.1.y, 2.0);
    assert_eq!(
        session.camera(),
        section_of(&session.prepared().expect("drawable").camera)
    );
}

#[test]
fn a_scene_without_a_camera_has_the_view_of_its_pictures() {
    let mut session = session();
    let view = |session: &Session| section_of(&session.prepared().expect("drawable").camera);
    let at_rest = view(&session);
    let still: fn(&mut Scene) = |s| s.motion = None;
    let windy: fn(&mut Scene) = |s| {
        s.motion = Some(MotionSection {
            wind: Some(WindSection::default()),
            ..MotionSection::default()
        });
    };
    let frizzy: fn(&mut Scene) = |s| s.variation.frizz = 1.0;
    for (change, name) in [(windy, "wind"), (still, "still"), (frizzy, "frizzy")] {
        edit(&mut session, name, change);
        assert_eq!(session.camera(), view(&session), "{name}");
        assert_eq!(session.camera() == at_rest, name == "still", "{name}");
    }
    edit(&mut session, "wind", windy);
    let before = session.camera();
    let turned = Map::from_iter([("camera.fov_deg".to_owned(), json!(20.0))]);
    session.set(&turned).expect("valid");
    assert_eq!(session.camera().position, before.position);
    assert_eq!(session.camera().fov_deg, 20.0);
}

#[test]
fn the_oldest_files_are_forgotten_where_they_take_too_much_memory() {
    let mut session = session();
    let bytes = |session: &Session| {
        let parts = session.snapshot.parts();
        parts.iter().map(|(_, bytes)| bytes).sum::<usize>()
    };
    let reload = |session: &mut Session, height: f32| {
        session.files().hold(Path::new("/s/a.groom"), groom(height));
        session.reload().expect("readable");
    };
    // Three sets of files beside those of the document.
    session.history.max_file_bytes = 7 * bytes(&session) / 2;
    for ix in 1..=10u8 {
        reload(&mut session, 1.0 + f32::from(ix));
    }
    assert_eq!(session.n_done(), 3);
    // Steps that read no files take nothing.
    for ix in 0..5 {
        edit(&mut session, "eta", |s| {
            s.hair.eta = 1.5 + 0.1 * f64::from(ix)
        });
        session.commit();
    }
    assert_eq!(session.n_done(), 8);
    session.go_to(0);
    assert_eq!(session.groom().bounds().1[1], 8.0);
    // The last step stays.
    session.history.max_file_bytes = 0;
    reload(&mut session, 1.0);
    reload(&mut session, 2.0);
    assert_eq!(session.n_done(), 1);
    session.undo();
    assert_eq!(session.groom().bounds().1[1], 1.0);
}

#[test]
fn a_map_in_the_background_comes_and_goes_with_its_step() {
    let mut session = session();
    let map = |brightness: f32| {
        let map = Panorama::from_pixels(4, &[[brightness; 3]; 8]).expect("valid");
        map.to_bytes().expect("valid")
    };
    session.files().hold(Path::new("/s/1.panorama"), map(1.0));
    session.files().hold(Path::new("/s/2.panorama"), map(2.0));
    let red = |session: &Session| {
        let prepared = session.prepared().expect("drawable");
        let panorama = prepared.panorama?;
        Some(panorama.radiance(glam::Vec3::X)[0])
    };
    // Named, and not seen: nothing is drawn anew, and nothing is read.
    let missing = |s: &mut Scene| s.lights.panorama = Some("3.panorama".into());
    assert_eq!(edit(&mut session, "name", missing).names(), ["label"]);
    assert_eq!(red(&session), None);
    let first = |s: &mut Scene| s.lights.panorama = Some("1.panorama".into());
    assert_eq!(edit(&mut session, "other", first).names(), ["label"]);
    let seen = |s: &mut Scene| s.render.background = Background::Panorama;
    assert_eq!(edit(&mut session, "seen", seen).names(), ["grade"]);
    assert_eq!(red(&session), Some(1.0));
    let second = |s: &mut Scene| s.lights.panorama = Some("2.panorama".into());
    assert_eq!(edit(&mut session, "second", second).names(), ["grade"]);
    assert_eq!(red(&session), Some(2.0));
    // It follows what lights follow.
    let bright = |s: &mut Scene| s.lights.intensity = 0.5;
    let names = edit(&mut session, "bright", bright).names();
    assert_eq!(names, ["grade", "light_colors"]);
    assert_eq!(red(&session), Some(1.0));
    let turned = |s: &mut Scene| s.lights.rotate_deg = 30.0;
    let names = edit(&mut session, "turned", turned).names();
    assert_eq!(names, ["grade", "lights"]);
    for (wanted, names) in [
        (1.0, &["grade", "lights"][..]),
        (2.0, &["grade", "light_colors"]),
        (1.0, &["grade"]),
    ] {
        assert_eq!(session.undo().expect("a step").names(), names);
        assert_eq!(red(&session), Some(wanted));
    }
    assert_eq!(session.undo().expect("a step").names(), ["grade"]);
    assert_eq!(red(&session), None);
    session.redo();
    assert_eq!(red(&session), Some(1.0));
    // One that is not there is refused, and so is none.
    for change in [missing, |s: &mut Scene| s.lights.panorama = None] {
        let error = session.edit("bad", change).expect_err("no map");
        assert!(error.to_string().contains("lights.panorama"), "{error}");
        assert_eq!(red(&session), Some(1.0));
    }
    let over = session.save_as(Path::new("/s/1.panorama"));
    let over = over.expect_err("the scene is made of it").to_string();
    assert!(over.contains("panorama"), "{over}");
    // The map of ground truth is named and not read.
    let lit = |s: &mut Scene| s.lights.map = Some("gone.exr".into());
    assert_eq!(edit(&mut session, "map", lit).names(), ["label"]);
    let over = session.save_as(Path::new("/s/gone.exr"));
    assert!(over.is_err(), "the scene is made of it");
    session.save_as(Path::new("/t/b.toml")).expect("written");
    let lights = &session.scene().lights;
    assert_eq!(lights.panorama, Some("../s/1.panorama".into()));
    assert_eq!(lights.map, Some("../s/gone.exr".into()));
    let saved = session.files().scene(Path::new("/t/b.toml"));
    assert_eq!(saved.expect("a scene").lights, *lights);
    assert_eq!(red(&session), Some(1.0));
}

#[test]
fn a_lut_comes_and_goes_with_its_step_and_is_saved() {
    let mut session = session();
    let white = |session: &Session| {
        let shown = session.prepared().expect("drawable").display;
        shown.display([1e6; 3])[0]
    };
    let with_tone_map = white(&session);
    let put = |session: &mut Session, name: &str| {
        session.commit();
        let lut = session.path_in_scene(Path::new(name));
        let change = edit(session, "LUT", |s| s.render.lut = Some(lut));
        assert_eq!(change.names(), ["grade"]);
    };
    put(&mut session, "/s/dark.cube");
    assert_eq!(session.scene().render.lut, Some("dark.cube".into()));
    assert_eq!(white(&session), 0.5);
    put(&mut session, "/s/light.cube");
    assert_eq!(white(&session), 1.0);
    assert_eq!(session.undo().expect("a step").names(), ["grade"]);
    assert_eq!(white(&session), 0.5);
    session.undo();
    assert_eq!(white(&session), with_tone_map);
    session.redo();
    assert_eq!(white(&session), 0.5);
    let over = session.save_as(Path::new("/s/dark.cube"));
    let over = over.expect_err("the scene is made of it").to_string();
    assert!(over.contains("LUT"), "{over}");
    // Another folder names it from there.
    session.save_as(Path::new("/t/b.toml")).expect("written");
    assert_eq!(session.scene().render.lut, Some("../s/dark.cube".into()));
    let again = Session::open_in(Path::new("/t/b.toml"), session.files().clone());
    assert_eq!(white(&again.expect("readable")), 0.5);
    edit(&mut session, "no LUT", |s| s.render.lut = None);
    assert_eq!(white(&session), with_tone_map);
    session.undo();
    assert_eq!(white(&session), 0.5);
    // A file that was written again is another one once it is read again.
    let light = session.files().read(Path::new("/s/light.cube"), 100);
    let (path, bytes) = (Path::new("/s/dark.cube"), light.expect("there"));
    session.files().write(path, &bytes).expect("written");
    session.reload().expect("read");
    assert_eq!(white(&session), 1.0);
    assert!(session.undo().expect("a step").has(Edits::GRADE));
    assert_eq!(white(&session), 0.5);
}

#[test]
fn the_diameters_of_the_groom_are_known() {
    use strandlight_formats::{Attribute, Domain};
    use strandlight_scene::assets::Diameters;

    let files = files();
    let mut session = session();
    assert_eq!(session.assets().diameters, None, "the file has none");
    let path = Path::new("/s/taller.groom");
    let mut taller = files.groom(path).expect("readable");
    taller.attributes.push(Attribute {
        name: "diameter".to_owned(),
        domain: Domain::Point,
        components: 1,
        data: vec![0.04, 0.01, 0.04, 0.03],
    });
    let bytes = taller.to_bytes().expect("valid");
    session.files().write(path, &bytes).expect("written");
    edit(&mut session, "groom", |s| {
        s.groom.file = "taller.groom".into()
    });
    let own = Diameters {
        min: 0.01,
        mean: 0.03,
        max: 0.04,
    };
    assert_eq!(session.assets().diameters, Some(own));
    session.undo();
    assert_eq!(session.assets().diameters, None);
}
