//! Paths of prims and their properties.

/// A path: its parent and its last part.
#[derive(Clone, Debug, Default)]
pub(super) struct Path {
    /// None of the root.
    pub parent: Option<u32>,
    pub token: u32,
    /// Of an attribute or relationship.
    pub is_property: bool,
    /// It is in the tree.
    pub is_known: bool,
}
