//! What came from mouse and keyboard since the last frame, in the pieces that the interface sees.

use egui::{Event, RawInput};

/// Most pieces of one frame; what comes after is in the last of them.
const MOST: usize = 64;

/// Cuts the events of `raw` after every press of a button or key, and around every release of a
/// button. The interface sees the mouse where it is at the end of a piece only: in one piece, a
/// drag that begins and ends within a slow frame would be nothing at all.
pub fn split(mut raw: RawInput) -> Vec<RawInput> {
    let mut pieces: Vec<Vec<Event>> = vec![Vec::new()];
    for event in std::mem::take(&mut raw.events) {
        let is_release = matches!(&event, Event::PointerButton { pressed: false, .. });
        let is_press = matches!(
            &event,
            Event::PointerButton { pressed: true, .. } | Event::Key { pressed: true, .. }
        );
        let is_full = pieces.len() >= MOST;
        match pieces.last_mut() {
            Some(last) if is_full || last.is_empty() || !is_release => last.push(event),
            _ => pieces.push(vec![event]),
        }
        if (is_press || is_release) && !is_full {
            pieces.push(Vec::new());
        }
    }
    if pieces.len() > 1 && pieces.last().is_some_and(Vec::is_empty) {
        pieces.pop();
    }
    // Files and news of the window come once.
    let mut rest = raw.clone();
    rest.dropped_files.clear();
    rest.viewports
        .values_mut()
        .for_each(|viewport| viewport.events.clear());
    let n = pieces.len();
    let mut whole = Vec::with_capacity(n);
    for (ix, events) in pieces.into_iter().enumerate() {
        let of_piece = if ix == 0 { &raw } else { &rest };
        whole.push(RawInput {
            events,
            ..of_piece.clone()
        });
    }
    whole
}

/// Has all fingers on one screen: winit names a device for each in a page, and the interface sees
/// two fingers together on one device only. And takes away the force of touches that is none: the standard of pointer events
/// has 0.5 for what is not measured.
#[cfg(target_arch = "wasm32")]
pub fn on_one_screen(mut raw: RawInput) -> RawInput {
    for event in &mut raw.events {
        if let Event::Touch {
            device_id, force, ..
        } = event
        {
            *device_id = egui::TouchDeviceId(0);
            *force = force.filter(|&force| force != 0.5);
        }
    }
    raw
}

#[cfg(test)]
mod tests {
    use egui::{Key, Modifiers, PointerButton, pos2};

    use super::*;

    fn button(pressed: bool) -> Event {
        Event::PointerButton {
            pos: pos2(1.0, 2.0),
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    fn moved(x: f32) -> Event {
        Event::PointerMoved(pos2(x, 0.0))
    }

    fn key() -> Event {
        Event::Key {
            key: Key::B,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        }
    }

    fn sizes(events: Vec<Event>) -> Vec<usize> {
        let raw = RawInput {
            events: events.clone(),
            ..RawInput::default()
        };
        let pieces = split(raw);
        let all: Vec<Event> = pieces.iter().flat_map(|p| p.events.clone()).collect();
        assert_eq!(all, events, "nothing is lost, and the order is kept");
        pieces.iter().map(|piece| piece.events.len()).collect()
    }

    #[test]
    fn press_drag_and_release_are_seen_one_after_the_other() {
        assert_eq!(sizes(vec![]), [0], "a frame without events is one frame");
        assert_eq!(sizes(vec![moved(1.0), moved(2.0)]), [2]);
        let drag = vec![
            moved(0.0),
            button(true),
            moved(1.0),
            moved(2.0),
            button(false),
            moved(3.0),
        ];
        assert_eq!(sizes(drag), [2, 2, 1, 1]);
        let clicks = vec![button(true), button(false), button(true), button(false)];
        assert_eq!(sizes(clicks), [1; 4]);
        // A key that changes what the mouse does comes before the press.
        let painted = vec![key(), button(true), moved(1.0), button(false)];
        assert_eq!(sizes(painted), [1; 4]);
        let many: Vec<Event> = (0..200).map(|ix| button(ix % 2 == 0)).collect();
        assert_eq!(sizes(many).len(), MOST);
    }
}
