//! Energy of each mode against the exact one, and the white furnace.

use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::json;
use strandlight_scattering::circular_gaussian::{
    circular_gaussian, circular_gaussian_integral, sharpness, unit_gaussian,
};
use strandlight_scattering::exact;
use strandlight_scattering::quadrature::GaussLegendre;
use strandlight_scattering::{HairParams, Lobe};

use super::draw::{self, Domain, LAMBDA, LAMBDA_P_CONSTANT, Random};
use super::point::{Evaluation, Group, Light, Point, hair_json, single};
use super::report::{Check, Tally};
use super::run::Run;
use super::target::StressError;

/// Bound on the relative error of a mode's energy, and of the furnace.
const BOUND: f64 = 0.01;
/// Energies below this share of the incident energy are not compared.
const THRESHOLD: f64 = 1e-6;
/// Points around the circle of [`over_azimuth`], for lights of at least [`RING_LAMBDA`]:
/// more than two a standard deviation of the narrowest answer.
const RING: usize = 384;
const RING_LAMBDA: f64 = 0.05;

/// Feeds one channel's energy into a tally, if it is large enough to be held.
fn see(
    tally: &mut Tally,
    found: [f64; 3],
    exact: [f64; 3],
    incident: f64,
    inputs: impl Fn() -> serde_json::Value,
) {
    for (found_c, exact_c) in found.into_iter().zip(exact) {
        if exact_c > THRESHOLD * incident {
            let error = (found_c / exact_c - 1.0).abs();
            tally.see(error, || [json!(found), json!(exact), inputs()]);
        }
    }
}

/// Energy of the inner integral under a constant light, where it is the answer itself.
///
/// One check a mode of circular fibres; TRT of elliptic ones is reported apart: their index
/// under the light is one number by Eq 26, which is an approximation of its own.
pub fn under_constant_light(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let tallies = run.tallies(n, 1, "energy, constant light", |random| {
        let mut tallies = [(); 4].map(|()| Tally::with_percentiles());
        let mut hair = draw::hair(random);
        let elliptic = hair;
        hair.eccentricity = 1.0;
        let mut points = Vec::new();
        for _ in 0..8 {
            let theta_d = draw::theta_d(random, &hair);
            let dphi = draw::phi(random);
            points.extend(Lobe::ALL.map(|lobe| Point::Azimuthal {
                lobe,
                lambda_p: LAMBDA_P_CONSTANT,
                dphi,
                theta_d,
            }));
        }
        let exact = |point: &Point, hair: &HairParams| match *point {
            Point::Azimuthal { lobe, theta_d, .. } => exact_energy(run, lobe, theta_d, hair),
            Point::Single { .. } => [0.0; 3],
        };
        let group = Group { hair, points };
        let values = run.target.cpu(&group)?;
        for (point, value) in group.points.iter().zip(values) {
            let expected = exact(point, &hair);
            let tally = &mut tallies[point.lobe().p() as usize];
            see(tally, value.map(f64::from), expected, 1.0, || {
                point.query(&hair)
            });
        }
        if elliptic.eccentricity != 1.0 {
            let mut points = group.points;
            points.retain(|point| point.lobe() == Lobe::Trt);
            let group = Group {
                hair: elliptic,
                points,
            };
            let values = run.target.cpu(&group)?;
            for (point, value) in group.points.iter().zip(values) {
                let expected = exact(point, &elliptic);
                see(&mut tallies[3], value.map(f64::from), expected, 1.0, || {
                    point.query(&elliptic)
                });
            }
        }
        Ok(tallies)
    })?;
    let mut checks = Vec::new();
    for (ix, tally) in tallies.into_iter().enumerate() {
        let lobe = Lobe::ALL
            .get(ix)
            .map_or("TRT, elliptic", |lobe| lobe.name());
        let note = "relative error of the inner integral under a constant light, \
                    energies above 1e-6";
        let bound = (ix < 3).then_some(BOUND);
        checks.push(tally.check(&format!("energy azimuthal {lobe}"), "cpu", bound, note));
    }
    Ok(checks)
}

/// Exact mass of N_t; TRT of an elliptic fibre averaged over the half angle, which a light that
/// is constant around the fibre does where it is integrated over the view as well.
fn exact_energy(run: &Run, lobe: Lobe, theta_d: f64, hair: &HairParams) -> [f64; 3] {
    if lobe != Lobe::Trt || hair.eccentricity == 1.0 {
        return exact::energy(lobe, theta_d, hair, run.fresnel);
    }
    let n = 24;
    let mut mean = [0.0; 3];
    for ix in 0..n {
        let phi_h = PI * (f64::from(ix) + 0.5) / f64::from(n);
        let eta = exact::eta_star(hair.eta, hair.eccentricity, phi_h);
        let energy = exact::energy(lobe, theta_d, &HairParams { eta, ..*hair }, run.fresnel);
        for (sum, energy) in mean.iter_mut().zip(energy) {
            *sum += energy / f64::from(n);
        }
    }
    mean
}

