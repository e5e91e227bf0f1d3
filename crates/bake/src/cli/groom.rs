//! `strandlight groom import` and `strandlight groom generate`.

use std::path::{Path, PathBuf};

use clap::{Subcommand, ValueEnum};
use strandlight_bake::grooms::{GrowSpec, Style, generate};
use strandlight_bake::progress::Progress;
use strandlight_formats::{Groom, HairImport, Kind, UpAxis};

use super::{Failure, Outcome, check_outputs, note, print_line, write_output};

/// Imports or generates hair
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Import(ImportArgs),
    Generate(GenerateArgs),
}

/// Turns a .hair file (Cem Yuksel's format) into a .groom
///
/// With --unit cm the file can be had back byte for byte with `strandlight export`.
#[derive(clap::Args)]
struct ImportArgs {
    /// The .hair file
    input: PathBuf,
    /// The .groom file to write
    #[arg(short, long)]
    output: PathBuf,
    /// Unit of the file: mm, cm, m, in, ft, or a number of centimetres
    #[arg(long, default_value = "cm", value_parser = parse_unit)]
    unit: f64,
    /// Axis that points up in the file: y, z or x; auto is z, the convention of .hair files
    #[arg(long, default_value = "auto")]
    up: Up,
}

#[derive(Clone, Copy, ValueEnum)]
enum Up {
    Auto,
    X,
    Y,
    Z,
}

/// Grows hair on a head centred at the origin, facing +Z
#[derive(clap::Args)]
struct GenerateArgs {
    /// The hair style
    #[arg(long, value_parser = parse_style)]
    style: Style,
    /// Number of strands, 1 to 1000000
    #[arg(long, default_value_t = 10_000)]
    strands: u32,
    /// Points of each strand, 2 to 4096; 67 million points at most in all
    #[arg(long, default_value_t = 32)]
    points_per_strand: u32,
    /// Equal seeds give equal files
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The .groom file to write
    #[arg(short, long)]
    output: PathBuf,
}

fn parse_style(text: &str) -> Result<Style, String> {
    Style::from_name(text).ok_or_else(|| {
        let names = Style::ALL.map(Style::name).join(", ");
        format!("there is no style {text}, only {names}")
    })
}

/// Centimetres per unit.
fn parse_unit(text: &str) -> Result<f64, String> {
    let cm = match text {
        "mm" => 0.1,
        "cm" => 1.0,
        "m" => 100.0,
        "in" => 2.54,
        "ft" => 30.48,
        _ => text.parse().unwrap_or(f64::NAN),
    };
    if (1e-6..=1e6).contains(&cm) {
        Ok(cm)
    } else {
        Err("must be mm, cm, m, in, ft or a number of centimetres in 1e-6..=1e6".to_owned())
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.command {
        Command::Import(args) => import(args),
        Command::Generate(args) => {
            check_outputs(&[], &[&args.output])?;
            let spec = GrowSpec {
                style: args.style,
                strands: args.strands,
                points_per_strand: args.points_per_strand,
                seed: args.seed,
            };
            let progress = Progress::new("groom", u64::from(args.strands));
            let groom = generate(&spec, &progress).map_err(Failure::input)?;
            write_groom(&groom, &args.output)
        }
    }
}

fn import(args: &ImportArgs) -> Outcome {
    check_outputs(&[&args.input], &[&args.output])?;
    let options = HairImport {
        cm_per_unit: args.unit,
        up: match args.up {
            Up::X => UpAxis::X,
            Up::Y => UpAxis::Y,
            Up::Auto | Up::Z => UpAxis::Z,
        },
    };
    let groom = Groom::read_hair(&args.input, options).map_err(Failure::input)?;
    let singles = groom
        .source
        .hair
        .as_ref()
        .map_or(0, |hair| hair.single_points.len());
    if singles > 0 {
        note!("{singles} strands of a single point are kept for export but not drawn");
    }
    let (min, max) = groom.bounds();
    let size = [0, 1, 2].map(|axis| max[axis] - min[axis]);
    let longest = size.into_iter().fold(0.0, f32::max);
    if !(10.0..=200.0).contains(&longest) {
        note!("the groom is {longest:.1} cm large; is --unit right?");
    }
    write_groom(&groom, &args.output)
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
