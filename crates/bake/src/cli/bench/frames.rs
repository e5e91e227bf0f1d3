//! `strandlight bench frames`.

use crate::cli::progress::progress;
use std::path::PathBuf;

use serde_json::json;
use strandlight_formats::Scene;
use strandlight_lab::bench::frames::{FrameCost, Progress, frame_costs, n_frames};
use strandlight_render::gpu::Context;
use strandlight_scene::PreparedScene;
use strandlight_scene::budget::MAX_TARGET_SIDE;

use crate::cli::render::parse_size;
use crate::cli::{Failure, Outcome, print_line};

/// Benchmark the first frame after each kind of edit, on the GPU
///
/// A frame is timed from the edit to a picture of 4 samples per pixel with all points shaded.
/// Reports medians in milliseconds, ratios to the first frame of each group, and the slowest stage;
/// the frames of a group are interleaved. Results of each group are printed on stderr as they come.
#[derive(clap::Args)]
pub struct Args {
    /// Scene file (TOML)
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    #[arg(long, value_name = "WxH", value_parser = parse_size,
        help = format!("Width and height in pixels, each 1..={MAX_TARGET_SIDE} [default: the scene's]"))]
    size: Option<[u32; 2]>,
    /// Rounds of two frames of each kind, after one warm-up round
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repetitions: u32,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let scene = Scene::read(&args.scene).map_err(Failure::input)?;
    let mut prepared =
        PreparedScene::load(&scene).map_err(|error| Failure::input(error.in_file(&args.scene)))?;
    prepared.size = args.size.unwrap_or(prepared.size);
    let context = Context::new().map_err(Failure::input)?;
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
    let costs = frame_costs(&context, &prepared, args.repetitions, &observer);
    progress.finish();
    let costs = costs.map_err(Failure::input)?;
    if args.json {
        return print_line(json!({
            "adapter": context.adapter_name,
            "size": prepared.size,
            "strands": prepared.strands.n_strands,
            "points": prepared.strands.points.len(),
            "lights": prepared.lights.len(),
            "repetitions": args.repetitions,
            "frames": costs.iter().map(FrameCost::to_json).collect::<Vec<_>>(),
        }));
    }
    print_line(format_args!(
        "{}: {} strands, {} points, {} lights, {}x{}",
        context.adapter_name,
        prepared.strands.n_strands,
        prepared.strands.points.len(),
        prepared.lights.len(),
        prepared.size[0],
        prepared.size[1],
    ))?;
    let mut group = "";
    for cost in &costs {
        if cost.group != group {
            group = cost.group;
            print_line(group)?;
        }
        let most = cost.stages.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let most = most.map_or(String::new(), |(name, milliseconds)| {
            format!("{name} {milliseconds:.2}")
        });
        let line = format!(
            "  {:46} {:9.2} ms {:7.3}  {most}",
            cost.name, cost.milliseconds, cost.ratio
        );
        print_line(line.trim_end())?;
    }
    Ok(())
}
