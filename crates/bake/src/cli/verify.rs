//! `strandlight verify`.
//!
//! Every file is judged, whatever is wrong with the others: one verdict a file.

mod groom;
mod lights;
mod line;
mod mesh;
mod panorama;
mod reference;

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandlight_bake::tables::{Check, verify_tables};
use strandlight_formats::{
    BakedFile, Error, FileKind, Groom, Kind, LightSet, Mesh, Panorama, SNIFF_BYTES, TableFile,
    counted, read_start, system_in_plain_words,
};
use strandlight_images::Map;

use super::{Failure, Outcome, note, parse_error, print_line};
use line::Line;
use reference::{Reference, Residual};

/// Check baked files: tables against other methods, light sets against their map, grooms,
/// meshes and panoramas against their own invariants
///
/// Checks every file, even after a failure. Exits with 2 when a file cannot be read, else with 1
/// when a check fails.
#[derive(clap::Args)]
pub struct Args {
    /// .tables, .lights, .groom, .mesh and .panorama files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Map that the light sets were fitted to
    #[arg(long)]
    map: Option<PathBuf>,
    /// What `lights --suns` left of that map: light sets of compact sources are judged with it
    #[arg(long, value_name = "R.exr", requires = "map")]
    residual: Option<PathBuf>,
    /// Largest accepted fibre error of a light set against its map: a fraction or percentage
    /// (0.5%). Sets of few lights need more
    #[arg(long, value_name = "E", default_value = "2%", value_parser = parse_error, requires = "map")]
    max_error: f64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Why a file could not be judged.
struct Refused {
    /// `unreadable` (missing, no permission, of another kind, of a newer version) or `damaged`.
    kind: &'static str,
    message: String,
}

impl Refused {
    fn unreadable(path: &Path, error: impl std::fmt::Display) -> Refused {
        Refused {
            kind: "unreadable",
            message: format!("{}: {error}", path.display()),
        }
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Refused {
        let kind = match error {
            Error::Io { .. } | Error::NotThisKind { .. } | Error::UnsupportedVersion { .. } => {
                "unreadable"
            }
            _ => "damaged",
        };
        Refused {
            kind,
            message: system_in_plain_words(&error.to_string()),
        }
    }
}

/// What was found in one file.
struct Verdict {
    path: PathBuf,
    kind: Option<Kind>,
    /// The checks, at least one, or why there are none.
    found: Result<Vec<Line>, Refused>,
}

impl Verdict {
    fn passed(&self) -> bool {
        match &self.found {
            Ok(lines) => !lines.is_empty() && lines.iter().all(|line| line.passed),
            Err(_) => false,
        }
    }

    /// Kind and text of what is wrong, if anything is; the first of several.
    fn error(&self) -> Option<(&'static str, String)> {
        match &self.found {
            Err(refused) => Some((refused.kind, refused.message.clone())),
            Ok(lines) => lines.iter().find(|line| !line.passed).map(|line| {
                let message = format!("{}: {}", self.path.display(), line.print());
                ("failed check", message)
            }),
        }
    }

    fn json(&self) -> Value {
        let checks: Vec<&Value> = match &self.found {
            Ok(lines) => lines.iter().map(|line| &line.json).collect(),
            Err(_) => Vec::new(),
        };
        let error = self.error();
        json!({
            "file": self.path.display().to_string(),
            "kind": self.kind.map(Kind::name),
            "passed": self.passed(),
            "checks": checks,
            "error": error.map(|(kind, message)| json!({ "kind": kind, "message": message })),
        })
    }

