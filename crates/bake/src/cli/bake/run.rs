//! A run of a manifest.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use strandlight_formats::counted;

use serde_json::{Value, json};
use strandlight_bake::manifest::{self, Cache, Item, Judgement, RunOptions, Summary, depfile};
use strandlight_scene::progress::timed;

use super::events::{Events, Teller};
use super::exit::{in_exit_codes, print_line, write};
use super::items::{check_beside, judge_all, read, rows};
use super::kinds::Kitchen;
use crate::cli::progress::progress;
use crate::cli::shard::{Shard, ShardArg};
use crate::cli::{Failure, Outcome, is_stream};

#[derive(clap::Args)]
pub struct RunArgs {
    /// Manifest, - for standard input; names in it are relative to its folder
    #[arg(value_name = "BAKE.toml", required = true)]
    manifest: Option<PathBuf>,
    /// Make nothing, and say why each item would be made
    #[arg(short = 'n', long, conflicts_with_all = ["events", "depfile", "timings", "cache"])]
    dry_run: bool,
    /// Make items that are up to date, too; the cache is written and not read
    #[arg(short, long)]
    force: bool,
    /// Go on after an item that failed; the exit code tells in the end
    #[arg(short, long)]
    keep_going: bool,
    /// Items at work at the same time, 1 to 256; each may also use all threads
    #[arg(short, long, value_name = "N", default_value_t = 1,
        value_parser = clap::value_parser!(u16).range(1..=256))]
    jobs: u16,
    #[command(flatten)]
    shard: ShardArg,
    /// Folder of what was made before, by content, for any number of machines; made if missing
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Write what outputs depend on, for Make and Ninja
    #[arg(long, value_name = "F.d")]
    depfile: Option<PathBuf>,
    /// Target of the depfile's only rule [default: a rule for each item, of its outputs]
    #[arg(long, value_name = "NAME", requires = "depfile")]
    depfile_target: Option<String>,
    /// Write what happens as JSON Lines, with times, - for standard output
    #[arg(long, value_name = "F.jsonl")]
    events: Option<PathBuf>,
    /// Print progress as a render manager reads it from standard output
    #[arg(long, value_enum, value_name = "FORMAT", conflicts_with_all = ["json", "dry_run"])]
    progress: Option<ProgressFormat>,
    /// Write how long each item took as JSON
    #[arg(long, value_name = "T.json")]
    timings: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Whose lines tell how far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum ProgressFormat {
    /// Open Job Description: `openjd_progress: 42.0`, in percent
    Openjd,
}

/// The items of a share.
fn share(items: Vec<Item>, shard: Shard) -> Vec<Item> {
    let mine = items.into_iter().enumerate();
    let mine = mine.filter(|(ix, _)| shard.has(*ix));
    mine.map(|(_, item)| item).collect()
}

/// Runs the command.
pub fn run(args: &RunArgs) -> Outcome {
    // Only a subcommand comes without.
    let Some(path) = &args.manifest else {
        return Ok(());
    };
    let (manifest, all) = read(path)?;
    let outputs = [&args.depfile, &args.events, &args.timings];
    let outputs = outputs.into_iter().flatten().map(PathBuf::as_path);
    let outputs: Vec<&Path> = outputs.collect();
    check_beside(&[path], &all, &outputs)?;
    let items = share(all, args.shard.shard.unwrap_or(Shard::WHOLE));
    if args.dry_run {
        return dry_run(&items, args);
    }
    if args.progress.is_some() && args.events.as_deref() == Some(Path::new("-")) {
        let message = "--progress and --events - both write to standard output";
        return Err(Failure::Input(message.to_owned()));
    }
    // Before the work: a name that it cannot hold is told at once.
    let depfile = args.depfile.as_ref().map(|path| {
        let beside = outputs.iter().copied().filter(|path| !is_stream(path));
        let beside: Vec<&Path> = beside.collect();
        let text = depfile(&manifest, &items, args.depfile_target.as_deref(), &beside);
        text.map(|text| (path, text)).map_err(Failure::Input)
    });
    let depfile = depfile.transpose()?;
    let options = RunOptions {
        force: args.force,
        keep_going: args.keep_going,
        jobs: args.jobs.into(),
        cache: args.cache.as_deref().map(open_cache).transpose()?,
    };
    let events = args.events.as_deref().map(Events::create).transpose()?;

    let progress = Arc::new(progress("baking", items.len() as u64));
    let teller = Teller::new(events, Arc::clone(&progress), args.keep_going);
    let teller = match args.progress {
        Some(ProgressFormat::Openjd) => teller.with_openjd(items.len()),
        None => teller,
    };
    teller.start(items.len(), args.shard.shard);
    let kitchen = Kitchen::new(Arc::clone(&progress));
    let (summary, seconds) = timed(|| manifest::run(&items, &kitchen, &options, &teller));
    progress.finish();
    teller.end(&summary, seconds);

    if let Some(path) = &args.timings {
        let document = json!({ "seconds": seconds, "items": teller.timings() });
        write(path, &format!("{document:#}\n"))?;
    }
    if let Some((path, text)) = depfile.filter(|_| summary.failed.is_empty()) {
        write(path, &text)?;
    }
    match args.json {
        true => print_line(format_args!("{:#}", document(&summary)))?,
        false if summary.failed.is_empty() || args.keep_going => {
            print_line(in_words(&summary, seconds))?;
        }
        // The failure is the answer.
        false => {}
    }
    outcome(&summary, items.len(), path, args)?;
    teller.outcome()
}

