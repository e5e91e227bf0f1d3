//! `strandlight groom import`, `strandlight groom formats` and `strandlight groom generate`.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use strandlight_bake::grooms::{
    GrowSpec, MAX_POINTS, MAX_POINTS_PER_STRAND, MAX_STRANDS, Style, generate,
};
use strandlight_formats::{
    AttributeSupport, BakedFile, CurveBasis, DiameterRange, DiameterSource, FormatInfo,
    GROOM_FORMATS, Groom, Guess, Guesses, ImportOptions, Kind, LengthUnit, Scene, SourceFile,
    UpAxis,
};
use strandlight_scene::files::Files;

use super::{Failure, Outcome, check_outputs, note, print_line, write_output};
use crate::cli::progress::progress;

/// Import or generate hair
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Import(ImportArgs),
    /// List the supported hair formats
    Formats,
    Generate(GenerateArgs),
}

/// Convert hair of another program to a .groom; the format is detected from the file's content
///
/// With --unit cm, `strandlight export` restores the file byte for byte. `strandlight groom
/// formats` lists the formats.
#[derive(clap::Args)]
struct ImportArgs {
    /// Hair file, - for standard input
    input: PathBuf,
    /// .groom file to write, - for standard output
    #[arg(short, long)]
    output: PathBuf,
    /// Unit of the file: mm, cm, in, ft, m, a number of centimetres, or auto (estimated from the
    /// size of the head; an error if ambiguous) [default: the format's, cm for .hair]
    #[arg(long, value_parser = parse_unit)]
    unit: Option<Unit>,
    /// Up axis of the file; auto estimates it from the position of the head and the direction in
    /// which hair hangs (an error if ambiguous) [default: the format's, z for .hair]
    #[arg(long, value_enum)]
    up: Option<Up>,
}

/// Centimetres per unit, or to be guessed.
#[derive(Clone, Copy)]
enum Unit {
    Auto,
    Cm(f64),
}

#[derive(Clone, Copy, ValueEnum)]
enum Up {
    X,
    Y,
    Z,
    Auto,
}

/// Generate hair on a head centred at the origin, facing +Z
#[derive(clap::Args)]
struct GenerateArgs {
    /// Hair style
    #[arg(long, value_enum)]
    style: Style,
    #[arg(long, default_value_t = 10_000, help = format!("Number of strands, 1 to {MAX_STRANDS}"))]
    strands: u32,
    #[arg(long, default_value_t = 32, help = format!(
        "Points per strand, 2 to {MAX_POINTS_PER_STRAND}; at most {MAX_POINTS} points in total"))]
    points_per_strand: u32,
    /// Random seed; the output is deterministic for a given seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// .groom file to write, - for standard output
    #[arg(short, long)]
    output: PathBuf,
}

fn parse_unit(text: &str) -> Result<Unit, String> {
    if text == "auto" {
        return Ok(Unit::Auto);
    }
    let named = LengthUnit::from_name(text).map(LengthUnit::cm);
    let cm = named.or_else(|| text.parse().ok()).unwrap_or(f64::NAN);
    if (1e-6..=1e6).contains(&cm) {
        Ok(Unit::Cm(cm))
    } else {
        Err(format!(
            "must be {}, a number of centimetres in 1e-6..=1e6, or auto",
            unit_names()
        ))
    }
}

fn unit_names() -> String {
    LengthUnit::ALL.map(LengthUnit::name).join(", ")
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Import(args) => import(args),
        Command::Formats => GROOM_FORMATS
            .into_iter()
            .try_for_each(|format| print_line(text_of_format(format.info()))),
        Command::Generate(args) => {
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
    }
}

/// A line of `groom formats`.
fn text_of_format(info: &FormatInfo) -> String {
    let endings: Vec<String> = info
        .extensions
        .iter()
        .map(|end| format!(".{end}"))
        .collect();
    let way = match (info.can.reads, info.can.writes) {
        (true, true) => "in and out",
        (true, false) => "in",
        _ => "out",
    };
    let bases: Vec<&str> = info
        .can
        .bases
        .iter()
        .map(|basis| CurveBasis::name(*basis))
        .collect();
    let attributes = match info.can.attributes {
        AttributeSupport::Only([]) => "no attributes".to_owned(),
        AttributeSupport::Only(names) => names.join(", "),
        _ => "any attributes".to_owned(),
    };
    let frames = if info.can.frames { ", animation" } else { "" };
    format!(
        "{}: {}, {way}; {} cm a unit and {} up unless the file says otherwise; {} curves, \
         {attributes}{frames}",
        info.name,
        endings.join(", "),
        info.cm_per_unit,
        info.up.name(),
        bases.join(", "),
    )
}

