//! Elliptic fibres against quadrature, and against themselves.

use super::*;
use crate::exact::{Light, View, single};

fn elliptic() -> Vec<HairParams> {
    let base = HairParams::default();
    vec![
        HairParams {
            eccentricity: 0.85,
            ..base
        },
        HairParams {
            eccentricity: 1.25,
            sigma_a: [0.0, 0.05, 0.2],
            caustic_width: 0.1,
            ..base
        },
        HairParams {
            eta: 1.4,
            eccentricity: 0.5,
            sigma_a: [0.3, 1.0, 2.5],
            caustic_width: 0.3,
            ..base
        },
        HairParams {
            eccentricity: 2.0,
            sigma_a: [0.0; 3],
            ..base
        },
    ]
}

/// `Int L S cos(theta_i) d omega_i` by a sum over the sphere.
fn sum_over_sphere(view: &BcsdfView, n: u32, radiance: impl Fn([f64; 3]) -> f64) -> [f64; 3] {
    let rule = GaussLegendre::new(8);
    let (mut total, n_phi) = ([0.0; 3], 24 * n);
    for panel in 0..n {
        let step = PI / f64::from(n);
        let start = -FRAC_PI_2 + step * f64::from(panel);
        for (theta, weight) in rule.on(start, start + step) {
            for ix in 0..n_phi {
                let omega = direction(theta, 2.0 * PI * (f64::from(ix) + 0.5) / f64::from(n_phi));
                let light = radiance(omega);
                if light < 1e-12 {
                    continue;
                }
                let area = weight * square(theta.cos()) * 2.0 * PI / f64::from(n_phi);
                let s = view.evaluate(omega).s;
                for c in 0..3 {
                    total[c] += area * light * s[c];
                }
            }
        }
    }
    total
}

#[test]
fn light_over_the_sphere_is_the_exact_integral() {
    let mut uniform = numbers(8);
    for hair in elliptic() {
        let bcsdf = Bcsdf::new(&hair, Fresnel::Dielectric, &[Lobe::Trt]).unwrap();
        for _ in 0..3 {
            let lambda = 0.3 + 0.5 * uniform();
            let (theta_o, phi_o) = (1.6 * (uniform() - 0.5), 6.3 * uniform());
            // Near the direction back, where TRT is.
            let (theta, phi) = (0.2 - theta_o, phi_o + uniform() - 0.5);
            let axis = direction(theta, phi);
            let light = |omega: [f64; 3]| {
                let cosine: f64 = (0..3).map(|c| omega[c] * axis[c]).sum();
                (2.0 * (cosine - 1.0) / square(lambda)).exp()
            };
            let found = sum_over_sphere(&bcsdf.view(direction(theta_o, phi_o)), 30, light);
            let source = Light { theta, phi, lambda };
            let eye = View {
                theta: theta_o,
                phi: phi_o,
            };
            let expected = single(Lobe::Trt, source, eye, &hair, Fresnel::Dielectric);
            for c in 0..3 {
                let error = found[c] / expected[c] - 1.0;
                assert!(error.abs() < 2e-3, "{found:?} {expected:?}");
            }
        }
    }
}

