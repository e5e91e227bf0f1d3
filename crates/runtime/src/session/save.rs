//! Saving, reading again, and what the disk holds.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use strandlight_formats::{BakedFile, Groom, ProxySection, Scene};

use super::asset_snapshot::{AssetSnapshot, PaintState};
use super::errors::check_size;
use super::history::Step;
use super::on_disk::{FileTimes, OnDisk, text_of, times_of};
use super::{Change, Session};
use crate::error::SessionError;
use strandlight_scene::SceneError;
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::files::{Files, MAX_GROOM_BYTES};

/// Parameter of a groom that a save has made: such a file may be replaced by the next save of the scene that it is called
/// after.
const SAVED_BY: (&str, &str) = ("saved_by", "strandview");

/// What saving wrote.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Saved {
    /// Files, the scene last.
    pub files: Vec<PathBuf>,
}

impl Session {
    /// Is there something that the files do not hold?
    pub fn is_modified(&self) -> bool {
        self.scene != self.on_disk.scene || self.snapshot.paint_state != self.on_disk.paint_state
    }

    /// Is the scene one that was made here and never saved? Then [`Session::path`] is a suggestion.
    pub fn is_unsaved(&self) -> bool {
        self.files.held(&self.path).is_some()
    }

    /// Is the paint other than the groom's file has it?
    pub fn is_repainted(&self) -> bool {
        self.differs_from_file(|state| state.paint)
    }

    /// Is the paint or the mask other than the groom's file has it?
    fn has_own_groom(&self) -> bool {
        self.differs_from_file(|state| state)
    }

    fn differs_from_file<T: PartialEq>(&self, of: impl Fn(PaintState) -> T) -> bool {
        let state = of(self.snapshot.paint_state);
        // Another groom that was put into the scene is as its own file has it.
        state != of(self.on_disk.paint_state) && Some(state) != self.snapshot.file_state.map(of)
    }

    /// Has a file of the document been written by another program since it was read or saved?
    pub fn is_changed_on_disk(&self) -> bool {
        self.on_disk
            .is_changed(&self.path, &self.scene, &self.files)
    }

    /// When a file of the document was written, as of when it was read or saved; `None` where it was neither, and within
    /// that where the time is not known.
    pub fn time_read(&self, path: &Path) -> Option<Option<SystemTime>> {
        self.on_disk.written.get(path).copied()
    }

    /// The scene and all files that it names.
    pub fn file_paths(&self) -> Vec<PathBuf> {
        let scene = [self.path.clone()].into_iter();
        scene.chain(self.scene.file_paths()).collect()
    }

    /// A file that [`Session::save`] would replace although another program has written it since it
    /// was read or saved.
    pub fn conflict(&self) -> Option<&Path> {
        let is_of_others = |path: &PathBuf| self.on_disk.is_written_by_others(path, &self.files);
        let found = self.files_to_write().into_iter().find(is_of_others)?;
        let (path, _) = self.on_disk.written.get_key_value(&found)?;
        Some(path)
    }

    /// The scene, and the groom where it is written with it.
    fn files_to_write(&self) -> Vec<PathBuf> {
        let groom = self
            .has_own_groom()
            .then(|| self.groom_to_write(&self.path));
        [self.path.clone()].into_iter().chain(groom).collect()
    }

    /// What others have written is not wanted: saving replaces it.
    pub fn keep_mine(&mut self) {
        let known: Vec<PathBuf> = self.on_disk.written.keys().cloned().collect();
        self.on_disk.written = times_of(known, &self.files);
    }

    /// What others have written to each [`Session::conflict`] is not wanted. That of other files still is.
    pub fn overrule_conflicts(&mut self) {
        let mut to_write = self.files_to_write();
        to_write.retain(|path| self.on_disk.written.contains_key(path));
        let times = times_of(to_write, &self.files);
        self.on_disk.written.extend(times);
    }

    /// Would [`Session::save_as`] replace a file that is not the document's own scene?
    pub fn replaces_other(&self, path: &Path) -> bool {
        self.files.exists(path) && !is_same(path, &self.path)
    }

    /// `path` as the scene names it: relative, so that scene and files can be moved together.
    pub fn path_in_scene(&self, path: &Path) -> PathBuf {
        match path.strip_prefix(&self.scene.folder) {
            Ok(below) => below.to_owned(),
            Err(_) => path_from(&self.scene.folder, path),
        }
    }