/// Energy of the inner integral by quadrature over the azimuth, lights of width 0.05 to 3.
pub fn over_azimuth(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let tallies = run.tallies(n, 2, "energy, over azimuth", |random| {
        let mut tallies = [(); 3].map(|()| Tally::with_percentiles());
        let mut hair = draw::hair(random);
        hair.eccentricity = 1.0;
        let mut rings = Vec::new();
        for _ in 0..2 {
            let theta_d = draw::theta_d(random, &hair);
            let lambda_p = single(random.log_uniform(RING_LAMBDA, 3.0));
            rings.extend(Lobe::ALL.map(|lobe| (lobe, lambda_p, theta_d)));
        }
        let points = rings
            .iter()
            .flat_map(|&(lobe, lambda_p, theta_d)| {
                ring().map(move |dphi| Point::Azimuthal {
                    lobe,
                    lambda_p,
                    dphi,
                    theta_d,
                })
            })
            .collect();
        let group = Group { hair, points };
        let values = run.target.cpu(&group)?;
        for (&(lobe, lambda_p, theta_d), values) in rings.iter().zip(values.chunks(RING)) {
            let mass = circular_gaussian_integral(sharpness(lambda_p));
            let found = sum(values).map(|x| x * 2.0 * PI / RING as f64 / mass);
            let exact = exact::energy(lobe, theta_d, &hair, run.fresnel);
            let tally = &mut tallies[lobe.p() as usize];
            see(tally, found, exact, 1.0, || {
                json!({ "mode": lobe.name(), "lambda": lambda_p, "theta_d": theta_d,
                        "hair": hair_json(&hair) })
            });
        }
        Ok(tallies)
    })?;
    Ok(per_lobe(
        tallies,
        "energy over azimuth",
        Some(BOUND),
        "relative error of the inner integral over dphi, energies above 1e-6",
    ))
}

/// Azimuths around the circle.
fn ring() -> impl Iterator<Item = f64> {
    (0..RING).map(|ix| single(PI * (2.0 * (ix as f64 + 0.5) / RING as f64 - 1.0)))
}

fn sum(values: &[[f32; 3]]) -> [f64; 3] {
    let mut total = [0.0; 3];
    for value in values {
        for (sum, x) in total.iter_mut().zip(value) {
            *sum += f64::from(*x);
        }
    }
    total
}

fn per_lobe(tallies: [Tally; 3], name: &str, bound: Option<f64>, note: &str) -> Vec<Check> {
    let lobes = Lobe::ALL.into_iter().zip(tallies);
    lobes
        .map(|(lobe, tally)| {
            let name = format!("{name} {}", lobe.name());
            tally.check(&name, "cpu", bound, note)
        })
        .collect()
}

/// Single scattering of a light of width 10 (0.96 to 1 of its peak everywhere) at one view;
/// reported: what is held is the energy over all views.
pub fn wide_light(run: &Run, n: usize, domain: Domain) -> Result<Vec<Check>, StressError> {
    let label = format!("wide light, {}", domain.name());
    let tallies = run.tallies(n, 30 + domain as u64, &label, |random| {
        let mut tallies = [(); 3].map(|()| Tally::with_percentiles());
        let hair = domain.hair(random);
        let light = wide(random, domain);
        let (theta_o, phi_o) = (domain.theta(random), draw::phi(random));
        let points = Lobe::ALL
            .map(|lobe| Point::Single {
                lobe,
                light,
                theta_o,
                phi_o,
            })
            .to_vec();
        let group = Group { hair, points };
        let values = run.target.cpu(&group)?;
        for (point, value) in group.points.iter().zip(values) {
            let exact = reference(run, point, &hair);
            let tally = &mut tallies[point.lobe().p() as usize];
            see(tally, value.map(f64::from), exact, 1.0, || {
                point.query(&hair)
            });
        }
        Ok(tallies)
    })?;
    Ok(per_lobe(
        tallies,
        &format!("wide light {}", domain.name()),
        None,
        "relative error of single scattering, lambda = 10, values above 1e-6",
    ))
}

/// What is held for ordinary hair is reported over the extremes, where two or three nodes of the
/// outer integral do not resolve what absorption and the poles make of it.
fn bound_in(domain: Domain) -> Option<f64> {
    (domain == Domain::Ordinary).then_some(BOUND)
}

fn wide(random: &mut Random, domain: Domain) -> Light {
    Light {
        theta: domain.theta(random),
        phi: draw::phi(random),
        lambda: LAMBDA[1],
    }
}

