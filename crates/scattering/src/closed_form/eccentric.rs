//! The index of an elliptic fibre (Xu 2011 Eq 24 to 26). Twin: `shaders/lib/eccentric.wgsl`.
//!
//! TRT of an elliptic fibre has at every phi_i another index, eta* = mean + swing
//! cos(phi_o + phi_i). The paper averages it over the light alone; but N_TRT is a bump around
//! phi_i = phi_o, and what counts is where light and bump overlap. With the bump as a circular
//! Gaussian of fixed sharpness the average over their product is closed. Relative RMSE of the
//! inner integral with exact N_TRT, a in 0.8..1.25, lambda' in 0.1..2: paper 20 %, the index at
//! phi_i = phi_o (no average) 8.7 %, this 7.5 %; on other draws 6.6 to 9.8 %. The best single index
//! is about as good.

use super::fibre::Fibre;
use super::frame::Lag;

/// Sharpness of the bump of N_TRT, found by search; the error is flat from 8 to 24.
pub(crate) const BUMP_SHARPNESS: f32 = 12.0;

/// Smallest (or eta, if less) and largest index of an elliptic fibre: Eq 24 passes 1 for strong
/// eccentricities, and tables end at 10. Clamped, so continuous.
pub const ETA_STAR_MIN: f32 = 1.05;
/// See [`ETA_STAR_MIN`].
pub const ETA_STAR_MAX: f32 = 10.0;

/// Mean index of an elliptic fibre over the product of the light, of sharpness `kappa` =
/// 2 / lambda'^2, and the bump of TRT; `fibre.eta` for a circular one.
pub fn eta_star(kappa: f32, lag: &Lag, fibre: &Fibre) -> f32 {
    if fibre.eta_swing == 0.0 {
        return fibre.eta;
    }
    let sum = kappa + BUMP_SHARPNESS;
    let fall = 4.0 * kappa * BUMP_SHARPNESS * (lag.sin_half * lag.sin_half);
    let kappa_3 = (sum * sum - fall).max(0.0).sqrt();
    // I_1(x) / (x I_0(x)) to 5 %, exact at 0 and to first order at infinity.
    let ratio = 1.0 / (0.5 + (kappa_3 * kappa_3 + 2.25).sqrt());
    let cosine = (kappa * lag.cos_sum + BUMP_SHARPNESS * lag.cos_view) * ratio;
    (fibre.eta_mean + fibre.eta_swing * cosine).clamp(fibre.eta.min(ETA_STAR_MIN), ETA_STAR_MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::lag_between;
    use crate::{HairParams, Lobe};

    fn at(eccentricity: f64, kappa: f32, phi_o: f32, phi_j: f32) -> f32 {
        let hair = HairParams {
            eccentricity,
            ..HairParams::default()
        };
        let fibre = Fibre::new(&hair, &Lobe::ALL, 4).unwrap();
        let lag = lag_between(phi_o.cos(), phi_o.sin(), phi_j.cos(), phi_j.sin());
        eta_star(kappa, &lag, &fibre)
    }

    #[test]
    fn limits_are_those_of_the_exact_index() {
        let exact = |eccentricity: f64, phi_h: f32| {
            crate::exact::eta_star(1.55, eccentricity, f64::from(phi_h)) as f32
        };
        for eccentricity in [0.8, 0.95, 1.0, 1.1, 1.25] {
            for (phi_o, phi_j) in [(0.3f32, 0.9f32), (-2.0, 1.4), (3.0, -0.2)] {
                // A narrow light picks its own azimuth, a wide one leaves that of the bump.
                let narrow = at(eccentricity, 1e5, phi_o, phi_j);
                assert!((narrow - exact(eccentricity, 0.5 * (phi_o + phi_j))).abs() < 2e-3);
                let wide = at(eccentricity, 0.0, phi_o, phi_j);
                let swing = exact(eccentricity, phi_o) - wide;
                assert!(swing.abs() < 0.03, "{eccentricity} {swing}");
            }
        }
    }

    #[test]
    fn extremes_are_clamped_and_continuous() {
        for eccentricity in [0.5, 0.7, 2.0] {
            let mut before = at(eccentricity, 3.0, -3.2, 0.4);
            for step in 0..640 {
                let eta = at(eccentricity, 3.0, -3.2 + 0.01 * step as f32, 0.4);
                assert!((ETA_STAR_MIN..=ETA_STAR_MAX).contains(&eta));
                assert!((eta - before).abs() < 0.08, "{eccentricity} {step}");
                before = eta;
            }
        }
    }
}
