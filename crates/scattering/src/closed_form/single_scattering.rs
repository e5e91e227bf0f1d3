//! Eq 11: one spherical Gaussian light over the scattering function. Twin:
//! `shaders/lib/single_scattering.wgsl`.
//!
//! Each mode is integrated over theta_i by the nodes of [`super::outer_integral`]; at a node the
//! integral over azimuth is R's polynomial on the table C, or TT's and TRT's lobes. With the
//! default nodes that is at most 8 inner integrals and 13 fetches a light: one of C for each
//! node of R, two 16-byte texels of the lobe texture for each of TT and TRT. An elliptic fibre
//! reads as often, TRT's fetches being bilinear. Of model `energy` ([`super::fisher_lobe`]) TT and TRT read
//! once for all nodes.

use super::azimuthal::{azimuthal_trt, azimuthal_tt};
use super::azimuthal_r::{Reflectance, azimuthal_r};
use super::eccentric::eta_star;
use super::fibre::{Fibre, MODE_R};
use super::fisher::{fisher_density, fisher_lobe, fisher_place, fisher_rule, further_orders};
use super::frame::{DirectionInFrame, Lag, LightInFrame, inclination, lag_between};
use super::lobes::{LobeView, SampleLobes};
use super::outer_integral::{
    LN_CULL, node_constants, node_count, node_extent, outer_node, outer_rule,
};
use super::special::bessel_i0e_fast;
use super::tables::Tables;

/// What the shading of one fibre, or of a painted point, reads. Parts of modes that are not enabled
/// are never read.
#[derive(Clone, Copy, Debug)]
pub struct Shading<'a, L = LobeView<'a>> {
    /// The fibre.
    pub fibre: &'a Fibre,
    /// The table C, for R.
    pub tables: Tables<'a>,
    /// R's coefficients at the fibre's eta.
    pub reflectance: &'a Reflectance,
    /// Lobes of TT.
    pub tt: L,
    /// Lobes of TRT.
    pub trt: L,
}

/// Sum of [`single_scattering_mode`] over the enabled modes: the integral of the light of
/// amplitude 1 against S cos(theta_i), linear RGB, >= 0, before transmittance.
pub fn single_scattering(
    light: &LightInFrame,
    view: &DirectionInFrame,
    shading: &Shading<impl SampleLobes>,
) -> [f32; 3] {
    shadowed_single_scattering(light, view, shading, [1.0; 3])
}

/// [`single_scattering`] with a share of the light for each mode (R, TT, TRT), 0..=1: what gets
/// through to where the mode takes its light from.
pub fn shadowed_single_scattering(
    light: &LightInFrame,
    view: &DirectionInFrame,
    shading: &Shading<impl SampleLobes>,
    shares: [f32; 3],
) -> [f32; 3] {
    let at = light.direction;
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    let mut total = [0.0f32; 3];
    for mode in 0..3 {
        if shading.fibre.modes & (1 << mode) != 0 {
            let value = mode_at_lag(mode, light, view, &lag, shading);
            for channel in 0..3 {
                total[channel] += shares[mode as usize] * value[channel];
            }
        }
    }
    total
}

/// M_t of Eq 11 for `mode` 0 (R), 1 (TT), 2 (TRT), enabled or not:
/// the integral over theta_i of g^c(theta_i; theta_j, lambda_j) M_t cos^2 theta_i / cos^2 theta_d
/// N_t(lambda', phi_o - phi_j, theta_d), lambda'^2 = lambda_j^2 / (cos theta_i cos theta_j).
pub fn single_scattering_mode(
    mode: u32,
    light: &LightInFrame,
    view: &DirectionInFrame,
    shading: &Shading<impl SampleLobes>,
) -> [f32; 3] {
    let at = light.direction;
    let lag = lag_between(view.cos_phi, view.sin_phi, at.cos_phi, at.sin_phi);
    mode_at_lag(mode, light, view, &lag, shading)
}

