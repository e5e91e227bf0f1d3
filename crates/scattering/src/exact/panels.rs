//! Integrals over the width of a fibre, `1/2 Int A_t(h) weight(phi(p, h)) dh`, on panels in
//! gamma, `h = sin gamma`.

use std::f64::consts::FRAC_PI_2;

use super::fibre::FibreSection;
use super::roots::roots;
use crate::circular_gaussian::{circular_gaussian, circular_gaussian_integral};
use crate::hair::Lobe;
use crate::quadrature::integrate_adaptive;

/// Tolerance of a panel: the panel rule that is kept is orders better.
const TOLERANCE: f64 = 1e-9;

/// TRT blurred by a unit Gaussian of sharpness `kappa_c`, at `phi`: `Int u(phi - phi') N dphi'`.
pub(super) fn blurred_function(section: &FibreSection, phi: f64, kappa_c: f64) -> [f64; 3] {
    let scale = 1.0 / circular_gaussian_integral(kappa_c);
    integrate_offsets(section, Lobe::Trt, phi, kappa_c, |x| {
        scale * circular_gaussian(x, kappa_c)
    })
}

/// `1/2 Int A_t(h) kernel(dphi - phi(p, h)) dh`, `h = sin gamma`, for a kernel peaked at 0 with
/// about sharpness `kappa`.
pub(super) fn integrate_offsets(
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
