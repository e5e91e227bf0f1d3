//! `strandlight lights import`.

use std::path::PathBuf;

use serde::Deserialize;
use strandlight_bake::lights::exchange::lambda;
use strandlight_bake::lights::sort_lights;
use strandlight_formats::{
    BakedFile, LightSet, LightSetInfo, NpyArray, SrbfLight, content_hash, counted, in_plain_words,
    read_file,
};

use crate::cli::{
    Failure, Outcome, check_outputs, check_own_extension, note, print_line, write_output,
};

/// Longest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Make a light set of spherical Gaussians from elsewhere
///
/// JSON: as `strandlight export` writes it; of each light direction, lambda or sharpness (2 / lambda^2),
/// and rgb are read. NumPy: an array of shape [n, 7], float32 or float64, with x, y, z, sharpness, r, g, b in
/// each row, as PhySG has it. Directions are made unit vectors, and lights are sorted by falling energy. The
/// format is detected from the file's content.
#[derive(clap::Args)]
pub struct Args {
    /// .json or .npy file, - for standard input
    input: PathBuf,
    /// Light set to write, - for standard output
    #[arg(short, long, value_name = "F.lights")]
    output: PathBuf,
}

#[derive(Deserialize)]
struct Document {
    lights: Vec<Light>,
}

#[derive(Deserialize)]
struct Light {
    direction: [f64; 3],
    lambda: Option<f64>,
    sharpness: Option<f64>,
    rgb: [f32; 3],
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    check_outputs(&[&args.input], &[&args.output])?;
    check_own_extension(&args.output, "lights")?;
    let bytes = read_file(&args.input, MAX_BYTES).map_err(Failure::input)?;
    let mut set = set_of(&bytes).map_err(|what| Failure::file(&args.input, what))?;
    let is_sorted = sort_lights(&mut set.lights);
    let file = set
        .to_bytes()
        .map_err(|error| Failure::file(&args.input, error))?;
    if is_sorted {
        let what = "the lights are sorted by falling energy; numbers of lights are by that order";
        note!("{}: {what}", args.input.display());
    }
    write_output(&args.output, &file)?;
    print_line(format_args!(
        "wrote {}: {}, {} bytes",
        args.output.display(),
        counted(set.lights.len(), "light", "lights"),
        file.len()
    ))
}

fn set_of(bytes: &[u8]) -> Result<LightSet, String> {
    let (format, lights) = match bytes.starts_with(b"\x93NUMPY") {
        true => ("npy", lights_of_npy(bytes)?),
        false => ("json", lights_of_json(bytes)?),
    };
    let n = u32::try_from(lights.len()).map_err(|_| "too many lights".to_owned())?;
    let pair = |name: &str, value: String| (name.to_owned(), value);
    Ok(LightSet {
        lights,
        info: LightSetInfo {
            requested_count: n,
            parameters: vec![
                pair("format", format.to_owned()),
                pair("source_hash", content_hash(bytes)),
            ],
            ..LightSetInfo::default()
        },
    })
}

fn lights_of_json(bytes: &[u8]) -> Result<Vec<SrbfLight>, String> {
    let document: Document = serde_json::from_slice(bytes).map_err(|error| {
        let what = in_plain_words(error);
        format!("neither a NumPy array nor JSON with lights: {what}")
    })?;
    let lights = document.lights.into_iter().enumerate();
    lights
        .map(|(ix, light)| {
            let lambda = match (light.lambda, light.sharpness) {
                (Some(lambda), _) => lambda,
                (None, Some(sharpness)) => lambda_of(ix, sharpness)?,
                (None, None) => return Err(format!("light {ix} has neither lambda nor sharpness")),
            };
            light_of(ix, light.direction, lambda, light.rgb)
        })
        .collect()
}

fn lights_of_npy(bytes: &[u8]) -> Result<Vec<SrbfLight>, String> {
    let is_wanted = |shape: &[u64]| matches!(shape, [_, 7]);
    let array = NpyArray::of(bytes, "(lights, 7)", is_wanted).map_err(|error| error.to_string())?;
    let rows = 0..array.shape[0] as usize;
    rows.map(|ix| {
        let at = |column: usize| array.value(7 * ix + column);
        let direction = [at(0), at(1), at(2)].map(f64::from);
        let lambda = lambda_of(ix, f64::from(at(3)))?;
        light_of(ix, direction, lambda, [at(4), at(5), at(6)])
    })
    .collect()
}

fn lambda_of(ix: usize, sharpness: f64) -> Result<f64, String> {
    match sharpness > 0.0 && sharpness.is_finite() {
        true => Ok(lambda(sharpness)),
        false => Err(format!(
            "light {ix}: its sharpness is {sharpness}; it must be above 0"
        )),
    }
}

fn light_of(
    ix: usize,
    direction: [f64; 3],
    lambda: f64,
    rgb: [f32; 3],
) -> Result<SrbfLight, String> {
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length.is_finite() && length > 1e-6) {
        return Err(format!(
            "light {ix}: its direction is {direction:?}, no direction"
        ));
    }
    // What is a unit vector but for its last digits stays as it is.
    let length = if (length - 1.0).abs() < 1e-6 {
        1.0
    } else {
        length
    };
    Ok(SrbfLight {
        direction: direction.map(|x| (x / length) as f32),
        lambda: lambda as f32,
        rgb,
    })
}
