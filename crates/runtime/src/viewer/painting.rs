//! Brushes, and what the renderer is told of paint and of what lies under it.

use strandlight_scene::material::check_paintable;
use strandlight_scene::paint::{ActiveStroke, Brush, BrushStroke, Canvas, Paint, PaintKinds};
use strandlight_scene::{Backend, RenderError, SceneError};

use super::Viewer;
use super::varied::VariedPaint;
use crate::session::{Change, Edits};

impl<B: Backend + ?Sized> Viewer<B> {
    /// A brush goes down. A stroke that was being made ends.
    ///
    /// # Errors
    /// The first value of the brush outside its range; whatever the device refuses.
    pub fn press(&mut self, brush: Brush) -> Result<(), RenderError> {
        self.release()?;
        self.check_brush(&brush)?;
        self.active_stroke = Some(ActiveStroke::new(brush).map_err(SceneError::from)?);
        Ok(())
    }

    /// The brush is dragged to `cursor`, px from the upper left corner of the picture; what it
    /// paints is seen at once. Without a brush down nothing happens.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn drag(&mut self, cursor: [f32; 2]) -> Result<(), RenderError> {
        let Some(mut active_stroke) = self.active_stroke.take() else {
            return Ok(());
        };
        let size = self.size();
        let scene = self.renderer.scene();
        let picker = self.picker.of(&scene.strands);
        let is_of_mask = active_stroke.effect().is_of_mask();
        let canvas = self.session.canvas(active_stroke.effect());
        let changed = active_stroke.drag(picker, canvas, &scene.camera, size, cursor);
        self.active_stroke = Some(active_stroke);
        match changed {
            Some(_) if is_of_mask => {
                self.mask_view.set_outdated();
                Ok(())
            }
            Some(range) => self.show(&Change::painted(range)),
            None => Ok(()),
        }
    }

    /// Elliptic fibres cannot be painted; what is protected of them makes no difference.
    fn check_brush(&self, brush: &Brush) -> Result<(), RenderError> {
        if brush.effect.is_of_mask() {
            return Ok(());
        }
        let hair = self.session.scene().hair.params();
        Ok(check_paintable(&hair).map_err(SceneError::from)?)
    }

    /// The brush goes up: its stroke is one step to undo.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub fn release(&mut self) -> Result<Change, RenderError> {
        let Some(active_stroke) = self.active_stroke.take() else {
            return Ok(Change::default());
        };
        let stroke = match self.session.canvas(active_stroke.effect()) {
            Canvas::Paint(paint, _) => active_stroke.finish(paint),
            Canvas::Mask(mask) => active_stroke.finish_mask(mask),
        };
        let change = self.session.stroke(stroke);
        self.show(&change)?;
        Ok(change)
    }

    /// A whole stroke, as a script has it.
    ///
    /// # Errors
    /// The first value of the brush outside its range; whatever the device refuses.
    pub fn stroke(&mut self, stroke: &BrushStroke) -> Result<Change, RenderError> {
        self.release()?;
        self.check_brush(&stroke.brush)?;
        let size = self.size();
        let scene = self.renderer.scene();
        let picker = self.picker.of(&scene.strands);
        let canvas = self.session.canvas(stroke.brush.effect);
        let stroke = picker
            .stroke(canvas, &scene.camera, size, stroke)
            .map_err(SceneError::from)?;
        let change = self.session.stroke(stroke);
        self.show(&change)?;
        Ok(change)
    }

    /// A brush over all hair, as one step to undo: see [`Picker::flood`](strandlight_scene::paint::Picker::flood).
    ///
    /// # Errors
    /// As [`Viewer::stroke`].
    pub fn flood(&mut self, brush: &Brush) -> Result<Change, RenderError> {
        self.release()?;
        self.check_brush(brush)?;
        let scene = self.renderer.scene();
        let picker = self.picker.of(&scene.strands);
        let stroke = picker.flood(self.session.canvas(brush.effect), brush);
        let change = self.session.stroke(stroke.map_err(SceneError::from)?);
        self.show(&change)?;
        Ok(change)
    }

    /// Presses the brush that is down with a share of its strength, 0..=1, from the next drag on.
    pub fn set_pressure(&mut self, pressure: f32) {
        if let Some(stroke) = &mut self.active_stroke {
            stroke.set_pressure(pressure);
        }
    }

    /// Absorption of the hair that is seen at `cursor`, per fibre radius, with its paint and variation; [`None`]
    /// beside the hair.
    pub fn pick_sigma_a(&mut self, cursor: [f32; 2]) -> Option<[f64; 3]> {
        let size = self.size();
        let scene = self.renderer.scene();
        let picker = self.picker.of(&scene.strands);
        let point = picker.pick_point(&scene.camera, size, cursor)?;
        let hair = scene.hair.hair();
        let paint = scene.paint().and_then(|paint| paint.get(point));
        Some(paint.map_or(hair.sigma_a, |paint| paint.on(hair).sigma_a))
    }

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
        let own = self.session.paint().filter(|paint| paint.is_painted());
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

    /// Does the renderer have paint that the document no longer has, and is its fibre one that takes none?
    pub(super) fn is_unpaintable(&self) -> bool {
        let scene = self.session.scene();
        self.renderer.scene().hair.paint().is_some()
            && check_paintable(&scene.hair.params()).is_err()
            && !scene.variation.varies_fibres()
            && !self.session.paint().is_some_and(Paint::is_painted)
    }
}
