//! `strandlight bench peers`.

mod lines;
mod total;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::ArgPredicate;
use serde_json::{Value, json};
use strandlight_formats::{Scene, counted};
use strandlight_lab::bench::converge;
use strandlight_lab::bench::peers::total::Options as TotalOptions;
use strandlight_lab::bench::peers::{Options, Peers, PeersError, n_steps, peers};
use strandlight_runtime::options::parse_size;
use strandlight_scene::RenderError;
use strandlight_scene::budget::MAX_TARGET_SIDE;

use super::scenes;
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, print_line};
use lines::{head, line};

/// Compare the cost of a picture with that of brute force at the same error
///
/// Single scattering of the hair on the CPU, in core-seconds. Brute force is `reference --method
/// directional` with fresh directions in each sample. Errors are relative RMSEs of means over 4x4
/// pixels; the truth is brute force too, two independent halves of it, so that its noise does not
/// count. The error of brute force falls as n^-1/2 with the samples: it is measured at some numbers
/// and extrapolated to ours. A ratio above 1 means that ours is cheaper.
///
/// `--scattering total`: all scattering, of the picture, of `render --converge`, and of plain paths as
/// `reference --method path` traces them; core-seconds from the loaded scene to errors of 5, 3 and 1 %
/// and to that of the picture. The truth is path tracing, in the light of the map of scenes that
/// name one (lights.map), of the light set of others. Errors of paths fall as n^-1/2: beyond those measured,
/// either way, they are extrapolated, which is marked.
#[derive(clap::Args)]
pub struct Args {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE.toml", required = true)]
    scenes: Vec<PathBuf>,
    #[arg(long, value_name = "WxH", value_parser = parse_size,
        help = format!("Width and height in pixels, each 1..={MAX_TARGET_SIDE} [default: the scene's]"))]
    size: Option<[u32; 2]>,
    /// What of the hair's light is compared
    #[arg(long, value_enum, default_value_t = Compared::Single)]
    scattering: Compared,
    /// Samples per pixel at which brute force is measured, each 1..=4096, comma-separated; with
    /// --scattering total those of `render --converge` and of paths, each 2..=65536, by default 2,4,8,16,32
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "1,2,4",
        default_value_if("scattering", ArgPredicate::Equals("total".into()), "2,4,8,16,32"),
        value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: Vec<u32>,
    /// Shadow rays of each sample of brute force, 1..=1024; `reference` has 24 [default: 24]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    rays: Option<u32>,
    /// Samples per pixel of each half of the truth, 1..=65536; with --scattering total 2 at least, by default 256
    #[arg(long, value_name = "N", default_value_t = 16,
        default_value_if("scattering", ArgPredicate::Equals("total".into()), "256"),
        value_parser = clap::value_parser!(u32).range(1..=65_536))]
    truth_samples: u32,
    /// With --scattering total: runs with other random numbers, 1..=4096 [default: 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    seeds: Option<u32>,
    /// Pictures of ours, after one that is not counted
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
    /// Random seed
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs that are averaged, without `--seeds`.
const SEEDS: u32 = 4;

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Compared {
    /// Single scattering, with brute force
    Single,
    /// All of it, with path tracing
    Total,
}

impl Args {
    /// Refuses what is of the other scattering, and numbers that it does not take.
    fn check(&self) -> Outcome {
        let (allowed, foreign) = match self.scattering {
            Compared::Single => (
                1..=4096,
                self.seeds.map(|_| "--seeds needs --scattering total"),
            ),
            Compared::Total => (
                2..=65_536,
                self.rays
                    .map(|_| "--rays is of brute force; leave out --scattering total"),
            ),
        };
        if let Some(text) = foreign {
            return Err(Failure::Input(text.to_owned()));
        }
        let outside = self
            .samples
            .iter()
            .find(|samples| !allowed.contains(*samples));
        if let Some(samples) = outside {
            return Err(Failure::Input(format!(
                "--samples {samples}: with --scattering {} each is {}..={}",
                self.scattering.name(),
                allowed.start(),
                allowed.end()
            )));
        }
        // The noise of paths is told from two samples on.
        if self.scattering == Compared::Total && self.truth_samples < 2 {
            return Err(Failure::Input(
                "--truth-samples 1: with --scattering total at least 2".to_owned(),
            ));
        }
        Ok(())
    }
}

