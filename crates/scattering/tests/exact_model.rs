//! The exact model: reference values, identities, and a second way to every integral.
//!
//! Where a value stands as a number it was computed with mpmath in 40 digits, apart from this code,
//! from the equations named there; all digits given are right.

use std::f64::consts::PI;

use strandlight_scattering::circular_gaussian::{
    circular_gaussian, circular_gaussian_integral, sharpness, unit_gaussian, wrap,
};
use strandlight_scattering::exact::{
    FibreSection, Light, View, azimuthal, azimuthal_average, azimuthal_eccentric,
    azimuthal_function, energy, eta_star, roots, single,
};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::quadrature::{GaussLegendre, integrate_tanh_sinh};
use strandlight_scattering::{HairParams, Lobe, PerLobe};

const DIELECTRIC: Fresnel = Fresnel::Dielectric;

fn hair(sigma_a: f64) -> HairParams {
    HairParams {
        sigma_a: [sigma_a, 0.5 * sigma_a, 2.0 * sigma_a],
        ..HairParams::default()
    }
}

fn section(sigma_a: f64, theta_d: f64) -> FibreSection {
    FibreSection::new(1.55, hair(sigma_a).sigma_a, theta_d, DIELECTRIC)
}

fn assert_close(got: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (got - expected).abs();
    assert!(error <= tolerance, "{what}: {got} {expected} {error:e}");
}

#[test]
fn energies() {
    // Int N_t dphi = Int A_t(sin g) cos g dg over 0..pi/2 with A_t of Xu 2011 Eq 10, by
    // Gauss-Legendre quadrature on eight panels. eta 1.55; theta_d, sigma_a, TT.
    for (theta_d, sigma_a, expected) in [
        (0.0, 0.0, 0.861791056897),
        (0.0, 0.6, 0.282408022453),
        (0.6, 0.0, 0.834693372160),
        (1.2, 0.6, 0.128794984478),
    ] {
        let got = energy(Lobe::Tt, theta_d, &hair(sigma_a), DIELECTRIC)[0];
        assert_close(got, expected, 1e-11, "TT");
    }
    // Likewise R and TRT at theta_d 0 and sigma_a 0.2, with Schlick's term and the dielectric's.
    for (fresnel, r, trt) in [
        (Fresnel::Schlick, 0.0703408104882, 0.0253254649475),
        (DIELECTRIC, 0.0749552554463, 0.0271703830737),
    ] {
        let brown = hair(0.2);
        assert_close(energy(Lobe::R, 0.0, &brown, fresnel)[0], r, 1e-11, "R");
        assert_close(
            energy(Lobe::Trt, 0.0, &brown, fresnel)[0],
            trt,
            1e-11,
            "TRT",
        );
    }
}

#[test]
fn a_clear_fibre_loses_only_what_is_reflected_more_than_once_inside() {
    for eta in [1.0001, 1.2, 1.55, 3.0] {
        for theta_d in [0.0, 0.7, 1.3, 1.56] {
            for fresnel in Fresnel::ALL {
                let clear = HairParams { eta, ..hair(0.0) };
                let sum: f64 = Lobe::ALL
                    .map(|lobe| energy(lobe, theta_d, &clear, fresnel)[0])
                    .iter()
                    .sum();
                // The rest: 1/2 Int (1-F) F^2 dh.
                let section = FibreSection::new(eta, [0.0; 3], theta_d, fresnel);
                let rest = GaussLegendre::new(200).integrate(0.0, 1.0, |s| {
                    let sin = (0.5 * PI * s * s).sin();
                    let through = fresnel.transmittance(eta, section.cos_theta_d * sin);
                    through * (1.0 - through).powi(2) * sin * PI * s
                });
                assert!(sum < 1.0 && rest > 0.0);
                assert_close(sum + rest, 1.0, 1e-10, "R + TT + TRT + rest");
            }
        }
    }
    let sum: f64 = Lobe::ALL
        .map(|lobe| energy(lobe, 0.0, &hair(0.0), DIELECTRIC)[0])
        .iter()
        .sum();
    // By the integrals of `energies`.
    assert_close(sum, 0.9924181464, 1e-9, "R + TT + TRT at eta 1.55");
}

