//! The one error type of this crate.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// The file an error is about; prints as `path: `, or as nothing for bytes in memory.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileName(pub Option<PathBuf>);

impl fmt::Display for FileName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Some(path) => write!(f, "{}: ", path.display()),
            None => Ok(()),
        }
    }
}

/// Where in a text file something is, ready to be printed before what is wrong there:
/// `path:line:column: `, `line L, column C: ` for a text in memory, or as much of it as is known.
fn place(file: &FileName, line: Option<usize>, column: Option<usize>) -> String {
    match (&file.0, line, column) {
        (Some(path), Some(line), Some(column)) => format!("{}:{line}:{column}: ", path.display()),
        (Some(path), Some(line), None) => format!("{}:{line}: ", path.display()),
        (None, Some(line), Some(column)) => format!("line {line}, column {column}: "),
        (None, Some(line), None) => format!("line {line}: "),
        (_, None, _) => file.to_string(),
    }
}

/// Why a file cannot be read or written. Every variant names the file where there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system said no: missing, a directory, no permission, disk full.
    #[error("{file}{source}")]
    Io {
        /// The file.
        file: FileName,
        /// What the system answered.
        source: io::Error,
    },
    /// A readable file, but of another kind.
    #[error("{file}not a {expected}: {found}")]
    NotThisKind {
        /// The file.
        file: FileName,
        /// What was asked for, e.g. `groom file`.
        expected: &'static str,
        /// What the file is instead.
        found: String,
    },
    /// Written by a later program in a format this one does not know.
    #[error(
        "{file}{kind} format version {found} is newer than this program reads (up to {known}.x)"
    )]
    UnsupportedVersion {
        /// The file.
        file: FileName,
        /// Kind of file, e.g. `groom file`.
        kind: &'static str,
        /// Version found, `major.minor`.
        found: String,
        /// Newest known major version.
        known: u16,
    },
    /// Damaged, cut short or contradicting itself.
    #[error("{file}{what} (at byte {offset})")]
    Invalid {
        /// The file.
        file: FileName,
        /// What is wrong.
        what: String,
        /// Where in the file, in bytes; 0 where no better place is known.
        offset: u64,
    },
    /// A text file that does not parse, or names an unknown key.
    #[error("{}{what}", place(file, Some(*line), Some(*column)))]
    Syntax {
        /// The file.
        file: FileName,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong.
        what: String,
    },
    /// A value outside its range.
    #[error("{}{key} is {value}, must be {range}", place(file, *line, None))]
    Value {
        /// The file.
        file: FileName,
        /// Line of a text file, from 1, where the key stands.
        line: Option<usize>,
        /// Field or key, e.g. `hair.eta` or `lights[3].lambda`.
        key: String,
        /// The offending value.
        value: String,
        /// What is accepted.
        range: String,
    },
}

/// Answer of this crate's functions.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Something wrong with the bytes at `offset`.
    pub(crate) fn invalid(what: impl Into<String>, offset: u64) -> Self {
        Error::Invalid {
            file: FileName::default(),
            what: what.into(),
            offset,
        }
    }

    /// A value outside its range.
    pub(crate) fn value(
        key: impl Into<String>,
        value: impl fmt::Display,
        range: impl Into<String>,
    ) -> Self {
        Error::Value {
            file: FileName::default(),
            line: None,
            key: key.into(),
            value: value.to_string(),
            range: range.into(),
        }
    }

    /// A file that is not `expected`; `found` says what it is.
    pub(crate) fn not_this_kind(expected: &'static str, found: String) -> Self {
        Error::NotThisKind {
            file: FileName::default(),
            expected,
            found,
        }
    }

    /// The same error; of a value, at the line that `line_of` knows of its key.
    #[must_use]
    pub(crate) fn at_line(mut self, line_of: impl FnOnce(&str) -> Option<usize>) -> Self {
        if let Error::Value { line, key, .. } = &mut self {
            *line = line.or_else(|| line_of(key));
        }
        self
    }

    /// The same error, about the file at `path`.
    #[must_use]
    pub fn in_file(mut self, path: &Path) -> Self {
        let (Error::Io { file, .. }
        | Error::NotThisKind { file, .. }
        | Error::UnsupportedVersion { file, .. }
        | Error::Invalid { file, .. }
        | Error::Syntax { file, .. }
        | Error::Value { file, .. }) = &mut self;
        file.0.get_or_insert_with(|| path.to_owned());
        self
    }

    /// The file this error is about.
    pub fn path(&self) -> Option<&Path> {
        let (Error::Io { file, .. }
        | Error::NotThisKind { file, .. }
        | Error::UnsupportedVersion { file, .. }
        | Error::Invalid { file, .. }
        | Error::Syntax { file, .. }
        | Error::Value { file, .. }) = self;
        file.0.as_deref()
    }
}

impl From<io::Error> for Error {
    fn from(source: io::Error) -> Self {
        Error::Io {
            file: FileName::default(),
            source,
        }
    }
}
