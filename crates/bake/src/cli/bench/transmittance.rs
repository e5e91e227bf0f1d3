//! `strandlight bench transmittance`.

use crate::cli::progress::progress;
use std::path::PathBuf;

use strandlight_formats::{Scene, counted};
use strandlight_lab::bench::{CLASS_NAMES, ShareErrors, TransmittanceOptions, run_transmittance};
use strandlight_lab::transmittance::Method;
use strandlight_scene::PreparedScene;

use crate::cli::{Failure, Outcome, print_line, transmittance_method};

/// Most points: some minutes by the fastest method.
const MAX_POINTS: u64 = 1_000_000;

/// Most rays of a light lobe.
const MAX_RAYS: i64 = 65_536;

/// Compare every transmittance method with ray-traced shadows: error and time
///
/// Evaluates random strand points under all lights of a scene. Reports bias and RMS error of the
/// transmittance T and of the forward-scattered fraction T_f.
#[derive(clap::Args)]
pub struct Args {
    /// Scene file (TOML)
    scene: PathBuf,
    #[arg(long, default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MAX_POINTS),
        help = format!("Number of random points, 1 to {MAX_POINTS}"))]
    points: u64,
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=MAX_RAYS),
        help = format!("Reference rays per light lobe, 1 to {MAX_RAYS}"))]
    rays: u32,
    /// Random seed
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[arg(long, value_delimiter = ',', value_parser = transmittance_method(),
        default_values = default_methods(), hide_default_value = true,
        help = format!("Methods to compare besides the sweep, comma-separated [default: {}]",
            default_methods().join(",")))]
    methods: Vec<Method>,
    /// Further sizes of the sweep's grid, in voxels along its longest side, 8 to 256,
    /// comma-separated
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(8..=256))]
    sides: Vec<u32>,
    /// Further numbers of sweep directions per light, 1 to 256, comma-separated
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=256))]
    directions: Vec<u32>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Names of the methods that are compared unless asked otherwise.
fn default_methods() -> Vec<&'static str> {
    let others = Method::ALL
        .into_iter()
        .filter(|&method| method != Method::Sweep);
    others.map(Method::name).collect()
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let scene = Scene::read(&args.scene).map_err(Failure::input)?;
    let scene =
        PreparedScene::load(&scene).map_err(|error| Failure::input(error.in_file(&args.scene)))?;
    let options = TransmittanceOptions {
        n_points: args.points as usize,
        n_rays: args.rays,
        seed: args.seed,
        methods: args.methods.clone(),
        sides: args.sides.clone(),
        directions: args.directions.clone(),
    };
    let found = run_transmittance(&scene, &options, progress);
    if args.json {
        return print_line(found.to_json());
    }
    print_line(format_args!(
        "{}, {}; truth by {} a lobe: {:.0} s, its noise in T {:.3}",
        counted(options.n_points, "point", "points"),
        counted(scene.lights.len(), "light", "lights"),
        counted(options.n_rays, "ray", "rays"),
        found.truth_seconds,
        found.noise
    ))?;
    print_line(format_args!(
        "{:20} {:>9} {:>6} {:>7} {:>7} {:>6} {:>7} {:>7} {:>6} {:>7} {:>8} {:>10}",
        "",
        "lambda",
        "lights",
        "T",
        "bias",
        "RMS",
        "T_f",
        "bias",
        "RMS",
        "s",
        "s/light",
        "us/look-up"
    ))?;
    for row in &found.rows {
        for (ix, (name, class)) in CLASS_NAMES.iter().zip(&row.classes).enumerate() {
            if class.n_lights == 0 {
                continue;
            }
            let shown = |errors: &ShareErrors| {
                format!(
                    "{:7.3} {:+7.4} {:6.4}",
                    errors.mean, errors.bias, errors.rms
                )
            };
            let (title, times) = match ix {
                3 => (
                    row.name.as_str(),
                    format!(
                        " {:7.2} {:8.3} {:10.2}",
                        row.geometry_seconds, row.light_seconds, row.look_up_microseconds
                    ),
                ),
                _ => ("", String::new()),
            };
            print_line(format_args!(
                "{title:20} {name:>9} {:6} {} {}{times}",
                class.n_lights,
                shown(&class.unblocked),
                shown(&class.forward)
            ))?;
        }
    }
    Ok(())
}
