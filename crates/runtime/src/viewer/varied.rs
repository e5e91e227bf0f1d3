//! Paint over strands that vary.

use std::ops::Range;

use strandlight_formats::{Groom, Scene};
use strandlight_scene::SceneError;
use strandlight_scene::paint::Paint;
use strandlight_scene::variation::FibreVariation;

/// The fibres of strands that vary, and the document's paint over them: what a renderer is painted with.
pub(super) struct VariedPaint {
    fibres: FibreVariation,
    /// Absorption of hair that does not vary, and of the hair around its strands.
    absorption: ([f64; 3], Option<[f32; 3]>),
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
        let sigma_a = scene.hair.params().sigma_a;
        let paint = fibres.under(sigma_a, own)?;
        Ok(Some(VariedPaint {
            absorption: (sigma_a, fibres.around(sigma_a)),
            fibres,
            paint,
        }))
    }

    /// Takes the document's `own` paint of the groom's points in `changed`; the rest is as it was.
    pub fn repaint(
        &mut self,
        scene: &Scene,
        own: Option<&Paint>,
        changed: Range<usize>,
    ) -> Result<(), SceneError> {
        let sigma_a = scene.hair.params().sigma_a;
        if self.absorption.0 != sigma_a {
            self.absorption = (sigma_a, self.fibres.around(sigma_a));
        }
        self.fibres
            .lay_under(self.absorption, own, changed, &mut self.paint)
    }

    /// All of it.
    pub fn paint(&self) -> &Paint {
        &self.paint
    }
}
