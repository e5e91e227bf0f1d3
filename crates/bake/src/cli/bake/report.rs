//! `strandlight bake report`.

use std::path::{Path, PathBuf};

use serde_json::Value;
use strandlight_bake::manifest::{INDEX_VERSION, html, index};
use strandlight_formats::read_file;

use super::exit::{print_line, write};
use super::items::{check_beside, judge_all, read};
use crate::cli::{Failure, Outcome, is_stream};

/// Longest report that is compared with, bytes.
const MAX_BYTES: u64 = 1 << 30;

/// Write an index of what was made, the worst light sets first
#[derive(clap::Args)]
pub struct Args {
    /// Manifest, - for standard input
    #[arg(value_name = "BAKE.toml")]
    manifest: PathBuf,
    /// .html or .json file to write, - for standard output (JSON); repeat for both
    #[arg(short, long, required = true, value_name = "R.html")]
    output: Vec<PathBuf>,
    /// Earlier report (JSON): say what is new, changed and gone
    #[arg(long, value_name = "OLD.json")]
    since: Option<PathBuf>,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let outputs: Vec<&Path> = args.output.iter().map(PathBuf::as_path).collect();
    let formats = outputs.iter().map(|path| Ok((*path, is_page(path)?)));
    let formats: Vec<(&Path, bool)> = formats.collect::<Result<_, Failure>>()?;
    let before = args.since.as_deref().map(read_report).transpose()?;
    let (_, items) = read(&args.manifest)?;
    let inputs = [Some(&args.manifest), args.since.as_ref()];
    let inputs: Vec<&Path> = inputs.into_iter().flatten().map(PathBuf::as_path).collect();
    check_beside(&inputs, &items, &outputs)?;
    let judged = judge_all(&items);
    let document = index(&judged, before.as_ref());
    for (path, is_page) in formats {
        let text = match is_page {
            true => html(&document),
            false => format!("{document:#}\n"),
        };
        write(path, &text)?;
        print_line(format_args!("wrote {}", path.display()))?;
    }
    Ok(())
}

fn is_page(path: &Path) -> Result<bool, Failure> {
    match path.extension().and_then(|end| end.to_str()) {
        Some("html" | "htm") => Ok(true),
        Some("json") => Ok(false),
        _ if is_stream(path) => Ok(false),
        _ => Err(Failure::file(path, "the name must end in .html or .json")),
    }
}

fn read_report(path: &Path) -> Result<Value, Failure> {
    let bytes = read_file(path, MAX_BYTES).map_err(Failure::input)?;
    let not = |what: &str| Failure::file(path, format!("not a bake report: {what}"));
    let document: Value =
        serde_json::from_slice(&bytes).map_err(|error| not(&error.to_string()))?;
    if !document["items"].is_array() {
        return Err(not("it has no items"));
    }
    match document["version"].as_u64() {
        Some(INDEX_VERSION) => Ok(document),
        _ => {
            let found = &document["version"];
            Err(not(&format!("its version is {found}, not {INDEX_VERSION}")))
        }
    }
}
