//! The list of keys.

use egui::{Align2, RichText, Ui};

use super::fitted::fitted;
use super::keys::{Command, KEYS, MOUSE, name_of};
use super::theme;

/// Height of the title, and width of the text below the list, points.
const TITLE: f32 = 50.0;
const TEXT: f32 = 520.0;

/// Shows the list while `is_open`.
pub fn show(ctx: &egui::Context, is_open: &mut bool) {
    egui::Window::new("Keys and mouse")
        .open(is_open)
        .anchor(Align2::CENTER_CENTER, [0.0, 0.0])
        .collapsible(false)
        .resizable(false)
        .show(ctx, |ui| {
            fitted(ui, TITLE, |ui, width| {
                list(ui);
                ui.add_space(6.0);
                let text = "Numbers are dragged, or typed after a click: 1.6, 1.6mm, 2*0.8. Hold Shift to drag finely. \
                            Point at a name to read what it is for.";
                ui.set_max_width(width.min(TEXT));
                ui.label(RichText::new(text).color(theme::WEAK));
            });
        });
}

fn list(ui: &mut Ui) {
    let ctx = ui.ctx().clone();
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
                .map(|(modifiers, key, ..)| name_of(&ctx, *modifiers, *key))
                .collect();
            let what = KEYS.iter().find(|(_, _, of, _)| *of == command);
            ui.label(RichText::new(of_command.join("  or  ")).strong());
            ui.label(what.map_or("", |(.., what)| what));
            ui.end_row();
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The texts of a frame, and where they are.
    fn texts(shape: &egui::Shape, found: &mut Vec<(String, f32)>) {
        match shape {
            egui::Shape::Text(text) => found.push((text.galley.text().to_owned(), text.pos.x)),
            egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, found)),
            _ => {}
        }
    }

    #[test]
    fn the_list_begins_inside_of_a_narrow_window() {
        let ctx = egui::Context::default();
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(360.0, 300.0));
        // Sizes are known from the frame before.
        for frame in 0..4 {
            let input = egui::RawInput {
                screen_rect: Some(screen),
                time: Some(f64::from(frame)),
                ..egui::RawInput::default()
            };
            let output = ctx.run_ui(input, |ui| show(ui.ctx(), &mut true));
            let mut found = Vec::new();
            for shape in &output.shapes {
                texts(&shape.shape, &mut found);
            }
            output.drop_without_applying_deltas();
            if frame == 3 {
                let first = found.iter().find(|(text, _)| text == "Ctrl + drag");
                let (_, left) = first.expect("it is listed");
                assert!((0.0..180.0).contains(left), "{left}");
            }
        }
    }
}
