//! `strandlight bench frames`.

use crate::cli::progress::progress;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::{Value, json};
use strandlight_formats::Scene;
use strandlight_lab::bench::cpu_frames::{self, PictureCost, SceneCosts, n_pictures, scene_costs};
use strandlight_lab::bench::frames::{FrameCost, Progress, frame_costs, n_frames};
use strandlight_render::gpu::Context;
use strandlight_scene::budget::MAX_TARGET_SIDE;
use strandlight_scene::{PreparedScene, RenderError, SceneError};

use crate::cli::render::parse_size;
use crate::cli::{Failure, Outcome, print_line};

/// Benchmark the first picture from nothing, and after each kind of edit
///
/// On the CPU: complete pictures, by clock and by seconds of all cores together, and what they
/// counted. On the GPU: frames from the edit to a picture of 4 samples per pixel with all points
/// shaded, as medians in milliseconds, ratios to the first frame of each group, and the slowest
/// stage; the frames of a group are interleaved, and its results are printed on stderr as they come.
#[derive(clap::Args)]
pub struct Args {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE.toml", required = true)]
    scenes: Vec<PathBuf>,
    /// Renderer
    #[arg(long, value_enum, default_value_t = BackendArg::Cpu)]
    backend: BackendArg,
    #[arg(long, value_name = "WxH", value_parser = parse_size,
        help = format!("Width and height in pixels, each 1..={MAX_TARGET_SIDE} [default: the scene's]"))]
    size: Option<[u32; 2]>,
    /// Rounds of two frames of each kind, after one warm-up round
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
    /// Compare with a picture of so many samples per pixel, 1..=65536, on the CPU; slow
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: Option<u32>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BackendArg {
    Cpu,
    Gpu,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let context = match args.backend {
        BackendArg::Cpu => None,
        BackendArg::Gpu if args.samples.is_some() => {
            let text = "--samples compares on the CPU only; leave out --backend gpu";
            return Err(Failure::Input(text.to_owned()));
        }
        BackendArg::Gpu => Some(Context::new().map_err(Failure::input)?),
    };
    // Read before anything is measured.
    let read = |path: &PathBuf| Scene::read(path).map_err(Failure::input);
    let scenes: Vec<Scene> = args.scenes.iter().map(read).collect::<Result<_, _>>()?;
    let mut documents = Vec::new();
    for (path, scene) in args.scenes.iter().zip(&scenes) {
        let mut document = match &context {
            Some(context) => on_gpu(args, path, scene, context)?,
            None => on_cpu(args, path, scene)?,
        };
        document["scene"] = json!(path.display().to_string());
        documents.push(document);
    }
    let on_cpu = || format!("cpu: {} threads", rayon::current_num_threads());
    match args.json {
        true => print_line(json!({
            "backend": context.map_or_else(on_cpu, |context| context.name()),
            "repetitions": args.repetitions,
            "scenes": documents,
        })),
        false => Ok(()),
    }
}

/// Measures and, without `--json`, prints.
fn on_cpu(args: &Args, path: &Path, scene: &Scene) -> Result<Value, Failure> {
    let options = cpu_frames::Options {
        size: args.size,
        repetitions: args.repetitions,
        samples: args.samples,
    };
    let progress = progress("pictures", n_pictures(&options));
    let costs = scene_costs(scene, &options, &|| progress.advance(1));
    progress.finish();
    let costs = costs.map_err(|error| match error {
        RenderError::Scene(error) => Failure::input(error.in_file(path)),
        error => Failure::input(error),
    })?;
    if !args.json {
        print_costs(path, &costs)?;
    }
    Ok(costs.to_json())
}

