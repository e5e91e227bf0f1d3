//! `strandlight scenes`: the paper's scenes from generated hair and maps.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandlight_bake::grooms::generate;
use strandlight_bake::lights::{self, FitOptions, STEPS, evaluate, fit};
use strandlight_bake::maps::Sky;
use strandlight_bake::scenes::{PaperScene, SCENES};
use strandlight_formats::{BakedFile, LightSet};
use strandlight_images::Map;
use strandlight_scene::progress::timed;

use super::{Failure, Outcome, check_outputs, note, output_folder, print_line, write_output};
use crate::cli::progress::progress;

/// Height of the generated maps in pixels.
const MAP_HEIGHT: usize = 256;

/// Generate the scenes of Xu 2011 at their published sizes, and three for accuracy
///
/// animation, straight, natural, bob-cut, dark, ponytail have the fibres, points and lights of
/// the paper's Table 2; dark-sun, brown-studio, blond-soft are the accuracy benchmarks. Writes
/// NAME.toml, NAME.groom and NAME.lights for each, ready for `strandlight render`.
#[derive(clap::Args)]
pub struct Args {
    /// Scenes to generate [default: all nine]
    #[arg(long, value_name = "NAME", num_args = 1.., value_parser = parse_name)]
    only: Vec<&'static PaperScene>,
    /// Folder for the files; created if missing
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Environment map of all scenes [default: the generated sun.exr, studio.exr, soft.exr]
    #[arg(long)]
    map: Option<PathBuf>,
    /// Factor on the number of strands, 0.0001..=1; fewer strands are thicker
    #[arg(long, default_value_t = 1.0, value_parser = parse_scale)]
    scale: f64,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

fn parse_name(text: &str) -> Result<&'static PaperScene, String> {
    PaperScene::from_name(text).ok_or_else(|| {
        let names: Vec<&str> = SCENES.iter().map(|scene| scene.name).collect();
        format!("unknown scene '{text}' (expected {})", names.join(", "))
    })
}

