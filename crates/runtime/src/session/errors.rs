//! What is wrong with a document, as an error of its scene.

use strandlight_formats::Scene;
use strandlight_scene::SceneError;
use strandlight_scene::budget::check_frame;

/// Refuses a size that cannot be rendered.
pub(super) fn check_size(scene: &Scene) -> Result<(), SceneError> {
    check_frame(scene.render.size, 1).map_err(|error| SceneError::from(error).at_key("render.size"))
}
