//! Errors against the exact model, and what rounding does.

use serde_json::json;
use strandlight_scattering::{HairParams, Lobe};

use super::draw::{self, Random};
use super::energy::reference;
use super::point::{Evaluation, Group, Point};
use super::report::{Check, Tally};
use super::run::Run;
use super::target::StressError;

/// Values below this share of the largest of their fibre, mode and function are measured against
/// that share.
const FLOOR: f64 = 1e-2;
/// So are those below this, per unit of light mass.
const SIZE_MIN: f64 = 1e-6;
/// Largest change by one unit in the last place of one input.
const ROUNDING_BOUND: f64 = 5e-3;
/// Points a fibre and function.
const POINTS: usize = 6;

const FUNCTIONS: [(bool, Lobe); 6] = [
    (false, Lobe::R),
    (false, Lobe::Tt),
    (false, Lobe::Trt),
    (true, Lobe::R),
    (true, Lobe::Tt),
    (true, Lobe::Trt),
];

fn function_name((is_single, lobe): (bool, Lobe)) -> String {
    let function = if is_single { "single" } else { "azimuthal" };
    format!("{function} {}", lobe.name())
}

fn points(random: &mut Random, hair: &HairParams, (is_single, lobe): (bool, Lobe)) -> Vec<Point> {
    let draw = if is_single {
        draw::single_point
    } else {
        draw::azimuthal
    };
    (0..POINTS).map(|_| draw(random, lobe, hair)).collect()
}

/// Errors against the exact model over the extremes; circular fibres. Reported, not held: the
/// accuracy that is promised is that of ordinary hair.
pub fn against_exact(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let tallies = run.tallies(
        n.div_ceil(POINTS),
        40,
        "accuracy over the extremes",
        |random| {
            let mut tallies = [(); 6].map(|()| Tally::with_percentiles());
            let mut hair = draw::hair(random);
            hair.eccentricity = 1.0;
            for (function, tally) in FUNCTIONS.into_iter().zip(&mut tallies) {
                let points = points(random, &hair, function);
                let group = Group { hair, points };
                let values = run.target.cpu(&group)?;
                let exact: Vec<[f64; 3]> = group
                    .points
                    .iter()
                    .map(|point| reference(run, point, &hair))
                    .collect();
                for c in 0..3 {
                    let scaled = |ix: usize| exact[ix][c] / group.points[ix].light_mass();
                    let largest = (0..POINTS).map(scaled).fold(0.0, f64::max);
                    for (ix, point) in group.points.iter().enumerate() {
                        let mass = point.light_mass();
                        let size = exact[ix][c].max(mass * SIZE_MIN.max(FLOOR * largest));

                        let error = (f64::from(values[ix][c]) - exact[ix][c]).abs() / size;
                        let found = || [json!(values[ix]), json!(exact[ix]), point.query(&hair)];
                        tally.see(error, found);
                    }
                }
            }
            Ok(tallies)
        },
    )?;
    let note = "difference from f64 over the extremes, relative to the value or 1 % of the \
                fibre's largest (per unit of light)";
    Ok(FUNCTIONS
        .into_iter()
        .zip(tallies)
        .map(|(function, tally)| {
            let name = format!("accuracy {}", function_name(function));
            tally.check(&name, "cpu", None, note)
        })
        .collect())
}

/// How much one unit in the last place of any angle or width moves an answer.
pub fn rounding(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let tallies = run.tallies(n.div_ceil(POINTS), 41, "rounding", |random| {
        let mut tallies = [(); 6].map(|()| Tally::with_percentiles());
        let hair = draw::hair(random);
        for (function, tally) in FUNCTIONS.into_iter().zip(&mut tallies) {
            let middles = points(random, &hair, function);
            let n_moves = moved(&middles[0]).len();
            let mut all = middles.clone();
            all.extend(middles.iter().flat_map(moved));
            let group = Group { hair, points: all };
            let values = run.target.cpu(&group)?;
            let (before, after) = values.split_at(POINTS);
            for c in 0..3 {
                let scaled = |ix: usize| f64::from(before[ix][c]) / middles[ix].light_mass();
                let largest = (0..POINTS).map(scaled).fold(0.0, f64::max);
                for (ix, point) in middles.iter().enumerate() {
                    let value = f64::from(before[ix][c]);
                    let size = value.max(point.light_mass() * SIZE_MIN.max(FLOOR * largest));
                    for step in 0..n_moves {
                        if step == 2 && is_at_pole(point) {
                            continue;
                        }
                        let at = ix * n_moves + step;
                        let there = f64::from(after[at][c]);
                        let error = (there - value).abs() / size;
                        tally.see(error, || {
                            let queries =
                                [point, &group.points[POINTS + at]].map(|p| p.query(&hair));
                            [json!(after[at]), json!(before[ix]), json!(queries)]
                        });
                    }
                }
            }
        }
        Ok(tallies)
    })?;
    let note = "change by one unit in the last place of one angle or width, relative to the \
                value or 1 % of the fibre's largest (per unit of light)";
    Ok(FUNCTIONS
        .into_iter()
        .zip(tallies)
        .map(|(function, tally)| {
            let name = format!("rounding {}", function_name(function));
            tally.check(&name, "cpu", Some(ROUNDING_BOUND), note)
        })
        .collect())
}

/// Is theta_d so near +-pi/2 that one unit of it moves cos(theta_d) itself by 1e-4 and more?
/// Energies go with its square: the exact model moves as much.
fn is_at_pole(point: &Point) -> bool {
    match *point {
        Point::Azimuthal { theta_d, .. } => theta_d.cos() < 1e-3,
        Point::Single { .. } => false,
    }
}

/// The point with each of its numbers one f32 nearer to 0.
fn moved(point: &Point) -> Vec<Point> {
    let down = |x: f64| {
        let x = x as f32;
        f64::from(if x > 0.0 { x.next_down() } else { x.next_up() })
    };
    let mut all = Vec::new();
    match *point {
        Point::Azimuthal { .. } => {
            for which in 0..3 {
                let mut there = *point;
                if let Point::Azimuthal {
                    lambda_p,
                    dphi,
                    theta_d,
                    ..
                } = &mut there
                {
                    let numbers = [lambda_p, dphi, theta_d];
                    if let Some(number) = numbers.into_iter().nth(which) {
                        *number = down(*number);
                    }
                }
                all.push(there);
            }
        }
        Point::Single { .. } => {
            for which in 0..5 {
                let mut there = *point;
                if let Point::Single {
                    light,
                    theta_o,
                    phi_o,
                    ..
                } = &mut there
                {
                    let numbers = [
                        &mut light.theta,
                        &mut light.phi,
                        &mut light.lambda,
                        theta_o,
                        phi_o,
                    ];
                    if let Some(number) = numbers.into_iter().nth(which) {
                        *number = down(*number);
                    }
                }
                all.push(there);
            }
        }
    }
    all
}
