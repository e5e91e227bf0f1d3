//! Paint over strands that vary.

use std::ops::Range;

use strandlight_formats::{Groom, Scene};
use strandlight_scene::SceneError;
use strandlight_scene::paint::Paint;
use strandlight_scene::variation::FibreVariation;

/// The fibres of strands that vary, and the document's paint over them: what a renderer is painted with.
pub(super) struct VariedPaint {
    fibres: FibreVariation,
    paint: Paint,
}

impl VariedPaint {
    /// Of the strands of `groom` with the document's `own` paint; [`None`] where they do not vary.
    pub fn new(
        scene: &Scene,
        groom: &Groom,
        own: Option<&Paint>,
    ) -> Result<Option<VariedPaint>, SceneError> {
        let Some(fibres) = FibreVariation::new(&scene.variation, groom) else {
            return Ok(None);
        };
        let paint = fibres.under(scene.hair.params().sigma_a, own)?;
        Ok(Some(VariedPaint { fibres, paint }))
    }

    /// Takes the document's `own` paint of the groom's points in `changed`; the rest is as it was.
    pub fn repaint(
        &mut self,
        scene: &Scene,
        own: Option<&Paint>,
        changed: Range<usize>,
    ) -> Result<(), SceneError> {
        let sigma_a = scene.hair.params().sigma_a;
        self.fibres
            .lay_under(sigma_a, own, changed, &mut self.paint)
    }

    /// All of it.
    pub fn paint(&self) -> &Paint {
        &self.paint
    }
}
