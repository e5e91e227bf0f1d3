//! The list of keys.

use egui::{Align2, Key, KeyboardShortcut, Modifiers, RichText};

use super::keys::{Command, KEYS, MOUSE};
use super::theme;

/// Shows the list while `is_open`.
pub fn show(ctx: &egui::Context, is_open: &mut bool) {
    egui::Window::new("Keys and mouse")
        .open(is_open)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(ctx, |ui| {
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
            ui.add_space(6.0);
            ui.label(
                RichText::new(
                    "Numbers are dragged, or typed after a click. Hold Shift to drag finely. \
                     Point at a name to read what it is for.",
                )
                .color(theme::WEAK),
            );
        });
}

/// A key as it is printed on a keyboard, with what is held down meanwhile.
fn name_of(ctx: &egui::Context, modifiers: Modifiers, key: Key) -> String {
    let shortcut = ctx.format_shortcut(&KeyboardShortcut::new(modifiers, key));
    let sign = match key {
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::Questionmark => "?",
        _ => return shortcut,
    };
    shortcut.replace(key.name(), sign)
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
