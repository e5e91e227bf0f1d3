//! Failures of a bake as exit codes.

use std::fmt;
use std::path::Path;

use strandlight_bake::manifest;
use strandlight_formats::write_file;

use crate::cli::{Failure, Outcome, STDOUT, try_print};

/// Writes a file of the run itself.
pub fn write(path: &Path, text: &str) -> Outcome {
    write_file(path, text.as_bytes()).map_err(|error| {
        let failure = manifest::Failure::io(path, "cannot be written", &error);
        in_exit_codes(failure)
    })
}

/// [`crate::cli::print_line`], with the exit codes of a bake.
pub fn print_line(line: impl fmt::Display) -> Outcome {
    let printed = try_print(line).map_err(|error| {
        let failure = manifest::Failure::io(Path::new(STDOUT), "cannot be written", &error);
        in_exit_codes(failure)
    });
    printed.map(drop)
}

/// 75 for what may succeed later, else 2.
pub fn in_exit_codes(failure: manifest::Failure) -> Failure {
    match failure.is_transient {
        true => Failure::Transient(failure.what),
        false => Failure::Input(failure.what),
    }
}
