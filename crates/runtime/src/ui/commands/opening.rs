//! Files that are opened, and work in the background.

use std::path::{Path, PathBuf};

use serde_json::json;
use strandlight_formats::Background;
use strandlight_scene::RenderError;
use strandlight_scene::interactive::PictureProgress;

use crate::error::SessionError;
use crate::session::Session;
use crate::ui::commands::files::scene_picker;
use crate::ui::document::Document;
use crate::ui::job::{Job, JobResult, News, Wanted};
use crate::ui::layout::UiState;
use crate::ui::orbit::Bounds;
use crate::ui::photo::{Photo, is_photo};
use crate::ui::questions::{Then, name_of};
use crate::ui::views::Views;
use crate::ui::workspace::Workspace;
use crate::viewer::Viewer;

impl Workspace {
    /// Takes a file that was chosen, or dropped on the window.
    pub(in crate::ui) fn take_file(&mut self, path: &Path) {
        use crate::opening::{Openable, fit_map, import_hair, kind_of};
        use strandlight_formats::BakedFile;

        self.end_stroke();
        if is_photo(path) {
            match Photo::read(path) {
                Ok(photo) => {
                    self.state.error = None;
                    self.state.paint.open_photo(photo);
                }
                Err(error) => self.fail(&error.to_string()),
            }
            self.is_outdated = true;
            self.window.request_redraw();
            return;
        }
        let from = path.to_owned();
        let name = name_of(path);
        match kind_of(path) {
            Ok(Openable::Scene) => self.before_losing(Then::Open(from)),
            Ok(Openable::Groom) => self.swap_hair(path, path, &[]),
            Ok(kind @ (Openable::Lights | Openable::Panorama | Openable::Lut)) => {
                self.swap(kind, path, path);
            }
            Ok(Openable::Hair) => self.begin(Job::start(format!("Reading {name}"), move |_| {
                let imported = import_hair(&from)?;
                Ok(JobResult::Groom {
                    bytes: imported.groom.to_bytes()?,
                    notes: imported.notes,
                    from,
                })
            })),
            Ok(Openable::Map) => {
                let title = format!("Fitting lights to {name}");
                self.begin(Job::start(title, move |work| {
                    let fitted = fit_map(&from, work)?;
                    Ok(JobResult::Lights { from, fitted })
                }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
        self.window.request_redraw();
    }

    /// Takes a file that was dropped on the window, after those that were dropped before it.
    pub(in crate::ui) fn drop_file(&mut self, path: &Path) {
        self.dropped.push_back(path.to_owned());
        self.take_dropped();
        if !self.dropped.is_empty() {
            self.say(&format!("{} is opened afterwards", name_of(path)));
            self.window.request_redraw();
        }
    }

    /// Takes files that were dropped, while no work is under way that they would stop, and no question is open about the
    /// scene that they change.
    pub(in crate::ui) fn take_dropped(&mut self) {
        while self.job.is_none() && self.state.question.is_none() {
            let Some(path) = self.dropped.pop_front() else {
                return;
            };
            self.take_file(&path);
        }
    }

    /// Waits for work; what was under way is stopped.
    pub(in crate::ui) fn begin(&mut self, job: Job) {
        self.log.write("job", json!({ "title": job.title }));
        if let Some(other) = self.job.replace(job) {
            other.stop();
        }
        self.is_outdated = true;
        self.window.request_redraw();
    }

    /// Takes up what work has made.
    pub(in crate::ui) fn poll_job(&mut self) {
        use crate::opening::{Openable, beside, beside_map};

        let news = self.job.as_ref().map_or(News::None, Job::news);
        if matches!(news, News::None) {
            return;
        }
        self.job = None;
        let files = self.viewer.session().files().clone();
        match news {
            News::None => {}
            News::Failed(reason) => self.fail(&reason),
            News::Stopped => self.say("Cancelled"),
            News::Done(JobResult::Scene { from, session }) => self.show_session(from, *session),
            News::Done(JobResult::Groom { from, bytes, notes }) => {
                let path = std::path::absolute(&from).unwrap_or_else(|_| from.clone());
                let path = beside(&path, "groom", &files);
                files.hold(&path, bytes);
                self.swap_hair(&path, &from, &notes);
            }
            News::Done(JobResult::Lights { from, fitted }) => {
                let path = std::path::absolute(&from).unwrap_or_else(|_| from.clone());
                let [path, panorama] = beside_map(&path, &files);
                files.hold(&path, fitted.lights);
                files.hold(&panorama, fitted.panorama);
                if self.swap(Openable::Lights, &path, &from) {
                    self.say(&format!("{}: {}", name_of(&from), fitted.figures));
                }
            }
            News::Done(JobResult::Chosen {
                wanted,
                path,
                is_missing,
            }) => match (wanted, path) {
                (Wanted::Open, Some(path)) => self.take_file(&path),
                (Wanted::SaveAs(then), Some(path)) => {
                    // The desktop may leave the ending out.
                    let file = scene_picker(path.display().to_string()).file();
                    self.save_as(file.display().to_string(), then, false);
                }
                (Wanted::Open, None) if is_missing => self.list_files(),
                (Wanted::SaveAs(then), None) if is_missing => self.list_places(then),
                _ => {}
            },
            News::Done(JobResult::Pictures(paths)) => {
                let (first, n) = (paths.first().map(|path| path.display()), paths.len());
                let first = first.map(|path| path.to_string()).unwrap_or_default();
                self.say(&match n {
                    1 => format!("Wrote {first}"),
                    _ => format!("Wrote {n} frames, the first one {first}"),
                });
                self.log
                    .write("picture", json!({ "path": first, "frames": n }));
            }
        }
        self.window.request_redraw();
    }

    /// Puts another groom into the scene, as [`Workspace::swap`] does, and has the view show it. `notes` tell how its file was
    /// read.
    fn swap_hair(&mut self, path: &Path, from: &Path, notes: &[String]) {
        let before = Bounds::of(&self.viewer.prepared().strands);
        if !self.swap(crate::opening::Openable::Groom, path, from) {
            return;
        }
        let mut said = self.state.message.clone();
        if self.frame_other_hair(before) {
            said += "; the view was moved to show it, Alt+Left goes back";
        }
        if !notes.is_empty() {
            said += &format!("; {}", notes.join("; "));
        }
        self.say(&said);
    }

    /// Puts another groom, light set, panorama or LUT into the scene, that of the file `from`, which is remembered; answers
    /// whether it is another one.
    pub(super) fn swap(
        &mut self,
        kind: crate::opening::Openable,
        path: &Path,
        from: &Path,
    ) -> bool {
        let is_other = self.put_in(kind, path, from);
        if is_other {
            self.state.settings.opened(from);
        }
        is_other
    }

    /// [`Workspace::swap`] of which nothing is remembered. With a light set comes its panorama, and the map where it was
    /// fitted to that here.
    pub(super) fn put_in(
        &mut self,
        kind: crate::opening::Openable,
        path: &Path,
        from: &Path,
    ) -> bool {
        use crate::opening::{Openable, panorama_of};

        let file = self.viewer.session().path_in_scene(path);
        let name = name_of(from);
        let label = format!("{} {name}", kind.name());
        let session = self.viewer.session();
        let n_before = session.light_set().lights.len();
        // Where it cannot be read the edit says so.
        let n_after = match kind {
            Openable::Lights => session.files().lights(path).ok(),
            _ => None,
        };
        let n_after = n_after.map_or(n_before, |set| set.lights.len());
        let files = session.files();
        let is_seen = session.scene().render.background == Background::Panorama;
        let panorama = match kind {
            Openable::Lights => panorama_of(path, files),
            _ => None,
        };
        // Of one that cannot be read the lights can still be taken.
        let panorama = panorama.filter(|path| !is_seen || files.panorama(path).is_ok());
        let panorama = panorama.map(|path| session.path_in_scene(&path));
        let map = (kind == Openable::Lights && from != path).then(|| {
            let whole = std::path::absolute(from).unwrap_or_else(|_| from.to_owned());
            session.path_in_scene(&whole)
        });
        self.viewer.commit();
        let changed = self.viewer.edit(&label, |scene| match kind {
            Openable::Lights if scene.lights.file != file => {
                scene.lights.change_set(file, n_before, n_after);
                (scene.lights.panorama, scene.lights.map) = (panorama, map);
                if is_seen && scene.lights.panorama.is_none() {
                    scene.render.background = Background::Lights;
                }
            }
            Openable::Lights if scene.lights.panorama.is_none() => scene.lights.panorama = panorama,
            Openable::Lights => {}
            Openable::Panorama => {
                scene.lights.panorama = Some(file);
                scene.render.background = Background::Panorama;
            }
            Openable::Lut => scene.render.lut = Some(file),
            _ => scene.groom.file = file,
        });
        self.viewer.commit();
        match changed {
            Ok(change) if change.is_empty() => {
                self.say(&format!("The scene already uses {name}"));
                false
            }
            Ok(_) => {
                self.state.lights.forget();
                self.say(&label);
                self.changed("edit", json!({ "label": label }));
                true
            }
            Err(error) => {
                self.fail(&error.to_string());
                false
            }
        }
    }

    /// Opens another scene in place of this one, which stays if that fails; the sample where there is
    /// no path.
    pub(super) fn open(&mut self, path: Option<PathBuf>) {
        self.begin(Job::open(path));
    }

    /// Shows a document that was opened, in place of this one.
    fn show_session(&mut self, from: Option<PathBuf>, session: Session) {
        let chosen = self.screen.chosen(self.choice);
        let chosen = chosen.map_err(|error| SessionError::from(RenderError::Gpu(error.into())));
        let opened = chosen.and_then(|chosen| Viewer::choose(self.choice, chosen, session));
        match opened {
            Ok(mut viewer) => {
                viewer.set_ground_truth(self.viewer.ground_truth().is_some());
                viewer.set_inspection(self.viewer.inspection());
                self.viewer = viewer;
                self.document = Document::new(self.viewer.session());
                let old = std::mem::take(&mut self.state);
                self.state = UiState {
                    paint: old.paint,
                    is_help_open: old.is_help_open,
                    settings: old.settings,
                    presets: old.presets,
                    panel: old.panel,
                    ..UiState::default()
                };
                // Its looks are gone.
                #[cfg(not(target_arch = "wasm32"))]
                {
                    self.look_job = None;
                }
                self.views = Views::default();
                self.progress = PictureProgress::default();
                (self.is_stuck, self.is_to_be_saved) = (false, false);
                let name = match &from {
                    Some(path) => path.display().to_string(),
                    None => "the sample".to_owned(),
                };
                if let Some(path) = &from {
                    self.state.settings.opened(path);
                }
                self.say(&format!("Opened {name}"));
                self.tell_recovery();
                self.changed("opened", json!({ "path": name }));
            }
            Err(error) => self.fail(&error.to_string()),
        }
        self.window.request_redraw();
    }
}
