//! What was read from files.

use std::sync::Arc;

use strandlight_scene::SceneError;
use strandlight_scene::assets::Assets;
use strandlight_scene::paint::Paint;

/// What is read from files and shared by the steps of the history.
#[derive(Clone, Debug)]
pub(super) struct AssetSnapshot {
    pub assets: Assets,
    /// Paint of the groom; none until the first stroke, if the groom has none.
    pub paint: Option<Arc<Paint>>,
    /// Number of the state that the paint is in: a stroke makes another, undoing it the old one.
    pub paint_state: u64,
    /// The state that the groom's file has; none where that file was written by others since.
    pub file_state: Option<u64>,
}

impl AssetSnapshot {
    pub fn new(assets: Assets, paint_state: u64) -> Result<AssetSnapshot, SceneError> {
        let paint = Paint::from_groom(&assets.groom)?;
        let paint = paint.map(Arc::new);
        Ok(AssetSnapshot {
            assets,
            paint,
            paint_state,
            file_state: Some(paint_state),
        })
    }
}
