//! M_t of model `energy`: a von Mises-Fisher lobe, in double precision.
//!
//! Directions around a unit vector at inclination mu with the density of von Mises and Fisher,
//! `exp(cos(angle) / v)` normalised over the sphere, have the inclinations (d'Eon 2011 Eq 7)
//!
//! ```text
//! M(theta_i) cos(theta_i),
//! M = exp(sin(theta_i) sin(mu) / v) I_0(cos(theta_i) cos(mu) / v) / (2 v sinh(1/v))
//! ```
//!
//! so that `Int M cos(theta_i) dtheta_i = 1` over +-pi/2 for every mu and v: nothing is cut off at the
//! ends as a Gaussian is. `mu = 2 alpha - theta_o`; of Xu's width w (of the full angle) `v = w^2 / 2`.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::circular_gaussian::wrap;
use crate::special::bessel_i0_scaled;

/// The lobe around one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FisherLobe {
    /// Inclination of the direction, +-pi/2.
    mean: f64,
    /// v.
    variance: f64,
    /// `1 / (v (1 - exp(-2/v)))`.
    norm: f64,
}

impl FisherLobe {
    /// Around inclination `mean`, which may lie beyond a pole: then it is the direction there, on the
    /// other side; of Xu's `width` > 0.
    pub fn new(mean: f64, width: f64) -> FisherLobe {
        let variance = 0.5 * width * width;
        let mean = wrap(mean);
        FisherLobe {
            mean: if mean.abs() > FRAC_PI_2 {
                PI.copysign(mean) - mean
            } else {
                mean
            },
            variance,
            norm: -1.0 / (variance * (-2.0 / variance).exp_m1()),
        }
    }

    /// Inclination of the direction, +-pi/2.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// `2 sin^2((theta_i - mean)/2) / v`: minus the logarithm of the lobe but for what varies slowly.
    pub fn fall(&self, theta_i: f64) -> f64 {
        let s = (0.5 * (theta_i - self.mean)).sin();
        2.0 * s * s / self.variance
    }

    /// `M cos(theta_i)`: density of the inclination, of mass 1 over +-pi/2.
    ///
    /// `exp(sin sin / v + cos cos / v) = exp(1/v - fall)`, so that nothing overflows.
    pub fn density(&self, theta_i: f64) -> f64 {
        let cos = theta_i.cos().max(0.0);
        let x = cos * self.mean.cos().max(0.0) / self.variance;
        self.norm * cos * bessel_i0_scaled(x) * (-self.fall(theta_i)).exp()
    }

    /// An inclination distributed as [`FisherLobe::density`]; `uniform` gives numbers in 0..1. Exact,
    /// from two of them: the cosine of the angle to the direction, and a turn around it.
    pub fn sample(&self, uniform: &mut impl FnMut() -> f64) -> f64 {
        let u = uniform();
        // 1 - cosine, of density exp(-x / v) on 0..=2.
        let below = -self.variance * (u * (-2.0 / self.variance).exp_m1()).ln_1p();
        let below = below.clamp(0.0, 2.0);
        let around = (below * (2.0 - below)).max(0.0).sqrt();
        let turn = (2.0 * PI * uniform()).cos();
        let (sin, cos) = self.mean.sin_cos();
        (sin * (1.0 - below) + cos * around * turn)
            .clamp(-1.0, 1.0)
            .asin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::GaussLegendre;
    use crate::random::SplitMix64;

    const MEANS: [f64; 9] = [-2.0, -1.57, -1.2, -0.3, 0.0, 0.8, 1.5, 1.7, 4.0];
    const WIDTHS: [f64; 6] = [0.004, 0.1, 0.35, 1.0, 3.0, 60.0];

    /// Mass over `low..=high` in +-pi/2.
    fn mass(lobe: &FisherLobe, low: f64, high: f64) -> f64 {
        let rule = GaussLegendre::new(12);
        let panel = lobe.variance.sqrt().min(0.1);
        // Nothing is left 12 standard deviations off.
        let reach = 12.0 * lobe.variance.sqrt();
        let (low, high) = (low.max(lobe.mean - reach), high.min(lobe.mean + reach));
        rule.on_panels(low, high, panel, 1..=u32::MAX)
            .map(|(theta, weight)| weight * lobe.density(theta))
            .sum()
    }

    #[test]
    fn nothing_is_lost_at_any_inclination_and_width() {
        let mut worst = 0.0f64;
        for mean in MEANS {
            for width in WIDTHS {
                let lobe = FisherLobe::new(mean, width);
                worst = worst.max((mass(&lobe, -FRAC_PI_2, FRAC_PI_2) - 1.0).abs());
            }
        }
        println!("mass off 1 by {worst:e}");
        assert!(worst < 1e-10, "{worst:e}");
    }

    #[test]
    fn is_the_density_on_the_sphere_over_the_azimuth() {
        let lobe = FisherLobe::new(0.9, 0.5);
        for theta in [-1.2f64, 0.2, 0.9, 1.4] {
            let n = 400;
            let around: f64 = (0..n)
                .map(|ix| {
                    let phi = 2.0 * PI * f64::from(ix) / f64::from(n);
                    let (sin, cos) = (0.9f64.sin(), 0.9f64.cos());
                    let cosine = theta.sin() * sin + theta.cos() * cos * phi.cos();
                    (cosine / lobe.variance).exp()
                })
                .sum();
            let mass = 4.0 * PI * lobe.variance * lobe.variance.recip().sinh();
            let expected = theta.cos() * around * 2.0 * PI / f64::from(n) / mass;
            assert!((lobe.density(theta) / expected - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn samples_follow_the_density() {
        let n = 200_000u32;
        let mut worst = 0.0f64;
        for (ix, mean) in [-1.4, 0.0, 0.7, 1.8].into_iter().enumerate() {
            for width in [0.05, 0.4, 2.0] {
                let lobe = FisherLobe::new(mean, width);
                let mut random = SplitMix64(ix as u64 + 3);
                let mut counts = [0u32; 24];
                for _ in 0..n {
                    let theta = lobe.sample(&mut || random.uniform(0.0, 1.0));
                    let cell = ((theta / PI + 0.5) * 24.0) as usize;
                    counts[cell.min(23)] += 1;
                }
                for (cell, count) in counts.into_iter().enumerate() {
                    let low = PI * (cell as f64 / 24.0 - 0.5);
                    let share = mass(&lobe, low, low + PI / 24.0).clamp(0.0, 1.0);
                    let deviation = (f64::from(n) * share * (1.0 - share)).sqrt().max(3.0);
                    let off = (f64::from(count) - f64::from(n) * share) / deviation;
                    worst = worst.max(off.abs());
                }
            }
        }
        println!("largest deviation {worst:.2} sigma");
        assert!(worst < 4.5, "{worst}");
    }
}
