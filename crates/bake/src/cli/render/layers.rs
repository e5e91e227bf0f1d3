//! `strandlight render --aov`: the picture and its layers in one file.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde_json::json;
use strandlight_bake::aov::{Group, Layers, Split, measured, specs};
use strandlight_cpu::{DATA_LAYERS, DataLayer};
use strandlight_formats::Scene;
use strandlight_scene::assets::{Assets, ModesToRead};
use strandlight_scene::files::Files;
use strandlight_scene::provenance::Recorder;
use strandlight_scene::{PreparedScene, SceneError};

use super::{Args, Failure, Outcome, inputs, note, print_line, write_output};
use crate::cli::progress::progress;

/// What layers are wanted.
#[derive(Clone, Copy, Debug)]
pub enum Aov {
    /// Parts of the light.
    Split(Split),
    /// Data, some of [`DATA_LAYERS`].
    Data(&'static [DataLayer]),
}

impl Aov {
    /// Names, help and what they stand for.
    fn all() -> impl Iterator<Item = (&'static str, &'static str, Aov)> {
        let of_light = [
            ("terms", "single, global, local", Split::Terms),
            (
                "modes",
                "single.R, single.TT, single.TRT, global.R, ..., and local",
                Split::Modes,
            ),
            (
                "lights",
                "light.000, ...: each enabled light, or light.NAME for groups",
                Split::Lights,
            ),
        ];
        let of_light = of_light.map(|(name, help, split)| (name, help, Aov::Split(split)));
        let data = ("data", "all of the following", Aov::Data(&DATA_LAYERS));
        let one = |layer| Aov::Data(std::slice::from_ref(layer));
        let by_name = DATA_LAYERS.iter();
        let by_name = by_name.map(move |layer| (layer.name, layer.help, one(layer)));
        of_light.into_iter().chain([data]).chain(by_name)
    }

    /// Is it the layers of lights?
    pub fn is_lights(&self) -> bool {
        matches!(self, Aov::Split(Split::Lights))
    }
}

/// Parses a value of `--aov`.
pub fn aov() -> impl TypedValueParser<Value = Aov> {
    let values = Aov::all().map(|(name, help, _)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).try_map(|name| {
        let found = Aov::all().find(|(known, _, _)| *known == name);
        found.map(|(_, _, aov)| aov).ok_or("unknown")
    })
}

/// A group of lights on the command line, like key=0,3.
pub fn parse_group(text: &str) -> Result<Group, String> {
    let parsed = text.split_once('=').and_then(|(name, lights)| {
        let lights = lights.split(',').map(|ix| ix.trim().parse().ok());
        Some((name, lights.collect::<Option<Vec<usize>>>()?))
    });
    let (name, lights) = parsed.ok_or("a group is a name and lights like key=0,3")?;
    let fine = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if name.is_empty() || name.len() > 64 || !name.chars().all(fine) || name == "rest" {
        return Err("a group's name is letters, digits, - and _, and not rest".to_owned());
    }
    Ok(Group {
        name: name.to_owned(),
        lights,
    })
}

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
        prepare().map_err(|error: SceneError| Failure::input(error.in_scene(&args.scene)))?;
    let mut splits = Vec::new();
    let mut data: Vec<&DataLayer> = Vec::new();
    for aov in &args.aov {
        match aov {
            Aov::Split(split) => splits.push(*split),
            Aov::Data(layers) => data.extend(*layers),
        }
    }
    // Each once, in the order of the table.
    let is_wanted = |layer: &&DataLayer| data.iter().any(|wanted| wanted.name == layer.name);
    let data: Vec<&DataLayer> = DATA_LAYERS.iter().filter(is_wanted).collect();
    let specs = specs(&prepared, &splits, &args.light_group).map_err(Failure::input)?;
    let mut backend = args.on_backend(|open| {
        let mut backend = open(measured(&prepared))?;
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
    let provenance = provenance.drawn(samples, &name);
    let of_light = layers.layers.iter().map(|(name, _)| name.clone());
    let of_data = data.iter().map(|layer| layer.name.to_owned());
    let names: Vec<String> = of_light.chain(of_data).collect();
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
        "{}: {}x{}, {samples} samples, {} layers, {} bytes",
        args.output.display(),
        size[0],
        size[1],
        names.len(),
        bytes.len()
    ))
}
