//! The inner integrals of Eq 12: N_t against the light's circular Gaussian in azimuth. Twin:
//! `shaders/lib/paper/azimuthal.wgsl`.

use core::f32::consts::PI;

use super::super::circular_gaussian::{c_0, product_integral};
use super::super::constants::SQRT_PI;
use super::super::fibre::Fibre;
use super::super::frame::{Inclination, Lag};
use super::super::special::{bessel_i0e, bessel_i1e};
use super::super::tables::{Cell, TableAxes, Tables, sample_c, sample_h, table_cell};
use super::fresnel::{transmittance_dielectric, transmittance_schlick};

/// Narrowest and widest fitted lobe. A lobe of width 2 sqrt(pi) is as good as constant; the
/// energy of a lobe is kept where its width is clamped.
const LOBE_LAMBDA_MIN: f32 = 1e-3;
const LOBE_LAMBDA_MAX: f32 = 3.544_907_7;
/// Range of eta' above 2 over which the width of TRT's single lobe leaves w_c (Xu 2011 4.2.4).
const TRANSITION: f32 = 0.3;
/// Keeps 1 / (2 - eta') finite where the lobes that hold it vanish faster.
const ETA_GAP_MIN: f32 = 1e-4;
/// Smallest (or eta, if less) and largest index of an elliptic fibre: Eq 24 passes 1 for strong
/// eccentricities, and the H tables end at 10.
const ETA_STAR_MIN: f32 = 1.05;
const ETA_STAR_MAX: f32 = 10.0;

/// 1 - F at incidence cosine `cosine`, with the Fresnel term of the tables.
fn transmittance(axes: &TableAxes, eta: f32, cosine: f32) -> f32 {
    if axes.schlick != 0 {
        return transmittance_schlick(eta, cosine);
    }
    transmittance_dielectric(eta, cosine)
}

/// N_R (Eq 14) with Schlick's Fresnel term:
/// 1/4 C_0 sum over i = 1..8 of (i/8) [F_0 + (1 - F_0) e_i] b_i, e_i the Bernstein coefficients
/// of degree 7 of (1 - c cos theta_d)^5 over c, all terms positive. `kappa` = 2 / lambda'^2.
pub fn azimuthal_r(kappa: f32, lag: &Lag, at: &Inclination, fibre: &Fibre, tables: &Tables) -> f32 {
    let b = sample_c(tables.c, &tables.axes, kappa, lag.cos_half);
    let r = (fibre.eta - 1.0) / (fibre.eta + 1.0);
    let f_0 = r * r;
    let f_1 = 1.0 - f_0;
    let g = 1.0 - at.cos_theta_d;
    let constant = b[0]
        + 2.0 * b[1]
        + 3.0 * b[2]
        + 4.0 * b[3]
        + 5.0 * b[4]
        + 6.0 * b[5]
        + 7.0 * b[6]
        + 8.0 * b[7];
    // Degree 5 raised to 7: e_i = sum over k of binom(5, k) binom(2, i - 1 - k) / binom(7, i - 1)
    // g^k, collected by powers of g.
    let rising = b[0]
        + 4.0 / 7.0 * b[1]
        + 1.0 / 7.0 * b[2]
        + g * (10.0 / 7.0 * (b[1] + b[2])
            + 4.0 / 7.0 * b[3]
            + g * (10.0 / 7.0 * (b[2] + b[4])
                + 16.0 / 7.0 * b[3]
                + g * (8.0 / 7.0 * b[3]
                    + 20.0 / 7.0 * (b[4] + b[5])
                    + g * (5.0 / 7.0 * b[4]
                        + 20.0 / 7.0 * b[5]
                        + 5.0 * b[6]
                        + g * (2.0 / 7.0 * b[5] + 2.0 * b[6] + 8.0 * b[7])))));
    c_0(kappa) * (1.0 / 32.0) * (f_0 * constant + f_1 * rising)
}

/// Energy of N_TT or N_TRT over exp(-s), by the fourth-order expansion of the attenuation
/// exp(-s sqrt(1 - h^2/eta'^2)) (Eq 18, 19, 22, 23): s = 2 p sigma', `y` = 1 / eta'^2.
fn lobe_energy(h: [f32; 4], s: f32, y: f32) -> f32 {
    0.5 * (h[0] + 0.5 * s * y * (h[1] + 0.25 * (1.0 + s) * y * h[2]))
}