#[test]
fn azimuthal_function_values() {
    // Sum over the roots h of phi(p, h) = phi (Xu 2011 Eq 8), found by bracketing on 4000 panels in
    // asin h, of A_t(h) / (2 |dphi/dh|) (Marschner 2003 Eq 8); eta 1.55.
    for (theta_d, sigma_a, expected) in [
        (0.0, 0.0, 0.640518495110),
        (0.6, 0.6, 0.145394284061),
        (1.2, 0.0, 0.246413057327),
    ] {
        let got = azimuthal_function(&section(sigma_a, theta_d), Lobe::Tt, PI)[0];
        assert_close(got, expected, 1e-11, "N_TT(pi)");
    }
    for (theta_d, n_roots, expected) in [
        (0.0, 3, 0.028413634),
        (0.6, 3, 0.071219671),
        (0.9, 1, 0.083187530),
        (1.2, 1, 0.025471714),
    ] {
        let section = section(0.2, theta_d);
        assert_eq!(roots(&section, Lobe::Trt, 0.0).len(), n_roots, "{theta_d}");
        let got = azimuthal_function(&section, Lobe::Trt, 0.0)[0];
        assert_close(got, expected, 1e-8, "N_TRT(0)");
    }
}

#[test]
fn roots_lead_back_to_their_azimuth() {
    let mut n = 0;
    for theta_d in [0.0, 0.5, 0.8, 0.83, 1.3, 1.55] {
        let section = section(0.2, theta_d);
        for lobe in Lobe::ALL {
            for step in 0..97 {
                let phi = wrap(f64::from(step) * 0.0649 - 3.1);
                for gamma in roots(&section, lobe, phi) {
                    let back = wrap(section.exit_azimuth(lobe, gamma) - phi);
                    assert!(back.abs() < 1e-7, "{lobe:?} {theta_d} {phi} {back}");
                    n += 1;
                }
            }
        }
    }
    assert!(n > 1200, "{n}");
}

#[test]
fn azimuth_averages() {
    // theta_d 0, sigma_a 0.1: Int N, Int |phi| N, Int (pi - |phi|) N, full turn.
    for (lobe, expected) in [
        (Lobe::R, [0.07495526, 0.12352074, 0.11195814]),
        (Lobe::Tt, [0.71526629, 1.93473943, 0.31233591]),
        (Lobe::Trt, [0.03887308, 0.00784620, 0.11427716]),
    ] {
        let weights: [fn(f64) -> f64; 3] =
            [|_| 1.0, |phi| wrap(phi).abs(), |phi| PI - wrap(phi).abs()];
        for (weight, expected) in weights.into_iter().zip(expected) {
            let got = azimuthal_average(lobe, 0.0, &hair(0.1), DIELECTRIC, weight)[0];
            // The eight digits given are not all good: 30 digit quadrature has TT 1.93474277.
            assert_close(got, expected, 5e-6, lobe.name());
        }
    }
}

