//! `strandlight compare`: how far a picture is from a reference.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde_json::{Value, json};
use strandlight_formats::counted;
use strandlight_reference::compare::{
    CompareError, Comparison, FlipMap, Layer, PIXELS_PER_DEGREE, Region, compare, flip_png,
    heat_scale, signed_png,
};
use strandlight_scene::tone::{aces2, agx, filmic};

use super::{Failure, Outcome, check_extension, check_outputs, note, print_line, write_output};

/// Largest side of blocks.
const MAX_BLOCK: i64 = 1024;

/// Compare picture A with reference B
///
/// Takes two OpenEXR pictures (linear, premultiplied alpha) or two PNGs (sRGB, compared in linear
/// light). Hair pixels are those with alpha > 0 in either image; images without alpha are compared
/// whole. Relative RMSE is sqrt(mean (a-b)^2 / mean b^2) over pixels and channels. If B has a layer
/// "variance" (of each pixel's mean), the report separates B's own noise. FLIP (Andersson 2020)
/// compares the tone-mapped pictures at full size, seen from 0.7 m on a monitor 0.7 m and 3840
/// pixels wide (67 pixels per degree).
#[derive(clap::Args)]
pub struct Args {
    /// Picture to test: .exr or .png
    a: PathBuf,
    /// Reference picture
    b: PathBuf,
    /// Layer of both OpenEXR files [default: the plain channels R, G, B]
    #[arg(long, value_name = "single|global|local|total|...")]
    layer: Option<String>,
    /// Layer of B if it differs from that of A; "-" for the plain channels
    #[arg(long, value_name = "NAME")]
    layer_b: Option<String>,
    #[arg(long = "box", value_name = "N", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=MAX_BLOCK),
        help = format!("Average blocks of N x N pixels first (not for FLIP), 1..={MAX_BLOCK}"))]
    block: u32,
    /// Exposure for FLIP of OpenEXR pictures in stops, -32..=32
    #[arg(long, value_name = "E", default_value_t = 0.0,
        value_parser = parse_exposure)]
    exposure: f32,
    /// Tone curve for FLIP of OpenEXR pictures; PNGs are used unchanged
    #[arg(long, value_enum, default_value_t = Curve::Filmic)]
    tone_map: Curve,
    /// Write the signed luminance difference: red where A is brighter, blue where B is, white
    /// where equal; saturates at half of B's root mean square over the hair
    #[arg(long, value_name = "OUT.png")]
    heatmap: Option<PathBuf>,
    /// Write the FLIP error of every pixel: black 0, purple, orange, pale yellow 1
    #[arg(long, value_name = "OUT.png")]
    flip: Option<PathBuf>,
    /// Largest accepted relative RMSE over the hair; above it the exit code is 1
    #[arg(long, value_name = "R", value_parser = parse_tolerance)]
    tolerance: Option<f64>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// From linear radiance to the screen.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Curve {
    /// The renderer's filmic curve
    Filmic,
    /// AgX
    Agx,
    /// ACES 2.0 for SDR displays
    Aces2,
    /// No tone mapping, clipped at 1
    None,
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(stops) if (-32.0..=32.0).contains(&stops) => Ok(stops),
        _ => Err("not a number from -32 to 32".to_owned()),
    }
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (0.0..=1e6).contains(&value) => Ok(value),
        _ => Err("not a number from 0 to 1e6".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let outputs: Vec<&Path> = [&args.heatmap, &args.flip]
        .into_iter()
        .flatten()
        .map(PathBuf::as_path)
        .collect();
    check_outputs(&[&args.a, &args.b], &outputs)?;
    for output in &outputs {
        check_extension(output, "png")?;
    }
    let layer_b = match args.layer_b.as_deref() {
        Some("-") => None,
        Some(name) => Some(name),
        None => args.layer.as_deref(),
    };
    let a = Layer::read(&args.a, args.layer.as_deref()).map_err(Failure::input)?;
    let b = Layer::read(&args.b, layer_b).map_err(Failure::input)?;
    let side = args.block as usize;
    let (small_a, small_b) = (a.boxed(side), b.boxed(side));
    let comparison = compare(&small_a, &small_b).map_err(|error| match error {
        CompareError::Sizes { .. } => Failure::Input(format!(
            "{} has {}x{} pixels and {} {}x{}: only pictures of one size can be compared",
            args.a.display(),
            a.width,
            a.height,
            args.b.display(),
            b.width,
            b.height
        )),
        error => Failure::input(error),
    })?;
    if a.is_display {
        let flags = [
            ("--exposure", args.exposure != 0.0),
            ("--tone-map", args.tone_map != Curve::Filmic),
        ];
        for (flag, _) in flags.into_iter().filter(|(_, is_given)| *is_given) {
            note!("{flag} has no effect on PNGs");
        }
    }
    let map = FlipMap::new(&a, &b, |rgb| args.show(rgb, a.is_display)).map_err(Failure::input)?;

    let scale = heat_scale(&small_a, &small_b);
    if let Some(path) = &args.heatmap {
        let png = signed_png(&small_a, &small_b, scale).map_err(Failure::input)?;
        write_output(path, &png)?;
    }
    if let Some(path) = &args.flip {
        write_output(path, &flip_png(&map).map_err(Failure::input)?)?;
    }
    let error = comparison.hair.relative_rmse;
    let passed = args.tolerance.map(|tolerance| error <= tolerance);
    if args.json {
        print_line(args.document(&comparison, &map, a.is_display, scale, passed))?;
    } else {
        args.print(&comparison, &map, scale)?;
    }
    match (passed, args.tolerance) {
        (Some(false), Some(tolerance)) => Err(Failure::Check(format!(
            "{}: relative RMSE {error:.6} is above {tolerance}",
            args.a.display()
        ))),
        _ => Ok(()),
    }
}

