//! Pens in web pages. winit tells of them as of mice and drops how hard they are pressed; here they become fingers, of whose force
//! it tells, while they touch the picture.

use winit::dpi::PhysicalPosition;
use winit::event::{ElementState, Force, MouseButton, Touch, TouchPhase, WindowEvent};

/// Number of the finger that a pen is.
const PEN: u64 = u64::MAX;

/// A pen over the window.
#[derive(Debug, Default)]
pub struct Pen {
    at: PhysicalPosition<f64>,
    is_down: bool,
}

impl Pen {
    /// The touch that stands for `event`, which is of a pen with that `pressure`; none where the event is that of a mouse, or
    /// of a pen that hovers.
    pub fn touch(&mut self, event: &WindowEvent, pressure: Option<f64>) -> Option<WindowEvent> {
        let (device_id, phase) = match *event {
            WindowEvent::CursorMoved {
                position,
                device_id,
            } => {
                self.at = position;
                (device_id, self.is_down.then_some(TouchPhase::Moved)?)
            }
            WindowEvent::MouseInput {
                device_id,
                state: ElementState::Pressed,
                button: MouseButton::Left,
            } if pressure.is_some() => {
                self.is_down = true;
                (device_id, TouchPhase::Started)
            }
            WindowEvent::MouseInput {
                device_id,
                state: ElementState::Released,
                button: MouseButton::Left,
            }
            | WindowEvent::CursorLeft { device_id }
                if self.is_down =>
            {
                self.is_down = false;
                (device_id, TouchPhase::Ended)
            }
            _ => return None,
        };
        Some(WindowEvent::Touch(Touch {
            device_id,
            phase,
            location: self.at,
            force: pressure.map(Force::Normalized),
            id: PEN,
        }))
    }
}

#[cfg(test)]
mod tests {
    use winit::event::DeviceId;

    use super::*;

    #[test]
    fn pens_are_fingers_while_they_are_down() {
        let device_id = DeviceId::dummy();
        let moved = |x: f64| WindowEvent::CursorMoved {
            device_id,
            position: PhysicalPosition::new(x, 1.0),
        };
        let button = |state, button| WindowEvent::MouseInput {
            device_id,
            state,
            button,
        };
        let press = button(ElementState::Pressed, MouseButton::Left);
        let release = button(ElementState::Released, MouseButton::Left);
        let touch = |phase, x: f64, force: Option<f64>| {
            Some(WindowEvent::Touch(Touch {
                device_id,
                phase,
                location: PhysicalPosition::new(x, 1.0),
                force: force.map(Force::Normalized),
                id: PEN,
            }))
        };
        let mut pen = Pen::default();
        // A mouse, and a pen that hovers.
        assert_eq!(pen.touch(&moved(1.0), None), None);
        assert_eq!(pen.touch(&press, None), None);
        assert_eq!(pen.touch(&release, None), None);
        assert_eq!(pen.touch(&moved(2.0), Some(0.0)), None);
        let started = touch(TouchPhase::Started, 2.0, Some(0.3));
        assert_eq!(pen.touch(&press, Some(0.3)), started);
        let dragged = touch(TouchPhase::Moved, 4.0, Some(0.6));
        assert_eq!(pen.touch(&moved(4.0), Some(0.6)), dragged);
        // Its other button is that of a mouse.
        let other = button(ElementState::Pressed, MouseButton::Right);
        assert_eq!(pen.touch(&other, Some(0.6)), None);
        let ended = touch(TouchPhase::Ended, 4.0, Some(0.0));
        assert_eq!(pen.touch(&release, Some(0.0)), ended);
        assert_eq!(pen.touch(&moved(5.0), Some(0.0)), None);
        // A pen that leaves is up.
        assert!(pen.touch(&press, Some(0.3)).is_some());
        let left = WindowEvent::CursorLeft { device_id };
        assert_eq!(pen.touch(&left, None), touch(TouchPhase::Ended, 5.0, None));
        assert_eq!(pen.touch(&left, None), None);
    }
}
