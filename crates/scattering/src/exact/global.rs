//! Global multiple scattering: light that other fibres scattered forward, over S (Xu 2011 Eq 27).
//!
//! Its azimuth has no roots either: with `phi(p, h)` as in Eq 12,
//!
//! `N^G = 1/pi Int_{phi_j +- pi/2} N_t(phi_o - phi_i) dphi_i = 1/(2 pi) Int A_t(h) w(dphi -
//! phi(p, h)) dh`,
//!
//! w the indicator of the half circle, blurred by w_c for TRT. Panels end where w jumps.

use std::f64::consts::{FRAC_PI_2, PI};

use super::azimuthal::residual;
use super::eccentric::eta_star;
use super::fibre::FibreSection;
use super::fisher::FisherLobe;
use super::forward::Forward;
use super::half_circle::HalfCircle;
use super::panels::{blurred_function, breakpoints, integrate_between};
use super::roots::roots;
use super::single::{View, window};
use crate::circular_gaussian::{sharpness, unit_gaussian};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe, Model};
use crate::quadrature::GaussLegendre;

/// Xu 2011 Eq 28 per channel: N_t at `theta_d` averaged over the half circle of light around
/// `phi_j`; over phi_o it integrates to the mass of N_t.
///
/// TRT is blurred by w_c; for an elliptic fibre its index follows the half angle of each phi_i.
/// Absolute error some 1e-8, of an elliptic TRT 1e-6 (tested against other quadratures).
pub fn azimuthal_global(
    lobe: Lobe,
    phi_j: f64,
    phi_o: f64,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    let blur = blur_of(lobe, hair);
    azimuthal_blurred(lobe, phi_j, phi_o, theta_d, hair, fresnel, &blur)
}

/// The half circle that `lobe` sees.
fn blur_of(lobe: Lobe, hair: &HairParams) -> HalfCircle {
    match lobe {
        Lobe::R | Lobe::Tt => HalfCircle::Sharp,
        Lobe::Trt => HalfCircle::new(sharpness(hair.caustic_width)),
    }
}

fn azimuthal_blurred(
    lobe: Lobe,
    phi_j: f64,
    phi_o: f64,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
    blur: &HalfCircle,
) -> [f64; 3] {
    if lobe == Lobe::Trt && hair.eccentricity != 1.0 {
        return azimuthal_elliptic(phi_j, phi_o, theta_d, hair, fresnel);
    }
    let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
    let dphi = phi_o - phi_j;
    let edges = [dphi - FRAC_PI_2, dphi + FRAC_PI_2];
    let breaks = match lobe {
        Lobe::R | Lobe::Tt => {
            let mut breaks = vec![-FRAC_PI_2, 0.0, FRAC_PI_2];
            breaks.extend(edges.iter().flat_map(|&phi| roots(&section, lobe, phi)));
            breaks.sort_by(f64::total_cmp);
            breaks
        }
        Lobe::Trt => breakpoints(&section, lobe, &edges, sharpness(hair.caustic_width)),
    };
    let value = integrate_between(&section, lobe, &breaks, |phi| blur.at(dphi - phi) / PI);
    let further = residual(lobe, hair, &section);
    std::array::from_fn(|c| value[c] + further[c] / (2.0 * PI))
}

/// [`azimuthal_global`] of TRT by panels over phi_i, the index of Eq 24 at each.
fn azimuthal_elliptic(
    phi_j: f64,
    phi_o: f64,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    let kappa_c = sharpness(hair.caustic_width);
    let rule = GaussLegendre::new(8);
    let mut total = [0.0; 3];
    let [low, high] = [phi_j - FRAC_PI_2, phi_j + FRAC_PI_2];
    for (phi_i, weight) in rule.on_panels(low, high, 2.0 * hair.caustic_width, 4..=200) {
        let eta = eta_star(hair.eta, hair.eccentricity, 0.5 * (phi_o + phi_i));
        let section = FibreSection::of(hair, eta, theta_d, fresnel);
        let value = blurred_function(&section, phi_o - phi_i, kappa_c);
        for c in 0..3 {
            total[c] += weight / PI * value[c];
        }
    }
    total
}