    /// Could [`Session::save_as`] write to `path`?
    ///
    /// # Errors
    /// A folder, no folder to write in, or a file that the scene is made of.
    pub fn check_target(&self, path: &Path) -> Result<(), SessionError> {
        self.check_no_source(path)?;
        Ok(self.files.check_writable(path)?)
    }

    /// A scene is not written over a file that it is made of.
    fn check_no_source(&self, path: &Path) -> Result<(), SessionError> {
        let scene = &self.scene;
        let named = [
            ("groom", Some(scene.groom_path())),
            ("light set", Some(scene.lights_path())),
            ("tables", scene.tables_path()),
            ("LUT", scene.lut_path()),
            ("panorama", scene.panorama_path()),
            ("map", scene.map_path()),
        ];
        let frames = scene.frame_paths().into_iter();
        let frames = frames.map(|frame| ("groom of a frame", Some(frame)));
        let meshes = scene.mesh_paths().into_iter();
        let meshes = meshes.map(|(_, mesh)| ("mesh of a proxy", Some(mesh)));
        for (what, file) in named.into_iter().chain(frames).chain(meshes) {
            if file.is_some_and(|file| is_same(&file, path)) {
                let path = path.to_owned();
                return Err(SessionError::TargetIsSource { path, what });
            }
        }
        Ok(())
    }

    /// Writes the document to the files it was read from. Painted hair goes to a groom file that
    /// an earlier save of this scene has made, or else to a new one: see [`Session::save_as`].
    ///
    /// # Errors
    /// What cannot be written, by name.
    pub fn save(&mut self) -> Result<Saved, SessionError> {
        self.save_to(&self.path.clone(), None)
    }

    /// Writes the scene to `path`, which it has from then on; comments and layout of the file that it was read
    /// from stay. Files that it names stay where they are: relative paths are written so that they lead there. If
    /// the hair was painted or masked since the groom was read or written, the groom goes to a new file beside the
    /// scene, called `NAME-painted.groom` or with a number after that. Hair with neither, whose file may be
    /// other by now, keeps its name, or gets a number after it. Grooms, light sets, panoramas and meshes that were
    /// made here and are in memory only are written beside the scene, under free names.
    ///
    /// # Errors
    /// What cannot be written, by name. What was written before it under a new name goes again.
    pub fn save_as(&mut self, path: &Path) -> Result<Saved, SessionError> {
        self.save_to(path, None)
    }

    /// [`Session::save_as`], with the groom and its paint in the file `groom`, which it replaces if
    /// there is one.
    ///
    /// # Errors
    /// As there.
    pub fn save_with_groom(&mut self, path: &Path, groom: &Path) -> Result<Saved, SessionError> {
        self.save_to(path, Some(groom))
    }

    /// Writes what [`Session::save_as`] writes, and stays the document that it is.
    ///
    /// # Errors
    /// As there.
    pub fn save_copy(&self, path: &Path) -> Result<Saved, SessionError> {
        let plan = self.plan_save(path, None)?;
        Ok(plan.write(&self.files, &mut Vec::new())?)
    }

    fn save_to(&mut self, path: &Path, groom: Option<&Path>) -> Result<Saved, SessionError> {
        let plan = self.plan_save(path, groom)?;
        let mut restored = Vec::new();
        let saved = plan.write(&self.files, &mut restored);
        // Not another program's work.
        self.on_disk.written.extend(times_of(restored, &self.files));
        let saved = saved?;
        self.adopt(plan, &saved);
        Ok(saved)
    }

    /// All that is to be written, so that whatever cannot be is known before anything is.
    fn plan_save(&self, path: &Path, groom: Option<&Path>) -> Result<SavePlan, SessionError> {
        self.check_target(path)?;
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let mut scene = self.scene.clone();
        let is_painted = self.has_own_groom() || groom.is_some();
        move_to(&mut scene, &folder);
        let held = self.place_held(&mut scene, is_painted);
        let painted = match is_painted {
            true => {
                let to = groom.map_or_else(|| self.groom_to_write(path), Path::to_owned);
                scene.groom.file = match to.strip_prefix(&folder) {
                    Ok(below) => below.to_owned(),
                    Err(_) => path_from(&folder, &to),
                };
                Some((to, self.painted_groom().to_bytes()?))
            }
            false => None,
        };
        let old = text_of(&self.path, &self.files);
        let old = old.as_ref().unwrap_or(&self.on_disk.text);
        Ok(SavePlan {
            text: scene.to_toml_over(old)?,
            path: path.to_owned(),
            scene,
            held,
            painted,
        })
    }

