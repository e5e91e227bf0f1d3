//! What became of a frame.

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Painted {
    /// It is on screen.
    Presented,
    /// Nothing can be seen now; try when something changes.
    Hidden,
    /// The surface was recreated; try again.
    Again,
}
