//! `strandlight tables`.

use super::{Failure, Outcome};

/// Bakes the tables
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
