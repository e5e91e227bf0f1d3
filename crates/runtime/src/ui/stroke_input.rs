//! Where the brush goes in a frame, and how hard it is pressed.

use egui::{Event, PointerButton, Pos2, TouchPhase};
use strandlight_scene::RenderError;

use crate::viewer::Viewer;

/// A place of the brush in pixels from the upper left of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub at: [f32; 2],
    /// Force of the touch, 0..=1; none of a mouse, and of what does not measure it.
    pub force: Option<f32>,
}

/// All places of mouse or finger among the `events` of a frame since the button went down, and `last`: in a slow frame
/// there are many, and a stroke goes through each, with the force that it has there. `pixel` says where a place of the window is
/// in the picture.
pub fn path(events: &[Event], pixel: impl Fn(Pos2) -> [f32; 2], last: [f32; 2]) -> Vec<Sample> {
    let mut path = Vec::new();
    // A touch is told first, then that the pointer which it stands for has moved.
    let mut force = None;
    for event in events {
        match event {
            Event::Touch {
                phase: TouchPhase::Start | TouchPhase::Move,
                force: of_touch,
                ..
            } => force = of_touch.filter(|&force| force > 0.0),
            Event::PointerButton {
                button: PointerButton::Primary,
                pressed: true,
                pos,
                ..
            } => {
                let at = pixel(*pos);
                path = vec![Sample { at, force }];
            }
            Event::PointerMoved(pos) => {
                let at = pixel(*pos);
                path.push(Sample { at, force });
            }
            _ => {}
        }
    }
    path.push(Sample { at: last, force });
    path
}

