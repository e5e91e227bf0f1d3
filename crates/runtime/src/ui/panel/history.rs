//! The steps of the document as small pictures: a click goes to one.

use std::sync::Arc;

use egui::text::LayoutJob;
use egui::{
    Color32, FontId, Galley, Painter, Rect, RichText, Sense, Stroke, StrokeKind, Ui, pos2, vec2,
};

use crate::session::Session;
use crate::ui::field::Changes;
use crate::ui::keys::Command;
use crate::ui::theme;
use crate::ui::thumbnails::{SIZE, Thumbnails};

/// Height of a caption of [`CAPTION_ROWS`].
const CAPTION: f32 = 30.0;
/// Most rows of a caption: names of parameters are wider than their pictures.
const CAPTION_ROWS: usize = 2;

/// Shows the steps of `session`, oldest first, as it was opened before them.
pub fn show(
    ui: &mut Ui,
    session: &Session,
    thumbnails: &Thumbnails,
    changes: &mut Changes,
    commands: &mut Vec<Command>,
) {
    let n_done = session.n_done();
    let mut steps = vec![("As opened", session.state_after(0))];
    steps.extend(session.steps());
    ui.label(RichText::new("History").strong());
    let [width, height] = SIZE.map(|side| side as f32);
    egui::ScrollArea::vertical()
        .id_salt("history")
        .max_height(3.0 * (height + CAPTION + 6.0))
        .auto_shrink([false, true])
        .stick_to_bottom(true)
        .show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                for (ix, (label, state)) in steps.iter().enumerate() {
                    let size = vec2(width, height + CAPTION);
                    let (rect, step) = ui.allocate_exact_size(size, Sense::click());
                    changes.place(format!("Step {ix}"), &step);
                    if ui.is_rect_visible(rect) {
                        let is_undone = ix > n_done;
                        let picture = Rect::from_min_size(rect.min, vec2(width, height));
                        let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
                        painter.rect_filled(picture, 2.0, theme::BACKDROP);
                        if let Some(texture) = thumbnails.of(*state) {
                            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
                            let tint = if is_undone {
                                Color32::from_gray(110)
                            } else {
                                Color32::WHITE
                            };
                            painter.image(texture.id(), picture, whole, tint);
                        }
                        if ix == n_done {
                            let stroke = Stroke::new(2.0, theme::ACCENT);
                            painter.rect_stroke(picture, 2.0, stroke, StrokeKind::Inside);
                        }
                        let color = if is_undone {
                            theme::WEAK
                        } else {
                            ui.visuals().text_color()
                        };
                        let at = pos2(rect.left(), picture.bottom() + 2.0);
                        let font = egui::TextStyle::Small.resolve(ui.style());
                        painter.galley(at, caption(&painter, label, font, color, width), color);
                    }
                    if step.clicked() && ix != n_done {
                        commands.push(Command::GoTo(ix));
                    }
                    step.on_hover_text(*label);
                }
            });
        });
}

/// `label` below a picture, in as many rows as there is room for; dots end what does not fit.
fn caption(
    painter: &Painter,
    label: &str,
    font: FontId,
    color: Color32,
    width: f32,
) -> Arc<Galley> {
    let mut job = LayoutJob::simple(label.to_owned(), font, color, width);
    job.wrap.max_rows = CAPTION_ROWS;
    painter.layout_job(job)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captions_stay_within_their_pictures() {
        let egui = egui::Context::default();
        theme::apply(&egui);
        let width = SIZE[0] as f32;
        let mut shown = Vec::new();
        let output = egui.run_ui(egui::RawInput::default(), |ui| {
            let font = egui::TextStyle::Small.resolve(ui.style());
            shown = [
                "As opened",
                "Absorption green",
                "Secondary highlight width of the tips",
            ]
            .map(|label| caption(ui.painter(), label, font.clone(), theme::WEAK, width))
            .to_vec();
        });
        output.drop_without_applying_deltas();
        let rows: Vec<usize> = shown.iter().map(|galley| galley.rows.len()).collect();
        assert_eq!(rows, [1, 2, 2]);
        assert!(
            shown
                .iter()
                .all(|galley| galley.size().x <= width && galley.size().y <= CAPTION)
        );
        let is_cut: Vec<bool> = shown.iter().map(|galley| galley.elided).collect();
        assert_eq!(is_cut, [false, false, true]);
    }
}
