//! Hair that is read: from a .groom, or from a file of another program by its own word, a guess, or
//! the command line.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use strandlight_bake::grooms::{dye_from_color, guides, subset, turn_strands, turned_strands};
use strandlight_formats::{
    BakedFile, Error, FileKind, Groom, Guess, Guesses, ImportOptions, Kind, NoteKind, SNIFF_BYTES,
    SourceFile, StatedBy, UpAxis, counted, read_start,
};

use super::doubts::{doubts, odd_size};
use super::kept::{lost_with_strands, note_kept};
use super::units::{Unit, Up, parse_unit, unit_names, unit_text};
use crate::cli::{Failure, note};

/// How a file of hair is understood.
#[derive(clap::Args, Default)]
pub struct SourceArgs {
    /// Unit of the file: mm, cm, in, ft, m, a number of centimetres, or auto (as the file says, or
    /// else estimated from the size of the head; an error if ambiguous) [default: as the file says,
    /// or else the format's, cm for .hair]
    #[arg(long, value_parser = parse_unit)]
    unit: Option<Unit>,
    /// Up axis of the file; auto takes what the file says, or else estimates it from the position of
    /// the head and the direction in which hair hangs (an error if ambiguous) [default: as the file
    /// says, or else the format's, z for .hair]
    #[arg(long, value_enum)]
    up: Option<Up>,
    /// Read this object of the file and all below it, as /head/hair [default: all hair]
    #[arg(long, value_name = "PATH")]
    prim: Option<String>,
    /// Points that each segment of a cubic curve becomes, 1 to 64 [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    samples_per_segment: Option<u32>,
    /// Order of the points: keep it, or turn strands whose tips are nearer to the middle of the roots
    #[arg(long, value_enum, default_value_t)]
    root: Root,
    /// Guides in a file that also has other strands; a file of guides alone keeps them
    #[arg(long, value_enum, default_value_t)]
    guides: GuideUse,
    /// Dye the hair with the colours of this attribute, as color: attribute dye holds the absorption
    /// that makes a head of such hair look so
    #[arg(long, value_name = "NAME")]
    color_from: Option<String>,
}

/// Order of the points of strands.
#[derive(Clone, Copy, Default, ValueEnum)]
enum Root {
    /// As the file has it
    #[default]
    Keep,
    /// Turn strands that seem to run from tip to root
    Auto,
}

/// What to do with guides among strands.
#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum GuideUse {
    /// Leave the guides out
    #[default]
    Drop,
    /// Keep them among the strands
    Keep,
    /// Keep the guides alone
    Only,
}

impl SourceArgs {
    /// Is anything asked for that only files of other programs take?
    pub fn is_about_files(&self) -> bool {
        self.unit.is_some()
            || self.up.is_some()
            || self.prim.is_some()
            || self.samples_per_segment.is_some()
    }
}

/// A file of hair, and how it is understood.
pub struct Source<'a> {
    path: &'a Path,
    args: &'a SourceArgs,
    file: SourceFile,
    options: ImportOptions,
    /// Why the unit and the axis were guessed, where they were.
    because: [Option<String>; 2],
}

impl<'a> Source<'a> {
    /// Reads the file of another program at `path`, and finds out its unit and axis, by frame
    /// `frame` if that takes a guess.
    pub fn open(path: &'a Path, args: &'a SourceArgs, frame: u32) -> Result<Self, Failure> {
        let file = SourceFile::read(path).map_err(Failure::input)?;
        let info = file.format().info();
        if args.prim.is_some() && !info.can.objects {
            let what = format!("--prim: {} has no named objects", info.title);
            return Err(Failure::file(path, what));
        }
        let mut options = ImportOptions::default().with_frame(frame);
        options.object = args.prim.clone();
        if let Some(n) = args.samples_per_segment {
            options.samples_per_segment = n;
        }
        if let Some(Unit::Cm(cm)) = args.unit {
            options.cm_per_unit = Some(cm);
        }
        options.up = args.up.and_then(Up::axis);
        let mut source = Source {
            path,
            args,
            file,
            options,
            because: [None, None],
        };
        if matches!(args.unit, Some(Unit::Auto)) || args.up == Some(Up::Auto) {
            source.find_out()?;
        }
        Ok(source)
    }