/// The exact answer at a point.
pub fn reference(run: &Run, point: &Point, hair: &HairParams) -> [f64; 3] {
    match *point {
        Point::Azimuthal {
            lobe,
            lambda_p,
            dphi,
            theta_d,
        } => exact::azimuthal(lobe, lambda_p, dphi, theta_d, hair, run.fresnel),
        Point::Single {
            lobe,
            light,
            theta_o,
            phi_o,
        } => {
            let light = exact::Light {
                theta: light.theta,
                phi: light.phi,
                lambda: light.lambda,
            };
            let view = exact::View {
                theta: theta_o,
                phi: phi_o,
            };
            exact::single(lobe, light, view, hair, run.fresnel)
        }
    }
}

/// Single scattering of one light into all views: its energy. Held for ordinary hair; over the
/// extremes reported, and held with `nodes` nodes of the outer integral.
pub fn over_views(
    run: &Run,
    n: usize,
    domain: Domain,
    nodes: Option<u32>,
) -> Result<Vec<Check>, StressError> {
    let rule = GaussLegendre::new(24);
    let mut name = format!("energy over views {}", domain.name());
    let mut bound = bound_in(domain);
    if let Some(nodes) = nodes {
        name = format!("{name}, {nodes} nodes");
        bound = Some(BOUND);
    }
    let tallies = run.tallies(n, 32 + domain as u64, &name, |random| {
        let mut tallies = [(); 3].map(|()| Tally::with_percentiles());
        let hair = domain.hair(random);
        let light = Light {
            theta: domain.theta(random),
            phi: 0.0,
            lambda: domain.lambda(random, 2.0 * RING_LAMBDA),
        };
        let prepared = match nodes {
            Some(nodes) => run.target.prepare_with_nodes(&hair, nodes)?,
            None => run.target.prepare(&hair)?,
        };
        let incident = incident_energy(light);
        for lobe in Lobe::ALL {
            let (alpha, beta) = (hair.shift.get(lobe), hair.width.get(lobe));
            let reach = 4.5 * (light.lambda * light.lambda + 4.0 * beta * beta).sqrt();
            let mean = 2.0 * alpha - light.theta;
            let low = (mean - reach).max(-FRAC_PI_2);
            let high = (mean + reach).min(FRAC_PI_2);
            let views: Vec<(f64, f64)> = rule
                .on(low, high)
                .map(|(theta_o, weight)| (single(theta_o), weight * theta_o.cos()))
                .collect();
            let points: Vec<Point> = views
                .iter()
                .flat_map(|&(theta_o, _)| {
                    ring().map(move |phi_o| Point::Single {
                        lobe,
                        light,
                        theta_o,
                        phi_o,
                    })
                })
                .collect();
            let values = run.target.at(&prepared, &points);
            let (mut found, mut exact) = ([0.0; 3], [0.0; 3]);
            for (&(theta_o, weight), values) in views.iter().zip(values.chunks(RING)) {
                let here = sum(values);
                let there = ring_energy(run, lobe, light, theta_o, &hair);
                for c in 0..3 {
                    found[c] += weight * here[c] * 2.0 * PI / RING as f64;
                    exact[c] += weight * there[c];
                }
            }
            see(
                &mut tallies[lobe.p() as usize],
                found,
                exact,
                incident,
                || {
                    json!({ "mode": lobe.name(), "light": {
                            "theta": light.theta, "phi": light.phi, "lambda": light.lambda },
                        "hair": hair_json(&hair) })
                },
            );
        }
        Ok(tallies)
    })?;
    Ok(per_lobe(
        tallies,
        &name,
        bound,
        "relative error of single scattering integrated over all views, \
         energies above 1e-6 of the light's",
    ))
}

/// `Int G cos(theta_i) d omega_i` of a light of amplitude 1.
fn incident_energy(light: Light) -> f64 {
    let kappa = sharpness(light.lambda);
    let reach = 6.0 * light.lambda;
    let low = (light.theta - reach).max(-FRAC_PI_2);
    let high = (light.theta + reach).min(FRAC_PI_2);
    GaussLegendre::new(48).integrate(low, high, |theta| {
        let cos = theta.cos();
        let around = circular_gaussian_integral(kappa * (cos * light.theta.cos()).max(0.0));
        circular_gaussian(theta - light.theta, kappa) * around * cos * cos
    })
}

/// Exact single scattering integrated over the azimuth of the view, where N_t becomes its mass:
/// `Int M_t g^c cos^2(theta_i)/cos^2(theta_d) 2 pi I0e(kappa') E_t(theta_d) d theta_i`.
fn ring_energy(run: &Run, lobe: Lobe, light: Light, theta_o: f64, hair: &HairParams) -> [f64; 3] {
    around_fibre(lobe, light, theta_o, hair, |theta_d| {
        exact::energy(lobe, theta_d, hair, run.fresnel)
    })
}

