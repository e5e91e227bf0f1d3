//! `strandlight bench converge`.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandlight_formats::counted;
use strandlight_images::Map;
use strandlight_lab::bench::converge::{
    ConvergeError, Convergences, GOALS, Goal, Options, converge, figure, n_steps,
};
use strandlight_runtime::options::parse_size;
use strandlight_scene::RenderError;
use strandlight_scene::budget::MAX_TARGET_SIDE;

use super::scenes;
use crate::cli::light::map_of;
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, check_extension, check_outputs, print_line, write_output};

/// Measure how fast `render --converge` goes to path-traced truth
///
/// For each number of samples: core-seconds; the error of the samples' plain means, of the converged
/// picture, and what it expects; the share of 16x16 tiles within its 95 % interval. Errors are relative
/// RMSEs of means over 4x4 pixels; the truth is path tracing too, two independent halves of it, so that
/// its noise does not count. Then, of several seeds, what their means say of bias; and core-seconds to
/// errors of 5, 3 and 1 %, the fast picture and what paths read included. Light is that of the map of
/// scenes that name one (lights.map), of the light set of others.
#[derive(clap::Args)]
pub struct Args {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE.toml", required = true)]
    scenes: Vec<PathBuf>,
    #[arg(long, value_name = "WxH", value_parser = parse_size,
        help = format!("Width and height in pixels, each 1..={MAX_TARGET_SIDE} [default: the scene's]"))]
    size: Option<[u32; 2]>,
    /// Samples per pixel at which errors are measured, each 2..=65536, comma-separated
    #[arg(long, value_name = "N", value_delimiter = ',', default_value = "2,4,8,16,32",
        value_parser = clap::value_parser!(u32).range(2..=65_536))]
    samples: Vec<u32>,
    /// Samples per pixel of each half of the truth, 2..=1048576
    #[arg(long, value_name = "N", default_value_t = 256,
        value_parser = clap::value_parser!(u32).range(2..=1 << 20))]
    truth_samples: u32,
    /// Runs with other random numbers, 1..=4096
    #[arg(long, value_name = "N", default_value_t = 4,
        value_parser = clap::value_parser!(u32).range(1..=4096))]
    seeds: u32,
    /// Random seed
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Write the curves as SVG
    #[arg(long, value_name = "OUT.svg")]
    svg: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    if let Some(svg) = &args.svg {
        check_extension(svg, "svg")?;
        let inputs: Vec<&Path> = args.scenes.iter().map(PathBuf::as_path).collect();
        check_outputs(&inputs, &[svg])?;
    }
    let mut samples = args.samples.clone();
    samples.sort_unstable();
    samples.dedup();
    let options = Options {
        size: args.size,
        samples,
        truth_samples: args.truth_samples,
        seeds: args.seeds,
        seed: args.seed,
    };
    let scenes = scenes::read(&args.scenes)?;
    scenes::check(&args.scenes, &scenes, args.size)?;
    let named = args.scenes.iter().map(PathBuf::as_path).zip(&scenes);
    let maps = named.map(|named| map_of(None, named));
    let maps = maps.collect::<Result<Vec<Option<Map>>, Failure>>()?;
    let scenes = scenes.iter().zip(&maps);
    let measured = args.scenes.iter().zip(scenes).map(|(path, (scene, map))| {
        let progress = progress("pictures", n_steps(&options));
        let pixels = map.as_ref().map(|map| (map.grid(), map.pixels()));
        let found = converge(scene, pixels, &options, &|| progress.advance(1));
        progress.finish();
        let found = found.map_err(|error| match error {
            ConvergeError::Render(RenderError::Scene(error)) => Failure::input(error.in_file(path)),
            error => Failure::file(path, error),
        })?;
        if !args.json {
            print_converge(path, map.is_some(), &found)?;
        }
        let panel = found.panel(&path.display().to_string());
        Ok((document(path, map.as_ref(), &found), panel))
    });
    let (measured, ended) = scenes::until_failure(measured);
    if measured.is_empty() {
        return ended;
    }
    let (documents, panels): (Vec<_>, Vec<_>) = measured.into_iter().unzip();
    if args.json {
        print_line(json!({
            "truth_samples": args.truth_samples,
            "seed": args.seed,
            "scenes": documents,
        }))?;
    }
    if let Some(svg) = &args.svg {
        write_output(svg, figure(panels).to_svg().as_bytes())?;
    }
    ended
}

