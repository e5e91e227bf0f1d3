//! `strandlight bench multiple`.

use crate::cli::progress::progress;
use strandlight_lab::bench::{INTEGRAL_NAMES, Method, MultipleOptions, Set, run_multiple};
use strandlight_scene::progress::timed;

use super::method_tables::method_tables;
use crate::cli::{Failure, Outcome, print_line};

/// Most random configurations.
const MAX_CONFIGURATIONS: u64 = 1_000_000;

/// Benchmark global and local multiple scattering of one light: error against the exact model, and
/// time
///
/// Relative RMSE over random configurations of light, spread, view and hair; nanoseconds per light
/// and point on one thread, and their ratio to the paper's scheme.
#[derive(clap::Args)]
pub struct Args {
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MAX_CONFIGURATIONS),
        help = format!("Random configurations, 1 to {MAX_CONFIGURATIONS}; 10000 take some minutes on two cores"))]
    n: u64,
    /// Random seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Distribution of the random configurations
    #[arg(long, value_enum, default_value_t = super::single::SetArg::Accuracy)]
    set: super::single::SetArg,
    /// Timed passes per method; 0 measures errors only
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u64).range(0..=1000))]
    repetitions: u64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let options = MultipleOptions {
        set: Set::from(args.set),
        n: args.n as usize,
        seed: args.seed,
        repetitions: args.repetitions as usize,
    };
    let tables = method_tables()?;
    let (multiple, seconds) = timed(|| run_multiple(options, &tables, progress));
    let multiple = multiple.map_err(Failure::input)?;
    if args.json {
        return print_line(multiple.to_json());
    }
    print_line(format_args!(
        "{} configurations ({}, seed {}); relative RMSE in %; ns per light and point, ratio to {} {}",
        options.n,
        options.set.name(),
        options.seed,
        Method::BASE.family(),
        Method::BASE.setting()
    ))?;
    let [r, tt, trt, global, local] = INTEGRAL_NAMES;
    print_line(format_args!(
        "{:16} {r:>8} {tt:>8} {trt:>8} {global:>8} {local:>8} {:>10} {:>7} {:>9} {:>7}",
        "", "global ns", "ratio", "local ns", "ratio"
    ))?;
    for row in &multiple.rows {
        let [r, tt, trt, global, local] = row.errors.map(|errors| 100.0 * errors.rel_rmse);
        let costs = match &row.costs {
            Some([global, local]) => format!(
                "{:10.1} {:7.2} {:9.1} {:7.2}",
                global.ns, global.ratio, local.ns, local.ratio
            ),
            None => String::new(),
        };
        let name = format!("{} {}", row.method.family(), row.method.setting());
        print_line(format_args!(
            "{name:16} {r:8.3} {tt:8.3} {trt:8.3} {global:8.3} {local:8.3} {costs}"
        ))?;
    }
    print_line(format_args!("measured in {seconds:.0} s"))
}
