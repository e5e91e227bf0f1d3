//! What was read from files.

use std::sync::Arc;

use strandlight_scene::SceneError;
use strandlight_scene::assets::Assets;
use strandlight_scene::paint::{Paint, PointMask};

/// Numbers of the states that the paint and the mask are in: a stroke makes another of one, undoing it the old one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PaintState {
    pub paint: u64,
    pub mask: u64,
}

impl PaintState {
    /// Both in the state of that number.
    pub fn of(number: u64) -> PaintState {
        PaintState {
            paint: number,
            mask: number,
        }
    }
}

/// What is read from files and shared by the steps of the history.
#[derive(Clone, Debug)]
pub(super) struct AssetSnapshot {
    pub assets: Assets,
    /// Paint of the groom; none until the first stroke, if the groom has none.
    pub paint: Option<Arc<Paint>>,
    /// What brushes leave alone; none until the first stroke that protects something, if the groom has none.
    pub mask: Option<Arc<PointMask>>,
    /// The state of both.
    pub paint_state: PaintState,
    /// The state that the groom's file has; none where that file was written by others since.
    pub file_state: Option<PaintState>,
}

impl AssetSnapshot {
    /// Files as they are, in the state `number` of paint and mask.
    pub fn new(assets: Assets, number: u64) -> Result<AssetSnapshot, SceneError> {
        let paint = Paint::from_groom(&assets.groom)?;
        let paint = paint.map(Arc::new);
        let mask = PointMask::from_groom(&assets.groom).map(Arc::new);
        let paint_state = PaintState::of(number);
        Ok(AssetSnapshot {
            assets,
            paint,
            mask,
            paint_state,
            file_state: Some(paint_state),
        })
    }

    /// What snapshots share: see [`Assets::parts`].
    pub fn parts(&self) -> Vec<(usize, usize)> {
        let mut parts = self.assets.parts();
        let paint = self.paint.as_ref();
        parts
            .extend(paint.map(|paint| (Arc::as_ptr(paint).addr(), size_of_val(&paint.points[..]))));
        let mask = self.mask.as_ref();
        parts.extend(mask.map(|mask| (Arc::as_ptr(mask).addr(), size_of_val(&mask.points[..]))));
        parts
    }
}
