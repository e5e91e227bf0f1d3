//! `strandlight bench edit`.

use std::path::PathBuf;
use std::sync::Arc;

use serde_json::json;
use strandlight_bake::tables::fresnel_of;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_lab::bench::edit::{BUDGET_MICROSECONDS, EditCost, edit_costs};
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::LobeTables;

use crate::cli::{Failure, Outcome, print_line};

/// Benchmark hair edits: what each parameter invalidates, bytes to upload, and time
///
/// Prints medians in microseconds on one thread, all three modes enabled; `all` recomputes
/// everything.
#[derive(clap::Args)]
pub struct Args {
    /// Baked tables [default: the bundled ones]
    #[arg(long, value_name = "F.tables")]
    tables: Option<PathBuf>,
    /// Number of edits per parameter
    #[arg(long, default_value_t = 101, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    repetitions: u64,
    /// Eccentricity of the edited hair; elliptic fibres cost more
    #[arg(long, default_value_t = 1.0, value_name = "A")]
    eccentricity: f64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let file = match &args.tables {
        Some(path) => TableFile::read(path).map_err(Failure::input)?,
        None => TableFile::from_bytes(DEFAULT_TABLES).map_err(Failure::input)?,
    };
    let fresnel = fresnel_of(&file).map_err(Failure::input)?;
    let lobes = LobeTables::from_file(&file, &Lobe::ALL).map_err(Failure::input)?;
    let hair = HairParams {
        eccentricity: args.eccentricity,
        ..HairParams::default()
    };
    let repetitions = args.repetitions as usize;
    let measure = || edit_costs(&Arc::new(lobes), fresnel, &hair, repetitions);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let costs = one_thread.map_err(Failure::input)?.install(measure);
    let costs = costs.map_err(Failure::input)?;
    if args.json {
        return print_line(json!({
            "repetitions": args.repetitions,
            "budget_microseconds": BUDGET_MICROSECONDS,
            "edits": costs.iter().map(EditCost::to_json).collect::<Vec<_>>(),
        }));
    }
    for cost in &costs {
        let budget = match cost.is_within_budget() {
            true => "",
            false => ", more than 1 ms",
        };
        print_line(format_args!(
            "{:14} {:8.1} us{budget}, {} bytes to upload",
            cost.parameter, cost.microseconds, cost.bytes
        ))?;
        for part in &cost.rebuilt {
            let where_to = match part.bytes {
                0 => String::new(),
                bytes => format!(", {bytes} bytes"),
            };
            print_line(format_args!(
                "  {:12} {:8.1} us{where_to}",
                part.name, part.microseconds
            ))?;
        }
    }
    Ok(())
}
