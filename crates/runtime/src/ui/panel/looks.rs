//! Looks that were kept.

use egui::{RichText, Sense, Ui, vec2};

use crate::ui::field::{Changes, row};
use crate::ui::keys::Command;
use crate::ui::looks::Looks;
use crate::ui::theme;

/// What is done with looks, and those that were kept with their pictures.
pub fn show(ui: &mut Ui, looks: &mut Looks, changes: &mut Changes, commands: &mut Vec<Command>) {
    let is_any = !looks.kept().is_empty();
    row(ui, |ui| {
        for (name, command, is_so, is_on, help) in [
            (
                "Keep",
                Command::KeepLook,
                true,
                false,
                "Keeps hair, lights and grading as they are now, with their picture: K",
            ),
            (
                "Swap",
                Command::SwapLook,
                is_any,
                false,
                "Goes to the chosen look, and back: X",
            ),
            (
                "Wipe",
                Command::Wipe,
                is_any,
                looks.is_wiping,
                "Shows the chosen look left of a line, and the present one right of it: W",
            ),
            (
                "Copy",
                Command::CopyLook,
                true,
                false,
                "Copies the hair as text, as scene files have it: Ctrl+Shift+C",
            ),
            (
                "Paste",
                Command::PasteLook,
                true,
                false,
                "Puts on hair that was copied as text: Ctrl+Shift+V",
            ),
        ] {
            let button = ui.add_enabled(is_so, egui::Button::new(name).selected(is_on));
            changes.place(format!("{name} look button"), &button);
            if button.on_hover_text(help).clicked() {
                commands.push(command);
            }
        }
    });
    if !is_any {
        let text = "Keep a look, change the hair, then swap or wipe between both.";
        ui.label(RichText::new(text).color(theme::WEAK));
        return;
    }
    let (mut chosen, mut removed) = (None, None);
    for (ix, kept) in looks.kept().iter().enumerate() {
        ui.horizontal(|ui| {
            let (rect, picture) = ui.allocate_exact_size(vec2(72.0, 48.0), Sense::click());
            ui.painter().rect_filled(rect, 2.0, theme::BACKDROP);
            if let Some(shown) = &kept.shown {
                shown.paint_small(ui.painter(), rect);
            }
            let label = ui.selectable_label(looks.chosen_ix() == ix, format!("Look {}", kept.name));
            changes.place(format!("Look {}", kept.name), &label);
            if label.clicked() || picture.clicked() {
                chosen = Some(ix);
            }
            if ui.small_button("Remove").clicked() {
                removed = Some(ix);
            }
        });
    }
    if let Some(ix) = chosen {
        looks.choose(ix);
    }
    if let Some(ix) = removed {
        looks.remove(ix);
    }
}