fn open_cache(folder: &Path) -> Result<Cache, Failure> {
    Cache::open(folder).map_err(|error| {
        let failure = manifest::Failure::io(folder, "cannot be the cache", &error);
        in_exit_codes(failure)
    })
}

/// What the exit code tells: 75 if anything may succeed later, else 2 if anything failed.
fn outcome(summary: &Summary, n_items: usize, path: &Path, args: &RunArgs) -> Outcome {
    let failed = &summary.failed;
    let transient = failed.iter().find(|(_, failure)| failure.is_transient);
    let Some((name, failure)) = transient.or(failed.first()) else {
        return Ok(());
    };
    let what = match args.keep_going {
        true => {
            let n = failed.len();
            let of = counted(n_items, "item", "items");
            format!("{}: {n} of {of} failed", path.display())
        }
        false => match summary.left {
            0 => failure.of_item(name),
            left => format!(
                "{}; {} left",
                failure.of_item(name),
                counted(left, "item", "items")
            ),
        },
    };
    Err(in_exit_codes(manifest::Failure {
        what,
        is_transient: failure.is_transient,
    }))
}

fn document(summary: &Summary) -> Value {
    let failed = summary.failed.iter().map(|(item, failure)| {
        json!({
            "item": item,
            "error": failure.what,
            "transient": failure.is_transient,
        })
    });
    json!({
        "made": summary.made,
        "cached": summary.cached,
        "up_to_date": summary.skipped,
        "left": summary.left,
        "failed": failed.collect::<Vec<_>>(),
    })
}

fn in_words(summary: &Summary, seconds: f64) -> String {
    let counts = [
        (summary.made, "made"),
        (summary.cached, "from the cache"),
        (summary.skipped, "up to date"),
        (summary.failed.len(), "failed"),
        (summary.left, "left"),
    ];
    let counts = counts.into_iter().filter(|(count, _)| *count > 0);
    let counts: Vec<String> = counts
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    match counts.is_empty() {
        true => "no items".to_owned(),
        false => format!("{}, {seconds:.2} s", counts.join(", ")),
    }
}

fn dry_run(items: &[Item], args: &RunArgs) -> Outcome {
    let judged = judge_all(items);
    let stale = judged
        .iter()
        .filter(|(_, judgement)| args.force || !judgement.is_done());
    if args.json {
        print_line(format_args!("{:#}", json!({ "items": rows(stale) })))?;
        return readable(&judged);
    }
    let mut n = 0;
    for (item, judgement) in stale {
        n += 1;
        let why = match (judgement.is_done(), &judgement.fingerprint) {
            (_, Err(failure)) => failure.what.clone(),
            (true, _) => "--force".to_owned(),
            (false, _) => judgement.why_beside(&item.name()),
        };
        print_line(format_args!("{}: {why}", item.name()))?;
    }
    let done = items.len() - n;
    print_line(format_args!("{n} to make, {done} up to date"))?;
    readable(&judged)
}

/// Refuses what no run could make: an input that cannot be read.
fn readable(judged: &[(&Item, Judgement)]) -> Outcome {
    let failed = judged.iter().find_map(|(item, judgement)| {
        let failure = judgement.fingerprint.as_ref().err()?;
        Some((item, failure))
    });
    match failed {
        None => Ok(()),
        Some((item, failure)) => Err(in_exit_codes(manifest::Failure {
            what: failure.of_item(&item.name()),
            is_transient: failure.is_transient,
        })),
    }
}