impl Args {
    /// Linear sRGB on the screen of a linear pixel.
    fn show(&self, rgb: [f32; 3], is_display: bool) -> [f32; 3] {
        if is_display {
            return rgb;
        }
        let exposed = rgb.map(|x| x * self.exposure.exp2());
        let light = exposed.map(|x| x.max(0.0));
        match self.tone_map {
            Curve::Filmic => filmic(light),
            Curve::Agx => agx(light),
            Curve::Aces2 => aces2(light),
            Curve::None => exposed,
        }
    }

    fn document(
        &self,
        comparison: &Comparison,
        map: &FlipMap,
        is_display: bool,
        scale: f64,
        passed: Option<bool>,
    ) -> Value {
        let name = |path: &Path| path.display().to_string();
        let layer_b = self.layer_b.as_ref().or(self.layer.as_ref());
        json!({
            "a": name(&self.a),
            "b": name(&self.b),
            "layer": self.layer,
            "layer_b": layer_b.filter(|layer| *layer != "-"),
            "box": self.block,
            "size": comparison.size,
            "hair": comparison.hair,
            "whole": comparison.whole,
            "max": comparison.max,
            "flip": {
                "mean": map.mean(),
                "weighted_first_quartile": map.weighted_percentile(0.25),
                "weighted_median": map.weighted_percentile(0.5),
                "weighted_third_quartile": map.weighted_percentile(0.75),
                "max": map.weighted_percentile(1.0),
                "pixels_per_degree": PIXELS_PER_DEGREE,
                "viewing": "0.7 m from a monitor 0.7 m and 3840 pixels wide",
                "exposure": if is_display { 0.0 } else { self.exposure },
                "tone_map": match (is_display, self.tone_map) {
                    (true, _) => "as in the files",
                    (false, Curve::Filmic) => "filmic",
                    (false, Curve::Agx) => "agx",
                    (false, Curve::Aces2) => "aces2",
                    (false, Curve::None) => "none",
                },
                "file": self.flip.as_deref().map(name),
            },
            "heatmap": {
                "file": self.heatmap.as_deref().map(name),
                "shows": "luminance of a - b",
                "blue": -scale,
                "white": 0.0,
                "red": scale,
            },
            "tolerance": self.tolerance,
            "passed": passed,
        })
    }

    fn print(&self, comparison: &Comparison, map: &FlipMap, scale: f64) -> Outcome {
        let [width, height] = comparison.size;
        print_line(format_args!("{width}x{height} pixels compared"))?;
        print_region("hair", &comparison.hair)?;
        print_region("whole", &comparison.whole)?;
        let max = &comparison.max;
        print_line(format_args!(
            "max    {:.4} at ({}, {}), {}: {:.5} against {:.5}",
            (max.a - max.b).abs(),
            max.x,
            max.y,
            ["red", "green", "blue"][max.channel],
            max.a,
            max.b
        ))?;
        print_line(format_args!(
            "FLIP   mean {:.4}, weighted median {:.4}, quartiles {:.4} {:.4}; \
             {PIXELS_PER_DEGREE:.1} pixels a degree",
            map.mean(),
            map.weighted_percentile(0.5),
            map.weighted_percentile(0.25),
            map.weighted_percentile(0.75)
        ))?;
        if let Some(path) = &self.heatmap {
            print_line(format_args!(
                "{}: luminance of A - B, blue -{scale:.4}, white 0, red {scale:.4}",
                path.display()
            ))?;
        }
        match &self.flip {
            Some(path) => print_line(format_args!(
                "{}: FLIP, black 0 to yellow 1",
                path.display()
            )),
            None => Ok(()),
        }
    }
}

fn print_region(name: &str, region: &Region) -> Outcome {
    let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |x| format!("{x:.4}"));
    let [r, g, b] = region.mean_ratio.map(number);
    let noise = match (
        region.relative_rmse_noise,
        region.relative_rmse_without_noise,
    ) {
        (Some(noise), Some(without)) => {
            format!("; noise explains {noise:.5}, without it {without:.5}")
        }
        _ => String::new(),
    };
    print_line(format_args!(
        "{name:6} relative RMSE {:.5}{noise}; mean ratio {r} {g} {b}; relative bias {}; {}",
        region.relative_rmse,
        region
            .relative_bias
            .map_or_else(|| "-".to_owned(), |x| format!("{x:+.4}")),
        counted(region.pixels, "pixel", "pixels")
    ))
}