/// [`single_scattering_mode`] with the lag at hand.
fn mode_at_lag(
    mode: u32,
    light: &LightInFrame,
    view: &DirectionInFrame,
    lag: &Lag,
    shading: &Shading<impl SampleLobes>,
) -> [f32; 3] {
    if shading.fibre.is_energy() {
        return energy_mode_at_lag(mode, light, view, lag, shading);
    }
    let mut total = [0.0f32; 3];
    let fibre = shading.fibre;
    let at = light.direction;
    let rule = outer_rule(
        at.theta,
        light.lambda,
        view.theta,
        fibre.alpha[mode as usize],
        fibre.beta[mode as usize],
    );
    if rule.ln_bound < LN_CULL {
        return total;
    }
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let extent = node_extent(&rule);
    let count = node_count(extent, fibre.node_count(mode));
    for ix in 0..count {
        let node = outer_node(&rule, node_constants(extent, count, ix));
        let cos_i = node.theta_i.cos().max(0.0);
        let incline = inclination(0.5 * (view.theta - node.theta_i));
        let kappa = kappa_j * cos_i;
        // At most 2 for any two directions, but for rounding at the poles.
        let ratio = (cos_i / incline.cos_theta_d).min(2.0);
        let factor = node.weight * (ratio * ratio);
        if mode == 0 {
            let value =
                factor * azimuthal_r(kappa, lag, &incline, shading.reflectance, &shading.tables);
            total = total.map(|sum| sum + value);
        } else {
            let value = if mode == 1 {
                let lobes = shading.tt.lobes_at(fibre.eta, incline.cos_theta_d);
                azimuthal_tt(kappa, lag, &lobes)
            } else {
                let eta = eta_star(kappa, lag, fibre);
                let lobes = shading.trt.lobes_at(eta, incline.cos_theta_d);
                azimuthal_trt(kappa, lag, &lobes)
            };
            for channel in 0..3 {
                total[channel] += factor * value[channel];
            }
        }
    }
    total
}

/// [`mode_at_lag`] of model `energy`: the integral of g^c(theta_i; theta_j, lambda_j) M_t cos(theta_i)
/// N_t(lambda', phi_o - phi_j, theta_o).
fn energy_mode_at_lag(
    mode: u32,
    light: &LightInFrame,
    view: &DirectionInFrame,
    lag: &Lag,
    shading: &Shading<impl SampleLobes>,
) -> [f32; 3] {
    let mut total = [0.0f32; 3];
    let fibre = shading.fibre;
    let at = light.direction;
    let (alpha, beta) = (fibre.alpha[mode as usize], fibre.beta[mode as usize]);
    let lobe = fisher_lobe(2.0 * alpha - view.theta, 4.0 * beta * beta);
    let rule = fisher_rule(at.theta, light.lambda, &lobe);
    if rule.ln_bound < LN_CULL {
        return total;
    }
    let kappa_j = 2.0 * at.cos_theta / (light.lambda * light.lambda);
    let incline = inclination(view.theta);
    let extent = node_extent(&rule);
    let count = node_count(extent, fibre.node_count(mode));
    if mode == 0 {
        for ix in 0..count {
            let place = fisher_place(&rule, node_constants(extent, count, ix));
            let from_light = (0.5 * (rule.to_light + place.step)).sin();
            let fall = rule.sharpness * (from_light * from_light);
            let cos_i = place.theta_i.cos().max(0.0);
            let factor =
                place.weight * fisher_density(&lobe, rule.to_lobe + place.step, cos_i, fall);
            let kappa = kappa_j * cos_i;
            let value =
                factor * azimuthal_r(kappa, lag, &incline, shading.reflectance, &shading.tables);
            total = total.map(|sum| sum + value);
        }
        return total;
    }
    let mut further = [0.0f32; 3];
    let lobes = if mode == 1 {
        shading.tt.lobes_at(fibre.eta, incline.cos_theta_d)
    } else {
        further = further_orders(fibre, incline.cos_theta_d);
        shading.trt.lobes_at(fibre.eta, incline.cos_theta_d)
    };
    for ix in 0..count {
        let place = fisher_place(&rule, node_constants(extent, count, ix));
        let from_light = (0.5 * (rule.to_light + place.step)).sin();
        let fall = rule.sharpness * (from_light * from_light);
        let cos_i = place.theta_i.cos().max(0.0);
        let factor = place.weight * fisher_density(&lobe, rule.to_lobe + place.step, cos_i, fall);
        let kappa = kappa_j * cos_i;
        let value = if mode == 1 {
            azimuthal_tt(kappa, lag, &lobes)
        } else {
            azimuthal_trt(kappa, lag, &lobes)
        };
        let even = bessel_i0e_fast(kappa);
        for channel in 0..3 {
            total[channel] += factor * (value[channel] + even * further[channel]);
        }
    }
    total
}

const _: () = assert!(MODE_R == 1, "modes are bits in the order of p");