fn print_costs(path: &Path, costs: &SceneCosts) -> Outcome {
    let stats = &costs.stats;
    print_line(format_args!(
        "{}: {}: {} strands, {} points, {} lights, {}x{}",
        path.display(),
        stats.backend,
        stats.strands,
        stats.points,
        stats.lights,
        costs.size[0],
        costs.size[1],
    ))?;
    print_line(format_args!(
        "  {:20} {:>10} {:>8} {:>8} {:>12} {:>9} {:>9}",
        "", "ms", "a second", "core-s", "products", "points", "entries"
    ))?;
    let shown = |core_seconds: Option<f64>| match core_seconds {
        Some(seconds) => format!("{seconds:8.3}"),
        None => format!("{:>8}", "-"),
    };
    let line = |cost: &PictureCost| {
        print_line(format_args!(
            "  {:20} {:10.1} {:8.2} {} {:12} {:9} {:9}  {}",
            cost.name,
            cost.milliseconds,
            cost.per_second(),
            shown(cost.core_seconds),
            cost.stats.products()[0],
            cost.stats.visible_points,
            cost.stats.list_entries,
            slowest(&cost.stages),
        ))
    };
    costs.pictures.iter().try_for_each(line)?;
    if let Some(samples) = &costs.samples {
        let ratio = samples.core_seconds_ratio;
        let ratio = ratio.map_or(String::new(), |ratio| format!(", {ratio:.1} of everything"));
        let error = samples.relative_rmse;
        let error = error.map_or(String::new(), |error| {
            format!("; the pictures differ by {:.3} %", 100.0 * error)
        });
        print_line(format_args!(
            "  {:20} {:10.1} {:8.2} {}{ratio}{error}",
            format!("{} samples", samples.samples),
            samples.milliseconds,
            1e3 / samples.milliseconds,
            shown(samples.core_seconds),
        ))?;
    }
    match costs.peak_bytes {
        Some(bytes) => print_line(format_args!("  {:.0} MB at most", 1e-6 * bytes as f64)),
        None => Ok(()),
    }
}

/// As [`on_cpu`].
fn on_gpu(args: &Args, path: &Path, scene: &Scene, context: &Context) -> Result<Value, Failure> {
    let in_file = |error: SceneError| Failure::input(error.in_file(path));
    let mut prepared = PreparedScene::load(scene).map_err(in_file)?;
    prepared.size = args.size.unwrap_or(prepared.size);
    let progress = progress("frames", n_frames(args.repetitions));
    let observer = |event: Progress| match event {
        Progress::Frame => progress.advance(1),
        Progress::Group {
            costs,
            seconds,
            starting,
        } => {
            let name = costs.first().map_or("", |cost| cost.group);
            progress.say(&format!(
                "{name}: {seconds:.1} s, {starting:.1} of them until the first pictures"
            ));
        }
    };
    let costs = frame_costs(context, &prepared, args.repetitions, &observer);
    progress.finish();
    let costs = costs.map_err(Failure::input)?;
    if !args.json {
        print_frames(path, context, &prepared, &costs)?;
    }
    Ok(json!({
        "size": prepared.size,
        "strands": prepared.strands.n_strands,
        "points": prepared.strands.points.len(),
        "lights": prepared.lights.len(),
        "frames": costs.iter().map(FrameCost::to_json).collect::<Vec<_>>(),
    }))
}

fn print_frames(
    path: &Path,
    context: &Context,
    prepared: &PreparedScene,
    costs: &[FrameCost],
) -> Outcome {
    print_line(format_args!(
        "{}: {}: {} strands, {} points, {} lights, {}x{}",
        path.display(),
        context.adapter_name,
        prepared.strands.n_strands,
        prepared.strands.points.len(),
        prepared.lights.len(),
        prepared.size[0],
        prepared.size[1],
    ))?;
    let mut group = "";
    for cost in costs {
        if cost.group != group {
            group = cost.group;
            print_line(group)?;
        }
        let most = slowest(&cost.stages);
        let line = format!(
            "  {:46} {:9.2} ms {:7.3}  {most}",
            cost.name, cost.milliseconds, cost.ratio
        );
        print_line(line.trim_end())?;
    }
    Ok(())
}

/// The stage that took longest, with its milliseconds.
fn slowest(stages: &[(&str, f64)]) -> String {
    let most = stages.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    most.map_or(String::new(), |(name, milliseconds)| {
        format!("{name} {milliseconds:.2}")
    })
}
