//! Paint over strands that vary.

use strandlight_scene::paint::{Paint, PaintKinds};
use strandlight_scene::variation::FibreVariation;
use strandlight_scene::{Backend, RenderError};

use super::Viewer;
use crate::session::{Change, Edits};

/// The fibres of strands that vary, and the document's paint over them: what the renderer is painted with.
pub(super) struct VariedPaint {
    fibres: FibreVariation,
    paint: Paint,
}

impl<B: Backend + ?Sized> Viewer<B> {
    /// Tells the renderer what has changed of the paint or of what lies under it.
    pub(super) fn show_paint(&mut self, change: &Change) -> Result<(), RenderError> {
        if change.has(Edits::VARIATION) {
            self.varied = None;
        } else if change.paint.is_none() {
            return Ok(());
        }
        let own = self.session.paint();
        let scene = self.session.scene();
        if !scene.variation.varies_fibres() {
            if let (Some(changed), Some(paint)) = (&change.paint, own) {
                self.renderer.set_paint(paint, changed.clone())?;
            }
            return Ok(());
        }
        let sigma_a = scene.hair.params().sigma_a;
        let groom = self.session.groom();
        let n_points = groom.points.len();
        match (&mut self.varied, &change.paint) {
            (Some(varied), Some(changed)) => {
                let (fibres, paint) = (&varied.fibres, &mut varied.paint);
                fibres.lay_under(sigma_a, own, changed.clone(), paint)?;
                self.renderer.set_paint(paint, changed.clone())
            }
            _ => {
                let Some(fibres) = FibreVariation::new(&scene.variation, groom) else {
                    return Ok(());
                };
                let paint = fibres.under(sigma_a, own)?;
                self.renderer.set_paint(&paint, 0..n_points)?;
                self.varied = Some(VariedPaint { fibres, paint });
                Ok(())
            }
        }
    }

    /// Would a scene of the document as it is now have no paint, or none of a kind that the renderer's has? A renderer
    /// keeps the kinds that it once had.
    pub(super) fn needs_less_paint(&self) -> bool {
        let Some(drawn) = self.renderer.scene().hair.paint() else {
            return false;
        };
        let variation = &self.session.scene().variation;
        let own = self.session.paint();
        if !variation.varies_fibres() && own.is_none() {
            return true;
        }
        let own = own
            .map(|paint| PaintKinds::of(&paint.points))
            .unwrap_or_default();
        let wanted = own.or(PaintKinds {
            widths: variation.varies_widths(),
            shifts: false,
        });
        drawn.or(wanted) != wanted
    }
}