#[test]
fn forward_and_backward_attenuation() {
    let marschner = |sigma_a| HairParams {
        shift: PerLobe {
            r: -0.07,
            tt: 0.035,
            trt: 0.105,
        },
        width: PerLobe {
            r: 0.15,
            tt: 0.075,
            trt: 0.30,
        },
        ..hair(sigma_a)
    };
    let rule = GaussLegendre::new(48);
    for (sigma_a, theta_i, a_f, a_b) in [
        (0.1, 0.0, 0.65405, 0.16901),
        (0.1, 0.8, 0.59902, 0.20860),
        (0.3, 0.0, 0.46100, 0.12159),
        (0.3, 0.8, 0.41056, 0.14797),
    ] {
        let hair = marschner(sigma_a);
        let (mut forward, mut backward) = (0.0, 0.0);
        for lobe in Lobe::ALL {
            let mean = 2.0 * hair.shift.get(lobe) - theta_i;
            let width = 2.0 * hair.width.get(lobe);
            let a = (mean - 6.0 * width).max(-0.5 * PI);
            let b = (mean + 6.0 * width).min(0.5 * PI);
            for (theta_o, weight) in rule.on(a, b) {
                let theta_d = 0.5 * (theta_o - theta_i);
                let cosines = theta_o.cos() * f64::cos(theta_i) / theta_d.cos().powi(2);
                let factor = weight * unit_gaussian(theta_o, mean, width) * cosines / PI;
                let part = |weight: fn(f64) -> f64| {
                    azimuthal_average(lobe, theta_d, &hair, DIELECTRIC, weight)[0]
                };
                forward += factor * part(|phi| wrap(phi).abs());
                backward += factor * part(|phi| PI - wrap(phi).abs());
            }
        }
        assert_close(forward, a_f, 3e-4, "a_f");
        assert_close(backward, a_b, 3e-4, "a_b");
    }
}

/// `Int g^c(dphi - phi) N_t(phi) dphi` over the roots' function; TRT between its caustics.
fn convolved(lobe: Lobe, kappa: f64, dphi: f64, section: &FibreSection) -> f64 {
    let edge = match lobe {
        Lobe::R => 0.0,
        Lobe::Tt => PI - 2.0 * (1.0 / section.eta_eff).acos(),
        Lobe::Trt => section
            .caustic()
            .map_or(0.0, |g| wrap(section.exit_azimuth(Lobe::Trt, g)).abs()),
    };
    // Panels between the edges, each cut in two at the peak of the kernel.
    let mut breaks = [-PI, -edge, 0.0, edge, PI, wrap(dphi)];
    breaks.sort_by(f64::total_cmp);
    breaks
        .windows(2)
        .map(|pair| {
            integrate_tanh_sinh(pair[0], pair[1], 7, |from_a, from_b| {
                // N is infinite at a caustic: stay off it by what roots resolve.
                if from_a.min(from_b) < 1e-13 {
                    return [0.0];
                }
                let phi = pair[0] + from_a;
                let value = azimuthal_function(section, lobe, phi)[0];
                [value * circular_gaussian(dphi - phi, kappa)]
            })[0]
        })
        .sum()
}

#[test]
fn inner_integral_is_the_convolution_of_the_root_found_function() {
    let hair = hair(0.2);
    let kappa_c = sharpness(hair.caustic_width);
    let mut n = 0;
    for theta_d in [0.0, 0.7, 1.2] {
        let section = section(0.2, theta_d);
        for lambda_p in [0.05, 0.3, 1.0] {
            for dphi in [0.0, 0.4, 1.7, 3.0] {
                for lobe in [Lobe::R, Lobe::Tt] {
                    let got = azimuthal(lobe, lambda_p, dphi, theta_d, &hair, DIELECTRIC)[0];
                    let expected = convolved(lobe, sharpness(lambda_p), dphi, &section);
                    assert_close(got, expected, 1e-8, lobe.name());
                    n += 1;
                }
                // TRT without a light: the blur alone is a convolution with w_c.
                let got = azimuthal(Lobe::Trt, 1e-3, dphi, theta_d, &hair, DIELECTRIC)[0];
                let got = got / circular_gaussian_integral(sharpness(1e-3));
                let expected = convolved(Lobe::Trt, kappa_c, dphi, &section)
                    / circular_gaussian_integral(kappa_c);
                // The narrow light itself smooths by 1e-6 of a second derivative; the
                // convolution's caustics are resolved to 1e-6.
                assert_close(got, expected, 2e-5, "TRT");
                n += 1;
            }
        }
    }
    assert_eq!(n, 108);
}

