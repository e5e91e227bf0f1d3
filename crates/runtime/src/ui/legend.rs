//! What is shown in place of the picture's colours, over the picture: its name, what false colours stand
//! for, and the values under the mouse.

use egui::{Align2, Color32, Rect, Ui, pos2, vec2};

use super::theme;
use crate::inspection::{BANDS, Inspection};
use crate::viewer::Viewer;

/// Of a band of the legend, points.
const BAND: egui::Vec2 = vec2(34.0, 10.0);

/// Draws it in the lower left of `rect`; `hover` is where the mouse is over the picture, pixels.
pub fn show(ui: &Ui, viewer: &Viewer, hover: Option<[f32; 2]>, rect: Rect) {
    let Some(inspection) = viewer.inspection() else {
        return;
    };
    let painter = ui.painter().with_clip_rect(rect);
    let font = egui::TextStyle::Small.resolve(ui.style());
    let text = |at: egui::Pos2, align: Align2, text: &str| {
        theme::outlined(&painter, at, align, text, &font);
    };
    let mut line = inspection.name();
    if inspection.is_drawn_apart() && !viewer.is_inspection_shown() {
        line += " ...";
    }
    if let Some(([r, g, b, _], stops)) = hover.and_then(|at| viewer.readout(at)) {
        line += &format!(": {r:.4} {g:.4} {b:.4}, {stops:+.1} stops from middle grey");
    }
    let mut left = rect.left_bottom() + vec2(8.0, -8.0);
    if inspection == Inspection::FalseColor {
        let top = left.y - BAND.y;
        for (ix, (_, [r, g, b])) in BANDS.into_iter().enumerate() {
            let min = pos2(left.x + BAND.x * ix as f32, top);
            let colour = Color32::from_rgb(r, g, b);
            painter.rect_filled(Rect::from_min_size(min, BAND), 0.0, colour);
        }
        // Between two bands.
        for (ix, (below, _)) in BANDS[..BANDS.len() - 1].iter().enumerate() {
            let at = pos2(left.x + BAND.x * (ix + 1) as f32, top - 2.0);
            text(at, Align2::CENTER_BOTTOM, &format!("{below:+}"));
        }
        left.y = top - 16.0;
    }
    text(left, Align2::LEFT_BOTTOM, &line);
}
