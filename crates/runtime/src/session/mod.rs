//! The document of a viewer: a scene and its groom, edits of them, undo, saving.
//!
//! - [`Session`]: the document. [`Session::edit`] changes keys of the [`Scene`]; whoever shows it
//!   reads from a [`Change`] what to recompute.
//! - [`with_key`]: one value by the name it has in the file.
//!
//! Nothing here needs a device.

mod asset_snapshot;
mod change;
mod errors;
mod history;
mod keys;
mod on_disk;
#[cfg(not(target_arch = "wasm32"))]
mod recovery;
mod save;
#[cfg(test)]
pub(crate) mod tests;

pub use change::Change;
// The table of ARCHITECTURE.md is made from them.
#[doc(hidden)]
pub use change::{EDITS, EditRule, Edits};
pub use history::{MAX_FILE_BYTES, MAX_STEPS, MAX_STROKE_POINTS};
pub use keys::{parse_value, with_key};
pub use save::Saved;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use save::free_name;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Map, Value};
use strandlight_formats::{CameraSection, Groom, LightSet, Scene};

use crate::error::SessionError;
use asset_snapshot::{AssetSnapshot, PaintState};
use errors::check_size;
use history::{History, Step};
use on_disk::{OnDisk, read_for, text_of, times_of};
use strandlight_scene::SceneError;
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::files::Files;
pub use strandlight_scene::keys::camera_section as section_of;
use strandlight_scene::keys::with_values;
use strandlight_scene::paint::{BrushEffect, Canvas, Paint, PointMask, Stroke};
use strandlight_scene::panorama::TurnedPanorama;
use strandlight_scene::scene::PreparedScene;

/// A scene that is open for editing.
#[derive(Clone, Debug)]
pub struct Session {
    files: Files,
    path: PathBuf,
    scene: Scene,
    snapshot: AssetSnapshot,
    history: History,
    on_disk: OnDisk,
    /// States of paint and mask so far.
    n_paint_states: u64,
    /// Grooms that saving has made.
    written_grooms: BTreeSet<PathBuf>,
    /// Values that stand over those of the file: see [`Session::apply_cli_overrides`].
    cli_overrides: Map<String, Value>,
}

impl Session {
    /// Opens the scene file at `path` and all that it names.
    ///
    /// # Errors
    /// The first file that cannot be read or value that cannot be used, by name.
    pub fn open(path: &Path) -> Result<Session, SessionError> {
        Session::open_in(path, Files::Disk)
    }

    /// [`Session::open`], with files from elsewhere.
    ///
    /// # Errors
    /// As there.
    pub fn open_in(path: &Path, files: Files) -> Result<Session, SessionError> {
        let mut written = times_of([path.to_owned()], &files);
        let scene = files.scene(path)?;
        let in_scene = |error: SceneError| error.in_file(path);
        written.extend(times_of(scene.file_paths(), &files));
        let assets = Assets::read(&scene, &files, ModesToRead::All).map_err(in_scene)?;
        check_size(&scene).map_err(in_scene)?;
        Ok(Session {
            on_disk: OnDisk {
                scene: scene.clone(),
                text: text_of(path, &files).unwrap_or_default(),
                paint_state: PaintState::default(),
                written,
            },
            path: path.to_owned(),
            snapshot: AssetSnapshot::new(assets, 0)?,
            n_paint_states: 0,
            written_grooms: BTreeSet::new(),
            cli_overrides: Map::new(),
            scene,
            files,
            history: History::default(),
        })
    }

    /// The scene file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where files come from and go to.
    pub fn files(&self) -> &Files {
        &self.files
    }

    /// The scene as it is edited now.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The files that the scene names.
    pub fn assets(&self) -> &Assets {
        &self.snapshot.assets
    }

    /// The groom as its file has it.
    pub fn groom(&self) -> &Groom {
        &self.snapshot.assets.groom
    }

    /// The paint of the groom's points; `None` where nothing was ever painted.
    pub fn paint(&self) -> Option<&Paint> {
        self.snapshot.paint.as_deref()
    }

    /// The paint, where strokes changed that of the groom's file.
    pub fn own_paint(&self) -> Option<&Paint> {
        self.paint().filter(|_| self.is_repainted())
    }

    /// The paint, for a stroke that ends with [`Session::stroke`].
    pub fn paint_mut(&mut self) -> &mut Paint {
        let n_points = self.snapshot.assets.groom.points.len();
        let unpainted = || Arc::new(Paint::unpainted(n_points));
        Arc::make_mut(self.snapshot.paint.get_or_insert_with(unpainted))
    }

