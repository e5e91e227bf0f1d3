//! Scenes to pictures, on the CPU.

use std::path::PathBuf;

use numpy::PyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{BakedFile, CameraSection, Error, Groom, LightSet, Scene};
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::budget::{MAX_SECONDS, check_frame};
use strandlight_scene::files::Files;
use strandlight_scene::keys::{camera_section, with_values};
use strandlight_scene::{Backend, PreparedScene};

use crate::arrays::fresh;
use crate::fault::{Fault, Outcome};
use crate::groom;
use crate::lights;
use crate::work;

/// Where a scene comes from.
enum Source {
    /// A scene file.
    File(PathBuf),
    /// What one would say, as JSON.
    Dict(Value),
}

/// What a groom and a light set that are not files are called in a scene.
const GROOM: &str = "(groom)";
const LIGHTS: &str = "(lights)";

impl Source {
    /// The scene, with the names above for what is given beside it.
    fn scene(&self, groom: bool, lights: bool) -> Outcome<Scene> {
        let mut scene = match self {
            Source::File(path) => Scene::read(path)?,
            Source::Dict(value) => {
                let mut value = value.clone();
                let Value::Object(keys) = &mut value else {
                    return Err(Fault::value("a scene is a path or a dict"));
                };
                keys.entry("version").or_insert(Scene::VERSION.into());
                for (key, name, is_given) in [("groom", GROOM, groom), ("lights", LIGHTS, lights)] {
                    let section = keys.entry(key).or_insert(Value::Object(Map::new()));
                    if let (Value::Object(section), true) = (section, is_given) {
                        section.insert("file".to_owned(), name.into());
                    }
                }
                // As if it had been written, so that every check and message is the file's.
                let text =
                    toml::to_string(&value).map_err(|error| Fault::value(error.to_string()))?;
                Scene::from_toml(&text).map_err(without_place)?
            }
        };
        if groom {
            scene.groom.file = GROOM.into();
        }
        if lights {
            scene.lights.file = LIGHTS.into();
        }
        Ok(scene)
    }

    fn name<T>(&self, outcome: Outcome<T>) -> Outcome<T> {
        outcome.map_err(|fault| match self {
            Source::File(path) => fault.in_file(path),
            Source::Dict(_) => fault,
        })
    }
}

/// An error about a text that nobody wrote, without a place in it.
fn without_place(error: Error) -> Fault {
    match error {
        Error::Syntax { what, .. } => Fault::new("syntax", what),
        Error::Value {
            file,
            key,
            value,
            range,
            ..
        } => Fault::from(Error::Value {
            file,
            line: None,
            key,
            value,
            range,
        }),
        error => error.into(),
    }
}

/// The files of `scene`: those of the disk, and over them what is given in their place.
fn files(scene: &Scene, groom: Option<&Groom>, lights: Option<&LightSet>) -> Outcome<Files> {
    let files = Files::over_disk();
    if let Some(groom) = groom {
        files.hold(&scene.groom_path(), groom.to_bytes()?);
    }
    if let Some(lights) = lights {
        files.hold(&scene.lights_path(), lights.to_bytes()?);
    }
    Ok(files)
}