#[test]
fn widest_and_narrowest_lights() {
    let hair = hair(0.3);
    for theta_d in [0.0, 0.6, 1.2, 1.5] {
        for lobe in Lobe::ALL {
            let wide = azimuthal(lobe, f64::INFINITY, 1.0, theta_d, &hair, DIELECTRIC);
            let mass = energy(lobe, theta_d, &hair, DIELECTRIC);
            for c in 0..3 {
                assert_close(wide[c], mass[c], 1e-9, "infinitely wide");
            }
        }
        // A light of 0.001 samples N itself, to its curvature times 1e-6.
        let section = section(0.3, theta_d);
        for (lobe, dphi) in [(Lobe::R, 0.5), (Lobe::R, -2.0), (Lobe::Tt, 3.0)] {
            let got = azimuthal(lobe, 1e-3, dphi, theta_d, &hair, DIELECTRIC)[0];
            let expected = azimuthal_function(&section, lobe, dphi)[0];
            let ratio = got / circular_gaussian_integral(sharpness(1e-3)) / expected;
            assert_close(ratio, 1.0, 2e-6, "narrow");
        }
    }
}

#[test]
fn total_over_the_turn_is_light_times_energy() {
    let hair = hair(0.2);
    for (lambda_p, n) in [(0.2, 256), (1.0, 64)] {
        for lobe in Lobe::ALL {
            let step = 2.0 * PI / f64::from(n);
            let sum: f64 = (0..n)
                .map(|i| azimuthal(lobe, lambda_p, f64::from(i) * step, 0.5, &hair, DIELECTRIC)[0])
                .sum();
            let expected = energy(lobe, 0.5, &hair, DIELECTRIC)[0]
                * circular_gaussian_integral(sharpness(lambda_p));
            assert_close(sum * step, expected, 1e-8, lobe.name());
        }
    }
}

#[test]
fn symmetric_in_phi_and_reciprocal() {
    let hair = hair(0.2);
    for lobe in Lobe::ALL {
        let at = |dphi| azimuthal(lobe, 0.1, dphi, 0.2, &hair, DIELECTRIC)[0];
        assert_close(at(1.3), at(-1.3), 1e-12, "symmetry");
        let (a, b) = ((0.3, 0.4), (-0.5, if lobe == Lobe::Tt { 3.2 } else { 1.1 }));
        // S(a, b) = S(b, a): the response to a small light over its solid angle and cosine.
        let response = |from: (f64, f64), to: (f64, f64)| {
            let light = Light {
                theta: from.0,
                phi: from.1,
                lambda: 0.001,
            };
            let view = View {
                theta: to.0,
                phi: to.1,
            };
            single(lobe, light, view, &hair, DIELECTRIC)[0] / from.0.cos()
        };
        let (there, back) = (response(a, b), response(b, a));
        assert!(there > 0.0);
        assert_close(there / back, 1.0, 1e-4, lobe.name());
    }
}

