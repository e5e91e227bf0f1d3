//! What the baked tables hold: axes, channels and the formulas that read them.
//!
//! # `C`: circular Gaussian times powers of `|cos(phi/2)|`
//! `C_k(kappa, phi) = Int |cos((phi-x)/2)|^k exp(kappa (cos x - 1)) dx` over a full turn,
//! `kappa = 2 / lambda_p^2`, `k = 0..=6` (Xu 2011 Eq 14). Stored is the Bernstein basis of degree
//! 8 over `C_0 = 2 pi I0e(kappa)`: with `c = |cos((phi-x)/2)|`,
//!
//! `b_i = binom(8,i) Int c^i (1-c)^(8-i) exp(kappa (cos x - 1)) dx / C_0`, sum over i = 1,
//!
//! so that `C_k / C_0 = sum_{i=k..8} binom(i,k)/binom(8,k) b_i` has positive terms only. Degree 8
//! is what R's dielectric Fresnel term asks for ([`crate::reflectance`]); b_0 = 1 - the others.
//!
//! - rows: `kappa` in 0..=2e6, i.e. `lambda_p` from infinity down to 0.001;
//! - columns: `cos_half_phi = |cos(phi/2)|` in 0..=1, i.e. phi from pi down to 0;
//! - channels (8): `b1` to `b8`. Shading packs them as unorm16 into one texel of 16 bytes.
//!
//! Measured largest `|error of C_k| / C_0` between centres, bilinear, 8192 texels:
//!
//! | rows x columns | axes | error |
//! |---|---|---|
//! | 128 x 64 | lambda_p logarithmic 0.001..10, phi linear (Xu 2011) | 3.0e-3 |
//! | 64 x 128 | the same axes | 1.6e-3 |
//! | 64 x 128 | `sqrt(t)`, `t = lambda_p/(lambda_p + 2)`; `(sqrt c + c^2)/2` | 4.8e-4 |
//! | 64 x 128 | `t = 1/sqrt(1+kappa)`, `sqrt t`; `(sqrt c + c^2)/2` | 2.9e-4 |
//! | 64 x 128 | the above with `(t + sqrt t)/2` | 2.3e-4 |
//! | **64 x 128** | **[`C_ROWS`], [`C_COLUMNS`]** | **1.9e-4** |
//! | 128 x 64 | the best found of the same families | 4.8e-4 |
//!
//! # `H_TT`, `H_TRT`: moments of the attenuation in h
//! `H_k = Int_{-1}^{1} h^k (1-F)^2 F^(p-1) dh`, `k = 0, 2, 4, 6`, p = 1 (TT), 2 (TRT): the lobe
//! without absorption (Xu 2011 Eq 19, 23).
//!
//! - rows: `eta` in 1..=10;
//! - columns, 0..=1: for the dielectric Fresnel term `eta_ratio = eta / eta_eff =
//!   eta cos(theta_d) / sqrt(eta^2 - sin(theta_d)^2)`, because for eta near 1 the term depends on
//!   `cos(theta_d) / sqrt(eta^2 - 1)` alone and no grid in theta_d resolves it; for Schlick's
//!   `cos_theta_d`. [`h_column`] computes either;
//! - channels (4, one RGBA texel): `H0 H2 H4 H6`.
//!
//! Measured largest absolute error between centres for theta_d <= 1.5, 8192 texels:
//!
//! | rows x columns | axes | dielectric | Schlick |
//! |---|---|---|---|
//! | 128 x 64 | eta logarithmic, theta_d linear (Xu 2011) | 1.4e-1 | 1.6e-3 |
//! | 64 x 128 | the same axes | 3.3e-1 | 4.3e-4 |
//! | 128 x 64 | eta - 1 squared, theta_d linear | 1.6e-2 | 1.6e-3 |
//! | 128 x 64 | best warps found of eta and cos(theta_d) | 1.5e-3 | 1.3e-3 |
//! | 128 x 64 | best warps found of eta and `eta_ratio` | 9.3e-4 | |
//! | **64 x 128** | **[`H_ROWS`], [`H_COLUMNS`]** | **6.1e-4** | **1.9e-4** |

use crate::axis::{Axis, Spacing};

/// Rows of the table `C`: `kappa = 2 / lambda_p^2`.
pub const C_ROWS: Axis = Axis {
    min: 0.0,
    max: 2.0e6,
    count: 64,
    spacing: Spacing::InverseSqrt,
};

/// Columns of the table `C`: `|cos(phi/2)|`.
pub const C_COLUMNS: Axis = Axis {
    min: 0.0,
    max: 1.0,
    count: 128,
    spacing: Spacing::RootSquare,
};

/// Names of the axes of `C`, rows first.
pub const C_AXIS_NAMES: [&str; 2] = ["kappa", "cos_half_phi"];

/// Degree of the Bernstein basis of `C`.
pub const C_DEGREE: usize = 8;

/// Channels of `C`.
pub const C_CHANNELS: [&str; C_DEGREE] = ["b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8"];

/// Rows of `H_TT` and `H_TRT`: eta.
pub const H_ROWS: Axis = Axis {
    min: 1.0,
    max: 10.0,
    count: 64,
    spacing: Spacing::Reciprocal,
};

