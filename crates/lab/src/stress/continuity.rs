//! Continuity along each parameter.
//!
//! A line through the parameters is walked in [`STEPS`] steps. Then the interval whose middle is
//! farthest off the mean of its ends is halved, again and again: at a jump that distance stays
//! half the jump, elsewhere it falls fourfold with the step. A jump is a difference across an
//! interval of [`FLOOR`] of the line (or between neighbouring f32) above [`BOUND`] (or
//! [`EDIT_BOUND`]) of the local scale: the largest value within [`NEIGHBOURHOOD`] steps, at least
//! [`SCALE_FLOOR`] of the line's largest. Values are divided by the light's mass, so that narrow
//! lights count.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};
use strandlight_scattering::{HairParams, Lobe, Parameter};

use super::draw::{self, BETA, CAUSTIC_WIDTH, ECCENTRICITY, LAMBDA, Random, SHIFT, SIGMA_A};
use super::point::{Evaluation, Group, Point, inclination, single};
use super::report::{Check, Tally};
use super::run::Run;
use super::target::StressError;

const STEPS: usize = 96;
/// Largest jump accepted, relative to the local scale, along parameters of light and view.
const BOUND: f64 = 2e-3;
/// The same along parameters of the fibre, where every step recomputes 16-bit textures: places
/// of lobes move in steps of 1e-4 radians, by 4.3 * 1e-4 / w_c of the value in the flank of a lobe
/// at 1 % of its peak; w_c is at least 0.01.
const EDIT_BOUND: f64 = 4e-2;
/// Widths below this share of the line are not halved.
const FLOOR: f64 = 1.0 / (1 << 26) as f64;
const NEIGHBOURHOOD: usize = 4;
const SCALE_FLOOR: f64 = 1e-2;
/// Least scale, per unit of light mass: [`BOUND`] of it, 2e-6 of the light, is what an early out or
/// a half float may cut.
const SCALE_MIN: f64 = 1e-3;
/// Evaluations a line: smooth ones of elliptic fibres with narrow caustics take more than 1500.
const BUDGET: usize = 4000;

/// What is walked along: a parameter of light or view, or one of the fibre.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Walk {
    ThetaJ,
    PhiJ,
    Lambda,
    ThetaO,
    PhiO,
    LambdaP,
    Dphi,
    ThetaD,
    Hair(Parameter),
}

use Walk::{Dphi, Hair, Lambda, LambdaP, PhiJ, PhiO, ThetaD, ThetaJ, ThetaO};

/// All of them.
fn all() -> impl Iterator<Item = Walk> {
    let of_point = [ThetaJ, PhiJ, Lambda, ThetaO, PhiO, LambdaP, Dphi, ThetaD];
    of_point
        .into_iter()
        .chain(Parameter::ALL.into_iter().map(Hair))
}

