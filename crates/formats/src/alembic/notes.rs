//! What is worth saying about a file, once each.

use crate::groom_format::{Note, NoteKind};

/// More different lines than this are counted only.
const MAX_LINES: usize = 64;

/// Lines about objects; what is the same of several is one line.
#[derive(Default)]
pub(super) struct Notes {
    lines: Vec<Line>,
    n_more: usize,
}

struct Line {
    kind: NoteKind,
    /// The first object, or empty for the file.
    path: String,
    text: String,
    n_objects: usize,
}

impl Notes {
    /// Says `text` of the object called `path`, or of the file if that is empty.
    pub fn add(&mut self, kind: NoteKind, path: &str, text: impl Into<String>) {
        let text = text.into();
        let same = |line: &&mut Line| {
            line.kind == kind && line.text == text && line.path.is_empty() == path.is_empty()
        };
        if let Some(line) = self.lines.iter_mut().find(same) {
            line.n_objects += 1;
        } else if self.lines.len() < MAX_LINES {
            self.lines.push(Line {
                kind,
                path: path.to_owned(),
                text,
                n_objects: 1,
            });
        } else {
            self.n_more += 1;
        }
    }

    /// All lines.
    pub fn finish(self) -> Vec<Note> {
        let lines = self.lines.into_iter().map(|line| {
            let text = match (&*line.path, line.n_objects) {
                ("", _) => line.text,
                (path, 1) => format!("{path}: {}", line.text),
                (path, n) => format!("{path} and {} more: {}", n - 1, line.text),
            };
            Note::new(line.kind, text)
        });
        let mut notes: Vec<Note> = lines.collect();
        if self.n_more > 0 {
            let text = format!("{} more notes like these", self.n_more);
            notes.push(Note::new(NoteKind::Dropped, text));
        }
        notes
    }
}
