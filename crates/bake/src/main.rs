//! `strandlight`: bakes light sets, tables and grooms, verifies and renders them.
//!
//! Exit codes: 0 done; 1 a check failed; 2 bad usage or bad input.

mod cli;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

/// Bakes light sets, tables and grooms for rendering hair under environment lighting.
#[derive(Parser)]
#[command(name = "strandlight", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(cli::demo::Args),
    Tables(cli::tables::Args),
    Lights(cli::lights::Args),
    Groom(cli::groom::Args),
    Inspect(cli::inspect::Args),
    Export(cli::export::Args),
    Verify(cli::verify::Args),
    Reference(cli::reference::Args),
    Render(cli::render::Args),
    Probe(cli::probe::Args),
    Bench(cli::bench::Args),
    Stress(cli::stress::Args),
    Compare(cli::compare::Args),
    Scenes(cli::scenes::Args),
}

fn main() -> ExitCode {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        // A bare `strandlight` gets the whole help.
        Err(error)
            if error.use_stderr()
                && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand =>
        {
            let failure = cli::usage(&error);
            return ended_by(&failure);
        }
        // Help and version are answers, not errors.
        Err(answer) => answer.exit(),
    };
    match dispatch(&command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => ended_by(&failure),
    }
}

/// Says why on stderr. The exit code tells it too, so a closed or full stderr is no error.
fn ended_by(failure: &cli::Failure) -> ExitCode {
    let _ = writeln!(std::io::stderr(), "strandlight: {failure}");
    failure.exit_code()
}

fn dispatch(command: &Command) -> cli::Outcome {
    match command {
        Command::Demo(args) => cli::demo::run(args, run_line),
        Command::Tables(args) => cli::tables::run(args),
        Command::Lights(args) => cli::lights::run(args),
        Command::Groom(args) => cli::groom::run(args),
        Command::Inspect(args) => cli::inspect::run(args),
        Command::Export(args) => cli::export::run(args),
        Command::Verify(args) => cli::verify::run(args),
        Command::Reference(args) => cli::reference::run(args),
        Command::Render(args) => cli::render::run(args),
        Command::Probe(args) => cli::probe::run(args),
        Command::Bench(args) => cli::bench::run(args),
        Command::Stress(args) => cli::stress::run(args),
        Command::Compare(args) => cli::compare::run(args),
        Command::Scenes(args) => cli::scenes::run(args),
    }
}

/// Runs one command line, given without the program's name, as the user would.
fn run_line(line: &[OsString]) -> cli::Outcome {
    let program = OsString::from("strandlight");
    match Cli::try_parse_from(std::iter::once(&program).chain(line)) {
        Ok(cli) => dispatch(&cli.command),
        Err(error) => Err(cli::usage(&error)),
    }
}
