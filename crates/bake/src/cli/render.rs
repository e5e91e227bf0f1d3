//! `strandlight render`: a scene file to a picture, its layers, or many pictures.

mod aov;
mod args;
mod backend;
mod converge;
mod frames;
mod layers;
mod report;
mod until;

use std::path::{Path, PathBuf};

use serde_json::json;
use strandlight_images::picture::exr_file_of;
use strandlight_lab::transmittance::Method;
use strandlight_scene::budget::check_frame;
use strandlight_scene::files::Files;
use strandlight_scene::provenance::Recorder;
use strandlight_scene::{PreparedScene, SceneError};

use super::{Failure, Outcome, check_not_of_scene, check_outputs, note, print_line, write_output};
use crate::cli::overrides::scene_with;
use crate::cli::progress::progress;
use args::{Format, format_of};
use report::{inputs, report};

pub use args::{Args, time_help};

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    args.check()?;
    if args.script.is_some() || args.turntable.is_some() {
        return frames::run(args);
    }
    let format = format_of(&args.output)?;
    let read = [Some(&args.scene), args.map.as_ref()];
    let read: Vec<&Path> = read.into_iter().flatten().map(PathBuf::as_path).collect();
    check_outputs(&read, &[&args.output])?;
    let scene = scene_with(&args.scene, &args.set)?;
    check_not_of_scene(&scene, &[&args.output])?;
    super::groom::note_doubts(&scene);
    let size = args.size.unwrap_or(scene.render.size);
    let samples = args.samples.unwrap_or(scene.render.samples);
    check_frame(size, samples).map_err(|error| Failure::file(&args.scene, error))?;
    let mut scene = scene;
    scene.render.shadow_maps = args.shadow_maps.unwrap_or(scene.render.shadow_maps);
    scene.render.scattering = args.scattering.unwrap_or(scene.render.scattering);
    (scene.render.size, scene.render.samples) = (size, samples);
    if args.converge {
        return converge::run(args, &scene, format, size);
    }
    if !args.aov.is_empty() {
        if !matches!(format, Format::Exr) {
            return Err(Failure::file(
                &args.output,
                "layers need a name that ends in .exr",
            ));
        }
        return layers::run(args, &scene, size, samples);
    }
    let in_scene = |error: SceneError| Failure::input(error.in_file(&args.scene));
    let prepared = PreparedScene::load_at(&scene, args.time).map_err(in_scene)?;
    let provenance = Recorder::new(&Files::Disk).record(&scene, args.time);
    let provenance = provenance.map_err(in_scene)?;
    const STEPS: u64 = 1000;
    let progress = progress("rendering", STEPS);
    let drawn = args.on_backend(|open| {
        let mut backend = open(prepared.clone())?;
        backend.shade_view_only();
        backend.render(size, samples, &|done| {
            progress.reach((done * STEPS as f64) as u64);
        })
    });
    progress.finish();
    let (picture, stats) = drawn?;
    let mut provenance = provenance.drawn(stats.samples, &stats.backend);
    if args.transmittance != Method::Sweep {
        provenance = provenance.with("transmittance", args.transmittance.name());
    }
    if args.stats {
        note!("{stats}");
    } else {
        note!("{}", stats.summary());
    }
    let bytes = match format {
        Format::Png => picture
            .to_png_of(prepared.exposure, &prepared.display, &provenance)
            .map_err(Failure::input)?,
        Format::Exr => exr_file_of(&picture, &provenance)
            .map_err(|error| Failure::file(&args.output, error))?,
    };
    write_output(&args.output, &bytes)?;
    if args.json {
        let mut report = report(&args.output, &picture, &stats);
        report["time"] = json!(args.time);
        report["inputs"] = inputs(&provenance);
        print_line(report)
    } else {
        print_line(format_args!(
            "{}: {}x{}, {}, {} bytes",
            args.output.display(),
            picture.width,
            picture.height,
            stats.visibility(),
            bytes.len()
        ))
    }
}
