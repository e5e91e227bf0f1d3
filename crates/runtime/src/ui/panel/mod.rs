//! The panel beside the picture: a section for each group of parameters.

pub mod camera;
pub mod hair;
pub mod history;
mod light_map;
pub mod lights;
pub mod looks;
pub mod motion;
pub mod paint;
pub mod picture;
pub mod statistics;
pub mod variation;

use egui::{CollapsingHeader, RichText, Ui};

use super::field::Changes;

/// A section of the panel with a heading that opens and closes it.
pub fn section(
    ui: &mut Ui,
    name: &str,
    is_open: bool,
    changes: &mut Changes,
    body: impl FnOnce(&mut Ui, &mut Changes),
) {
    let heading = RichText::new(name).text_style(egui::TextStyle::Heading);
    let shown = CollapsingHeader::new(heading)
        .id_salt(name)
        .default_open(is_open)
        .show_unindented(ui, |ui| {
            body(ui, changes);
            ui.add_space(6.0);
        });
    changes.place(name, &shown.header_response);
    ui.separator();
}
