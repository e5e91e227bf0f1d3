//! Local multiple scattering: what many fibres send back (Xu 2011 Eq 29, Zinke 2008 Eq 10).
//!
//! ```text
//! S_back = A_b / cos^2(theta_d) s_b(phi_i, phi_o) g^u(theta_i; Delta_b - theta_o, sigma_b)
//! s_b    = 1/pi where cos(phi_i - phi_o) > 0, else 0
//! ```
//!
//! of model `energy` `S_back cos(theta_i) = A_b s_b M`, M of unit mass with the cosine ([`super::FisherLobe`]);
//! without the papers' factor 2: M has unit mass in theta_i. A_b, Delta_b, sigma_b are taken at the
//! inclination (theta_i - theta_o)/2 as in Eq 31.

use std::f64::consts::{FRAC_PI_2, PI};

use super::fisher::FisherLobe;
use super::forward::{Forward, REACH};
use super::half_circle::HalfCircle;
use super::single::{Light, View};
use crate::Model;
use crate::circular_gaussian::{circular_gaussian, sharpness, unit_gaussian, wrap};
use crate::dual_scattering::Backscatter;
use crate::quadrature::GaussLegendre;
use crate::spherical_gaussian::solid_angle;

/// `Int psi_f(omega_i) S_back cos(theta_i) d omega_i` (Xu 2011 Eq 29) per channel:
///
/// `(pi - Delta)/pi^2 1/Z Int g^u(theta_i; theta_j, sigma_f) g^u(theta_i; Delta_b - theta_o,
/// sigma_b) A_b cos^2(theta_i)/cos^2(theta_d) dtheta_i`, `Delta = |phi_o - phi_j|` in 0..=pi,
///
/// for averages `back` over the incident inclination in +-pi/2 (smooth on the scale of 0.1 rad and
/// of their own widths). Panelled Gauss-Legendre; error some 1e-7 of the largest value (tested
/// against narrower panels).
pub fn local(forward: Forward, view: View, mut back: impl FnMut(f64) -> Backscatter) -> [f64; 3] {
    let psi = forward.longitudinal();
    let lag = wrap(view.phi - forward.phi).abs();
    let overlap = (PI - lag) / (PI * PI);
    outer(
        forward.window(),
        forward.sigma_f,
        view,
        1.0,
        &mut back,
        |theta_i| overlap * psi(theta_i),
    )
}

/// `1/Omega Int G(omega_i) S_back cos(theta_i) d omega_i` per channel: [`local`] of the light
/// itself instead of psi_f, `G / Omega` a spherical Gaussian of unit mass.
///
/// Its azimuth is the share of the light's circular Gaussian within a quarter turn of phi_o.
pub fn direct_local(
    light: Light,
    view: View,
    mut back: impl FnMut(f64) -> Backscatter,
) -> [f64; 3] {
    let kappa = sharpness(light.lambda);
    let solid_angle = solid_angle(light.lambda);
    let window = (
        (light.theta - REACH * light.lambda).max(-FRAC_PI_2),
        (light.theta + REACH * light.lambda).min(FRAC_PI_2),
    );
    let dphi = view.phi - light.phi;
    outer(window, light.lambda, view, 1.0, &mut back, |theta_i| {
        let kappa_p = kappa * (theta_i.cos() * light.theta.cos()).max(0.0);
        let mass = crate::circular_gaussian::circular_gaussian_integral(kappa_p);
        let share = HalfCircle::new(kappa_p).at(dphi);
        circular_gaussian(theta_i - light.theta, kappa) * mass * share / (PI * solid_angle)
    })
}

/// Nodes at which the reach of the backscatter is looked at.
const N_SCAN: u32 = 33;

