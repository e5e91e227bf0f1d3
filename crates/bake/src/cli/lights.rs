//! `strandlight lights` and `strandlight lights import`.

mod import;

use std::path::{Path, PathBuf};
use std::time::Instant;
use strandlight_scene::progress::Progress;

use serde_json::{Map as Object, Value, json};
use strandlight_bake::lights::{
    Fit, FitOptions, MAX_LIGHTS, STEPS, evaluate, fit, light_set, preview_png,
};
use strandlight_formats::{BakedFile, Kind, LightSet};
use strandlight_images::{Map, MapSelection};
use strandlight_scene::progress::timed;

use super::{Failure, Outcome, check_extension, check_outputs, print_line, write_output};
use crate::cli::progress::progress;

/// Fit spherical Gaussian lights to an HDR map
///
/// The map holds linear radiance in the latitude-longitude layout of OpenEXR, twice as wide as
/// high, +Y up: OpenEXR (any compression, scan lines or tiles, mip maps) or Radiance .hdr. The
/// display window of an OpenEXR file covers the sphere; pixels outside its data window are black.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    fit: Option<FitArgs>,
}

#[derive(clap::Subcommand)]
enum Command {
    Import(import::Args),
}

#[derive(clap::Args)]
struct FitArgs {
    /// OpenEXR or Radiance .hdr map, - for standard input
    map: PathBuf,
    /// Light set to write, - for standard output
    #[arg(short, long, value_name = "F.lights")]
    output: PathBuf,
    #[arg(long, default_value_t = 40, value_parser = parse_count,
        help = format!("Number of lights, 1 to {MAX_LIGHTS}"))]
    count: usize,
    /// Random seed; the output is deterministic for a given seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Layout of the map
    #[arg(long, value_enum, default_value_t = Layout::Latlong)]
    layout: Layout,
    /// Part of an OpenEXR file, by name or by index from 0 [default: the first with colour]
    #[arg(long, value_name = "NAME|INDEX")]
    part: Option<String>,
    /// Layer of an OpenEXR file, the name before .R, .G, .B or .Y of its channels; "" for the
    /// plain ones [default: the plain channels, else the first layer with colour]
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Write the errors of the fit as JSON
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
    /// Skip measuring errors: the light set records none, --json prints null
    #[arg(long, conflicts_with = "report")]
    no_report: bool,
    /// Write map, light set, difference and lights as a picture
    #[arg(long, value_name = "P.png")]
    preview: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Layouts of a map on the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Layout {
    /// Equirectangular, row 0 on top, OpenEXR's orientation
    Latlong,
}

fn parse_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_LIGHTS).contains(&count) => Ok(count),
        _ => Err(format!("not a number from 1 to {MAX_LIGHTS}")),
    }
}

/// Steps beside those of the fit: reading, the report, the files.
const OTHER_STEPS: u64 = 3;

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match (&args.command, &args.fit) {
        (Some(Command::Import(args)), _) => import::run(args),
        (None, Some(args)) => run_fit(args),
        // The parser asks for a map or a subcommand.
        (None, None) => Ok(()),
    }
}

fn run_fit(args: &FitArgs) -> Outcome {
    // The one layout there is; the match makes a new one stop here.
    let Layout::Latlong = args.layout;
    let outputs = [
        Some(&args.output),
        args.report.as_ref(),
        args.preview.as_ref(),
    ];
    let outputs: Vec<&Path> = outputs
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    check_outputs(&[&args.map], &outputs)?;
    if let Some(preview) = &args.preview {
        check_extension(preview, "png")?;
    }

    let progress = progress("fitting lights", STEPS + OTHER_STEPS);
    let baked = bake(args, &progress);
    progress.finish();
    let baked = baked?;
    if args.json {
        return print_line(format_args!("{:#}", baked.document));
    }
    let wrote = |path: &Path| format!("wrote {}", path.display());
    if let Some(path) = &args.preview {
        print_line(wrote(path))?;
    }
    if let Some(path) = &args.report {
        print_line(wrote(path))?;
    }
    let (major, minor) = Kind::Lights.version();
    let how_many = match baked.set.lights.len() {
        found if found == args.count => format!("{found} lights"),
        found => format!("{found} of {} lights, more would not help", args.count),
    };
    let figures = match baked.set.info.report {
        Some(report) => {
            let worst_energy = report
                .energy_ratio
                .iter()
                .fold(0.0f64, |worst, ratio| worst.max((ratio - 1.0).abs()));
            format!(
                "fibre error {:.2} %, irradiance error {:.2} %, energy off by at most {:.3} %",
                100.0 * report.fibre_error,
                100.0 * report.irradiance_error,
                100.0 * worst_energy,
            )
        }
        None => "errors not measured".to_owned(),
    };
    print_line(format_args!(
        "{}: light set, format {major}.{minor}, {how_many} ({} compact), {} bytes, {figures}, \
         {:.2} s",
        wrote(&args.output),
        baked.compact_lights,
        baked.bytes,
        baked.seconds,
    ))
}

