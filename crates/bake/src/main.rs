//! `strandlight`: bakes light sets, tables and grooms, verifies and renders them.
//!
//! Exit codes: 0 done; 1 a check failed; 2 bad usage or bad input; 75 worth trying again; 129, 130, 143
//! interrupted.

mod cli;

use std::collections::HashSet;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
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
    strandlight_runtime::work::end_all_when_interrupted();
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
        Err(answer) => return answered(&answer),
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

fn parse(words: impl IntoIterator<Item = OsString>) -> clap::error::Result<Cli> {
    let command = Cli::command();
    let words = with_negative_values(&command, words);
    Cli::from_arg_matches(&command.try_get_matches_from(words)?)
}

/// Joins what begins like a number below 0 to the option before it, as in `--size=-4x3`, so that the
/// option's own parser says what is wrong with it. With clap's `allow_hyphen_values` an option would
/// also take the next one for the value that was forgotten.
fn with_negative_values(
    command: &clap::Command,
    words: impl IntoIterator<Item = OsString>,
) -> Vec<OsString> {
    let options = options_of_one_value(command);
    let mut joined: Vec<OsString> = Vec::new();
    let mut is_after_options = false;
    for word in words {
        is_after_options |= word == "--";
        let is_negative = matches!(word.as_encoded_bytes(), [b'-', b'0'..=b'9' | b'.', ..]);
        let option = joined.last_mut().filter(|last| {
            let last = last.to_str();
            last.is_some_and(|last| options.contains(last))
        });
        match option {
            Some(option) if is_negative && !is_after_options => {
                option.push("=");
                option.push(word);
            }
            _ => joined.push(word),
        }
    }
    joined
}

/// Options that take one value, as `--long` and `-s`, of all commands.
fn options_of_one_value(command: &clap::Command) -> HashSet<String> {
    let arguments = command.get_arguments().filter(|argument| {
        let is_one = |n: clap::builder::ValueRange| n.max_values() == 1;
        let takes_one = argument.get_num_args().is_none_or(is_one);
        takes_one && argument.get_action().takes_values() && !argument.is_positional()
    });
    let names = arguments.flat_map(|argument| {
        let long = argument.get_long_and_visible_aliases().unwrap_or_default();
        let short = argument.get_short().map(|name| format!("-{name}"));
        let long = long.into_iter().map(|name| format!("--{name}"));
        long.chain(short).collect::<Vec<String>>()
    });
    let of_subcommands = command.get_subcommands().flat_map(options_of_one_value);
    names.chain(of_subcommands).collect()
}

/// Prints help or the version: answers, not errors. A reader that is gone wants no more of them.
fn answered(answer: &clap::Error) -> ExitCode {
    let printed = answer.print().and_then(|()| std::io::stdout().flush());
    match printed {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            ended_by(&cli::Failure::file(Path::new(cli::STDOUT), error))
        }
        _ => ExitCode::from(answer.exit_code().try_into().unwrap_or(2)),
    }
}

fn ended_by(failure: &cli::Failure) -> ExitCode {
    cli::print_failure(failure);
    ExitCode::from(failure.exit_code())
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
    match parse(std::iter::once(program).chain(line.iter().cloned())) {
        Ok(cli) => dispatch(&cli.command),
        Err(error) => Err(cli::usage(&error)),
    }
}