    /// The document is what was written. What can be undone moves along, and keeps the new files.
    fn adopt(&mut self, plan: SavePlan, saved: &Saved) {
        let SavePlan {
            text,
            path,
            scene,
            held,
            painted,
        } = plan;
        for Held { from, .. } in &held {
            self.files.release(from);
        }
        let folder = &scene.folder;
        let (old_groom, old_lights) = (self.scene.groom_path(), self.scene.lights_path());
        let state = self.snapshot.paint_state;
        let is_painted = painted.is_some();
        self.history.for_each_scene(|remembered, snapshot| {
            let has_groom = remembered.groom_path() == old_groom;
            let has_lights = remembered.lights_path() == old_lights;
            let (meshes, panorama) = (remembered.mesh_paths(), remembered.panorama_path());
            move_to(remembered, folder);
            if let (Some(from), Some(file)) = (panorama, &mut remembered.lights.panorama)
                && let Some(held) = held.iter().find(|held| held.from == from)
            {
                *file = held.name();
            }
            if has_groom {
                remembered.groom.file.clone_from(&scene.groom.file);
                if let Some(snapshot) = snapshot.filter(|_| is_painted) {
                    snapshot.file_state = Some(state);
                }
            }
            if has_lights {
                remembered.lights.file.clone_from(&scene.lights.file);
            }
            for (ix, from) in meshes {
                if let Some(ProxySection::Mesh { mesh, .. }) = remembered.proxies.get_mut(ix)
                    && let Some(held) = held.iter().find(|held| held.from == from)
                {
                    *mesh = held.name();
                }
            }
        });
        self.history.close();
        if path != self.path {
            // They are the other scene's.
            self.written_grooms.clear();
        }
        if is_painted {
            self.written_grooms.insert(scene.groom_path());
            self.snapshot.file_state = Some(state);
        }
        let is_in_other_folder = scene.folder != self.scene.folder;
        (self.scene, self.path) = (scene, path);
        let mut own = saved.files.clone();
        own.extend(is_painted.then(|| self.scene.groom_path()));
        self.on_disk = OnDisk {
            scene: self.scene.clone(),
            text,
            paint_state: state,
            written: self.times_after_save(own, is_in_other_folder),
        };
        self.cli_overrides.clear();
    }

    /// [`OnDisk::written`] after a save that wrote `own`. What others have written to the other files is not known yet: those
    /// keep the times they had, also where all paths lead from another folder now.
    fn times_after_save(&mut self, own: Vec<PathBuf>, is_in_other_folder: bool) -> FileTimes {
        let mut times = std::mem::take(&mut self.on_disk.written);
        if is_in_other_folder {
            let by_whole = times
                .iter()
                .filter_map(|(path, time)| Some((whole(path)?, *time)));
            let by_whole: FileTimes = by_whole.collect();
            let named = self.scene.file_paths().into_iter();
            let known = named.filter_map(|path| {
                let time = *by_whole.get(&whole(&path)?)?;
                Some((path, time))
            });
            times = known.collect();
        }
        times.extend(times_of(own, &self.files));
        let mut others = self.scene.file_paths();
        others.retain(|path| !times.contains_key(path));
        times.extend(times_of(others, &self.files));
        times
    }

    /// Free names beside `scene` for those of its files that are in memory only, by which it names
    /// them from now on. The groom is not among them where its painted copy is written.
    fn place_held(&self, scene: &mut Scene, is_painted: bool) -> Vec<Held> {
        let folder = scene.folder.clone();
        let mut made: Vec<Held> = Vec::new();
        let mut place = |from: PathBuf, called: &Path, file: &mut PathBuf| {
            if let Some(known) = made.iter().find(|held| held.from == from) {
                *file = known.name();
                return;
            }
            let Some(bytes) = self.files.held(&from) else {
                return;
            };
            let is_taken =
                |to: &Path| to.symlink_metadata().is_ok() || made.iter().any(|held| held.to == to);
            let to = free_name(
                &folder.join(called.file_name().unwrap_or_default()),
                is_taken,
            );
            let held = Held { from, to, bytes };
            *file = held.name();
            made.push(held);
        };
        if !is_painted {
            let groom = self.scene.groom_path();
            place(groom.clone(), &groom, &mut scene.groom.file);
        }
        let lights = self.scene.lights_path();
        place(lights.clone(), &lights, &mut scene.lights.file);
        if let (Some(from), Some(file)) = (self.scene.panorama_path(), &mut scene.lights.panorama) {
            // Called as its light set is, wherever that is written.
            let called = match from == lights.with_extension("panorama") {
                true => scene.lights.file.with_extension("panorama"),
                false => from.clone(),
            };
            place(from, &called, file);
        }
        let meshes = self.scene.mesh_paths();
        for (ix, from) in meshes {
            if let Some(ProxySection::Mesh { mesh, .. }) = scene.proxies.get_mut(ix) {
                place(from.clone(), &from, mesh);
            }
        }
        made
    }

