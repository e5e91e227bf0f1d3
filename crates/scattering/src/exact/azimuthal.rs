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
use super::roots::roots;
use crate::circular_gaussian::{blurred_by, circular_gaussian, sharpness};
use crate::fresnel::Fresnel;
use crate::hair::{HairParams, Lobe};
use crate::quadrature::{GaussLegendre, integrate_adaptive};
use crate::special::bessel_i0_scaled;

/// Tolerance of a panel: the panel rule that is kept is orders better.
const TOLERANCE: f64 = 1e-9;

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

/// TRT blurred by a unit Gaussian of sharpness `kappa_c`, at `phi`: `Int u(phi - phi') N dphi'`.
pub(super) fn blurred_function(section: &FibreSection, phi: f64, kappa_c: f64) -> [f64; 3] {
    let scale = 1.0 / crate::circular_gaussian::circular_gaussian_integral(kappa_c);
    integrate_offsets(section, Lobe::Trt, phi, kappa_c, |x| {
        scale * circular_gaussian(x, kappa_c)
    })
}

/// `1/2 Int A_t(h) kernel(dphi - phi(p, h)) dh`, `h = sin gamma`, for a kernel peaked at 0 with
/// about sharpness `kappa`.
fn integrate_offsets(
    section: &FibreSection,
    lobe: Lobe,
    dphi: f64,
    kappa: f64,
    kernel: impl Fn(f64) -> f64,
) -> [f64; 3] {
    let breaks = breakpoints(section, lobe, &[dphi], kappa);
    integrate_between(section, lobe, &breaks, |phi| kernel(dphi - phi))
}

/// `1/2 Int A_t(h) weight(phi(p, h)) dh` on panels between `breaks` in gamma.
pub(super) fn integrate_between(
    section: &FibreSection,
    lobe: Lobe,
    breaks: &[f64],
    weight: impl Fn(f64) -> f64,
) -> [f64; 3] {
    integrate_adaptive(breaks, TOLERANCE, |gamma| {
        let weight = weight(section.exit_azimuth(lobe, gamma));
        if weight == 0.0 {
            return [0.0; 3];
        }
        let (sin, cos) = gamma.sin_cos();
        let kept = section.attenuation(lobe, sin, cos);
        kept.map(|a| 0.5 * cos * weight * a)
    })
}

/// Panels graded towards every place where a kernel of sharpness `kappa` around the azimuths `at`
/// changes: the roots, and TRT's caustics, where phi stands still. A peak between the nodes of a
/// panel would not be seen.
pub(super) fn breakpoints(section: &FibreSection, lobe: Lobe, at: &[f64], kappa: f64) -> Vec<f64> {
    let mut breaks = vec![-FRAC_PI_2, 0.0, FRAC_PI_2];
    // Width of the kernel in phi, at most a turn's.
    let width = (2.0 / kappa.max(0.2)).sqrt();
    let mut grade = |centre: f64, scale: f64| {
        breaks.push(centre);
        let mut distance = 2.0 * scale;
        while distance < 2.0 {
            breaks.push(centre - distance);
            breaks.push(centre + distance);
            distance *= 4.0;
        }
    };
    if kappa > 2.0 {
        for gamma in at.iter().flat_map(|&phi| roots(section, lobe, phi)) {
            let slope = section.exit_azimuth_slope(lobe, gamma).abs();
            grade(gamma, width / slope.max(width.sqrt()));
        }
        if lobe == Lobe::Trt {
            // phi near the caustic: quadratic, so the kernel is sqrt(width) wide there.
            for gamma in section.caustic().into_iter().flat_map(|g| [-g, g]) {
                grade(gamma, width.sqrt());
            }
        }
    }
    breaks.retain(|x| x.abs() <= FRAC_PI_2);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
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
