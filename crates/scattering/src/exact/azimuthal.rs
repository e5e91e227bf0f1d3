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
use crate::hair::{HairParams, Lobe, Model};
use crate::quadrature::GaussLegendre;
use crate::special::bessel_i0_scaled;

/// Xu 2011 Eq 12, per channel: the light's circular Gaussian of width `lambda_p` (> 0, may be
/// infinite) around azimuth lag `dphi` = phi_o - phi_j, over N_t at `theta_d`.
///
/// TRT is blurred by `hair.caustic_width`; of model `energy` it holds all further orders, evenly around
/// the fibre, and `theta_d` is theta_o. Absolute error below 1e-8 (tested against other
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
    let kappa = sharpness(lambda_p);
    let value = azimuthal_section(lobe, kappa, dphi, &section, hair.caustic_width);
    let [r, g, b] = residual(lobe, hair, &section);
    // Of N = A / 2 pi against the light's 2 pi I0e.
    let light = bessel_i0_scaled(kappa);
    [
        value[0] + light * r,
        value[1] + light * g,
        value[2] + light * b,
    ]
}

/// `1/2 Int A dh` of all orders beyond TRT, per channel: what `lobe` TRT of model `energy` holds of them.
/// Nothing of other modes and models.
pub(super) fn residual(lobe: Lobe, hair: &HairParams, section: &FibreSection) -> [f64; 3] {
    match (hair.model, lobe) {
        (Model::Energy, Lobe::Trt) => over_offsets(|_, sin, cos| (1.0, section.residual(sin, cos))),
        _ => [0.0; 3],
    }
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

/// `1/2 Int A dh` of all orders beyond TRT at the inclination of this cosine, per channel.
pub(crate) fn further_mass(hair: &HairParams, cos_theta: f64, fresnel: Fresnel) -> [f64; 3] {
    let section = FibreSection::of(hair, hair.eta, cos_theta.clamp(0.0, 1.0).acos(), fresnel);
    residual(Lobe::Trt, hair, &section)
}

/// Mass of N_t, `Int N_t dphi = 1/2 Int A_t(h) dh`, per channel, at `theta_d`.
///
/// R, TT and TRT of a fibre without absorption sum to less than 1: the rest takes more internal
/// reflections, which TRT of model `energy` holds. Eccentricity is left out.
pub fn energy(lobe: Lobe, theta_d: f64, hair: &HairParams, fresnel: Fresnel) -> [f64; 3] {
    let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
    let further = residual(lobe, hair, &section);
    let own = azimuthal_average(lobe, theta_d, hair, fresnel, |_| 1.0);
    std::array::from_fn(|c| own[c] + further[c])
}

/// `Int weight(phi) N_t(phi) dphi = 1/2 Int A_t(h) weight(phi(p, h)) dh`, per channel, for a
/// `weight` of the unwrapped azimuth; 96 Gauss-Legendre nodes a side, so for smooth weights. Orders
/// beyond TRT are left out.
pub fn azimuthal_average(
    lobe: Lobe,
    theta_d: f64,
    hair: &HairParams,
    fresnel: Fresnel,
    weight: impl Fn(f64) -> f64,
) -> [f64; 3] {
    let section = FibreSection::of(hair, hair.eta, theta_d, fresnel);
    over_offsets(|gamma, sin, cos| {
        (
            weight(section.exit_azimuth(lobe, gamma)),
            section.attenuation(lobe, sin, cos),
        )
    })
}

/// `1/2 Int factor kept dh` of what `at` answers for gamma, its sine and its cosine.
fn over_offsets(at: impl Fn(f64, f64, f64) -> (f64, [f64; 3])) -> [f64; 3] {
    let rule = GaussLegendre::new(96);
    let mut total = [0.0; 3];
    for side in [-1.0, 1.0] {
        // gamma = pi/2 (1 - s^2): dense near grazing.
        for (s, w) in rule.on(0.0, 1.0) {
            let gamma = side * FRAC_PI_2 * (1.0 - s * s);
            let (sin, cos) = gamma.sin_cos();
            let (weight, kept) = at(gamma, sin, cos);
            let value = 0.5 * cos * std::f64::consts::PI * s * w * weight;
            for c in 0..3 {
                total[c] += value * kept[c];
            }
        }
    }
    total
}