/// `Int psi_f(omega_i) S_t(omega_i, omega_o) cos(theta_i) d omega_i` (Xu 2011 Eq 27) per channel:
///
/// `1/Z Int g^u(theta_i; theta_j, sigma_f) M_t cos^2(theta_i)/cos^2(theta_d) N^G dtheta_i`; of model
/// `energy` `N^G(theta_o) / Z Int g^u M_t cos(theta_i) dtheta_i`.
///
/// Panelled Gauss-Legendre where both Gaussians live. Error some 1e-6 of the lobe's peak (tested
/// against narrower panels). About a millisecond, of an elliptic TRT a hundred.
pub fn global(
    lobe: Lobe,
    forward: Forward,
    view: View,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    global_with(lobe, forward, view, hair, fresnel, 1.5)
}

/// [`global`] with panels of `panel` times the integrand's width.
fn global_with(
    lobe: Lobe,
    forward: Forward,
    view: View,
    hair: &HairParams,
    fresnel: Fresnel,
    panel: f64,
) -> [f64; 3] {
    let mean = 2.0 * hair.shift.get(lobe) - view.theta;
    let width = 2.0 * hair.width.get(lobe);
    let psi = forward.longitudinal();
    let fisher = (hair.model == Model::Energy).then(|| FisherLobe::new(mean, width));
    let (low, high) = window(&|theta: f64| {
        let z_m = (theta - mean) / width;
        let z_f = (theta - forward.theta) / forward.sigma_f;
        fisher.map_or(z_m * z_m, |m| m.fall(theta)) + z_f * z_f
    });
    // Narrower of the two Gaussians, and than what varies in the rest: 0.3 rad.
    let scale = (width.powi(-2) + forward.sigma_f.powi(-2))
        .sqrt()
        .recip()
        .min(0.3);
    let rule = GaussLegendre::new(10);
    let nodes = rule.on_panels(low, high, panel * scale, 1..=400);
    let blur = blur_of(lobe, hair);
    let (phi_j, phi_o) = (forward.phi, view.phi);
    let mut total = [0.0; 3];
    if let Some(m) = fisher {
        let share: f64 = nodes
            .map(|(theta_i, weight)| weight * psi(theta_i) * m.density(theta_i))
            .sum();
        let n = azimuthal_blurred(lobe, phi_j, phi_o, view.theta, hair, fresnel, &blur);
        return n.map(|n| share * n);
    }
    for (theta_i, weight) in nodes {
        let theta_d = 0.5 * (view.theta - theta_i);
        let ratio = theta_i.cos() / theta_d.cos();
        let m = unit_gaussian(theta_i, mean, width);
        let factor = weight * psi(theta_i) * m * ratio * ratio;
        if factor == 0.0 {
            continue;
        }
        let inner = azimuthal_blurred(lobe, phi_j, phi_o, theta_d, hair, fresnel, &blur);
        for c in 0..3 {
            total[c] += factor * inner[c];
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circular_gaussian::wrap;
    use crate::exact::{azimuthal, azimuthal_average, energy};

    const FRESNEL: Fresnel = Fresnel::Dielectric;

    fn at(lobe: Lobe, dphi: f64, theta_d: f64, hair: &HairParams) -> [f64; 3] {
        azimuthal_global(lobe, 0.3, 0.3 + dphi, theta_d, hair, FRESNEL)
    }

    #[test]
    fn is_the_blur_by_a_half_circle() {
        // Eq 12 with lights of width 0.02 along the half circle: N_t averaged, by another
        // quadrature; a light of constant 1 makes both halves.
        let hair = HairParams {
            sigma_a: [0.1, 0.5, 2.0],
            caustic_width: 0.15,
            ..HairParams::default()
        };
        for lobe in Lobe::ALL {
            for theta_d in [0.0, 0.7, 1.3] {
                for dphi in [0.0, 0.8, 1.57, 2.5, 3.1] {
                    let found = at(lobe, dphi, theta_d, &hair);
                    // The circular Gaussian of width 0.02 has mass close to sqrt(pi) 0.02.
                    let n = 1600;
                    let mass =
                        crate::circular_gaussian::circular_gaussian_integral(sharpness(0.02));
                    let mut expected = [0.0; 3];
                    for i in 0..n {
                        let phi_i = PI * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
                        if i % 8 == 4 {
                            let value =
                                azimuthal(lobe, 0.02, dphi - phi_i, theta_d, &hair, FRESNEL);
                            for c in 0..3 {
                                expected[c] += value[c] / mass * 8.0 / f64::from(n);
                            }
                        }
                    }
                    for c in 0..3 {
                        let error = (found[c] - expected[c]).abs();
                        assert!(error < 2e-3, "{lobe:?} {theta_d} {dphi} {error:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn opposite_half_circles_make_the_energy() {
        for (eta, eccentricity) in [(1.0001, 1.0), (1.2, 1.0), (1.55, 1.0), (3.0, 1.0)] {
            let hair = HairParams {
                eta,
                eccentricity,
                caustic_width: 0.05,
                ..HairParams::default()
            };
            for theta_d in [0.0, 0.9, 1.5] {
                for lobe in Lobe::ALL {
                    for dphi in [0.0, 1.0, 1.57, 2.2] {
                        let a = at(lobe, dphi, theta_d, &hair);
                        let b = at(lobe, dphi + PI, theta_d, &hair);
                        let whole = energy(lobe, theta_d, &hair, FRESNEL);
                        for c in 0..3 {
                            let error = (PI * (a[c] + b[c]) - whole[c]).abs();
                            assert!(error < 1e-6, "{eta} {theta_d} {lobe:?} {dphi} {error:e}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn averages_over_the_view_are_those_of_the_lag() {
        // Over the half circle opposite the light the share of N_t is |phi| / pi.
        let hair = HairParams::default();
        let rule = GaussLegendre::new(200);
        for lobe in [Lobe::R, Lobe::Tt] {
            let found: f64 = rule.integrate(FRAC_PI_2, 1.5 * PI, |x| at(lobe, x, 0.4, &hair)[1]);
            let lag = |phi: f64| wrap(phi).abs() / PI;
            let expected = azimuthal_average(lobe, 0.4, &hair, FRESNEL, lag)[1];
            assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
        }
    }

    #[test]
    fn an_elliptic_fibre_goes_over_into_a_round_one() {
        let round = HairParams {
            caustic_width: 0.2,
            ..HairParams::default()
        };
        let nearly = HairParams {
            eccentricity: 1.0 + 1e-9,
            ..round
        };
        for dphi in [0.2, 1.4, 2.9] {
            let (a, b) = (
                at(Lobe::Trt, dphi, 0.5, &round),
                at(Lobe::Trt, dphi, 0.5, &nearly),
            );
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() < 1e-7, "{dphi} {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn narrower_panels_change_nothing() {
        let hair = HairParams::default();
        let mut checked = 0;
        for lobe in Lobe::ALL {
            let (mut peak, mut worst) = (0.0f64, 0.0f64);
            for theta in [-1.5, -0.4, 0.8] {
                for (theta_o, dphi) in [(0.3, 0.1), (-1.4, 1.6), (1.1, 2.9)] {
                    for sigma_f in [0.001, 0.01, 0.2, 1.0, 3.0, 10.0] {
                        let forward = Forward {
                            theta,
                            phi: 0.0,
                            sigma_f,
                        };
                        let view = View {
                            theta: theta_o,
                            phi: dphi,
                        };
                        let [few, many] = [1.5, 0.5]
                            .map(|panel| global_with(lobe, forward, view, &hair, FRESNEL, panel));
                        for c in 0..3 {
                            peak = peak.max(many[c]);
                            worst = worst.max((few[c] - many[c]).abs());
                            checked += 1;
                        }
                    }
                }
            }
            println!("{}: {worst:e} of {peak:e}", lobe.name());
            assert!(
                worst < 1e-5 * peak,
                "{}: {worst:e} of {peak:e}",
                lobe.name()
            );
        }
        assert_eq!(checked, 3 * 54 * 3);
    }
}
