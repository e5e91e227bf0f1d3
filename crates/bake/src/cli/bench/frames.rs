//! `strandlight bench frames`.

use crate::cli::progress::progress;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::{Value, json};
use strandlight_bake::scenes::PaperScene;
use strandlight_formats::{Scene, counted};
use strandlight_lab::bench::cpu_frames::{
    self, HAIR_EDITS, PictureCost, SceneCosts, n_pictures, n_window_pictures, scene_costs,
};
use strandlight_lab::bench::estimate::{GPUS, Gpu, Pass};
use strandlight_lab::bench::frames::{FrameCost, Progress, frame_costs, n_frames};
use strandlight_lab::bench::window_frames::{EditPictures, WindowCost, window_costs};
use strandlight_render::gpu::Context;
use strandlight_runtime::options::parse_size;
use strandlight_runtime::work::NewFolders;
use strandlight_scene::budget::MAX_TARGET_SIDE;
use strandlight_scene::{PreparedScene, RenderError, SceneError};

use super::{against, scenes};
use crate::cli::scenes::table_2;
use crate::cli::{Failure, Outcome, output_folder, print_line, write_output};

/// Benchmark the first picture from nothing, and after each kind of edit
///
/// On the CPU: complete pictures, by clock and by seconds of all cores together, and what they
/// counted. On the GPU: frames from the edit to the finished picture of a window, as medians in milliseconds,
/// ratios to the first frame of each group, what the device did and for what, and the slowest stage; the frames of a group are interleaved, and its results are printed on stderr as they come.
///
/// `--window`: the same edits in a window on the CPU: time to the first new picture, a draft perhaps, and how
/// far it is from the last one at most (relative RMS of their levels); time to the first picture of every
/// light and term, how far it is from the last one, seconds of all cores to it and milliseconds of each stage until then, time to the last
/// one, and the longest time that the renderer keeps the window from input.
///
/// `--against PROGRAM` runs this build and another, each as `bench frames --json` in a process of its
/// own, in the order this, other, other, this, and prints the other's time over ours.
#[derive(clap::Args)]
pub struct Args {
    /// Scene files (TOML)
    #[arg(value_name = "SCENE.toml", required_unless_present = "table2")]
    scenes: Vec<PathBuf>,
    /// Also the six scenes of Xu 2011, Table 2, in this folder, generated there if missing, with the
    /// paper's frames per second beside those after edits of the hair
    #[arg(long, value_name = "DIR")]
    table2: Option<PathBuf>,
    /// Compare with another build's `strandlight`
    #[arg(long, value_name = "PROGRAM", conflicts_with = "model")]
    against: Option<PathBuf>,
    /// Pictures as a window on the CPU shows them, one after the other
    #[arg(long, conflicts_with_all = ["model", "against", "samples", "table2"])]
    window: bool,
    /// With --window: write what it showed after each kind of edit into this folder, a PNG each: its first
    /// new picture, the last one, and eight times their difference
    #[arg(long, value_name = "DIR", requires = "window")]
    pictures: Option<PathBuf>,
    /// Estimate each picture on this GPU from what the CPU counted; nothing runs on it
    #[arg(long, value_name = "GPU", value_parser = gpu_model())]
    model: Option<Gpu>,
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

/// Parses `--model GPU`.
fn gpu_model() -> impl TypedValueParser<Value = Gpu> {
    PossibleValuesParser::new(GPUS.map(|gpu| gpu.name))
        .map(|name| Gpu::from_name(&name).unwrap_or(GPUS[0]))
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BackendArg {
    Cpu,
    Gpu,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let gpu = args.backend == BackendArg::Gpu;
    if gpu && (args.samples.is_some() || args.model.is_some() || args.window) {
        let option = if args.samples.is_some() {
            "--samples"
        } else if args.window {
            "--window"
        } else {
            "--model"
        };
        let text = format!("{option} is of pictures on the CPU; leave out --backend gpu");
        return Err(Failure::Input(text));
    }
    let mut paths = args.scenes.clone();
    // What cannot be read is told before scenes are generated.
    scenes::read(&paths)?;
    let table_2 = match &args.table2 {
        Some(folder) => table_2(folder)?,
        None => Vec::new(),
    };
    paths.extend(table_2.iter().map(|(_, path)| path.clone()));
    let scenes = scenes::read(&paths)?;
    if let Some(program) = &args.against {
        return against::run(program, &paths, &options_of(args), args.json);
    }
    let context = match gpu {
        false => None,
        true => Some(Context::new().map_err(Failure::input)?),
    };
    scenes::check(&paths, &scenes, args.size)?;
    let _new = args
        .pictures
        .as_deref()
        .map(|folder| pictures_folder(folder, &paths));
    let _new = _new.transpose()?;
    let measured = paths.iter().zip(&scenes).enumerate();
    let measured = measured.map(|(ix, (path, scene))| {
        let mut document = match &context {
            Some(context) => on_gpu(args, path, scene, context)?,
            None if args.window => in_window(args, path, scene)?,
            None => on_cpu(args, path, scene)?,
        };
        document["scene"] = json!(path.display().to_string());
        if let Some((paper, _)) = ix.checked_sub(args.scenes.len()).map(|ix| &table_2[ix]) {
            document["xu_2011"] = beside_paper(paper, &document);
        }
        Ok(document)
    });
    let (documents, ended) = scenes::until_failure(measured);
    if documents.is_empty() {
        return ended;
    }
    let on_cpu = || {
        format!(
            "cpu: {}",
            counted(rayon::current_num_threads(), "thread", "threads")
        )
    };
    match args.json {
        true => print_line(json!({
            "backend": context.map_or_else(on_cpu, |context| context.name()),
            "repetitions": args.repetitions,
            "scenes": documents,
        }))?,
        false => print_table_2(&documents)?,
    }
    ended
}

/// The options that runs of `--against` have.
fn options_of(args: &Args) -> against::Options {
    let gpu = args.backend == BackendArg::Gpu;
    let kept = match gpu {
        true => vec!["--backend".into(), "gpu".into()],
        false => Vec::new(),
    };
    let costly = |repetitions: u32, size: Option<[u32; 2]>, samples: Option<u32>| {
        let mut options: Vec<OsString> =
            vec!["--repetitions".into(), repetitions.to_string().into()];
        if let Some([width, height]) = size {
            options.extend(["--size".into(), format!("{width}x{height}").into()]);
        }
        if let Some(samples) = samples {
            options.extend(["--samples".into(), samples.to_string().into()]);
        }
        options
    };
    against::Options {
        kept,
        costly: costly(args.repetitions, args.size, args.samples),
        least: costly(1, Some([16; 2]), args.samples.map(|_| 1)),
    }
}

/// What Table 2 has of a scene, and our frames a second after the slowest edit of the hair over the
/// paper's: null of another size.
fn beside_paper(paper: &PaperScene, document: &Value) -> Value {
    let frames = document["frames"].as_array().into_iter().flatten();
    let edits = frames.filter(|frame| {
        frame["name"]
            .as_str()
            .is_some_and(|name| HAIR_EDITS.contains(&name))
    });
    let slowest = edits
        .filter_map(|frame| frame["milliseconds"].as_f64())
        .reduce(f64::max);
    let a_second = slowest.map(|milliseconds| 1e3 / milliseconds);
    let points = u64::from(paper.strands) * u64::from(paper.points_per_strand);
    let is_that_size = document["size"] == json!([720, 480])
        && document["lights"] == json!(paper.lights)
        && document["strands"] == json!(paper.strands);
    let ratio = a_second
        .zip(paper.frames_per_second)
        .filter(|_| is_that_size);
    json!({
        "name": paper.name,
        "strands": paper.strands,
        "points": points,
        "lights": paper.lights,
        "frames_per_second": paper.frames_per_second,
        "ours": a_second,
        "ratio": ratio.map(|(ours, paper)| ours / paper),
    })
}

/// Frames a second of the scenes of Table 2, if any were measured.
fn print_table_2(documents: &[Value]) -> Outcome {
    let rows: Vec<&Value> = documents
        .iter()
        .map(|document| &document["xu_2011"])
        .filter(|row| row.is_object())
        .collect();
    if rows.is_empty() {
        return Ok(());
    }
    print_line(format_args!(
        "{:12} {:>9} {:>7} {:>9} {:>9} {:>7}   frames a second after the slowest edit of the hair",
        "Table 2", "points", "lights", "Xu 2011", "ours", "ratio"
    ))?;
    let shown = |value: &Value| {
        value
            .as_f64()
            .map_or("-".to_owned(), |value| format!("{value:.2}"))
    };
    rows.into_iter().try_for_each(|row| {
        print_line(format_args!(
            "{:12} {:>9} {:>7} {:>9} {:>9} {:>7}",
            row["name"].as_str().unwrap_or_default(),
            row["points"].to_string(),
            row["lights"].to_string(),
            shown(&row["frames_per_second"]),
            shown(&row["ours"]),
            shown(&row["ratio"]),
        ))
    })
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
    let estimates: Vec<Estimate> = args.model.map_or(Vec::new(), |gpu| {
        let pictures = costs.pictures.iter();
        let passes = |cost: &PictureCost| gpu.passes(&cost.stats, costs.size);
        pictures
            .map(|cost| Estimate::new(&gpu, passes(cost)))
            .collect()
    });
    if !args.json {
        print_costs(path, &costs)?;
        print_estimates(&costs, &estimates)?;
    }
    let mut document = costs.to_json();
    for (ix, estimate) in estimates.iter().enumerate() {
        document["frames"][ix]["model"] = estimate.to_json();
    }
    Ok(document)
}

/// As [`on_cpu`].
fn in_window(args: &Args, path: &Path, scene: &Scene) -> Result<Value, Failure> {
    let options = cpu_frames::Options {
        size: args.size,
        repetitions: args.repetitions,
        samples: None,
    };
    let progress = progress("edits", n_window_pictures(&options));
    let mut written = Ok(());
    let mut seen = |name: &str, pictures: EditPictures| {
        if let Some(folder) = args.pictures.as_deref().filter(|_| written.is_ok()) {
            let path = folder.join(picture_name(path, name));
            let png = pictures.to_png().map_err(Failure::input);
            written = png.and_then(|png| write_output(&path, &png));
        }
    };
    let costs = window_costs(scene, &options, &|| progress.advance(1), &mut seen);
    progress.finish();
    let costs = costs.map_err(|error| match error {
        RenderError::Scene(error) => Failure::input(error.in_file(path)),
        error => Failure::input(error),
    })?;
    written?;
    if !args.json {
        print_line(format_args!(
            "{}: cpu: {}, in a window\n  {:20} {:>10} {:>7} {:>10} {:>9} {:>8} {:>10} {:>10}  ms to the first by stage",
            path.display(),
            counted(rayon::current_num_threads(), "thread", "threads"),
            "",
            "shown, ms",
            "off, %",
            "first, ms",
            "first off",
            "core-s",
            "last, ms",
            "longest"
        ))?;
        let seconds = |seconds: Option<f64>| match seconds {
            Some(seconds) => format!("{seconds:8.3}"),
            None => format!("{:>8}", "-"),
        };
        costs.iter().try_for_each(|cost| {
            print_line(format_args!(
                "  {:20} {:10.1} {:7.1} {:10.1} {:9.1} {} {:10.1} {:10.1}  {}",
                cost.name,
                cost.shown_milliseconds,
                100.0 * cost.shown_off,
                cost.first_milliseconds,
                100.0 * cost.first_off,
                seconds(cost.first_core_seconds),
                cost.settled_milliseconds,
                cost.longest_milliseconds,
                stages(&cost.first_stages),
            ))
        })?;
    }
    Ok(json!({
        "edits": costs.iter().map(WindowCost::to_json).collect::<Vec<_>>(),
    }))
}

/// Stages that took a millisecond or more, the longest first.
fn stages(of: &[(&str, f64)]) -> String {
    let mut of: Vec<_> = of.iter().filter(|(_, took)| *took >= 1.0).collect();
    of.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let texts: Vec<String> = of
        .iter()
        .map(|(name, took)| format!("{name} {took:.0}"))
        .collect();
    texts.join(", ")
}

/// The folder of `--pictures`, where scenes of one name would write over each other's.
fn pictures_folder(folder: &Path, scenes: &[PathBuf]) -> Result<NewFolders, Failure> {
    let mut names = std::collections::HashSet::new();
    for path in scenes {
        if !names.insert(path.file_stem()) {
            let text = "has the name of another scene, whose pictures would be written over; give them other names";
            return Err(Failure::file(path, text));
        }
    }
    output_folder(folder)
}

/// Of the pictures of a scene after an edit of this name.
fn picture_name(scene: &Path, edit: &str) -> String {
    let stem = scene.file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}.{}.png", edit.replace(' ', "-"))
}

/// A picture on a GPU that is not at hand.
struct Estimate {
    gpu: &'static str,
    passes: Vec<Pass>,
    milliseconds: f64,
}

impl Estimate {
    fn new(gpu: &Gpu, passes: Vec<Pass>) -> Estimate {
        Estimate {
            gpu: gpu.name,
            milliseconds: passes.iter().map(|pass| pass.1).sum(),
            passes,
        }
    }

