//! `strandlight bench`: run time against error.

mod against;
mod converge;
mod edit;
mod frames;
mod growth;
mod method_tables;
mod multiple;
mod peers;
mod plots;
mod single;
mod transmittance;

use super::Outcome;

/// Benchmark speed against accuracy
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Edit(edit::Args),
    Frames(frames::Args),
    Peers(peers::Args),
    Converge(converge::Args),
    Growth(growth::Args),
    Single(single::Args),
    Multiple(multiple::Args),
    Transmittance(transmittance::Args),
    Plots(plots::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.what {
        What::Edit(args) => edit::run(args),
        What::Frames(args) => frames::run(args),
        What::Peers(args) => peers::run(args),
        What::Converge(args) => converge::run(args),
        What::Growth(args) => growth::run(args),
        What::Single(args) => single::run(args),
        What::Multiple(args) => multiple::run(args),
        What::Transmittance(args) => transmittance::run(args),
        What::Plots(args) => plots::run(args),
    }
}
