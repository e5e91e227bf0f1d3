//! Setting one value of a scene by the name that it has in the file.

use serde_json::Value;
use strandlight_formats::Scene;

pub use strandlight_scene::keys::parse_value;

use crate::error::SessionError;

/// `scene` with `value` at `key`, a path like `hair.eta`, `lights.adjust.0.tint` or
/// `camera.position.1`. `null` takes a key away, which has its default then, or an entry of a list.
///
/// `hair.preset` gives the hair all that the preset says; one of the three ways to give a colour
/// takes the place of the others.
///
/// # Errors
/// [`SessionError::Key`] for no such key or a value of another kind, [`SessionError::Scene`] for a
/// value outside its range; the text names the key.
pub fn with_key(scene: &Scene, key: &str, value: &Value) -> Result<Scene, SessionError> {
    Ok(strandlight_scene::keys::with_key(scene, key, value)?)
}
