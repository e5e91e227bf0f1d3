//! `strandlight completions`.

use std::io::{self, Write};

use clap_complete::Shell;

use super::{Failure, Outcome};

/// Print a shell completion script
///
/// Load it from the shell's start-up file, for example `source <(strandlight completions bash)`
/// in ~/.bashrc, or save it where the shell looks for completions.
#[derive(clap::Args)]
pub struct Args {
    /// Shell to complete for
    shell: Shell,
}

/// Runs the command; `program` is the parser of the whole command line.
pub fn run(args: &Args, mut program: clap::Command) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "strandlight", &mut script);
    match io::stdout().lock().write_all(&script) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::Input(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}