fn document(path: &Path, map: Option<&Map>, found: &Convergences) -> Value {
    let mut document = found.to_json();
    document["scene"] = json!(path.display().to_string());
    document["map"] = json!(map.map(|map| &map.source().hash));
    document
}

fn print_converge(path: &Path, has_map: bool, found: &Convergences) -> Outcome {
    let [strands, points, lights] = found.counts;
    let [width, height] = found.size;
    let percent = |value: Option<f64>, digits: usize| match value {
        Some(value) => format!("{:.digits$} %", 100.0 * value),
        None => "-".to_owned(),
    };
    let seconds = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1}"));
    print_line(format_args!(
        "{}: {}, {}, {}{}, {} scattering, {width}x{height}, {}",
        path.display(),
        counted(strands, "strand", "strands"),
        counted(points, "point", "points"),
        counted(lights, "light", "lights"),
        if has_map { ", by the map" } else { "" },
        found.scattering.name(),
        counted(found.seeds, "seed", "seeds")
    ))?;
    print_line(format_args!(
        "  fast picture: {}, {} core-s; noise of the truth {}, taken out",
        percent(found.fast_error, 2),
        seconds(found.fast_core_seconds),
        percent(Some(found.truth_noise), 2),
    ))?;
    print_line(format_args!(
        "  {:>8} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8} {:>8}",
        "samples", "core-s", "paths", "converged", "expected", "inside", "mean", "bias"
    ))?;
    for point in &found.points {
        print_line(format_args!(
            "  {:>8} {:>9} {:>9} {:>9} {:>9} {:>8} {:>8.4} {:>8}",
            point.samples,
            seconds(point.core_seconds),
            percent(point.plain, 2),
            percent(point.converged, 2),
            percent(Some(point.expected), 2),
            percent(Some(point.inside), 1),
            point.means[1].ratio,
            percent(point.bias[1], 2),
        ))?;
    }
    print_means(found)?;
    for goal in GOALS {
        print_goal(&found.goal(goal), &percent(Some(goal), 0), "converged")?;
    }
    // Of one number of samples there are none.
    let [Some(plain), Some(converged)] = found.slopes() else {
        return Ok(());
    };
    let gain = found.gain().map_or(String::new(), |gain| {
        format!("; paths alone take {gain:.1} times as long to the last error")
    });
    print_line(format_args!(
        "  errors fall as n^{plain:.2} and n^{converged:.2}{gain}",
    ))
}

/// Core-seconds of paths to `error`, and of what is `named`.
pub(super) fn print_goal(goal: &Goal, error: &str, named: &str) -> Outcome {
    let times = goal.ratio().map_or(String::new(), |ratio| {
        let digits = if ratio < 1.0 { 2 } else { 1 };
        format!(": {ratio:.digits$} times as long")
    });
    // Of paths any error is known, if one was measured.
    let reached = |value: Option<f64>| match value {
        Some(value) => format!("{value:.1} core-s"),
        None if goal.paths.is_none() => "not known".to_owned(),
        None => "not reached".to_owned(),
    };
    let mark = match goal.is_extrapolated && goal.paths.is_some() {
        true => " by n^-1/2",
        false => "",
    };
    print_line(format_args!(
        "  to {error}: {named} {}, paths {}{mark}{times}",
        reached(goal.converged),
        reached(goal.paths),
    ))
}

/// What the means over the seeds say of bias, where there are several.
fn print_means(found: &Convergences) -> Outcome {
    for point in &found.points {
        for (name, mean) in ["paths", "converged"].iter().zip(&point.means) {
            let Some((error, beyond)) = mean.standard_error.zip(mean.tiles_beyond) else {
                continue;
            };
            print_line(format_args!(
                "  mean over {} of {} samples, {name}: {:.4} +- {:.4} of the truth's, {:.1} % of the tiles more than \
                 three standard errors off",
                counted(found.seeds, "seed", "seeds"),
                point.samples,
                mean.ratio,
                error,
                100.0 * beyond,
            ))?;
        }
    }
    Ok(())
}