fn parse_scale(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(scale) if (1e-4..=1.0).contains(&scale) => Ok(scale),
        _ => Err("not a number from 0.0001 to 1".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let mut documents = Vec::new();
    write(args, &mut |document| match args.json {
        true => {
            documents.push(document);
            Ok(())
        }
        false => print_line(in_words(&document)),
    })?;
    if args.json {
        return print_line(format_args!("{:#}", json!({ "scenes": documents })));
    }
    note!(
        "next: strandlight render {}/NAME.toml -o NAME.png",
        args.output.display()
    );
    Ok(())
}

/// Scene files in `folder` of the scenes of Table 2; those that are not there are generated, each of
/// which is said on stderr.
pub fn table_2(folder: &Path) -> Result<Vec<(&'static PaperScene, PathBuf)>, Failure> {
    let file = |scene: &PaperScene| scene_paths(scene, folder)[0].clone();
    let missing = PaperScene::of_table_2().filter(|scene| !file(scene).exists());
    let args = Args {
        only: missing.collect(),
        output: folder.to_owned(),
        map: None,
        scale: 1.0,
        json: false,
    };
    if !args.only.is_empty() {
        write(&args, &mut |document| {
            note!("{}", in_words(&document));
            Ok(())
        })?;
    }
    let scenes = PaperScene::of_table_2();
    Ok(scenes.map(|scene| (scene, file(scene))).collect())
}

/// What was written, as a line.
fn in_words(document: &Value) -> String {
    let text = |key: &str| document[key].as_str().unwrap_or_default().to_owned();
    let number = |key: &str| document[key].as_f64().unwrap_or(f64::NAN);
    format!(
        "{}: {} strands, {} points, {} lights (fibre error {:.2} %), {:.1} s",
        text("scene"),
        document["strands"],
        document["points"],
        document["lights"],
        100.0 * number("fibre_error"),
        number("seconds"),
    )
}

/// Writes the scenes; `written` receives what `--json` says of each.
fn write(args: &Args, written: &mut dyn FnMut(Value) -> Outcome) -> Outcome {
    // In the order of the table, each once.
    let scenes: Vec<&PaperScene> = SCENES
        .iter()
        .filter(|scene| args.only.is_empty() || args.only.contains(scene))
        .collect();
    // Read before anything is written.
    let own = args.map.as_deref().map(Map::read).transpose();
    let own = own.map_err(Failure::input)?;
    let folder = &args.output;
    let _new = output_folder(folder)?;
    let skies: Vec<Sky> = Sky::ALL
        .into_iter()
        .filter(|&sky| own.is_none() && scenes.iter().any(|scene| scene.sky == sky))
        .collect();
    let outputs: Vec<PathBuf> = skies
        .iter()
        .map(|&sky| map_path(sky, folder))
        .chain(scenes.iter().flat_map(|scene| scene_paths(scene, folder)))
        .collect();
    let outputs: Vec<&Path> = outputs.iter().map(PathBuf::as_path).collect();
    let inputs: Vec<&Path> = args.map.as_deref().into_iter().collect();
    check_outputs(&inputs, &outputs)?;

    let mut maps = Vec::new();
    for sky in skies {
        maps.push((sky, write_map(sky, folder)?));
    }
    for scene in scenes {
        let drawn = maps.iter().find(|(sky, _)| *sky == scene.sky);
        let Some(map) = own.as_ref().or(drawn.map(|(_, map)| map)) else {
            return Err(Failure::Input(format!("{} has no map", scene.name)));
        };
        written(write_scene(scene, map, args)?)?;
    }
    Ok(())
}

/// File of a generated map.
fn map_path(sky: Sky, folder: &Path) -> PathBuf {
    folder.join(sky.name()).with_extension("exr")
}

/// The three files of a scene: itself, its groom and its lights.
fn scene_paths(scene: &PaperScene, folder: &Path) -> [PathBuf; 3] {
    ["toml", "groom", "lights"].map(|extension| folder.join(scene.name).with_extension(extension))
}

/// Writes a generated map and reads it as any other.
fn write_map(sky: Sky, folder: &Path) -> Result<Map, Failure> {
    let path = map_path(sky, folder);
    let bytes = sky
        .exr_file(MAP_HEIGHT)
        .map_err(|error| Failure::file(&path, error))?;
    write_output(&path, &bytes)?;
    Map::read(&path).map_err(Failure::input)
}

/// Writes the three files of a scene; answers what `--json` says of it.
fn write_scene(scene: &PaperScene, map: &Map, args: &Args) -> Result<Value, Failure> {
    let [toml, groom_path, lights_path] = scene_paths(scene, &args.output);
    let (written, seconds) = timed(|| {
        let spec = scene.groom(args.scale);
        let progress = progress(scene.name, u64::from(spec.strands));
        let groom = generate(&spec, &progress).map_err(Failure::input)?;
        let bytes = groom
            .to_bytes()
            .map_err(|error| Failure::file(&groom_path, error))?;
        write_output(&groom_path, &bytes)?;
        let set = light_set(scene, map)?;
        let bytes = set
            .to_bytes()
            .map_err(|error| Failure::file(&lights_path, error))?;
        write_output(&lights_path, &bytes)?;
        write_output(&toml, scene.toml().as_bytes())?;
        Ok((groom.n_strands(), groom.points.len(), set))
    });
    let (strands, points, set) = written?;
    let report = set.info.report.as_ref();
    Ok(json!({
        "name": scene.name,
        "source": scene.source,
        "scene": toml.display().to_string(),
        "groom": groom_path.display().to_string(),
        "lights_file": lights_path.display().to_string(),
        "map": match &args.map {
            Some(map) => map.display().to_string(),
            None => map_path(scene.sky, &args.output).display().to_string(),
        },
        "strands": strands,
        "points": points,
        "lights": set.lights.len(),
        "preset": scene.preset,
        "fibre_error": report.map(|report| report.fibre_error),
        "energy_ratio": report.map(|report| report.energy_ratio),
        "seconds": seconds,
    }))
}

fn light_set(scene: &PaperScene, map: &Map) -> Result<LightSet, Failure> {
    let options = FitOptions {
        count: scene.lights,
        seed: 0,
    };
    let progress = progress("fitting lights", STEPS);
    let fitted = fit(map, options, &progress);
    progress.finish();
    let fitted = fitted.map_err(|error| Failure::Input(format!("{}: {error}", scene.name)))?;
    let report = evaluate(&fitted.lights, map);
    Ok(lights::light_set(options, map, &fitted, Some(report)))
}
