//! Saving, reading again, and what the disk holds.

use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use strandlight_formats::Scene;

use super::history::Step;
use super::{Change, Held, Session, check_size, told};
use crate::assets::{Assets, ModesToRead};
use crate::error::SceneError;
use crate::files::Files;

/// The document as it is on disk.
#[derive(Clone, Debug)]
pub(super) struct OnDisk {
    scene: Scene,
    /// The files and when they were written.
    written: Vec<(PathBuf, Option<SystemTime>)>,
}

impl OnDisk {
    pub fn new(path: &Path, scene: &Scene, files: &Files) -> OnDisk {
        let written = [path.to_owned(), scene.groom_path(), scene.lights_path()]
            .into_iter()
            .chain(scene.tables_path())
            .chain(scene.frame_paths())
            .map(|path| {
                let time = files.modified(&path);
                (path, time)
            })
            .collect();
        OnDisk {
            scene: scene.clone(),
            written,
        }
    }
}

/// What saving wrote.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Saved {
    /// Files, the scene last.
    pub files: Vec<PathBuf>,
}

impl Session {
    /// Is there something that the files do not hold?
    pub fn is_modified(&self) -> bool {
        self.scene != self.on_disk.scene
    }

    /// Has a file of the document been written by somebody else since it was read or saved?
    pub fn is_changed_on_disk(&self) -> bool {
        let changed = |(path, time): &(PathBuf, Option<SystemTime>)| {
            // A file that is being replaced is gone for a moment.
            let now = self.files.modified(path);
            now.is_some() && now != *time
        };
        self.on_disk.written.iter().any(changed)
    }

    /// Writes the document to the files it was read from.
    ///
    /// # Errors
    /// What cannot be written, by name.
    pub fn save(&mut self) -> Result<Saved, SceneError> {
        self.save_as(&self.path.clone())
    }

    /// Writes the scene to `path`, which it has from then on. Files that it names stay where they
    /// are: relative paths are written so that they lead there.
    ///
    /// # Errors
    /// What cannot be written, by name; files that were written before it stay.
    pub fn save_as(&mut self, path: &Path) -> Result<Saved, SceneError> {
        self.files.check_writable(path).map_err(told)?;
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let mut scene = self.scene.clone();
        move_to(&mut scene, &folder);
        let text = scene.to_toml_string().map_err(told)?;
        self.files.write(path, text.as_bytes()).map_err(told)?;
        self.history.for_each_scene(|scene| move_to(scene, &folder));
        self.history.close();
        self.scene = scene;
        self.path = path.to_owned();
        self.on_disk = OnDisk::new(&self.path, &self.scene, &self.files);
        Ok(Saved {
            files: vec![path.to_owned()],
        })
    }

    /// Reads all files again, as one step that can be undone. Edits that were not saved are taken
    /// back by it.
    ///
    /// # Errors
    /// As [`Session::open`]; nothing is changed then.
    pub fn reload(&mut self) -> Result<Change, SceneError> {
        let scene = self.files.scene(&self.path).map_err(told)?;
        let assets = Assets::read(&scene, &self.files, ModesToRead::All)?;
        check_size(&scene)?;
        self.on_disk = OnDisk::new(&self.path, &scene, &self.files);
        let after = Held { assets };
        let before = std::mem::replace(&mut self.held, after.clone());
        let step = Step::Scene {
            before: Box::new(std::mem::replace(&mut self.scene, scene.clone())),
            after: Box::new(scene),
            held: Some(Box::new([before, after])),
        };
        self.history.close();
        self.history.push("reload", step);
        self.history.close();
        Ok(Change::everything())
    }
}

/// Makes the paths of `scene` lead from `folder` to the files that they lead to now.
fn move_to(scene: &mut Scene, folder: &Path) {
    if scene.folder == folder {
        return;
    }
    let from = std::mem::replace(&mut scene.folder, folder.to_owned());
    let files = [&mut scene.groom.file, &mut scene.lights.file];
    let tables = scene.tables.as_mut().map(|tables| &mut tables.file);
    let motion = scene.motion.iter_mut();
    let frames = motion.flat_map(|motion| &mut motion.frames);
    for file in files.into_iter().chain(tables).chain(frames) {
        *file = path_from(folder, &from.join(&*file), file);
    }
}

/// `target` as seen from `folder`; an absolute path as it was `given` stays.
fn path_from(folder: &Path, target: &Path, given: &Path) -> PathBuf {
    if given.is_absolute() {
        return given.to_owned();
    }
    let (Some(folder), Some(target)) = (whole(folder), whole(target)) else {
        return target.to_owned();
    };
    let shared = folder
        .components()
        .zip(target.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = folder
        .components()
        .skip(shared)
        .map(|_| Component::ParentDir);
    let down = target.components().skip(shared);
    up.chain(down).collect()
}

/// The path from the root, links resolved as far as there are files; `None` where there is no such
/// thing or the paths of a page start nowhere.
fn whole(path: &Path) -> Option<PathBuf> {
    if let Ok(found) = path.canonicalize() {
        return Some(found);
    }
    let path = match path.as_os_str().is_empty() {
        true => Path::new("."),
        false => path,
    };
    let folder = path.parent()?;
    let folder = match folder.as_os_str().is_empty() {
        true => Path::new("."),
        false => folder,
    };
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => Some(folder.join(name)),
        (Ok(folder), None) => Some(folder),
        (Err(_), _) => std::path::absolute(path).ok(),
    }
}
