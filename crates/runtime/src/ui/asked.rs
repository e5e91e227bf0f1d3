//! What the questions of the window know of the scene.

use std::path::PathBuf;

/// What questions are asked about.
pub struct Asked<'a> {
    /// The name of the scene.
    pub scene: &'a str,
    /// Folders to choose files from, by name.
    pub places: &'a [(&'a str, PathBuf)],
    /// Width and height of the window's picture.
    pub window: [u32; 2],
    /// Width and height that the scene has.
    pub scene_size: [u32; 2],
}
