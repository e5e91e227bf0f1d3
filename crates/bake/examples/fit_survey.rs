//! Fits every map named on the command line and prints a table of the errors.
//!
//! `cargo run --release -p strandlight-bake --example fit_survey -- MAPS... [--count N]`

use std::path::Path;
use std::time::Instant;

use strandlight_bake::lights::{FitOptions, evaluate, fit};
use strandlight_images::Map;
use strandlight_scene::progress::Progress;

fn main() {
    let mut options = FitOptions::default();
    let mut paths = Vec::new();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--count" => options.count = args.next().and_then(|n| n.parse().ok()).unwrap_or(0),
            "--seed" => options.seed = args.next().and_then(|n| n.parse().ok()).unwrap_or(0),
            _ => paths.push(arg),
        }
    }
    println!("map, lights, fibre %, irradiance %, rel_l2 %, energy off %, fit s, all s, suns");
    let mut errors = Vec::new();
    for path in &paths {
        let path = Path::new(path);
        let start = Instant::now();
        let map = match Map::read(path) {
            Ok(map) => map,
            Err(error) => {
                println!("{error}");
                continue;
            }
        };
        let read = start.elapsed().as_secs_f64();
        let fitted = match fit(&map, options, &Progress::silent()) {
            Ok(fitted) => fitted,
            Err(error) => {
                println!("{}: {error}", path.display());
                continue;
            }
        };
        let fit_seconds = start.elapsed().as_secs_f64();
        let report = evaluate(&fitted.lights, &map);
        let all_seconds = start.elapsed().as_secs_f64();
        let energy_off = report
            .energy_ratio
            .iter()
            .fold(0.0f64, |m, r| m.max((r - 1.0).abs()));
        let stages: Vec<String> = fitted
            .seconds
            .iter()
            .map(|(name, s)| format!("{name} {s:.2}"))
            .collect();
        let suns: Vec<String> = fitted
            .lights
            .lights
            .iter()
            .filter(|light| light.lambda < 0.06)
            .map(|light| format!("{:.4}", light.lambda))
            .collect();
        println!(
            "{:28} {:3} {:6.2} {:6.2} {:6.1} {:7.3} {:5.2} {:5.2}  {} [{}]  read {read:.2} {} report {:.2}; scale {:.3?}",
            path.file_name().map_or("", |n| n.to_str().unwrap_or("")),
            fitted.lights.lights.len(),
            100.0 * report.fibre_error,
            100.0 * report.irradiance_error,
            100.0 * report.rel_l2,
            100.0 * energy_off,
            fit_seconds,
            all_seconds,
            fitted.suns,
            suns.join(" "),
            stages.join(" "),
            all_seconds - fit_seconds,
            fitted.energy_scale,
        );
        errors.push(report.fibre_error);
    }
    errors.sort_by(f64::total_cmp);
    if let Some(worst) = errors.last() {
        let n = errors.len();
        let median = 0.5 * (errors[(n - 1) / 2] + errors[n / 2]);
        println!(
            "{n} maps: fibre error median {:.2} %, worst {:.2} %",
            100.0 * median,
            100.0 * worst
        );
    }
}
