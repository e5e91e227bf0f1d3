//! Circular Gaussians g^c(x; mu, lambda) = exp(kappa (cos(x - mu) - 1)), kappa = 2 / lambda^2.
//! Twin: `shaders/lib/circular_gaussian.wgsl`.

use core::f32::consts::PI;

use super::special::{bessel_i0e, bessel_i0e_fast};

/// Integral of a circular Gaussian over the circle, C_0 = 2 pi exp(-kappa) I_0(kappa), exact.
pub fn c_0(kappa: f32) -> f32 {
    2.0 * PI * bessel_i0e(kappa)
}

/// Integral over the circle of the product of two circular Gaussians of sharpness `kappa_1`,
/// `kappa_2` whose centres are apart by delta; `sin_half` = sin(delta / 2), either sign.
///
/// Xu 2011 (preprint App C and F): the product is a circular Gaussian of sharpness kappa_3, whose
/// integral is taken as sqrt(pi) lambda_3 as published, but never above the 2 pi of a constant
/// (the published one grows without bound for opposite equal lobes). Its height is
/// exp(kappa_3 - kappa_1 - kappa_2), written without the cancellation of that form:
/// kappa_3^2 = (kappa_1 + kappa_2)^2 - 4 kappa_1 kappa_2 sin^2(delta / 2).
/// Sharpnesses 0.02..=2e6 stay finite.
pub fn product_integral(kappa_1: f32, kappa_2: f32, sin_half: f32) -> f32 {
    let s = (sin_half * sin_half).min(1.0);
    let sum = kappa_1 + kappa_2;
    let product = 4.0 * kappa_1 * kappa_2;
    let difference = kappa_1 - kappa_2;
    let kappa_3 = (difference * difference + product * (1.0 - s)).sqrt();
    let width = (2.0 * PI / kappa_3.max(1e-6)).sqrt().min(2.0 * PI);
    width * (-product * s / (sum + kappa_3)).exp()
}

/// Integral over the circle of the product of two circular Gaussians of sharpness `kappa_1`,
/// `kappa_2` >= 0 (sum at most 1e7) whose centres are apart by delta, over 2 pi; `sin_half_2` =
/// sin^2(delta / 2). In 0..=1.
///
/// exp(kappa_3 - kappa_1 - kappa_2) exp(-kappa_3) I_0(kappa_3), exact but for
/// [`bessel_i0e_fast`]; written as [`product_integral`] without cancellation.
pub fn lobe_integral(kappa_1: f32, kappa_2: f32, sin_half_2: f32) -> f32 {
    let sum = kappa_1 + kappa_2;
    let fall = 4.0 * kappa_1 * kappa_2 * sin_half_2;
    let kappa_3 = (sum * sum - fall).max(0.0).sqrt();
    (-fall / (sum + kappa_3).max(1e-30)).exp() * bessel_i0e_fast(kappa_3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_matches_quadrature_for_narrow_lobes() {
        let n = 200_000;
        for (l_1, l_2, delta) in [(0.1f64, 0.2, 0.3), (0.3, 0.05, -0.2), (0.02, 0.02, 0.05)] {
            let (k_1, k_2) = (2.0 / (l_1 * l_1), 2.0 / (l_2 * l_2));
            let step = std::f64::consts::TAU / f64::from(n);
            let exact: f64 = (0..n)
                .map(|i| {
                    let x = f64::from(i) * step;
                    step * (k_1 * (x.cos() - 1.0) + k_2 * ((x - delta).cos() - 1.0)).exp()
                })
                .sum();
            let value = product_integral(k_1 as f32, k_2 as f32, (delta / 2.0).sin() as f32);
            // sqrt(pi) lambda_3 misses 1/(8 kappa_3) of it: 0.3 % at lambda_3 = 0.09.
            let tolerance = 1.0 / (8.0 * (k_1 + k_2 - 4.0 * k_1.min(k_2) * delta * delta)) + 1e-4;
            assert!(
                (f64::from(value) / exact - 1.0).abs() < tolerance.max(4e-3),
                "{value} {exact}"
            );
        }
    }

    #[test]
    fn lobe_integral_matches_quadrature() {
        use crate::special::bessel_i0_scaled;
        let mut worst = 0.0f64;
        for k_1 in [0.0f64, 1e-3, 0.3, 2.0, 30.0, 800.0, 2e4] {
            for k_2 in [0.0f64, 0.02, 1.0, 9.0, 50.0, 3e3] {
                for delta in [0.0f64, 0.05, 0.4, 1.5, 3.0, 3.1] {
                    let s = (0.5 * delta).sin();
                    let value = f64::from(lobe_integral(k_1 as f32, k_2 as f32, (s * s) as f32));
                    let k_3 = (k_1 * k_1 + k_2 * k_2 + 2.0 * k_1 * k_2 * delta.cos()).sqrt();
                    let exact = (k_3 - k_1 - k_2).exp() * bessel_i0_scaled(k_3);
                    worst = worst.max((value - exact).abs() / (exact + 1e-6));
                }
            }
        }
        assert!(worst < 2e-4, "{worst}");
    }

    #[test]
    fn extremes_stay_finite() {
        for k_1 in [1e-3f32, 0.02, 2.0, 2e3, 2e6] {
            for k_2 in [1e-3f32, 0.02, 2.0, 2e3, 2e6] {
                for sin_half in [0.0f32, 1e-4, 0.5, 1.0, -1.0, 1.000_000_1] {
                    let value = product_integral(k_1, k_2, sin_half);
                    assert!(
                        (0.0..=2.0001 * PI).contains(&value),
                        "{k_1} {k_2} {sin_half} {value}"
                    );
                }
            }
        }
    }
}
