//! Setting values of a scene by the names that they have in the file.

use std::cmp::Reverse;

use serde_json::{Map, Value};
use strandlight_formats::{
    CameraSection, Error, HairSection, Scene, did_you_mean, in_plain_words, inline_value,
};

use crate::camera::Camera;

/// Sets several keys of the hair.
const PRESET: &str = "hair.preset";

/// Parts that a key has at most; `lights.adjust.0.tint.2` has 5.
const MAX_PARTS: usize = 8;

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
    /// A key of more parts than any has.
    #[error("no such key: it has {0} parts, none has more than {MAX_PARTS}")]
    Parts(usize),
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
/// `camera.position.1`. `null` takes a key away, which has its default then, or an entry of a list.
///
/// `hair.preset` gives the hair all that the preset says; one of the three ways to give a colour
/// takes the place of the others.
///
/// # Errors
/// [`SetError::Key`] for no such key or a value of another kind, [`SetError::Scene`] for a value
/// outside its range; the text names the key.
pub fn with_key(scene: &Scene, key: &str, value: &Value) -> Result<Scene, SetError> {
    with_all(scene, &[(key, value)])
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
    with_all(&scene, &in_order(values))
}

/// A key and its value.
type Given<'a> = (&'a str, &'a Value);

/// The order in which `values` are set: all the hair and a preset before the keys that they set too; entries of
/// lists in their order; those that are taken away at the end and from the last, so that numbers count the
/// entries that there were.
fn in_order(values: &Map<String, Value>) -> Vec<Given<'_>> {
    let path = |key: &str| -> Vec<(Option<usize>, String)> {
        let parts = key.split('.');
        parts
            .map(|part| (part.parse().ok(), part.to_owned()))
            .collect()
    };
    let values = values.iter().map(|(key, value)| (key.as_str(), value));
    let (mut gone, mut values): (Vec<_>, Vec<_>) =
        values.partition(|(key, value)| value.is_null() && names_entry(key));
    values.sort_by_cached_key(|(key, _)| (*key != "hair", *key != PRESET, path(key)));
    gone.sort_by_cached_key(|(key, _)| Reverse(path(key)));
    values.extend(gone);
    values
}

/// Is `key` that of an entry of a list?
fn names_entry(key: &str) -> bool {
    let last = key.rsplit('.').next();
    last.is_some_and(|last| last.parse::<usize>().is_ok())
}

/// What may need several keys at once: the entry of a list that `key` is in, or the camera.
fn whole_of(key: &str) -> &str {
    let ends = key.match_indices('.').map(|(at, _)| at);
    let mut starts = ends.chain([key.len()]).map(|end| &key[..end]);
    let found = starts.find(|&start| start == "camera" || names_entry(start));
    found.unwrap_or(key)
}

/// `scene` with all of `values`, in their order.
fn with_all(scene: &Scene, values: &[Given]) -> Result<Scene, SetError> {
    let mut changed = scene.clone();
    for values in values.chunk_by(|(a, _), (b, _)| whole_of(a) == whole_of(b)) {
        changed = with_some(&changed, values).map_err(|error| match error {
            Unset::Key(error) => error,
            Unset::Scene(source) => SetError::Key {
                key: to_blame(&changed, values, &source).to_owned(),
                source: source.into(),
            },
        })?;
    }
    changed.folder = scene.folder.clone();
    changed.validate()?;
    Ok(changed)
}

/// Why some values make no scene.
enum Unset {
    /// One of them has no place.
    Key(SetError),
    /// Together they are no scene.
    Scene(serde_json::Error),
}

/// `scene` with `values`, which are not checked against their ranges.
fn with_some(scene: &Scene, values: &[Given]) -> Result<Scene, Unset> {
    let mut root = serde_json::to_value(scene).map_err(Unset::Scene)?;
    for (key, value) in values {
        set_in(&mut root, key, value).map_err(Unset::Key)?;
    }
    serde_json::from_value(root).map_err(Unset::Scene)
}

/// The key that `error` is about: the one of `values` that fails alike alone, or what they are all in.
fn to_blame<'a>(scene: &Scene, values: &[Given<'a>], error: &serde_json::Error) -> &'a str {
    let [(first, _), _, ..] = values else {
        return values.first().map_or("", |(key, _)| key);
    };
    let text = error.to_string();
    let mut alike = values.iter().filter(|&&given| {
        let alone = with_some(scene, &[given]);
        matches!(alone, Err(Unset::Scene(error)) if error.to_string() == text)
    });
    match (alike.next(), alike.next()) {
        (Some((key, _)), None) => key,
        _ => whole_of(first),
    }
}

