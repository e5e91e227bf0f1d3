//! The steps of the document as small pictures: a click goes to one.

use egui::{Color32, Rect, RichText, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

use crate::session::Session;
use crate::ui::field::Changes;
use crate::ui::keys::Command;
use crate::ui::theme;
use crate::ui::thumbnails::{SIZE, Thumbnails};

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
        .max_height(3.0 * (height + 22.0))
        .auto_shrink([false, true])
        .stick_to_bottom(true)
        .show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                for (ix, (label, state)) in steps.iter().enumerate() {
                    let size = vec2(width, height + 16.0);
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
                        painter.text(at, egui::Align2::LEFT_TOP, label, font, color);
                    }
                    if step.clicked() && ix != n_done {
                        commands.push(Command::GoTo(ix));
                    }
                    step.on_hover_text(*label);
                }
            });
        });
}
