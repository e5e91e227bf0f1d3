//! Setting one value of a scene by the name that it has in the file.

use serde_json::{Map, Value};
use strandlight_formats::{
    CameraSection, Error, HairSection, Scene, did_you_mean, in_plain_words, inline_value,
};

use crate::camera::Camera;

/// Sets several keys of the hair.
const PRESET: &str = "hair.preset";

/// Why a key of a scene cannot have a value.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// A list has no such entry.
    #[error("there is no entry {entry}; the list has {length}")]
    Entry {
        /// The entry asked for.
        entry: String,
        /// Entries there are.
        length: usize,
    },
    /// A key below a number or text.
    #[error("no such key: {0} stands below a plain value")]
    BelowValue(String),
    /// A value of another kind than the key has, or no such key.
    #[error("{}", in_plain_words(.0))]
    Value(#[from] serde_json::Error),
}

/// Why a scene cannot be changed by its keys.
#[derive(Debug, thiserror::Error)]
pub enum SetError {
    /// A key that the scene does not have, or a value of another kind.
    #[error("{key}: {source}{}", hint(source))]
    Key {
        /// The key as it was given.
        key: String,
        /// What is wrong with it.
        source: KeyError,
    },
    /// A value outside its range.
    #[error(transparent)]
    Scene(#[from] Error),
}

/// What was meant instead, where `error` lets one guess.
fn hint(error: &KeyError) -> String {
    did_you_mean(&error.to_string()).map_or(String::new(), |hint| format!("; {hint}"))
}

/// `scene` with `value` at `key`, a path like `hair.eta`, `lights.adjust.0.tint` or
/// `camera.position.1`. `null` takes a key away: it has its default then.
///
/// `hair.preset` gives the hair all that the preset says; one of the three ways to give a colour
/// takes the place of the others.
///
/// # Errors
/// [`SetError::Key`] for no such key or a value of another kind, [`SetError::Scene`] for a value
/// outside its range; the text names the key.
pub fn with_key(scene: &Scene, key: &str, value: &Value) -> Result<Scene, SetError> {
    let at_key = |source: KeyError| SetError::Key {
        key: key.to_owned(),
        source,
    };
    let mut root = tree_of(scene).map_err(at_key)?;
    set_in(&mut root, key, value)?;
    let mut changed: Scene = serde_json::from_value(root).map_err(|error| at_key(error.into()))?;
    changed.folder = scene.folder.clone();
    changed.validate()?;
    Ok(changed)
}

fn tree_of(scene: &Scene) -> Result<Value, KeyError> {
    Ok(serde_json::to_value(scene)?)
}

/// Puts `value` at `key` of a scene's tree.
fn set_in(root: &mut Value, key: &str, value: &Value) -> Result<(), SetError> {
    let at_key = |source: KeyError| SetError::Key {
        key: key.to_owned(),
        source,
    };
    if let (PRESET, Value::String(name)) = (key, value) {
        let scene: Scene =
            serde_json::from_value(root.clone()).map_err(|error| at_key(error.into()))?;
        let hair = scene.hair.with_preset(name)?;
        *root = tree_of(&Scene { hair, ..scene }).map_err(at_key)?;
        return Ok(());
    }
    if let Some(color) = HairSection::COLOR_KEYS.into_iter().find(|&color| {
        key.strip_prefix("hair.")
            .is_some_and(|rest| rest.split('.').next() == Some(color))
    }) {
        take_other_colors(root, color);
    }
    let path: Vec<&str> = key.split('.').collect();
    replace(root, &path, value).map_err(at_key)
}

/// `scene` with all of `values`. A key below `camera` changes that which `view` gives where the scene
/// leaves it to the program.
///
/// # Errors
/// As [`with_key`].
pub fn with_values(
    mut scene: Scene,
    values: &Map<String, Value>,
    view: impl Fn() -> CameraSection,
) -> Result<Scene, SetError> {
    if scene.camera.is_none() && values.keys().any(|key| key.starts_with("camera.")) {
        scene.camera = Some(view());
    }
    // At once: an entry that is added may need several keys.
    if let Some(scene) = with_all(&scene, values) {
        return Ok(scene);
    }
    // One by one: which key is to blame?
    for (key, value) in in_order(values) {
        scene = with_key(&scene, key, value)?;
    }
    Ok(scene)
}

/// Entries of lists in their order, and a preset before the keys that it sets too.
fn in_order(values: &Map<String, Value>) -> Vec<(&String, &Value)> {
    let path = |key: &str| -> Vec<(Option<usize>, String)> {
        let parts = key.split('.');
        parts
            .map(|part| (part.parse().ok(), part.to_owned()))
            .collect()
    };
    let mut values: Vec<(&String, &Value)> = values.iter().collect();
    values.sort_by_cached_key(|(key, _)| (*key != PRESET, path(key)));
    values
}

/// `scene` with all of `values`; `None` where something is wrong.
fn with_all(scene: &Scene, values: &Map<String, Value>) -> Option<Scene> {
    let mut root = tree_of(scene).ok()?;
    for (key, value) in in_order(values) {
        set_in(&mut root, key, value).ok()?;
    }
    let mut changed: Scene = serde_json::from_value(root).ok()?;
    changed.folder = scene.folder.clone();
    changed.validate().ok()?;
    Some(changed)
}

/// A camera as a scene file has it.
pub fn camera_section(camera: &Camera) -> CameraSection {
    // Through the shortest decimal of the f32, so that files read well.
    let plain = |x: f32| x.to_string().parse().unwrap_or(f64::from(x));
    let vector = |v: glam::Vec3| v.to_array().map(plain);
    CameraSection {
        position: vector(camera.eye),
        target: vector(camera.target),
        up: vector(camera.up),
        // Whole degrees come back as such.
        fov_deg: (f64::from(camera.fov_y).to_degrees() * 1e4).round() / 1e4,
    }
}

/// Takes the ways to give a colour away that are not `kept`.
fn take_other_colors(root: &mut Value, kept: &str) {
    if let Some(hair) = root.get_mut("hair").and_then(Value::as_object_mut) {
        hair.retain(|key, _| key == kept || !HairSection::COLOR_KEYS.contains(&key.as_str()));
    }
}

/// Puts `value` at `path` below `at`; tables and lists on the way are made, and the entry after the last of a list of tables.
fn replace(at: &mut Value, path: &[&str], value: &Value) -> Result<(), KeyError> {
    let Some((&first, rest)) = path.split_first() else {
        *at = value.clone();
        return Ok(());
    };
    match at {
        Value::Object(table) if rest.is_empty() && value.is_null() => {
            table.remove(first);
            Ok(())
        }
        Value::Object(table) => {
            let empty = || empty_for(rest);
            replace(table.entry(first).or_insert_with(empty), rest, value)
        }
        Value::Array(list) => {
            let length = list.len();
            // Lists of tables grow; those of numbers are as long as they are.
            let is_of_tables = !rest.is_empty() && list.iter().all(Value::is_object);
            if first.parse() == Ok(length) && is_of_tables && !value.is_null() {
                list.push(Value::Object(Map::new()));
            }
            let ix = first.parse().ok().filter(|&ix: &usize| ix < list.len());
            let ix = ix.ok_or_else(|| KeyError::Entry {
                entry: first.to_owned(),
                length,
            })?;
            replace(&mut list[ix], rest, value)
        }
        _ => Err(KeyError::BelowValue(first.to_owned())),
    }
}

/// What a path that goes on with `rest` is put into: a list of tables if it begins with a number and goes on.
fn empty_for(rest: &[&str]) -> Value {
    match rest {
        [first, _, ..] if first.parse::<usize>().is_ok() => Value::Array(Vec::new()),
        _ => Value::Object(Map::new()),
    }
}

/// A value as a person types it: JSON, a table or list as scene files have it, or else text.
pub fn parse_value(text: &str) -> Value {
    let is_toml = text.trim_start().starts_with(['{', '[']);
    let from_toml = || is_toml.then(|| inline_value(text)).flatten();
    (serde_json::from_str(text).ok())
        .or_else(from_toml)
        .unwrap_or_else(|| Value::String(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use strandlight_formats::Melanin;

    use super::*;

    fn set(scene: &Scene, key: &str, value: Value) -> Scene {
        match with_key(scene, key, &value) {
            Ok(scene) => scene,
            Err(error) => panic!("{key}: {error}"),
        }
    }

    #[test]
    fn keys_of_every_kind_are_set() {
        let mut scene = Scene::new("a.groom", "a.lights");
        scene.folder = "somewhere".into();
        let scene = set(&scene, "hair.eta", json!(1.6));
        let scene = set(&scene, "hair.width_deg.tt", json!(4));
        let scene = set(&scene, "hair.modes", json!(["TT"]));
        let scene = set(&scene, "lights.rotate_deg", json!(40));
        let scene = set(&scene, "lights.adjust.0.light", json!(3));
        let scene = set(&scene, "lights.adjust.0.tint.2", json!(0.5));
        let scene = set(&scene, "render.background", json!("none"));
        let scene = set(
            &scene,
            "camera",
            json!({"position": [0, 0, 9], "target": [0, 0, 0]}),
        );
        let scene = set(&scene, "camera.position.1", json!(2.5));
        assert_eq!(scene.hair.eta, 1.6);
        assert_eq!(scene.hair.width_deg.tt, 4.0);
        assert_eq!(scene.lights.rotate_deg, 40.0);
        assert_eq!(scene.lights.factor(3), [1.0, 1.0, 0.5]);
        assert_eq!(scene.folder, std::path::Path::new("somewhere"));
        let camera = scene.camera.as_ref().expect("set");
        assert_eq!(camera.position, [0.0, 2.5, 9.0]);
        let scene = set(&scene, "camera", Value::Null);
        assert_eq!(scene.camera, None);
    }

    #[test]
    fn a_colour_takes_the_place_of_the_others() {
        let scene = Scene::new("a", "b");
        let scene = set(&scene, "hair.reflectance", json!([0.5, 0.3, 0.2]));
        assert_eq!(scene.hair.reflectance, Some([0.5, 0.3, 0.2]));
        let scene = set(&scene, "hair.melanin.eumelanin", json!(1.5));
        let melanin = Melanin {
            eumelanin: 1.5,
            pheomelanin: 0.0,
        };
        assert_eq!(
            (scene.hair.reflectance, scene.hair.melanin),
            (None, Some(melanin))
        );
        let scene = set(&scene, "hair.sigma_a", json!([1.0, 2.0, 3.0]));
        assert_eq!(
            (scene.hair.melanin, scene.hair.sigma_a),
            (None, [1.0, 2.0, 3.0])
        );
        let scene = set(&scene, "hair.diameter_cm", json!(0.01));
        let scene = set(&scene, "hair.preset", json!("zinke-fig9-wide"));
        assert_eq!(scene.hair.width_deg.trt, 30.0);
        assert_eq!(
            scene.hair.diameter_cm,
            Some(0.01),
            "not the preset's business"
        );
    }

    #[test]
    fn a_preset_comes_before_the_keys_that_it_sets() {
        let values =
            json!({ "hair.eta": 2.5, "hair.preset": "xu-fig10-a", "hair.width_deg.r": 9.0 });
        let values = values.as_object().expect("a table");
        let view = || CameraSection::new([0.0; 3], [1.0; 3]);
        let scene = Scene::new("a", "b");
        let changed = with_values(scene.clone(), values, view).expect("valid");
        let preset = set(&scene, "hair.preset", json!("xu-fig10-a"));
        let mut wanted = preset.clone();
        (wanted.hair.eta, wanted.hair.width_deg.r) = (2.5, 9.0);
        assert!(preset.hair.eta != 2.5 && changed == wanted);
    }

    #[test]
    fn an_entry_is_added_by_several_keys() {
        let scene = Scene::new("a", "b");
        let view = || CameraSection::new([0.0; 3], [1.0; 3]);
        let with = |values: Value| {
            let values = values.as_object().expect("a table").clone();
            with_values(scene.clone(), &values, view)
        };
        let changed = with(json!({
            "lights.adjust.0.intensity": 2,
            "lights.adjust.0.light": 3,
            "proxy.0.kind": "ellipsoid",
            "proxy.0.centre": [0, 1, 2],
            "proxy.0.radii": [7, 11, 9],
        }));
        let changed = changed.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(changed.lights.factor(3), [2.0; 3]);
        assert_eq!(changed.proxies.len(), 1);
        for (values, needle) in [
            (
                json!({"lights.adjust.0.intensity": 2}),
                "missing field `light`",
            ),
            (json!({"hair.sigma.0": 2}), "unknown field"),
            (
                json!({"hair.eta": 9, "lights.adjust.0.light": 3}),
                "hair.eta is 9",
            ),
        ] {
            let error = with(values).expect_err(needle).to_string();
            assert!(error.contains(needle), "{error}");
        }
    }

    #[test]
    fn errors_name_the_key() {
        let scene = Scene::new("a", "b");
        for (key, value, needle) in [
            ("hair.eta", json!(9.0), "hair.eta is 9"),
            ("hair.eta", json!("thick"), "hair.eta: invalid type"),
            ("hair.eta", json!("thick"), "expected a number"),
            ("hair.colour", json!(1.0), "hair.colour: unknown field"),
            ("hair.etta", json!(1.0), "did you mean eta?"),
            ("hair.eta.x", json!(1.0), "hair.eta.x: no such key"),
            ("hair.sigma_a.3", json!(1.0), "no entry 3; the list has 3"),
            (
                "hair.sigma_a.5",
                json!(1.0),
                "there is no entry 5; the list has 3",
            ),
            (
                "lights.added.1.lambda",
                json!(0.3),
                "no entry 1; the list has 0",
            ),
            ("hair.preset", json!("purple"), "purple"),
            (
                "camera.position",
                json!([0, 0, 1]),
                "camera.position: missing field `target`",
            ),
            ("groom", Value::Null, "groom: missing field"),
            ("", json!(1), ": unknown field"),
            ("lights.muted", json!([-1]), "lights.muted: invalid value"),
        ] {
            let error = with_key(&scene, key, &value).expect_err(key).to_string();
            assert!(error.contains(needle), "{key}: {error}");
        }
    }

    #[test]
    fn values_are_json_or_text() {
        assert_eq!(parse_value("1.5"), json!(1.5));
        assert_eq!(parse_value("[1, 2]"), json!([1, 2]));
        assert_eq!(parse_value("none"), json!("none"));
        assert_eq!(
            parse_value("{ r = -7, tt = 3.5 }"),
            json!({"r": -7, "tt": 3.5})
        );
        assert_eq!(parse_value("[{light = 2}]"), json!([{"light": 2}]));
        assert_eq!(parse_value("[a"), json!("[a"));
    }
}