    /// Where the painted groom of a scene at `path` goes by default.
    fn groom_to_write(&self, path: &Path) -> PathBuf {
        let ours = |(key, value): &(String, String)| (&**key, &**value) == (SAVED_BY.0, SAVED_BY.1);
        let parameters = &self.snapshot.assets.groom.source.parameters;
        let groom = self.scene.groom_path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let named = |ix: u32| match ix {
            1 => path.with_file_name(format!("{stem}-painted.groom")),
            ix => path.with_file_name(format!("{stem}-painted-{ix}.groom")),
        };
        // A painted groom of another scene stays that scene's, whoever names it too.
        let is_named_so = groom.parent() == path.parent()
            && (groom.file_stem().unwrap_or_default().to_string_lossy())
                .strip_prefix(&format!("{stem}-painted"))
                .is_some_and(|number| {
                    let digits = number.strip_prefix('-').unwrap_or(number);
                    digits.chars().all(|digit| digit.is_ascii_digit())
                });
        let is_of_file = self.on_disk.scene.groom_path() == groom;
        let is_saved_before = is_of_file && is_named_so && parameters.iter().any(ours);
        if path == self.path && (is_saved_before || self.written_grooms.contains(&groom)) {
            return groom;
        }
        if self.snapshot.paint.is_none() && self.snapshot.mask.is_none() {
            // Its file was read again, and may hold other hair now.
            let called = path.with_file_name(groom.file_name().unwrap_or_default());
            return free_name(&called, |path| self.files.exists(path));
        }
        let free = (1..10_000).map(named).find(|path| !self.files.exists(path));
        free.unwrap_or_else(|| named(10_000))
    }

    /// The groom with its paint and its mask as attributes.
    pub fn painted_groom(&self) -> Groom {
        let mut groom = Groom::clone(&self.snapshot.assets.groom);
        if let Some(paint) = &self.snapshot.paint {
            paint.write_to(&mut groom);
        }
        if let Some(mask) = &self.snapshot.mask {
            mask.write_to(&mut groom);
        }
        let parameters = &mut groom.source.parameters;
        parameters.retain(|(key, _)| key != SAVED_BY.0);
        parameters.push((SAVED_BY.0.to_owned(), SAVED_BY.1.to_owned()));
        groom
    }

    /// Reads all files again, with the values of [`Session::apply_cli_overrides`] over them, as one
    /// step that can be undone. Edits that were not saved are taken back by it.
    ///
    /// # Errors
    /// As [`Session::open`]; nothing is changed then.
    pub fn reload(&mut self) -> Result<Change, SessionError> {
        let mut times = times_of([self.path.clone()], &self.files);
        if self.is_put_back() {
            self.on_disk.written.extend(times);
            return Ok(Change::default());
        }
        let scene = self.files.scene(&self.path)?;
        let scene = self.with_values(scene, &self.cli_overrides)?;
        times.extend(times_of(scene.file_paths(), &self.files));
        let in_scene = |error: SceneError| error.in_file(&self.path);
        let assets = Assets::read(&scene, &self.files, ModesToRead::All).map_err(in_scene)?;
        check_size(&scene).map_err(in_scene)?;
        let state = self.next_paint_state();
        let after = AssetSnapshot::new(assets, state)?;
        self.on_disk.scene = scene.clone();
        self.on_disk.text = text_of(&self.path, &self.files).unwrap_or_default();
        self.on_disk.paint_state = PaintState::of(state);
        self.on_disk.written.extend(times);
        let mut before = std::mem::replace(&mut self.snapshot, after.clone());
        let groom = self.scene.groom_path();
        // What its file had is no more; one in memory is nobody else's.
        if self.files.held(&groom).is_none() {
            before.file_state = None;
            self.history.for_each_scene(|remembered, snapshot| {
                if let Some(snapshot) = snapshot.filter(|_| remembered.groom_path() == groom) {
                    snapshot.file_state = None;
                }
            });
        }
        let step = Step::Scene {
            before: Box::new(std::mem::replace(&mut self.scene, scene.clone())),
            after: Box::new(scene),
            snapshot: Some(Box::new([before, after])),
        };
        self.history.close();
        self.history.push("reload", step);
        self.history.close();
        Ok(Change::everything())
    }

