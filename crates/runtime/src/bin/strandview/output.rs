//! What goes to standard output.

use std::fmt::Display;
use std::io::{self, Write};

/// Prints a line of the result; a closed pipe is no error.
///
/// # Errors
/// One line that says why it could not be printed.
pub fn say(line: impl Display) -> Result<(), String> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(format!("standard output: {error}"))
        }
        _ => Ok(()),
    }
}
