//! `strandlight render`: a scene file to a picture, its layers, or many pictures.

mod backend;
mod frames;
mod layers;

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};
use strandlight_bake::aov::Group;
use strandlight_formats::{Scattering, Scene};
use strandlight_images::picture::exr_file_of;
use strandlight_lab::transmittance::Method;
use strandlight_runtime::Session;
use strandlight_runtime::script::MAX_FRAMES;
use strandlight_runtime::session::parse_value;
use strandlight_scene::budget::check_frame;
use strandlight_scene::files::Files;
use strandlight_scene::provenance::{Provenance, Recorder};
use strandlight_scene::{Picture, PreparedScene, SceneError, Stats};

use super::{
    Failure, Outcome, check_outputs, is_stream, note, output_folder, print_line,
    transmittance_method, write_output,
};
use crate::cli::progress::{is_quiet, progress};
use backend::Choice;

/// Render a scene
///
/// PNG is tone-mapped 8-bit sRGB; OpenEXR is linear float, premultiplied alpha. With --script
/// or --turntable, the output is a folder that also receives timings.json.
#[derive(clap::Args)]
pub struct Args {
    /// Scene file (TOML), - for standard input
    #[arg(value_name = "SCENE.toml")]
    scene: PathBuf,
    /// Picture to write: .png or .exr, - for PNG on standard output; or a folder
    #[arg(short, long, value_name = "FILE|DIR")]
    output: PathBuf,
    /// Override a key of the scene file, such as hair.eta=1.6 or render.background=none; the flags
    /// below take precedence; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_key)]
    set: Vec<(String, Value)>,
    /// Render the frames of a list of edits and views (JSON); OpenEXR unless named .png
    #[arg(long, value_name = "EDITS.json", conflicts_with_all = ["turntable", "aov"])]
    script: Option<PathBuf>,
    /// Render N frames of a full turn about +Y: 0000.exr, 0001.exr, ...
    #[arg(long, value_name = "N", conflicts_with = "aov",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_FRAMES)))]
    turntable: Option<u32>,
    /// Layers to add to the picture, which must be .exr: parts of the light, and data of what is
    /// seen
    #[arg(long, value_parser = layers::aov(), value_delimiter = ',')]
    aov: Vec<layers::Aov>,
    /// Group lights into one layer of --aov lights, as NAME=0,3; repeatable
    #[arg(long, value_name = "NAME=LIGHTS", value_parser = layers::parse_group)]
    light_group: Vec<Group>,
    /// Width and height in pixels, each 1..=16384 and together at most 134217728 pixels
    /// [default: the scene's, 720x480]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Samples per pixel, 1..=65536 [default: the scene's, 64]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: Option<u32>,
    /// Renderer; auto uses the GPU if available
    #[arg(long, value_enum, default_value_t = Choice::Auto)]
    backend: Choice,
    /// Scattering terms to render: single, global, local or total [default: the scene's, total]
    #[arg(long, value_name = "TERMS", value_parser = parse_scattering)]
    scattering: Option<Scattering>,
    /// Approximate number of shadow maps for all lights, 0..=4096 [default: the scene's, 96]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=4096))]
    shadow_maps: Option<u32>,
    /// Transmittance method; all except sweep are CPU baselines
    #[arg(long, value_name = "METHOD", default_value = Method::Sweep.name(), value_parser = transmittance_method())]
    transmittance: Method,
    /// Animation time in seconds, 0..=1000000
    #[arg(long, value_name = "SECONDS", value_parser = parse_time, default_value_t = 0.0)]
    time: f64,
    /// Print which passes ran or were skipped for each picture, with bytes and milliseconds
    #[arg(long)]
    stats: bool,
    /// Print a JSON document about the picture instead of text
    #[arg(long)]
    json: bool,
}

/// Kind of the picture file.
#[derive(Clone, Copy)]
enum Format {
    Png,
    Exr,
}

/// A size on the command line, like 720x480.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let size = parsed.ok_or("a size is two numbers like 720x480")?;
    check_frame(size, 1).map_err(|error| error.to_string())?;
    Ok(size)
}

fn parse_key(text: &str) -> Result<(String, Value), String> {
    let (key, value) = text.split_once('=').ok_or("must be KEY=VALUE")?;
    Ok((key.trim().to_owned(), parse_value(value)))
}

/// A time on the command line, seconds.
pub fn parse_time(text: &str) -> Result<f64, String> {
    let parsed = text.parse().ok();
    let seconds = parsed.filter(|seconds| (0.0..=1e6).contains(seconds));
    seconds.ok_or_else(|| "a time is a number of seconds in 0..=1000000".to_owned())
}

