//! What the disk holds of a document.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::asset_snapshot::PaintState;
use strandlight_formats::Scene;
use strandlight_scene::files::Files;

/// The document as it is on disk.
#[derive(Clone, Debug)]
pub(super) struct OnDisk {
    pub scene: Scene,
    pub paint_state: PaintState,
    /// The files and when they were written.
    pub written: Vec<(PathBuf, Option<SystemTime>)>,
}

impl OnDisk {
    pub fn new(path: &Path, scene: &Scene, paint_state: PaintState, files: &Files) -> OnDisk {
        let paths = [path.to_owned()].into_iter().chain(scene.file_paths());
        let written = paths.map(|path| {
            let time = files.modified(&path);
            (path, time)
        });
        OnDisk {
            scene: scene.clone(),
            paint_state,
            written: written.collect(),
        }
    }
}
