//! `strandlight groom check`.

use std::path::PathBuf;

use serde_json::{Value, json};
use strandlight_bake::grooms::{Finding, check, finding_of_error};
use strandlight_formats::{BakedFile, Error, Groom, ImportOptions, SourceFile, counted};

use super::doubts::odd_size;
use super::source::is_groom;
use crate::cli::{Failure, Outcome, print_line};

/// Look for what is commonly wrong with hair: unit, guides, widths, root order, broken strands
///
/// Reads a .groom or any hair file, in the unit and axis that it states or its format implies. Exits with
/// 1 if something is found, also that the file is damaged, with 2 if it is missing or no file of hair.
#[derive(clap::Args)]
pub struct Args {
    /// .groom or hair file of another program, - for standard input
    file: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// What was read.
struct Read {
    format: String,
    groom: Result<Groom, Error>,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let Read { format, groom } = read(args)?;
    let (counts, findings, note) = match groom {
        Ok(groom) => {
            let counts = [groom.n_strands(), groom.points.len()];
            (Some(counts), check(&groom), odd_size(&groom))
        }
        Err(error) => match finding_of_error(&error) {
            Some(finding) => (None, vec![finding], None),
            None => return Err(Failure::input(error)),
        },
    };
    let name = args.file.display();
    if args.json {
        print_line(json!({
            "file": name.to_string(),
            "format": format,
            "strands": counts.map(|[strands, _]| strands),
            "points": counts.map(|[_, points]| points),
            "passed": findings.is_empty(),
            "findings": findings.iter().map(document).collect::<Vec<_>>(),
            "notes": note.iter().collect::<Vec<_>>(),
        }))?;
    } else {
        let counts = counts.map(|[strands, points]| {
            let strands = counted(strands, "strand", "strands");
            format!(", {strands}, {}", counted(points, "point", "points"))
        });
        let word = if findings.is_empty() {
            "ok"
        } else {
            "PROBLEMS"
        };
        print_line(format_args!(
            "{name}: {format}{}, {word}",
            counts.unwrap_or_default()
        ))?;
        for Finding {
            code,
            first_strand,
            message,
            advice,
            ..
        } in &findings
        {
            let first = first_strand.map(|ix| format!(" (first: strand {ix})"));
            let first = first.unwrap_or_default();
            print_line(format_args!("  {code}: {message}{first}; {advice}"))?;
        }
        if let Some(note) = note {
            print_line(format_args!("  note: {note}"))?;
        }
    }
    if findings.is_empty() {
        return Ok(());
    }
    let codes: Vec<&str> = findings.iter().map(|finding| finding.code).collect();
    Err(Failure::Check(format!(
        "{name}: check failed: {}",
        codes.join(", ")
    )))
}

fn read(args: &Args) -> Result<Read, Failure> {
    if is_groom(&args.file)? {
        return Ok(Read {
            format: "groom".to_owned(),
            groom: Groom::read(&args.file),
        });
    }
    let file = SourceFile::read(&args.file).map_err(Failure::input)?;
    Ok(Read {
        format: file.format().info().name.to_owned(),
        groom: file
            .import(&ImportOptions::default())
            .map(|import| import.groom),
    })
}

fn document(finding: &Finding) -> Value {
    json!({
        "code": finding.code,
        "count": finding.count,
        "first_strand": finding.first_strand,
        "message": finding.message,
        "advice": finding.advice,
    })
}
