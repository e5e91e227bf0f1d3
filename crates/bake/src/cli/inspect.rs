//! `strandlight inspect`.

use super::{Failure, Outcome};

/// Says what is in a file
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