    /// Unit and axis where the command line says auto: the file's word, or else a guess.
    fn find_out(&mut self) -> Result<(), Failure> {
        let (stated, guesses) = match self.file.import(&self.options) {
            Ok(import) => (
                [import.unit_by, import.up_by].map(|by| by == StatedBy::File),
                import.groom.guess_source(),
            ),
            // In the usual unit it may be too large for a groom.
            Err(error @ Error::Value { .. }) if self.options.cm_per_unit.is_none() => {
                let small = self.options.clone().with_unit(0.01);
                let import = self.file.import(&small);
                let import = import.map_err(|_| Failure::input(error))?;
                ([false; 2], import.groom.guess_source())
            }
            Err(error) => return Err(Failure::input(error)),
        };
        let Guesses { unit, up } = guesses;
        let [unit_stated, up_stated] = stated;
        if matches!(self.args.unit, Some(Unit::Auto)) && !unit_stated {
            let Some(Guess { value, because }) = unit else {
                let what = format!(
                    "--unit auto: it is not like a head of hair in any unit; give {}, or a number \
                     of centimetres",
                    unit_names()
                );
                return Err(Failure::file(self.path, what));
            };
            self.options.cm_per_unit = Some(value.cm());
            self.because[0] = Some(because);
        }
        if self.args.up == Some(Up::Auto) && !up_stated {
            let Some(Guess { value, because }) = up else {
                let what = "--up auto: cannot determine the up axis from the position or the hair; use x, y or z";
                return Err(Failure::file(self.path, what));
            };
            self.options.up = Some(value);
            self.because[1] = Some(because);
        }
        Ok(())
    }

    /// Times of its points in time, seconds.
    pub fn frame_times(&self) -> Result<Vec<f64>, Failure> {
        self.file.frame_times().map_err(Failure::input)
    }

    /// Can files of its format move?
    pub fn may_move(&self) -> bool {
        self.file.format().info().can.frames
    }

    /// The groom at point `frame` in time; with `says`, what was taken and what was dropped goes to
    /// stderr.
    pub fn groom(&self, frame: u32, says: bool) -> Result<Groom, Failure> {
        let options = self.options.clone().with_frame(frame);
        let import = self.file.import(&options).map_err(Failure::input)?;
        let taken = self.taken(&import.groom, import.unit_by, import.up_by);
        let mut dropped = Vec::new();
        let mut lines = Vec::new();
        for line in import.notes {
            match line.kind {
                NoteKind::Dropped => dropped.push(line.text),
                _ => lines.push(line.text),
            }
        }
        let mut groom = import.groom;
        lines.extend(odd_size(&groom));
        lines.extend(doubts(&groom, groom.diameter_range()));
        finish(&mut groom, self.args, self.path, &mut lines, &mut dropped)?;
        if says {
            note!("{}: {taken}", self.path.display());
            for line in &lines {
                note!("{line}");
            }
            note_kept(self.path, &groom, &dropped);
        }
        Ok(groom)
    }

    /// Which unit and axis were taken, and why.
    fn taken(&self, groom: &Groom, unit_by: StatedBy, up_by: StatedBy) -> String {
        let why = |because: &Option<String>, by: StatedBy, flag: &str| match (because, by) {
            (Some(because), _) => format!("guessed: {because}"),
            (None, StatedBy::Options) => flag.to_owned(),
            (None, StatedBy::File) => "the file says so".to_owned(),
            _ => "by convention of the format".to_owned(),
        };
        let [unit, up] = &self.because;
        format!(
            "unit {} ({}); {} up ({})",
            unit_text(groom.source.cm_per_unit),
            why(unit, unit_by, "--unit"),
            UpAxis::name(groom.source.up),
            why(up, up_by, "--up"),
        )
    }
}

