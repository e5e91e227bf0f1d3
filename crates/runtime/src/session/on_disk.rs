//! What the disk holds of a document.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::asset_snapshot::PaintState;
use strandlight_formats::Scene;
use strandlight_scene::files::Files;

/// Files, and when each was written; `None` where that is not known.
pub(super) type FileTimes = BTreeMap<PathBuf, Option<SystemTime>>;

/// The document as it is on disk.
#[derive(Clone, Debug)]
pub(super) struct OnDisk {
    pub scene: Scene,
    /// The text of its file, which may go.
    pub text: String,
    pub paint_state: PaintState,
    /// The files that the document was read from or saved to, with the times that they had before they were read and after
    /// they were saved: what others write later is seen by another time.
    pub written: FileTimes,
}

/// The text of a scene file, nothing where it cannot be read.
pub(super) fn text_of(path: &Path, files: &Files) -> Option<String> {
    let bytes = files.read(path, Scene::MAX_BYTES).ok()?;
    String::from_utf8(bytes).ok()
}

/// When `paths` were written. Asked before they are read: a file that is written while it is read is another one.
pub(super) fn times_of(paths: impl IntoIterator<Item = PathBuf>, files: &Files) -> FileTimes {
    let timed = |path: PathBuf| {
        let time = files.modified(&path);
        (path, time)
    };
    paths.into_iter().map(timed).collect()
}

/// The files that are read where a document becomes `scene`. Frames of a motion, which may be very many, are not: whoever
/// moves the hair reads them.
pub(super) fn read_for(scene: &Scene) -> Vec<PathBuf> {
    let meshes = scene.mesh_paths().into_iter().map(|(_, path)| path);
    let others = [
        scene.tables_path(),
        scene.lut_path(),
        scene.seen_panorama_path(),
    ];
    let named = [scene.groom_path(), scene.lights_path()];
    let read = named.into_iter().chain(others.into_iter().flatten());
    read.chain(meshes).collect()
}

impl OnDisk {
    /// Is there a file, of those that the document names as it is on disk or as `scene`, that others have written?
    pub fn is_changed(&self, path: &Path, scene: &Scene, files: &Files) -> bool {
        let named = [&self.scene, scene].map(Scene::file_paths);
        let own = std::iter::once(path.to_owned());
        let mut all = own.chain(named.into_iter().flatten());
        all.any(|path| self.is_written_by_others(&path, files))
    }

    /// Have others written the file at `path`? One that is being replaced is gone for a moment.
    pub fn is_written_by_others(&self, path: &Path, files: &Files) -> bool {
        let known = self.written.get(path);
        known.is_some_and(|time| {
            let now = files.modified(path);
            now.is_some() && now != *time
        })
    }
}
