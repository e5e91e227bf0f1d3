//! Symmetries that the model has.

use serde_json::json;
use strandlight_scattering::{HairParams, Lobe, PerLobe};

use super::draw::{self, Random};
use super::point::{Evaluation, Group, Light, Point, inclination, single};
use super::report::{Check, Tally};
use super::run::Run;
use super::target::StressError;

/// Bound on exact symmetries: rounding of f32 at the narrowest lights.
const EXACT_BOUND: f64 = 1e-3;
/// Bound on reciprocity of lights of [`NARROW`]: the model has it for points only, and the light
/// seen around the fibre is wider at a grazing angle.
const RECIPROCITY_BOUND: f64 = 0.01;
const NARROW: f64 = 0.002;
/// Values below this share of a group's largest are measured against that share.
const FLOOR: f64 = 1e-2;
/// So are those below this, per unit of light mass.
const SIZE_MIN: f64 = 1e-6;
/// Pairs a fibre.
const PAIRS: usize = 8;

/// Two points whose answers, divided by their scales, must be equal.
struct Pair {
    here: Point,
    there: Point,
    scale: [f64; 2],
}

/// All symmetries.
pub fn checks(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    Ok(vec![
        symmetry(
            run,
            n,
            10,
            ("symmetry azimuthal", EXACT_BOUND),
            "N_t is even in dphi and in theta_d",
            |random, hair, lobe| {
                let point = draw::azimuthal(random, lobe, hair);
                let Point::Azimuthal {
                    lambda_p,
                    dphi,
                    theta_d,
                    ..
                } = point
                else {
                    return None;
                };
                let there = Point::Azimuthal {
                    lobe,
                    lambda_p,
                    dphi: if random.chance(0.5) { -dphi } else { dphi },
                    theta_d: -theta_d,
                };
                Some((pair(point, there), *hair))
            },
        )?,
        symmetry(
            run,
            n,
            11,
            ("symmetry mirrored azimuths", EXACT_BOUND),
            "single scattering is even in (phi_j, phi_o)",
            |random, hair, lobe| {
                let point = draw::single_point(random, lobe, hair);
                let there = with(point, |light, _, phi_o| {
                    light.phi = -light.phi;
                    *phi_o = -*phi_o;
                })?;
                Some((pair(point, there), *hair))
            },
        )?,
        symmetry(
            run,
            n,
            12,
            ("symmetry mirrored inclinations", EXACT_BOUND),
            "single scattering is even in (theta_j, theta_o, alpha)",
            |random, hair, lobe| {
                let point = draw::single_point(random, lobe, hair);
                let there = with(point, |light, theta_o, _| {
                    light.theta = -light.theta;
                    *theta_o = -*theta_o;
                })?;
                let PerLobe { r, tt, trt } = hair.shift;
                let shift = PerLobe {
                    r: -r,
                    tt: -tt,
                    trt: -trt,
                };
                Some((pair(point, there), HairParams { shift, ..*hair }))
            },
        )?,
        symmetry(
            run,
            n,
            13,
            ("reciprocity, narrow lights", RECIPROCITY_BOUND),
            "S(omega_i, omega_o) = S(omega_o, omega_i): lambda = 0.002, |theta| <= 1, beta of 5 \
             degrees and wider, w_c >= 0.1, eta >= 1.2, R not within 0.2 of phi = pi",
            reciprocal,
        )?,
    ])
}

fn pair(here: Point, there: Point) -> Pair {
    Pair {
        here,
        there,
        scale: [1.0; 2],
    }
}

/// A single-scattering point after `change` of light, theta_o, phi_o.
fn with(point: Point, change: impl FnOnce(&mut Light, &mut f64, &mut f64)) -> Option<Point> {
    let Point::Single {
        lobe,
        mut light,
        mut theta_o,
        mut phi_o,
    } = point
    else {
        return None;
    };
    change(&mut light, &mut theta_o, &mut phi_o);
    Some(Point::Single {
        lobe,
        light,
        theta_o,
        phi_o,
    })
}