    /// What brushes leave alone; `None` where nothing was ever protected.
    pub fn mask(&self) -> Option<&PointMask> {
        self.snapshot.mask.as_deref()
    }

    /// Is any hair protected from brushes?
    pub fn is_masked(&self) -> bool {
        self.mask().is_some_and(PointMask::is_protecting)
    }

    /// The mask, for a stroke that ends with [`Session::stroke`].
    pub fn mask_mut(&mut self) -> &mut PointMask {
        let n_points = self.snapshot.assets.groom.points.len();
        let none = || Arc::new(PointMask::none(n_points));
        Arc::make_mut(self.snapshot.mask.get_or_insert_with(none))
    }

    /// What a brush with this effect changes, for a stroke that ends with [`Session::stroke`]. Hair that is masked
    /// alone gets no paint by it.
    pub fn canvas(&mut self, effect: BrushEffect) -> Canvas<'_> {
        if effect.is_of_mask() {
            return Canvas::Mask(self.mask_mut());
        }
        self.paint_mut();
        let AssetSnapshot { paint, mask, .. } = &mut self.snapshot;
        let paint = Arc::make_mut(paint.get_or_insert_default());
        Canvas::Paint(paint, mask.as_deref())
    }

    /// The light set as its file has it.
    pub fn light_set(&self) -> &LightSet {
        &self.snapshot.assets.lights
    }

    /// The map behind the hair, turned and multiplied as the scene says, where it is seen.
    pub fn panorama(&self) -> Option<TurnedPanorama> {
        self.snapshot.assets.turned_panorama(&self.scene.lights)
    }

    /// The document, ready to be rendered: see [`PreparedScene::new`].
    ///
    /// # Errors
    /// What cannot be drawn, by name.
    pub fn prepared(&self) -> Result<PreparedScene, SceneError> {
        PreparedScene::with_paint(&self.scene, &self.snapshot.assets, self.paint())
    }

    /// The scene's camera, or where there is none the one that its pictures have.
    pub fn camera(&self) -> CameraSection {
        if let Some(camera) = &self.scene.camera {
            return camera.clone();
        }
        section_of(&self.snapshot.assets.framing(&self.scene))
    }

    /// Changes the scene. Edits of the same `label` in a row are one step to undo, until
    /// [`Session::commit`].
    ///
    /// # Errors
    /// A value outside its range or a file that cannot be read; nothing is changed then.
    pub fn edit(
        &mut self,
        label: &str,
        change: impl FnOnce(&mut Scene),
    ) -> Result<Change, SessionError> {
        let mut after = self.scene.clone();
        change(&mut after);
        after.folder.clone_from(&self.scene.folder);
        if after == self.scene {
            return Ok(Change::default());
        }
        after.validate()?;
        check_size(&after)?;
        let before = &self.snapshot.assets;
        let change = Change::between(&self.scene, &after);
        let known = read_for(&self.scene);
        let others = read_for(&after);
        let others = others.into_iter().filter(|path| !known.contains(path));
        let times = times_of(others, &self.files);
        let assets = before.reread(&self.scene, &after, &self.files)?;
        self.on_disk.written.extend(times);
        let snapshot = if change.has(Edits::GEOMETRY) {
            let after = AssetSnapshot::new(assets, self.next_paint_state())?;
            let before = std::mem::replace(&mut self.snapshot, after.clone());
            Some(Box::new([before, after]))
        } else if change.has(Edits::LIGHTS | Edits::TABLES)
            || !Arc::ptr_eq(&assets.meshes, &before.meshes)
            || has_other_grade(&assets, before)
        {
            let before = std::mem::replace(&mut self.snapshot.assets, assets.clone());
            // The groom is the same, so its paint is not the step's business.
            Some(Box::new([before, assets].map(|assets| AssetSnapshot {
                assets,
                paint: None,
                mask: None,
                paint_state: PaintState::default(),
                file_state: None,
            })))
        } else {
            None
        };
        let step = Step::Scene {
            before: Box::new(std::mem::replace(&mut self.scene, after.clone())),
            after: Box::new(after),
            snapshot,
        };
        self.history.push(label, step);
        Ok(change)
    }

    /// Gives the points of `stroke` their paint and mask, as one step to undo. Points that have it already,
    /// because they were changed while the stroke was made, stay as they are.
    pub fn stroke(&mut self, stroke: Stroke) -> Change {
        if stroke.is_empty() {
            // The stroke may have made paint that says nothing: hair without any is drawn as bare hair.
            self.snapshot.paint.take_if(|paint| !paint.is_painted());
            return Change::default();
        }
        let change = self.apply(&stroke, Direction::After);
        let (before, number) = (self.snapshot.paint_state, self.next_paint_state());
        let after = &mut self.snapshot.paint_state;
        if !stroke.changed.is_empty() {
            after.paint = number;
        }
        if !stroke.masked.is_empty() {
            after.mask = number;
        }
        let states = [before, *after];
        let label = match stroke.changed.is_empty() {
            true => "mask",
            false => "paint",
        };
        let step = Step::Stroke {
            stroke: Arc::new(stroke),
            states,
        };
        self.history.close();
        self.history.push(label, step);
        self.history.close();
        change
    }

    /// What there is of paint and mask alone is made where a stroke needs it.
    fn apply(&mut self, stroke: &Stroke, direction: Direction) -> Change {
        let mut change = Change::default();
        if !stroke.changed.is_empty() {
            let paint = self.paint_mut();
            let range = match direction {
                Direction::Before => paint.revert(stroke),
                Direction::After => paint.apply(stroke),
            };
            change = Change::painted(range.unwrap_or_default());
        }
        if !stroke.masked.is_empty() {
            let mask = self.mask_mut();
            match direction {
                Direction::Before => mask.revert(stroke),
                Direction::After => mask.apply(stroke),
            };
            change.edits |= Edits::MASK;
        }
        change
    }

    fn next_paint_state(&mut self) -> u64 {
        self.n_paint_states += 1;
        self.n_paint_states
    }

    /// Sets values by the names of their keys, as one step; see [`with_key`]. A key below `camera`
    /// changes the view there is, even where the scene leaves it to the program.
    ///
    /// # Errors
    /// As [`with_key`] and [`Session::edit`]; nothing is changed then.
    pub fn set(&mut self, values: &Map<String, Value>) -> Result<Change, SessionError> {
        let scene = self.with_values(self.scene.clone(), values)?;
        let keys: Vec<&str> = values.keys().map(String::as_str).collect();
        self.commit();
        let change = self.edit(&format!("set {}", keys.join(", ")), |old| *old = scene);
        self.commit();
        change
    }

    /// Opens the scene with other values than its file has, as a command line does: they are no
    /// change that must be saved and no step to undo, and stay when the files are read again.
    /// Saving writes them with the rest; they are the file's then. Forgets all steps.
    ///
    /// # Errors
    /// As [`Session::set`]; nothing is changed then.
    pub fn apply_cli_overrides(
        &mut self,
        values: &Map<String, Value>,
    ) -> Result<Change, SessionError> {
        let is_modified = self.is_modified();
        let change = self.set(values)?;
        self.history = History::default();
        let cli_overrides = values
            .iter()
            .map(|(key, value)| (key.clone(), value.clone()));
        self.cli_overrides.extend(cli_overrides);
        if !is_modified {
            self.on_disk.scene = self.scene.clone();
            self.on_disk.paint_state = self.snapshot.paint_state;
            // What was read has its time.
            let mut named = self.scene.file_paths();
            named.retain(|path| !self.on_disk.written.contains_key(path));
            let times = times_of(named, &self.files);
            self.on_disk.written.extend(times);
        }
        Ok(change)
    }

    fn with_values(
        &self,
        scene: Scene,
        values: &Map<String, Value>,
    ) -> Result<Scene, SessionError> {
        Ok(with_values(scene, values, || self.camera())?)
    }

    /// Ends a step: the next edit is another one, whatever its label.
    pub fn commit(&mut self) {
        self.history.close();
    }

    /// Takes the last step back. `None` if there is none.
    pub fn undo(&mut self) -> Option<Change> {
        let step = self.history.undo()?;
        Some(self.take(step, Direction::Before))
    }

    /// Does again what was undone last. `None` if there is none.
    pub fn redo(&mut self) -> Option<Change> {
        let step = self.history.redo()?;
        Some(self.take(step, Direction::After))
    }

    /// Is there a step to undo?
    pub fn can_undo(&self) -> bool {
        self.undo_label().is_some()
    }

    /// Is there a step to do again?
    pub fn can_redo(&self) -> bool {
        self.redo_label().is_some()
    }

    /// Label of the step that [`Session::undo`] takes back.
    pub fn undo_label(&self) -> Option<&str> {
        self.history.labels()[0]
    }

    /// Label of the step that [`Session::redo`] does again.
    pub fn redo_label(&self) -> Option<&str> {
        self.history.labels()[1]
    }

    /// Steps that can be undone, oldest first, then those that can be done again: label, and a number of the state after
    /// it that no other state has.
    pub fn steps(&self) -> impl Iterator<Item = (&str, u64)> {
        self.history.steps()
    }

    /// How many of [`Session::steps`] can be undone.
    pub fn n_done(&self) -> usize {
        self.history.n_done()
    }

    /// Number of the state after the first `n_done` steps; that before all of them where there are fewer.
    pub fn state_after(&self, n_done: usize) -> u64 {
        let last = n_done.checked_sub(1);
        let step = last.and_then(|last| self.history.steps().nth(last));
        step.map_or(self.history.first_state(), |(_, state)| state)
    }

    /// Undoes or does again until the first `n_done` of [`Session::steps`] are done, or as many as there are. `None` where
    /// they are already.
    pub fn go_to(&mut self, n_done: usize) -> Option<Change> {
        let mut all: Option<Change> = None;
        loop {
            let stepped = match self.n_done().cmp(&n_done) {
                std::cmp::Ordering::Greater => self.undo(),
                std::cmp::Ordering::Less => self.redo(),
                std::cmp::Ordering::Equal => None,
            };
            let Some(change) = stepped else {
                return all;
            };
            all = Some(match all {
                Some(all) => all.and(change),
                None => change,
            });
        }
    }

    /// The last edit could be shown.
    pub(crate) fn keep_edit(&mut self) {
        self.history.keep();
    }

    /// Takes the last edit back, as if it had not been made: it could not be shown.
    pub(crate) fn abandon(&mut self) -> Option<Change> {
        let step = self.history.take_back()?;
        Some(self.take(step, Direction::Before))
    }

    fn take(&mut self, step: Step, direction: Direction) -> Change {
        match step {
            Step::Scene {
                before,
                after,
                snapshot,
            } => {
                let scene = direction.pick(*before, *after);
                let mut change = Change::between(&self.scene, &scene);
                self.scene = scene;
                if let Some(snapshot) = snapshot {
                    let [before, after] = *snapshot;
                    let snapshot = direction.pick(before, after);
                    // Only another groom brings other paint.
                    let keeps_paint =
                        Arc::ptr_eq(&snapshot.assets.groom, &self.snapshot.assets.groom);
                    let old = std::mem::replace(&mut self.snapshot, snapshot);
                    if keeps_paint {
                        (self.snapshot.paint, self.snapshot.mask) = (old.paint, old.mask);
                        self.snapshot.paint_state = old.paint_state;
                        self.snapshot.file_state = old.file_state;
                    }
                    let old = old.assets;
                    let new = &self.snapshot.assets;
                    for (edit, is_other) in [
                        (Edits::GEOMETRY, !Arc::ptr_eq(&old.groom, &new.groom)),
                        (Edits::LIGHTS, !Arc::ptr_eq(&old.lights, &new.lights)),
                        (Edits::TABLES, !Arc::ptr_eq(&old.tables, &new.tables)),
                        (Edits::PROXIES, !Arc::ptr_eq(&old.meshes, &new.meshes)),
                        (Edits::GRADE, has_other_grade(&old, new)),
                    ] {
                        change.edits.set(edit, is_other || change.has(edit));
                    }
                }
                change
            }
            Step::Stroke { stroke, states } => {
                let change = self.apply(&stroke, direction);
                let [before, after] = states;
                self.snapshot.paint_state = direction.pick(before, after);
                change
            }
        }
    }
}

/// Which way a step is taken.
#[derive(Clone, Copy)]
enum Direction {
    Before,
    After,
}

impl Direction {
    fn pick<T>(self, before: T, after: T) -> T {
        match self {
            Direction::Before => before,
            Direction::After => after,
        }
    }
}

/// Are pictures shown by another LUT, or before another map, or by one and by none?
fn has_other_grade(a: &Assets, b: &Assets) -> bool {
    let has_other_lut = a.lut.as_ref().map(Arc::as_ptr) != b.lut.as_ref().map(Arc::as_ptr);
    let map = |assets: &Assets| assets.panorama.as_ref().map(Arc::as_ptr);
    has_other_lut || map(a) != map(b)
}
