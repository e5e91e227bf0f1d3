//! Questions about the scene as a file, and their answers.

#[cfg(not(target_arch = "wasm32"))]
use std::io::Write;
use std::path::Path;

use serde_json::json;
use web_time::Instant;

use crate::error::SessionError;
#[cfg(not(target_arch = "wasm32"))]
use crate::ui::desktop;
#[cfg(not(target_arch = "wasm32"))]
use crate::ui::job::{Job, JobResult, Wanted};
use crate::ui::keys::{self, Command};
use crate::ui::picker::{Picker as FilePicker, Purpose};
#[cfg(not(target_arch = "wasm32"))]
use crate::ui::questions::name_of;
use crate::ui::questions::{Answer, Question, Then};
use crate::ui::workspace::Workspace;

/// A document that cannot be saved.
#[derive(Debug, thiserror::Error)]
enum SaveError {
    #[error(transparent)]
    Session(#[from] SessionError),
    #[cfg(target_arch = "wasm32")]
    #[error(transparent)]
    Web(#[from] crate::page::WebError),
}

impl Workspace {
    pub(in crate::ui) fn close(&mut self) {
        let is_asking = self.state.question.is_some() || self.job.is_some();
        if !is_asking && self.egui.text_edit_focused() {
            // What is typed is a change too.
            self.state.waiting.push(Command::Close);
            keys::end_typing(&self.egui);
            self.window.request_redraw();
            return;
        }
        self.before_losing(Then::Close);
    }

    /// Goes on with `then`, by which changes would be lost: asks first where there are any.
    pub(super) fn before_losing(&mut self, then: Then) {
        self.end_stroke();
        if self.viewer.session().is_modified() {
            self.ask(Question::Unsaved { then });
        } else {
            self.go_on(then);
        }
    }

    fn go_on(&mut self, then: Then) {
        match then {
            Then::Stay => {}
            Then::Close => self.is_open = false,
            Then::Open(path) => self.open(Some(path)),
            Then::Sample => self.open(None),
        }
    }

    pub(in crate::ui) fn ask(&mut self, question: Question) {
        self.log
            .write("question", json!({ "name": question.name() }));
        self.state.question = Some(question);
        self.is_outdated = true;
        self.window.request_redraw();
    }

    /// Asks for a file to open.
    pub(super) fn ask_what(&mut self) {
        // A page has no files to choose from.
        if cfg!(target_arch = "wasm32") {
            return;
        }
        #[cfg(not(target_arch = "wasm32"))]
        if desktop::has_dialogs() {
            return self.ask_desktop(Wanted::Open);
        }
        self.list_files();
    }

    /// Asks for a file to open by the window's own list.
    pub(super) fn list_files(&mut self) {
        let path = self.viewer.session().path();
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let picker = FilePicker::in_folder_of(Purpose::Open, &whole, openable_extensions());
        self.ask(Question::Open {
            picker,
            failure: None,
        });
    }

    /// Asks where the scene is saved, and goes on with `then` once it is.
    pub(super) fn ask_where(&mut self, then: Then) {
        #[cfg(not(target_arch = "wasm32"))]
        if desktop::has_dialogs() {
            return self.ask_desktop(Wanted::SaveAs(then));
        }
        self.list_places(then);
    }

    /// The same by the window's own list.
    pub(super) fn list_places(&mut self, then: Then) {
        let path = self.document.path_text();
        self.ask(save_as_question(path, then));
    }

    /// Asks by the desktop's dialog.
    #[cfg(not(target_arch = "wasm32"))]
    fn ask_desktop(&mut self, wanted: Wanted) {
        let path = self.viewer.session().path();
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let title = "Choose a file in the desktop's dialog".to_owned();
        self.begin(Job::start(title, move |_| {
            let start = Instant::now();
            let path = match &wanted {
                Wanted::Open => desktop::open(&whole, &openable_extensions()),
                Wanted::SaveAs(_) => desktop::save(&whole),
            };
            Ok(JobResult::Chosen {
                is_missing: path.is_none() && start.elapsed() < desktop::GLANCE,
                wanted,
                path,
            })
        }));
    }

    pub(in crate::ui) fn answer(&mut self, answer: Answer) {
        match answer {
            Answer::Open(path) => self.take_file(&path),
            Answer::SaveAs(path, then) => self.save_as(path, then, false),
            Answer::Still(still) => self.write_still(still, false),
            Answer::Replace(asked, path) => match *asked {
                Question::SaveAs { then, .. } => self.save_as(path, then, true),
                Question::Still { still, .. } => self.write_still(still, true),
                Question::Preset { name, .. } => self.save_preset(name, true),
                _ => {}
            },
            Answer::Overwrite(then) => {
                // What else has changed is read then.
                self.viewer.overrule_conflicts();
                self.save(then);
            }
            Answer::Save(then) => self.save(then),
            Answer::Discard(then) => self.go_on(then),
            Answer::KeepMine => {
                self.viewer.keep_mine();
                self.state.has_changed_on_disk = false;
            }
            Answer::Preset(name) => self.save_preset(name, false),
        }
        self.is_outdated = true;
    }

    /// Saves the hair as a preset of one's own; asks before it replaces another.
    fn save_preset(&mut self, name: String, is_agreed: bool) {
        let asked = |name: String, failure| Question::Preset { name, failure };
        if !is_agreed && self.state.presets.has_file(&name) {
            return self.ask(Question::Replace {
                path: name.trim().to_owned(),
                asked: Box::new(asked(name, None)),
            });
        }
        let hair = self.viewer.session().scene().hair.clone();
        match self.state.presets.save(&name, &hair) {
            Ok(()) => self.say(&format!("Saved the preset {}", name.trim())),
            Err(failure) => {
                self.log.write("error", json!({ "message": failure }));
                self.ask(asked(name, Some(failure)));
            }
        }
    }

    /// Saves where the scene is from and goes on with `then`; asks first where another program has
    /// written that file.
    pub(in crate::ui) fn save(&mut self, then: Then) {
        self.end_stroke();
        if let Some(file) = self.viewer.session().conflict() {
            let file = file.to_owned();
            return self.ask(Question::Overwrite { file, then });
        }
        // One that was made here has no file yet.
        if self.viewer.session().is_unsaved() {
            return self.ask_where(then);
        }
        match self.write(None) {
            Ok(()) => self.go_on(then),
            Err(error) => self.fail(&format!("not saved: {error}")),
        }
    }

    /// Saves to the path that was typed and goes on with `then`; asks before it replaces another file
    /// there.
    pub(super) fn save_as(&mut self, path: String, then: Then, is_agreed: bool) {
        let session = self.viewer.session();
        let typed = Path::new(&path);
        let is_own = !session.is_unsaved() && !session.replaces_other(typed);
        if is_own && session.files().exists(typed) {
            return self.save(then);
        }
        // What cannot be written is not asked about.
        let can_be_written = session.check_target(typed).map_err(SaveError::from);
        let is_replacing = match session.is_unsaved() {
            true => typed.symlink_metadata().is_ok(),
            false => !is_own,
        };
        if can_be_written.is_ok() && is_replacing && !is_agreed {
            let asked = Box::new(save_as_question(path.clone(), then));
            return self.ask(Question::Replace { path, asked });
        }
        match can_be_written.and_then(|()| self.write(Some(typed))) {
            Ok(()) => self.go_on(then),
            Err(error) => {
                let error = error.to_string();
                self.log.write("error", json!({ "message": error }));
                self.ask(save_as_question(path, then).failed(error));
            }
        }
    }

    fn write(&mut self, path: Option<&Path>) -> Result<(), SaveError> {
        let before = self.viewer.session().scene().clone();
        let saved = match path {
            Some(path) => self.viewer.save_as(path),
            None => self.viewer.save(),
        };
        let saved = saved?;
        let looks = &mut self.state.looks;
        looks.move_along(&before, self.viewer.session());
        // What was saved in a page's memory is the reader's to keep.
        #[cfg(target_arch = "wasm32")]
        crate::page::offer(self.viewer.session().files(), &saved)?;
        #[cfg(not(target_arch = "wasm32"))]
        let _ = saved;
        self.document.saved(self.viewer.session());
        #[cfg(not(target_arch = "wasm32"))]
        self.state.settings.opened(self.viewer.session().path());
        self.say(&format!("Saved {}", self.document.path_text()));
        self.log
            .write("saved", json!({ "path": self.document.path_text() }));
        // Nothing is lost any more by what others have written.
        if std::mem::take(&mut self.state.has_changed_on_disk) {
            self.reload();
        }
        Ok(())
    }

    /// Keeps changes that were not saved in a file of their own, because the program is about to end and nobody can be asked.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn keep_unsaved(&mut self) {
        self.end_stroke();
        let session = self.viewer.session();
        if !session.is_modified() {
            return;
        }
        let line = match session.write_recovery() {
            Ok(path) => {
                let path = std::path::absolute(&path).unwrap_or(path);
                self.note_recovery(&path, true);
                format!("the unsaved changes are kept in {}", path.display())
            }
            Err(error) => format!("the unsaved changes are lost: {error}"),
        };
        // Nobody may listen.
        let _ = writeln!(std::io::stderr(), "strandview: {line}");
    }

    /// Adds to the status line that unsaved changes of an earlier start were kept.
    #[cfg(not(target_arch = "wasm32"))]
    pub(in crate::ui) fn tell_recovery(&mut self) {
        let Some(path) = self.viewer.session().newer_recovery() else {
            return;
        };
        self.note_recovery(&path, false);
        let mut said = std::mem::take(&mut self.state.message);
        if !said.is_empty() {
            said += "; ";
        }
        self.say(&format!(
            "{said}Unsaved changes from before are in {}: open it to go on with them",
            name_of(&path)
        ));
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn note_recovery(&mut self, path: &Path, is_written: bool) {
        let path = path.display().to_string();
        let of_file = json!({ "path": path, "is_written": is_written });
        self.log.write("recovery", of_file);
    }

    pub(in crate::ui) fn on_files(&mut self) {
        self.end_stroke();
        if self.viewer.session().is_modified() {
            self.state.has_changed_on_disk = true;
        } else {
            self.reload();
        }
        self.window.request_redraw();
    }

    pub(in crate::ui) fn reload(&mut self) {
        self.state.has_changed_on_disk = false;
        match self.viewer.reload() {
            Ok(_) => {
                self.document.saved(self.viewer.session());
                self.say("Reloaded");
                self.changed("reloaded", json!({}));
            }
            Err(error) => self.fail(&error.to_string()),
        }
    }
}

/// Where a scene is saved.
pub(super) fn scene_picker(path: String) -> FilePicker {
    FilePicker::new(Purpose::Save, path, vec!["toml".to_owned()])
}

fn save_as_question(path: String, then: Then) -> Question {
    Question::SaveAs {
        picker: scene_picker(path),
        failure: None,
        then,
    }
}

/// Endings of the files that can be opened.
fn openable_extensions() -> Vec<String> {
    let ours = ["toml", "groom", "lights", "panorama", "exr", "hdr", "cube"].into_iter();
    let formats = strandlight_formats::GROOM_FORMATS.iter();
    let others = formats.flat_map(|format| format.info().extensions);
    let all = ours.chain(others.copied());
    // A page takes no photos.
    #[cfg(not(target_arch = "wasm32"))]
    let all = all.chain(crate::ui::photo::EXTENSIONS);
    all.map(str::to_owned).collect()
}
