//! `strandlight groom convert`.

use std::path::PathBuf;

use strandlight_formats::GroomFormat;

use super::frames::write_sequence;
use super::import::FrameArgs;
use super::presets::{self, Preset};
use super::source::{SourceArgs, is_groom, read_hair};
use super::target::{Target, Wish, parse_format};
use super::units::{Axis, parse_cm};
use crate::cli::{Failure, Outcome, check_outputs};

/// Convert hair from any format that is read to any that is written, .groom included
///
/// The format is detected from the file's content, and chosen by --to, --format or the ending of
/// OUTPUT. --unit and --up are those of INPUT, --to-unit and --to-up those of OUTPUT.
#[derive(clap::Args)]
pub struct Args {
    /// .groom or hair file of another program, - for standard input
    input: PathBuf,
    /// File to write, - for standard output (a .groom); of several frames as hair.%04d.groom, or one
    /// file in a format that moves
    #[arg(short, long)]
    output: PathBuf,
    /// Program that the hair goes to: selects format, unit and axis
    #[arg(long, value_name = "PROGRAM", value_parser = presets::parser())]
    to: Option<&'static Preset>,
    /// Output format [default: by extension]
    #[arg(long, value_parser = parse_format)]
    format: Option<&'static dyn GroomFormat>,
    /// Unit of OUTPUT: mm, cm, in, ft, m, or a number of centimetres [default: that of --to, or else
    /// as in INPUT if of the same format, or else the format's]
    #[arg(long, value_name = "UNIT", value_parser = parse_cm)]
    to_unit: Option<f64>,
    /// Up axis of OUTPUT [default: likewise]
    #[arg(long, value_name = "UP", value_enum)]
    to_up: Option<Axis>,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    frames: FrameArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Args { input, output, .. } = args;
    let wish = Wish {
        to: args.to,
        format: args.format,
        cm_per_unit: args.to_unit,
        up: args.to_up.map(Axis::into),
    };
    let target = Target::new(output, wish, None)?;
    if is_groom(input)? {
        if args.frames.frames.is_some() {
            let what = "a .groom holds one frame; groom export makes one file of several";
            return Err(Failure::file(input, what));
        }
        check_outputs(&[input], &[output])?;
        let groom = read_hair(input, &args.source, args.frames.frame)?;
        return target.write(&groom, output);
    }
    if let Some(range) = args.frames.frames {
        let source = args.frames.open(input, &args.source)?;
        return write_sequence(&source, input, range, &target, output);
    }
    check_outputs(&[input], &[output])?;
    let source = args.frames.open(input, &args.source)?;
    target.write(&source.groom(args.frames.frame, true)?, output)
}
