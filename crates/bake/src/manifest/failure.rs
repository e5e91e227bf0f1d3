//! Why an item was not made, and whether trying again may help.

use std::fmt;
use std::io::{self, ErrorKind};
use std::path::Path;

use strandlight_formats::system_in_plain_words;

/// Why an item was not made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// One sentence that names the file.
    pub what: String,
    /// The same work may succeed later: the disk was full, a server did not answer, an input was
    /// being written.
    pub is_transient: bool,
}

impl Failure {
    /// Something wrong with what was given.
    pub fn input(what: impl fmt::Display) -> Self {
        Failure {
            what: what.to_string(),
            is_transient: false,
        }
    }

    /// The sentence after the name of the item that was not made, which is often the file that it names.
    pub fn of_item(&self, item: &str) -> String {
        let names_it = (self.what.strip_prefix(item)).is_some_and(|rest| rest.starts_with(": "));
        match names_it {
            true => self.what.clone(),
            false => format!("{item}: {}", self.what),
        }
    }

    /// Something that may be otherwise next time.
    pub fn transient(what: impl fmt::Display) -> Self {
        Failure {
            what: what.to_string(),
            is_transient: true,
        }
    }

    /// What the system answered about the file at `path`.
    pub fn io(path: &Path, doing: &str, error: &io::Error) -> Self {
        Failure {
            what: system_in_plain_words(&format!("{}: {doing}: {error}", path.display())),
            is_transient: is_transient(error.kind()),
        }
    }

    /// Why a file could not be read.
    pub fn reading(error: &strandlight_formats::Error) -> Self {
        Failure {
            what: system_in_plain_words(&error.to_string()),
            is_transient: matches!(error, strandlight_formats::Error::Io { source, .. }
                if is_transient(source.kind())),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)
    }
}

/// May the same request be answered otherwise later? Names, kinds and permissions of files stay as
/// they are; full disks, lost servers and limits of the system do not.
fn is_transient(kind: ErrorKind) -> bool {
    !matches!(
        kind,
        ErrorKind::NotFound
            | ErrorKind::PermissionDenied
            | ErrorKind::AlreadyExists
            | ErrorKind::NotADirectory
            | ErrorKind::IsADirectory
            | ErrorKind::ReadOnlyFilesystem
            | ErrorKind::InvalidInput
            | ErrorKind::InvalidData
            | ErrorKind::InvalidFilename
            | ErrorKind::UnexpectedEof
            | ErrorKind::Unsupported
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_is_named_once() {
        let of_item = |what: &str| Failure::input(what).of_item("a.lights");
        assert_eq!(
            of_item("a.lights: is a directory"),
            "a.lights: is a directory"
        );
        for other in ["a.exr: is missing", "a.lights.html: is a directory"] {
            assert_eq!(of_item(other), format!("a.lights: {other}"));
        }
    }

    #[test]
    fn full_disks_pass_and_missing_files_do_not() {
        let of = |kind: ErrorKind| Failure::io("a".as_ref(), "x", &kind.into()).is_transient;
        for kind in [
            ErrorKind::StorageFull,
            ErrorKind::QuotaExceeded,
            ErrorKind::StaleNetworkFileHandle,
            ErrorKind::TimedOut,
            ErrorKind::Other,
        ] {
            assert!(of(kind), "{kind}");
        }
        for kind in [ErrorKind::NotFound, ErrorKind::PermissionDenied] {
            assert!(!of(kind), "{kind}");
        }
    }
}
