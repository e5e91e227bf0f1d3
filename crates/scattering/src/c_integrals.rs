//! The functions of the table `C`: circular Gaussians times powers of `|cos(phi/2)|`, by closed
//! forms and by quadrature in a positive basis.
//!
//! `C_k(kappa, phi) = Int_{-pi}^{pi} |cos((phi - x)/2)|^k exp(kappa (cos x - 1)) dx` (Xu 2011
//! Eq 14), `kappa = 2 / lambda_p^2`.

use std::f64::consts::PI;

use crate::quadrature::{GaussLegendre, integrate_tanh_sinh};
use crate::special::{bessel_i_scaled, bessel_i0_scaled, dawson, erf};

/// Above this sharpness the odd functions use erf and Dawson's integral, below it their Fourier
/// series; the recurrences of the closed form lose digits like `1/kappa^2` below.
const CLOSED_FORM_FROM: f64 = 4.0;

/// Terms of the Fourier series below [`CLOSED_FORM_FROM`]: `I_n` is below 1e-30 there.
const FOURIER_TERMS: usize = 32;

/// `C_k(kappa, phi)`, k = 0..=6, in closed form.
///
/// Even k are finite sums of Bessel functions; odd k a Fourier series for `kappa < 4` and
/// combinations of erf and Dawson's integral above (substitute `s = sin(x/2)` and `c = cos(x/2)`
/// in `cos((phi-x)/2) = cos(phi/2) c + sin(phi/2) s`). `kappa` >= 0 finite, any `phi`. The
/// *absolute* error is below `5e-15 C_0` throughout; where `C_k` itself is smaller than that,
/// use [`BernsteinRule::shares`].
pub fn c_closed_form(kappa: f64, phi: f64) -> [f64; 7] {
    let bessel = bessel_i_scaled(FOURIER_TERMS, kappa);
    let harmonic = |n: u32| (f64::from(n) * phi).cos() * bessel[n as usize];
    let even_2 = PI * (bessel[0] + harmonic(1));
    let even_4 = 2.0 * PI * (0.375 * bessel[0] + 0.5 * harmonic(1) + 0.125 * harmonic(2));
    let even_6 = 2.0
        * PI
        * (0.3125 * bessel[0]
            + 15.0 / 32.0 * harmonic(1)
            + 3.0 / 16.0 * harmonic(2)
            + 1.0 / 32.0 * harmonic(3));
    let [odd_1, odd_3, odd_5] = if kappa < CLOSED_FORM_FROM {
        [1, 3, 5].map(|k| odd_fourier(k, phi, &bessel))
    } else {
        odd_closed_form(kappa, phi)
    };
    [
        2.0 * PI * bessel[0],
        odd_1,
        even_2,
        odd_3,
        even_4,
        odd_5,
        even_6,
    ]
}

/// `2 pi [b_0 I0e + 2 sum_n b_n cos(n phi) I_n e^(-kappa)]` with the Fourier coefficients of
/// `|cos(phi/2)|^k`, `b_n = 2^(-k) k! / (Gamma(k/2+n+1) Gamma(k/2-n+1))`.
fn odd_fourier(k: u32, phi: f64, bessel: &[f64]) -> f64 {
    // b_0: the mean of |cos(phi/2)|^k, (2/pi) (k-1)!!/k!! for odd k; then by ratios,
    // b_n / b_(n-1) = (k/2 - n + 1) / (k/2 + n).
    let mut b = 2.0 / PI;
    for j in (3..=k).step_by(2) {
        b *= f64::from(j - 1) / f64::from(j);
    }
    let half = 0.5 * f64::from(k);
    let mut sum = b * bessel[0];
    for (n, value) in bessel.iter().enumerate().skip(1) {
        let n = n as f64;
        b *= (half - n + 1.0) / (half + n);
        sum += 2.0 * b * (n * phi).cos() * value;
    }
    2.0 * PI * sum
}

/// C_1, C_3, C_5 for sharpness from [`CLOSED_FORM_FROM`].
fn odd_closed_form(kappa: f64, phi: f64) -> [f64; 3] {
    let (s, c) = (0.5 * phi).sin_cos();
    let (s, c) = (s.abs(), c.abs());
    let rho = (2.0 * kappa).sqrt();
    let tail = (-2.0 * kappa * c * c).exp();
    let e_0 = (PI / (2.0 * kappa)).sqrt() * erf(rho * c);
    let p_0 = 2.0 * tail * dawson(rho * s) / rho;
    let e_1 = (e_0 - 2.0 * c * tail) / (4.0 * kappa);
    let p_1 = (2.0 * s * tail - p_0) / (4.0 * kappa);
    let e_2 = (3.0 * e_1 - 2.0 * c.powi(3) * tail) / (4.0 * kappa);
    let p_2 = (2.0 * s.powi(3) * tail - 3.0 * p_1) / (4.0 * kappa);
    let c_1 = 2.0 * (c * e_0 + s * p_0);
    let c_3 = 2.0
        * (c.powi(3) * (e_0 - e_1)
            + 3.0 * c * s * s * e_1
            + s.powi(3) * (p_0 - p_1)
            + 3.0 * c * c * s * p_1);
    let c_5 = 2.0
        * (c.powi(5) * (e_0 - 2.0 * e_1 + e_2)
            + 10.0 * c.powi(3) * s * s * (e_1 - e_2)
            + 5.0 * c * s.powi(4) * e_2
            + s.powi(5) * (p_0 - 2.0 * p_1 + p_2)
            + 10.0 * s.powi(3) * c * c * (p_1 - p_2)
            + 5.0 * s * c.powi(4) * p_2);
    [c_1, c_3, c_5]
}

