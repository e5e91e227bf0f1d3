//! N_t(phi) by the roots of phi(p, h) = phi (Xu 2011 Eq 9): for plots and tests.

use std::f64::consts::{FRAC_PI_2, PI};

use super::fibre::FibreSection;
use crate::circular_gaussian::wrap;
use crate::hair::Lobe;

/// All offset angles gamma in +-pi/2 whose path leaves at `phi` (any turn), rising. R and TT have
/// one (TT none outside `|phi - pi| <= 2 acos(1/eta_eff)`), TRT one or three.
pub fn roots(section: &FibreSection, lobe: Lobe, phi: f64) -> Vec<f64> {
    let phi = wrap(phi);
    match lobe {
        Lobe::R => vec![-0.5 * phi],
        Lobe::Tt => {
            // h = cos(phi/2) / sqrt(1 + a^2 - 2 a sin(phi/2)), a = 1/eta_eff, phi in (0, 2 pi).
            let phi = if phi < 0.0 { phi + 2.0 * PI } else { phi };
            let a = 1.0 / section.eta_eff;
            let (sin, cos) = (0.5 * phi).sin_cos();
            if sin < a {
                return Vec::new();
            }
            let h = cos / (1.0 + a * a - 2.0 * a * sin).sqrt();
            vec![h.clamp(-1.0, 1.0).asin()]
        }
        Lobe::Trt => trt_roots(section, phi),
    }
}

/// Bisection on each monotone branch, for every whole turn in reach.
fn trt_roots(section: &FibreSection, phi: f64) -> Vec<f64> {
    // Odd in gamma, within +-pi: phi(2, h) - 2 pi.
    let azimuth = |gamma: f64| section.exit_azimuth(Lobe::Trt, gamma) - 2.0 * PI;
    let mut branches = vec![-FRAC_PI_2, FRAC_PI_2];
    if let Some(caustic) = section.caustic() {
        branches.insert(1, -caustic);
        branches.insert(2, caustic);
    }
    let mut found: Vec<f64> = Vec::new();
    for pair in branches.windows(2) {
        for turn in [-1.0, 0.0, 1.0] {
            let target = phi + turn * 2.0 * PI;
            let (mut low, mut high) = (pair[0], pair[1]);
            let rising = azimuth(high) >= azimuth(low);
            let below = |gamma: f64| (azimuth(gamma) < target) == rising;
            if !below(low) || below(high) {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if below(middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            found.push(0.5 * (low + high));
        }
    }
    found.sort_by(f64::total_cmp);
    found.dedup_by(|a, b| (*a - *b).abs() < 1e-14);
    found
}

/// N_t(phi), per channel: `sum over roots of 1/2 |d phi / dh|^(-1) A_t(h)`; infinite at a
/// caustic, not blurred by w_c.
pub fn azimuthal_function(section: &FibreSection, lobe: Lobe, phi: f64) -> [f64; 3] {
    let mut total = [0.0; 3];
    for gamma in roots(section, lobe, phi) {
        let (sin, cos) = gamma.sin_cos();
        // |d phi / dh| = |d phi / d gamma| / cos gamma
        let weight = 0.5 * cos / section.exit_azimuth_slope(lobe, gamma).abs();
        let kept = section.attenuation(lobe, sin, cos);
        for c in 0..3 {
            total[c] += weight * kept[c];
        }
    }
    total
}
