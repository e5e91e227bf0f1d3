//! Scenes that are measured one after the other: what is wrong with one of them must not cost what was
//! measured in others.

use std::path::PathBuf;

use strandlight_formats::Scene;
use strandlight_scene::PreparedScene;
use strandlight_scene::budget::check_target;

use crate::cli::{Failure, Outcome};

/// The scenes of these files.
pub fn read(paths: &[PathBuf]) -> Result<Vec<Scene>, Failure> {
    let scenes = paths.iter();
    scenes
        .map(|path| Scene::read(path).map_err(Failure::input))
        .collect()
}

/// Refuses, before minutes of measuring, sizes that are not drawn and scenes that cannot be loaded.
pub fn check(paths: &[PathBuf], scenes: &[Scene], size: Option<[u32; 2]>) -> Outcome {
    for (path, scene) in paths.iter().zip(scenes) {
        let size = size.unwrap_or(scene.render.size);
        check_target(size).map_err(|error| Failure::file(path, error))?;
    }
    // The first is loaded at once anyway.
    let later = paths.iter().zip(scenes).skip(1);
    for (path, scene) in later {
        let loaded = PreparedScene::load(scene);
        loaded.map_err(|error| Failure::input(error.in_file(path)))?;
    }
    Ok(())
}

/// What was found until the first failure, and that, if there was one. Nothing comes after it.
pub fn until_failure<T>(found: impl Iterator<Item = Result<T, Failure>>) -> (Vec<T>, Outcome) {
    let mut kept = Vec::new();
    for found in found {
        match found {
            Ok(found) => kept.push(found),
            Err(failure) => return (kept, Err(failure)),
        }
    }
    (kept, Ok(()))
}
