//! The functions of the tables `H_TT`, `H_TRT`: moments of the attenuation over the offset h.
//!
//! `H_k = Int_{-1}^{1} h^k (1-F)^2 F^(p-1) dh` for k = 0, 2, 4, 6 and p = 1 (TT), 2 (TRT), F at
//! the incidence cosine `cos(theta_d) sqrt(1 - h^2)`; Xu 2011 Eq 19, 23 without absorption.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::fresnel::{Fresnel, dielectric_transmittance};
use crate::quadrature::{GaussLegendre, integrate_tanh_sinh};

/// `H_0, H_2, H_4, H_6`.
pub type Moments = [f64; 4];

/// Moments of both modes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HMoments {
    /// Of TT.
    pub tt: Moments,
    /// Of TRT.
    pub trt: Moments,
}

/// Reflectance at offset angle gamma as the tables' columns see it: column variable `x` is
/// `eta / eta_eff` for the dielectric, `cos(theta_d)` for Schlick
/// ([`crate::table_layout::h_column`]).
///
/// With `cos(theta_d) = x s`, `s^2 = (eta^2-1)/(eta^2-x^2)`, both cosines of the dielectric term
/// share the factor s, which cancels: it stays regular at eta = 1.
fn transmittance(fresnel: Fresnel, eta: f64, x: f64, sin_gamma: f64, cos_gamma: f64) -> f64 {
    match fresnel {
        Fresnel::Dielectric => {
            let xh = x * sin_gamma;
            let q = ((eta - xh) * (eta + xh)).sqrt();
            // Where both cosines vanish (eta = x = h = 1) nothing is reflected.
            if q == 0.0 {
                return 1.0;
            }
            dielectric_transmittance(eta, x * cos_gamma, q)
        }
        Fresnel::Schlick => fresnel.transmittance(eta, x * cos_gamma),
    }
}

/// `h^k (1-F)^2 F^(p-1) dh/dgamma` of TT (k = 0, 2, 4, 6), then of TRT.
fn moment_integrand(
    fresnel: Fresnel,
    eta: f64,
    x: f64,
    sin_gamma: f64,
    cos_gamma: f64,
) -> [f64; 8] {
    let through = transmittance(fresnel, eta, x, sin_gamma, cos_gamma);
    let tt = through * through * cos_gamma;
    let trt = tt * (1.0 - through);
    let h_2 = sin_gamma * sin_gamma;
    let h_4 = h_2 * h_2;
    let powers = [1.0, h_2, h_4, h_2 * h_4];
    std::array::from_fn(|i| powers[i % 4] * if i < 4 { tt } else { trt })
}

/// Computes [`MomentRule::moments`]; holds the quadrature rule.
#[derive(Clone, Debug)]
pub struct MomentRule {
    /// `sin gamma`, `cos gamma`, weight over h in -1..=1.
    nodes: Vec<[f64; 3]>,
}

impl MomentRule {
    /// Gauss-Legendre in s with `h = sin gamma`, `gamma = pi/2 (1 - s^2)`: dense near grazing,
    /// where the branch points of the Fresnel term come close as eta nears 1. 32 nodes give 1e-10
    /// for eta >= 1.01, 64 for eta >= 1.0001.
    pub fn new(n: usize) -> Self {
        let nodes = GaussLegendre::new(n)
            .on(0.0, 1.0)
            .map(|(s, weight)| {
                // sin(pi/2 (1 - s^2)) = cos(pi/2 s^2)
                let (sin, cos) = (FRAC_PI_2 * s * s).sin_cos();
                [cos, sin, 2.0 * PI * s * weight]
            })
            .collect();
        MomentRule { nodes }
    }

    /// Both modes' moments at index `eta` >= 1 and column variable `x` in 0..=1
    /// ([`crate::table_layout::h_column`]).
    pub fn moments(&self, fresnel: Fresnel, eta: f64, x: f64) -> HMoments {
        let mut sums = [0.0; 8];
        for &[sin, cos, weight] in &self.nodes {
            let values = moment_integrand(fresnel, eta, x, sin, cos);
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
        let [a, b, c, d, e, f, g, h] = sums;
        HMoments {
            tt: [a, b, c, d],
            trt: [e, f, g, h],
        }
    }
}

/// [`MomentRule::moments`] by the tanh-sinh rule in gamma with 257 nodes: slower, and independent
/// of the nodes the tables are baked with.
pub fn moments_tanh_sinh(fresnel: Fresnel, eta: f64, x: f64) -> HMoments {
    let sums = integrate_tanh_sinh(0.0, FRAC_PI_2, 5, |gamma, from_grazing| {
        moment_integrand(fresnel, eta, x, gamma.sin(), from_grazing.sin())
    });
    HMoments {
        tt: std::array::from_fn(|i| 2.0 * sums[i]),
        trt: std::array::from_fn(|i| 2.0 * sums[i + 4]),
    }
}

/// Schlick's moments as finite sums of Beta functions.
///
/// `1 - F = (1 - F_0) q(c u)` with `u = sqrt(1-h^2)`, `c = cos(theta_d)`, `q(y) = 1 - (1-y)^5`,
/// and `Int h^k u^n dh = B((k+1)/2, n/2 + 1)`. Absolute error 1e-11 by cancellation.
pub fn schlick_moments(eta: f64, cos_theta_d: f64) -> HMoments {
    let f_0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
    let q = [0.0, 5.0, -10.0, 10.0, -5.0, 1.0];
    let q_2 = multiply(&q, &q);
    let q_3 = multiply(&q_2, &q);
    let integral = |polynomial: &[f64], k: usize| {
        let mut power = 1.0;
        let mut sum = 0.0;
        for (n, coefficient) in polynomial.iter().enumerate() {
            sum += coefficient * power * beta_integral(k, n);
            power *= cos_theta_d;
        }
        sum
    };
    let through = 1.0 - f_0;
    let mut moments = HMoments::default();
    for i in 0..4 {
        let (j_2, j_3) = (integral(&q_2, 2 * i), integral(&q_3, 2 * i));
        moments.tt[i] = through * through * j_2;
        moments.trt[i] = through * through * (j_2 - through * j_3);
    }
    moments
}

/// Coefficients of the product of two polynomials.
fn multiply(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; a.len() + b.len() - 1];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            product[i + j] += a * b;
        }
    }
    product
}

