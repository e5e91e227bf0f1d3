//! `strandlight bench`: run time against error.

mod single;

use super::Outcome;

/// Measures error and run time
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Single(single::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.what {
        What::Single(args) => single::run(args),
    }
}
