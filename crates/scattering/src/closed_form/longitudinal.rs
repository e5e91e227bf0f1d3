//! The Gaussian part of Eq 11 in theta_i: the light times M_t (Xu 2011 section 4.2.2). Twin:
//! `shaders/lib/longitudinal.wgsl`.

use super::constants::SQRT_PI;

/// The product of the light's Gaussian in theta_i and M_t: exp(ln_b) g(theta_i; mean, lambda).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Longitudinal {
    /// Centre, inside the hull of the two centres; may leave +-pi/2.
    pub mean: f32,
    /// Width, Xu's sense.
    pub lambda: f32,
    /// Logarithm of how far the product is below the peak of M_t, <= 0.
    pub ln_b: f32,
    /// Peak 1 / (2 sqrt(pi) beta) of M_t.
    pub peak: f32,
}

/// Product of g(theta_i; theta_j, lambda_j) and M_t = g^u(theta_i; 2 alpha - theta_o, 2 beta),
/// which has unit mass in theta_i.
pub fn longitudinal(
    theta_j: f32,
    lambda_j: f32,
    theta_o: f32,
    alpha: f32,
    beta: f32,
) -> Longitudinal {
    let centre = 2.0 * alpha - theta_o;
    let variance_j = lambda_j * lambda_j;
    let variance_m = 4.0 * beta * beta;
    let sum = variance_j + variance_m;
    let apart = theta_j - centre;
    Longitudinal {
        mean: theta_j - apart * (variance_j / sum),
        lambda: 2.0 * beta * (lambda_j / sum.sqrt()),
        ln_b: -apart * apart / sum,
        peak: 0.5 / (SQRT_PI * beta),
    }
}
