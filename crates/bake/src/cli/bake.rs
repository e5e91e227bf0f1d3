//! `strandlight bake`: what a manifest asks for, made again only where something has changed.

mod events;
mod exit;
mod items;
mod kinds;
mod plan;
mod report;
mod run;
mod status;

use super::Outcome;

/// Make what a manifest asks for, and only what has changed
///
/// A manifest (bake.toml) names maps, hair and tables by patterns, with their parameters. An item is
/// made again when its input, a parameter or this program changed, or an output is missing or
/// altered. Hashes are kept in .strandlight-bake beside the outputs. A run that is ended at any moment
/// leaves whole files, and the next one resumes it. Exit code 2: bad input, which no retry mends; 75:
/// a full disk or another passing cause.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: Option<run::RunArgs>,
}

#[derive(clap::Subcommand)]
enum Command {
    Status(status::Args),
    Report(report::Args),
    Plan(plan::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match (&args.command, &args.run) {
        (Some(Command::Status(args)), _) => status::run(args),
        (Some(Command::Report(args)), _) => report::run(args),
        (Some(Command::Plan(args)), _) => plan::run(args),
        (None, Some(args)) => run::run(args),
        // The parser asks for a manifest or a subcommand.
        (None, None) => Ok(()),
    }
}
