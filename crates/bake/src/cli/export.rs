//! `strandlight export`.

mod npy;
mod output;
mod tables;

use std::path::{Path, PathBuf};

use strandlight_bake::lights::rig::{self, RigTarget};
use strandlight_bake::lights::{exchange, rest_parameter, texel_means};
use strandlight_formats::{
    BakedFile, FileKind, Kind, LightSet, SNIFF_BYTES, TableFile, read_start,
};
use strandlight_images::exr_file;
use strandlight_images::{LatLong, Map};

use super::groom::export::{TargetArgs, export as export_groom};
use super::inspect::{Content, lights};
use super::{Failure, Outcome, check_outputs, is_stream, note, print_line, write_output};
use output::Output;

/// Widest environment map.
const MAX_WIDTH: u32 = 8192;
/// Its width where none is given.
const DEFAULT_WIDTH: u32 = 1024;

/// Convert a .tables, .lights or .groom file, or an HDR map, to another format
///
/// .tables: to .npy (float32, [channel, row, column], and a vector with the values at the texel
/// centres of each axis) or .exr, one file per table, named OUT_TABLE.npy, or OUT/TABLE.npy when
/// OUT is a folder; the channels of table C are C0 to C6. A table with three axes becomes a picture with the
/// first two stacked. .lights: to .json (with the formula, and directions to test an evaluation by),
/// .npy (float32, one row of direction, sharpness and colour per light), .h (C), .exr (the environment
/// map of the lights, latitude-longitude), or .usda (USD: a distant light for each). .groom: to the formats listed by `strandlight groom formats`, such as .hair
/// (diameters as thickness); export to the format a groom was imported from restores the file, byte
/// for byte if imported with --unit cm. HDR map (OpenEXR, Radiance): to .npy (float32, [row, column, channel]), the
/// pixels as `lights` reads them: linear Rec.709 radiance, none negative.
#[derive(clap::Args)]
pub struct Args {
    /// .tables, .lights or .groom file, or an HDR map; - for standard input
    file: PathBuf,
    /// File to write, in the format of its extension; - for standard output (JSON for a light set,
    /// .hair for a groom)
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    groom: TargetArgs,
    /// Map for the dome light of a .usda rig: what `lights --suns` left
    #[arg(long, value_name = "R.exr")]
    residual: Option<PathBuf>,
    /// Program that a .usda rig is for; Blender reads angles and intensities in its own way
    #[arg(long = "for", value_name = "PROGRAM", value_enum, default_value_t = Program::Usd)]
    program: Program,
    #[arg(long, value_parser = map_width,
        help = format!("Width of a light set's environment map, an even number of pixels from 4 to {MAX_WIDTH}; its height is half the width [default: {DEFAULT_WIDTH}]"))]
    width: Option<u32>,
}

/// Parses the width of a map that is twice as wide as high.
fn map_width(text: &str) -> Result<u32, String> {
    let width = text.parse().ok();
    width
        .filter(|width| (4..=MAX_WIDTH).contains(width) && width.is_multiple_of(2))
        .ok_or_else(|| format!("must be an even number in 4..={MAX_WIDTH}"))
}

/// Programs that light rigs are written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Program {
    /// What reads UsdLux as it is specified
    Usd,
    /// Blender 5.0
    Blender,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let (input, output) = (&*args.file, &*args.output);
    let extension = output.extension().and_then(|extension| extension.to_str());
    let is_plain = extension.is_none() && is_stream(output);
    if !output.is_dir() {
        check_outputs(&[input], &[output])?;
    }
    let start = read_start(input, SNIFF_BYTES as u64).map_err(Failure::input)?;
    let content = match FileKind::of(&start) {
        FileKind::Map(_) => None,
        _ => Some(Content::of(input)?),
    };
    let is_of = |kind| matches!(content, Some(Content::Kind(found)) if found == kind);
    if let Some(flag) = args.groom.given()
        && !is_of(Kind::Groom)
    {
        return Err(Failure::file(input, format!("{flag} is for grooms")));
    }
    let is_of_lights = |end: &str| is_of(Kind::Lights) && extension == Some(end);
    if args.width.is_some() && !is_of_lights("exr") {
        let what = "--width is for light sets that become .exr";
        return Err(Failure::file(input, what));
    }
    let is_rig = is_of_lights("usda");
    if !is_rig && (args.residual.is_some() || args.program != Program::Usd) {
        let what = "--residual and --for are for light sets that become .usda";
        return Err(Failure::file(input, what));
    }
    let Some(content) = content else {
        let Some("npy") = extension else {
            return Err(unknown(output, "a map", ".npy"));
        };
        let map = Map::read(input).map_err(Failure::input)?;
        let (width, height) = (map.width(), map.height());
        let bytes = npy::float32(&[height, width, 3], map.pixels().as_flattened());
        let what = format!("npy float32 [{height}, {width}, 3]: linear Rec.709 radiance");
        return write(input, &[one(output, what, bytes)]);
    };
    let outputs = match content {
        Content::Kind(Kind::Tables) => {
            let file = TableFile::read(input).map_err(Failure::input)?;
            tables::check_names(input, &file)?;
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
                let width = args.width.unwrap_or(DEFAULT_WIDTH) as usize;
                let height = width / 2;
                let bytes = reconstruct(&set, width, height)
                    .map_err(|error| Failure::file(output, error))?;
                let what = format!("OpenEXR, {width} x {height} RGB float32");
                vec![one(output, what, bytes)]
            }
            Some("usda") => vec![usd_rig(args)?],
            _ => {
                let accepted = ".json, .npy, .h, .exr or .usda";
                return Err(unknown(output, "a light set", accepted));
            }
        },
        Content::Kind(Kind::Groom) => return export_groom(input, output, &args.groom),
        Content::Kind(_) => return Err(Failure::file(input, "no other format is available")),
        Content::Hair(format) => return Err(not_ours(input, FileKind::Hair(format))),
        Content::Lut => return Err(not_ours(input, FileKind::Cube)),
        Content::Scene => return Err(not_ours(input, FileKind::Scene)),
    };
    write(input, &outputs)
}

