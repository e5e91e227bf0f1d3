//! Scenes with keys that the command line overrides.

use std::path::Path;

use serde_json::Value;
use strandlight_formats::Scene;
use strandlight_runtime::Session;

use super::Failure;

/// The scene of a file, some of its keys being others.
pub fn scene_with(path: &Path, set: &[(String, Value)]) -> Result<Scene, Failure> {
    if set.is_empty() {
        return Scene::read(path).map_err(Failure::input);
    }
    let mut session = Session::open(path).map_err(Failure::input)?;
    let keys = set.iter().cloned().collect();
    session.set(&keys).map_err(Failure::input)?;
    Ok(session.scene().clone())
}
