//! How much of a circular Gaussian lies in the half circle around a lag.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::circular_gaussian::{sharpness, wrap};
use crate::special::{bessel_i_scaled, erf};

/// The indicator of `cos(x) > 0`, blurred by a circular Gaussian of unit mass; in 0..=1.
#[derive(Clone, Debug)]
pub enum HalfCircle {
    /// Not blurred.
    Sharp,
    /// By one of this sharpness, much less than a turn wide.
    Narrow(f64),
    /// `1/2 + sum c_n cos(n x)`, n = 1, 3, 5, ...
    Series(Vec<f64>),
}

/// Below this width the blur is that of a Gaussian on the line in `sin(x/2)`, with its first
/// correction: 1e-7 of it.
const NARROW: f64 = 0.03;

impl HalfCircle {
    /// Blurred by sharpness `kappa` >= 0.
    pub fn new(kappa: f64) -> HalfCircle {
        if kappa > sharpness(NARROW) {
            return HalfCircle::Narrow(kappa);
        }
        // c_n = 2/pi (-1)^((n-1)/2) / n I_n/I_0; the moments fall like exp(-n^2 / (2 kappa)).
        let n_max = (5.0 * kappa.sqrt()) as usize + 12;
        let bessel = bessel_i_scaled(n_max, kappa);
        let term = |n: usize| {
            let sign = if n % 4 == 1 { 1.0 } else { -1.0 };
            sign * 2.0 / (PI * n as f64) * bessel[n] / bessel[0]
        };
        HalfCircle::Series((1..=n_max).step_by(2).map(term).collect())
    }

    /// Its value at `x`, any turn; absolute error below 1e-6.
    pub fn at(&self, x: f64) -> f64 {
        match self {
            HalfCircle::Sharp => f64::from(u8::from(x.cos() > 0.0)),
            HalfCircle::Narrow(kappa) => {
                // One edge is within reach: Int exp(-2 kappa sin^2(y/2)) dy up to it, with
                // s = sqrt(2 kappa) sin(y/2), dy = sqrt(2/kappa) (1 + s^2/(4 kappa) + ...) ds.
                let inside = FRAC_PI_2 - wrap(x).abs();
                let s = (2.0 * kappa).sqrt() * (0.5 * inside).sin();
                let correction = s * (-s * s).exp() / (4.0 * kappa * PI.sqrt());
                0.5 * (1.0 + erf(s) - correction)
            }
            HalfCircle::Series(coefficients) => {
                // cos((n + 2) x) = 2 cos(2x) cos(n x) - cos((n - 2) x)
                let cos = x.cos();
                let step = 4.0 * cos * cos - 2.0;
                let (mut before, mut here) = (cos, cos);
                let mut sum = 0.5;
                for c in coefficients {
                    sum += c * here;
                    let next = step * here - before;
                    before = here;
                    here = next;
                }
                sum
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circular_gaussian::{circular_gaussian, circular_gaussian_integral};
    use crate::quadrature::GaussLegendre;

    #[test]
    fn is_the_share_of_the_gaussian() {
        let rule = GaussLegendre::new(24);
        for lambda in [
            0.001,
            0.01,
            0.0299,
            0.0301,
            0.1,
            0.5,
            2.0,
            30.0,
            f64::INFINITY,
        ] {
            let kappa = sharpness(lambda);
            let half = HalfCircle::new(kappa);
            for step in -12..=12 {
                for off in [0.0, 0.4, -1.0] {
                    let x = PI * f64::from(step) / 4.0 + off * lambda.min(1.0);
                    // Panels with edges where x - y = +-pi/2.
                    let reach = (8.0 * lambda).min(PI);
                    let mut edges: Vec<f64> =
                        (-8..=8).map(|ix| reach * f64::from(ix) / 8.0).collect();
                    edges.extend([wrap(x - FRAC_PI_2), wrap(x + FRAC_PI_2)]);
                    edges.retain(|y| y.abs() <= reach);
                    edges.sort_by(f64::total_cmp);
                    let inside: f64 = edges
                        .windows(2)
                        .filter(|pair| (x - 0.5 * (pair[0] + pair[1])).cos() > 0.0)
                        .map(|pair| {
                            rule.integrate(pair[0], pair[1], |y| circular_gaussian(y, kappa))
                        })
                        .sum();
                    let error = (half.at(x) - inside / circular_gaussian_integral(kappa)).abs();
                    assert!(error < 1e-6, "{lambda} {x} {error:e}");
                }
            }
        }
        assert_eq!(HalfCircle::Sharp.at(1.5), 1.0);
        assert_eq!(HalfCircle::Sharp.at(1.6 + 4.0 * PI), 0.0);
    }
}
