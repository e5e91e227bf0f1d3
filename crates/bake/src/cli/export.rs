//! `strandlight export`.

mod npy;
mod output;
mod tables;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use strandlight_bake::lights::{exchange, radiance};
use strandlight_formats::{BakedFile, FileKind, Kind, LightSet, TableFile};
use strandlight_images::LatLong;
use strandlight_images::exr_file;

use super::groom::export::{TargetArgs, export as export_groom};
use super::inspect::{Content, lights};
use super::{Failure, Outcome, check_outputs, is_stream, print_line, write_output};
use output::Output;

/// Widest environment map.
const MAX_WIDTH: i64 = 8192;

/// Convert a .tables, .lights or .groom file to another format
///
/// .tables: to .npy (float32, [channel, row, column], and a vector with the values at the texel
/// centres of each axis) or .exr, one file per table, named OUT_TABLE.npy, or OUT/TABLE.npy when
/// OUT is a folder; C is written as C_0 to C_6. A table with three axes becomes a picture with the
/// first two stacked. .lights: to .json (with the formula, and directions to test an evaluation by),
/// .npy (float32, one row of direction, sharpness and colour per light), .h (C), or .exr (the environment
/// map of the lights, latitude-longitude). .groom: to the formats listed by `strandlight groom formats`, such as .hair
/// (diameters as thickness); export to the format a groom was imported from restores the file, byte
/// for byte if imported with --unit cm.
#[derive(clap::Args)]
pub struct Args {
    /// .tables, .lights or .groom file, - for standard input
    file: PathBuf,
    /// File to write, in the format of its extension; - for standard output (JSON for a light set,
    /// .hair for a groom)
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    groom: TargetArgs,
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(2..=MAX_WIDTH),
        help = format!("Width of a light set's environment map, 2 to {MAX_WIDTH} pixels; its height is half the width"))]
    width: u32,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let (input, output) = (&*args.file, &*args.output);
    let extension = output.extension().and_then(|extension| extension.to_str());
    let is_plain = extension.is_none() && is_stream(output);
    if !output.is_dir() {
        check_outputs(&[input], &[output])?;
    }
    let content = Content::of(input)?;
    if let Some(flag) = args.groom.given()
        && !matches!(content, Content::Kind(Kind::Groom))
    {
        return Err(Failure::file(input, format!("{flag} is for grooms")));
    }
    let outputs = match content {
        Content::Kind(Kind::Tables) => {
            let file = TableFile::read(input).map_err(Failure::input)?;
            match extension {
                Some("npy") => tables::to_npy(&file, &pattern(output)),
                Some("exr") => tables::to_exr(&file, &pattern(output))?,
                _ if output.is_dir() => {
                    tables::to_npy(&file, &|name| output.join(format!("{name}.npy")))
                }
                _ => {
                    return Err(unknown(
                        output,
                        "tables",
                        ".npy, .exr or an existing folder",
                    ));
                }
            }
        }
        Content::Kind(Kind::Lights) => match extension {
            _ if is_plain || extension == Some("json") => {
                let info = lights(input)?;
                let mut bytes = serde_json::to_vec_pretty(&info).map_err(Failure::input)?;
                bytes.push(b'\n');
                vec![one(output, "light set as JSON".to_owned(), bytes)]
            }
            Some("npy") => {
                let set = LightSet::read(input).map_err(Failure::input)?;
                let n = set.lights.len();
                let bytes = npy::float32(&[n, 7], &exchange::to_array(&set.lights));
                let what = format!("npy float32 [{n}, 7]: direction x, y, z, sharpness, r, g, b");
                vec![one(output, what, bytes)]
            }
            Some("h") => {
                let set = LightSet::read(input).map_err(Failure::input)?;
                let bytes = exchange::to_c_header(&set).into_bytes();
                vec![one(output, "light set as a C header".to_owned(), bytes)]
            }
            Some("exr") => {
                let set = LightSet::read(input).map_err(Failure::input)?;
                let width = args.width as usize;
                let height = width / 2;
                let bytes = reconstruct(&set, width, height)
                    .map_err(|error| Failure::file(output, error))?;
                let what = format!("OpenEXR, {width} x {height} RGB float32");
                vec![one(output, what, bytes)]
            }
            _ => return Err(unknown(output, "a light set", ".json, .npy, .h or .exr")),
        },
        Content::Kind(Kind::Groom) => return export_groom(input, output, &args.groom),
        Content::Kind(_) => return Err(Failure::file(input, "no other format is available")),
        Content::Hair(format) => return Err(not_ours(input, FileKind::Hair(format))),
        Content::Scene => return Err(not_ours(input, FileKind::Scene)),
    };
    let paths: Vec<&Path> = outputs.iter().map(|output| &*output.path).collect();
    check_outputs(&[input], &paths)?;
    for output in &outputs {
        write_output(&output.path, &output.bytes)?;
    }
    outputs.iter().try_for_each(|output| {
        let bytes = output.bytes.len();
        print_line(format_args!(
            "{}: {}, {bytes} bytes",
            output.path.display(),
            output.what
        ))
    })
}

fn one(path: &Path, what: String, bytes: Vec<u8>) -> Output {
    Output {
        path: path.to_owned(),
        what,
        bytes,
    }
}

fn not_ours(input: &Path, found: FileKind) -> Failure {
    let what = "only .tables, .lights and .groom are exported";
    Failure::file(input, format!("{what}: {}", found.describe()))
}

fn unknown(output: &Path, what: &str, accepted: &str) -> Failure {
    Failure::file(output, format!("{what} can be exported to {accepted}"))
}

/// `a/x.npy` names its files `a/x_NAME.npy`.
fn pattern(output: &Path) -> impl Fn(&str) -> PathBuf + '_ {
    move |name| {
        let mut file = output.file_stem().unwrap_or_default().to_os_string();
        file.push(format!("_{name}."));
        file.push(output.extension().unwrap_or_default());
        output.with_file_name(file)
    }
}

/// The radiance of the light set in every direction, as an OpenEXR file.
fn reconstruct(set: &LightSet, width: usize, height: usize) -> Result<Vec<u8>, String> {
    let grid = LatLong { width, height };
    let pixels: Vec<[f32; 3]> = (0..width * height)
        .into_par_iter()
        .map(|ix| {
            let (x, y) = ((ix % width) as f64 + 0.5, (ix / width) as f64 + 0.5);
            radiance(&set.lights, grid.direction(x, y)).map(|value| value as f32)
        })
        .collect();
    let channel = |c: usize| pixels.iter().map(|pixel| pixel[c]).collect();
    let channels = vec![
        exr_file::floats("R", channel(0)),
        exr_file::floats("G", channel(1)),
        exr_file::floats("B", channel(2)),
    ];
    exr_file::encode_map((width, height), channels)
        .map_err(|error| format!("cannot be encoded: {error}"))
}
