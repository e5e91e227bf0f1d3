//! The list of keys.

use egui::{Align2, RichText};

use super::keys::{Command, KEYS, MOUSE, name_of};
use super::theme;

/// Shows the list while `is_open`.
pub fn show(ctx: &egui::Context, is_open: &mut bool) {
    egui::Window::new("Keys and mouse")
        .open(is_open)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(ctx, |ui| {
            let room = ui.ctx().content_rect();
            egui::ScrollArea::vertical().max_height(room.height() - 120.0).show(ui, |ui| {
            egui::Grid::new("keys").spacing([24.0, 5.0]).show(ui, |ui| {
                for (how, what) in MOUSE {
                    ui.label(RichText::new(how).strong());
                    ui.label(what);
                    ui.end_row();
                }
                ui.end_row();
                for command in commands() {
                    let of_command: Vec<String> = (KEYS.iter())
                        .filter(|(_, _, of, _)| *of == command)
                        .map(|(modifiers, key, ..)| name_of(ctx, *modifiers, *key))
                        .collect();
                    let what = KEYS.iter().find(|(_, _, of, _)| *of == command);
                    ui.label(RichText::new(of_command.join("  or  ")).strong());
                    ui.label(what.map_or("", |(.., what)| what));
                    ui.end_row();
                }
            });
            });
            ui.add_space(6.0);
            ui.label(
                RichText::new(
                    "Numbers are dragged, or typed after a click: 1.6, 1.6mm, 2*0.8. Hold Shift to drag finely. \
                     Point at a name to read what it is for.",
                )
                .color(theme::WEAK),
            );
        });
}

/// Every command once, in the order of the keys.
fn commands() -> Vec<Command> {
    let mut commands: Vec<Command> = Vec::new();
    for (_, _, command, _) in KEYS {
        if !commands.contains(&command) {
            commands.push(command);
        }
    }
    commands
}
