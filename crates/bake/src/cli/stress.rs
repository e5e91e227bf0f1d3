//! `strandlight stress`: scattering under numerical stress.

use std::fmt;
use std::path::PathBuf;

use strandlight_bake::tables::fresnel_of;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_lab::stress::{Options, Report, Target, run as run_stress};
use strandlight_render::probe::{GpuProbe, Scheme};
use strandlight_scattering::Lobe;
use strandlight_scene::material::LobeTables;
use strandlight_scene::tables::{ShadingTables, lobe_table};

use super::probe::{default_tables, parse_query};
use super::progress::progress;
use super::{Failure, Outcome, note, print_line};

/// Stress-test single and multiple scattering at corner cases and random extremes, against f64
///
/// Checks the renderer's functions in f32 on the CPU and as WGSL on the GPU: finite values,
/// agreement of CPU and GPU, energy, white furnace, symmetries, continuity, rounding, rejection of
/// invalid parameters. Prints the worst case of each check with all its inputs. Exits with 1 when a
/// check fails.
#[derive(clap::Args)]
pub struct Args {
    /// Samples per function (expensive checks use fewer)
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    n: u32,
    /// Scattering scheme to test
    #[arg(long, value_enum, default_value_t = Method::Runtime)]
    method: Method,
    /// Random seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Baked tables [default: the bundled ones]
    #[arg(long, value_name = "F.tables")]
    tables: Option<PathBuf>,
    /// Skip GPU checks
    #[arg(long)]
    no_gpu: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Schemes of single scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// What the renderer evaluates
    Runtime,
    /// Xu's scheme as published; it fails
    Paper,
}

impl From<Method> for Scheme {
    fn from(method: Method) -> Scheme {
        match method {
            Method::Runtime => Scheme::Lobes,
            Method::Paper => Scheme::Paper,
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let file = match &args.tables {
        Some(path) => TableFile::read(path).map_err(Failure::input)?,
        None => default_tables()?,
    };
    let cannot = |error: &dyn fmt::Display| match &args.tables {
        Some(path) => Failure::file(path, error),
        None => Failure::input(error),
    };
    let tables = match args.method {
        Method::Runtime => ShadingTables::whole_or_lean(&file),
        Method::Paper => ShadingTables::from_file(&file),
    };
    let tables = tables.map_err(|error| cannot(&error))?;
    let fresnel = fresnel_of(&file).map_err(|error| cannot(&error))?;
    let probe = if args.no_gpu {
        None
    } else {
        match GpuProbe::new(&tables) {
            Ok(probe) => Some(probe),
            Err(error) => {
                note!("strandlight: {error}: testing the CPU only");
                None
            }
        }
    };
    let lobes = match args.method {
        Method::Paper => LobeTables::default(),
        Method::Runtime => LobeTables {
            tt: Some(lobe_table(&file, Lobe::Tt).map_err(|error| cannot(&error))?),
            trt: Some(lobe_table(&file, Lobe::Trt).map_err(|error| cannot(&error))?),
        },
    };
    let target = Target::new(args.method.into(), &tables, lobes.into(), fresnel, probe);
    let options = Options {
        n: args.n as usize,
        seed: args.seed,
    };
    let parse = |line: &str| parse_query(line).map_err(Into::into);
    let report = run_stress(&target, options, &parse, &progress).map_err(Failure::input)?;
    if args.json {
        print_line(report.to_json())?;
    } else {
        for line in report.to_lines() {
            print_line(line)?;
        }
    }
    verdict(&report)
}

fn verdict(report: &Report) -> Outcome {
    if report.passed() {
        return Ok(());
    }
    let names: Vec<&str> = report.failed().map(|check| check.name.as_str()).collect();
    Err(Failure::Check(format!("failed: {}", names.join(", "))))
}