    /// What was found, on stdout; a file that could not be judged is named on stderr at the end.
    fn print(&self) -> Outcome {
        let Ok(lines) = &self.found else {
            return Ok(());
        };
        let word = if self.passed() { "ok" } else { "FAILED" };
        let kind = self.kind.map_or("file", Kind::name);
        print_line(format!("{}: {kind}, {word}", self.path.display()))?;
        for line in lines {
            print_line(format!("  {}", line.print()))?;
        }
        Ok(())
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let mut verdicts = Vec::new();
    // A map that cannot be read is one more file that cannot.
    let mut read = |path: &PathBuf| match Map::read(path) {
        Ok(map) => Some(map),
        Err(error) => {
            verdicts.push(Verdict {
                path: path.clone(),
                kind: None,
                found: Err(Refused {
                    kind: "unreadable",
                    message: system_in_plain_words(&error.to_string()),
                }),
            });
            None
        }
    };
    let map = args.map.as_ref().and_then(|path| Some((path, read(path)?)));
    let residual = match &args.residual {
        None => Residual::NotNamed,
        Some(path) => read(path).map_or(Residual::Unreadable, |map| Residual::Read(map.into())),
    };
    let reference = map.map(|(path, map)| Reference {
        path,
        map,
        residual,
        max_error: args.max_error,
    });
    for path in &args.files {
        let verdict = verify(path, reference.as_ref());
        if !args.json {
            verdict.print()?;
        }
        verdicts.push(verdict);
    }
    if args.map.is_some() && !verdicts.iter().any(|it| it.kind == Some(Kind::Lights)) {
        note!("--map has no effect: none of the files is a light set");
    }
    if args.json {
        let files: Vec<Value> = verdicts.iter().map(Verdict::json).collect();
        let passed = verdicts.iter().all(Verdict::passed);
        print_line(json!({ "passed": passed, "files": files }))?;
    }
    let messages: Vec<String> = verdicts
        .iter()
        .filter_map(Verdict::error)
        .map(|(_, message)| message)
        .collect();
    if messages.is_empty() {
        Ok(())
    } else if verdicts.iter().any(|verdict| verdict.found.is_err()) {
        Err(Failure::Input(messages.join("; ")))
    } else {
        Err(Failure::Check(messages.join("; ")))
    }
}

fn verify(path: &Path, reference: Option<&Reference<'_>>) -> Verdict {
    let (kind, found) = match kind_of(path) {
        Err(refused) => (None, Err(refused)),
        Ok(kind) => {
            let found = match kind {
                Kind::Tables => verify_table_file(path),
                Kind::Lights => LightSet::read(path)
                    .map(|set| {
                        if let Some(line) = lights::needless_residual(&set, reference) {
                            note!("{}: {line}", path.display());
                        }
                        lights::checks(&set, reference)
                    })
                    .map_err(Refused::from),
                Kind::Groom => Groom::read(path)
                    .map(|groom| {
                        for line in super::groom::doubts(&groom, groom.diameter_range()) {
                            note!("{}: {line}", path.display());
                        }
                        groom::checks(&groom)
                    })
                    .map_err(Refused::from),
                Kind::Mesh => Mesh::read(path)
                    .map(|mesh| mesh::checks(&mesh))
                    .map_err(Refused::from),
                Kind::Panorama => Panorama::read(path)
                    .map(|panorama| panorama::checks(&panorama))
                    .map_err(Refused::from),
                _ => Err(Refused::unreadable(
                    path,
                    "no checks are available for this file",
                )),
            };
            (Some(kind), found)
        }
    };
    Verdict {
        path: path.to_owned(),
        kind,
        found,
    }
}

/// The kind that the first bytes announce.
fn kind_of(path: &Path) -> Result<Kind, Refused> {
    let start = read_start(path, SNIFF_BYTES as u64)?;
    match FileKind::of(&start) {
        FileKind::Ours(kind) => Ok(kind),
        other => {
            let what = other.describe();
            let what = format!("not a tables file, light set, groom, mesh or panorama: {what}");
            Err(Refused::unreadable(path, what))
        }
    }
}

fn verify_table_file(path: &Path) -> Result<Vec<Line>, Refused> {
    let file = TableFile::read(path)?;
    let report = verify_tables(&file, 0).map_err(|error| Refused::unreadable(path, error))?;
    Ok(report.checks.iter().map(table_line).collect())
}

fn table_line(check: &Check) -> Line {
    let worst = &check.worst;
    let entry = if worst.entry.is_empty() {
        // Nothing differs.
        String::new()
    } else if worst.found.is_nan() && worst.expected.is_nan() {
        format!("; {}", worst.entry)
    } else {
        let (found, expected) = (worst.found, worst.expected);
        format!("; {} is {found:.9e}, not {expected:.9e}", worst.entry)
    };
    Line {
        passed: check.passed(),
        text: format!(
            "{}: {}: worst {:.2e}, tolerance {:.0e}, {}{entry}",
            check.table,
            check.name,
            worst.error,
            check.tolerance,
            counted(check.n_values, "value", "values"),
        ),
        json: json!({
            "table": check.table,
            "check": check.name,
            "passed": check.passed(),
            "values": check.n_values,
            "tolerance": check.tolerance,
            "worst": {
                "entry": worst.entry,
                "found": worst.found,
                "expected": worst.expected,
                "error": worst.error,
            },
        }),
    }
}

#[cfg(test)]
mod tests {
    use strandlight_bake::tables::Worst;

    use super::*;

    #[test]
    fn the_worst_entry_is_told_where_there_is_one() {
        let text = |worst: Worst| {
            let check = Check {
                name: "words",
                table: "N",
                n_values: 2,
                tolerance: 0.0,
                worst,
            };
            table_line(&check).text
        };
        let start = "N: words: worst 0.00e0, tolerance 0e0, 2 values";
        assert_eq!(text(Worst::default()), start);
        let entry = "b_1 at 0".to_owned();
        let worst = Worst {
            entry: entry.clone(),
            ..Worst::default()
        };
        let end = "; b_1 at 0 is 0.000000000e0, not 0.000000000e0";
        assert_eq!(text(worst), format!("{start}{end}"));
        let worst = Worst {
            entry,
            found: f64::NAN,
            expected: f64::NAN,
            error: 0.0,
        };
        assert_eq!(text(worst), format!("{start}; b_1 at 0"));
    }
}
