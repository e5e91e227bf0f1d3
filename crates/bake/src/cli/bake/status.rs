//! `strandlight bake status`.

use std::path::PathBuf;

use serde_json::json;
use strandlight_bake::manifest::State;

use super::exit::print_line;
use super::items::{judge_all, read, rows};
use crate::cli::Outcome;

/// Say of each item whether it is done, stale, missing or failed, and why
#[derive(clap::Args)]
pub struct Args {
    /// Manifest, - for standard input
    #[arg(value_name = "BAKE.toml")]
    manifest: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let (_, items) = read(&args.manifest)?;
    let judged = judge_all(&items);
    if args.json {
        return print_line(format_args!(
            "{:#}",
            json!({ "items": rows(judged.iter()) })
        ));
    }
    let mut counts =
        [State::Done, State::Stale, State::Missing, State::Failed].map(|state| (state, 0));
    for (item, judgement) in &judged {
        let state = judgement.state();
        let count = counts.iter_mut().find(|(other, _)| *other == state);
        count.into_iter().for_each(|(_, n)| *n += 1);
        let why = match judgement
            .failure
            .clone()
            .unwrap_or_else(|| judgement.why_beside(&item.name()))
        {
            why if why.is_empty() => why,
            why => format!(": {why}"),
        };
        print_line(format_args!("{:<7} {}{why}", state.name(), item.name()))?;
    }
    let counts = counts.map(|(state, n)| format!("{n} {}", state.name()));
    print_line(counts.join(", "))
}
