//! What multiple scattering in closed form costs beside single scattering, and what
//! `bench multiple` does not measure of its errors.
//!
//! ```sh
//! cargo run -p strandlight-bake --example multiple_cost -- errors wide 1000
//! cargo build -p strandlight-bake --example multiple_cost
//! for n in 20 40; do
//!   valgrind --tool=callgrind --callgrind-out-file=/dev/null \
//!     target/debug/examples/multiple_cost cost global $n 2>&1 | grep Collected
//! done
//! ```
//!
//! Errors are relative RMSE over configurations (sets of `bench single`), sigma_f log-uniform in
//! 0.05..2 with local scattering, lambda that of the set with direct local scattering. "Eq 31" is
//! the exact integral with Delta_b and sigma_b averaged over theta_j +- sigma_f, as Xu's prefix
//! sums have it, and A_b in the middle: no number of nodes gets below it.
//!
//! Costs are of `single`, `global`, `local`, `direct`: each repetition is 8 fibres x 256 lights and
//! views = 2048 evaluations; the instructions of one are the difference of two counts over 20 x
//! 2048.

use std::hint::black_box;
use std::process::ExitCode;
use std::sync::Arc;

use rayon::prelude::*;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_lab::bench::{Configuration, Set};
use strandlight_scattering::closed_form::{
    direct_local_scattering, global_scattering, local_scattering, pack_averages, single_scattering,
};
use strandlight_scattering::dual_scattering::{Average, AverageTable, Backscatter};
use strandlight_scattering::exact::{Forward, direct_local, local};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::random::SplitMix64;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::{HairMaterial, LobeTables};
use strandlight_scene::tables::ShadingTables;

const FRESNEL: Fresnel = Fresnel::Dielectric;

type Failed = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("multiple_cost: {error}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, which, count] = &arguments[..] else {
        return Err("usage: multiple_cost errors SET N | cost NAME REPETITIONS".into());
    };
    let count: u64 = count.parse()?;
    match what.as_str() {
        "errors" => errors(which, count),
        "cost" => cost(which, count),
        _ => Err(format!("there is no '{what}'").into()),
    }
}

/// The bundled tables.
struct Bundled {
    tables: ShadingTables,
    lobes: Arc<LobeTables>,
}

impl Bundled {
    fn new() -> Result<Bundled, Failed> {
        let file = TableFile::from_bytes(DEFAULT_TABLES)?;
        Ok(Bundled {
            tables: ShadingTables::from_file(&file)?,
            lobes: Arc::new(LobeTables::from_file(&file, &Lobe::ALL)?),
        })
    }

    fn textures(&self, hair: &HairParams) -> Result<HairMaterial, Failed> {
        let lobes = Arc::clone(&self.lobes);
        let mut textures = HairMaterial::new(lobes, FRESNEL, hair, &Lobe::ALL, 4)?;
        textures.enable_multiple(true);
        Ok(textures)
    }
}

/// Configuration `ix` of a set, and sigma_f.
fn draw(set: &str, ix: u64) -> Result<(Configuration, f64), Failed> {
    let sigma_f = SplitMix64::of_item(5, ix).log_uniform(0.05, 2.0);
    let drawn = match set {
        "accuracy" => Set::Accuracy.draw(1, ix),
        "wide" => Set::Wide.draw(1, ix),
        _ => return Err(format!("there is no set '{set}'").into()),
    };
    Ok((drawn, sigma_f))
}

/// Sums of squares of error and value.
#[derive(Clone, Copy, Default)]
struct Squares([f64; 2]);

impl Squares {
    fn of(found: [f32; 3], exact: [f64; 3]) -> Squares {
        let mut squares = [0.0; 2];
        for (found, exact) in found.iter().zip(exact) {
            squares[0] += (f64::from(*found) - exact).powi(2);
            squares[1] += exact * exact;
        }
        Squares(squares)
    }
}

/// What is measured.
const NAMES: [&str; 3] = ["local", "local by Eq 31", "direct local"];