/// N_TT (Eq 16, 17) per channel: one circular Gaussian at phi = pi whose height is N_TT(pi) and
/// whose width keeps the energy. `row` is the cell of eta in the H tables.
pub fn azimuthal_tt(
    kappa: f32,
    lag: &Lag,
    at: &Inclination,
    fibre: &Fibre,
    row: Cell,
    tables: &Tables,
) -> [f32; 3] {
    lobes_tt(at, fibre, row, tables, |kappa_lobe| {
        product_integral(kappa, kappa_lobe, lag.cos_half)
    })
}

/// The lobe of [`azimuthal_tt`], its Gaussian of sharpness `kappa_lobe` at phi = pi replaced by
/// `integral(kappa_lobe)`.
pub(super) fn lobes_tt(
    at: &Inclination,
    fibre: &Fibre,
    row: Cell,
    tables: &Tables,
    integral: impl Fn(f32) -> f32,
) -> [f32; 3] {
    let eta = fibre.eta;
    let cos_2 = at.cos_theta_d * at.cos_theta_d;
    let sin_t = at.sin_theta_d / eta;
    let excess = (eta - 1.0) * (eta + 1.0);
    let eta_p = (1.0 + excess / cos_2).sqrt();
    let y = 1.0 / (eta_p * eta_p);
    // |dphi/dh| = 2 (1 - 1/eta') at h = 0.
    let gap = excess / (cos_2 * (eta_p + 1.0) * eta_p);
    let through = transmittance(&tables.axes, eta, at.cos_theta_d);
    let height = through * through / (4.0 * gap);
    let h = sample_h(tables.h_tt, &tables.axes, row, eta, at.cos_theta_d);
    let path = 2.0 / (1.0 - sin_t * sin_t).sqrt();
    std::array::from_fn(|channel| {
        let s = fibre.sigma_a[channel] * path;
        let e = lobe_energy(h, s, y);
        let lambda = (e / (SQRT_PI * height.max(1e-30))).clamp(LOBE_LAMBDA_MIN, LOBE_LAMBDA_MAX);
        let amplitude = e * (-s).exp() / (SQRT_PI * lambda);
        amplitude * integral(2.0 / (lambda * lambda))
    })
}

/// Mean index of an elliptic fibre under the light (Eq 26): C_0 and C_2 at phi_o + phi_j in
/// closed form, C_2 / C_0 = (1 + cos(phi_o + phi_j) I_1/I_0) / 2.
pub fn eta_star(kappa: f32, lag: &Lag, fibre: &Fibre) -> f32 {
    if fibre.eta_swing == 0.0 {
        return fibre.eta;
    }
    let ratio = bessel_i1e(kappa) / bessel_i0e(kappa);
    eta_at(lag.cos_sum * ratio, fibre)
}

/// Index of an elliptic fibre for a mean `cosine` of phi_o + phi_i.
pub(super) fn eta_at(cosine: f32, fibre: &Fibre) -> f32 {
    if fibre.eta_swing == 0.0 {
        return fibre.eta;
    }
    (fibre.eta_mean + fibre.eta_swing * cosine).clamp(fibre.eta.min(ETA_STAR_MIN), ETA_STAR_MAX)
}

/// N_TRT (Eq 20 to 23, 25) per channel: below eta' = 2 two lobes at +-phi* and a residue at 0,
/// above it one lobe. The energy is that of Eq 23 everywhere; the residue gives way where it
/// would ask for more. `row` is the cell of eta in the H tables, for circular fibres.
pub fn azimuthal_trt(
    kappa: f32,
    lag: &Lag,
    at: &Inclination,
    fibre: &Fibre,
    row: Cell,
    tables: &Tables,
) -> [f32; 3] {
    let eta = eta_star(kappa, lag, fibre);
    lobes_trt(eta, lag, at, fibre, row, tables, |kappa_lobe, sin_half| {
        product_integral(kappa, kappa_lobe, sin_half)
    })
}