impl Walk {
    const fn name(self) -> &'static str {
        match self {
            ThetaJ => "theta_j",
            PhiJ => "phi_j",
            Lambda => "lambda",
            ThetaO => "theta_o",
            PhiO => "phi_o",
            LambdaP => "lambda_p",
            Dphi => "dphi",
            ThetaD => "theta_d",
            Hair(parameter) => parameter.name(),
        }
    }

    /// Largest jump accepted.
    const fn bound(self) -> f64 {
        match self {
            Hair(_) => EDIT_BOUND,
            _ => BOUND,
        }
    }

    /// Does it belong to single scattering or to the inner integral only? Those of the fibre
    /// belong to both.
    fn moves(self, point: &Point) -> bool {
        match self {
            ThetaJ | PhiJ | Lambda | ThetaO | PhiO => matches!(point, Point::Single { .. }),
            LambdaP | Dphi | ThetaD => matches!(point, Point::Azimuthal { .. }),
            Hair(Parameter::CausticWidth | Parameter::Eccentricity) => point.lobe() == Lobe::Trt,
            Hair(Parameter::SigmaA) => point.lobe() != Lobe::R,
            Hair(Parameter::Shift | Parameter::Width) => matches!(point, Point::Single { .. }),
            Hair(_) => true,
        }
    }

    /// The parameter at `t` in 0..=1 of its range, in single precision.
    fn at(self, t: f64) -> f64 {
        let linear = |[low, high]: [f64; 2]| low + (high - low) * t;
        let log = |[low, high]: [f64; 2]| low * (high / low).powf(t);
        match self {
            ThetaJ | ThetaO | ThetaD => inclination(linear([-FRAC_PI_2, FRAC_PI_2])),
            PhiJ | PhiO | Dphi => single(linear([-PI, PI])),
            Lambda | LambdaP => single(log(LAMBDA)),
            Hair(Parameter::SigmaA) => single(SIGMA_A * t * t * t),
            Hair(Parameter::Shift) => single(linear([-SHIFT, SHIFT])),
            Hair(Parameter::Width) => single(log(BETA)),
            Hair(Parameter::CausticWidth) => {
                single(log(CAUSTIC_WIDTH)).clamp(CAUSTIC_WIDTH[0], CAUSTIC_WIDTH[1])
            }
            Hair(Parameter::Eccentricity) => single(log(ECCENTRICITY)),
            Hair(parameter) => parameter.clamp(single(linear(parameter.range()))),
        }
    }

    /// `base` with the parameter at `value`.
    fn set(self, base: &Group, value: f64) -> Group {
        let mut group = base.clone();
        if let Hair(parameter) = self {
            let shares = match parameter {
                Parameter::SigmaA => [1.0, 0.5, 0.1],
                _ => [1.0; 3],
            };
            parameter.set(&mut group.hair, shares.map(|share| share * value));
        }
        for point in &mut group.points {
            match point {
                Point::Single {
                    light,
                    theta_o,
                    phi_o,
                    ..
                } => match self {
                    ThetaJ => light.theta = value,
                    PhiJ => light.phi = value,
                    Lambda => light.lambda = value,
                    ThetaO => *theta_o = value,
                    PhiO => *phi_o = value,
                    _ => {}
                },
                Point::Azimuthal {
                    lambda_p,
                    dphi,
                    theta_d,
                    ..
                } => match self {
                    LambdaP => *lambda_p = value,
                    Dphi => *dphi = value,
                    ThetaD => *theta_d = value,
                    _ => {}
                },
            }
        }
        group
    }
}

/// Continuity in every parameter, `n` lines each.
pub fn checks(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let mut checks = Vec::new();
    for (ix, parameter) in all().enumerate() {
        let name = format!("continuity in {}", parameter.name());
        let [tally] = run.tallies(n, 20 + ix as u64, &name, |random| {
            let mut tally = Tally::new();
            let base = base(random, parameter);
            walk(run, parameter, &base, &mut tally)?;
            Ok([tally])
        })?;
        let note = "largest difference left across 2^-26 of the range, or between neighbouring \
                    f32, relative to the local scale";
        checks.push(tally.check(&name, "cpu", Some(parameter.bound()), note));
    }
    Ok(checks)
}

/// Where a line starts from: a few points of each mode that the parameter moves.
fn base(random: &mut Random, parameter: Walk) -> Group {
    let hair = draw::hair(random);
    let mut points = Vec::new();
    for lobe in Lobe::ALL {
        points.push(draw::azimuthal(random, lobe, &hair));
        points.push(draw::single_point(random, lobe, &hair));
    }
    points.retain(|point| parameter.moves(point));
    Group { hair, points }
}

/// The larger; NaN counts as infinite.
fn worse(best: (f64, usize), here: (f64, usize)) -> (f64, usize) {
    match here {
        (value, ix) if value.is_nan() => (f64::INFINITY, ix),
        (value, _) if value > best.0 => here,
        _ => best,
    }
}

