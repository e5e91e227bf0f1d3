//! What the keys and the mouse do; the help panel shows the same table.

use egui::{Event, Key, Modifiers};

#[cfg(not(target_arch = "wasm32"))]
use crate::inspection::Inspection;

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
    /// Asks for a file and opens it.
    Open,
    /// Opens the bundled sample.
    Sample,
    /// Forgets the files that were open.
    ForgetRecent,
    /// Reads the scene's files again.
    Reload,
    /// Brings all hair into the picture.
    Frame,
    /// Looks from the scene's camera again.
    Home,
    /// Makes the view the scene's camera.
    SaveView,
    /// Looks from where it looked before.
    ViewBack,
    /// Looks from where it looked before that was taken back.
    ViewForward,
    /// Looks at all hair from a side.
    Look(Side),
    /// Writes the picture as a PNG.
    Screenshot,
    /// Asks for size, frames, layers and name, and writes the picture so.
    Still,
    /// Saves the hair as a preset of one's own.
    SavePreset,
    /// Undoes or does again until as many steps are done.
    GoTo(usize),
    /// Keeps the look, to be compared.
    KeepLook,
    /// Goes to the look that is compared, or back.
    SwapLook,
    /// Shows both looks in one picture.
    Wipe,
    /// Copies the look as text.
    CopyLook,
    /// Puts on a look that was copied as text.
    PasteLook,
    /// Lets the finished picture go on to ground truth, or no longer.
    GroundTruth,
    /// Shows something else than the picture's colours, or them again.
    #[cfg(not(target_arch = "wasm32"))]
    Inspect(Option<Inspection>),
    /// Goes to the next thing that is shown in place of the picture's colours.
    NextInspection,
    /// Goes to the next part of the light.
    NextLightLayer,
    /// Takes the next light set of the folder.
    NextLights,
    /// Takes the one before.
    LightsBefore,
    /// Shows or hides the panel.
    Panel,
    /// Switches between painting and orbiting.
    Paint,
    /// Paints all hair with the brush.
    Flood,
    /// Protects what is not protected from brushes, and releases the rest.
    InvertMask,
    /// Releases all hair.
    ClearMask,
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
    /// Closes the help; ends picking or placing a light, or painting.
    Escape,
}

impl Command {
    /// Does it no more than look at the scene from elsewhere?
    pub fn is_view(&self) -> bool {
        matches!(
            self,
            Command::Frame
                | Command::Home
                | Command::ViewBack
                | Command::ViewForward
                | Command::Look(_)
        )
    }
}

/// A side to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From +Z.
    Front,
    /// From -Z.
    Back,
    /// From +X.
    Right,
    /// From -X.
    Left,
    /// From +Y.
    Top,
    /// From -Y.
    Bottom,
}

impl Side {
    /// All of them, with their names.
    pub const ALL: [(Side, &str); 6] = [
        (Side::Front, "Front"),
        (Side::Back, "Back"),
        (Side::Right, "Right"),
        (Side::Left, "Left"),
        (Side::Top, "Top"),
        (Side::Bottom, "Bottom"),
    ];
}