/// The lobes of [`azimuthal_trt`] for index `eta`, each Gaussian replaced by
/// `integral(kappa_lobe, sin_half)`, sin_half the sine of half its distance from the lag.
pub(super) fn lobes_trt(
    eta: f32,
    lag: &Lag,
    at: &Inclination,
    fibre: &Fibre,
    row: Cell,
    tables: &Tables,
    integral: impl Fn(f32, f32) -> f32,
) -> [f32; 3] {
    let mut eta_row = row;
    if fibre.eta_swing != 0.0 {
        eta_row = table_cell(&tables.axes.h_rows, eta);
    }
    let cos_2 = at.cos_theta_d * at.cos_theta_d;
    let sin_t = at.sin_theta_d / eta;
    let eta_p_2 = 1.0 + (eta - 1.0) * (eta + 1.0) / cos_2;
    let eta_p = eta_p_2.sqrt();
    let y = 1.0 / eta_p_2;
    let h = sample_h(tables.h_trt, &tables.axes, eta_row, eta, at.cos_theta_d);
    let path = 4.0 / (1.0 - sin_t * sin_t).sqrt();
    let through = transmittance(&tables.axes, eta, at.cos_theta_d);
    let head_on = through * through * (1.0 - through).max(0.0);
    let w_c = fibre.caustic_width;
    if eta_p >= 2.0 {
        // |dphi/dh| = 2 (eta' - 2) / eta' at h = 0; lambda_3 -> 0 with it.
        let inverse = 4.0 * (eta_p - 2.0) / (SQRT_PI * eta_p * head_on.max(1e-30));
        let t = ((eta_p - 2.0) / TRANSITION).clamp(0.0, 1.0);
        let blend = t * t * (3.0 - 2.0 * t);
        return std::array::from_fn(|channel| {
            let s = fibre.sigma_a[channel] * path;
            let e = lobe_energy(h, s, y);
            let lambda_3 = (e * inverse).clamp(LOBE_LAMBDA_MIN, LOBE_LAMBDA_MAX);
            let lambda = w_c + (lambda_3 - w_c) * blend;
            let amplitude = e * (-s).exp() / (SQRT_PI * lambda);
            amplitude * integral(2.0 / (lambda * lambda), lag.sin_half)
        });
    }

    // The caustic: h* = sqrt((4 - eta'^2) / 3), phi* = |4 gamma_t - 2 gamma_i|.
    let sin_i_2 = ((4.0 - eta_p_2) / 3.0).clamp(0.0, 1.0);
    let sin_i = sin_i_2.sqrt();
    let cos_i = (1.0 - sin_i_2).sqrt();
    let sin_r = sin_i / eta_p;
    let cos_r = (1.0 - sin_r * sin_r).sqrt();
    let sin_2r = 2.0 * sin_r * cos_r;
    let cos_2r = 1.0 - 2.0 * sin_r * sin_r;
    let sin_star = (sin_2r * cos_i - cos_2r * sin_i).abs();
    let cos_star = cos_2r * cos_i + sin_2r * sin_i;
    let lambda_2 = (2.0 * sin_star.atan2(cos_star)).clamp(LOBE_LAMBDA_MIN, PI);

    // N_TRT(0): the root h = 0 and, above eta' = sqrt(2), a pair with cos(gamma_t) = eta' / 2.
    let eta_gap = (2.0 - eta_p).max(ETA_GAP_MIN);
    let centre = eta_p / (4.0 * eta_gap) * head_on;
    let cos_pair = (0.5 * eta_p_2 - 1.0).max(0.0);
    let through_pair = transmittance(&tables.axes, eta, at.cos_theta_d * cos_pair);
    let reflect_pair = (1.0 - through_pair).max(0.0);
    let pair = eta_p_2 * cos_pair / (2.0 * eta_gap * (2.0 + eta_p))
        * (through_pair * through_pair * reflect_pair);

    let exponent = 4.0 * sin_star * sin_star / (w_c * w_c);
    let outside = 1.0 - (-exponent).exp();
    let kappa_c = 2.0 / (w_c * w_c);
    let sum = lag.sin_half * cos_star;
    let swing = lag.cos_half * sin_star;
    let pair_lobes = integral(kappa_c, sum - swing) + integral(kappa_c, sum + swing);
    let centre_lobe = integral(2.0 / (lambda_2 * lambda_2), lag.sin_half);
    std::array::from_fn(|channel| {
        let s = fibre.sigma_a[channel] * path;
        let e = lobe_energy(h, s, y) * (-s).exp();
        let at_zero = centre * (-s).exp() + pair * (-0.5 * s * eta_p).exp();
        let b_2 = (at_zero * outside * outside).min(e / (SQRT_PI * lambda_2));
        let b_1 = (e - b_2 * SQRT_PI * lambda_2).max(0.0) / (2.0 * SQRT_PI * w_c);
        b_1 * pair_lobes + b_2 * centre_lobe
    })
}
