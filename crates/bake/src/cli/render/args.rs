//! The flags of `strandlight render`.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::{Map, Value, json};
use strandlight_bake::aov::Group;
use strandlight_formats::{RenderSection, Scattering};
use strandlight_lab::transmittance::Method;
use strandlight_runtime::BackendChoice;
use strandlight_runtime::options::{parse_key, parse_size, parse_time};
use strandlight_runtime::script::MAX_SCRIPT_FRAMES;
use strandlight_scene::budget::{MAX_PIXELS, MAX_SAMPLES, MAX_SECONDS, MAX_SIDE};
use strandlight_scene::shadow_maps::MAX_SHADOW_MAPS;

use super::aov::{Aov, aov, parse_group};
use super::until::{Until, parse_until};
use crate::cli::progress::is_quiet;
use crate::cli::shard::ShardArg;
use crate::cli::{Failure, Outcome, is_stream, transmittance_method};

/// Render a scene
///
/// PNG is tone-mapped 8-bit sRGB; OpenEXR is linear float, premultiplied alpha. With --script
/// or --turntable, the output is a folder that also receives timings.json. With --shard I/N, every
/// Nth frame is rendered into it, with the bytes of a whole run on the same backend, and
/// timings-I-of-N.json beside it.
#[derive(clap::Args)]
pub struct Args {
    /// Scene file (TOML), - for standard input
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Picture to write: .png or .exr, - for PNG on standard output; or a folder
    #[arg(short, long, value_name = "FILE|DIR")]
    pub output: PathBuf,
    /// Override a key of the scene file, such as hair.eta=1.6 or render.background=none; the flags
    /// below take precedence; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_key)]
    pub set: Vec<(String, Value)>,
    /// Render the frames of a list of edits and views (JSON); OpenEXR unless named .png
    #[arg(long, value_name = "EDITS.json", conflicts_with_all = ["turntable", "aov"])]
    pub script: Option<PathBuf>,
    /// Render N frames of a full turn about +Y: 0000.exr, 0001.exr, ...
    #[arg(long, value_name = "N", conflicts_with = "aov",
        value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SCRIPT_FRAMES)))]
    pub turntable: Option<u32>,
    #[command(flatten)]
    pub shard: ShardArg,
    /// Layers to add to the picture, which must be .exr: parts of the light, and data of what is
    /// seen
    #[arg(long, value_parser = aov(), value_delimiter = ',')]
    pub aov: Vec<Aov>,
    /// Group lights into one layer of --aov lights, as NAME=0,3; repeatable
    #[arg(long, value_name = "NAME=LIGHTS", value_parser = parse_group)]
    pub light_group: Vec<Group>,
    /// Go on from the picture to path-traced truth, with errors as layers of an .exr
    #[arg(long, conflicts_with_all = ["script", "turntable", "aov", "transmittance"])]
    pub converge: bool,
    /// End at the first of these: an expected error of means over 4x4 pixels (1%), a time (30s, 5m,
    /// 2h), samples per pixel (64)
    #[arg(long, value_name = "GOAL", value_parser = parse_until, value_delimiter = ',',
        default_value = "3%", requires = "converge")]
    pub until: Vec<Until>,
    /// Converge to the light of this OpenEXR or Radiance map, rotated and scaled as in the scene,
    /// rather than of the light set [default: the scene's lights.map; the light set where it has none,
    /// or with lights.map=null in --set]
    #[arg(long, value_name = "MAP", requires = "converge")]
    pub map: Option<PathBuf>,
    /// Random seed of what is traced
    #[arg(long, value_name = "S", default_value_t = 0, requires = "converge")]
    pub seed: u64,
    #[arg(long, value_name = "WxH", value_parser = parse_size, help = size_help())]
    pub size: Option<[u32; 2]>,
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MAX_SAMPLES.into()),
        help = format!("Samples per pixel, 1..={MAX_SAMPLES} [default: no samples: a visibility list, free of noise; the \
            scene's number, {}, in pictures of more than 33 million pixels and where a GPU has no room for the list]",
            RenderSection::default().samples))]
    pub samples: Option<u32>,
    /// Renderer; auto uses the GPU if there is one, and the CPU rather than a software adapter
    #[arg(long, value_enum, default_value_t = Choice::Auto)]
    pub backend: Choice,
    /// Scattering terms to render: single, global, local or total [default: the scene's, total]
    #[arg(long, value_name = "TERMS", value_parser = parse_scattering)]
    pub scattering: Option<Scattering>,
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=MAX_SHADOW_MAPS.into()),
        help = shadow_maps_help())]
    pub shadow_maps: Option<u32>,
    /// Transmittance method; all except sweep are CPU baselines
    #[arg(long, value_name = "METHOD", default_value = Method::Sweep.name(), value_parser = transmittance_method())]
    pub transmittance: Method,
    #[arg(long, value_name = "SECONDS", value_parser = parse_time, default_value_t = 0.0, help = time_help())]
    pub time: f64,
    /// Print which passes ran or were skipped for each picture, with bytes and milliseconds
    #[arg(long)]
    pub stats: bool,
    /// Print a JSON document about the picture instead of text
    #[arg(long)]
    pub json: bool,
}

