//! Questions that the window asks before it goes on, one at a time and over everything else.

use std::path::{Path, PathBuf};

use egui::{RichText, Ui};

use super::asked::Asked;
use super::field::Changes;
use super::fitted::fitted_modal;
use super::picker::{Picked, Picker};
use super::still::{self, Still};
use super::theme;

/// What the window wants to know.
#[derive(Clone, Debug, PartialEq)]
pub enum Question {
    /// Which file to open.
    Open {
        /// The list of files.
        picker: Picker,
        /// Why it could not be opened.
        failure: Option<String>,
    },
    /// Where to save the scene.
    SaveAs {
        /// The path as it is typed, and the list of files.
        picker: Picker,
        /// Why it could not be saved there.
        failure: Option<String>,
        /// What is done once it is saved.
        then: Then,
    },
    /// What picture to write, and where.
    Still {
        /// Size, frames, layers and file.
        still: Box<Still>,
        /// Why it could not be written.
        failure: Option<String>,
    },
    /// There is a file at the path that was typed, or of the preset that was named.
    Replace {
        /// That path, or name.
        path: String,
        /// What was asked for, and is again if the file is to stay.
        asked: Box<Question>,
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
    /// What a preset is called.
    Preset {
        /// Its name.
        name: String,
        /// Why it could not be saved.
        failure: Option<String>,
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
    /// The bundled sample is opened.
    Sample,
}

/// What was answered.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// Open this file.
    Open(PathBuf),
    /// Save the scene to this path, and go on.
    SaveAs(String, Then),
    /// Write this picture.
    Still(Box<Still>),
    /// Do what was asked for and replace what is there.
    Replace(Box<Question>, String),
    /// Save over what another program has written.
    Overwrite(Then),
    /// Save first.
    Save(Then),
    /// Lose the changes.
    Discard(Then),
    /// Changes on disk are not wanted.
    KeepMine,
    /// Save the hair as a preset of this name.
    Preset(String),
}

impl Question {
    /// Its name in the log.
    pub fn name(&self) -> &'static str {
        match self {
            Question::Open { .. } => "open",
            Question::SaveAs { .. } => "save as",
            Question::Still { .. } => "picture",
            Question::Replace { .. } => "replace",
            Question::Overwrite { .. } => "overwrite",
            Question::Unsaved { .. } => "unsaved",
            Question::Preset { .. } => "preset",
        }
    }

    /// The same question after `failure`.
    pub fn failed(mut self, reason: String) -> Question {
        match &mut self {
            Question::Open { failure, .. }
            | Question::SaveAs { failure, .. }
            | Question::Still { failure, .. }
            | Question::Preset { failure, .. } => *failure = Some(reason),
            Question::Replace { .. } | Question::Overwrite { .. } | Question::Unsaved { .. } => {}
        }
        self
    }
}

/// Shows `question` until it is answered or taken back.
pub fn show(
    ui: &mut Ui,
    question: &mut Option<Question>,
    asked: &Asked<'_>,
    changes: &mut Changes,
) -> Option<Answer> {
    let shown = question.take()?;
    let (left, answer) = match shown {
        Question::Open { .. } | Question::SaveAs { .. } | Question::Still { .. } => {
            form(ui, shown, asked, changes)
        }
        Question::Preset { name, failure } => preset(ui, name, failure, changes),
        Question::Replace { path, asked } => {
            let text = format!("{} exists. Replace it?", name_of(Path::new(&path)));
            match choose(ui, "replacing", &text, &["Replace", "Cancel"], changes) {
                Some(0) => (None, Some(Answer::Replace(asked, path))),
                // What was typed is not lost.
                Some(_) => (Some(*asked), None),
                None => (Some(Question::Replace { path, asked }), None),
            }
        }
        Question::Overwrite { file, then } => {
            let name = name_of(&file);
            let text = format!("{name} was changed by another program. Overwrite it?");
            match choose(ui, "overwriting", &text, &["Overwrite", "Cancel"], changes) {
                Some(0) => (None, Some(Answer::Overwrite(then))),
                Some(_) => (None, None),
                None => (Some(Question::Overwrite { file, then }), None),
            }
        }
        Question::Unsaved { then } => {
            let opening = |name: String| {
                (
                    format!("opening {name}"),
                    ["Save and open", "Don't save", "Cancel"],
                )
            };
            let (before, buttons) = match &then {
                Then::Open(path) => opening(name_of(path)),
                Then::Sample => opening("the sample".to_owned()),
                _ => (
                    "closing".to_owned(),
                    ["Save and close", "Don't save", "Cancel"],
                ),
            };
            let scene = asked.scene;
            let text = format!("Save the changes to {scene} before {before}?");
            match choose(ui, "unsaved", &text, &buttons, changes) {
                Some(0) => (None, Some(Answer::Save(then))),
                Some(1) => (None, Some(Answer::Discard(then))),
                Some(_) => (None, None),
                None => (Some(Question::Unsaved { then }), None),
            }
        }
    };
    *question = left;
    answer
}