/// An interval of the line, with the answers at its ends and its middle.
struct Interval {
    /// Ends and middle, positions in 0..=1.
    at: [f64; 3],
    values: [Vec<f64>; 3],
    scale: Vec<f64>,
    /// Largest over the components of the middle's distance from the mean of the ends, and the
    /// component.
    bend: (f64, usize),
}

impl Interval {
    /// The scale grows with what is found: a peak may lie between the first samples.
    fn new(at: [f64; 3], values: [Vec<f64>; 3], mut scale: Vec<f64>) -> Interval {
        let [a, b, c] = &values;
        for (ix, scale) in scale.iter_mut().enumerate() {
            *scale = scale.max(a[ix]).max(b[ix]).max(c[ix]);
        }
        let bend = (0..scale.len())
            .map(|ix| ((b[ix] - 0.5 * (a[ix] + c[ix])).abs() / scale[ix], ix))
            .fold((0.0, 0), worse);
        Interval {
            at,
            values,
            scale,
            bend,
        }
    }

    /// The largest difference across the interval and its component.
    fn jump(&self) -> (f64, usize) {
        let [a, _, c] = &self.values;
        (0..self.scale.len())
            .map(|ix| ((c[ix] - a[ix]).abs() / self.scale[ix], ix))
            .fold((0.0, 0), worse)
    }
}

