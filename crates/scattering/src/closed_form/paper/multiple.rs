//! What global and local scattering share: psi_f over the piecewise linear rule (Xu 2011 section
//! 4.2.2).

use core::f32::consts::FRAC_PI_2;

use super::super::constants::SQRT_PI;
use super::super::frame::DirectionInFrame;
use super::super::longitudinal::longitudinal;
use super::super::mean_cosine::mean_cosine;
use super::super::special::erf_pair;
use super::outer_integral::{hat_weight, node_position};
use super::single_scattering::LN_CULL;

/// `1 / Z` of psi_f, `Z = Int g^u(theta_i; theta_j, sigma_f) cos(theta_i) dtheta_i` over +-pi/2.
/// Xu has `1 / cos(theta_j)`, with which psi_f has the mass 1.3 at theta_j = 1.3, sigma_f = 1, 3.8
/// at theta_j = 1.5, and any at grazing.
pub(super) fn forward_norm(light: &DirectionInFrame, sigma_f: f32) -> f32 {
    1.0 / mean_cosine(light.theta, light.cos_theta, sigma_f)
}

/// `Int g^u(theta_i; theta_j, sigma_f) g^u(theta_i; 2 alpha - theta_o, 2 beta) f(theta_i) dtheta_i`
/// by the piecewise linear rule with `segments`; f is 0 at +-pi/2.
pub(super) fn outer_integral<const N: usize>(
    light: &DirectionInFrame,
    sigma_f: f32,
    view: &DirectionInFrame,
    [alpha, beta]: [f32; 2],
    segments: u32,
    mut f: impl FnMut(f32) -> [f32; N],
) -> [f32; N] {
    let mut total = [0.0f32; N];
    let product = longitudinal(light.theta, sigma_f, view.theta, alpha, beta);
    if product.ln_b < LN_CULL {
        return total;
    }
    let low = (-FRAC_PI_2 - product.mean) / product.lambda;
    let high = (FRAC_PI_2 - product.mean) / product.lambda;
    for s in 1..segments {
        let [u_0, u, u_1] = [s - 1, s, s + 1].map(|s| node_position(low, high, segments, s));
        let [e_0, e, e_1] = [u_0, u, u_1].map(erf_pair);
        let weight = hat_weight(u_0, u, u_1, e_0, e, e_1);
        if weight > 0.0 {
            for (total, value) in total.iter_mut().zip(f(product.mean + product.lambda * u)) {
                *total += weight * value;
            }
        }
    }
    let scale = product.lambda * product.peak * product.ln_b.exp() / (SQRT_PI * sigma_f);
    total.map(|value| value * scale)
}
