//! `strandlight groom export`, and `strandlight export` of a .groom.

use std::path::{Path, PathBuf};

use strandlight_formats::{BakedFile, Groom, GroomFormat, MotionSection};

use super::frames::{bytes_of, check_bytes};
use super::presets::{self, Preset};
use super::target::{Target, Wish, parse_format};
use super::units::{Axis, parse_cm};
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_outputs};

/// Convert .groom files to the format of another program
///
/// One .groom as `strandlight export` does; several, in their order, as one file that moves, in a
/// format that can. Says on stderr what was kept and what was dropped.
#[derive(clap::Args)]
pub struct Args {
    /// .groom files; - for standard input
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// File to write, in the format of its extension; - for standard output (.hair)
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    target: TargetArgs,
    #[arg(long, value_parser = frame_rate,
        help = format!("Frames per second of a file that moves [default: {}]", MotionSection::DEFAULT_FPS))]
    fps: Option<f64>,
}

/// How a groom is written.
#[derive(clap::Args)]
pub struct TargetArgs {
    /// Output format of a groom [default: by extension]
    #[arg(long, value_parser = parse_format)]
    format: Option<&'static dyn GroomFormat>,
    /// Program that a groom goes to: selects format, unit and axis
    #[arg(long, value_name = "PROGRAM", value_parser = presets::parser())]
    to: Option<&'static Preset>,
    /// Unit that a groom is written in: mm, cm, in, ft, m, or a number of centimetres [default: that
    /// of --to, or else as it was imported if of the same format, or else the format's]
    #[arg(long, value_parser = parse_cm)]
    unit: Option<f64>,
    /// Up axis that a groom is written with [default: likewise]
    #[arg(long, value_enum)]
    up: Option<Axis>,
}

impl TargetArgs {
    /// The first flag that is given.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [
            ("--format", self.format.is_some()),
            ("--to", self.to.is_some()),
            ("--unit", self.unit.is_some()),
            ("--up", self.up.is_some()),
        ];
        flags
            .iter()
            .find_map(|(flag, given)| given.then_some(*flag))
    }

    fn target(&self, output: &Path) -> Result<Target, Failure> {
        let wish = Wish {
            to: self.to,
            format: self.format,
            cm_per_unit: self.unit,
            up: self.up.map(Axis::into),
        };
        let target = Target::new(output, wish, Some(PLAIN_FORMAT))?;
        if target.is_groom() {
            let what = "is a .groom already; name a file of another format";
            return Err(Failure::file(output, what));
        }
        Ok(target)
    }
}

/// The format of a groom that goes to a stream, whose name says none.
const PLAIN_FORMAT: &str = "hair";

fn frame_rate(text: &str) -> Result<f64, String> {
    let fps = text.parse().ok();
    let fps = fps.filter(|fps: &f64| fps.is_finite() && *fps > 0.0);
    fps.ok_or_else(|| "not a number above 0".to_owned())
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Args { files, output, .. } = args;
    let [file] = &files[..] else {
        return export_frames(args);
    };
    if args.fps.is_some() && !args.target.target(output)?.holds_frames() {
        let what = "--fps is for files that move, and its format does not";
        return Err(Failure::file(output, what));
    }
    check_outputs(&[file], &[output])?;
    export(file, output, &args.target)
}

/// Writes the .groom at `input` to `output`, which was checked.
pub fn export(input: &Path, output: &Path, args: &TargetArgs) -> Outcome {
    let target = args.target(output)?;
    let groom = Groom::read(input).map_err(Failure::input)?;
    target.write(&groom, output)
}

fn export_frames(args: &Args) -> Outcome {
    let Args { files, output, .. } = args;
    let target = args.target.target(output)?;
    if !target.holds_frames() {
        let what = format!(
            "{} .groom files in one, and its format does not move",
            files.len()
        );
        return Err(Failure::file(output, what));
    }
    let inputs: Vec<&Path> = files.iter().map(PathBuf::as_path).collect();
    check_outputs(&inputs, &[output])?;
    let progress = progress("frames", files.len() as u64);
    let mut grooms = Vec::new();
    let mut n_bytes = 0;
    for file in files {
        let groom = Groom::read(file).map_err(Failure::input)?;
        n_bytes += bytes_of(&groom);
        check_bytes(n_bytes, output)?;
        grooms.push(groom);
        progress.advance(1);
    }
    progress.finish();
    let fps = args.fps.unwrap_or(MotionSection::DEFAULT_FPS);
    target.write_frames(&grooms, fps, output)
}