/// Does to a groom what the command line asks for, whatever it was read from.
fn finish(
    groom: &mut Groom,
    args: &SourceArgs,
    path: &Path,
    lines: &mut Vec<String>,
    dropped: &mut Vec<String>,
) -> Result<(), Failure> {
    use_guides(groom, args.guides, path, lines, dropped)?;
    if let Root::Auto = args.root {
        let turned = turned_strands(groom);
        turn_strands(groom, &turned).map_err(Failure::input)?;
        if !turned.is_empty() {
            lines.push(format!(
                "--root auto: {} of {} ran from tip to root and {} turned",
                turned.len(),
                counted(groom.n_strands(), "strand", "strands"),
                if turned.len() == 1 { "was" } else { "were" }
            ));
        }
    }
    if let Some(name) = &args.color_from {
        let dyed = dye_from_color(groom, name).map_err(|error| Failure::file(path, error))?;
        if dyed.n_clamped > 0 {
            lines.push(format!(
                "--color-from {name}: {} of {} colours are outside 0..=1 and were clamped",
                dyed.n_clamped, dyed.n_values
            ));
        }
        if dyed.replaces_dye {
            lines.push(format!("--color-from {name}: replaces the dye of the file"));
        }
    }
    Ok(())
}

fn use_guides(
    groom: &mut Groom,
    asked: GuideUse,
    path: &Path,
    lines: &mut Vec<String>,
    dropped: &mut Vec<String>,
) -> Result<(), Failure> {
    let Some(is_guide) = guides(groom) else {
        return match asked {
            GuideUse::Only => Err(Failure::file(path, "--guides only: it has no guides")),
            _ => Ok(()),
        };
    };
    let n = groom.n_strands();
    let n_guides = is_guide.iter().filter(|&&is_guide| is_guide).count();
    if n_guides == n {
        lines.push(format!(
            "{}, all guides: the hair itself is not in the file; `strandlight groom \
             interpolate` makes strands of them",
            counted(n, "curve", "curves")
        ));
        return Ok(());
    }
    let wanted = match asked {
        GuideUse::Keep => {
            lines.push(format!(
                "{n_guides} of {n} curves are guides, and are drawn"
            ));
            return Ok(());
        }
        GuideUse::Drop => {
            dropped.push(counted(n_guides, "guide", "guides") + " (--guides keep)");
            false
        }
        GuideUse::Only => {
            dropped.push(counted(
                n - n_guides,
                "strand that is no guide",
                "strands that are no guides",
            ));
            true
        }
    };
    let kept: Vec<usize> = (0..n).filter(|&ix| is_guide[ix] == wanted).collect();
    let taken = subset(groom, &kept);
    dropped.extend(lost_with_strands(groom, &taken));
    *groom = taken;
    // It is about all strands of the file.
    groom.source.original = None;
    Ok(())
}

/// Is the file at `path` a .groom?
pub fn is_groom(path: &Path) -> Result<bool, Failure> {
    let start = read_start(path, SNIFF_BYTES as u64).map_err(Failure::input)?;
    Ok(matches!(FileKind::of(&start), FileKind::Ours(Kind::Groom)))
}

/// The groom in any file of hair, and what `args` ask of it; of a moving file, frame `frame`.
pub fn read_hair(path: &Path, args: &SourceArgs, frame: u32) -> Result<Groom, Failure> {
    if !is_groom(path)? {
        return Source::open(path, args, frame)?.groom(frame, true);
    }
    if args.is_about_files() || frame > 0 {
        let what = "a .groom is in centimetres with y up and holds one frame and object; --unit, --up, \
                    --prim, --samples-per-segment and --frame are for files of other programs";
        return Err(Failure::file(path, what));
    }
    let mut groom = Groom::read(path).map_err(Failure::input)?;
    let (mut lines, mut dropped) = (Vec::new(), Vec::new());
    finish(&mut groom, args, path, &mut lines, &mut dropped)?;
    for line in &lines {
        note!("{line}");
    }
    if !dropped.is_empty() {
        note_kept(path, &groom, &dropped);
    }
    Ok(groom)
}

/// A file of hair to edit, taken as it says itself or as its format has it, guides and all.
#[derive(clap::Args)]
pub struct EditArgs {
    /// .groom or hair file of another program, - for standard input
    pub input: PathBuf,
    /// File to write, a .groom or a hair format by its extension; - for standard output (a .groom)
    #[arg(short, long)]
    pub output: PathBuf,
}

impl EditArgs {
    /// The hair to edit.
    pub fn read(&self) -> Result<Groom, Failure> {
        read_to_edit(&self.input)
    }
}

/// The hair to edit at `path`, guides and all.
pub fn read_to_edit(path: &Path) -> Result<Groom, Failure> {
    let args = SourceArgs {
        guides: GuideUse::Keep,
        ..SourceArgs::default()
    };
    read_hair(path, &args, 0)
}
