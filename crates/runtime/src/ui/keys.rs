//! What the keys and the mouse do; the help panel shows the same table.

use egui::{Event, Key, Modifiers};

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Takes the last edit back.
    Undo,
    /// Does it again.
    Redo,
    /// Saves scene and groom.
    Save,
    /// Asks for a name and saves there.
    SaveAs,
    /// Reads the scene's files again.
    Reload,
    /// Brings all hair into the picture.
    Frame,
    /// Looks from the scene's camera again.
    Home,
    /// Makes the view the scene's camera.
    SaveView,
    /// Writes the picture as a PNG.
    Screenshot,
    /// Switches between painting and orbiting.
    Paint,
    /// Makes the brush larger.
    LargerBrush,
    /// Makes it smaller.
    SmallerBrush,
    /// Starts and stops the motion.
    Play,
    /// Shows or hides the list of keys.
    Help,
    /// Closes the window; asks first where there are changes.
    Close,
    /// Closes the help; ends picking a light, or painting.
    Escape,
}

/// Keys and what they do.
pub const KEYS: [(Modifiers, Key, Command, &str); 19] = {
    const NONE: Modifiers = Modifiers::NONE;
    const CTRL: Modifiers = Modifiers::COMMAND;
    const BOTH: Modifiers = Modifiers {
        shift: true,
        ..Modifiers::COMMAND
    };
    // Those with more modifiers come first, or Ctrl+Z would take Ctrl+Shift+Z.
    [
        (BOTH, Key::Z, Command::Redo, "Redo"),
        (CTRL, Key::Z, Command::Undo, "Undo"),
        (CTRL, Key::Y, Command::Redo, "Redo"),
        (BOTH, Key::S, Command::SaveAs, "Save as ..."),
        (CTRL, Key::S, Command::Save, "Save scene and groom"),
        (CTRL, Key::R, Command::Reload, "Reload from disk"),
        (CTRL, Key::Q, Command::Close, "Close the window"),
        (NONE, Key::F, Command::Frame, "Frame all hair"),
        (
            NONE,
            Key::Home,
            Command::Home,
            "Return to the scene's camera",
        ),
        (
            NONE,
            Key::V,
            Command::SaveView,
            "Save the view as the scene's camera",
        ),
        (NONE, Key::P, Command::Screenshot, "Save a picture (PNG)"),
        (
            NONE,
            Key::B,
            Command::Paint,
            "Switch between painting and orbiting",
        ),
        (
            NONE,
            Key::CloseBracket,
            Command::LargerBrush,
            "Larger brush",
        ),
        (
            NONE,
            Key::OpenBracket,
            Command::SmallerBrush,
            "Smaller brush",
        ),
        (NONE, Key::Space, Command::Play, "Start and stop the motion"),
        (NONE, Key::H, Command::Help, "This help"),
        (NONE, Key::F1, Command::Help, "This help"),
        (NONE, Key::Questionmark, Command::Help, "This help"),
        (
            NONE,
            Key::Escape,
            Command::Escape,
            "Close the dialog; stop painting",
        ),
    ]
};

/// What the mouse does over the picture.
pub const MOUSE: [(&str, &str); 7] = [
    ("Drag", "Orbit about the target; paint while painting"),
    ("Ctrl + drag", "Orbit while painting"),
    ("Middle drag, or Shift + drag", "Pan"),
    ("Wheel, or right drag", "Dolly in and out"),
    ("Double click", "Centre the view on that strand"),
    (
        "Pick, then click",
        "Identify the light that contributes most there",
    ),
    (
        "Drop a file",
        "Open a scene; replace the groom or the lights",
    ),
];

/// Takes the keys pressed in this frame that are commands, all of them and in their order: a slow
/// frame may have several. A field that is being typed in keeps its keys.
pub fn pressed(ctx: &egui::Context) -> Vec<Command> {
    let is_typing = ctx.text_edit_focused();
    let mut commands = Vec::new();
    ctx.input_mut(|input| {
        input
            .events
            .retain(|event| match command_of(event, is_typing) {
                Some(command) => {
                    commands.push(command);
                    false
                }
                None => true,
            });
    });
    commands
}

fn command_of(event: &Event, is_typing: bool) -> Option<Command> {
    let Event::Key {
        key,
        pressed: true,
        modifiers,
        ..
    } = event
    else {
        return None;
    };
    let is_free = |wanted: &Modifiers| {
        !is_typing || (*wanted != Modifiers::NONE && !matches!(key, Key::Z | Key::Y))
    };
    KEYS.into_iter()
        // Whatever is on top takes that itself; see `layout`.
        .filter(|(_, of, ..)| of == key && *of != Key::Escape)
        .find(|(wanted, ..)| modifiers.matches_logically(*wanted) && is_free(wanted))
        .map(|(_, _, command, _)| command)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_one_frame_are_all_taken_in_the_order_they_were_pressed() {
        let press = |key, modifiers| Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        };
        let ctrl = Modifiers::COMMAND | Modifiers::CTRL;
        let events = vec![
            press(Key::Z, ctrl),
            press(Key::Z, ctrl),
            press(Key::S, ctrl),
            press(Key::Z, ctrl | Modifiers::SHIFT),
            press(Key::B, Modifiers::NONE),
            press(Key::A, ctrl),
        ];
        let ctx = egui::Context::default();
        let input = egui::RawInput {
            events,
            ..egui::RawInput::default()
        };
        let mut commands = Vec::new();
        let mut left = 0;
        let output = ctx.run_ui(input, |ui| {
            commands = pressed(ui.ctx());
            left = ui.input(|input| input.events.len());
        });
        output.drop_without_applying_deltas();
        assert_eq!(
            commands,
            [
                Command::Undo,
                Command::Undo,
                Command::Save,
                Command::Redo,
                Command::Paint
            ]
        );
        assert_eq!(left, 1, "what is no command stays");
    }
}