/// Half width of the integration interval in bandwidths: `exp(-7.5^2)` is 4e-25.
const HALF_WIDTH: f64 = 7.5;

/// `exp(kappa (cos x - 1)) binom(8,i) c^i (1-c)^(8-i)`, i = 0..=8, at distance `from_kink` =
/// `x - (phi - pi)` from the kink, where `c = |cos((phi-x)/2)| = |sin(from_kink/2)|`.
fn bernstein_integrand(kappa: f64, x: f64, from_kink: f64) -> [f64; 9] {
    let half_sine = (0.5 * x).sin();
    let gaussian = (-2.0 * kappa * half_sine * half_sine).exp();
    let (sin, cos) = (0.5 * from_kink).sin_cos();
    let c = sin.abs();
    // 1 - c without cancellation.
    let d = cos * cos / (1.0 + c);
    let (c_2, d_2) = (c * c, d * d);
    let (c_3, d_3) = (c_2 * c, d_2 * d);
    let (c_4, d_4) = (c_2 * c_2, d_2 * d_2);
    [
        gaussian * d_4 * d_4,
        gaussian * 8.0 * c * d_4 * d_3,
        gaussian * 28.0 * c_2 * d_4 * d_2,
        gaussian * 56.0 * c_3 * d_4 * d,
        gaussian * 70.0 * c_4 * d_4,
        gaussian * 56.0 * c_4 * c * d_3,
        gaussian * 28.0 * c_4 * c_2 * d_2,
        gaussian * 8.0 * c_4 * c_3 * d,
        gaussian * c_4 * c_4,
    ]
}

/// Where the integrands of this file live: `|x| <= min(pi, 7.5 lambda_p)`, split at the kink
/// `x = phi - pi` where it falls inside. Returns `(a, b, from_kink at a)` of one or two panels.
fn panels(kappa: f64, cos_half_phi: f64) -> Vec<(f64, f64, f64)> {
    let half = if kappa > 0.0 {
        (HALF_WIDTH * (2.0 / kappa).sqrt()).min(PI)
    } else {
        PI
    };
    // phi - pi = -2 asin(cos(phi/2)) keeps its digits near phi = pi.
    let kink = -2.0 * cos_half_phi.clamp(0.0, 1.0).asin();
    if kink > -half {
        vec![(-half, kink, -half - kink), (kink, half, 0.0)]
    } else {
        vec![(-half, 0.0, -half - kink), (0.0, half, -kink)]
    }
}

/// Computes [`BernsteinRule::shares`]; holds the quadrature rule.
#[derive(Clone, Debug)]
pub struct BernsteinRule {
    rule: GaussLegendre,
}

impl Default for BernsteinRule {
    fn default() -> Self {
        BernsteinRule {
            rule: GaussLegendre::new(48),
        }
    }
}

impl BernsteinRule {
    /// The stored form of `C`: with `c = |cos((phi-x)/2)|`,
    /// `b_i = binom(8,i) Int c^i (1-c)^(8-i) exp(kappa (cos x - 1)) dx / C_0`, i = 0..=8, all
    /// >= 0, their sum 1.
    ///
    /// By 48 Gauss-Legendre nodes on either side of the kink. `kappa` >= 0 finite,
    /// `cos_half_phi` = `|cos(phi/2)|` in 0..=1. Relative error of each `b_i`
    /// below 1e-11 (tested against tanh-sinh).
    pub fn shares(&self, kappa: f64, cos_half_phi: f64) -> [f64; 9] {
        let mut sums = [0.0; 9];
        for (a, b, from_kink_at_a) in panels(kappa, cos_half_phi) {
            for (from_a, weight) in self.rule.on(0.0, b - a) {
                let values = bernstein_integrand(kappa, a + from_a, from_kink_at_a + from_a);
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += weight * value;
                }
            }
        }
        let c_0 = 2.0 * PI * bessel_i0_scaled(kappa);
        sums.map(|sum| sum / c_0)
    }
}