fn errors(set: &str, count: u64) -> Result<(), Failed> {
    let all = (0..count)
        .into_par_iter()
        .map(|ix| Ok(one(draw(set, ix)?)))
        .collect::<Result<Vec<_>, Failed>>()?;
    for (ix, name) in NAMES.iter().enumerate() {
        let sum = |k: usize| -> f64 { all.iter().map(|squares| squares[ix].0[k]).sum() };
        println!("{name}: {:.3} %", 100.0 * (sum(0) / sum(1)).sqrt());
    }
    Ok(())
}

/// Averages of the table at `theta`.
fn back(table: &AverageTable, theta: f64) -> Backscatter {
    let [attenuation, shift, width] = [Average::Ab, Average::DeltaB, Average::SigmaB]
        .map(|average| table.get(average, theta as f32).map(f64::from));
    Backscatter {
        attenuation,
        shift,
        width_2: width.map(|width| width * width),
        model: table.model,
    }
}

/// Eq 31: means over `theta` +- `half`.
fn back_over(table: &AverageTable, theta: f64, half: f64) -> Backscatter {
    let mut mean = back(table, theta);
    (mean.shift, mean.width_2) = ([0.0; 3], [0.0; 3]);
    let n = 64;
    let mut width = [0.0; 3];
    for ix in 0..n {
        let at = theta + half * (2.0 * (f64::from(ix) + 0.5) / f64::from(n) - 1.0);
        let here = back(table, at);
        for (c, width) in width.iter_mut().enumerate() {
            mean.shift[c] += here.shift[c] / f64::from(n);
            *width += here.width_2[c].sqrt() / f64::from(n);
        }
    }
    mean.width_2 = width.map(|width| width * width);
    mean
}

fn one((drawn, sigma_f): (Configuration, f64)) -> [Squares; 3] {
    let table = AverageTable::new(&drawn.hair, FRESNEL);
    let averages = pack_averages(&table);
    let (light, view) = drawn.in_frame();
    let forward = Forward {
        theta: drawn.light.theta,
        phi: drawn.light.phi,
        sigma_f,
    };
    let exact = local(forward, drawn.view, |theta| back(&table, theta));
    let found = local_scattering(&light.direction, &view, sigma_f as f32, &averages[..]);
    let middle = 0.5 * (forward.theta - drawn.view.theta);
    let mean = back_over(&table, middle, 0.5 * sigma_f);
    let by_means = local(forward, drawn.view, |_| mean).map(|value| value as f32);
    let exact_direct = direct_local(drawn.light, drawn.view, |theta| back(&table, theta));
    let found_direct = direct_local_scattering(&light, &view, &averages[..]);
    [
        Squares::of(found, exact),
        Squares::of(by_means, exact),
        Squares::of(found_direct, exact_direct),
    ]
}

fn cost(name: &str, repetitions: u64) -> Result<(), Failed> {
    let bundled = Bundled::new()?;
    let textures = (0..8)
        .map(|ix| bundled.textures(&draw("wide", ix)?.0.hair))
        .collect::<Result<Vec<_>, Failed>>()?;
    let points = (0..256)
        .map(|ix| {
            let (drawn, sigma_f) = draw("wide", 100 + ix)?;
            let (light, view) = drawn.in_frame();
            Ok((light, view, sigma_f as f32))
        })
        .collect::<Result<Vec<_>, Failed>>()?;
    for _ in 0..repetitions {
        for textures in &textures {
            let shading = textures.optics().shading(bundled.tables.view());
            for (light, view, sigma_f) in black_box(&points) {
                let (at, averages) = (&light.direction, textures.averages());
                black_box(match name {
                    "single" => single_scattering(light, view, &shading),
                    "global" => global_scattering(at, view, *sigma_f, &shading),
                    "local" => local_scattering(at, view, *sigma_f, averages),
                    "direct" => direct_local_scattering(light, view, averages),
                    _ => return Err(format!("there is no '{name}'").into()),
                });
            }
        }
    }
    Ok(())
}
