//! What edits change.

use super::*;

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
    full.lights.map = Some("sky.exr".into());
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
                "lights.map" => json!("other.exr"),
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
    assert_eq!(names("lights.map", json!("sky.exr")), "label");
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
