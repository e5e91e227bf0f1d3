//! Circular Gaussians in f64: `g^c(x; mu, lambda) = exp(2 (cos(x - mu) - 1) / lambda^2)`
//! (Xu 2011 Table 1), and the unit Gaussian on the line.
//!
//! Functions take the sharpness `kappa = 2 / lambda^2`, which has no infinity: 0 is the constant
//! 1. [`sharpness`] converts.

use crate::special::bessel_i0_scaled;
use std::f64::consts::PI;

/// `kappa = 2 / lambda^2` of Xu's bandwidth `lambda` > 0 (infinite: 0).
pub fn sharpness(lambda: f64) -> f64 {
    2.0 / (lambda * lambda)
}

/// `exp(kappa (cos x - 1))`, with the small difference formed as `-2 sin^2(x/2)`.
pub fn circular_gaussian(x: f64, kappa: f64) -> f64 {
    let s = (0.5 * x).sin();
    (-2.0 * kappa * s * s).exp()
}

/// Integral of [`circular_gaussian`] over a full turn: `2 pi I0e(kappa)`.
pub fn circular_gaussian_integral(kappa: f64) -> f64 {
    2.0 * PI * bessel_i0_scaled(kappa)
}

/// `Int g^c(x - y; kappa_1) g^c(y; kappa_2) dy / Int g^c(y; kappa_2) dy`: the first Gaussian
/// blurred by the second, made of unit mass.
///
/// Exact: with `kappa_3 = |kappa_1 + kappa_2 e^(ix)|`, it is `exp(kappa_3 - kappa_1 - kappa_2)
/// I0e(kappa_3) / I0e(kappa_2)`; the exponent is formed without cancellation.
pub fn blurred(x: f64, kappa_1: f64, kappa_2: f64) -> f64 {
    blurred_by(x, kappa_1, kappa_2, bessel_i0_scaled(kappa_2))
}

/// [`blurred`] with `i0e_2 = I0e(kappa_2)` at hand.
pub(crate) fn blurred_by(x: f64, kappa_1: f64, kappa_2: f64, i0e_2: f64) -> f64 {
    let s = (0.5 * x).sin();
    let product = 4.0 * kappa_1 * kappa_2 * s * s;
    let sum = kappa_1 + kappa_2;
    let kappa_3 = (sum * sum - product).max(0.0).sqrt();
    let exponent = if product > 0.0 {
        -product / (sum + kappa_3)
    } else {
        0.0
    };
    if exponent < -745.0 {
        return 0.0;
    }
    exponent.exp() * bessel_i0_scaled(kappa_3) / i0e_2
}

/// `g^u(x; mu, lambda) = exp(-(x - mu)^2 / lambda^2) / (sqrt(pi) lambda)`, of unit mass.
pub fn unit_gaussian(x: f64, mu: f64, lambda: f64) -> f64 {
    let z = (x - mu) / lambda;
    (-z * z).exp() / (PI.sqrt() * lambda)
}

/// `x` brought into (-pi, pi] by whole turns.
pub fn wrap(x: f64) -> f64 {
    let turns = ((x - PI) / (2.0 * PI)).ceil();
    x - turns * 2.0 * PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blur_is_the_convolution() {
        // The trapezoid rule is exact for periodic functions this smooth.
        let n = 4096;
        for (lambda_1, lambda_2) in [(0.1, 0.2), (0.5, 0.02), (3.0, 0.7), (f64::INFINITY, 0.3)] {
            let (k_1, k_2) = (sharpness(lambda_1), sharpness(lambda_2));
            for x in [0.0, 0.3, -2.0, 3.1] {
                let step = 2.0 * PI / f64::from(n);
                let sum: f64 = (0..n)
                    .map(|i| {
                        let y = f64::from(i) * step;
                        circular_gaussian(x - y, k_1) * circular_gaussian(y, k_2) * step
                    })
                    .sum();
                let expected = sum / circular_gaussian_integral(k_2);
                assert!((blurred(x, k_1, k_2) - expected).abs() < 1e-12);
            }
        }
        // Very narrow: a plain difference of sharpnesses would lose every digit.
        let got = blurred(0.01, sharpness(0.001), sharpness(0.2));
        let expected = 0.001 / 0.040001f64.sqrt() * (-1e-4f64 / 0.040001).exp();
        assert!((got / expected - 1.0).abs() < 1e-2);
    }

    #[test]
    fn wrapping() {
        assert_eq!(wrap(PI), PI);
        assert_eq!(wrap(-PI), PI);
        assert!((wrap(7.0) - (7.0 - 2.0 * PI)).abs() < 1e-15);
        assert!((wrap(-100.0) + 100.0 - 32.0 * PI).abs() < 1e-12);
    }
}
