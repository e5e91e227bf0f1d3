//! `strandlight bench`: run time against error.

mod edit;
mod frames;
mod multiple;
mod plots;
mod single;
mod transmittance;

use strandlight_bake::tables::bake_c_and_h;
use strandlight_lab::bench::MethodTables;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::progress::Progress;

use super::{Failure, Outcome};

/// Benchmark speed against accuracy
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(clap::Subcommand)]
enum What {
    Edit(edit::Args),
    Frames(frames::Args),
    Single(single::Args),
    Multiple(multiple::Args),
    Transmittance(transmittance::Args),
    Plots(plots::Args),
}

/// The tables of all methods; those of the paper are baked now, some 0.3 s of two cores.
fn method_tables() -> Result<MethodTables, Failure> {
    let schlick = bake_c_and_h(Fresnel::Schlick, &Progress::silent());
    MethodTables::new(&schlick).map_err(Failure::input)
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    match &args.what {
        What::Edit(args) => edit::run(args),
        What::Frames(args) => frames::run(args),
        What::Single(args) => single::run(args),
        What::Multiple(args) => multiple::run(args),
        What::Transmittance(args) => transmittance::run(args),
        What::Plots(args) => plots::run(args),
    }
}
