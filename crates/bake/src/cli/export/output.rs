//! A file of an export.

use std::path::PathBuf;

/// A file to be written.
pub struct Output {
    pub path: PathBuf,
    /// Format and shape for the closing line.
    pub what: String,
    pub bytes: Vec<u8>,
}