impl Compared {
    fn name(self) -> &'static str {
        match self {
            Compared::Single => "single",
            Compared::Total => "total",
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    args.check()?;
    let scenes = scenes::read(&args.scenes)?;
    scenes::check(&args.scenes, &scenes, args.size)?;
    match args.scattering {
        Compared::Single => single(args, &scenes),
        Compared::Total => total::run(&args.scenes, &scenes, &total_options(args), args.json),
    }
}

/// Of all scattering.
fn total_options(args: &Args) -> TotalOptions {
    let mut samples = args.samples.clone();
    samples.sort_unstable();
    samples.dedup();
    TotalOptions {
        converge: converge::Options {
            size: args.size,
            samples,
            truth_samples: args.truth_samples,
            seeds: args.seeds.unwrap_or(SEEDS),
            seed: args.seed,
        },
        repetitions: args.repetitions,
    }
}

/// Single scattering beside brute force.
fn single(args: &Args, scenes: &[Scene]) -> Outcome {
    let options = Options {
        size: args.size,
        samples: args.samples.clone(),
        rays: args.rays.unwrap_or(24),
        truth_samples: args.truth_samples,
        repetitions: args.repetitions,
        seed: args.seed,
    };
    let measured = args.scenes.iter().zip(scenes).map(|(path, scene)| {
        let progress = progress("pictures", n_steps(&options));
        let found = peers(scene, &options, &|| progress.advance(1));
        progress.finish();
        let found = found.map_err(|error| match error {
            PeersError::Render(RenderError::Scene(error)) => Failure::input(error.in_file(path)),
            error => Failure::file(path, error),
        })?;
        if !args.json {
            print_peers(path, &found)?;
        }
        Ok(document(path, &found))
    });
    let (documents, ended) = scenes::until_failure(measured);
    if args.json && !documents.is_empty() {
        print_line(json!({
            "truth_samples": args.truth_samples,
            "repetitions": args.repetitions,
            "seed": args.seed,
            "scenes": documents,
        }))?;
    }
    ended
}

fn document(path: &Path, found: &Peers) -> Value {
    let mut document = found.to_json();
    document["scene"] = json!(path.display().to_string());
    document
}

fn print_peers(path: &Path, found: &Peers) -> Outcome {
    let [strands, points, lights] = found.counts;
    let [width, height] = found.size;
    print_line(format_args!(
        "{}: {}, {}, {}, {width}x{height}, single scattering",
        path.display(),
        counted(strands, "strand", "strands"),
        counted(points, "point", "points"),
        counted(lights, "light", "lights"),
    ))?;
    let brute = &found.brute_force;
    head()?;
    let ours = &found.ours;
    let error = Some(ours.relative_rmse);
    line(
        "ours, from the loaded scene",
        None,
        error,
        ours.core_seconds,
    )?;
    line(
        "ours, edit of the hair, shadows kept",
        None,
        error,
        ours.edit_core_seconds,
    )?;
    line(
        "brute force: hierarchy of the hair",
        None,
        None,
        brute.hierarchy_core_seconds,
    )?;
    line(
        "brute force: tables of the fibre",
        None,
        None,
        brute.fibre_core_seconds,
    )?;
    for point in &brute.points {
        line(
            &format!(
                "brute force: {} per sample",
                counted(brute.rays, "ray", "rays")
            ),
            Some(f64::from(point.samples)),
            Some(point.relative_rmse),
            point.core_seconds,
        )?;
    }
    let samples = Some(found.samples());
    let [still, edited] = found.core_seconds();
    line("brute force to our error", samples, error, still)?;
    line(
        "the same after an edit, hierarchy kept",
        samples,
        error,
        edited,
    )?;
    let exponent = brute.exponent().map_or(String::new(), |exponent| {
        format!(" as n^{exponent:.2}; fitted with n^-0.5:")
    });
    print_line(format_args!(
        "  brute force falls{exponent} {:.2} % at one sample; noise of the truth {:.2} %, taken out",
        100.0 * brute.relative_rmse_of_one(),
        100.0 * found.truth_noise,
    ))?;
    let shown = |ratio: Option<f64>| ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
    let [ratio, ratio_of_edit] = found.ratios();
    print_line(format_args!(
        "  brute force over ours: {} for a still, {} for an edit with shadows kept",
        shown(ratio),
        shown(ratio_of_edit),
    ))
}