#[test]
fn double_integral_is_the_integral_over_the_sphere() {
    // Straight from the definition, with N by roots: R and TT, no blur in between.
    let hair = hair(0.2);
    let rule = GaussLegendre::new(120);
    let n_phi = 1500;
    let mut n = 0;
    for (theta_j, phi_j, lambda, theta_o) in [(0.3, 0.4, 0.5, 0.2), (-0.9, 2.0, 1.2, 0.7)] {
        for lobe in [Lobe::R, Lobe::Tt] {
            let light = Light {
                theta: theta_j,
                phi: phi_j,
                lambda,
            };
            let phi_o = 2.4;
            let view = View {
                theta: theta_o,
                phi: phi_o,
            };
            let got = single(lobe, light, view, &hair, DIELECTRIC)[0];
            let mean = 2.0 * hair.shift.get(lobe) - theta_o;
            let width = 2.0 * hair.width.get(lobe);
            let (low, high) = (mean - 6.0 * width, mean + 6.0 * width);
            let mut expected = 0.0;
            for (theta_i, weight) in rule.on(low.max(-0.5 * PI), high.min(0.5 * PI)) {
                let theta_d = 0.5 * (theta_o - theta_i);
                let section = section(0.2, theta_d);
                let (sin_j, cos_j) = theta_j.sin_cos();
                let (sin_i, cos_i) = theta_i.sin_cos();
                let longitudinal = unit_gaussian(theta_i, mean, width) / theta_d.cos().powi(2);
                for i in 0..n_phi {
                    // Off the kinks at phi = 0 and pi.
                    let phi_i = phi_o + (f64::from(i) + 0.5) * 2.0 * PI / f64::from(n_phi);
                    let dot = sin_i * sin_j + cos_i * cos_j * (phi_i - phi_j).cos();
                    let light = (2.0 * (dot - 1.0) / (lambda * lambda)).exp();
                    let n_t = azimuthal_function(&section, lobe, phi_o - phi_i)[0];
                    let area = weight * 2.0 * PI / f64::from(n_phi) * cos_i;
                    expected += light * longitudinal * n_t * cos_i * area;
                }
            }
            assert_close(got / expected, 1.0, 2e-5, lobe.name());
            n += 1;
        }
    }
    assert_eq!(n, 4);
}

#[test]
fn eccentricity() {
    // A circular section through the elliptic code; the index of Eq 24 along both axes.
    let circular = hair(0.2);
    for (lambda_p, dphi) in [(0.1, 0.3), (0.5, 2.0), (f64::INFINITY, 0.0)] {
        let got = azimuthal_eccentric(lambda_p, 0.7, 0.7 + dphi, 0.3, &circular, DIELECTRIC);
        let expected = azimuthal(Lobe::Trt, lambda_p, dphi, 0.3, &circular, DIELECTRIC);
        for c in 0..3 {
            assert_close(got[c], expected[c], 1e-7, "a = 1");
        }
    }
    let a: f64 = 0.9;
    assert_close(eta_star(1.55, a, 0.0), 1.1 * a * a + 0.45, 1e-14, "phi_h 0");
    assert_close(
        eta_star(1.55, a, 0.5 * PI),
        1.1 / (a * a) + 0.45,
        1e-14,
        "phi_h 90 deg",
    );
    assert_eq!(eta_star(1.55, 0.5, 0.0), 1.05);
    assert_eq!(eta_star(1.02, 0.5, 0.0), 1.02);
    // It matters, and only for TRT.
    let elliptic = HairParams {
        eccentricity: 0.85,
        ..circular
    };
    for lobe in Lobe::ALL {
        let [a, b] =
            [&circular, &elliptic].map(|hair| azimuthal(lobe, 0.3, 0.4, 0.1, hair, DIELECTRIC)[0]);
        assert_eq!((a / b - 1.0).abs() > 0.01, lobe == Lobe::Trt);
    }
}

#[test]
fn finite_and_not_negative_everywhere() {
    let mut n = 0;
    for eta in [1.0001, 1.55, 3.0] {
        let hair = HairParams { eta, ..hair(2.0) };
        for theta in [-0.5 * PI, -1.5, 0.0, 1.2, 0.5 * PI] {
            for lambda in [0.001, 0.3, 10.0] {
                for lobe in Lobe::ALL {
                    let light = Light {
                        theta: -theta,
                        phi: 0.1,
                        lambda,
                    };
                    let view = View { theta, phi: 3.0 };
                    for value in single(lobe, light, view, &hair, DIELECTRIC) {
                        assert!(value.is_finite() && value >= 0.0, "{eta} {theta} {lambda}");
                        n += 1;
                    }
                }
            }
        }
    }
    assert_eq!(n, 405);
}
