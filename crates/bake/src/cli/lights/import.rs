//! `strandlight lights import`.

use std::path::PathBuf;

use serde::Deserialize;
use serde_json::Value;
use strandlight_bake::lights::exchange::lambda;
use strandlight_bake::lights::{rest_parameter, sort_lights};
use strandlight_formats::{
    BakedFile, LightSet, LightSetInfo, NpyArray, SrbfLight, content_hash, counted, in_plain_words,
    read_file,
};
use strandlight_images::MapSelection;

use crate::cli::{
    Failure, Outcome, check_outputs, check_own_extension, note, print_line, write_output,
};

/// Longest file that is read, bytes.
const MAX_BYTES: u64 = 64 << 20;
/// Largest relative difference of a lambda from that of the sharpness beside it: both may have been
/// rounded.
const MAX_DISAGREEMENT: f64 = 1e-4;

/// Make a light set of spherical Gaussians from elsewhere
///
/// JSON: as `strandlight export` writes it; of each light direction, lambda or sharpness (2 / lambda^2;
/// both must agree), and rgb are read, and of `parameters` which map, or part of one, the lights stand for. NumPy: an array of shape [n, 7], float32 or float64, with x, y, z, sharpness, r, g, b in
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
    /// What an export records; of other programs it may be anything.
    #[serde(default)]
    parameters: Value,
}

#[derive(Deserialize)]
struct Light {
    direction: [f64; 3],
    lambda: Option<f64>,
    sharpness: Option<f64>,
    rgb: [f64; 3],
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    check_outputs(&[&args.input], &[&args.output])?;
    check_own_extension(&args.output, "lights")?;
    let bytes = read_file(&args.input, MAX_BYTES).map_err(Failure::input)?;
    let mut set = set_of(&bytes).map_err(|what| Failure::file(&args.input, what))?;
    let refused = |error| Failure::file(&args.input, error);
    // In the order of the file, by which lights are named.
    set.validate().map_err(refused)?;
    let is_sorted = sort_lights(&mut set.lights);
    let file = set.to_bytes().map_err(refused)?;
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
    let (format, lights, of_map) = match bytes.starts_with(b"\x93NUMPY") {
        true => ("npy", lights_of_npy(bytes)?, Vec::new()),
        false => {
            let Document { lights, parameters } = document(bytes)?;
            ("json", lights_of_json(lights)?, of_map(&parameters))
        }
    };
    let n = u32::try_from(lights.len()).map_err(|_| "too many lights".to_owned())?;
    let pair = |name: &str, value: String| (name.to_owned(), value);
    let mut parameters = vec![
        pair("format", format.to_owned()),
        pair("source_hash", content_hash(bytes)),
    ];
    parameters.extend(of_map);
    Ok(LightSet {
        lights,
        info: LightSetInfo {
            requested_count: n,
            parameters,
            ..LightSetInfo::default()
        },
    })
}

fn document(bytes: &[u8]) -> Result<Document, String> {
    serde_json::from_slice(bytes).map_err(|error| {
        let what = in_plain_words(error);
        format!("neither a NumPy array nor JSON with lights: {what}")
    })
}

/// Of recorded parameters those without which a set is measured against another map: the image of its file, and
/// that the lights are its compact sources alone.
fn of_map(parameters: &Value) -> Vec<(String, String)> {
    let pairs = parameters.as_object().into_iter().flatten();
    let pairs = pairs.filter_map(|(name, value)| Some((name.clone(), value.as_str()?.to_owned())));
    pairs
        .filter(|pair| {
            let selection = MapSelection::recorded(std::slice::from_ref(pair));
            *pair == rest_parameter() || selection != MapSelection::default()
        })
        .collect()
}

fn lights_of_json(lights: Vec<Light>) -> Result<Vec<SrbfLight>, String> {
    let lights = lights.into_iter().enumerate();
    lights
        .map(|(ix, light)| {
            let lambda = match (light.lambda, light.sharpness) {
                (Some(lambda), None) => lambda,
                (Some(lambda), Some(sharpness)) => {
                    let other = lambda_of(ix, sharpness)?;
                    // Not a number agrees with nothing.
                    let agrees = (lambda / other - 1.0).abs() <= MAX_DISAGREEMENT;
                    if !agrees {
                        let what = "disagree; sharpness is 2 / lambda^2";
                        return Err(format!(
                            "light {ix}: its lambda {lambda} and its sharpness {sharpness} {what}"
                        ));
                    }
                    lambda
                }
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
        let direction = [at(0), at(1), at(2)];
        let lambda = lambda_of(ix, at(3))?;
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
    rgb: [f64; 3],
) -> Result<SrbfLight, String> {
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !(length.is_finite() && length > 1e-6) {
        return Err(format!(
            "light {ix}: its direction is {direction:?}, no direction"
        ));
    }
    // Told as it was given, not as the infinity that it would become.
    let is_too_large = |value: f64| value.is_finite() && (value as f32).is_infinite();
    for (name, values) in [("lambda", &[lambda][..]), ("rgb", &rgb)] {
        if let Some(value) = values.iter().find(|value| is_too_large(**value)) {
            return Err(format!(
                "light {ix}: its {name} is {value:e}, beyond single precision"
            ));
        }
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
        rgb: rgb.map(|value| value as f32),
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_tells_the_map_of_a_set_is_kept() {
        let light = json!({ "direction": [0, 1, 0], "lambda": 1, "rgb": [1, 1, 1] });
        let recorded = |parameters: Value| {
            let document = json!({ "lights": [light], "parameters": parameters });
            let set = set_of(document.to_string().as_bytes()).expect("a light");
            let pairs = set.info.parameters.into_iter();
            pairs.skip(2).collect::<Vec<_>>()
        };
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        assert_eq!(
            recorded(json!({ "map_layer": "sun", "map_part": "1", "rest": "residual map" })),
            [
                pair("map_layer", "sun"),
                pair("map_part", "1"),
                pair("rest", "residual map")
            ]
        );
        for other in [
            json!({ "format": "exr", "rest": "of it", "map_part": 1 }),
            json!(["rest"]),
            json!(null),
        ] {
            assert!(recorded(other).is_empty());
        }
    }

    #[test]
    fn doubles_of_arrays_are_told_as_they_are() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 7)}\n";
        let file = |row: [f64; 7]| {
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((header.len() as u16).to_le_bytes());
            bytes.extend(header.as_bytes());
            bytes.extend(row.iter().flat_map(|value| value.to_le_bytes()));
            bytes
        };
        let refused = |row| set_of(&file(row)).expect_err("it is refused");
        let what = "beyond single precision";
        assert_eq!(
            refused([0.0, 1.0, 0.0, 8.0, 1.0, 1e39, 1.0]),
            format!("light 0: its rgb is 1e39, {what}")
        );
        assert_eq!(
            refused([0.0, 1.0, 0.0, 2e-80, 1.0, 1.0, 1.0]),
            format!("light 0: its lambda is 1e40, {what}")
        );
        // What a direction becomes is of length 1.
        let set = set_of(&file([0.0, 3e50, 0.0, 8.0, 1.0, 2.0, 3.0])).expect("a light");
        assert_eq!(set.lights[0].direction, [0.0, 1.0, 0.0]);
    }
}