/// `Int_{-1}^{1} h^k (1-h^2)^(n/2) dh` for even k, by its recurrences.
fn beta_integral(k: usize, n: usize) -> f64 {
    let mut value = if n.is_multiple_of(2) { 2.0 } else { FRAC_PI_2 };
    let mut m = n % 2;
    while m < n {
        m += 2;
        value *= m as f64 / (m as f64 + 1.0);
    }
    let mut j = 0;
    while j < k {
        j += 2;
        value *= (j as f64 - 1.0) / ((n + j) as f64 + 1.0);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table_layout::h_column;

    fn close(got: Moments, expected: Moments, tolerance: f64) {
        for i in 0..4 {
            let error = (got[i] / expected[i] - 1.0).abs();
            assert!(error < tolerance, "{got:?} {expected:?} {error:e}");
        }
    }

    #[test]
    fn golden_values_dielectric() {
        let rule = MomentRule::new(32);
        let eta = 1.55;
        let golden = [
            (
                0.0f64,
                [
                    1.72358211379,
                    0.525723968734,
                    0.293081019493,
                    0.196458621633,
                ],
                [
                    0.111343668089,
                    0.0495637713376,
                    0.0347313969438,
                    0.0273420707252,
                ],
            ),
            (
                0.6,
                [
                    1.66938674432,
                    0.493502932095,
                    0.269536188501,
                    0.177927410451,
                ],
                [
                    0.12777360664,
                    0.0575160485219,
                    0.0396532038701,
                    0.0306510592624,
                ],
            ),
            (
                1.2,
                [
                    1.13738687443,
                    0.290564934994,
                    0.14487213932,
                    0.0895382317467,
                ],
                [
                    0.252860001938,
                    0.0858776350461,
                    0.0498996074996,
                    0.0341298888884,
                ],
            ),
        ];
        for (theta_d, tt, trt) in golden {
            let x = h_column(eta, theta_d.cos(), true);
            let got = rule.moments(Fresnel::Dielectric, eta, x);
            close(got.tt, tt, 2e-11);
            close(got.trt, trt, 2e-11);
        }
    }

    #[test]
    fn golden_values_schlick() {
        let rule = MomentRule::new(32);
        let golden = [
            (
                0.0f64,
                [
                    1.74141541714,
                    0.536841864385,
                    0.300479259394,
                    0.201569136706,
                ],
                [
                    0.104023126326,
                    0.0449322135033,
                    0.0315548641053,
                    0.0250419134203,
                ],
            ),
            (
                1.2,
                [
                    1.16036545006,
                    0.286982147726,
                    0.13976681806,
                    0.0848105903192,
                ],
                [
                    0.243458850363,
                    0.0834995423708,
                    0.0482739635732,
                    0.032759387642,
                ],
            ),
        ];
        for (theta_d, tt, trt) in golden {
            let c = theta_d.cos();
            for got in [
                rule.moments(Fresnel::Schlick, 1.55, c),
                schlick_moments(1.55, c),
            ] {
                close(got.tt, tt, 3e-11);
                close(got.trt, trt, 3e-10);
            }
        }
    }

    #[test]
    fn more_nodes_change_nothing() {
        let (few, many) = (MomentRule::new(40), MomentRule::new(300));
        let mut worst = 0.0f64;
        for eta in [1.0, 1.001, 1.02, 1.1, 1.55, 3.0, 10.0] {
            for x in [0.0, 1e-3, 0.3, 0.9, 0.99, 1.0] {
                // The corner eta = x = 1 needs more; the first texels off it do not.
                if eta < 1.02 && x > 0.99 && (x + eta - 2.0f64).abs() > 1e-9 {
                    continue;
                }
                let a = few.moments(Fresnel::Dielectric, eta, x);
                let b = many.moments(Fresnel::Dielectric, eta, x);
                for i in 0..4 {
                    worst = worst.max((a.tt[i] - b.tt[i]).abs());
                    worst = worst.max((a.trt[i] - b.trt[i]).abs());
                }
            }
        }
        println!("40 nodes against 300: {worst:e}");
        assert!(worst < 1e-9, "{worst:e}");
        let clear = few.moments(Fresnel::Dielectric, 1.0, 1.0);
        close(clear.tt, [2.0, 2.0 / 3.0, 0.4, 2.0 / 7.0], 1e-13);
        assert!(clear.trt.iter().all(|value| value.abs() < 1e-15));
    }
}