/// `Int light(theta_i) A_b g^u(theta_i; Delta_b - theta_o, sigma_b) cos^2/cos^2 dtheta_i` over
/// `low..high`, for light of this width.
fn outer(
    (mut low, mut high): (f64, f64),
    width: f64,
    view: View,
    panel: f64,
    back: &mut impl FnMut(f64) -> Backscatter,
    light: impl Fn(f64) -> f64,
) -> [f64; 3] {
    // Where g^u lives, from the extremes of its parameters; twice, as they depend on where.
    let mut scale = width.min(0.1);
    for _ in 0..2 {
        let (mut first, mut last, mut narrowest) = (high, low, width);
        for ix in 0..N_SCAN {
            let theta_i = low + (high - low) * f64::from(ix) / f64::from(N_SCAN - 1);
            let found = back(0.5 * (theta_i - view.theta));
            for c in 0..3 {
                let sigma_b = found.width_2[c].sqrt();
                let centre = match found.model {
                    Model::Marschner => found.shift[c] - view.theta,
                    // Many events take it round the sphere.
                    Model::Energy => FisherLobe::new(found.shift[c] - view.theta, sigma_b).mean(),
                };
                first = first.min(centre - (REACH + 1.0) * sigma_b);
                last = last.max(centre + (REACH + 1.0) * sigma_b);
                narrowest = narrowest.min(sigma_b);
            }
        }
        (low, high) = (low.max(first), high.min(last));
        if low >= high {
            return [0.0; 3];
        }
        scale = narrowest.min(0.1);
    }
    let rule = GaussLegendre::new(6);
    let mut total = [0.0; 3];
    for (theta_i, weight) in rule.on_panels(low, high, panel * scale, 1..=1000) {
        let ratio = theta_i.cos() / (0.5 * (view.theta - theta_i)).cos();
        let lit = weight * light(theta_i);
        if lit == 0.0 {
            continue;
        }
        let found = back(0.5 * (theta_i - view.theta));
        for (c, total) in total.iter_mut().enumerate() {
            let centre = found.shift[c] - view.theta;
            let sigma_b = found.width_2[c].sqrt();
            *total += match found.model {
                Model::Marschner => {
                    let g = unit_gaussian(theta_i, centre, sigma_b);
                    lit * ratio * ratio * found.attenuation[c] * g
                }
                Model::Energy => {
                    let m = FisherLobe::new(centre, sigma_b);
                    lit * found.attenuation[c] * m.density(theta_i)
                }
            };
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual_scattering::{Events, all_orders};
    use crate::fresnel::Fresnel;
    use crate::hair::HairParams;

    fn blond() -> HairParams {
        HairParams {
            sigma_a: [0.03, 0.1, 0.4],
            ..HairParams::default()
        }
    }

    #[test]
    fn is_the_integral_over_the_sphere() {
        let events = Events::new(&blond(), Fresnel::Dielectric);
        let table: Vec<Backscatter> = (0..=4000)
            .map(|ix| all_orders(&events.at(PI * (f64::from(ix) / 4000.0 - 0.5))))
            .collect();
        let back = |theta: f64| table[((theta / PI + 0.5) * 4000.0).round() as usize];
        let s_back = |theta_i: f64, phi: f64, view: View, c: usize| {
            let found = back(0.5 * (theta_i - view.theta));
            let cos_d = (0.5 * (theta_i - view.theta)).cos();
            let g = unit_gaussian(
                theta_i + view.theta,
                found.shift[c],
                found.width_2[c].sqrt(),
            );
            let behind = (phi - view.phi).cos() < 0.0;
            if behind {
                0.0
            } else {
                found.attenuation[c] * g / (PI * cos_d * cos_d)
            }
        };
        let (n_theta, n_phi) = (2000, 720);
        for (theta, phi, width, view) in [
            (0.2, 0.0, 0.4, (0.1, 0.5)),
            (-0.9, 2.0, 1.5, (0.3, -2.0)),
            (1.2, 1.0, 0.3, (-0.8, 1.1)),
        ] {
            let view = View {
                theta: view.0,
                phi: view.1,
            };
            let forward = Forward {
                theta,
                phi,
                sigma_f: width,
            };
            let light = Light {
                theta,
                phi,
                lambda: width,
            };
            let psi = forward.longitudinal();
            let found = [
                local(forward, view, |theta| all_orders(&events.at(theta))),
                direct_local(light, view, |theta| all_orders(&events.at(theta))),
            ];
            let kappa = sharpness(width);
            let mut expected = [0.0; 2];
            let mut mass = [0.0; 2];
            for i in 0..n_theta {
                let theta_i = PI * ((f64::from(i) + 0.5) / f64::from(n_theta) - 0.5);
                for j in 0..n_phi {
                    let phi_i = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(n_phi);
                    let cell = 2.0 * PI * PI / f64::from(n_theta * n_phi) * theta_i.cos();
                    let cos = theta_i.sin() * theta.sin()
                        + theta_i.cos() * theta.cos() * (phi_i - phi).cos();
                    let around = f64::from(u8::from((phi_i - phi).cos() > 0.0));
                    let values = [around * psi(theta_i) / PI, (kappa * (cos - 1.0)).exp()];
                    for side in 0..2 {
                        let value = cell * values[side];
                        mass[side] += value;
                        expected[side] += value * s_back(theta_i, phi_i, view, 1) * theta_i.cos();
                    }
                }
            }
            for side in 0..2 {
                let expected = expected[side] / mass[side];
                let error = (found[side][1] / expected - 1.0).abs();
                assert!(error < 8e-3, "{side} {} {expected}", found[side][1]);
            }
        }
    }

    #[test]
    fn narrower_panels_change_nothing() {
        let events = Events::new(&blond(), Fresnel::Dielectric);
        let mut back = |theta: f64| all_orders(&events.at(theta));
        let (mut peak, mut worst) = (0.0f64, 0.0f64);
        for theta in [-1.5, -0.4, 0.8] {
            for theta_o in [0.3, -1.4, 1.1] {
                for sigma_f in [0.001, 0.01, 0.2, 1.0, 3.0, 10.0] {
                    let view = View {
                        theta: theta_o,
                        phi: 0.5,
                    };
                    let forward = Forward {
                        theta,
                        phi: 0.0,
                        sigma_f,
                    };
                    let psi = forward.longitudinal();
                    let [few, many] = [1.0, 0.4].map(|panel| {
                        outer(forward.window(), sigma_f, view, panel, &mut back, &psi)
                    });
                    for c in 0..3 {
                        peak = peak.max(many[c]);
                        worst = worst.max((few[c] - many[c]).abs());
                    }
                }
            }
        }
        println!("{worst:e} of {peak:e}");
        assert!(worst < 1e-6 * peak, "{worst:e} of {peak:e}");
    }

    #[test]
    fn nothing_comes_back_from_the_far_side() {
        let forward = Forward {
            theta: 0.0,
            phi: 0.0,
            sigma_f: 0.3,
        };
        let view = |phi| View { theta: 0.0, phi };
        let back = |_| Backscatter {
            attenuation: [0.2; 3],
            shift: [0.0; 3],
            width_2: [0.1; 3],
            ..Backscatter::default()
        };
        let behind = local(forward, view(PI), back)[0];
        let front = local(forward, view(0.0), back)[0];
        assert!(behind.abs() < 1e-12 && front > 0.01, "{behind} {front}");
    }
}