/// As [`ring_energy`], with `mass(theta_d)` in the place of `E_t`.
fn around_fibre(
    lobe: Lobe,
    light: Light,
    theta_o: f64,
    hair: &HairParams,
    mass: impl Fn(f64) -> [f64; 3],
) -> [f64; 3] {
    let width = 2.0 * hair.width.get(lobe);
    let mean = 2.0 * hair.shift.get(lobe) - theta_o;
    let kappa = sharpness(light.lambda);
    let low = (mean - 5.0 * width)
        .max(light.theta - 5.0 * light.lambda)
        .max(-FRAC_PI_2);
    let high = (mean + 5.0 * width)
        .min(light.theta + 5.0 * light.lambda)
        .min(FRAC_PI_2);
    let mut total = [0.0; 3];
    if low >= high {
        return total;
    }
    for (theta_i, weight) in GaussLegendre::new(40).on(low, high) {
        let theta_d = 0.5 * (theta_o - theta_i);
        let (cos_i, cos_d) = (theta_i.cos(), theta_d.cos());
        let around = circular_gaussian_integral(kappa * (cos_i * light.theta.cos()).max(0.0));
        let factor = weight
            * unit_gaussian(theta_i, mean, width)
            * circular_gaussian(theta_i - light.theta, kappa)
            * (cos_i / cos_d).powi(2)
            * around;
        if factor > 1e-12 {
            let mass = mass(theta_d);
            for c in 0..3 {
                total[c] += factor * mass[c];
            }
        }
    }
    total
}

/// White furnace: no absorption, tilted lobes.
///
/// Azimuthal: the energies of the inner integrals and the exact rest (three and more internal
/// reflections) sum to 1. Single: a light of width 10 scattered by all modes and by that rest,
/// taken as isotropic with M of TRT, against the same in f64; the absolute value is reported.
pub fn furnace(run: &Run, n: usize, domain: Domain) -> Result<Vec<Check>, StressError> {
    let label = format!("white furnace, {}", domain.name());
    let [inner, single, absolute] = run.tallies(n, 34 + domain as u64, &label, |random| {
        let mut tallies = [(); 3].map(|()| Tally::with_percentiles());
        let mut hair = domain.hair(random);
        hair.sigma_a = [0.0; 3];
        let theta_d = draw::theta_d(random, &hair);
        let light = wide(random, domain);
        let (theta_o, phi_o) = (domain.theta(random), draw::phi(random));
        let mut points = Vec::new();
        for lobe in Lobe::ALL {
            points.push(Point::Azimuthal {
                lobe,
                lambda_p: LAMBDA_P_CONSTANT,
                dphi: phi_o,
                theta_d,
            });
            points.push(Point::Single {
                lobe,
                light,
                theta_o,
                phi_o,
            });
        }
        let group = Group { hair, points };
        let values = run.target.cpu(&group)?;
        let rest = |theta_d: f64| {
            let all = Lobe::ALL.map(|lobe| exact::energy(lobe, theta_d, &hair, run.fresnel)[0]);
            [1.0 - all.iter().sum::<f64>(); 3]
        };
        let (mut inner, mut outer, mut exact) = (rest(theta_d)[0], 0.0, 0.0);
        for (point, value) in group.points.iter().zip(values) {
            if matches!(point, Point::Azimuthal { .. }) {
                inner += f64::from(value[0]);
            } else {
                outer += f64::from(value[0]);
                exact += reference(run, point, &hair)[0];
            }
        }
        let at = json!({ "theta_d": theta_d, "hair": hair_json(&hair) });
        tallies[0].see((inner - 1.0).abs(), || [json!(inner), json!(1.0), at]);
        let higher = around_fibre(Lobe::Trt, light, theta_o, &hair, rest)[0] / (2.0 * PI);
        let (found, expected) = (outer + higher, exact + higher);
        let inputs = || {
            let mut query = group.points[1].query(&hair);
            query["mode"] = json!("all");
            query
        };
        if expected > THRESHOLD {
            let error = (found / expected - 1.0).abs();
            tallies[1].see(error, || [json!(found), json!(expected), inputs()]);
            let error = (found - 1.0).abs();
            tallies[2].see(error, || [json!(found), json!(1.0), inputs()]);
        }
        Ok(tallies)
    })?;
    Ok(vec![
        inner.check(
            &format!("furnace azimuthal {}", domain.name()),
            "cpu",
            Some(BOUND),
            "sigma_a = 0: energies of the inner integrals and the exact rest, off 1",
        ),
        single.check(
            &format!("furnace single {}", domain.name()),
            "cpu",
            bound_in(domain),
            "sigma_a = 0, lambda = 10, the exact rest added: relative error",
        ),
        absolute.check(
            &format!("furnace, absolute {}", domain.name()),
            "cpu",
            None,
            "the same, off 1: what the model itself loses and gains by cos^2 factors and tilt",
        ),
    ])
}
