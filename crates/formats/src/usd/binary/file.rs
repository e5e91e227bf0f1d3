//! A binary file with its tables.

use super::bytes::Bytes;
use super::path::Path;

/// A file with its tables.
#[derive(Debug)]
pub struct Crate<'a> {
    pub(super) bytes: Bytes<'a>,
    /// Second and third number of the version, which starts with 0.
    pub(super) version: (u8, u8),
    pub(super) tokens: Vec<String>,
    /// Tokens of the strings.
    pub(super) strings: Vec<u32>,
    /// Paths as text; filled with those that values name.
    pub(super) paths: Vec<Path>,
}
