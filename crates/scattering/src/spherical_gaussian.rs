//! Spherical Gaussians `exp(2 (omega . axis - 1) / lambda^2)`, the lights of Xu 2011 Eq 1.

use std::f64::consts::PI;

use crate::circular_gaussian::sharpness;

/// Integral over the sphere, the solid angle of a light of width `lambda` (> 0, finite) in sr:
/// `2 pi (1 - e^(-2 kappa)) / kappa` with `kappa = 2 / lambda^2`.
pub fn solid_angle(lambda: f64) -> f64 {
    let kappa = sharpness(lambda);
    2.0 * PI * -(-2.0 * kappa).exp_m1() / kappa
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate_tanh_sinh;

    #[test]
    fn solid_angle_is_the_integral() {
        for lambda in [0.1, 0.5, 1.5, 10.0] {
            // Over 1 - cos of the angle to the axis.
            let [expected] = integrate_tanh_sinh(0.0, 2.0, 6, |down, _| {
                [2.0 * PI * (-2.0 * down / (lambda * lambda)).exp()]
            });
            assert!(
                (solid_angle(lambda) / expected - 1.0).abs() < 1e-10,
                "{lambda}"
            );
        }
        assert!((solid_angle(0.001) / (PI * 1e-6) - 1.0).abs() < 1e-12);
        assert!((solid_angle(1000.0) / (4.0 * PI) - 1.0).abs() < 1e-5);
    }
}
