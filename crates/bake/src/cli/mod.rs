//! The commands, one file each: `Args` are parsed by clap, `run` does the work.

pub mod bench;
pub mod compare;
pub mod demo;
pub mod export;
pub mod groom;
pub mod inspect;
pub mod lights;
pub mod probe;
pub mod reference;
pub mod render;
pub mod scenes;
pub mod stress;
pub mod tables;
pub mod verify;

use std::fmt;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Says a line on stderr; where nobody can hear it, the work goes on.
macro_rules! note {
    ($($text:tt)*) => {{
        use std::io::Write;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}
use note;

/// Why a command did not do what was asked; printed as one line on stderr.
#[derive(Debug)]
pub enum Failure {
    /// A check was made and failed: exit code 1.
    Check(String),
    /// Bad usage or bad input: exit code 2.
    Input(String),
}

impl Failure {
    /// Any error of a library, as bad input.
    pub fn input(error: impl fmt::Display) -> Self {
        Failure::Input(error.to_string())
    }

    /// An error about `path`.
    pub fn file(path: &Path, error: impl fmt::Display) -> Self {
        Failure::Input(format!("{}: {error}", path.display()))
    }

    /// The process exit code that stands for this failure.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Failure::Check(_) => ExitCode::from(1),
            Failure::Input(_) => ExitCode::from(2),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Failure::Check(text) | Failure::Input(text)) = self;
        // One line, whatever a library put into its message.
        for (ix, line) in text
            .lines()
            .map(str::trim)
            .filter(|line| !line.is_empty())
            .enumerate()
        {
            write!(f, "{}{line}", if ix == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

/// What clap says of a command line, without its usage text: one line like every other failure.
pub fn usage(error: &clap::Error) -> Failure {
    let rendered = error.render().to_string();
    let text = rendered.strip_prefix("error: ").unwrap_or(&rendered);
    let first = text.split("\n\n").next().unwrap_or(text);
    Failure::Input(format!("{} (see --help)", first.replace('\n', " ")))
}

/// What every command answers.
pub type Outcome = Result<(), Failure>;

/// Prints a line of the result on stdout; a closed pipe is no error.
pub fn print_line(line: impl fmt::Display) -> Outcome {
    match writeln!(io::stdout().lock(), "{line}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Failure::input(error)),
        _ => Ok(()),
    }
}

/// Refuses, before any work is done, outputs that cannot be written, that are one file, or that
/// are an input.
pub fn check_outputs(inputs: &[&Path], outputs: &[&Path]) -> Outcome {
    let mut targets = Vec::with_capacity(outputs.len());
    for path in outputs {
        let target = strandlight_formats::check_writable(path)
            .map_err(|error| Failure::file(path, format!("cannot be written: {error}")))?;
        if inputs
            .iter()
            .any(|input| input.canonicalize().is_ok_and(|input| input == target))
        {
            return Err(Failure::file(path, "is an input; name another output"));
        }
        if targets.contains(&target) {
            return Err(Failure::file(path, "is named for two outputs"));
        }
        targets.push(target);
    }
    Ok(())
}

/// Writes a file whole or not at all.
pub fn write_output(path: &Path, bytes: &[u8]) -> Outcome {
    strandlight_formats::write_file(path, bytes)
        .map_err(|error| Failure::file(path, format!("cannot be written: {error}")))
}