/// [`BernsteinRule::shares`] by the tanh-sinh rule with 257 nodes a panel: slower, and
/// independent of the nodes the tables are baked with.
pub fn shares_tanh_sinh(kappa: f64, cos_half_phi: f64) -> [f64; 9] {
    let mut sums = [0.0; 9];
    for (a, b, from_kink_at_a) in panels(kappa, cos_half_phi) {
        let part = integrate_tanh_sinh(a, b, 5, |from_a, _| {
            bernstein_integrand(kappa, a + from_a, from_kink_at_a + from_a)
        });
        for (sum, value) in sums.iter_mut().zip(part) {
            *sum += value;
        }
    }
    let c_0 = 2.0 * PI * bessel_i0_scaled(kappa);
    sums.map(|sum| sum / c_0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circular_gaussian::sharpness;
    use crate::table_layout::C_FROM_B;

    /// lambda_p, phi, C_0..C_6 to 12 digits.
    const GOLDEN: [(f64, f64, [f64; 7]); 5] = [
        (
            0.05,
            0.7,
            [
                0.0886365495901,
                0.0832497391161,
                0.0781935690933,
                0.0734475458094,
                0.0689924580677,
                0.0648102961621,
                0.0608841760186,
            ],
        ),
        (
            0.5,
            0.0,
            [
                0.901208464346,
                0.88622691179,
                0.872025303635,
                0.858532334863,
                0.845686486669,
                0.833434110456,
                0.821728048051,
            ],
        ),
        (
            0.5,
            2.0,
            [
                0.901208464346,
                0.47898931606,
                0.275231186429,
                0.167204622871,
                0.106162682604,
                0.0699231488429,
                0.0475196893297,
            ],
        ),
        (
            1.0,
            3.0,
            [
                1.93841495941,
                0.611157774427,
                0.299687020697,
                0.183065257315,
                0.127698195716,
                0.0971389138831,
                0.078398061936,
            ],
        ),
        (
            3.0,
            1.0,
            [
                5.09348680763,
                3.37265747331,
                2.69869748789,
                2.31558709698,
                2.06038946128,
                1.8746881079,
                1.73170262224,
            ],
        ),
    ];

    fn c_from_shares(kappa: f64, phi: f64) -> [f64; 7] {
        let b = BernsteinRule::default().shares(kappa, (0.5 * phi).cos().abs());
        let c_0 = 2.0 * PI * bessel_i0_scaled(kappa);
        C_FROM_B.map(|row| c_0 * row.iter().zip(b).map(|(m, b)| m * b).sum::<f64>())
    }

    #[test]
    fn golden_values() {
        for (lambda_p, phi, expected) in GOLDEN {
            let kappa = sharpness(lambda_p);
            for got in [c_closed_form(kappa, phi), c_from_shares(kappa, phi)] {
                for k in 0..7 {
                    assert!((got[k] / expected[k] - 1.0).abs() < 2e-11, "{k} {got:?}");
                }
            }
        }
    }

    #[test]
    fn closed_form_and_quadrature_agree() {
        let mut worst = 0.0f64;
        for lambda_p in [
            0.001, 0.01, 0.07, 0.3, 0.7, 0.706, 0.71, 1.0, 3.0, 10.0, 1e9,
        ] {
            for phi in [0.0, 1e-3, 0.4, 1.5, 2.9, 3.1, 3.138, PI] {
                let kappa = sharpness(lambda_p);
                let (a, b) = (c_closed_form(kappa, phi), c_from_shares(kappa, phi));
                for k in 0..7 {
                    worst = worst.max((a[k] - b[k]).abs() / a[0]);
                }
            }
        }
        println!("closed form against quadrature: {worst:e} of C_0");
        assert!(worst < 1e-14);
    }

    #[test]
    fn shares_sum_to_one_and_are_relatively_exact() {
        let rule = BernsteinRule::default();
        let mut worst = 0.0f64;
        for lambda_p in [0.001, 0.004, 0.03, 0.3, 1.0, 2.0, 10.0, f64::INFINITY] {
            for cos_half_phi in [0.0, 1e-5, 0.002, 0.03, 0.4, 0.9, 0.9999, 1.0] {
                let kappa = sharpness(lambda_p);
                let got = rule.shares(kappa, cos_half_phi);
                assert!((got.iter().sum::<f64>() - 1.0).abs() < 1e-10);
                let expected = shares_tanh_sinh(kappa, cos_half_phi);
                for i in 0..9 {
                    let error = (got[i] / expected[i] - 1.0).abs();
                    assert!(error < 1e-11, "{lambda_p} {cos_half_phi} {i} {error:e}");
                    worst = worst.max(error);
                }
            }
        }
        println!("shares against tanh-sinh: {worst:e} relative");
    }
}