/// Light and view exchanged. A light as narrow as this answers S cos(theta_j) pi lambda^2.
fn reciprocal(random: &mut Random, hair: &HairParams, lobe: Lobe) -> Option<(Pair, HairParams)> {
    let (alpha, beta) = (hair.shift.get(lobe), hair.width.get(lobe));
    if beta < 0.087 || hair.caustic_width < 0.1 || hair.eta < 1.2 {
        return None;
    }
    let lambda = single(NARROW);
    let theta_j = random.uniform(-1.0, 1.0);
    let theta_o = (2.0 * alpha - theta_j + random.uniform(-3.0, 3.0) * beta).clamp(-1.0, 1.0);
    let (theta_j, theta_o) = (inclination(theta_j), inclination(theta_o));
    let (phi_j, phi_o) = (draw::phi(random), draw::phi(random));
    // R has a kink at phi = pi, which two lights of different width round differently.
    if lobe == Lobe::R && (0.5 * (phi_o - phi_j)).cos().abs() < 0.1 {
        return None;
    }
    let at = |theta: f64, phi: f64, theta_o: f64, phi_o: f64| Point::Single {
        lobe,
        light: Light { theta, phi, lambda },
        theta_o,
        phi_o,
    };
    let pair = Pair {
        here: at(theta_j, phi_j, theta_o, phi_o),
        there: at(theta_o, phi_o, theta_j, phi_j),
        scale: [theta_j.cos(), theta_o.cos()],
    };
    Some((pair, *hair))
}

/// One symmetry over random fibres; `draw` answers a pair and the fibre of its second point,
/// which is the same for every pair of a fibre.
fn symmetry(
    run: &Run,
    n: usize,
    purpose: u64,
    (name, bound): (&str, f64),
    note: &str,
    draw: impl Fn(&mut Random, &HairParams, Lobe) -> Option<(Pair, HairParams)> + Sync,
) -> Result<Check, StressError> {
    let [tally] = run.tallies(n.div_ceil(3 * PAIRS), purpose, name, |random| {
        let mut tally = Tally::with_percentiles();
        let hair = draw::hair(random);
        let mut pairs = Vec::new();
        let mut other = hair;
        for lobe in Lobe::ALL {
            for _ in 0..PAIRS {
                if let Some((pair, second)) = draw(random, &hair, lobe) {
                    pairs.push(pair);
                    other = second;
                }
            }
        }
        let side = |hair, points| run.target.cpu(&Group { hair, points });
        let here = side(hair, pairs.iter().map(|pair| pair.here).collect())?;
        let there = side(other, pairs.iter().map(|pair| pair.there).collect())?;
        let scaled = |pair: &Pair, ix: usize, value: f32| {
            f64::from(value) / (pair.scale[ix] * pair.here.light_mass())
        };
        for lobe in Lobe::ALL {
            let of_lobe = || {
                let both = pairs.iter().zip(here.iter().zip(&there));
                both.filter(move |(pair, _)| pair.here.lobe() == lobe)
            };
            let largest = of_lobe()
                .flat_map(|(pair, (a, _))| a.map(|x| scaled(pair, 0, x)))
                .fold(0.0, f64::max);
            for (pair, (a, b)) in of_lobe() {
                for c in 0..3 {
                    let (x, y) = (scaled(pair, 0, a[c]), scaled(pair, 1, b[c]));
                    let size = x.max(y).max(FLOOR * largest).max(SIZE_MIN);
                    let error = if x == y { 0.0 } else { (x - y).abs() / size };
                    tally.see(error, || {
                        let queries = [pair.here.query(&hair), pair.there.query(&other)];
                        [json!(a), json!(b), json!(queries)]
                    });
                }
            }
        }
        Ok([tally])
    })?;
    Ok(tally.check(name, "cpu", Some(bound), note))
}
