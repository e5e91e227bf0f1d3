//! `strandlight groom resample`.

use strandlight_bake::grooms::{MAX_POINTS_PER_STRAND, Resample, resample};

use super::source::EditArgs;
use super::target::{Target, Wish};
use crate::cli::{Failure, Outcome, check_outputs};

/// Give strands other points: a number of them at equal distances, or as few as an error allows
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    files: EditArgs,
    #[command(flatten)]
    how: How,
}

#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct How {
    #[arg(long, help = format!(
        "Points of every strand, at equal distances, 2 to {MAX_POINTS_PER_STRAND}; widths and paint are \
         interpolated there, and what is finer is lost"
    ))]
    points: Option<u32>,
    /// Leave out points while the others stay this near to the strand, cm, and widths and paint within
    /// 5 % of their largest value
    #[arg(long, value_name = "CM")]
    max_error: Option<f32>,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let EditArgs { input, output } = &args.files;
    let target = Target::new(output, Wish::default(), None)?;
    check_outputs(&[input], &[output])?;
    let how = match (args.how.points, args.how.max_error) {
        (Some(n), _) => Resample::Points(n),
        (None, cm) => Resample::MaxError(cm.unwrap_or_default()),
    };
    let groom = args.files.read()?;
    let made = resample(&groom, how).map_err(|error| Failure::file(input, error))?;
    target.write(&made, output)
}
