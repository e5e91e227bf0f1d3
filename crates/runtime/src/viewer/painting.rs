//! What the renderer is told of paint, and of what lies under it.

use strandlight_scene::paint::PaintKinds;
use strandlight_scene::{Backend, RenderError};

use super::Viewer;
use super::varied::VariedPaint;
use crate::session::{Change, Edits};

impl<B: Backend + ?Sized> Viewer<B> {
    /// Tells the renderer what has changed of the paint or of the fibres under it.
    pub(super) fn show_paint(&mut self, change: &Change) -> Result<(), RenderError> {
        let is_other = change.has(Edits::VARIATION);
        if is_other {
            self.varied = None;
        }
        let n_points = self.session.groom().points.len();
        let changed = match &change.paint {
            _ if is_other => 0..n_points,
            Some(changed) => changed.clone(),
            None => return Ok(()),
        };
        let (scene, own) = (self.session.scene(), self.session.paint());
        if let Some(varied) = &mut self.varied {
            varied.repaint(scene, own, changed.clone())?;
            return self.renderer.set_paint(varied.paint(), changed);
        }
        self.varied = VariedPaint::new(scene, self.session.groom(), own)?;
        match (&self.varied, own) {
            // Where it was made just now, the renderer has what it would have been before.
            (Some(varied), _) => self.renderer.set_paint(varied.paint(), changed),
            (None, Some(own)) => self.renderer.set_paint(own, changed),
            (None, None) => Ok(()),
        }
    }

    /// Would a scene of the document as it is now have no paint, or none of a kind that the renderer's has?
    /// A renderer keeps the kinds that it once had.
    pub(super) fn needs_less_paint(&self) -> bool {
        let Some(drawn) = self.renderer.scene().hair.paint() else {
            return false;
        };
        let variation = &self.session.scene().variation;
        let own = self.session.paint();
        if !variation.varies_fibres() && own.is_none() {
            return true;
        }
        let own = own.map(|paint| PaintKinds::of(&paint.points));
        let wanted = own.unwrap_or_default().or(PaintKinds {
            widths: variation.varies_widths(),
            shifts: false,
        });
        drawn.or(wanted) != wanted
    }
}
