//! Light that other fibres have scattered forward: psi_f of dual scattering (Xu 2011 Eq 4, 5).

use std::f64::consts::FRAC_PI_2;

use super::single::check_direction;
use crate::circular_gaussian::unit_gaussian;
use crate::hair::{ParamError, in_range};
use crate::quadrature::GaussLegendre;

/// Beyond this many widths a Gaussian is left out: erfc(6.5) = 4e-20.
pub(super) const REACH: f64 = 6.5;

/// A cone of light of unit mass around a direction:
///
/// `psi_f = s_f(phi_i) g^u(theta_i; theta, sigma_f) / Z`, `s_f = 1/pi` where
/// `|phi_i - phi| < pi/2` and 0 elsewhere, `Z = Int g^u cos(theta_i) dtheta_i` over +-pi/2.
///
/// Xu divides by cos(theta) instead of Z, which lets the mass grow without bound towards grazing
/// and for wide cones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward {
    /// Inclination of its axis, +-pi/2.
    pub theta: f64,
    /// Azimuth of its axis, +-1e6.
    pub phi: f64,
    /// Width of its Gaussian, Xu's sense, 0.001..=10.
    pub sigma_f: f64,
}

impl Forward {
    /// Checks every field against its documented range.
    ///
    /// # Errors
    /// The first field outside its range, by name and value.
    pub fn validate(&self) -> Result<(), ParamError> {
        check_direction(["light.theta", "light.phi"], self.theta, self.phi)?;
        in_range("sigma_f", self.sigma_f, 0.001, 10.0)
    }

    /// `g^u(theta_i; theta, sigma_f) / Z` as a function of theta_i.
    pub fn longitudinal(self) -> impl Fn(f64) -> f64 {
        let norm = self.norm();
        move |theta_i| norm * unit_gaussian(theta_i, self.theta, self.sigma_f)
    }

    /// `1 / Z`, by panels of 12 Gauss-Legendre nodes: good to 1e-10 of it.
    pub fn norm(&self) -> f64 {
        let (low, high) = self.window();
        let rule = GaussLegendre::new(12);
        let nodes = rule.on_panels(low, high, self.sigma_f, 4..=16);
        let z: f64 = nodes
            .map(|(theta_i, weight)| {
                weight * unit_gaussian(theta_i, self.theta, self.sigma_f) * theta_i.cos()
            })
            .sum();
        z.recip()
    }

    /// Where its Gaussian lives, inside +-pi/2.
    pub(super) fn window(&self) -> (f64, f64) {
        (
            (self.theta - REACH * self.sigma_f).max(-FRAC_PI_2),
            (self.theta + REACH * self.sigma_f).min(FRAC_PI_2),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate_tanh_sinh;

    #[test]
    fn has_unit_mass() {
        for theta in [-FRAC_PI_2, -1.5, 0.0, 0.4, 1.3, FRAC_PI_2] {
            for sigma_f in [0.001, 0.01, 0.3, 1.0, 3.0, 10.0] {
                let forward = Forward {
                    theta,
                    phi: 0.0,
                    sigma_f,
                };
                forward.validate().unwrap();
                let psi = forward.longitudinal();
                let mass = integrate_tanh_sinh(-FRAC_PI_2, FRAC_PI_2, 12, |a, b| {
                    let theta_i = if a < b { a - FRAC_PI_2 } else { FRAC_PI_2 - b };
                    [psi(theta_i) * a.min(b).sin()]
                })[0];
                assert!((mass - 1.0).abs() < 1e-9, "{theta} {sigma_f} {mass}");
            }
        }
    }

    #[test]
    fn ranges_are_checked() {
        let good = Forward {
            theta: 0.0,
            phi: 1.0,
            sigma_f: 0.3,
        };
        for (bad, field) in [
            (Forward { theta: 1.6, ..good }, "light.theta"),
            (
                Forward {
                    phi: f64::NAN,
                    ..good
                },
                "light.phi",
            ),
            (
                Forward {
                    sigma_f: 0.0009,
                    ..good
                },
                "sigma_f",
            ),
            (
                Forward {
                    sigma_f: 10.1,
                    ..good
                },
                "sigma_f",
            ),
        ] {
            assert_eq!(bad.validate().unwrap_err().field, field);
        }
    }
}
