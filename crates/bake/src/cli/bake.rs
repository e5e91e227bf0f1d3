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
    run: run::RunArgs,
}

#[derive(clap::Subcommand)]
enum Command {
    Status(status::Args),
    Report(report::Args),
    Plan(plan::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.command {
        Some(Command::Status(args)) => status::run(args),
        Some(Command::Report(args)) => report::run(args),
        Some(Command::Plan(args)) => plan::run(args),
        None => run::run(&args.run),
    }
}
