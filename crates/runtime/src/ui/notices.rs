//! What went wrong, and what others did to the files: over the picture, whose size stays, so that ground truth
//! that was traced is kept and nothing moves under the mouse.

use egui::RichText;

use super::field::Changes;
use super::theme;

/// What is to be done about files that others have written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilesAnswer {
    /// Read them again.
    Reload,
    /// Leave the document as it is.
    KeepMine,
}

/// Margins at both sides.
const MARGIN: i8 = 8;

/// Shows an `error`, which may be dismissed, and asks where files `have_changed`, along the upper edge of the picture.
pub fn show(
    ctx: &egui::Context,
    picture: egui::Rect,
    error: &mut Option<String>,
    have_changed: bool,
    changes: &mut Changes,
) -> Option<FilesAnswer> {
    if error.is_none() && !have_changed {
        return None;
    }
    let mut answer = None;
    let frame = egui::Frame::new()
        .fill(egui::Color32::from_gray(44))
        .inner_margin(egui::Margin::symmetric(MARGIN, 4));
    egui::Area::new(egui::Id::unique("notices"))
        .order(egui::Order::Middle)
        .fixed_pos(picture.min)
        .constrain(false)
        .show(ctx, |ui| {
            frame.show(ui, |ui| {
                let width = picture.width() - 2.0 * f32::from(MARGIN);
                ui.set_width(width.max(1.0));
                if let Some(text) = error.clone() {
                    ui.horizontal_wrapped(|ui| {
                        ui.label(RichText::new(text).color(theme::ERROR));
                        let dismiss = ui.button("Dismiss");
                        changes.place("Dismiss button", &dismiss);
                        if dismiss.clicked() {
                            *error = None;
                        }
                    });
                }
                if have_changed {
                    ui.horizontal_wrapped(|ui| answer = ask(ui, changes));
                }
            });
        });
    answer
}

fn ask(ui: &mut egui::Ui, changes: &mut Changes) -> Option<FilesAnswer> {
    let text = "The scene's files changed on disk. You have unsaved changes.";
    ui.label(RichText::new(text).color(theme::WARNING));
    let reload = ui.button("Discard my changes and reload");
    changes.place("Reload button", &reload);
    let keep = ui.button("Keep my changes");
    changes.place("Keep my changes button", &keep);
    match (reload.clicked(), keep.clicked()) {
        (true, _) => Some(FilesAnswer::Reload),
        (_, true) => Some(FilesAnswer::KeepMine),
        _ => None,
    }
}
