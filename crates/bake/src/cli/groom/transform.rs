//! `strandlight groom transform`.

use strandlight_bake::grooms::Transform;
use strandlight_formats::UpAxis;

use super::source::EditArgs;
use super::target::{Target, Wish};
use crate::cli::{Failure, Outcome, check_outputs};

/// Scale, rotate and move hair, in this order, in centimetres with y up
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    files: EditArgs,
    /// Factor on positions and widths, 1e-6 to 1e6
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Turn about the axis X, Y or Z through the origin by an angle in degrees, as --rotate X 90;
    /// repeat for one turn after another
    #[arg(long, num_args = 2, value_names = ["AXIS", "DEG"], allow_negative_numbers = true)]
    rotate: Vec<String>,
    /// Move by x, y and z, cm
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_vector)]
    translate: Option<Vector>,
    /// Reverse the points of all strands, so that their tips become their roots
    #[arg(long)]
    flip_root: bool,
}

/// Three numbers.
#[derive(Clone, Copy)]
struct Vector([f64; 3]);

fn parse_vector(text: &str) -> Result<Vector, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|number| number.trim().parse().ok())
        .filter(|number: &f64| number.is_finite())
        .collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 => Ok(Vector([x, y, z])),
        _ => Err("must be three numbers, as 0,1.5,-2".to_owned()),
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Outcome {
    let EditArgs { input, output } = &args.files;
    let target = Target::new(output, Wish::default(), None)?;
    let transform = Transform {
        scale: args.scale,
        rotations_deg: rotations(&args.rotate)?,
        translation: args.translate.map_or([0.0; 3], |Vector(xyz)| xyz),
        flip_root: args.flip_root,
    };
    if transform == Transform::default() {
        let what = "nothing to do: give --scale, --rotate, --translate or --flip-root";
        return Err(Failure::Input(what.to_owned()));
    }
    check_outputs(&[input], &[output])?;
    let groom = args.files.read()?;
    let moved = transform.apply(&groom);
    target.write(&moved.map_err(|error| Failure::file(input, error))?, output)
}

/// Pairs of axis and angle.
fn rotations(words: &[String]) -> Result<Vec<(UpAxis, f64)>, Failure> {
    let pairs = words.chunks_exact(2).map(|pair| {
        let axis = match pair[0].to_ascii_lowercase().as_str() {
            "x" => Some(UpAxis::X),
            "y" => Some(UpAxis::Y),
            "z" => Some(UpAxis::Z),
            _ => None,
        };
        let angle = pair[1].parse().ok().filter(|angle: &f64| angle.is_finite());
        axis.zip(angle).ok_or_else(|| {
            let text = pair.join(" ");
            Failure::Input(format!("--rotate {text}: must be X, Y or Z and degrees"))
        })
    });
    pairs.collect()
}
