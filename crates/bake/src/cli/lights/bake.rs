//! The work of `strandlight lights MAP`: all files in memory, then written.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map as Object, Value};
use strandlight_bake::lights::{
    FitOptions, evaluate, evaluate_with_residual, fibre_error_of, light_set, panorama, pictures,
    preview_png, rest_parameter,
};
use strandlight_formats::{BakedFile, FitReport};
use strandlight_images::{Map, MapSelection, exr_file};
use strandlight_scene::progress::{Progress, timed};

use super::args::{FitArgs, command, is_page};
use super::html::Page;
use super::plan::{Found, Goal, Plan};
use super::results::{BudgetResult, HairResult, ResidualResult, Results, timings};
use super::saturated;
use crate::cli::{Failure, Outcome, write_output};

/// What was made.
pub struct Baked {
    pub results: Results,
    /// The light set's file.
    pub bytes: Vec<u8>,
    /// The report.
    pub document: Value,
    timings: Object<String, Value>,
    pub seconds: f64,
    /// Files beside the light set.
    files: Vec<File>,
}

/// A file and its bytes.
type File = (PathBuf, Vec<u8>);

impl Baked {
    /// Writes all files; of a budget that is not met, not the light set.
    pub fn write(&self, args: &FitArgs) -> Outcome {
        if self.results.is_kept() {
            write_output(&args.output, &self.bytes)?;
        }
        for (path, bytes) in &self.files {
            write_output(path, bytes)?;
        }
        Ok(())
    }

    /// The files beside the light set.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(path, _)| path.as_path())
    }

    /// The bytes of such a file.
    pub fn file(&self, path: &Path) -> Option<&[u8]> {
        let file = self.files.iter().find(|(name, _)| name == path);
        file.map(|(_, bytes)| bytes.as_slice())
    }

    /// The report and the times.
    pub fn document_with_times(&self) -> Value {
        let mut document = self.document.clone();
        if let Value::Object(document) = &mut document {
            document.extend(self.timings.clone());
        }
        document
    }
}

/// All the work but for writing. A page tells the paths of `told`, which are `args` as seen from elsewhere.
///
/// # Errors
/// The map cannot be read, has no light, or none of what was asked for.
pub fn bake(
    args: &FitArgs,
    told: &FitArgs,
    plan: &Plan,
    progress: &Progress,
) -> Result<Baked, Failure> {
    let start = Instant::now();
    let selection = MapSelection {
        part: args.part.clone(),
        layer: args.layer.clone(),
    };
    let (map, read_seconds) = timed(|| Map::read_selected(&args.map, &selection));
    let map = map.map_err(Failure::input)?;
    progress.advance(1);
    let found = plan.fit(&map, progress);
    let found = found.map_err(|error| Failure::file(&args.map, error))?;
    if found.fit.lights.lights.is_empty() {
        let what = "no compact source has 4 % of the energy; nothing was written";
        return Err(Failure::Check(format!("{}: {what}", args.map.display())));
    }
    for line in remarks(&map) {
        progress.say(&format!("{}: {line}", args.map.display()));
    }
    let mut stages: Vec<(&str, f64)> = vec![("read", read_seconds)];
    stages.extend(&found.fit.seconds);
    let report = if args.no_report {
        None
    } else {
        let (report, seconds) = timed(|| report(&found, &map));
        stages.push(("report", seconds));
        report
    };
    progress.advance(1);

    let results = results_of(args, plan, &map, &found, report);
    let bytes = results
        .set
        .to_bytes()
        .map_err(|error| Failure::file(&args.output, error))?;
    let document = results.document(&map);
    let mut files = files((args, told), &map, &found, &results, &document, &mut stages)?;
    let seconds = start.elapsed().as_secs_f64();
    let timings = timings(seconds, &stages);
    if let Some(path) = &args.timings {
        let text = format!("{:#}\n", Value::Object(timings.clone()));
        files.push((path.clone(), text.into_bytes()));
    }
    Ok(Baked {
        results,
        bytes,
        document,
        timings,
        seconds,
        files,
    })
}

/// How far the lights are from the map, with the rest of it where they are its suns alone.
fn report(found: &Found, map: &Map) -> Option<FitReport> {
    match &found.residual {
        None => Some(evaluate(&found.fit.lights, map)),
        Some(residual) => {
            let silent = Progress::silent();
            evaluate_with_residual(&found.fit.lights, residual, map, &silent)
        }
    }
}

