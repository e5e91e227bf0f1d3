//! The visibility list of a renderer.

use web_time::Instant;

use crate::passes::visibility::{Seen, VisibilityPass};
use strandlight_scene::camera::ViewUniform;

/// A list that is there.
#[derive(Clone, Copy)]
pub(super) struct ViewList {
    /// Of which view.
    pub view: ViewUniform,
    /// Is there one, or has the device no room for it?
    pub is_there: bool,
    /// How many points that shows, once the device has answered.
    pub n_points: Option<u32>,
}

impl ViewList {
    /// That there is none of `view`.
    pub fn none(view: &ViewUniform) -> ViewList {
        ViewList {
            view: *view,
            is_there: false,
            n_points: None,
        }
    }

    /// Is it that of `view`, as [`list_view`] has it? A camera that is no number is its own.
    pub fn is_of(&self, view: &ViewUniform) -> bool {
        bytemuck::bytes_of(&self.view) == bytemuck::bytes_of(view)
    }
}

/// The list, and what it is of.
pub(super) struct VisibleList {
    pub pass: VisibilityPass,
    pub listed: Option<ViewList>,
    /// The view whose list is under way, and since when.
    pub making: Option<(ViewUniform, Instant)>,
    /// How many were begun.
    pub n_made: u64,
    /// The list that the device was asked about how much it shows, and whether that is all of a picture.
    pub asked: (u64, bool),
    /// Something was submitted for a list since this was last asked.
    pub has_submitted: bool,
}

impl VisibleList {
    /// How much a list shows, once, when the device has answered: which list, and whether that is all of a picture.
    pub fn take_seen(&mut self) -> Option<(u64, bool, Seen)> {
        let seen = self.pass.take_seen()?;
        let (list, is_whole) = self.asked;
        if list == self.n_made
            && let Some(listed) = &mut self.listed
        {
            listed.n_points = Some(seen.points);
        }
        Some((list, is_whole, seen))
    }

    /// The points or what is beside them have moved.
    pub fn forget(&mut self) {
        self.listed = None;
        self.making = None;
        self.pass.forget();
    }

    pub fn bytes(&self) -> u64 {
        self.pass.bytes()
    }
}

/// `view` as lists know it: light does not matter.
pub(super) fn list_view(view: &ViewUniform) -> ViewUniform {
    ViewUniform {
        radiance_scale: 1.0,
        margin_px: 0.0,
        ..*view
    }
}