fn import(args: &ImportArgs) -> Outcome {
    check_outputs(&[&args.input], &[&args.output])?;
    let file = SourceFile::read(&args.input).map_err(Failure::input)?;
    let options = options(args, &file)?;
    let import = file.import(&options).map_err(Failure::input)?;
    for line in &import.notes {
        note!("{line}");
    }
    let groom = import.groom;
    let doubts = doubts(&groom, groom.diameter_range());
    for line in &doubts {
        note!("{line}");
    }
    let size = groom.size();
    if doubts.is_empty() && !(10.0..=200.0).contains(&size) {
        note!("the groom is {size:.1} cm large; is --unit right?");
    }
    write_groom(&groom, &args.output)
}

/// What the command line says of unit and axis, guesses put in where it says auto.
fn options(args: &ImportArgs, file: &SourceFile) -> Result<ImportOptions, Failure> {
    let guesses = match (args.unit, args.up) {
        (Some(Unit::Auto), _) | (_, Some(Up::Auto)) => {
            file.guess_source().map_err(Failure::input)?
        }
        _ => Guesses::default(),
    };
    let mut options = ImportOptions::default();
    options.cm_per_unit = match (args.unit, guesses.unit) {
        (None, _) => None,
        (Some(Unit::Cm(cm)), _) => Some(cm),
        (Some(Unit::Auto), Some(Guess { value, because })) => {
            note!("taken as --unit {}: {because}", value.name());
            Some(value.cm())
        }
        (Some(Unit::Auto), None) => {
            let what = format!(
                "--unit auto: it is not like a head of hair in any unit; give {}, or a number \
                 of centimetres",
                unit_names()
            );
            return Err(Failure::file(&args.input, what));
        }
    };
    options.up = match (args.up, guesses.up) {
        (None, _) => None,
        (Some(Up::X), _) => Some(UpAxis::X),
        (Some(Up::Y), _) => Some(UpAxis::Y),
        (Some(Up::Z), _) => Some(UpAxis::Z),
        (Some(Up::Auto), Some(Guess { value, because })) => {
            note!("taken as --up {}: {because}", value.name());
            Some(value)
        }
        (Some(Up::Auto), None) => {
            let what = "--up auto: cannot determine the up axis from the position or the hair; use x, y or z";
            return Err(Failure::file(&args.input, what));
        }
    };
    Ok(options)
}

/// What seems wrong with unit, axes and thickness of `groom`, drawn as `drawn` says, in lines.
pub fn doubts(groom: &Groom, drawn: DiameterRange) -> Vec<String> {
    let mut lines = groom.doubts(drawn);
    let faults = groom.thickness_faults();
    let faults = faults.filter(|_| drawn.source != DiameterSource::Scene);
    lines.extend(faults.map(|faults| faults.to_string()));
    lines
}

/// Says on stderr what seems wrong with unit, axes and thickness of the hair that `scene` draws. A
/// groom that cannot be read is for the renderer to refuse.
pub fn note_doubts(scene: &Scene) {
    let path = scene.groom_path();
    if let Ok(groom) = Files::Disk.groom(&path) {
        for line in doubts(&groom, scene.hair.diameter_range(&groom)) {
            note!("{}: {line}", path.display());
        }
    }
}

fn write_groom(groom: &Groom, path: &Path) -> Outcome {
    let bytes = groom
        .to_bytes()
        .map_err(|error| Failure::file(path, error))?;
    write_output(path, &bytes)?;
    let (major, minor) = Kind::Groom.version();
    print_line(format_args!(
        "{}: groom {major}.{minor}, {} strands, {} points, {} bytes",
        path.display(),
        groom.n_strands(),
        groom.points.len(),
        bytes.len()
    ))
}