    /// Has the scene file been written with the text that it had, and nothing else changed?
    fn is_put_back(&self) -> bool {
        let is_written = |path: &Path| self.on_disk.is_written_by_others(path, &self.files);
        !self.is_modified()
            && is_written(&self.path)
            && !self.scene.file_paths().iter().any(|path| is_written(path))
            && text_of(&self.path, &self.files).as_ref() == Some(&self.on_disk.text)
    }
}

/// A document as it is to be written.
struct SavePlan {
    path: PathBuf,
    /// As it will be there, and its text.
    scene: Scene,
    text: String,
    /// Files that are in memory only.
    held: Vec<Held>,
    /// Where the painted groom goes, and what it is.
    painted: Option<(PathBuf, Vec<u8>)>,
}

impl SavePlan {
    /// Writes the files, the scene last. Where one cannot be written, those before it are as they were: `restored` has those that had been
    /// replaced.
    fn write(
        &self,
        files: &Files,
        restored: &mut Vec<PathBuf>,
    ) -> Result<Saved, strandlight_formats::Error> {
        let held = self.held.iter().map(|held| (&held.to, &held.bytes[..]));
        let painted = self.painted.iter().map(|(to, bytes)| (to, &bytes[..]));
        let scene = std::iter::once((&self.path, self.text.as_bytes()));
        let (mut saved, mut before) = (Saved::default(), Vec::new());
        for (to, bytes) in held.chain(painted).chain(scene) {
            // The scene is the last one.
            let was_there = *to != self.path && files.exists(to);
            before.push(was_there.then(|| files.read(to, MAX_GROOM_BYTES)));
            if let Err(error) = files.write(to, bytes) {
                for (made, before) in saved.files.iter().zip(before) {
                    match before {
                        None => files.remove(made),
                        Some(Ok(bytes)) if files.write(made, &bytes).is_ok() => {
                            restored.push(made.clone());
                        }
                        // Nobody can say what it was.
                        Some(_) => {}
                    }
                }
                return Err(error);
            }
            saved.files.push(to.clone());
        }
        Ok(saved)
    }
}

/// A file that was made and is in memory only: where it is held, and where it is written.
struct Held {
    from: PathBuf,
    to: PathBuf,
    bytes: Arc<[u8]>,
}

impl Held {
    /// As a scene beside it names it.
    fn name(&self) -> PathBuf {
        PathBuf::from(self.to.file_name().unwrap_or_default())
    }
}

/// `path`, or with a number before its extension where that `is_taken`.
pub(crate) fn free_name(path: &Path, is_taken: impl Fn(&Path) -> bool) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let named = |ix: u32| {
        let extension = path
            .extension()
            .map(|x| format!(".{}", x.to_string_lossy()));
        path.with_file_name(format!("{stem}-{ix}{}", extension.unwrap_or_default()))
    };
    if !is_taken(path) {
        return path.to_owned();
    }
    let free = (2..10_000).map(named).find(|path| !is_taken(path));
    free.unwrap_or_else(|| named(10_000))
}

/// Makes the paths of `scene` lead from `folder` to the files that they lead to now.
fn move_to(scene: &mut Scene, folder: &Path) {
    if scene.folder == folder {
        return;
    }
    let from = std::mem::replace(&mut scene.folder, folder.to_owned());
    let files = [&mut scene.groom.file, &mut scene.lights.file];
    let tables = scene.tables.as_mut().map(|tables| &mut tables.file);
    let lut = scene.render.lut.as_mut();
    let motion = scene.motion.iter_mut();
    let frames = motion.flat_map(|motion| &mut motion.frames);
    let meshes = scene.proxies.iter_mut().filter_map(|proxy| match proxy {
        ProxySection::Mesh { mesh, .. } => Some(mesh),
        _ => None,
    });
    let of_lights = [&mut scene.lights.panorama, &mut scene.lights.map];
    let of_lights = of_lights.into_iter().flatten();
    let files = files.into_iter().chain(tables).chain(lut).chain(of_lights);
    for file in files.chain(frames).chain(meshes) {
        // An absolute path stays.
        if !file.is_absolute() {
            *file = path_from(folder, &from.join(&*file));
        }
    }
}

/// `target` as seen from `folder`.
fn path_from(folder: &Path, target: &Path) -> PathBuf {
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

/// Do both paths lead to the same file?
fn is_same(a: &Path, b: &Path) -> bool {
    a == b || whole(a).is_some_and(|whole_a| Some(whole_a) == whole(b))
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
