//! `strandlight bake plan`.

use std::path::{Path, PathBuf};

use strandlight_bake::manifest::{Farm, Job, farm_job};

use super::exit::write;
use super::items::{check_beside, check_inputs, read};
use crate::cli::{Failure, Outcome};

/// Items of a shard, where their number is not given: minutes of work, not seconds.
const ITEMS_A_SHARD: usize = 100;

/// Most tasks of a job.
const MAX_SHARDS: u32 = 100_000;

/// Image with the program.
const IMAGE: &str = concat!("strandlight:", env!("CARGO_PKG_VERSION"));

/// The name of a claim, which Kubernetes has to take.
fn claim(name: &str) -> Result<String, String> {
    let is_end = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    let is_part = |part: &str| {
        part.starts_with(is_end)
            && part.ends_with(is_end)
            && part.chars().all(|c| is_end(c) || c == '-')
    };
    match name.len() <= 253 && name.split('.').all(is_part) {
        true => Ok(name.to_owned()),
        false => Err(
            "not a name of Kubernetes: small letters, digits and hyphens, as in hair-assets"
                .to_owned(),
        ),
    }
}

/// Refuses what Kubernetes would not take.
fn check_k8s(job: &Job) -> Outcome {
    let folder = &job.folder;
    let refused = |text: String| Err(Failure::Input(text));
    if !folder.starts_with('/') || folder.contains(':') {
        return refused(format!(
            "--folder {folder}: Kubernetes mounts a claim at a path from the root without colons, as /assets"
        ));
    }
    if job.image.is_empty() || job.image.contains(char::is_whitespace) {
        return refused(format!("--image '{}': not the name of an image", job.image));
    }
    Ok(())
}

/// Write a job for a scheduler: one task for each shard of the items
///
/// Each task runs `strandlight bake --shard I/N --keep-going`. Tasks may run again at any time: what is
/// up to date is skipped.
#[derive(clap::Args)]
#[command(group(clap::ArgGroup::new("farm").required(true)))]
pub struct Args {
    /// Manifest, as the machines of the farm see it from --folder
    #[arg(value_name = "BAKE.toml")]
    manifest: PathBuf,
    /// Slurm: an array job for sbatch
    #[arg(long, group = "farm")]
    slurm: bool,
    /// Open Job Description: a template for Deadline Cloud and others
    #[arg(long, group = "farm")]
    openjd: bool,
    /// Kubernetes: an Indexed Job
    #[arg(long, group = "farm")]
    k8s: bool,
    /// A command a line: GNU parallel, xargs, OpenCue
    #[arg(long, group = "farm")]
    commands: bool,
    /// Number of shards [default: one for every 100 items]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SHARDS)))]
    shards: Option<u32>,
    /// Threads of a task
    #[arg(long = "threads-per-task", value_name = "N", default_value_t = 4,
        value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Folder in which tasks start, for --slurm and --k8s [default: the current one; /assets for --k8s]
    #[arg(long, value_name = "DIR", conflicts_with_all = ["openjd", "commands"])]
    folder: Option<String>,
    /// The program, as the machines of the farm know it
    #[arg(long, value_name = "PATH", default_value = "strandlight")]
    program: String,
    /// Cache that the tasks share
    #[arg(long, value_name = "DIR")]
    cache: Option<String>,
    #[arg(long, conflicts_with_all = ["slurm", "openjd", "commands"],
        help = format!("Container image, for --k8s [default: {IMAGE}]"))]
    image: Option<String>,
    /// Persistent volume claim that is mounted at the folder, for --k8s [default: assets]
    #[arg(long, conflicts_with_all = ["slurm", "openjd", "commands"], value_parser = claim)]
    claim: Option<String>,
    /// File to write
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    if args.manifest == Path::new("-") {
        let what = "tasks have no standard input: name the manifest's file";
        return Err(Failure::file(&args.manifest, what));
    }
    let (manifest, items) = read(&args.manifest)?;
    check_beside(&[&args.manifest], &items, &[&args.output])?;
    check_inputs(&manifest, &items)?;
    let farm = match (args.slurm, args.openjd, args.k8s) {
        (true, _, _) => Farm::Slurm,
        (_, true, _) => Farm::OpenJd,
        (_, _, true) => Farm::Kubernetes,
        _ => Farm::Commands,
    };
    let by_items = items.len().div_ceil(ITEMS_A_SHARD).max(1);
    let by_items = u32::try_from(by_items)
        .unwrap_or(MAX_SHARDS)
        .min(MAX_SHARDS);
    let utf8 = |path: PathBuf| {
        let not = |path: std::ffi::OsString| Failure::file(path.as_ref(), "is not UTF-8");
        path.into_os_string().into_string().map_err(not)
    };
    let folder = match &args.folder {
        Some(folder) => folder.clone(),
        None if farm == Farm::Kubernetes => "/assets".to_owned(),
        None => utf8(std::env::current_dir().map_err(Failure::input)?)?,
    };
    let cache = args.cache.iter();
    let job = Job {
        program: args.program.clone(),
        manifest: utf8(args.manifest.clone())?,
        folder,
        shards: args.shards.unwrap_or(by_items),
        threads: args.threads,
        options: cache.map(|folder| format!("--cache={folder}")).collect(),
        image: args.image.clone().unwrap_or_else(|| IMAGE.to_owned()),
        claim: args.claim.clone().unwrap_or_else(|| "assets".to_owned()),
    };
    if farm == Farm::Kubernetes {
        check_k8s(&job)?;
    }
    write(&args.output, &farm_job(farm, &job))
}
