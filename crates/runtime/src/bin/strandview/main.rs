//! `strandview`: shows a scene in a window, or renders frames of it without one.
//!
//! Exit codes: 0 done; 2 bad usage or bad input.

mod args;
mod headless;
mod window;

use std::io::Write;
use std::process::ExitCode;

use args::{Args, Job, USAGE, help};

fn main() -> ExitCode {
    let mut words = std::env::args_os().skip(1).peekable();
    let first = words.peek().and_then(|word| word.to_str());
    match first {
        Some("--help" | "-h") => {
            let _ = writeln!(std::io::stdout(), "{USAGE}\n{}", help());
            return ExitCode::SUCCESS;
        }
        Some("--version" | "-V") => {
            let _ = writeln!(
                std::io::stdout(),
                "strandview {}",
                env!("CARGO_PKG_VERSION")
            );
            return ExitCode::SUCCESS;
        }
        _ => {}
    }
    match args::parse(words).and_then(|args| run(&args)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            let lines: Vec<&str> = message.lines().map(str::trim).collect();
            let _ = writeln!(std::io::stderr(), "strandview: {}", lines.join(" "));
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    match args.job {
        Job::Window => window::run(args),
        _ => headless::run(args).map_err(|error| error.to_string()),
    }
}
