//! The document without a device.

mod masks;

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

/// Every key of a scene, changed alone, sets a flag, and can be undone and redone.
#[test]
fn every_key_of_a_scene_is_covered() {
    let mut full = session().scene().clone();
    full.tables = Some(TablesSection {
        file: "other.tables".into(),
    });
    full.camera = Some(CameraSection {
        position: [0.0, 0.0, 9.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        fov_deg: 30.0,
    });
    full.hair.preset = Some("blond".to_owned());
    full.hair.diameter_cm = Some(0.01);
    full.hair.taper = 0.5;
    full.hair.density_forward = Some(0.5);
    full.hair.density_back = Some(0.5);
    full.lights.muted = vec![1];
    full.lights.solo = vec![0];
    full.lights.adjust = vec![LightAdjust {
        light: 0,
        intensity: 2.0,
        tint: [0.5; 3],
    }];
    full.lights.added = vec![AddedLight::default()];
    full.render.lut = Some("dark.cube".into());
    full.render.lut_input = LutInput::Srgb;
    full.lights.panorama = Some("sky.panorama".into());
    full.motion = Some(MotionSection {
        wind: Some(WindSection::default()),
        ..MotionSection::default()
    });
    full.variation = VariationSection {
        seed: 1,
        melanin_strand: 0.2,
        melanin_lock: 0.2,
        redness_strand: 0.2,
        redness_lock: 0.2,
        roughness_strand: 0.2,
        roughness_lock: 0.2,
        grey: 0.2,
        clump: 0.2,
        frizz: 0.2,
        ..VariationSection::default()
    };
    full.proxies = vec![
        ProxySection::Ellipsoid {
            centre: [0.0; 3],
            radii: [8.0; 3],
            tilt_deg: 0.0,
            albedo: [0.5; 3],
        },
        ProxySection::Ground {
            height: 0.0,
            albedo: [0.5; 3],
        },
        ProxySection::mesh("head.mesh"),
    ];
    let mut with_reflectance = full.clone();
    with_reflectance.hair.reflectance = Some([0.5; 3]);
    with_reflectance.motion = Some(MotionSection {
        frames: vec!["1.groom".into()],
        fps: Some(24.0),
        wind: None,
    });
    let mut with_melanin = full.clone();
    with_melanin.hair.melanin = Some(Melanin {
        eumelanin: 1.0,
        pheomelanin: 0.5,
    });
    let mut n_keys = 0;
    for base in [full, with_reflectance, with_melanin] {
        let value = serde_json::to_value(&base).expect("plain data");
        let mut keys = Vec::new();
        leaves(&value, String::new(), &mut keys);
        for key in keys {
            let other = match key.as_str() {
                "version" => continue,
                "groom.file" => json!("taller.groom"),
                "lights.file" => json!("../c.lights"),
                "tables.file" => json!("../c.tables"),
                "hair.preset" => json!("red"),
                "hair.modes.0" => json!("TT"),
                "hair.modes.1" => json!("R"),
                "hair.modes.2" | "proxy.0.kind" | "proxy.1.kind" | "proxy.2.kind" => continue,
                "proxy.2.mesh" => json!("other.mesh"),
                "motion.frames.0" => json!("2.groom"),
                "render.tone_map" => json!("none"),
                "render.lut" => json!("other.cube"),
                "lights.panorama" => json!("other.panorama"),
                "render.lut_input" => json!("linear"),
                "render.background" => json!("none"),
                "render.scattering" => json!("single"),
                "lights.muted.0" => json!(0),
                "lights.solo.0" => json!(1),
                "lights.adjust.0.light" => json!(1),
                _ => nudged(value.pointer(&pointer(&key)).expect("listed")),
            };
            let mut base = base.clone();
            if key == "hair.eccentricity" {
                // Elliptic hair does not vary.
                base.variation = VariationSection::default();
            }
            let changed = match key.as_str() {
                "hair.modes.0" => with_key(&base, "hair.modes", &json!(["TT", "TRT"])),
                "hair.modes.1" => with_key(&base, "hair.modes", &json!(["R"])),
                key => with_key(&base, key, &other),
            };
            let changed = changed.unwrap_or_else(|error| panic!("{key}: {error}"));
            assert!(changed != base, "{key} was not changed");
            let change = Change::between(&base, &changed);
            assert!(!change.is_empty(), "{key} is not covered");
            assert_eq!(change, Change::between(&changed, &base), "{key}");
            assert_eq!(change.names().is_empty(), change.is_empty());
            n_keys += 1;
        }
        assert!(Change::between(&base, &base).is_empty());
    }
    assert!(n_keys > 150, "{n_keys}");
}

fn pointer(key: &str) -> String {
    format!("/{}", key.replace('.', "/"))
}

fn leaves(value: &Value, key: String, keys: &mut Vec<String>) {
    let join = |part: &str| match key.is_empty() {
        true => part.to_owned(),
        false => format!("{key}.{part}"),
    };
    match value {
        Value::Object(table) => {
            for (part, value) in table {
                leaves(value, join(part), keys);
            }
        }
        Value::Array(list) => {
            for (ix, value) in list.iter().enumerate() {
                leaves(value, join(&ix.to_string()), keys);
            }
        }
        _ => keys.push(key),
    }
}

/// A number a little larger.
fn nudged(value: &Value) -> Value {
    match (value.as_u64(), value.as_f64()) {
        (Some(n), _) => json!(n + 1),
        (None, Some(x)) => json!(x + 0.01),
        _ => panic!("{value} is no number"),
    }
}

/// No key of the hair is forgotten by what is made again.
#[test]
fn every_parameter_of_the_hair_is_a_change() {
    use strandlight_formats::params::{HAIR, Kind, Value};
    for param in HAIR.params {
        let before = Scene::new("a", "b");
        let mut after = before.clone();
        let key = param.spec.key;
        let value = match (param.spec.kind, param.get(&after.hair)) {
            (Kind::Numbers(numbers), Some(value)) => {
                let middle = 0.5 * (numbers.min + numbers.max);
                value.with_number(0, middle)
            }
            (Kind::Numbers(numbers), None) if numbers.shape.len() == 1 => {
                Value::Number(0.5 * (numbers.min + numbers.max))
            }
            (Kind::Numbers(_), None) => Value::Vector([0.5; 3]),
            (Kind::Choice(words), _) => Value::Text(words[words.len() - 1].0.to_owned()),
            (Kind::Choices(_), _) => Value::Texts(vec!["R".to_owned()]),
            _ => Value::Text("brown".to_owned()),
        };
        param.set(&mut after.hair, Some(value)).expect(key);
        assert!(!Change::between(&before, &after).is_empty(), "{key}");
    }
}

#[test]
fn changes_name_what_depends_on_them_and_no_more() {
    let mut session = session();
    let mut names = |key: &str, value: Value| {
        let values: Map<String, Value> = [(key.to_owned(), value)].into_iter().collect();
        match session.set(&values) {
            Ok(change) => change.names().join(" "),
            Err(error) => panic!("{key}: {error}"),
        }
    };
    assert_eq!(names("hair.eta", json!(1.6)), "hair");
    assert_eq!(names("hair.eta", json!(1.6)), "", "as it was");
    assert_eq!(names("hair.modes", json!(["R", "TT"])), "modes");
    assert_eq!(names("hair.density_back", json!(0.5)), "densities label");
    assert_eq!(names("hair.diameter_cm", json!(0.01)), "diameter");
    assert_eq!(names("hair.taper", json!(0.6)), "diameter");
    assert_eq!(names("variation.seed", json!(5)), "label", "nothing varies");
    assert_eq!(names("variation.roughness_lock", json!(0.2)), "variation");
    assert_eq!(names("hair.sigma_a", json!([1, 2, 3])), "hair");
    assert_eq!(names("variation.grey", json!(0.2)), "variation");
    assert_eq!(names("hair.sigma_a", json!([1, 2, 4])), "hair variation");
    assert_eq!(names("hair.eta", json!(1.5)), "hair");
    assert_eq!(names("variation.clump", json!(0.2)), "shape");
    assert_eq!(names("variation.seed", json!(6)), "variation shape");
    assert_eq!(
        names("variation.frizz_length_cm", json!(2)),
        "label",
        "no frizz"
    );
    assert_eq!(names("variation", Value::Null), "variation shape");
    assert_eq!(names("lights.rotate_deg", json!(10)), "lights");
    assert_eq!(names("lights.muted", json!([1])), "light_colors");
    assert_eq!(names("lights.tint", json!([1, 0.5, 0.5])), "light_colors");
    assert_eq!(names("camera.position", json!([0, 0, 9])), "camera");
    assert_eq!(names("render.exposure", json!(1)), "grade");
    assert_eq!(names("render.lut", json!("dark.cube")), "grade");
    assert_eq!(names("render.lut", json!("./dark.cube")), "grade");
    assert_eq!(names("render.lut_input", json!("srgb")), "grade");
    assert_eq!(names("render.size", json!([20, 10])), "size");
    assert_eq!(names("groom.file", json!("taller.groom")), "geometry");
    assert_eq!(names("tables", json!({"file": "other.tables"})), "tables");
    // The same colour in another notation, and a different colour.
    let sigma_a = session.scene().hair.sigma_a;
    let change = session.edit("color", |scene| {
        let caustic = scene.hair.params().caustic_width;
        let color = strandlight_scattering::color::reflectance_from_sigma_a(sigma_a, caustic);
        scene.hair.reflectance = Some(color.map(|c| (c * 1e4).round() / 1e4));
    });
    assert_eq!(change.expect("valid").names(), ["hair", "label"]);
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
    session.save_as(Path::new("/t/b.toml")).expect("written");
    let named = session.scene().lights.panorama.clone();
    assert_eq!(named, Some("../s/1.panorama".into()));
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
