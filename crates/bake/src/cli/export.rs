//! `strandlight export`.

use super::{Failure, Outcome};

/// Writes a file in another format
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
