//! `strandlight verify`.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde_json::json;
use strandlight_bake::lights::{Map, evaluate};
use strandlight_bake::tables::{Check, verify_tables};
use strandlight_formats::{Groom, Kind, LightSet, TableFile};

use super::{Failure, Outcome, print_line};

/// Checks baked files: tables against other methods, light sets against their map, grooms
/// against their own invariants
///
/// Exit code 1 when a tolerance is missed, 2 when a file cannot be read.
#[derive(clap::Args)]
pub struct Args {
    /// Files of any kind
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The map that the light sets were fitted to
    #[arg(long)]
    map: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Largest relative difference of a channel's energy between a light set and its map.
const ENERGY_TOLERANCE: f64 = 5e-3;
/// Largest fibre error of a light set that records none; see [`evaluate`].
const FIBRE_ERROR_TOLERANCE: f64 = 5e-2;

/// What was found in one file.
struct Verdict {
    kind: Kind,
    passed: bool,
    /// One line per check, worst entry named.
    lines: Vec<String>,
    /// The same for programs.
    checks: Vec<serde_json::Value>,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let mut documents = Vec::new();
    let mut failed = Vec::new();
    for path in &args.files {
        let verdict = verify(path, args.map.as_deref())?;
        let word = if verdict.passed { "ok" } else { "FAILED" };
        if args.json {
            documents.push(json!({
                "file": path.display().to_string(),
                "kind": verdict.kind.name(),
                "passed": verdict.passed,
                "checks": verdict.checks,
            }));
        } else {
            let name = path.display();
            print_line(format!("{name}: {}, {word}", verdict.kind.name()))?;
            for line in &verdict.lines {
                print_line(format!("  {line}"))?;
            }
        }
        if !verdict.passed {
            let worst = verdict.lines.iter().find(|line| line.starts_with("FAILED"));
            let worst = worst.map_or("", String::as_str);
            failed.push(format!("{}: {worst}", path.display()));
        }
    }
    if args.json {
        print_line(json!({ "passed": failed.is_empty(), "files": documents }))?;
    }
    if failed.is_empty() {
        Ok(())
    } else {
        Err(Failure::Check(failed.join("; ")))
    }
}

fn verify(path: &Path, map: Option<&Path>) -> Result<Verdict, Failure> {
    match kind_of(path)? {
        Kind::Tables => verify_table_file(path),
        Kind::Lights => verify_light_set(path, map),
        Kind::Groom => verify_groom(path),
    }
}

/// The kind that the first bytes announce.
fn kind_of(path: &Path) -> Result<Kind, Failure> {
    let mut start = Vec::new();
    // A pipe or a device may never answer.
    if std::fs::metadata(path).is_ok_and(|data| !data.is_file() && !data.is_dir()) {
        return Err(Failure::file(path, "not a regular file"));
    }
    File::open(path)
        .and_then(|file| file.take(64).read_to_end(&mut start))
        .map_err(|error| Failure::file(path, error))?;
    Kind::of_bytes(&start)
        .ok_or_else(|| Failure::file(path, "not a tables file, light set or groom"))
}

fn verify_table_file(path: &Path) -> Result<Verdict, Failure> {
    let file = TableFile::read(path).map_err(Failure::input)?;
    let report = verify_tables(&file, 0).map_err(|error| Failure::file(path, error))?;
    Ok(Verdict {
        kind: Kind::Tables,
        passed: report.passed(),
        lines: report.checks.iter().map(check_line).collect(),
        checks: report.checks.iter().map(check_json).collect(),
    })
}

fn check_line(check: &Check) -> String {
    let word = if check.passed() { "ok" } else { "FAILED" };
    let worst = &check.worst;
    format!(
        "{word} {}: {}: worst {:.2e}, tolerance {:.0e}, {} values; {} is {:.9e}, not {:.9e}",
        check.table,
        check.name,
        worst.error,
        check.tolerance,
        check.n_values,
        worst.entry,
        worst.found,
        worst.expected
    )
}

fn check_json(check: &Check) -> serde_json::Value {
    json!({
        "table": check.table,
        "check": check.name,
        "passed": check.passed(),
        "values": check.n_values,
        "tolerance": check.tolerance,
        "worst": {
            "entry": check.worst.entry,
            "found": check.worst.found,
            "expected": check.worst.expected,
            "error": check.worst.error,
        },
    })
}

/// The reader checks every promise of the format; with a map, the fit is measured against it.
fn verify_light_set(path: &Path, map: Option<&Path>) -> Result<Verdict, Failure> {
    let lights = LightSet::read(path).map_err(Failure::input)?;
    lights
        .validate()
        .map_err(|error| Failure::file(path, error))?;
    if let Some(map) = map {
        return verify_light_set_against_map(path, &lights, map);
    }
    Ok(sound(
        Kind::Lights,
        format!("ok {} lights", lights.lights.len()),
    ))
}

/// Measures the fit again.
fn verify_light_set_against_map(
    path: &Path,
    lights: &LightSet,
    map_path: &Path,
) -> Result<Verdict, Failure> {
    let map = Map::read(map_path).map_err(Failure::input)?;
    let recorded = &lights.info.map_hash;
    if !recorded.is_empty() && *recorded != map.source().hash {
        let found = &map.source().hash;
        let what = format!(
            "fitted to the map of hash {recorded}, not to {} of hash {found}",
            map_path.display()
        );
        return Err(Failure::file(path, what));
    }
    let report = evaluate(lights, &map);
    // What the file says of itself must be true; where it says nothing, it must be good.
    let fibre_tolerance = match &lights.info.report {
        Some(recorded) => 1.01 * recorded.fibre_error + 1e-4,
        None => FIBRE_ERROR_TOLERANCE,
    };
    let energy_off = report.energy_ratio.map(|ratio| (ratio - 1.0).abs());
    let checks = [
        (
            "energy of a channel, relative",
            energy_off.into_iter().fold(0.0, f64::max),
            ENERGY_TOLERANCE,
        ),
        ("fibre error", report.fibre_error, fibre_tolerance),
    ];
    let passed = |error: f64, tolerance: f64| error <= tolerance;
    Ok(Verdict {
        kind: Kind::Lights,
        passed: checks
            .iter()
            .all(|&(_, error, tolerance)| passed(error, tolerance)),
        lines: checks
            .iter()
            .map(|&(name, error, tolerance)| {
                let word = if passed(error, tolerance) {
                    "ok"
                } else {
                    "FAILED"
                };
                format!("{word} {name}: {error:.2e}, tolerance {tolerance:.2e}")
            })
            .collect(),
        checks: checks
            .iter()
            .map(|&(name, error, tolerance)| {
                json!({
                    "check": name,
                    "passed": passed(error, tolerance),
                    "tolerance": tolerance,
                    "worst": { "error": error },
                })
            })
            .collect(),
    })
}

fn verify_groom(path: &Path) -> Result<Verdict, Failure> {
    let groom = Groom::read(path).map_err(Failure::input)?;
    groom
        .validate()
        .map_err(|error| Failure::file(path, error))?;
    let line = format!(
        "ok {} strands, {} points",
        groom.n_strands(),
        groom.points.len()
    );
    Ok(sound(Kind::Groom, line))
}

/// The verdict on a file whose own invariants hold.
fn sound(kind: Kind, line: String) -> Verdict {
    let checks = vec![json!({ "check": "invariants of the format", "passed": true })];
    Verdict {
        kind,
        passed: true,
        lines: vec![line],
        checks,
    }
}