/// Drags the brush that is down along `path`, with the force of each place as its pressure. Where that is not told it stays as
/// it is.
///
/// # Errors
/// Whatever the device refuses.
pub fn drag(viewer: &mut Viewer, path: &[Sample]) -> Result<(), RenderError> {
    for sample in path {
        if let Some(force) = sample.force {
            viewer.set_pressure(force);
        }
        viewer.drag(sample.at)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use egui::{Modifiers, RawInput, Rect, TouchDeviceId, TouchId, pos2, vec2};
    use strandlight_cpu::InteractiveRenderer;
    use strandlight_scene::Camera;
    use strandlight_scene::paint::Brush;

    use super::*;
    use crate::InteractiveBackend;
    use crate::session::tests::session;
    use crate::ui::input::split;
    use crate::ui::orbit::Bounds;
    use crate::ui::view;

    const SIZE: [u32; 2] = [300, 200];

    fn viewer() -> Viewer {
        let viewer = Viewer::on(session(), |scene| {
            let renderer: Box<dyn InteractiveBackend> = Box::new(InteractiveRenderer::new(scene));
            Ok(renderer)
        });
        let mut viewer = viewer.expect("drawable");
        viewer.set_window(SIZE).expect("a size");
        viewer
    }

    /// A finger, and the pointer that it stands for, as egui-winit tells of both.
    fn touch(phase: TouchPhase, at: [f32; 2], force: Option<f32>) -> Vec<Event> {
        let pos = pos2(at[0], at[1]);
        let button = |pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let mut events = vec![Event::Touch {
            device_id: TouchDeviceId(0),
            id: TouchId(7),
            phase,
            pos,
            force,
        }];
        match phase {
            TouchPhase::Start => events.extend([Event::PointerMoved(pos), button(true)]),
            TouchPhase::Move => events.push(Event::PointerMoved(pos)),
            TouchPhase::End | TouchPhase::Cancel => {
                events.extend([button(false), Event::PointerGone]);
            }
        }
        events
    }

    /// Shows the picture after each of `frames`, and paints as the window does.
    fn paint(viewer: &mut Viewer, frames: Vec<Vec<Event>>) {
        let egui = egui::Context::default();
        let strands = &viewer.prepared().strands;
        let bounds = Bounds {
            centre: strands.centre,
            radius: strands.radius,
        };
        let brush = Brush {
            radius_cm: 0.2,
            softness: 0.0,
            ..Brush::default()
        };
        let mut is_stroking = false;
        let size = vec2(SIZE[0] as f32, SIZE[1] as f32);
        // The picture has its place from the second frame on.
        for events in std::iter::once(Vec::new()).chain(frames) {
            let raw = RawInput {
                screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), size)),
                events,
                ..RawInput::default()
            };
            for raw in split(raw) {
                let camera: Camera = viewer.prepared().camera;
                let mut input = None;
                let mut output = egui.run_ui(raw, |ui| {
                    let mode = (true, false, false);
                    input = Some(view::show(ui, None, &camera, bounds, mode).0);
                });
                output.textures_delta.clear();
                let input = input.expect("shown");
                assert_eq!(input.size, SIZE);
                match (&input.brush, is_stroking) {
                    (Some(path), _) => {
                        if !std::mem::replace(&mut is_stroking, true) {
                            viewer.press(brush).expect("pressed");
                        }
                        drag(viewer, path).expect("painted");
                    }
                    (None, true) => {
                        is_stroking = false;
                        viewer.release().expect("released");
                    }
                    (None, false) => {}
                }
            }
        }
        assert!(!is_stroking, "the finger is up");
    }

    /// Where in the picture the roots of both strands are.
    fn roots(viewer: &mut Viewer) -> [[f32; 2]; 2] {
        [0.0, 1.0].map(|x| {
            let root = glam::Vec3::new(x, 0.0, 0.0);
            let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
            let found = places.filter_map(|place| {
                let place = place.map(|at| at as f32);
                let apart = viewer.pick(place)?.distance(root);
                Some((place, apart))
            });
            let nearest = found.min_by(|a, b| a.1.total_cmp(&b.1)).expect("hair");
            assert!(nearest.1 < 0.05, "{nearest:?}");
            nearest.0
        })
    }

    /// Weights of the dye at both roots.
    fn weights(viewer: &Viewer) -> [f32; 2] {
        let paint = viewer.session().paint().map(|paint| &paint.points);
        [0, 2].map(|root| paint.map_or(0.0, |points| points[root].weight))
    }

    #[test]
    fn half_the_force_is_half_the_effect() {
        use TouchPhase::{End, Move, Start};
        for (force, expected) in [
            (Some(1.0), 1.0),
            (Some(0.5), 0.5),
            (Some(0.25), 0.25),
            // What does not measure it paints with full strength, as a mouse does.
            (None, 1.0),
            (Some(0.0), 1.0),
            (Some(f32::NAN), 1.0),
            (Some(7.0), 1.0),
        ] {
            let mut viewer = viewer();
            let [root, _] = roots(&mut viewer);
            let frames = vec![
                touch(Start, root, force),
                touch(Move, [root[0], root[1] - 1.0], force),
                // Browsers tell of no force as a finger leaves.
                touch(End, root, Some(0.0)),
            ];
            paint(&mut viewer, frames);
            assert_eq!(weights(&viewer), [expected, 0.0], "{force:?}");
        }
    }

    #[test]
    fn every_sample_of_a_slow_frame_counts() {
        use TouchPhase::{End, Move, Start};
        let mut viewer = viewer();
        let [a, b] = roots(&mut viewer);
        // Below the hair, farther than a strand is picked from.
        let beside = |at: [f32; 2]| [at[0], at[1] + 16.0];
        assert!(beside(a)[1] < SIZE[1] as f32 && viewer.pick(beside(a)).is_none());
        let frame = [
            touch(Start, beside(a), Some(0.9)),
            touch(Move, a, Some(0.25)),
            touch(Move, beside(a), Some(0.8)),
            touch(Move, beside(b), Some(0.1)),
            touch(Move, b, Some(0.75)),
            touch(Move, beside(b), Some(0.6)),
            touch(End, beside(b), Some(0.0)),
        ];
        paint(&mut viewer, vec![frame.concat()]);
        let [a, b] = weights(&viewer);
        // Places between two samples have the force of the second.
        assert!(
            (0.25..=0.8).contains(&a) && (0.6..=0.75).contains(&b),
            "{a} {b}"
        );
        let undone = viewer.undo().expect("undone");
        assert!(
            undone.is_some() && weights(&viewer) == [0.0; 2],
            "one stroke"
        );
    }
}
