//! `strandlight probe`.

use super::{Failure, Outcome};

/// Values of the model at given points
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