/// Puts `value` at `key` of a scene's tree.
fn set_in(root: &mut Value, key: &str, value: &Value) -> Result<(), SetError> {
    let path: Vec<&str> = key.split('.').collect();
    if path.len() > MAX_PARTS {
        return Err(SetError::Key {
            key: format!("{}...", path[..MAX_PARTS].join(".")),
            source: KeyError::Parts(path.len()),
        });
    }
    let at_key = |source: KeyError| SetError::Key {
        key: key.to_owned(),
        source,
    };
    let no_scene = |error: serde_json::Error| at_key(error.into());
    match (&path[..], value) {
        (["hair", "preset"], Value::String(name)) => {
            let scene: Scene = serde_json::from_value(root.clone()).map_err(no_scene)?;
            let hair = scene.hair.with_preset(name)?;
            *root = serde_json::to_value(&Scene { hair, ..scene }).map_err(no_scene)?;
            return Ok(());
        }
        (["hair"], Value::Object(own)) => {
            if let Some(Value::String(name)) = own.get("preset") {
                // As in a file: what the table does not say is the preset's.
                let preset = serde_json::to_value(HairSection::preset(name)?).map_err(no_scene)?;
                root["hair"] = preset;
                let colors = HairSection::COLOR_KEYS;
                if let Some(color) = colors.into_iter().find(|&color| own.contains_key(color)) {
                    take_other_colors(root, color);
                }
                for (key, value) in own {
                    root["hair"][key] = value.clone();
                }
                return Ok(());
            }
        }
        (["hair", color, ..], _) if HairSection::COLOR_KEYS.contains(color) => {
            take_other_colors(root, color);
        }
        _ => {}
    }
    replace(root, &path, value).map_err(at_key)
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
            let empty = || empty_for(rest, value);
            replace(table.entry(first).or_insert_with(empty), rest, value)
        }
        Value::Array(list) => {
            let length = list.len();
            // Lists of tables grow; those of numbers are as long as they are.
            let is_table = value.is_object() || (!rest.is_empty() && !value.is_null());
            let is_of_tables = is_table && list.iter().all(Value::is_object);
            if first.parse() == Ok(length) && is_of_tables {
                list.push(Value::Object(Map::new()));
            }
            let ix = first.parse().ok().filter(|&ix: &usize| ix < list.len());
            let ix = ix.ok_or_else(|| KeyError::Entry {
                entry: first.to_owned(),
                length,
            })?;
            if rest.is_empty() && value.is_null() {
                list.remove(ix);
                return Ok(());
            }
            replace(&mut list[ix], rest, value)
        }
        _ => Err(KeyError::BelowValue(first.to_owned())),
    }
}

