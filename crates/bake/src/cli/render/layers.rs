//! `strandlight render --aov`: the picture and its layers in one file.

use serde_json::json;
use strandlight_bake::aov::{Layers, measured, specs};
use strandlight_formats::{Scene, counted};
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::files::Files;
use strandlight_scene::layers::{COVERAGE, Layer, data_layers};
use strandlight_scene::provenance::Recorder;
use strandlight_scene::{PreparedScene, SceneError};

use super::aov::Aov;
use super::args::Args;
use super::report::inputs;
use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, note, print_line, write_output};

/// Renders `scene` and its layers to the output.
pub fn run(args: &Args, scene: &Scene, size: [u32; 2], samples: u32) -> Outcome {
    let prepare = || {
        let files = Files::Disk;
        let assets = Assets::read(scene, &files, ModesToRead::OfScene)?;
        let mut prepared = PreparedScene::new(scene, &assets)?;
        prepared.move_hair(scene, &files, args.time)?;
        Ok((prepared, Recorder::new(&files).record(scene, args.time)?))
    };
    let (prepared, provenance) =
        prepare().map_err(|error: SceneError| Failure::input(error.in_file(&args.scene)))?;
    let mut splits = Vec::new();
    let mut data: Vec<&Layer> = Vec::new();
    for aov in &args.aov {
        match aov {
            Aov::Split(split) => splits.push(*split),
            Aov::AllData => data.extend(data_layers().map(|(layer, _)| layer)),
            Aov::Data(layer) => data.push(layer),
        }
    }
    // Each once, in the order of the table.
    let all = data_layers().map(|(layer, _)| layer);
    let data: Vec<&Layer> = all.filter(|layer| data.contains(layer)).collect();
    let specs = specs(&prepared, &splits, &args.light_group).map_err(Failure::input)?;
    let mut backend = args.on_backend(|open| {
        let mut backend = open(measured(&prepared, &specs))?;
        // Layers share what they are drawn into.
        backend.set_size(size)?;
        Ok(backend)
    })?;
    let name = backend.name();
    const STEPS: u64 = 1000;
    let progress = progress("rendering layers", STEPS);
    let observe = |done: f64| progress.reach((done * STEPS as f64) as u64);
    let wanted = (&*specs, &*data);
    let layers = Layers::draw(&mut *backend, wanted, size, samples, &observe);
    progress.finish();
    let layers = layers.map_err(Failure::input)?;
    match args.stats {
        true => {
            for (name, stats) in &layers.stats {
                note!("{name}: {stats}");
            }
        }
        false => note!("rendered on {name}"),
    }
    let provenance = provenance.drawn(layers.samples, &name);
    let of_light = layers.layers.iter().map(|layer| layer.name.clone());
    // Coverage is written though nobody asks for it.
    let all = data_layers().map(|(layer, _)| layer);
    let of_data = all.filter(|layer| **layer == COVERAGE || data.contains(layer));
    let of_data = of_data.map(|layer| layer.name.to_owned());
    let names: Vec<String> = of_light.chain(of_data).collect();
    let (samples, visibility) = (layers.samples, layers.visibility.clone());
    let bytes = layers
        .encode(&provenance)
        .map_err(|error| Failure::file(&args.output, error))?;
    write_output(&args.output, &bytes)?;
    if args.json {
        return print_line(json!({
            "file": args.output.display().to_string(),
            "size": size,
            "samples": samples,
            "backend": name,
            "time": args.time,
            "layers": names,
            "inputs": inputs(&provenance),
        }));
    }
    print_line(format_args!(
        "{}: {}x{}, {visibility}, {}, {} bytes",
        args.output.display(),
        size[0],
        size[1],
        counted(names.len(), "layer", "layers"),
        bytes.len()
    ))
}
