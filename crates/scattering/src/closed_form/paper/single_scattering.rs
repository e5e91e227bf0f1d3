//! Eq 11: one spherical Gaussian light over the scattering function. Twin:
//! `shaders/lib/paper/single_scattering.wgsl`.

use core::f32::consts::FRAC_PI_2;

use super::super::fibre::{Fibre, MODE_R};
use super::super::frame::{DirectionInFrame, LightInFrame, inclination, lag_between};
use super::super::longitudinal::longitudinal;
use super::super::special::erf_pair;
use super::super::tables::{Tables, table_cell};
use super::azimuthal::{azimuthal_r, azimuthal_trt, azimuthal_tt};
use super::outer_integral::{hat_weight, node_position};

/// A lobe is skipped where the product of light and M_t is below exp(LN_CULL) of its peak. At
/// -16 (1e-7) nothing visible is lost in single precision.
pub const LN_CULL: f32 = -16.0;

/// Sum of [`single_scattering_mode`] over the enabled modes: the integral of the light of
/// amplitude 1 against S cos(theta_i), linear RGB, >= 0, before transmittance.
pub fn single_scattering(
    light: &LightInFrame,
    view: &DirectionInFrame,
    fibre: &Fibre,
    tables: &Tables,
) -> [f32; 3] {
    let mut total = [0.0f32; 3];
    for mode in 0..3 {
        if fibre.modes & (1 << mode) != 0 {
            let value = single_scattering_mode(mode, light, view, fibre, tables);
            for channel in 0..3 {
                total[channel] += value[channel];
            }
        }
    }
    total
}

/// M_t of Eq 11 for `mode` 0 (R), 1 (TT), 2 (TRT), enabled or not:
/// the integral over theta_i of g(theta_i; theta_j, lambda_j) M_t cos^2 theta_i / cos^2 theta_d
/// N_t(lambda', phi_o - phi_j, theta_d), lambda'^2 = lambda_j^2 / (cos theta_i cos theta_j).
pub fn single_scattering_mode(
    mode: u32,
    light: &LightInFrame,
    view: &DirectionInFrame,
    fibre: &Fibre,
    tables: &Tables,
) -> [f32; 3] {
    let mut total = [0.0f32; 3];
    let at = light.direction;
    let product = longitudinal(
        at.theta,
        light.lambda,
        view.theta,
        fibre.alpha[mode as usize],
        fibre.beta[mode as usize],
    );
    if product.ln_b < LN_CULL {
        return total;
    }
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let row = table_cell(&tables.axes.h_rows, fibre.eta);
    let low = (-FRAC_PI_2 - product.mean) / product.lambda;
    let high = (FRAC_PI_2 - product.mean) / product.lambda;
    let mut u_0 = low;
    let mut u = node_position(low, high, fibre.segments, 1);
    let mut e_0 = erf_pair(u_0);
    let mut e = erf_pair(u);
    for s in 1..fibre.segments {
        let u_1 = node_position(low, high, fibre.segments, s + 1);
        let e_1 = erf_pair(u_1);
        let weight = hat_weight(u_0, u, u_1, e_0, e, e_1);
        if weight > 0.0 {
            let theta_i = product.mean + product.lambda * u;
            let cos_i = theta_i.cos().max(0.0);
            let incline = inclination(0.5 * (view.theta - theta_i));
            // At a grazing light or node the circular Gaussian in azimuth is constant.
            let kappa = (kappa_j * cos_i).max(1e-6);
            let ratio = cos_i / incline.cos_theta_d;
            let factor = weight * ratio * ratio;
            let value = if mode == 0 {
                [azimuthal_r(kappa, &lag, &incline, fibre, tables); 3]
            } else if mode == 1 {
                azimuthal_tt(kappa, &lag, &incline, fibre, row, tables)
            } else {
                azimuthal_trt(kappa, &lag, &incline, fibre, row, tables)
            };
            for channel in 0..3 {
                total[channel] += factor * value[channel];
            }
        }
        u_0 = u;
        u = u_1;
        e_0 = e;
        e = e_1;
    }
    let scale = product.lambda * product.peak * product.ln_b.exp();
    total.map(|value| value * scale)
}

const _: () = assert!(MODE_R == 1, "modes are bits in the order of p");
