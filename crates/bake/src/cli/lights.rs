//! `strandlight lights`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map as Object, Value, json};
use strandlight_bake::lights::{
    Fit, FitOptions, MAX_LIGHTS, Map, STEPS, evaluate, fit, preview_png,
};
use strandlight_bake::progress::{Progress, timed};
use strandlight_formats::{FitReport, Kind, LightSet, LightSetInfo};

use super::{Failure, Outcome, check_outputs, note, print_line, write_output};

/// Fits spherical Gaussian lights to an HDR map
///
/// The map is linear radiance on the latitude-longitude layout of OpenEXR, twice as wide as
/// high, +Y up: OpenEXR (any compression, scan lines or tiles, mip maps) or Radiance .hdr.
#[derive(clap::Args)]
pub struct Args {
    /// OpenEXR or Radiance .hdr map
    map: PathBuf,
    /// Light set to write
    #[arg(short, long, value_name = "F.lights")]
    output: PathBuf,
    /// Number of lights, 1 to 1024
    #[arg(long, default_value_t = 40, value_parser = parse_count)]
    count: usize,
    /// Turns the start of the search; same seed, same bytes
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Layout of the map
    #[arg(long, value_enum, default_value_t = Layout::Latlong)]
    layout: Layout,
    /// Writes figures of the fit as JSON
    #[arg(long, value_name = "R.json")]
    report: Option<PathBuf>,
    /// Writes map, light set, difference and lights as a picture
    #[arg(long, value_name = "P.png")]
    preview: Option<PathBuf>,
    /// Prints the report on stdout, and nothing else
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

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let start = Instant::now();
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
    if let Some(preview) = &args.preview
        && !preview
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
    {
        return Err(Failure::file(
            preview,
            "the name of a preview must end in .png",
        ));
    }

    let (map, read_seconds) = timed(|| Map::read(&args.map));
    let map = map.map_err(Failure::input)?;
    let options = FitOptions {
        count: args.count,
        seed: args.seed,
    };
    let progress = Progress::new("fitting lights", STEPS);
    let fitted = fit(&map, options, &progress);
    progress.finish();
    let fitted = fitted.map_err(|error| Failure::file(&args.map, error))?;
    let faults = map.faults();
    if !faults.is_clean() {
        note!(
            "{}: clamped pixels: {} NaN, {} infinite, {} negative",
            args.map.display(),
            faults.nan,
            faults.infinite,
            faults.negative
        );
    }
    let (report, report_seconds) = timed(|| evaluate(&fitted.lights, &map));

    let set = LightSet {
        lights: fitted.lights.lights.clone(),
        info: info(options, &map, &fitted, report),
    };
    let bytes = set
        .to_bytes()
        .map_err(|error| Failure::file(&args.output, error))?;
    let preview = match &args.preview {
        Some(path) => {
            let bytes = preview_png(&set, &map).map_err(|error| Failure::file(path, error))?;
            Some((path, bytes))
        }
        None => None,
    };
    let seconds = start.elapsed().as_secs_f64();
    let mut stages: Vec<(&str, f64)> = vec![("read", read_seconds)];
    stages.extend(&fitted.seconds);
    stages.push(("report", report_seconds));
    let document = document(&set, &map, &fitted, &report, seconds, &stages);

    write_output(&args.output, &bytes)?;
    if let Some(path) = &args.report {
        write_output(path, format!("{document:#}\n").as_bytes())?;
    }
    if let Some((path, bytes)) = preview {
        write_output(path, &bytes)?;
    }
    if args.json {
        print_line(format_args!("{document:#}"))
    } else {
        let wrote = |path: &Path| format!("wrote {}", path.display());
        if let Some(path) = &args.preview {
            print_line(wrote(path))?;
        }
        if let Some(path) = &args.report {
            print_line(wrote(path))?;
        }
        let (major, minor) = Kind::Lights.version();
        let worst_energy = report
            .energy_ratio
            .iter()
            .fold(0.0f64, |worst, ratio| worst.max((ratio - 1.0).abs()));
        let how_many = match set.lights.len() {
            found if found == args.count => format!("{found} lights"),
            found => format!("{found} of {} lights, more would not help", args.count),
        };
        print_line(format_args!(
            "{}: light set, format {major}.{minor}, {} ({} compact), {} bytes, fibre error \
             {:.2} %, irradiance error {:.2} %, energy off by at most {:.3} %, {seconds:.2} s",
            wrote(&args.output),
            how_many,
            fitted.suns,
            bytes.len(),
            100.0 * report.fibre_error,
            100.0 * report.irradiance_error,
            100.0 * worst_energy,
        ))
    }
}

/// What the file records about its making: nothing that changes from run to run.
pub(super) fn info(
    options: FitOptions,
    map: &Map,
    fitted: &Fit,
    report: FitReport,
) -> LightSetInfo {
    LightSetInfo {
        map_hash: map.source().hash.clone(),
        // At most 32768: fits.
        map_size: [map.width() as u32, map.height() as u32],
        requested_count: options.count as u32,
        seed: options.seed,
        parameters: vec![
            ("layout".to_owned(), "latlong".to_owned()),
            ("map_format".to_owned(), map.source().format.clone()),
            ("compact_lights".to_owned(), fitted.suns.to_string()),
        ],
        report: Some(report),
        ..LightSetInfo::default()
    }
}

/// The report as JSON.
fn document(
    set: &LightSet,
    map: &Map,
    fitted: &Fit,
    report: &FitReport,
    seconds: f64,
    stages: &[(&str, f64)],
) -> Value {
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
        "rel_l2": report.rel_l2,
        "energy_ratio": report.energy_ratio,
        "irradiance_error": report.irradiance_error,
        "fibre_error": report.fibre_error,
        "energy_scale": fitted.energy_scale,
        "map": {
            "format": map.source().format,
            "hash": map.source().hash,
            "width": map.width(),
            "height": map.height(),
            "clamped_pixels": map.faults(),
        },
        "tool_version": set.info.tool_version,
    })
}
