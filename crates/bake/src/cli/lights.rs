//! `strandlight lights` and `strandlight lights import`.

mod args;
mod bake;
mod html;
mod import;
mod plan;
mod repeat;
mod results;
mod saturated;

use std::path::{Path, PathBuf};

use strandlight_formats::{Kind, counted};

use super::{
    Failure, Outcome, check_extension, check_outputs, check_own_extension, check_report_extension,
    print_line,
};
use crate::cli::progress::progress;
use args::Layout;
use results::BudgetResult;

pub use args::FitArgs;
pub use bake::{Baked, bake};
pub use plan::Plan;

/// Fit spherical Gaussian lights to an HDR map
///
/// The map holds linear radiance in the latitude-longitude layout of OpenEXR, twice as wide as
/// high, +Y up: OpenEXR (any compression, scan lines or tiles, mip maps) or Radiance .hdr. The
/// display window of an OpenEXR file covers the sphere; pixels outside its data window are black.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    fit: Option<FitArgs>,
}

#[derive(clap::Subcommand)]
enum Command {
    Import(import::Args),
}

/// Steps beside those of the fit: reading, the report, the files.
const OTHER_STEPS: u64 = 3;

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match (&args.command, &args.fit) {
        (Some(Command::Import(args)), _) => import::run(args),
        (None, Some(args)) => run_fit(args),
        // The parser asks for a map or a subcommand.
        (None, None) => Ok(()),
    }
}

fn run_fit(args: &FitArgs) -> Outcome {
    // The one layout there is; the match makes a new one stop here.
    let Layout::Latlong = args.layout;
    let beside = [&args.residual, &args.timings, &args.preview, &args.panorama];
    let outputs = [&args.output].into_iter().chain(&args.report);
    let outputs = outputs.chain(beside.into_iter().flatten());
    let outputs: Vec<&Path> = outputs.map(PathBuf::as_path).collect();
    let hair = args.hair.as_ref().map(Path::new);
    let inputs: Vec<&Path> = [Some(args.map.as_path()), hair]
        .into_iter()
        .flatten()
        .collect();
    check_outputs(&inputs, &outputs)?;
    check_own_extension(&args.output, "lights")?;
    for report in args.report.iter().chain(&args.timings) {
        check_report_extension(report)?;
    }
    if let Some(preview) = &args.preview {
        check_extension(preview, "png")?;
    }
    if let Some(residual) = &args.residual {
        check_extension(residual, "exr")?;
    }
    if let Some(panorama) = &args.panorama {
        check_extension(panorama, "panorama")?;
    }
    let plan = Plan::of(args)?;
    let progress = progress("fitting lights", plan.steps() + OTHER_STEPS);
    let baked = bake(args, args, &plan, &progress).and_then(|baked| {
        baked.write(args)?;
        progress.advance(1);
        Ok(baked)
    });
    progress.finish();
    let baked = baked?;
    if args.json {
        print_line(format_args!("{:#}", baked.document_with_times()))?;
    } else {
        for path in baked.files() {
            print_line(format_args!("wrote {}", path.display()))?;
        }
    }
    match missed_budget(args, &baked) {
        Some(missed) => Err(missed),
        None if args.json => Ok(()),
        None => print_line(summary(args, &baked)),
    }
}

/// The failure of a budget that no set keeps.
pub fn missed_budget(args: &FitArgs, baked: &Baked) -> Option<Failure> {
    let budget = baked.results.budget.as_ref();
    let budget = budget.filter(|budget| !budget.is_met())?;
    Some(Failure::Check(missed(args, baked, budget)))
}

/// The last line of a fit.
fn summary(args: &FitArgs, baked: &Baked) -> String {
    let set = &baked.results.set;
    let (major, minor) = Kind::Lights.version();
    let how_many = match (set.lights.len(), set.info.requested_count as usize) {
        (found, _) if baked.results.residual.is_some() => counted(found, "light", "lights"),
        (found, asked) if found == asked => counted(found, "light", "lights"),
        (found, asked) => format!("{found} of {asked} lights, more would not help"),
    };
    let mut figures = match baked.results.report {
        Some(report) => {
            let worst_energy = report
                .energy_ratio
                .iter()
                .fold(0.0f64, |worst, ratio| worst.max((ratio - 1.0).abs()));
            format!(
                "fibre error {:.2} %, irradiance error {:.2} %, energy off by at most {:.3} %",
                100.0 * report.fibre_error,
                100.0 * report.irradiance_error,
                100.0 * worst_energy,
            )
        }
        None => "errors not measured".to_owned(),
    };
    if baked.results.residual.is_some() {
        figures = format!("with the residual {figures}");
    }
    if let Some(hair) = &baked.results.hair {
        let error = 100.0 * hair.fibre_error;
        figures += &format!(", fibre error of {} {error:.2} %", hair.name);
    }
    format!(
        "wrote {}: light set, format {major}.{minor}, {how_many} ({} compact), {} bytes, {figures}, \
         {:.2} s",
        args.output.display(),
        baked.results.compact_lights,
        baked.bytes.len(),
        baked.seconds,
    )
}

/// What is said of a budget that no set keeps.
fn missed(args: &FitArgs, baked: &Baked, budget: &BudgetResult) -> String {
    // 0.07 * 100 has a tail of digits.
    let percent = |error: f64| (1e12 * error).round() / 1e10;
    format!(
        "{}: no set of up to {} has a {} error of at most {} %; the best of those fitted has \
         {:.3} %, with {}; no light set was written",
        args.map.display(),
        counted(budget.max_count, "light", "lights"),
        budget.metric.name(),
        percent(budget.max_error),
        percent(budget.error),
        baked.results.set.lights.len(),
    )
}