    fn to_json(&self) -> Value {
        let pass =
            |(name, milliseconds): &Pass| json!({ "name": name, "milliseconds": milliseconds });
        json!({
            "gpu": self.gpu,
            "is_estimate": true,
            "milliseconds": self.milliseconds,
            "frames_per_second": 1e3 / self.milliseconds,
            "passes": self.passes.iter().map(pass).collect::<Vec<_>>(),
        })
    }
}

fn print_estimates(costs: &SceneCosts, estimates: &[Estimate]) -> Outcome {
    let Some(first) = estimates.first() else {
        return Ok(());
    };
    print_line(format_args!(
        "  ESTIMATE for {}, from these counts alone; nothing ran on one",
        first.gpu
    ))?;
    costs
        .pictures
        .iter()
        .zip(estimates)
        .try_for_each(|(cost, estimate)| {
            print_line(format_args!(
                "  {:20} {:10.3} {:8.0} {:8}  {}",
                cost.name,
                estimate.milliseconds,
                1e3 / estimate.milliseconds,
                "",
                slowest(&estimate.passes),
            ))
        })
}

fn print_costs(path: &Path, costs: &SceneCosts) -> Outcome {
    let stats = &costs.stats;
    print_line(format_args!(
        "{}: {}: {}, {}, {}, {}x{}",
        path.display(),
        stats.backend,
        counted(stats.strands, "strand", "strands"),
        counted(stats.points, "point", "points"),
        counted(stats.lights, "light", "lights"),
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
            counted(samples.samples, "sample", "samples"),
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
        "{}: {}: {}, {}, {}, {}x{}",
        path.display(),
        context.adapter_name,
        counted(prepared.strands.n_strands, "strand", "strands"),
        counted(prepared.strands.points.len(), "point", "points"),
        counted(prepared.lights.len(), "light", "lights"),
        prepared.size[0],
        prepared.size[1],
    ))?;
    print_line(
        "  submissions, workgroups, MB written, points shaded, million products, pairs of a pixel and a segment; the stage that took the device longest",
    )?;
    let mut group = "";
    for cost in costs {
        if cost.group != group {
            group = cost.group;
            print_line(group)?;
        }
        let stages = cost.stages.iter();
        let stages = stages.map(|stage| {
            let milliseconds = stage.gpu_milliseconds.unwrap_or(stage.milliseconds);
            (stage.name, milliseconds)
        });
        let most = slowest(&stages.collect::<Vec<_>>());
        let work = &cost.work;
        let line = format!(
            "  {:46} {:9.2} ms {:7.3} {:5} {:9} {:9.3} {:9} {:9.2} {:9}  {most}",
            cost.name,
            cost.milliseconds,
            cost.ratio,
            work.submissions,
            work.workgroups,
            1e-6 * work.written_bytes as f64,
            work.points,
            1e-6 * work.products as f64,
            work.list_entries,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_a_second_are_over_those_of_the_paper() {
        let paper = PaperScene::from_name("bob-cut").expect("of the table");
        let mut document = json!({
            "size": [720, 480],
            "strands": 10_000,
            "lights": 30,
            "frames": [
                { "name": "view", "milliseconds": 900.0 },
                { "name": "widths", "milliseconds": 200.0 },
                { "name": "colour of the hair", "milliseconds": 100.0 },
            ],
        });
        let row = beside_paper(paper, &document);
        assert_eq!(row["ours"], 5.0);
        assert_eq!(
            (&row["points"], &row["frames_per_second"]),
            (&json!(350_000), &json!(10.6))
        );
        let ratio = row["ratio"].as_f64().expect("of the same size");
        assert!((ratio - 5.0 / 10.6).abs() < 1e-12);
        document["size"] = json!([360, 240]);
        assert!(beside_paper(paper, &document)["ratio"].is_null());
    }
}
