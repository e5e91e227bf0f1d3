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
        let written = [path.to_owned(), scene.groom_path(), scene.lights_path()]
            .into_iter()
            .chain(scene.tables_path())
            .chain(scene.lut_path())
            .chain(scene.panorama_path())
            .chain(scene.frame_paths())
            .chain(scene.mesh_paths().into_iter().map(|(_, path)| path))
            .map(|path| {
                let time = files.modified(&path);
                (path, time)
            })
            .collect();
        OnDisk {
            scene: scene.clone(),
            paint_state,
            written,
        }
    }
}