/// The scene at `path`, or in JSON; with `groom` and `lights` in place of its files. Answers the
/// pixels `(height, width, 4)` and what shows them: exposure, tone map and LUT.
#[pyfunction]
#[allow(
    clippy::too_many_arguments,
    reason = "Python's keywords, which the package gives by position"
)]
pub fn render<'py>(
    py: Python<'py>,
    path: Option<PathBuf>,
    scene: Option<&str>,
    groom: Option<PyRef<'_, groom::Groom>>,
    lights: Option<PyRef<'_, lights::LightSet>>,
    keys: &str,
    size: (Option<u32>, Option<u32>),
    samples: Option<u32>,
    time: f64,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyArrayDyn<f32>>, Bound<'py, PyDict>)> {
    let make = || -> Outcome<_> {
        let parse = |text: &str| -> Outcome<Value> {
            serde_json::from_str(text).map_err(|error| Fault::value(error.to_string()))
        };
        let source = match (path, scene) {
            (Some(path), _) => Source::File(path),
            (None, Some(text)) => Source::Dict(parse(text)?),
            (None, None) => Source::Dict(Value::Object(Map::new())),
        };
        let Value::Object(keys) = parse(keys)? else {
            return Err(Fault::value("set is a dict of keys and values"));
        };
        Ok((source, keys))
    };
    let (source, keys) = make().map_err(|fault| fault.raise(py))?;
    let groom = groom.map(|groom| groom.to_groom(py)).transpose()?;
    let lights = lights.map(|lights| lights.0.clone());
    let (picture, render, lut) = work::run(py, progress, move |watch| {
        if !(0.0..=MAX_SECONDS).contains(&time) {
            let what = format!("time is {time}, must be in 0..={MAX_SECONDS}");
            return Err(Fault::value(what));
        }
        let mut scene = source.scene(groom.is_some(), lights.is_some())?;
        if !keys.is_empty() {
            let given = [("groom", groom.is_some()), ("lights", lights.is_some())];
            for (name, is_given) in given {
                let is_set = keys.contains_key(name) || keys.contains_key(&format!("{name}.file"));
                if is_given && is_set {
                    let what = format!("set names another {name} than the one that is given");
                    return Err(Fault::value(what));
                }
            }
            scene = with_keys(&source, scene, &keys, (groom.as_ref(), lights.as_ref()))?;
        }
        let [w, h] = scene.render.size;
        scene.render.size = [size.0.unwrap_or(w), size.1.unwrap_or(h)];
        scene.render.samples = samples.unwrap_or(scene.render.samples);
        let frame = check_frame(scene.render.size, scene.render.samples);
        frame.map_err(|error| Fault::value(error.to_string()))?;
        let files = files(&scene, groom.as_ref(), lights.as_ref())?;
        drop(groom);
        let prepared = source.name(prepare(&scene, &files, time))?;
        drop(files);
        let (size, n) = (prepared.size, prepared.samples);
        let mut renderer = match samples {
            None => CpuRenderer::new(prepared),
            Some(_) => CpuRenderer::by_samples(prepared),
        };
        renderer.shade_view_only();
        let (picture, _) = renderer.render(size, n, &|done| watch.reach(done))?;
        Ok((picture, scene.render.clone(), scene.lut_path()))
    })?;
    let shape = [picture.height as usize, picture.width as usize, 4];
    let shown = PyDict::new(py);
    shown.set_item("exposure", render.exposure as f32)?;
    shown.set_item("tone_map", render.tone_map.name())?;
    // It may be shown from another folder.
    let lut = lut.map(|path| std::path::absolute(&path).unwrap_or(path));
    shown.set_item("lut", lut)?;
    shown.set_item("lut_input", render.lut_input.name())?;
    Ok((fresh(py, picture.rgba.into_flattened(), &shape)?, shown))
}

/// `scene` with `keys`, the view being that of the scene or else of all the hair.
fn with_keys(
    source: &Source,
    scene: Scene,
    keys: &Map<String, Value>,
    (groom, lights): (Option<&Groom>, Option<&LightSet>),
) -> Outcome<Scene> {
    let asks_for_view = keys.keys().any(|key| key.starts_with("camera."));
    let view = match &scene.camera {
        Some(camera) => camera.clone(),
        // Nobody asks for it, and finding it reads files.
        None if !asks_for_view => CameraSection::new([0.0; 3], [1.0; 3]),
        None => {
            let files = files(&scene, groom, lights)?;
            let assets = Assets::read(&scene, &files, ModesToRead::OfScene).map_err(Fault::from);
            camera_section(&source.name(assets)?.framing(&scene))
        }
    };
    Ok(with_values(scene, keys, || view.clone())?)
}

fn prepare(scene: &Scene, files: &Files, time: f64) -> Outcome<PreparedScene> {
    let assets = Assets::read(scene, files, ModesToRead::OfScene)?;
    let mut prepared = PreparedScene::new(scene, &assets)?;
    prepared.move_hair(scene, files, time)?;
    Ok(prepared)
}
