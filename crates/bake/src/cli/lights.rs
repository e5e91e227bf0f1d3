//! `strandlight lights`.

use super::{Failure, Outcome};

/// Fits spherical Gaussian lights to an HDR map
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: &Args) -> Outcome {
    Err(Failure::Input("not built yet".to_owned()))
}
