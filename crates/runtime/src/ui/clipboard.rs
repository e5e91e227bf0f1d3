//! The system's clipboard, so that text goes to other programs and comes from them. egui-winit keeps a
//! clipboard of its own, which this one is laid into.

use winit::event::{ElementState, WindowEvent};
use winit::keyboard::{Key, ModifiersState, NamedKey};

/// The clipboard, opened when it is first wanted.
#[derive(Default)]
pub struct Clipboard {
    #[cfg(not(target_arch = "wasm32"))]
    system: Option<arboard::Clipboard>,
}

/// Does `event` paste?
pub fn pastes(event: &WindowEvent, modifiers: ModifiersState) -> bool {
    let WindowEvent::KeyboardInput { event, .. } = event else {
        return false;
    };
    event.state == ElementState::Pressed
        && match &event.logical_key {
            Key::Named(NamedKey::Paste) => true,
            Key::Named(NamedKey::Insert) => modifiers.shift_key(),
            Key::Character(text) => {
                let command = if cfg!(target_os = "macos") {
                    modifiers.super_key()
                } else {
                    modifiers.control_key()
                };
                command && text.eq_ignore_ascii_case("v")
            }
            _ => false,
        }
}

#[cfg(not(target_arch = "wasm32"))]
impl Clipboard {
    fn system(&mut self) -> Option<&mut arboard::Clipboard> {
        if self.system.is_none() {
            self.system = arboard::Clipboard::new().ok();
        }
        self.system.as_mut()
    }

    /// The text in it.
    pub fn text(&mut self) -> Option<String> {
        self.system()?.get_text().ok()
    }

    /// Puts text into it.
    pub fn set_text(&mut self, text: &str) {
        if let Some(system) = self.system() {
            // What the system does not take stays within the window.
            let _ = system.set_text(text);
        }
    }
}

#[cfg(target_arch = "wasm32")]
impl Clipboard {
    /// A browser gives no text unasked.
    pub fn text(&mut self) -> Option<String> {
        None
    }

    /// Nor takes any here.
    pub fn set_text(&mut self, _: &str) {}
}