/// Writes `outputs`, none of which is `input`, and names them.
fn write(input: &Path, outputs: &[Output]) -> Outcome {
    let paths: Vec<&Path> = outputs.iter().map(|output| &*output.path).collect();
    check_outputs(&[input], &paths)?;
    for output in outputs {
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

/// A light set as lights of USD.
fn usd_rig(args: &Args) -> Result<Output, Failure> {
    let (input, output) = (&*args.file, &*args.output);
    let set = LightSet::read(input).map_err(Failure::input)?;
    let residual = match &args.residual {
        Some(path) => {
            check_outputs(&[path], &[output])?;
            // A dome without a map would be a white one.
            Map::read(path).map_err(Failure::input)?;
            Some(asset_path(path, output)?)
        }
        None => None,
    };
    if residual.is_none() && set.info.parameters.contains(&rest_parameter()) {
        let what = "holds the compact sources of its map alone; --residual adds the rest";
        note!("{}: {what}", input.display());
    }
    let target = match args.program {
        Program::Usd => RigTarget::Usd,
        Program::Blender => RigTarget::Blender,
    };
    let discs = set.lights.iter().map(rig::disc);
    let narrowed = discs.filter(|disc| disc.is_narrowed).count();
    let n = set.lights.len();
    if narrowed > 0 {
        let what = "lights are wider than half the sphere, which no distant light is; they become half the sphere";
        note!("{}: {narrowed} of {n} {what}", input.display());
    }
    let dome = if residual.is_some() {
        ", 1 dome light"
    } else {
        ""
    };
    let bytes = rig::to_usda(&set, residual.as_deref(), target).into_bytes();
    let lights = if n == 1 { "light" } else { "lights" };
    Ok(one(
        output,
        format!("USD, {n} distant {lights}{dome}"),
        bytes,
    ))
}

/// How a layer names a file: from its own folder if the file is there.
fn asset_path(file: &Path, layer: &Path) -> Result<String, Failure> {
    let refused = |what: &str| Failure::file(file, what);
    let file = file
        .canonicalize()
        .map_err(|error| refused(&error.to_string()))?;
    let folder = layer
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok();
    let (path, start) = match folder
        .as_deref()
        .and_then(|folder| file.strip_prefix(folder).ok())
    {
        Some(below) => (below, "./"),
        None => (&*file, ""),
    };
    let path = path
        .to_str()
        .ok_or_else(|| refused("its path is not UTF-8"))?;
    if path.contains(char::is_control) {
        return Err(refused(
            "its path has control characters, which USD cannot quote",
        ));
    }
    Ok(format!("{start}{}", path.replace('\\', "/")))
}

fn not_ours(input: &Path, found: FileKind) -> Failure {
    let what = "only .tables, .lights and .groom files and HDR maps are exported";
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

/// The map of the light set, as an OpenEXR file.
fn reconstruct(set: &LightSet, width: usize, height: usize) -> Result<Vec<u8>, String> {
    let grid = LatLong { width, height };
    let pixels = texel_means(&set.lights, grid);
    let channel = |c: usize| pixels.iter().map(|pixel| pixel[c]).collect();
    let channels = vec![
        exr_file::floats("R", channel(0)),
        exr_file::floats("G", channel(1)),
        exr_file::floats("B", channel(2)),
    ];
    exr_file::encode_map((width, height), channels)
        .map_err(|error| format!("cannot be encoded: {error}"))
}
