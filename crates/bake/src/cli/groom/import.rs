//! `strandlight groom import`.

use std::path::PathBuf;

use strandlight_formats::Groom;

use super::frames::{FrameRange, parse_range, write_sequence};
use super::source::{Source, SourceArgs};
use super::target::{Target, Wish, check_groom_name, write_groom};
use crate::cli::{Failure, Outcome, check_outputs, note};

/// Convert hair of another program to a .groom; the format is detected from the file's content
///
/// With --unit cm, `strandlight export` restores the file byte for byte. `strandlight groom
/// formats` lists the formats. Says on stderr which unit and axis were taken and why, what was kept
/// and what was dropped.
#[derive(clap::Args)]
pub struct Args {
    /// Hair file, - for standard input
    input: PathBuf,
    /// .groom file to write, - for standard output; of several frames as hair.%04d.groom
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    frames: FrameArgs,
}

/// Which frames of a file that moves.
#[derive(clap::Args)]
pub struct FrameArgs {
    /// Frame of a file that moves, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub frame: u32,
    /// Frames of a file that moves, as A..B (both included) or A.. (to the last): one .groom each,
    /// and the motion section for a scene that plays them
    #[arg(long, value_name = "A..B", value_parser = parse_range, conflicts_with = "frame")]
    pub frames: Option<FrameRange>,
}

impl FrameArgs {
    /// The one frame that is read, or the first.
    pub fn open<'a>(
        &self,
        path: &'a std::path::Path,
        args: &'a SourceArgs,
    ) -> Result<Source<'a>, Failure> {
        let first = self.frames.map_or(self.frame, FrameRange::first);
        let source = Source::open(path, args, first)?;
        if source.may_move() && self.frames.is_none() {
            let n = source.frame_times()?.len();
            FrameRange::one(self.frame).of(n, path)?;
            if n > 1 {
                note!(
                    "{}: frame {} of {n} is taken; --frames 0..{} takes all",
                    path.display(),
                    self.frame,
                    n - 1
                );
            }
        } else if self.frames.is_none() && self.frame > 0 {
            FrameRange::one(self.frame).of(1, path)?;
        }
        Ok(source)
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Args { input, output, .. } = args;
    if let Some(range) = args.frames.frames {
        check_groom_name(output)?;
        let source = args.frames.open(input, &args.source)?;
        let target = Target::new(output, Wish::default(), None)?;
        return write_sequence(&source, input, range, &target, output);
    }
    check_outputs(&[input], &[output])?;
    check_groom_name(output)?;
    write_groom(&groom(args)?, output)
}

/// The groom of one frame; what was taken and dropped is said on stderr.
///
/// # Errors
/// The file cannot be read, or what was asked of it is not there.
pub fn groom(args: &Args) -> Result<Groom, Failure> {
    let source = args.frames.open(&args.input, &args.source)?;
    source.groom(args.frames.frame, true)
}
