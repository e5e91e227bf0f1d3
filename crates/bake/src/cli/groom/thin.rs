//! `strandlight groom thin`.

use strandlight_bake::grooms::thin;

use super::kept::lost_with_strands;
use super::source::EditArgs;
use super::target::{Target, Wish};
use crate::cli::{Failure, Outcome, check_outputs, note};

/// Keep a part of the strands, spread evenly, and widen them so that coverage stays
///
/// Coverage is the sum of length times width. The strands that stay are unchanged but for their
/// widths, which are multiplied by one factor. What says of which guides strands are made is kept
/// where those guides are.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    files: EditArgs,
    /// Number of strands to keep, 1 to as many as there are
    #[arg(long)]
    strands: u32,
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
    let thinned = thin(&groom, args.strands, args.seed);
    let thinned = thinned.map_err(|error| Failure::file(input, error))?;
    if let Some(lost) = lost_with_strands(&groom, &thinned) {
        note!("{}: dropped: {lost}", input.display());
    }
    target.write(&thinned, output)
}
