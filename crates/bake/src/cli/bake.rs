//! `strandlight bake`: what a manifest asks for, made again only where something has changed.

mod events;
mod exit;
mod items;
mod kinds;
mod plan;
mod report;
mod run;
mod status;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use strandlight_formats::output_target;

use strandlight_bake::manifest::Item;

use super::{Failure, Outcome, check_outputs};

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

/// Refuses, before any work is done, outputs beside those of the items of a manifest that cannot be written or that
/// are a file of the manifest.
fn check_beside(manifest: &Path, items: &[Item], outputs: &[&Path]) -> Outcome {
    let inputs: Vec<PathBuf> = items.iter().filter_map(Item::input_path).collect();
    let inputs = inputs.iter().map(PathBuf::as_path);
    let inputs: Vec<&Path> = inputs.chain(std::iter::once(manifest)).collect();
    check_outputs(&inputs, outputs)?;
    if outputs.is_empty() {
        return Ok(());
    }
    let made = items.iter().flat_map(|item| {
        let outputs = item.outputs.iter();
        outputs.filter_map(|output| output_target(&item.resolve(&output.path)).ok())
    });
    let made: HashSet<_> = made.collect();
    for path in outputs {
        if output_target(path).is_ok_and(|target| made.contains(&target)) {
            return Err(Failure::file(
                path,
                "is an output of the manifest; name another file",
            ));
        }
    }
    Ok(())
}
