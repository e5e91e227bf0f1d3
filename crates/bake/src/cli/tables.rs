//! `strandlight tables`.

use std::path::PathBuf;

use clap::ValueEnum;
use serde_json::json;
use strandlight_bake::tables::{Float16Cost, N_STEPS, bake_tables, float16_cost, lean};
use strandlight_formats::{BakedFile, Kind, TableFile};
use strandlight_scene::progress::{Progress, timed};

use super::{Failure, Outcome, check_outputs, check_own_extension, print_line, write_output};
use crate::cli::progress::progress;

/// Bake the renderer's lookup tables
///
/// The R lobe uses `C` over light width and azimuth; the other two use `lobes_TT_*` and
/// `lobes_TRT_*` over refractive index, inclination and absorption; the paper's scheme uses `H_TT`
/// and `H_TRT`. They depend only on the Fresnel term; the dielectric tables are bundled with the
/// program. The errors of the lobes are recorded in the file and printed.
#[derive(clap::Args)]
pub struct Args {
    /// .tables file to write, - for standard output
    #[arg(short, long)]
    output: PathBuf,
    /// Fresnel term of the lobes and of the H tables
    #[arg(long, default_value = "dielectric")]
    fresnel: FresnelArg,
    /// Omit `H_TT` and `H_TRT`: sufficient for rendering, three quarters of the size
    #[arg(long)]
    lean: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum FresnelArg {
    Dielectric,
    Schlick,
}

impl From<FresnelArg> for strandlight_scattering::fresnel::Fresnel {
    fn from(arg: FresnelArg) -> Self {
        match arg {
            FresnelArg::Dielectric => Self::Dielectric,
            FresnelArg::Schlick => Self::Schlick,
        }
    }
}

impl Args {
    fn trimmed(&self, file: TableFile) -> TableFile {
        if self.lean { lean(file) } else { file }
    }
}

/// The bytes of the file.
///
/// # Errors
/// The tables break a promise of the format.
pub fn bake(args: &Args, progress: &Progress) -> Result<Vec<u8>, Failure> {
    let file = args.trimmed(bake_tables(args.fresnel.into(), progress));
    file.to_bytes().map_err(Failure::input)
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    check_own_extension(&args.output, "tables")?;
    check_outputs(&[], &[&args.output])?;
    let progress = progress("tables", N_STEPS);
    let (file, seconds) = timed(|| bake_tables(args.fresnel.into(), &progress));
    progress.finish();
    let cost = float16_cost(&file).map_err(Failure::input)?;
    let file = args.trimmed(file);
    let bytes = file.to_bytes().map_err(Failure::input)?;
    write_output(&args.output, &bytes)?;
    if args.json {
        print_line(json_report(args, &file, bytes.len(), seconds, &cost))
    } else {
        print_report(args, &file, bytes.len(), seconds, &cost)
    }
}

fn print_report(
    args: &Args,
    file: &TableFile,
    n_bytes: usize,
    seconds: f64,
    cost: &Float16Cost,
) -> Outcome {
    for table in &file.tables {
        let axes: Vec<String> = table
            .axes
            .iter()
            .map(|axis| {
                let (name, count, spacing) = (&axis.name, axis.count, axis.spacing.name());
                format!("{name} {}..{} ({count}, {spacing})", axis.min, axis.max)
            })
            .collect();
        print_line(format!(
            "{}: {}; {}; error between texels {:.2e}",
            table.name,
            axes.join(" x "),
            table.header().format(),
            table.max_interpolation_error
        ))?;
    }
    for (name, value) in &file.info.parameters {
        if name.starts_with("lobes_") {
            print_line(format!("{name}: {value}"))?;
        }
    }
    print_line(format!(
        "half floats would cost: R lobe {:.1e} (95 % of texels; {:.1e} if powers were stored), \
         H {:.1e}",
        cost.shares_p95, cost.powers_p95, cost.moments
    ))?;
    let (major, minor) = Kind::Tables.version();
    print_line(format!(
        "wrote {}: tables version {major}.{minor}, {} fresnel, {n_bytes} bytes, baked in {:.0} ms",
        args.output.display(),
        file.fresnel,
        1e3 * seconds
    ))
}

fn json_report(
    args: &Args,
    file: &TableFile,
    n_bytes: usize,
    seconds: f64,
    cost: &Float16Cost,
) -> serde_json::Value {
    let tables: Vec<_> = file
        .tables
        .iter()
        .map(|table| {
            let axes: Vec<_> = table
                .axes
                .iter()
                .map(|axis| {
                    json!({
                        "name": axis.name,
                        "min": axis.min,
                        "max": axis.max,
                        "count": axis.count,
                        "spacing": axis.spacing.name(),
                    })
                })
                .collect();
            json!({
                "name": table.name,
                "axes": axes,
                "channels": table.channels,
                "format": table.header().format(),
                "max_interpolation_error": table.max_interpolation_error,
            })
        })
        .collect();
    let lobe_errors: serde_json::Map<_, _> = file
        .info
        .parameters
        .iter()
        .filter(|(name, _)| name.starts_with("lobes_"))
        .map(|(name, value)| (name.clone(), json!(value)))
        .collect();
    json!({
        "file": args.output.display().to_string(),
        "bytes": n_bytes,
        "seconds": seconds,
        "fresnel": file.fresnel,
        "tables": tables,
        "lobe_errors": lobe_errors,
        "float16": {
            "c_error_over_c_0": cost.shares_c,
            "r_lobe_median": cost.shares_median,
            "r_lobe_p95": cost.shares_p95,
            "r_lobe_max": cost.shares_max,
            "r_lobe_from_powers_median": cost.powers_median,
            "r_lobe_from_powers_p95": cost.powers_p95,
            "r_lobe_from_powers_max": cost.powers_max,
            "h_error": cost.moments,
        },
    })
}
