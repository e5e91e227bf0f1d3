//! The light that ground truth is traced in.

use std::path::Path;

use strandlight_formats::Scene;
use strandlight_images::Map;
use strandlight_reference::Environment;
use strandlight_reference::environment::LightSampler;
use strandlight_scene::PreparedScene;

use super::Failure;

/// The map that lights `scene`, read from the file at `path`: that of a flag, or else the scene's
/// `lights.map`; none where the light set does.
pub fn map_of(flag: Option<&Path>, (path, scene): (&Path, &Scene)) -> Result<Option<Map>, Failure> {
    if let Some(map) = flag {
        return Map::read(map).map(Some).map_err(Failure::input);
    }
    let map = scene.map_path().map(|map| Map::read(&map)).transpose();
    map.map_err(|error| Failure::file(path, format!("lights.map: {error}")))
}

/// The light of the map, turned and multiplied as `scene` says, or that of the light set.
pub fn environment_of(map: Option<&Map>, scene: &Scene, prepared: &PreparedScene) -> Environment {
    match map {
        None => Environment::Lights(LightSampler::new(&prepared.lights)),
        Some(map) => Environment::of_map(map.grid(), map.pixels(), &scene.lights, &prepared.lights),
    }
}
