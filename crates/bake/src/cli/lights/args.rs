//! The words of `strandlight lights MAP`.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use strandlight_bake::lights::{MAX_FITTED_LIGHTS, MAX_SUNS, Metric};
use strandlight_formats::{HairSection, MAX_PANORAMA_WIDTH, Scene, preset_names};
use strandlight_scattering::{HairParams, Lobe, PerLobe};

use super::repeat::Line;
use crate::cli::{Failure, parse_error};

#[derive(clap::Args)]
pub struct FitArgs {
    /// OpenEXR or Radiance .hdr map, - for standard input
    pub map: PathBuf,
    /// Light set to write, - for standard output
    #[arg(short, long, value_name = "F.lights")]
    pub output: PathBuf,
    #[arg(long, default_value_t = 40, value_parser = parse_count,
        help = format!("Number of lights, 1 to {MAX_FITTED_LIGHTS}"))]
    pub count: usize,
    /// Fit the smallest set whose error is at most E, a fraction or percentage (0.5%); if there is
    /// none, exit with 1 and write reports, but no light set
    #[arg(long, value_name = "E", value_parser = parse_error, conflicts_with = "count")]
    pub max_error: Option<f64>,
    /// Error that --max-error limits: of what fibres scatter, or of the irradiance
    #[arg(long, value_name = "METRIC", default_value = "fibre", value_parser = metric(),
        requires = "max_error")]
    pub metric: Metric,
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = parse_count,
        requires = "max_error",
        help = format!("Most lights that --max-error may take, 1 to {MAX_FITTED_LIGHTS}"))]
    pub max_count: usize,
    /// Hair whose fibres measure the fibre error, beside the default's: a scene (.toml) or the
    /// name of a preset
    #[arg(long, value_name = "SCENE|PRESET", conflicts_with = "no_report")]
    pub hair: Option<String>,
    /// Fit other numbers of lights too, for the error against their number in the report
    #[arg(long, conflicts_with = "no_report")]
    pub curve: bool,
    /// Random seed; the output is deterministic for a given seed
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Layout of the map
    #[arg(long, value_enum, default_value_t = Layout::Latlong)]
    pub layout: Layout,
    /// Part of an OpenEXR file, by name or by index from 0 [default: the first with colour]
    #[arg(long, value_name = "NAME|INDEX")]
    pub part: Option<String>,
    /// Layer of an OpenEXR file, the name before .R, .G, .B or .Y of its channels; "" for the
    /// plain ones [default: the plain channels, else the first layer with colour]
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
    /// Write what was found: .html for people, a page with pictures, or JSON; may be given twice. Equal
    /// runs give equal files
    #[arg(long, value_name = "R.html|R.json")]
    pub report: Vec<PathBuf>,
    /// Write the seconds that it took, as JSON
    #[arg(long, value_name = "T.json")]
    pub timings: Option<PathBuf>,
    /// Skip measuring errors: the light set records none, --json prints null
    #[arg(long, conflicts_with_all = ["report", "max_error"])]
    pub no_report: bool,
    /// Write lights for the compact sources alone, N of them at the most, 1..=16 (a sun, bare lamps), and what
    /// is left of the map to --residual; exit with 1 if there is none
    #[arg(long, value_name = "N", value_parser = parse_suns, requires = "residual",
        conflicts_with_all = ["count", "max_error", "curve", "hair", "no_report"])]
    pub suns: Option<usize>,
    /// The map without the compact sources of --suns, OpenEXR, as large as the map
    #[arg(long, value_name = "R.exr", requires = "suns")]
    pub residual: Option<PathBuf>,
    /// Write map, light set, difference and lights as a picture
    #[arg(long, value_name = "P.png")]
    pub preview: Option<PathBuf>,
    /// Write the map itself, for the background of pictures: `lights.panorama` of a scene
    #[arg(long, value_name = "X.panorama")]
    pub panorama: Option<PathBuf>,
    #[arg(long, value_name = "PIXELS", default_value_t = 2048, value_parser = parse_width,
        requires = "panorama", help = format!(
            "Width of the panorama, even, 4 to {MAX_PANORAMA_WIDTH}; a map that is narrower keeps its own"
        ))]
    pub panorama_width: u32,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