fn parse_scattering(text: &str) -> Result<Scattering, String> {
    let found = Scattering::ALL.into_iter().find(|s| s.name() == text);
    found.ok_or_else(|| "single, global, local or total".to_owned())
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    args.check()?;
    if args.script.is_some() || args.turntable.is_some() {
        return frames::run(args);
    }
    let format = format_of(&args.output)?;
    check_outputs(&[&args.scene], &[&args.output])?;
    let scene = match args.set.is_empty() {
        true => Scene::read(&args.scene).map_err(Failure::input)?,
        false => {
            let mut session = Session::open(&args.scene).map_err(Failure::input)?;
            let keys = args.set.iter().cloned().collect();
            session.set(&keys).map_err(Failure::input)?;
            session.scene().clone()
        }
    };
    super::groom::note_doubts(&scene);
    let size = args.size.unwrap_or(scene.render.size);
    let samples = args.samples.unwrap_or(scene.render.samples);
    check_frame(size, samples).map_err(|error| Failure::file(&args.scene, error))?;
    let mut scene = scene;
    scene.render.shadow_maps = args.shadow_maps.unwrap_or(scene.render.shadow_maps);
    scene.render.scattering = args.scattering.unwrap_or(scene.render.scattering);
    (scene.render.size, scene.render.samples) = (size, samples);
    if !args.aov.is_empty() {
        if !matches!(format, Format::Exr) {
            return Err(Failure::file(
                &args.output,
                "layers need a name that ends in .exr",
            ));
        }
        return layers::run(args, &scene, size, samples);
    }
    let in_scene = |error: SceneError| Failure::input(error.in_scene(&args.scene));
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
    let mut provenance = provenance.drawn(samples, &stats.backend);
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
            .to_png_of(prepared.exposure, prepared.tone_map, &provenance)
            .map_err(Failure::input)?,
        Format::Exr => exr_file_of(&picture, &provenance)
            .map_err(|error| Failure::file(&args.output, error))?,
    };
    write_output(&args.output, &bytes)?;
    if args.json {
        let mut report = report(&args.output, &picture, samples, &stats);
        report["time"] = json!(args.time);
        report["inputs"] = inputs(&provenance);
        print_line(report)
    } else {
        print_line(format_args!(
            "{}: {}x{}, {samples} samples, {} bytes",
            args.output.display(),
            picture.width,
            picture.height,
            bytes.len()
        ))
    }
}

impl Args {
    /// Refuses flags that cannot go together and that the parser knows nothing of: none is ignored.
    fn check(&self) -> Outcome {
        let refused = |text: String| Err(Failure::Input(text));
        let of_pictures = [
            ("--light-group", !self.light_group.is_empty()),
            ("--script", self.script.is_some()),
            ("--turntable", self.turntable.is_some()),
            ("--aov", !self.aov.is_empty()),
        ];
        let mut of_pictures = of_pictures.into_iter().filter(|(_, is_given)| *is_given);
        let of_pictures = of_pictures.next().map(|(flag, _)| flag);
        let method = self.transmittance;
        if method != Method::Sweep {
            let name = method.name();
            if let Some(flag) = of_pictures {
                return refused(format!(
                    "--transmittance {name} is for single pictures; leave it out with {flag}"
                ));
            }
            if self.shadow_maps.is_some() {
                return refused(format!(
                    "--shadow-maps is for --transmittance sweep; --transmittance {name} has none"
                ));
            }
            if self.backend == Choice::Gpu {
                return refused(format!(
                    "--transmittance {name} runs on the CPU only; use --backend cpu, not --backend gpu"
                ));
            }
        }
        if self.stats && is_quiet() {
            let what = "--stats prints on stderr, which --quiet silences; leave one out";
            return refused(what.to_owned());
        }
        if !self.light_group.is_empty() && !self.aov.iter().any(layers::Aov::is_lights) {
            let many = [
                ("--script", self.script.is_some()),
                ("--turntable", self.turntable.is_some()),
            ];
            let many = many.into_iter().find(|(_, is_given)| *is_given);
            let without = many.map(|(flag, _)| format!("; leave it out with {flag}"));
            let without = without.unwrap_or_default();
            return refused(format!("--light-group needs --aov lights{without}"));
        }
        Ok(())
    }

    /// What the command line says as keys of the scene.
    fn keys(&self) -> Map<String, Value> {
        let mut keys: Map<String, Value> = self.set.iter().cloned().collect();
        let flags = [
            ("render.size", self.size.map(|size| json!(size))),
            ("render.samples", self.samples.map(|n| json!(n))),
            ("render.shadow_maps", self.shadow_maps.map(|n| json!(n))),
            (
                "render.scattering",
                self.scattering.map(|s| json!(s.name())),
            ),
        ];
        for (key, value) in flags {
            keys.extend(value.map(|value| (key.to_owned(), value)));
        }
        keys
    }
}

/// The kind that the name promises; a stream need not promise any.
fn format_of(path: &Path) -> Result<Format, Failure> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let format = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("png") => Format::Png,
        Some("exr") => Format::Exr,
        _ if is_stream(path) => Format::Png,
        _ => return Err(Failure::file(path, "the name must end in .png or .exr")),
    };
    Ok(format)
}

/// What a picture was made from, for `--json`.
fn inputs(provenance: &Provenance) -> Value {
    let entries = provenance.entries().iter();
    let entries = entries.map(|(name, value)| (name.clone(), json!(value)));
    Value::Object(entries.collect())
}

fn report(path: &Path, picture: &Picture, samples: u32, stats: &Stats) -> serde_json::Value {
    let stages: Vec<_> = stats
        .stages
        .iter()
        .map(|stage| {
            json!({
                "name": stage.name,
                "milliseconds": stage.milliseconds,
                "bytes": stage.bytes,
            })
        })
        .collect();
    let terms: Vec<_> = stats
        .terms
        .iter()
        .map(|term| {
            json!({
                "name": term.name,
                "products": term.products,
                "skipped": term.skipped,
            })
        })
        .collect();
    let [products, products_skipped] = stats.products();
    json!({
        "file": path.display().to_string(),
        "size": [picture.width, picture.height],
        "samples": samples,
        "backend": stats.backend,
        "strands": stats.strands,
        "points": stats.points,
        "segments": stats.segments,
        "lights": stats.lights,
        "sweeps": stats.sweeps,
        "shadow_maps": stats.shadow_maps,
        "voxels": stats.voxels,
        "scattering": stats.scattering,
        "terms": terms,
        "products": products,
        "products_skipped": products_skipped,
        "skipped": stats.skipped,
        "points_skipped": stats.points_skipped,
        "stages": stages,
    })
}
