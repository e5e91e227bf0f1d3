//! All scattering: the fast picture, `render --converge` and plain paths.

use std::path::{Path, PathBuf};

use serde_json::json;
use strandlight_formats::{Scene, counted};
use strandlight_images::Map;
use strandlight_lab::bench::converge::ConvergeError;
use strandlight_lab::bench::peers::total::{Options, TotalPeers, n_steps, total_peers};
use strandlight_scene::RenderError;

use super::super::converge::print_goal;
use super::lines::{head, line};
use crate::cli::bench::scenes;
use crate::cli::light::map_of;
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, print_line};

/// Measures all scattering in the scenes of these files.
pub fn run(paths: &[PathBuf], scenes: &[Scene], options: &Options, json: bool) -> Outcome {
    let named = paths.iter().map(PathBuf::as_path).zip(scenes);
    let maps = named.map(|named| map_of(None, named));
    let maps = maps.collect::<Result<Vec<Option<Map>>, Failure>>()?;
    let scenes = scenes.iter().zip(&maps);
    let measured = paths.iter().zip(scenes).map(|(path, (scene, map))| {
        let progress = progress("pictures", n_steps(options));
        let pixels = map.as_ref().map(|map| (map.grid(), map.pixels()));
        let found = total_peers(scene, pixels, options, &|| progress.advance(1));
        progress.finish();
        let found = found.map_err(|error| match error {
            ConvergeError::Render(RenderError::Scene(error)) => Failure::input(error.in_file(path)),
            error => Failure::file(path, error),
        })?;
        if !json {
            print_total(path, map.is_some(), &found)?;
        }
        let mut document = found.to_json();
        document["scene"] = json!(path.display().to_string());
        document["map"] = json!(map.as_ref().map(|map| &map.source().hash));
        Ok(document)
    });
    let (documents, ended) = scenes::until_failure(measured);
    if json && !documents.is_empty() {
        print_line(json!({
            "truth_samples": options.converge.truth_samples,
            "repetitions": options.repetitions,
            "seeds": options.converge.seeds,
            "seed": options.converge.seed,
            "scenes": documents,
        }))?;
    }
    ended
}

fn print_total(path: &Path, has_map: bool, found: &TotalPeers) -> Outcome {
    let measured = &found.measured;
    let [strands, points, lights] = measured.counts;
    let [width, height] = measured.size;
    print_line(format_args!(
        "{}: {}, {}, {}{}, {width}x{height}, total scattering, {}",
        path.display(),
        counted(strands, "strand", "strands"),
        counted(points, "point", "points"),
        counted(lights, "light", "lights"),
        if has_map { ", paths by the map" } else { "" },
        counted(measured.seeds, "seed", "seeds"),
    ))?;
    head()?;
    let (error, seconds) = (measured.fast_error, measured.fast_core_seconds);
    line("ours, from the loaded scene", None, error, seconds)?;
    let traced = measured.traced_core_seconds;
    line("what paths read of the scene", None, None, traced)?;
    let ways = [
        ("render --converge, all included", found.converged()),
        ("paths, what they read included", found.paths()),
    ];
    for (name, points) in ways {
        for point in points {
            let samples = Some(f64::from(point.samples));
            line(name, samples, point.relative_rmse, point.core_seconds)?;
        }
    }
    for goal in found.goals() {
        let error = format!("{:.0} %", 100.0 * goal.relative_rmse);
        print_goal(&goal, &error, "converged")?;
    }
    if let Some(ours) = found.to_ours() {
        let error = format!("{:.2} %, the error of ours", 100.0 * ours.relative_rmse);
        print_goal(&ours, &error, "ours")?;
    }
    let falls = measured.slopes()[0].map_or(String::new(), |exponent| {
        format!("paths fall as n^{exponent:.2}; ")
    });
    print_line(format_args!(
        "  {falls}noise of the truth {:.2} %, taken out",
        100.0 * measured.truth_noise
    ))
}
