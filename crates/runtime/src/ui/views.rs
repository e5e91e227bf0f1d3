//! Where the user looked from: views have an undo of their own, since looking around is no edit.

use std::time::Duration;

use strandlight_scene::Camera;
use web_time::Instant;

/// Turns of the wheel with less between them are one step.
const PAUSE: Duration = Duration::from_millis(700);

/// Most views that are remembered.
const MOST: usize = 200;

/// Views before and after the one that is shown.
#[derive(Debug, Default)]
pub struct Views {
    back: Vec<Camera>,
    forward: Vec<Camera>,
    /// The last move: when it was, and whether by a drag that may go on.
    last: Option<(Instant, bool)>,
}

impl Views {
    /// The view moved away from `from`, by a drag or at once. A whole drag is one step, and so is the
    /// wheel without a pause.
    pub fn left(&mut self, from: Camera, is_drag: bool, now: Instant) {
        let is_same = match self.last {
            Some((_, true)) if is_drag => true,
            Some((then, false)) if !is_drag => now.duration_since(then) < PAUSE,
            _ => false,
        };
        if !is_same {
            self.back.push(from);
            if self.back.len() > MOST {
                self.back.remove(0);
            }
        }
        self.forward.clear();
        self.last = Some((now, is_drag));
    }

    /// A drag ended, or something else happened: the next move is another step.
    pub fn close(&mut self) {
        self.last = None;
    }

    /// Ends the step of a drag whose button is up.
    pub fn released(&mut self) {
        if let Some((_, true)) = self.last {
            self.last = None;
        }
    }

    /// The view before, the one that is left being `from`.
    pub fn back(&mut self, from: Camera) -> Option<Camera> {
        let view = self.back.pop()?;
        self.forward.push(from);
        self.last = None;
        Some(view)
    }

    /// The view that was taken back last.
    pub fn forward(&mut self, from: Camera) -> Option<Camera> {
        let view = self.forward.pop()?;
        self.back.push(from);
        self.last = None;
        Some(view)
    }

    /// Is there one before, and one after?
    pub fn can(&self) -> [bool; 2] {
        [!self.back.is_empty(), !self.forward.is_empty()]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_drag_is_one_step_back_and_forward() {
        let view = |x: f32| Camera::framing(Vec3::new(x, 0.0, 0.0), 1.0, 0.5);
        let mut views = Views::default();
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        // A drag over three frames, however slow, then two turns of the wheel, then a pause.
        for (x, ms) in [(0.0, 0), (1.0, 900), (2.0, 1800)] {
            views.left(view(x), true, at(ms));
        }
        views.released();
        views.left(view(3.0), false, at(1900));
        views.left(view(4.0), false, at(2000));
        views.left(view(5.0), false, at(4000));
        assert_eq!(views.can(), [true, false]);
        assert_eq!(views.back(view(6.0)), Some(view(5.0)));
        assert_eq!(views.back(view(5.0)), Some(view(3.0)));
        assert_eq!(views.back(view(3.0)), Some(view(0.0)));
        assert_eq!(views.back(view(0.0)), None);
        assert_eq!(views.forward(view(0.0)), Some(view(3.0)));
        // Another way from there: what was ahead is gone.
        views.left(view(3.0), true, at(5000));
        assert_eq!(views.forward(view(9.0)), None);
        assert_eq!(views.back(view(9.0)), Some(view(3.0)));
        // Two drags at once are two steps.
        views.left(view(1.0), true, at(5100));
        views.released();
        views.left(view(2.0), true, at(5101));
        assert_eq!(views.back(view(3.0)), Some(view(2.0)));
    }
}
