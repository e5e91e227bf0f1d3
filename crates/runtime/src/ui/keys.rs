//! What the keys and the mouse do; the help panel shows the same table.

use egui::{Key, KeyboardShortcut, Modifiers};

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
    /// Looks from where the scene was opened.
    Home,
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
pub const KEYS: [(Modifiers, Key, Command, &str); 18] = {
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
        (NONE, Key::Home, Command::Home, "Camera as opened"),
        (NONE, Key::P, Command::Screenshot, "Save a picture (PNG)"),
        (NONE, Key::B, Command::Paint, "Paint, or orbit again"),
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
            "Close what is on top; stop painting",
        ),
    ]
};

/// What the mouse does over the picture.
pub const MOUSE: [(&str, &str); 6] = [
    ("Drag", "Orbit about the target; paint while painting"),
    ("Ctrl + drag", "Orbit while painting"),
    ("Middle drag, or Shift + drag", "Pan"),
    ("Wheel, or right drag", "Dolly in and out"),
    ("Double click", "Look at the strand there"),
    ("Pick, then click", "Name the light that shines there"),
];

/// Takes the keys pressed in this frame that are commands. A field that is being typed in keeps
/// its keys.
pub fn pressed(ctx: &egui::Context) -> Vec<Command> {
    let is_typing = ctx.text_edit_focused();
    ctx.input_mut(|input| {
        KEYS.into_iter()
            .filter(|(modifiers, ..)| !(is_typing && *modifiers == Modifiers::NONE))
            .filter(|(_, key, ..)| !(is_typing && matches!(key, Key::Z | Key::Y)))
            // Whatever is on top takes that itself; see `layout`.
            .filter(|(_, key, ..)| *key != Key::Escape)
            .filter(|(modifiers, key, ..)| {
                input.consume_shortcut(&KeyboardShortcut::new(*modifiers, *key))
            })
            .map(|(_, _, command, _)| command)
            .collect()
    })
}