#[test]
fn samples_follow_their_density() {
    let mut checked = 0;
    for (ix, hair) in elliptic().iter().enumerate() {
        // TRT alone, and all modes.
        for modes in [&[Lobe::Trt][..], &Lobe::ALL] {
            let bcsdf = Bcsdf::new(hair, Fresnel::Dielectric, modes).unwrap();
            for (jx, (theta_o, phi_o)) in [(0.0, 0.7), (1.0, -1.7)].into_iter().enumerate() {
                let n = 60_000;
                let view = bcsdf.view(direction(theta_o, phi_o));
                let (counts, expected) = histogram(&view, n, (10 * ix + jx) as u64 + 40);
                let mass: f64 = expected.iter().sum::<f64>() / n as f64;
                let z = deviation(&counts, &expected);
                println!("fibre {ix}, {theta_o} {phi_o}: {z:.2} sigma, mass {mass:.6}");
                assert!((mass - 1.0).abs() < 1e-3, "{mass}");
                assert!(z < 3.5, "{z}");
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 16);
}

/// Samples of TRT alone: their mean is the integral seen from there, the mean of all azimuths the
/// albedo, and none weighs much more than the others.
#[test]
fn slow_mean_weights_are_the_albedo() {
    for (ix, hair) in elliptic().iter().enumerate() {
        let bcsdf = Bcsdf::new(hair, Fresnel::Dielectric, &[Lobe::Trt]).unwrap();
        for theta_o in [0.0, 0.8] {
            let (mut all, mut worst) = (0.0, 0.0f64);
            let n_turns = 48;
            for turn in 0..n_turns {
                // Half a turn is the same again.
                let phi_o = 0.1 + PI * f64::from(turn) / f64::from(n_turns);
                let view = bcsdf.view(direction(theta_o, phi_o));
                let expected = sum_over_sphere(&view, 12, |_| 1.0)[0];
                let albedo = bcsdf.albedo_from(theta_o, phi_o)[0];
                worst = worst.max((albedo / expected - 1.0).abs());
                all += expected / f64::from(n_turns);
                if turn % 6 != 0 {
                    continue;
                }
                let mut uniform = numbers(ix as u64 + 70);
                let (mut sum, mut squares, mut greatest) = (0.0, 0.0, 0.0f64);
                let n = 40_000;
                for _ in 0..n {
                    let weight = view
                        .sample(&mut uniform)
                        .map_or(0.0, |sample| sample.weight[0]);
                    sum += weight;
                    squares += square(weight);
                    greatest = greatest.max(weight);
                }
                let mean = sum / f64::from(n);
                let spread = (squares / f64::from(n) - mean * mean).sqrt();
                println!(
                    "fibre {ix}, {theta_o} {phi_o:.2}: {mean:.5} of {expected:.5}, deviation {:.2}, greatest {:.2}",
                    spread / mean,
                    greatest
                );
                let error = spread / f64::from(n).sqrt();
                assert!(spread < 3.0 * mean && greatest < 4.0);
                assert!((mean - expected).abs() < 4.0 * error + 1e-3 * expected);
            }
            println!("fibre {ix}, {theta_o}: albedo_from is off by {worst:.4} at most");
            // A straight line between turns where TRT ends within one of them.
            let most = [0.03, 0.08, 0.08, 0.16][ix];
            assert!(worst < most, "{worst}");
            let albedo = bcsdf.albedo(theta_o)[0];
            println!("fibre {ix}, {theta_o}: {all:.5}, albedo {albedo:.5}");
            assert!((all / albedo - 1.0).abs() < 5e-3, "{all} {albedo}");
        }
    }
}

#[test]
fn directions_can_be_swapped() {
    let mut uniform = numbers(3);
    for hair in elliptic() {
        let bcsdf = bcsdf(&hair);
        for _ in 0..200 {
            let mut draw = || direction(3.0 * (uniform() - 0.5), 6.3 * uniform());
            let (a, b) = (draw(), draw());
            let (there, back) = (bcsdf.view(a).evaluate(b).s, bcsdf.view(b).evaluate(a).s);
            for c in 0..3 {
                assert!((there[c] - back[c]).abs() <= 1e-9 * there[c] + 1e-12);
            }
        }
    }
}

/// Turned about its axis a round fibre looks the same, an elliptic one does not: in TRT alone.
#[test]
fn roll_matters() {
    let [round, elliptic] = [1.0, 0.85].map(|eccentricity| HairParams {
        eccentricity,
        ..HairParams::default()
    });
    let seen = |hair: &HairParams, lobe: Lobe, roll: f64| {
        let bcsdf = Bcsdf::new(hair, Fresnel::Dielectric, &[lobe]).unwrap();
        let phi = if lobe == Lobe::Tt { 3.0 } else { 0.2 };
        let view = bcsdf.view(direction(0.1, roll));
        view.evaluate(direction(-0.1, roll + phi)).s[0]
    };
    for lobe in Lobe::ALL {
        let ratio = |hair| seen(hair, lobe, FRAC_PI_2) / seen(hair, lobe, 0.0);
        assert!((ratio(&round) - 1.0).abs() < 1e-9);
        let turned = ratio(&elliptic);
        match lobe {
            Lobe::Trt => assert!((turned - 1.0).abs() > 0.2, "{turned}"),
            _ => assert!((turned - 1.0).abs() < 1e-9, "{turned}"),
        }
    }
}

/// A fibre that is hardly elliptic is round within what both tables err by.
#[test]
fn nearly_round_is_round() {
    let round = HairParams::default();
    let nearly = HairParams {
        eccentricity: 1.0 + 1e-7,
        ..round
    };
    let (round, nearly) = (bcsdf(&round), bcsdf(&nearly));
    let mut uniform = numbers(4);
    let (mut worst, mut peak) = (0.0f64, 0.0f64);
    for _ in 0..2000 {
        let omega_o = direction(2.6 * (uniform() - 0.5), 6.0 * uniform());
        let omega_i = direction(2.6 * (uniform() - 0.5), 6.3 * uniform());
        let [a, b] = [&round, &nearly].map(|bcsdf| bcsdf.view(omega_o).evaluate(omega_i).s[0]);
        worst = worst.max((a - b).abs());
        peak = peak.max(a);
    }
    assert!(worst < 1e-3 * peak, "{worst:e} {peak:e}");
}

#[test]
fn extremes_are_finite() {
    let base = HairParams::default();
    let mut samples = 0;
    for (eta, eccentricity, sigma, caustic_width) in [
        (1.0001, 2.0, 0.1, 0.1),
        (3.0, 0.5, 0.0, 0.1),
        (1.55, 0.5, 50.0, 0.1),
        (1.55, 0.75, 0.2, 0.03),
        (1.02, 1.5, 1.0, 1.5),
    ] {
        let bcsdf = bcsdf(&HairParams {
            eta,
            eccentricity,
            sigma_a: [sigma; 3],
            caustic_width,
            ..base
        });
        let mut uniform = numbers(11);
        for theta_o in [0.0, 0.5, -1.5, 1.57, FRAC_PI_2, -FRAC_PI_2] {
            let view = bcsdf.view(direction(theta_o, 1.0));
            for _ in 0..300 {
                samples += usize::from(check_sample(&view, &mut uniform).is_some());
            }
            for theta_i in [0.0, theta_o, -theta_o, FRAC_PI_2, -FRAC_PI_2] {
                for phi in [0.0, 1.0, 1.0 + PI, -PI, 1e-9] {
                    let Scattered { s, pdf } = view.evaluate(direction(theta_i, phi));
                    assert!(s.iter().all(|x| x.is_finite() && *x >= 0.0));
                    assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
                }
            }
        }
        for bad in [[f64::NAN; 3], [0.0; 3]] {
            let _ = bcsdf.view(bad).evaluate(bad);
            let _ = bcsdf.view(bad).sample(&mut uniform);
        }
    }
    assert!(samples > 5_000, "{samples}");
}

#[test]
fn paint_is_refused() {
    let hair = HairParams {
        eccentricity: 1.1,
        ..HairParams::default()
    };
    let refused = PaintedBcsdf::new(&hair, Fresnel::Dielectric, &Lobe::ALL);
    let eccentricity = 1.1;
    assert_eq!(
        refused.err(),
        Some(BcsdfError::PaintedEccentric { eccentricity })
    );
    // Without TRT it is as any other.
    assert!(PaintedBcsdf::new(&hair, Fresnel::Dielectric, &[Lobe::R, Lobe::Tt]).is_ok());
}