/// The files beside the light set; of a budget that is not met, those alone that say so.
fn files(
    (args, told): (&FitArgs, &FitArgs),
    map: &Map,
    found: &Found,
    results: &Results,
    document: &Value,
    stages: &mut Vec<(&str, f64)>,
) -> Result<Vec<File>, Failure> {
    let mut files = Vec::new();
    if let (Some(path), Some(residual)) = (&args.residual, &found.residual) {
        let bytes = exr_of(residual).map_err(|error| Failure::file(path, error))?;
        files.push((path.clone(), bytes));
    }
    if let Some(path) = args.preview.as_ref().filter(|_| results.is_kept()) {
        let (bytes, seconds) = timed(|| preview_png(&results.set, map));
        stages.push(("preview", seconds));
        let bytes = bytes.map_err(|error| Failure::file(path, error))?;
        files.push((path.clone(), bytes));
    }
    if let Some(path) = args.panorama.as_ref().filter(|_| results.is_kept()) {
        let (made, seconds) = timed(|| panorama(map, args.panorama_width));
        stages.push(("panorama", seconds));
        let bytes = made.and_then(|made| made.to_bytes());
        let bytes = bytes.map_err(|error| Failure::file(path, error))?;
        files.push((path.clone(), bytes));
    }
    for path in &args.report {
        let bytes = if is_page(path) {
            let (pictures, seconds) =
                timed(|| pictures(&results.set, found.residual.as_ref(), map));
            stages.push(("pictures", seconds));
            let page = Page {
                results,
                map,
                map_name: &told.map.to_string_lossy(),
                command: &command(told),
                pictures: &pictures.map_err(|error| Failure::file(path, error))?,
                remarks: &remarks(map),
            };
            page.html().into_bytes()
        } else {
            format!("{document:#}\n").into_bytes()
        };
        files.push((path.clone(), bytes));
    }
    Ok(files)
}

/// A map as OpenEXR.
fn exr_of(map: &Map) -> Result<Vec<u8>, String> {
    let channel = |c: usize| map.pixels().iter().map(|pixel| pixel[c]).collect();
    let channels = ["R", "G", "B"].into_iter().enumerate();
    let channels = channels.map(|(c, name)| exr_file::floats(name, channel(c)));
    exr_file::encode_map((map.width(), map.height()), channels.collect())
        .map_err(|error| format!("cannot be encoded: {error}"))
}

fn results_of(
    args: &FitArgs,
    plan: &Plan,
    map: &Map,
    found: &Found,
    report: Option<FitReport>,
) -> Results {
    let options = FitOptions {
        count: found.count,
        seed: args.seed,
    };
    let fitted = &found.fit;
    let (point, curve) = found.curve.clone().unzip();
    let hair = plan.hair.as_ref().map(|hair| HairResult {
        name: args.hair.clone().unwrap_or_default(),
        fibre_error: match point {
            Some(point) => point.fibre_error,
            None => fibre_error_of(&fitted.lights, map, hair),
        },
    });
    let budget = match (&plan.goal, point) {
        (Goal::Budget(budget), Some(point)) => Some(BudgetResult {
            max_error: budget.max_error,
            metric: budget.metric,
            max_count: budget.max_count,
            error: budget.metric.of(&point),
        }),
        _ => None,
    };
    let residual = found.residual.as_ref().map(|residual| {
        let (rest, whole) = (residual.energy(), map.energy());
        let share = |c: usize| {
            if whole[c] > 0.0 {
                rest[c] / whole[c]
            } else {
                0.0
            }
        };
        ResidualResult {
            energy_share: [0, 1, 2].map(share),
        }
    });
    // Figures of the lights with the residual are not those of the set.
    let recorded = report.filter(|_| residual.is_none());
    let mut set = light_set(options, map, fitted, recorded);
    if residual.is_some() {
        set.info.parameters.push(rest_parameter());
    }
    Results {
        set,
        report,
        compact_lights: fitted.suns,
        energy_scale: fitted.energy_scale,
        budget,
        curve,
        hair,
        residual,
    }
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
        .chain(saturated::remark(map))
        .collect()
}