/// Keys and what they do.
pub const KEYS: [(Modifiers, Key, Command, &str); 40] = {
    const NONE: Modifiers = Modifiers::NONE;
    const SHIFT: Modifiers = Modifiers::SHIFT;
    const ALT: Modifiers = Modifiers::ALT;
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
        (
            CTRL,
            Key::O,
            Command::Open,
            "Open a scene, hair, lights, a map or a photo",
        ),
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
        (ALT, Key::ArrowLeft, Command::ViewBack, "The view before"),
        (ALT, Key::ArrowRight, Command::ViewForward, "The view after"),
        (NONE, Key::Num1, Command::Look(Side::Front), "Front"),
        (CTRL, Key::Num1, Command::Look(Side::Back), "Back"),
        (NONE, Key::Num3, Command::Look(Side::Right), "Right side"),
        (CTRL, Key::Num3, Command::Look(Side::Left), "Left side"),
        (NONE, Key::Num7, Command::Look(Side::Top), "Top"),
        (CTRL, Key::Num7, Command::Look(Side::Bottom), "Bottom"),
        (
            SHIFT,
            Key::P,
            Command::Still,
            "Save a picture of any size (PNG, EXR)",
        ),
        (
            NONE,
            Key::P,
            Command::Screenshot,
            "Save the window's picture, once it is finished (PNG)",
        ),
        (BOTH, Key::C, Command::CopyLook, "Copy the look as text"),
        (
            BOTH,
            Key::V,
            Command::PasteLook,
            "Put on a look that was copied",
        ),
        (NONE, Key::K, Command::KeepLook, "Keep the look"),
        (
            NONE,
            Key::X,
            Command::SwapLook,
            "Swap with the look that was kept",
        ),
        (
            NONE,
            Key::W,
            Command::Wipe,
            "Wipe: the look that was kept on the left",
        ),
        (
            NONE,
            Key::G,
            Command::GroundTruth,
            "Go on to ground truth by path tracing, or stop",
        ),
        (
            SHIFT,
            Key::N,
            Command::NextLightLayer,
            "Next part of the light: R, TT, TRT, single, multiple ...",
        ),
        (
            NONE,
            Key::N,
            Command::NextInspection,
            "Next of picture, false colour, clipping, depth ...",
        ),
        (
            NONE,
            Key::Period,
            Command::NextLights,
            "Next light set of the folder",
        ),
        (
            NONE,
            Key::Comma,
            Command::LightsBefore,
            "Light set before it",
        ),
        (NONE, Key::Tab, Command::Panel, "Show or hide the panel"),
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

/// The first key of `command`, as menus show it; empty where it has none.
pub fn shortcut(ctx: &egui::Context, command: Command) -> String {
    let key = KEYS.iter().find(|(_, _, of, _)| *of == command);
    key.map_or_else(String::new, |(modifiers, key, ..)| {
        name_of(ctx, *modifiers, *key)
    })
}

/// A key as it is printed on a keyboard, with what is held down meanwhile.
pub fn name_of(ctx: &egui::Context, modifiers: Modifiers, key: Key) -> String {
    let shortcut = ctx.format_shortcut(&egui::KeyboardShortcut::new(modifiers, key));
    let sign = match key {
        Key::OpenBracket => "[",
        Key::CloseBracket => "]",
        Key::Questionmark => "?",
        Key::Comma => ",",
        Key::Period => ".",
        // No arrow is in the font.
        Key::ArrowLeft => "Left",
        Key::ArrowRight => "Right",
        _ => return shortcut,
    };
    shortcut
        .replace(key.symbol_or_name(), sign)
        .replace(key.name(), sign)
}

/// What the mouse does over the picture.
pub const MOUSE: [(&str, &str); 10] = [
    ("Drag", "Orbit about the target; paint while painting"),
    ("Ctrl + drag", "Orbit while painting"),
    ("Shift + drag", "Release with the mask brush"),
    ("Middle drag, or Shift + drag", "Pan"),
    ("Ctrl + Shift + drag", "Turn the lights of the set"),
    ("Wheel, or right drag", "Dolly in and out"),
    ("Double click", "Centre the view on that strand"),
    (
        "Pick from picture, then click",
        "Identify the light that contributes most there",
    ),
    (
        "Drop a file",
        "Open a scene; replace the hair or the lights",
    ),
    ("One finger, two fingers", "Orbit; pan and dolly"),
];

/// Takes Tab out of what egui hears, which would move the focus by it; answers how often it was
/// pressed alone.
pub fn take_tabs(events: &mut Vec<Event>) -> usize {
    let before = events.len();
    events.retain(|event| {
        !matches!(event, Event::Key { key: Key::Tab, pressed: true, modifiers, .. }
            if *modifiers == Modifiers::NONE)
    });
    before - events.len()
}

/// The commands of this frame. Those that are pressed while a field is typed in wait in `waiting` for the next frame, once it
/// has taken what is typed: without that, saving would save the value of before.
pub fn due(ctx: &egui::Context, waiting: &mut Vec<Command>) -> Vec<Command> {
    let mut due = std::mem::take(waiting);
    let is_typing = ctx.text_edit_focused();
    let pressed = pressed(ctx);
    match is_typing {
        true => *waiting = pressed,
        false => due.extend(pressed),
    }
    due
}

/// Takes the keyboard away from the field that is typed in, which takes what is typed in the next frame.
pub fn end_typing(ctx: &egui::Context) {
    ctx.memory_mut(egui::Memory::stop_text_input);
    ctx.request_repaint();
}

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
    // With Shift alone a letter is typed.
    let is_free = |wanted: &Modifiers| {
        let is_command = wanted.command || wanted.alt;
        !is_typing || (is_command && !matches!(key, Key::Z | Key::Y))
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