/// Where to render.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Choice {
    Auto,
    Gpu,
    Cpu,
}

impl From<Choice> for BackendChoice {
    fn from(choice: Choice) -> BackendChoice {
        match choice {
            Choice::Auto => BackendChoice::Auto,
            Choice::Gpu => BackendChoice::Gpu,
            Choice::Cpu => BackendChoice::Cpu,
        }
    }
}

/// Kind of the picture file.
#[derive(Clone, Copy)]
pub enum Format {
    Png,
    Exr,
}

fn size_help() -> String {
    let [width, height] = RenderSection::default().size;
    format!(
        "Width and height in pixels, each 1..={MAX_SIDE} and together at most {MAX_PIXELS} pixels \
         [default: the scene's, {width}x{height}]"
    )
}

fn shadow_maps_help() -> String {
    format!(
        "Approximate number of shadow maps for all lights, 0..={MAX_SHADOW_MAPS} [default: the \
         scene's, {}]",
        RenderSection::default().shadow_maps
    )
}

/// Help of `--time`.
pub fn time_help() -> String {
    format!("Animation time in seconds, 0..={MAX_SECONDS}")
}

fn parse_scattering(text: &str) -> Result<Scattering, String> {
    let found = Scattering::ALL.into_iter().find(|s| s.name() == text);
    found.ok_or_else(|| "single, global, local or total".to_owned())
}

impl Args {
    /// Refuses flags that cannot go together and that the parser knows nothing of: none is ignored.
    pub fn check(&self) -> Outcome {
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
        let is_single = self.script.is_none() && self.turntable.is_none();
        if self.shard.shard.is_some() && is_single {
            return refused("--shard deals frames; it needs --script or --turntable".to_owned());
        }
        if self.stats && is_quiet() {
            let what = "--stats prints on stderr, which --quiet silences; leave one out";
            return refused(what.to_owned());
        }
        if !self.light_group.is_empty() && !self.aov.iter().any(Aov::is_lights) {
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
    pub fn keys(&self) -> Map<String, Value> {
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
pub fn format_of(path: &Path) -> Result<Format, Failure> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let format = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("png") => Format::Png,
        Some("exr") => Format::Exr,
        _ if is_stream(path) => Format::Png,
        _ => return Err(Failure::file(path, "the name must end in .png or .exr")),
    };
    Ok(format)
}

#[cfg(test)]
mod tests {
    use clap::Args as _;

    use super::*;

    #[test]
    fn help_has_the_limits() {
        let command = clap::Command::new("render");
        let help = Args::augment_args(command).render_help().to_string();
        for limit in [MAX_SIDE, MAX_PIXELS, MAX_SAMPLES, MAX_SHADOW_MAPS] {
            assert!(help.contains(&limit.to_string()), "{limit}: {help}");
        }
    }
}