impl PartialEq for Interval {
    fn eq(&self, other: &Interval) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Interval {}

impl PartialOrd for Interval {
    fn partial_cmp(&self, other: &Interval) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Interval {
    fn cmp(&self, other: &Interval) -> Ordering {
        let by_bend = self.bend.0.total_cmp(&other.bend.0);
        by_bend.then(other.at[0].total_cmp(&self.at[0]))
    }
}

/// Walks one line and feeds its largest jump into `tally`.
fn walk(run: &Run, parameter: Walk, base: &Group, tally: &mut Tally) -> Result<(), StressError> {
    let prepared = run.target.prepare(&base.hair)?;
    let evaluate = |value: f64| -> Result<Vec<f64>, StressError> {
        let group = parameter.set(base, value);
        let values = if group.hair == base.hair {
            run.target.at(&prepared, &group.points)
        } else {
            run.target.cpu(&group)?
        };
        let scaled = group.points.iter().zip(values).flat_map(|(point, rgb)| {
            let mass = point.light_mass();
            rgb.map(|x| f64::from(x) / mass)
        });
        Ok(scaled.collect())
    };
    let (jump, place) = largest_jump(|t| parameter.at(t), evaluate)?;
    tally.see(jump, || match place {
        Some((interval, component)) => {
            let [from, _, to] = interval.at.map(|t| parameter.at(t));
            let found = json!(interval.values.each_ref().map(|values| values[component]));
            let inputs = inputs(parameter, base, component / 3, [from, to]);
            [found, json!("equal, of unit light mass"), inputs]
        }
        None => [Value::Null, Value::Null, Value::Null],
    });
    Ok(())
}

/// The largest jump of `evaluate(parameter(t))` over t in 0..=1, 0 if there is none above half of
/// [`BOUND`], with its interval and component. `parameter` rounds to f32.
fn largest_jump<E>(
    parameter: impl Fn(f64) -> f64,
    evaluate: impl Fn(f64) -> Result<Vec<f64>, E>,
) -> Result<(f64, Option<(Interval, usize)>), E> {
    let at = |t: f64| evaluate(parameter(t));
    let mut heap = initial_intervals(&at)?;
    let mut worst = (0.0, None);
    for _ in 0..BUDGET / 2 {
        let Some(interval) = heap.pop() else { break };
        if 4.0 * interval.bend.0 <= BOUND {
            return Ok(worst);
        }
        let [a, b, c] = interval.at;
        let same = |x: f64, y: f64| parameter(x) == parameter(y);
        if c - a <= FLOOR || same(a, b) || same(b, c) {
            let (jump, component) = interval.jump();
            if jump > worst.0 {
                worst = (jump, Some((interval, component)));
            }
            continue;
        }
        let (left, right) = (0.5 * (a + b), 0.5 * (b + c));
        let (f_left, f_right) = (at(left)?, at(right)?);
        let [f_a, f_b, f_c] = interval.values;
        let scale = interval.scale;
        heap.push(Interval::new(
            [a, left, b],
            [f_a, f_left, f_b.clone()],
            scale.clone(),
        ));
        heap.push(Interval::new([b, right, c], [f_b, f_right, f_c], scale));
    }
    // What was not resolved within the budget might still hide a jump of twice its bend.
    if let Some(interval) = heap.pop()
        && 2.0 * interval.bend.0 > worst.0.max(BOUND)
    {
        let (bend, component) = interval.bend;
        worst = (2.0 * bend, Some((interval, component)));
    }
    Ok(worst)
}

/// The intervals of the first walk, each with its local scale.
fn initial_intervals<E>(
    at: &impl Fn(f64) -> Result<Vec<f64>, E>,
) -> Result<BinaryHeap<Interval>, E> {
    let position = |ix: usize| ix as f64 / (2 * STEPS) as f64;
    let samples = (0..=2 * STEPS)
        .map(|ix| at(position(ix)))
        .collect::<Result<Vec<_>, _>>()?;
    let largest = |samples: &[Vec<f64>], c: usize| samples.iter().map(|s| s[c]).fold(0.0, f64::max);
    let mut heap = BinaryHeap::new();
    for step in 0..STEPS {
        let from = (2 * step).saturating_sub(2 * NEIGHBOURHOOD);
        let to = (2 * (step + 1 + NEIGHBOURHOOD)).min(2 * STEPS);
        let scale = (0..samples[0].len())
            .map(|c| {
                let near = largest(&samples[from..=to], c);
                near.max(SCALE_FLOOR * largest(&samples, c)).max(SCALE_MIN)
            })
            .collect();
        let ixs = [2 * step, 2 * step + 1, 2 * step + 2];
        let values = ixs.map(|ix| samples[ix].clone());
        heap.push(Interval::new(ixs.map(position), values, scale));
    }
    Ok(heap)
}

/// The query at the near end of an interval, and the interval.
fn inputs(parameter: Walk, base: &Group, point: usize, between: [f64; 2]) -> Value {
    let group = parameter.set(base, between[0]);
    let hair: &HairParams = &group.hair;
    json!({ "parameter": parameter.name(), "between": between,
            "query": group.points[point].query(hair) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jump(f: impl Fn(f64) -> f64) -> f64 {
        let evaluate = |x: f64| Ok::<_, ()>(vec![1.0, f(x)]);
        largest_jump(single, evaluate).unwrap().0
    }

    #[test]
    fn jumps_are_found_and_slopes_are_not() {
        // A narrow peak, a kink, a steep rise: continuous.
        assert_eq!(jump(|x| (-((x - 0.3) / 0.02).powi(2)).exp()), 0.0);
        assert_eq!(jump(|x| (x - 0.4).abs()), 0.0);
        assert_eq!(jump(|x| 1.0 + (2e4 * (x - 0.6)).tanh()), 0.0);
        // Steps, also small ones on a slope and beside a larger rise.
        assert!((jump(|x| f64::from(u8::from(x > 0.123))) - 1.0).abs() < 1e-3);
        let small = jump(|x| 1.0 + x + if x > 0.777 { 0.01 } else { 0.0 });
        assert!((small - 0.01 / 1.78).abs() < 1e-3, "{small}");
        let hidden = jump(|x| 2.0 + (200.0 * (x - 0.2)).tanh() + if x > 0.5 { 0.02 } else { 0.0 });
        assert!((hidden - 0.02 / 3.0).abs() < 1e-3, "{hidden}");
        // Below the bound: not a jump.
        assert!(jump(|x| 1.0 + if x > 0.5 { 0.1 * BOUND } else { 0.0 }) <= BOUND);
        assert_eq!(
            jump(|x| if x > 0.9 { f64::NAN } else { 0.0 }),
            f64::INFINITY
        );
    }
}
