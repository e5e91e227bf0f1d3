//! `strandlight groom interpolate`.

use strandlight_bake::grooms::{
    InterpolateSpec, Interpolated, MAX_POINTS_PER_STRAND, MAX_STRANDS, interpolate,
};
use strandlight_formats::counted;

use super::source::EditArgs;
use super::target::{Target, Wish};
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_outputs, note};

/// Make strands of guides
///
/// Guides are the curves marked as such, or all where none is. New strands lie between neighbouring
/// guides, those of one side of a parting only. Where the file also has strands that name their
/// closest guides and weights (groom_closest_guides, groom_guide_weights), their roots, guides and
/// weights are used.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    files: EditArgs,
    #[arg(long, help = format!("Number of strands, 1 to {MAX_STRANDS}"))]
    strands: u32,
    #[arg(long, help = format!(
        "Points per strand, 2 to {MAX_POINTS_PER_STRAND} [default: as many as its guides]"))]
    points: Option<u32>,
    /// Random seed; the output is deterministic for a given seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let EditArgs { input, output } = &args.files;
    let target = Target::new(output, Wish::default(), None)?;
    check_outputs(&[input], &[output])?;
    let groom = args.files.read()?;
    let spec = InterpolateSpec {
        strands: args.strands,
        points_per_strand: args.points,
        seed: args.seed,
    };
    let progress = progress("strands", u64::from(args.strands));
    let made = interpolate(&groom, &spec, &progress);
    let Interpolated {
        groom,
        n_guides,
        by_attributes,
        ..
    } = made.map_err(|error| Failure::file(input, error))?;
    let how = match by_attributes {
        true => "roots, closest guides and weights of the file",
        false => "guides with neighbouring roots",
    };
    let guides = counted(n_guides, "guide", "guides");
    note!("{}: {guides}; by {how}", input.display());
    target.write(&groom, output)
}
