//! The visibility list of a renderer.

use crate::passes::visibility::{Seen, VisibilityPass};
use strandlight_scene::camera::ViewUniform;

/// The list, and what it is of.
pub(super) struct VisibleList {
    pub pass: VisibilityPass,
    /// Of which view it is, and how much that shows; nothing if the device has no room for it.
    pub listed: Option<(ViewUniform, Option<Seen>)>,
    /// How many were made.
    pub n_made: u64,
}

impl VisibleList {
    /// The points or what is beside them have moved.
    pub fn forget(&mut self) {
        self.listed = None;
    }

    pub fn bytes(&self) -> u64 {
        self.pass.bytes()
    }
}
