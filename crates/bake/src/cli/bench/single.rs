//! `strandlight bench single`.

use crate::cli::progress::progress;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use strandlight_lab::bench::{Cost, Frontier, FrontierError, Method, Options, SUM_NAMES, Set};
use strandlight_render::gpu::GpuError;
use strandlight_runtime::work::NewFolders;
use strandlight_scene::progress::timed;

use super::method_tables::method_tables;
use crate::cli::{Failure, Outcome, check_outputs, note, output_folder, print_line, write_output};

/// Most random configurations.
const MAX_CONFIGURATIONS: u64 = 1_000_000;

/// Benchmark single scattering of one light: error against the exact model, and time per method
///
/// Relative RMSE over random configurations of light, view and hair; nanoseconds per light and
/// point, measured side by side on one thread and on the adapter.
#[derive(clap::Args)]
pub struct Args {
    /// Folder for single.csv, single.json and single.svg; created if missing
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MAX_CONFIGURATIONS),
        help = format!("Random configurations, 1 to {MAX_CONFIGURATIONS}; 10000 take about a minute on two cores"))]
    n: u64,
    /// Random seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Distribution of the random configurations
    #[arg(long, value_enum, default_value_t = SingleSetArg::Accuracy)]
    set: SingleSetArg,
    /// Timed passes per method; 0 measures errors only
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u64).range(0..=1000))]
    repetitions: u64,
    /// Whether to time the shaders on the GPU as well
    #[arg(long, value_enum, default_value_t = AdapterArg::Auto)]
    adapter: AdapterArg,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub enum SetArg {
    /// eta 1.55, w_c 0.15, grey absorption
    Accuracy,
    /// eta 1.45 to 1.65, w_c 0.08 to 0.3, each channel its own absorption
    Wide,
}

impl From<SetArg> for Set {
    fn from(set: SetArg) -> Set {
        match set {
            SetArg::Accuracy => Set::Accuracy,
            SetArg::Wide => Set::Wide,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum SingleSetArg {
    /// eta 1.55, w_c 0.15, grey absorption
    Accuracy,
    /// eta 1.45 to 1.65, w_c 0.08 to 0.3, each channel its own absorption
    Wide,
    /// As wide, of model energy, which the renderer's scheme alone takes
    Energy,
}

impl From<SingleSetArg> for Set {
    fn from(set: SingleSetArg) -> Set {
        match set {
            SingleSetArg::Accuracy => Set::Accuracy,
            SingleSetArg::Wide => Set::Wide,
            SingleSetArg::Energy => Set::Energy,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum AdapterArg {
    /// If there is one
    Auto,
    /// Fail without one
    Yes,
    /// CPU only
    No,
}

/// Names of what is written.
const FILES: [&str; 3] = ["single.csv", "single.json", "single.svg"];

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    // A new folder would go at once if nobody held it.
    let (_new, paths) = match &args.output {
        Some(folder) => output_paths(folder).map(|(new, paths)| (Some(new), paths))?,
        None => (None, Vec::new()),
    };
    if args.adapter == AdapterArg::Yes && args.repetitions == 0 {
        note!("--adapter yes has no effect with --repetitions 0");
    }
    let (frontier, seconds) = timed(|| measure(args));
    let frontier = frontier?;
    let document = frontier.to_json();
    if let [csv, json, svg] = &paths[..] {
        write_output(csv, frontier.to_csv().as_bytes())?;
        let text = serde_json::to_string_pretty(&document).map_err(Failure::input)?;
        write_output(json, (text + "\n").as_bytes())?;
        write_output(svg, frontier.figure().to_svg().as_bytes())?;
    }
    if args.json {
        return print_line(document);
    }
    print_table(&frontier)?;
    for path in &paths {
        print_line(format_args!("wrote {}", path.display()))?;
    }
    print_line(format_args!("measured in {seconds:.0} s"))
}

/// Makes the folder and checks that the files can be written there.
fn output_paths(folder: &Path) -> Result<(NewFolders, Vec<PathBuf>), Failure> {
    let new = output_folder(folder)?;
    let paths = FILES.map(|name| folder.join(name));
    let [csv, json, svg] = &paths;
    check_outputs(&[], &[csv, json, svg])?;
    Ok((new, paths.to_vec()))
}

fn measure(args: &Args) -> Result<Frontier, Failure> {
    let options = Options {
        set: Set::from(args.set),
        n: args.n as usize,
        seed: args.seed,
        repetitions: args.repetitions as usize,
        adapter: args.adapter != AdapterArg::No,
    };
    let tables = method_tables()?;
    let result = strandlight_lab::bench::run(options, &tables, progress);
    let absent = matches!(
        result,
        Err(FrontierError::Gpu(
            GpuError::NoAdapter(_) | GpuError::Unsuitable { .. } | GpuError::NoDevice { .. }
        ))
    );
    if !absent || args.adapter == AdapterArg::Yes {
        return result.map_err(Failure::input);
    }
    note!("no GPU adapter: the CPU alone is timed");
    let options = Options {
        adapter: false,
        ..options
    };
    strandlight_lab::bench::run(options, &tables, progress).map_err(Failure::input)
}

fn print_table(frontier: &Frontier) -> Outcome {
    let options = &frontier.options;
    let base = Method::base_of(options.set.model());
    print_line(format_args!(
        "{} configurations ({}, seed {}); relative RMSE in %; inner integrals and ns per light and point, ratio to {} {}",
        options.n,
        options.set.name(),
        options.seed,
        base.family(),
        base.setting()
    ))?;
    if let Some(name) = &frontier.adapter_name {
        print_line(format_args!("adapter: {name}"))?;
    }
    let [r, tt, trt, all] = SUM_NAMES;
    print_line(format_args!(
        "{:26} {r:>8} {tt:>8} {trt:>8} {all:>8} {:>7} {:>10} {:>7} {:>10} {:>7}",
        "", "inner", "CPU ns", "ratio", "adapter ns", "ratio"
    ))?;
    let shown = |cost: Option<Cost>| match cost {
        Some(cost) => format!("{:10.1} {:7.2}", cost.ns, cost.ratio),
        None => format!("{:>10} {:>7}", "-", "-"),
    };
    for row in &frontier.rows {
        let [r, tt, trt, all] = row.measured.errors.map(|errors| 100.0 * errors.rel_rmse);
        let name = format!("{} {}", row.method.family(), row.method.setting());
        print_line(format_args!(
            "{name:26} {r:8.3} {tt:8.3} {trt:8.3} {all:8.3} {:7.2} {} {}",
            row.measured.inner_mean,
            shown(row.cpu),
            shown(row.adapter)
        ))?;
    }
    Ok(())
}
