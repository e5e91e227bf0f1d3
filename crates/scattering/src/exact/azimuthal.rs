//! The inner integral (Xu 2011 Eq 12) without roots.
//!
//! With `phi(p, h)` the azimuth at which the path through `h` leaves,
//!
//! `Int g^c(phi'; 0, lambda_p) N_t(dphi - phi') dphi' = 1/2 Int A_t(h) g^c(dphi - phi(p, h)) dh`,
//!
//! and N_t's caustics never appear. The blur of TRT by w_c turns `g^c` into the product integral
//! of two circular Gaussians, which is exact ([`crate::circular_gaussian::blurred`]).

use std::f64::consts::FRAC_PI_2;

use super::eccentric::azimuthal_eccentric;
use super::fibre::FibreSection;
use super::panels::integrate_offsets;
use crate::circular_gaussian::{blurred_by, circular_gaussian, sharpness};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::GaussLegendre;
use crate::special::bessel_i0_scaled;

/// Xu 2011 Eq 12, per channel: the light's circular Gaussian of width `lambda_p` (> 0, may be
/// infinite) around azimuth lag `dphi` = phi_o - phi_j, over N_t at `theta_d`.
///
/// TRT is blurred by `hair.caustic_width`. Absolute error below 1e-8 (tested against other
/// quadratures for lambda_p from 0.001 to infinity). For an eccentric fibre TRT also depends on
/// where light and view stand; this takes phi_j = 0, phi_o = dphi, and
/// [`azimuthal_eccentric`] takes both.
pub fn azimuthal(
    lobe: Lobe,
    lambda_p: f64,
    dphi: f64,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
) -> [f64; 3] {
    if lobe == Lobe::Trt && hair.eccentricity != 1.0 {
        return azimuthal_eccentric(lambda_p, 0.0, dphi, theta_d, hair, fresnel);
    }
    let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
    azimuthal_section(
        lobe,
        sharpness(lambda_p),
        dphi,
        &section,
        hair.caustic_width,
    )
}

/// [`azimuthal`] of a section at hand, with sharpness `kappa`.
pub(super) fn azimuthal_section(
    lobe: Lobe,
    kappa: f64,
    dphi: f64,
    section: &FibreSection,
    caustic_width: f64,
) -> [f64; 3] {
    match lobe {
        Lobe::R | Lobe::Tt => {
            integrate_offsets(section, lobe, dphi, kappa, |x| circular_gaussian(x, kappa))
        }
        Lobe::Trt => {
            let kappa_c = sharpness(caustic_width);
            let i0e_c = bessel_i0_scaled(kappa_c);
            // Width of the blurred Gaussian: 1/kappa_b = 1/kappa + 1/kappa_c.
            let kappa_b = 1.0 / (1.0 / kappa + 1.0 / kappa_c);
            integrate_offsets(section, lobe, dphi, kappa_b, |x| {
                blurred_by(x, kappa, kappa_c, i0e_c)
            })
        }
    }
}

/// Mass of N_t, `Int N_t dphi = 1/2 Int A_t(h) dh`, per channel, at `theta_d`.
///
/// R, TT and TRT of a fibre without absorption sum to less than 1: the rest takes more internal
/// reflections. Eccentricity is left out.
pub fn energy(lobe: Lobe, theta_d: f64, hair: &HairParams, fresnel: Fresnel) -> [f64; 3] {
    azimuthal_average(lobe, theta_d, hair, fresnel, |_| 1.0)
}

/// `Int weight(phi) N_t(phi) dphi = 1/2 Int A_t(h) weight(phi(p, h)) dh`, per channel, for a
/// `weight` of the unwrapped azimuth; 96 Gauss-Legendre nodes a side, so for smooth weights.
pub fn azimuthal_average(
    lobe: Lobe,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
    weight: impl Fn(f64) -> f64,
) -> [f64; 3] {
    let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
    let rule = GaussLegendre::new(96);
    let mut total = [0.0; 3];
    for side in [-1.0, 1.0] {
        // gamma = pi/2 (1 - s^2): dense near grazing.
        for (s, w) in rule.on(0.0, 1.0) {
            let gamma = side * FRAC_PI_2 * (1.0 - s * s);
            let (sin, cos) = gamma.sin_cos();
            let factor = 0.5 * cos * std::f64::consts::PI * s * w;
            let value = factor * weight(section.exit_azimuth(lobe, gamma));
            let kept = section.attenuation(lobe, sin, cos);
            for c in 0..3 {
                total[c] += value * kept[c];
            }
        }
    }
    total
}
