//! Failures of a bake as exit codes.

use std::path::Path;

use strandlight_bake::manifest;
use strandlight_formats::write_file;

use crate::cli::{Failure, Outcome};

/// Writes a file of the run itself.
pub fn write(path: &Path, text: &str) -> Outcome {
    write_file(path, text.as_bytes()).map_err(|error| {
        let failure = manifest::Failure::io(path, "cannot be written", &error);
        in_exit_codes(failure)
    })
}

/// 75 for what may succeed later, else 2.
pub fn in_exit_codes(failure: manifest::Failure) -> Failure {
    match failure.is_transient {
        true => Failure::Transient(failure.what),
        false => Failure::Input(failure.what),
    }
}