/// Layouts of a map on the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Layout {
    /// Equirectangular, row 0 on top, OpenEXR's orientation
    Latlong,
}

fn parse_count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_FITTED_LIGHTS).contains(&count) => Ok(count),
        _ => Err(format!("not a number from 1 to {MAX_FITTED_LIGHTS}")),
    }
}

fn parse_width(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(width) if (4..=MAX_PANORAMA_WIDTH).contains(&width) && width.is_multiple_of(2) => {
            Ok(width)
        }
        _ => Err(format!("not an even number from 4 to {MAX_PANORAMA_WIDTH}")),
    }
}

fn parse_suns(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=MAX_SUNS).contains(&count) => Ok(count),
        _ => Err(format!("not a number from 1 to {MAX_SUNS}")),
    }
}

/// Parses `--metric`.
fn metric() -> impl TypedValueParser<Value = Metric> {
    let name_of = |name: String| Metric::ALL.into_iter().find(|metric| metric.name() == name);
    PossibleValuesParser::new(Metric::ALL.map(Metric::name))
        .map(move |name| name_of(name).unwrap_or_default())
}

/// The hair of `--hair`: a preset of that name, else a scene.
pub fn hair_of(name: &str) -> Result<HairParams, Failure> {
    if preset_names().any(|preset| preset == name) {
        let hair = HairSection::preset(name).map_err(Failure::input)?;
        return Ok(scattered(&hair));
    }
    let path = Path::new(name);
    if path.extension().is_none() && !path.exists() {
        let what = "neither a scene nor a preset of hair; presets:";
        let names: Vec<&str> = preset_names().collect();
        return Err(Failure::Input(format!(
            "{name}: {what} {}",
            names.join(", ")
        )));
    }
    Ok(scattered(&Scene::read(path).map_err(Failure::input)?.hair))
}

/// The parameters of the hair; modes that it does not draw have no intensity.
fn scattered(hair: &HairSection) -> HairParams {
    let mut params = hair.params();
    let of_mode = |mode| match hair.modes.contains(&mode) {
        true => params.intensity.get(mode),
        false => 0.0,
    };
    let [r, tt, trt] = Lobe::ALL.map(of_mode);
    params.intensity = PerLobe { r, tt, trt };
    params
}

/// Is the report of that name for people?
pub fn is_page(path: &Path) -> bool {
    let extension = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    extension.is_some_and(|extension| extension == "html" || extension == "htm")
}

/// The command line that makes the same again, without what is only said.
pub fn command(args: &FitArgs) -> String {
    let mut line = Line::new("strandlight lights");
    line.path("", &args.map);
    line.path("-o", &args.output);
    match (args.suns, args.max_error) {
        (Some(suns), _) => line.value("--suns", suns),
        (None, Some(max_error)) => {
            line.value("--max-error", max_error);
            line.value("--metric", args.metric.name());
            line.value("--max-count", args.max_count);
            line.value("--seed", args.seed);
        }
        (None, None) => {
            line.value("--count", args.count);
            line.value("--seed", args.seed);
        }
    }
    if let Some(path) = &args.residual {
        line.path("--residual", path);
    }
    for (flag, value) in [
        ("--part", &args.part),
        ("--layer", &args.layer),
        ("--hair", &args.hair),
    ] {
        if let Some(value) = value {
            line.value(flag, value);
        }
    }
    if args.curve {
        line.word("--curve");
    }
    if let Some(path) = &args.preview {
        line.path("--preview", path);
    }
    if let Some(path) = &args.panorama {
        line.path("--panorama", path);
        line.value("--panorama-width", args.panorama_width);
    }
    for path in &args.report {
        line.path("--report", path);
    }
    line.0
}