/// A question about a file: its heading, the list of files, and two buttons.
fn form(
    ui: &mut Ui,
    mut question: Question,
    asked: &Asked<'_>,
    changes: &mut Changes,
) -> (Option<Question>, Option<Answer>) {
    let (heading, verb, place) = match &question {
        Question::Open { .. } => ("Open", "Open", "Open file button"),
        Question::Still { .. } => ("Save picture", "Save", "Save picture button"),
        _ => ("Save scene as", "Save", "Save as button"),
    };
    let mut entered = None;
    let mut is_open = true;
    let room = ui.ctx().content_rect().size();
    let modal = fitted_modal(ui, heading, |ui, width| {
        ui.set_width(width.min(520.0));
        ui.label(RichText::new(heading).strong());
        let focused = ui.memory(egui::Memory::focused);
        let of_options = match &question {
            Question::Still { .. } => 225.0,
            _ => 0.0,
        };
        let height = (room.y - 210.0 - of_options).clamp(40.0, 300.0);
        let (picker, failure) = match &mut question {
            Question::Open { picker, failure } => (picker, failure),
            Question::SaveAs {
                picker, failure, ..
            } => (picker, failure),
            Question::Still { still, failure } => {
                still::show(ui, still, asked, changes);
                (&mut still.picker, failure)
            }
            _ => return,
        };
        let picked = picker.show(ui, focused, asked.places, height, changes);
        if let Some(failure) = failure {
            ui.label(RichText::new(failure.as_str()).color(theme::ERROR));
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let button = ui.button(verb);
            changes.place(place, &button);
            entered = match picked {
                Picked::Path(path) => Some(path),
                Picked::No if button.clicked() => match picker.press() {
                    Picked::Path(path) => Some(path),
                    Picked::No => None,
                },
                Picked::No => None,
            };
            let cancel = ui.button("Cancel");
            changes.place("Cancel button", &cancel);
            is_open &= !cancel.clicked();
        });
    });
    if let Some(path) = entered {
        // Or the next key would still be typed.
        ui.memory_mut(egui::Memory::stop_text_input);
        let answer = match question {
            Question::SaveAs { then, .. } => Answer::SaveAs(path, then),
            Question::Still { still, .. } => Answer::Still(still),
            _ => Answer::Open(PathBuf::from(path)),
        };
        return (None, Some(answer));
    }
    if is_open && !modal.should_close() {
        return (Some(question), None);
    }
    ui.memory_mut(egui::Memory::stop_text_input);
    (None, None)
}

/// The name of a preset.
fn preset(
    ui: &mut Ui,
    mut name: String,
    failure: Option<String>,
    changes: &mut Changes,
) -> (Option<Question>, Option<Answer>) {
    let (mut is_entered, mut is_open) = (false, true);
    let modal = fitted_modal(ui, "preset name", |ui, width| {
        ui.set_width(width.min(300.0));
        ui.label(RichText::new("Save the hair as a preset").strong());
        is_entered =
            ui.input_mut(|input| input.consume_key(egui::Modifiers::NONE, egui::Key::Enter));
        let field = ui.add(egui::TextEdit::singleline(&mut name).desired_width(f32::INFINITY));
        changes.place("Preset name", &field);
        field.request_focus();
        if let Some(failure) = &failure {
            ui.label(RichText::new(failure).color(theme::ERROR));
        }
        ui.horizontal(|ui| {
            let save = ui.button("Save");
            changes.place("Save preset as button", &save);
            is_entered |= save.clicked();
            let cancel = ui.button("Cancel");
            changes.place("Cancel button", &cancel);
            is_open &= !cancel.clicked();
        });
    });
    if is_entered {
        ui.memory_mut(egui::Memory::stop_text_input);
        return (None, Some(Answer::Preset(name)));
    }
    if is_open && !modal.should_close() {
        return (Some(Question::Preset { name, failure }), None);
    }
    ui.memory_mut(egui::Memory::stop_text_input);
    (None, None)
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
    let modal = fitted_modal(ui, id, |ui, width| {
        ui.set_max_width(width.min(440.0));
        ui.label(RichText::new(text).strong());
        ui.add_space(8.0);
        ui.horizontal_wrapped(|ui| {
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
