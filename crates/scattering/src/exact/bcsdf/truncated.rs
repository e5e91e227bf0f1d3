//! Sampling of Gaussians: cut off to an interval on the line, and on the circle.

use std::f64::consts::PI;

use crate::special::{erf, erfc};

/// `g^u(x; mean, width)` cut off to `low..=high` and not normalised again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Truncated {
    mean: f64,
    width: f64,
    /// The interval in units of `width` around `mean`.
    low: f64,
    high: f64,
    /// Mass inside the interval, 0..=1.
    pub mass: f64,
}

impl Truncated {
    /// The Gaussian of Xu's `width` > 0 around `mean`, cut off to `low..=high`.
    pub fn new(mean: f64, width: f64, low: f64, high: f64) -> Self {
        let (low, high) = ((low - mean) / width, (high - mean) / width);
        let mass = if low > 0.5 {
            0.5 * (erfc(low) - erfc(high))
        } else if high < -0.5 {
            0.5 * (erfc(-high) - erfc(-low))
        } else {
            0.5 * (erf(high) - erf(low))
        };
        Truncated {
            mean,
            width,
            low,
            high,
            mass: mass.max(0.0),
        }
    }

    /// `g^u(x; mean, width)`; inside the interval this integrates to [`Truncated::mass`].
    pub fn density(&self, x: f64) -> f64 {
        let z = (x - self.mean) / self.width;
        (-z * z).exp() / (PI.sqrt() * self.width)
    }

    /// `Int density(x) f(x) dx / mass`, also where the mass itself underflows: panelled
    /// Gauss-Legendre over the part that counts.
    pub fn average<const N: usize>(
        &self,
        rule: &crate::quadrature::GaussLegendre,
        f: impl Fn(f64) -> [f64; N],
    ) -> [f64; N] {
        let nearest = 0.0f64.clamp(self.low, self.high);
        // exp(-(z^2 - nearest^2)) has fallen to e^-40 at the edge.
        let edge = (nearest * nearest + 40.0).sqrt();
        let (a, b) = (self.low.max(-edge), self.high.min(edge));
        // Panels of half a width, shorter where a tail falls faster, and never beyond 0.1 rad.
        let scale = (0.5 / (1.0 + nearest.abs())).min(0.1 / self.width);
        let (mut total, mut mass) = ([0.0; N], 0.0);
        for (z, weight) in rule.on_panels(a, b, scale, 1..=400) {
            let weight = weight * (nearest * nearest - z * z).exp();
            mass += weight;
            let value = f(self.mean + self.width * z);
            for (sum, x) in total.iter_mut().zip(value) {
                *sum += weight * x;
            }
        }
        total.map(|x| if mass > 0.0 { x / mass } else { 0.0 })
    }

    /// A number inside the interval, distributed as [`Truncated::density`]; `uniform` gives
    /// numbers in 0..1.
    ///
    /// By rejection: from the whole Gaussian where most of it is inside, evenly where the interval
    /// is short, from an exponential (Robert 1995) where only a tail is inside. All accept more
    /// than a quarter.
    pub fn sample(&self, uniform: &mut impl FnMut() -> f64) -> f64 {
        let (low, high) = (self.low, self.high);
        let z = if low > 0.0 {
            tail(low, high, uniform)
        } else if high < 0.0 {
            -tail(-high, -low, uniform)
        } else if self.mass > 0.3 {
            loop {
                let z = (-(1.0 - uniform()).ln()).sqrt() * (2.0 * PI * uniform()).cos();
                if (low..=high).contains(&z) {
                    break z;
                }
            }
        } else {
            loop {
                let z = low + (high - low) * uniform();
                if uniform() <= (-z * z).exp() {
                    break z;
                }
            }
        };
        self.mean + self.width * z
    }
}

/// A number in `low..=high` (0 < low) distributed as `exp(-z^2)`.
fn tail(low: f64, high: f64, uniform: &mut impl FnMut() -> f64) -> f64 {
    let rate = low + (low * low + 2.0).sqrt();
    let span = -(-rate * (high - low)).exp_m1();
    loop {
        let z = low - (-span * uniform()).ln_1p() / rate;
        let off = z - 0.5 * rate;
        // The greatest value that the ratio takes in the interval.
        let best = (0.5 * rate).clamp(low, high) - 0.5 * rate;
        if uniform() <= (best * best - off * off).exp() {
            return z.clamp(low, high);
        }
    }
}

/// A number in +-pi distributed as the circular Gaussian of sharpness `kappa` > 0 around 0.
///
/// Best and Fisher 1979: rejection from a wrapped Cauchy; accepts two thirds or more.
pub(super) fn sample_circular(kappa: f64, uniform: &mut impl FnMut() -> f64) -> f64 {
    let tau = 1.0 + (1.0 + 4.0 * kappa * kappa).sqrt();
    let rho = (tau - (2.0 * tau).sqrt()) / (2.0 * kappa);
    let r = (1.0 + rho * rho) / (2.0 * rho);
    loop {
        // 1 - cos x of the proposal; formed so, since r tends to 1 for narrow Gaussians.
        let half = 0.5 * PI * uniform();
        let z_minus = 2.0 * half.sin().powi(2);
        // f = (1 + r z)/(r + z) with z = 1 - z_minus
        let one_minus_f = (r - 1.0) * z_minus / (r + 1.0 - z_minus);
        let c = kappa * (r - 1.0 + one_minus_f);
        let u = uniform();
        if c * (2.0 - c) >= u || (u > 0.0 && (c / u).ln() + 1.0 - c >= 0.0) {
            let x = 2.0 * (0.5 * one_minus_f).clamp(0.0, 1.0).sqrt().asin();
            return if uniform() < 0.5 { -x } else { x };
        }
    }
}