/// What `value` is put into below a path that goes on with `rest`: a list of tables if that begins with a number,
/// unless a plain value ends there.
fn empty_for(rest: &[&str], value: &Value) -> Value {
    match rest {
        [first, below @ ..]
            if first.parse::<usize>().is_ok()
                && (!below.is_empty() || value.is_object() || value.is_null()) =>
        {
            Value::Array(Vec::new())
        }
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
    use strandlight_formats::{Melanin, ProxySection, params};

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

    fn set_all(scene: &Scene, values: Value) -> Result<Scene, SetError> {
        let view = || CameraSection::new([0.0; 3], [1.0; 3]);
        with_values(scene.clone(), values.as_object().expect("a table"), view)
    }

    #[test]
    fn a_preset_in_all_the_hair_is_that_of_a_file() {
        let scene = Scene::new("a", "b");
        for (hair, lines) in [
            (json!({"preset": "blond"}), "preset = 'blond'"),
            (
                json!({"preset": "zinke-fig9-wide", "eta": 1.6, "melanin": {"eumelanin": 1.5}}),
                "preset = 'zinke-fig9-wide'\neta = 1.6\nmelanin = { eumelanin = 1.5 }",
            ),
        ] {
            let head = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n[hair]\n";
            let file = Scene::from_toml(&format!("{head}{lines}")).expect("valid");
            // What was there goes: the table is all the hair.
            let thick = set(&scene, "hair.diameter_cm", json!(0.01));
            assert_eq!(set(&thick, "hair", hair).hair, file.hair, "{lines}");
        }
        for value in [
            json!({"hair": {"preset": "nope"}}),
            json!({"hair": {"preset": "nope"}, "hair.eta": 1.6}),
        ] {
            let error = set_all(&scene, value).expect_err("no such preset");
            let text = error.to_string();
            assert!(
                text.starts_with("hair.preset is nope") && text.contains("blond"),
                "{text}"
            );
        }
        let values = json!({"hair": {"eta": 1.6}, "hair.preset": "blond"});
        let preset = set(&scene, "hair.preset", json!("blond"));
        let changed = set_all(&scene, values).expect("valid");
        assert_eq!(changed.hair.sigma_a, preset.hair.sigma_a);
    }

    #[test]
    fn entries_are_whole_tables_or_taken_away() {
        let scene = Scene::new("a", "b");
        let ground = |height: f64| json!({"kind": "ground", "height": height});
        let one = set(&scene, "proxy.0", ground(-14.0));
        let three = json!({"proxy.0.height": -15, "proxy.1": ground(-1.0), "proxy.2": ground(-2.0), "proxy.2.height": -3});
        let three = set_all(&one, three).expect("valid");
        let heights = |scene: &Scene| -> Vec<f64> {
            let height = |proxy: &ProxySection| match proxy {
                ProxySection::Ground { height, .. } => *height,
                _ => f64::NAN,
            };
            scene.proxies.iter().map(height).collect()
        };
        assert_eq!(heights(&one), [-14.0]);
        assert_eq!(heights(&three), [-15.0, -1.0, -3.0]);
        let added = json!({"kind": "ground", "height": -4, "albedo": [0.1, 0.2, 0.3]});
        assert_eq!(heights(&set(&three, "proxy.3", added)).len(), 4);
        assert_eq!(heights(&set(&three, "proxy.1", Value::Null)), [-15.0, -3.0]);
        // Numbers are those of the entries that there were.
        let values = json!({"proxy.0": null, "proxy.1": null, "proxy.2.height": -9, "proxy.3": ground(-7.0)});
        let changed = set_all(&three, values).expect("valid");
        assert_eq!(heights(&changed), [-9.0, -7.0]);
        // Ten comes after two.
        let many: Map<String, Value> = (0..12)
            .map(|ix| (format!("lights.adjust.{ix}"), json!({"light": ix})))
            .collect();
        let many = set_all(&scene, many.into()).expect("valid");
        let values = json!({"lights.adjust.2": null, "lights.adjust.10": null});
        let few = set_all(&many, values).expect("valid");
        let left: Vec<u32> = few.lights.adjust.iter().map(|row| row.light).collect();
        assert_eq!(left, [0, 1, 3, 4, 5, 6, 7, 8, 9, 11]);
        let muted = set(&scene, "lights.muted", json!([3, 5]));
        assert_eq!(set(&muted, "lights.muted.0", Value::Null).lights.muted, [5]);
        for (key, value, needle) in [
            (
                "proxy.1",
                ground(0.0),
                "proxy.1: there is no entry 1; the list has 0",
            ),
            (
                "proxy.0",
                Value::Null,
                "proxy.0: there is no entry 0; the list has 0",
            ),
            ("proxy.0", json!({}), "proxy.0: missing field `kind`"),
            (
                "hair.sigma_a.0",
                Value::Null,
                "hair.sigma_a.0: invalid length 2",
            ),
        ] {
            let error = with_key(&scene, key, &value).expect_err(key).to_string();
            assert!(error.contains(needle), "{key}: {error}");
        }
    }

    #[test]
    fn errors_are_about_the_key_that_is_wrong() {
        let scene = Scene::new("a", "b");
        for (values, needle) in [
            (
                json!({"proxy.0.kind": "ground", "proxy.0.height": -14, "render.exposure": 99}),
                "render.exposure is 99",
            ),
            (
                json!({"proxy.0.kind": "ground", "proxy.0.height": -14, "render.exposure": "far"}),
                "render.exposure: invalid type",
            ),
            (
                json!({"lights.adjust.0.light": 3, "lights.adjust.0.intensity": 2, "hair.etta": 1}),
                "hair.etta: unknown field",
            ),
            (
                json!({"proxy.0.kind": "ground", "proxy.0.hight": -14}),
                "proxy.0: unknown field `hight`",
            ),
            (
                json!({"camera.position": [0, 0, 9], "camera.fov_deg": "wide"}),
                "camera.fov_deg: invalid type",
            ),
        ] {
            let error = set_all(&scene, values).expect_err(needle).to_string();
            assert!(error.starts_with(needle), "{error}");
        }
        // Beside each other both are needed.
        let values =
            json!({"camera": null, "camera.position": [0, 0, 9], "camera.target": [0, 0, 1]});
        assert!(set_all(&scene, values).is_ok());
    }

    #[test]
    fn keys_of_very_many_parts_are_refused() {
        let scene = Scene::new("a", "b");
        let long = vec!["a"; 50_000].join(".");
        let error = with_key(&scene, &long, &json!(1))
            .expect_err("too long")
            .to_string();
        assert!(
            error.starts_with("a.a.a.a.a.a.a.a...: no such key: it has 50000 parts"),
            "{error}"
        );
        assert!(error.len() < 100, "{error}");
        // Below a key of the list, a number for the entry and one for a colour's part.
        let deepest = params::keys().map(|key| key.split('.').count() + 2).max();
        assert!(deepest.is_some_and(|deepest| deepest <= MAX_PARTS));
    }

    #[test]
    fn an_entry_is_added_by_several_keys() {
        let scene = Scene::new("a", "b");
        let with = |values: Value| set_all(&scene, values);
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
