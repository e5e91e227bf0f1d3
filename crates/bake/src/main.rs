//! `strandlight`: bakes light sets, tables and grooms, verifies and renders them.
//!
//! Exit codes: 0 done; 1 a check failed; 2 bad usage or bad input; 75 worth trying again; 130, 143
//! interrupted.

mod cli;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

/// Bake light sets, tables and grooms, and render hair under environment lighting
#[derive(Parser)]
#[command(name = "strandlight", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print nothing on stderr except errors
    #[arg(long, global = true)]
    quiet: bool,
    /// Worker threads, 1 to 1024; the output does not depend on it [default: one per core]
    #[arg(long, global = true, value_name = "N",
        value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

#[derive(Subcommand)]
enum Command {
    Demo(cli::demo::Args),
    Tables(cli::tables::Args),
    Lights(cli::lights::Args),
    Groom(cli::groom::Args),
    Bake(cli::bake::Args),
    Mesh(cli::mesh::Args),
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
    Completions(cli::completions::Args),
    Man(cli::man::Args),
}

fn main() -> ExitCode {
    #[cfg(unix)]
    remove_temporary_files_when_interrupted();
    // Asked of the words themselves, so that a line that cannot be parsed is answered as well.
    let mut options = std::env::args_os().take_while(|word| word != "--");
    if options.any(|word| word == "--json") {
        cli::want_json();
    }
    let cli = match parse(std::env::args_os()) {
        Ok(cli) => cli,
        // A bare `strandlight` gets the whole help.
        Err(error)
            if error.use_stderr()
                && error.kind() != ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand =>
        {
            return ended_by(&cli::usage(&error));
        }
        // Help and version are answers, not errors.
        Err(answer) => answer.exit(),
    };
    if cli.quiet {
        cli::progress::be_quiet();
    }
    if let Some(threads) = cli.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
        if let Err(error) = pool.build_global() {
            let text = format!("--threads {threads}: cannot start the threads: {error}");
            return ended_by(&cli::Failure::Input(text));
        }
    }
    match dispatch(&cli.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => ended_by(&failure),
    }
}

fn parse<W: Clone + Into<OsString>>(
    words: impl IntoIterator<Item = W>,
) -> clap::error::Result<Cli> {
    let matches = with_negative_numbers(Cli::command()).try_get_matches_from(words)?;
    Cli::from_arg_matches(&matches)
}

/// Lets numbers below 0 be values of all options, so that those that are out of range are told as that.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let of_option = |arg: clap::Arg| match arg.get_action().takes_values() && !arg.is_positional() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command
        .mut_args(of_option)
        .mut_subcommands(with_negative_numbers)
}

fn ended_by(failure: &cli::Failure) -> ExitCode {
    cli::print_failure(failure);
    ExitCode::from(failure.exit_code())
}

/// Ends the process at SIGINT and SIGTERM with nothing half written left behind, with the exit code
/// that a shell gives to those signals. Where no handler can be installed, they end it as ever.
#[cfg(unix)]
fn remove_temporary_files_when_interrupted() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else {
        return;
    };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            strandlight_formats::remove_temporary_files();
            // At once: graphics drivers do not take it well when the process exits under them.
            signal_hook::low_level::exit(128 + signal);
        }
    });
}

fn dispatch(command: &Command) -> cli::Outcome {
    match command {
        Command::Demo(args) => cli::demo::run(args, run_line),
        Command::Tables(args) => cli::tables::run(args),
        Command::Lights(args) => cli::lights::run(args),
        Command::Groom(args) => cli::groom::run(args),
        Command::Bake(args) => cli::bake::run(args),
        Command::Mesh(args) => cli::mesh::run(args),
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
        Command::Completions(args) => cli::completions::run(args, Cli::command()),
        Command::Man(args) => cli::man::run(args, Cli::command()),
    }
}

/// Runs one command line, given without the program's name, as the user would.
fn run_line(line: &[OsString]) -> cli::Outcome {
    let program = OsString::from("strandlight");
    match parse(std::iter::once(&program).chain(line)) {
        Ok(cli) => dispatch(&cli.command),
        Err(error) => Err(cli::usage(&error)),
    }
}
