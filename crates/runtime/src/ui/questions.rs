//! Questions that the window asks before it goes on, one at a time and over everything else.

use std::path::{Path, PathBuf};

use egui::{Key, Modal, RichText, Ui};

use super::field::Changes;
use super::theme;

/// What the window wants to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Question {
    /// Where to save the scene.
    SaveAs {
        /// The path as it is typed.
        path: String,
        /// Why it could not be saved there.
        failure: Option<String>,
    },
    /// There is a file at the path that was typed.
    Replace {
        /// That path.
        path: String,
    },
    /// Another program has written a file that saving would replace.
    Overwrite {
        /// That file.
        file: PathBuf,
        /// What is done once it is saved.
        then: Then,
    },
    /// There are changes that would be lost by what comes next.
    Unsaved {
        /// What comes next.
        then: Then,
    },
}

/// What is done after saving.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Then {
    /// Nothing.
    Stay,
    /// The window is closed.
    Close,
    /// This scene is opened.
    Open(PathBuf),
}

/// What was answered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Save the scene to this path.
    SaveAs(String),
    /// And replace what is there.
    Replace(String),
    /// Save over what another program has written.
    Overwrite(Then),
    /// Save first.
    Save(Then),
    /// Lose the changes.
    Discard(Then),
    /// Changes on disk are not wanted.
    KeepMine,
}

impl Question {
    /// Its name in the log.
    pub fn name(&self) -> &'static str {
        match self {
            Question::SaveAs { .. } => "save as",
            Question::Replace { .. } => "replace",
            Question::Overwrite { .. } => "overwrite",
            Question::Unsaved { .. } => "unsaved",
        }
    }
}

/// Shows `question` of the scene called `scene` until it is answered or taken back.
pub fn show(
    ui: &mut Ui,
    question: &mut Option<Question>,
    scene: &str,
    changes: &mut Changes,
) -> Option<Answer> {
    match question.take()? {
        Question::SaveAs { path, failure } => {
            let (left, answer) = save_as(ui, path, failure, changes);
            *question = left;
            answer
        }
        Question::Replace { path } => {
            let text = format!("{} exists. Replace it?", name_of(Path::new(&path)));
            let chosen = choose(ui, "replacing", &text, &["Replace", "Cancel"], changes);
            match chosen {
                Some(0) => Some(Answer::Replace(path)),
                // What was typed is not lost.
                Some(_) => {
                    let failure = None;
                    *question = Some(Question::SaveAs { path, failure });
                    None
                }
                None => {
                    *question = Some(Question::Replace { path });
                    None
                }
            }
        }
        Question::Overwrite { file, then } => {
            let name = name_of(&file);
            let text = format!("{name} was changed by another program. Overwrite it?");
            match choose(ui, "overwriting", &text, &["Overwrite", "Cancel"], changes) {
                Some(0) => Some(Answer::Overwrite(then)),
                Some(_) => None,
                None => {
                    *question = Some(Question::Overwrite { file, then });
                    None
                }
            }
        }
        Question::Unsaved { then } => {
            let (before, buttons) = match &then {
                Then::Open(path) => (
                    format!("opening {}", name_of(path)),
                    ["Save and open", "Don't save", "Cancel"],
                ),
                _ => (
                    "closing".to_owned(),
                    ["Save and close", "Don't save", "Cancel"],
                ),
            };
            let text = format!("Save the changes to {scene} before {before}?");
            match choose(ui, "unsaved", &text, &buttons, changes) {
                Some(0) => Some(Answer::Save(then)),
                Some(1) => Some(Answer::Discard(then)),
                Some(_) => None,
                None => {
                    *question = Some(Question::Unsaved { then });
                    None
                }
            }
        }
    }
}

/// The field for a path; answers what is still asked, and the answer.
fn save_as(
    ui: &mut Ui,
    mut path: String,
    failure: Option<String>,
    changes: &mut Changes,
) -> (Option<Question>, Option<Answer>) {
    let mut answer = None;
    let mut is_open = true;
    let modal = Modal::new(egui::Id::unique("save as")).show(ui.ctx(), |ui| {
        ui.set_width(440.0);
        ui.label(RichText::new("Save scene as").strong());
        let field = egui::TextEdit::singleline(&mut path).desired_width(f32::INFINITY);
        let field = ui.add(field);
        changes.place("Path", &field);
        field.request_focus();
        if let Some(failure) = &failure {
            ui.label(RichText::new(failure).color(theme::ERROR));
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let is_entered = ui.input(|input| input.key_pressed(Key::Enter));
            let save = ui.button("Save");
            changes.place("Save as button", &save);
            if save.clicked() || is_entered {
                answer = Some(Answer::SaveAs(path.clone()));
                is_open = false;
            }
            let cancel = ui.button("Cancel");
            changes.place("Cancel button", &cancel);
            is_open &= !cancel.clicked();
        });
    });
    if is_open && !modal.should_close() {
        return (Some(Question::SaveAs { path, failure }), None);
    }
    // Or the next key would still be typed.
    ui.memory_mut(egui::Memory::stop_text_input);
    (None, answer)
}

/// `text` over some buttons, the last of which takes the question back, as Escape does. Answers the
/// button that was clicked.
fn choose(
    ui: &mut Ui,
    id: &'static str,
    text: &str,
    buttons: &[&str],
    changes: &mut Changes,
) -> Option<usize> {
    let mut chosen = None;
    let modal = Modal::new(egui::Id::unique(id)).show(ui.ctx(), |ui| {
        ui.set_max_width(440.0);
        ui.label(RichText::new(text).strong());
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            for (ix, name) in buttons.iter().enumerate() {
                let button = ui.button(*name);
                changes.place(format!("{name} button"), &button);
                if button.clicked() {
                    chosen = Some(ix);
                }
            }
        });
    });
    let is_cancelled = chosen.is_none() && modal.should_close();
    chosen.or(is_cancelled.then(|| buttons.len() - 1))
}

/// The last part of a path, by which people know a file.
pub fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
