//! `strandlight groom`.

use super::{Failure, Outcome};

/// Imports or generates hair
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
