//! `strandlight groom`: hair from and for other programs, and what can be done to it.

mod check;
mod convert;
mod doubts;
pub mod export;
mod formats;
pub mod frames;
mod generate;
pub mod import;
mod interpolate;
mod kept;
mod merge;
mod presets;
mod resample;
mod source;
mod stats;
mod target;
mod thin;
mod transform;
mod units;

use clap::Subcommand;

use super::Outcome;

pub use doubts::{doubts, note_doubts};
pub use units::parse_cm;

/// Import, export, convert, check, edit or generate hair
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Import(import::Args),
    Export(export::Args),
    Convert(convert::Args),
    /// List the supported hair formats
    Formats,
    Check(check::Args),
    Stats(stats::Args),
    Thin(thin::Args),
    Resample(resample::Args),
    Interpolate(interpolate::Args),
    Transform(transform::Args),
    Merge(merge::Args),
    Generate(generate::Args),
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Import(args) => import::run(args),
        Command::Export(args) => export::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Formats => formats::run(),
        Command::Check(args) => check::run(args),
        Command::Stats(args) => stats::run(args),
        Command::Thin(args) => thin::run(args),
        Command::Resample(args) => resample::run(args),
        Command::Interpolate(args) => interpolate::run(args),
        Command::Transform(args) => transform::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Generate(args) => generate::run(args),
    }
}