/// What was made, for the last lines.
struct Baked {
    set: LightSet,
    /// Length of its file.
    bytes: usize,
    compact_lights: usize,
    document: Value,
    seconds: f64,
}

/// All the work, up to the last file that is written.
fn bake(args: &FitArgs, progress: &Progress) -> Result<Baked, Failure> {
    let start = Instant::now();
    let selection = MapSelection {
        part: args.part.clone(),
        layer: args.layer.clone(),
    };
    let (map, read_seconds) = timed(|| Map::read_selected(&args.map, &selection));
    let map = map.map_err(Failure::input)?;
    progress.advance(1);
    let options = FitOptions {
        count: args.count,
        seed: args.seed,
    };
    let fitted = fit(&map, options, progress).map_err(|error| Failure::file(&args.map, error))?;
    for line in remarks(&map) {
        progress.say(&format!("{}: {line}", args.map.display()));
    }
    let mut stages: Vec<(&str, f64)> = vec![("read", read_seconds)];
    stages.extend(&fitted.seconds);
    let report = if args.no_report {
        None
    } else {
        let (report, seconds) = timed(|| evaluate(&fitted.lights, &map));
        stages.push(("report", seconds));
        Some(report)
    };
    progress.advance(1);

    let set = light_set(options, &map, &fitted, report);
    let bytes = set
        .to_bytes()
        .map_err(|error| Failure::file(&args.output, error))?;
    let preview = match &args.preview {
        Some(path) => {
            let (bytes, seconds) = timed(|| preview_png(&set, &map));
            stages.push(("preview", seconds));
            Some((path, bytes.map_err(|error| Failure::file(path, error))?))
        }
        None => None,
    };
    let seconds = start.elapsed().as_secs_f64();
    let document = document(&set, &map, &fitted, seconds, &stages);

    write_output(&args.output, &bytes)?;
    if let Some(path) = &args.report {
        write_output(path, format!("{document:#}\n").as_bytes())?;
    }
    if let Some((path, bytes)) = preview {
        write_output(path, &bytes)?;
    }
    progress.advance(1);
    Ok(Baked {
        set,
        bytes: bytes.len(),
        compact_lights: fitted.suns,
        document,
        seconds,
    })
}

/// What one should know of a map that is not exactly what its file seems to hold.
fn remarks(map: &Map) -> Vec<String> {
    let source = map.source();
    let faults = map.faults();
    let image = source.image.as_ref().map(|image| {
        let choices = &image.choices;
        format!("reads {image} of {choices}; --part and --layer choose")
    });
    let clamped = (!faults.is_clean()).then(|| format!("clamped pixels: {faults}"));
    image
        .into_iter()
        .chain(source.windows.map(|windows| windows.to_string()))
        .chain(clamped)
        .collect()
}

/// The report as JSON; without the figures of the fit they are null.
fn document(
    set: &LightSet,
    map: &Map,
    fitted: &Fit,
    seconds: f64,
    stages: &[(&str, f64)],
) -> Value {
    let report = set.info.report;
    let stages: Object<String, Value> = stages
        .iter()
        .map(|(name, seconds)| ((*name).to_owned(), json!(seconds)))
        .collect();
    json!({
        "count": set.lights.len(),
        "requested_count": set.info.requested_count,
        "compact_lights": fitted.suns,
        "sun_found": fitted.suns > 0,
        "seed": set.info.seed,
        "seconds": seconds,
        "stage_seconds": stages,
        "rel_l2": report.map(|report| report.rel_l2),
        "energy_ratio": report.map(|report| report.energy_ratio),
        "irradiance_error": report.map(|report| report.irradiance_error),
        "fibre_error": report.map(|report| report.fibre_error),
        "energy_scale": fitted.energy_scale,
        "map": {
            "format": map.source().format,
            "hash": map.source().hash,
            "width": map.width(),
            "height": map.height(),
            "image": map.source().image,
            "windows": map.source().windows,
            "clamped_pixels": map.faults(),
        },
        "tool_version": set.info.tool_version,
    })
}
