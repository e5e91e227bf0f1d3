//! `strandlight groom generate`.

use std::path::PathBuf;

use strandlight_bake::grooms::{
    GrowSpec, MAX_GENERATED_POINTS, MAX_POINTS_PER_STRAND, MAX_STRANDS, Style, generate,
};

use super::target::{check_groom_name, write_groom};
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_outputs};

/// Generate hair on a head centred at the origin, facing +Z
#[derive(clap::Args)]
pub struct Args {
    /// Hair style
    #[arg(long, value_enum)]
    style: Style,
    #[arg(long, default_value_t = 10_000, help = format!("Number of strands, 1 to {MAX_STRANDS}"))]
    strands: u32,
    #[arg(long, default_value_t = 32, help = format!(
        "Points per strand, 2 to {MAX_POINTS_PER_STRAND}; at most {MAX_GENERATED_POINTS} points in total"))]
    points_per_strand: u32,
    /// Random seed; the output is deterministic for a given seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// .groom file to write, - for standard output
    #[arg(short, long)]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    check_groom_name(&args.output)?;
    check_outputs(&[], &[&args.output])?;
    let spec = GrowSpec {
        style: args.style,
        strands: args.strands,
        points_per_strand: args.points_per_strand,
        seed: args.seed,
    };
    let progress = progress("groom", u64::from(args.strands));
    let groom = generate(&spec, &progress).map_err(Failure::input)?;
    write_groom(&groom, &args.output)
}