/// Columns of `H_TT` and `H_TRT`: see [`h_column`].
pub const H_COLUMNS: Axis = Axis {
    min: 0.0,
    max: 1.0,
    count: 128,
    spacing: Spacing::Concave,
};

/// Names of the axes of `H_TT` and `H_TRT` with the dielectric Fresnel term, rows first.
pub const H_AXIS_NAMES_DIELECTRIC: [&str; 2] = ["eta", "eta_ratio"];

/// Names of the axes of `H_TT` and `H_TRT` with Schlick's Fresnel term, rows first.
pub const H_AXIS_NAMES_SCHLICK: [&str; 2] = ["eta", "cos_theta_d"];

/// Channels of `H_TT` and `H_TRT`.
pub const H_CHANNELS: [&str; 4] = ["H0", "H2", "H4", "H6"];

/// `C_FROM_B[k][i]` with `C_k / C_0 = sum_i C_FROM_B[k][i] b_i`: `binom(i,k) / binom(8,k)`.
pub const C_FROM_B: [[f64; C_DEGREE + 1]; 7] = c_from_b();

pub(crate) const fn binomial(n: u32, k: u32) -> f64 {
    let mut product = 1.0;
    let mut i = 0;
    while i < k {
        product = product * (n as f64 - i as f64) / (i as f64 + 1.0);
        i += 1;
    }
    product
}

const fn c_from_b() -> [[f64; C_DEGREE + 1]; 7] {
    let mut matrix = [[0.0; C_DEGREE + 1]; 7];
    let mut k = 0;
    while k < 7 {
        let mut i = k;
        while i <= C_DEGREE {
            let degree = C_DEGREE as u32;
            matrix[k][i] = binomial(i as u32, k as u32) / binomial(degree, k as u32);
            i += 1;
        }
        k += 1;
    }
    matrix
}

/// Column variable of the H tables: `eta / eta_eff` for the dielectric Fresnel term
/// (`dielectric`), `cos(theta_d)` for Schlick's. `eta` >= 1, `cos_theta_d` in 0..=1 (clamped).
/// At eta = 1 and theta_d = pi/2, where the ratio has no limit, the answer is 1.
pub fn h_column(eta: f64, cos_theta_d: f64, dielectric: bool) -> f64 {
    let c = cos_theta_d.clamp(0.0, 1.0);
    if !dielectric {
        return c;
    }
    let below = (eta * eta - 1.0 + c * c).max(0.0);
    if below > 0.0 {
        (eta * c / below.sqrt()).min(1.0)
    } else {
        1.0
    }
}

/// theta_d in 0..=pi/2 at index `eta` >= 1 and column variable `x` in 0..=1: inverse of
/// [`h_column`]. At eta = 1 every theta_d has x = 1; the answer is 0 there and pi/2 below.
pub fn theta_d_from_h_column(eta: f64, x: f64, dielectric: bool) -> f64 {
    let cos = if dielectric {
        let rest = (eta - x) * (eta + x);
        if rest > 0.0 {
            x * ((eta - 1.0) * (eta + 1.0) / rest).sqrt()
        } else {
            1.0
        }
    } else {
        x
    };
    cos.clamp(0.0, 1.0).acos()
}

/// f32 twin of [`h_column`], operation for operation (and in WGSL).
pub fn h_column_f32(eta: f32, cos_theta_d: f32, dielectric: bool) -> f32 {
    let c = cos_theta_d.clamp(0.0, 1.0);
    if !dielectric {
        return c;
    }
    // (eta - 1)(eta + 1) keeps its digits near eta = 1.
    let below = ((eta - 1.0) * (eta + 1.0) + c * c).max(1e-12);
    (eta * c / below.sqrt()).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_in_the_bernstein_basis() {
        // c^k = sum_i C_FROM_B[k][i] binom(8,i) c^i (1-c)^(8-i) for every c.
        for c in [0.0f64, 0.1, 0.5, 0.9, 1.0] {
            for (k, row) in C_FROM_B.iter().enumerate() {
                let sum: f64 = (0..9)
                    .map(|i| {
                        let b = binomial(8, i) * c.powi(i as i32) * (1.0 - c).powi(8 - i as i32);
                        row[i as usize] * b
                    })
                    .sum();
                assert!((sum - c.powi(k as i32)).abs() < 1e-15, "{k} {c}");
            }
        }
    }

    #[test]
    fn h_column_is_the_ratio_of_indices() {
        for eta in [1.0001, 1.3, 1.55, 10.0] {
            for theta_d in [0.0f64, 0.5, 1.2, 1.5] {
                let (sin, cos) = theta_d.sin_cos();
                let eta_eff = (eta * eta - sin * sin).sqrt() / cos;
                let x = h_column(eta, cos, true);
                assert!((x - eta / eta_eff).abs() < 1e-14);
                let back = theta_d_from_h_column(eta, x, true);
                assert!((back - theta_d).abs() < 1e-7);
                assert_eq!(h_column(eta, cos, false), cos);
                let twin = h_column_f32(eta as f32, cos as f32, true);
                assert!((f64::from(twin) - x).abs() < 2e-4 / (eta - 1.0).max(1e-3) * 1e-2);
            }
        }
        assert_eq!(h_column(1.0, 0.0, true), 1.0);
        assert_eq!(h_column(1.0, 0.5, true), 1.0);
    }
}
