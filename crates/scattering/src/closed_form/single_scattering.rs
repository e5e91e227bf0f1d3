//! Eq 11: one spherical Gaussian light over the scattering function. Twin:
//! `shaders/lib/single_scattering.wgsl`.
//!
//! Each mode is integrated over theta_i by the nodes of [`super::outer_integral`]; at a node the
//! integral over azimuth is R's polynomial on the table C, or TT's and TRT's lobes. With the
//! default nodes that is at most 8 inner integrals and 13 fetches a light: one of C for each
//! node of R, two 16-byte texels of the lobe texture for each of TT and TRT. TRT of an
//! elliptic fibre has nine bilinear fetches at a node, for one index and for eight azimuths
//! ([`super::eccentric`]). Of model `energy` ([`super::fisher_lobe`]) TT and TRT read
//! once for all nodes.

use core::f32::consts::{FRAC_1_PI, FRAC_1_SQRT_2, PI};

use super::azimuthal::{azimuthal_lobes, azimuthal_trt, azimuthal_tt};
use super::azimuthal_r::{Reflectance, azimuthal_r};
use super::eccentric::{
    AZIMUTH_BUMP, AZIMUTH_REACH, AZIMUTH_STRETCH, AZIMUTH_STRETCHED, AZIMUTHS, EllipticLag,
    azimuth_node, elliptic_lag, eta_at, eta_at_azimuth, half_angle, height, lobes_at_azimuth,
    moved,
};
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

/// TRT of an elliptic fibre, per channel, for a light of sharpness `kappa` = 2 / lambda'^2 >= 0 and
/// amplitude 1: `Int g^c(phi_i; phi_j, lambda') N_TRT(phi_o - phi_i; eta*(phi_o + phi_i)) dphi_i`,
/// blurred by w_c (the lobes hold it). `u` is the place of the node of the outer integral, as in
/// [`super::GAUSS_HERMITE`].
pub fn azimuthal_elliptic(
    kappa: f32,
    lag: &EllipticLag,
    cos_theta_d: f32,
    u: f32,
    fibre: &Fibre,
    trt: &impl SampleLobes,
) -> [f32; 3] {
    let cos_lag = 1.0 - 2.0 * lag.sin_half * lag.sin_half;
    let sin_lag = 2.0 * lag.sin_half * lag.cos_half;
    // The centre of the product of light and bump, from the view, and from the light without
    // cancellation.
    let (x, y) = (AZIMUTH_BUMP + kappa * cos_lag, kappa * sin_lag);
    let kappa_3 = (x * x + y * y).sqrt().max(1e-6);
    let [sin_centre, cos_centre] = half_angle(x, y, kappa_3);
    // Lobes at the mean index over the product, whose integral is closed; I_1(k) / (k I_0(k)) to 5 %.
    let cosine = (lag.cos_view * x - lag.sin_view * y) / (0.5 + (kappa_3 * kappa_3 + 2.25).sqrt());
    let mean = trt.lobes_at(eta_at(cosine, fibre), cos_theta_d);
    let (x, y) = (kappa + AZIMUTH_BUMP * cos_lag, -AZIMUTH_BUMP * sin_lag);
    let [sin_light, cos_light] = half_angle(x, y, kappa_3);
    let reach = (AZIMUTH_REACH / kappa_3.sqrt()).min(PI);
    let by = moved(u, sin_lag, fibre);
    let stretched = (AZIMUTH_STRETCHED * kappa_3).min(1.0);
    let step_of_t = reach * (0.25 * AZIMUTH_STRETCH);
    let mut total = [0.0f32; 3];
    for ix in 0..AZIMUTHS.len() {
        let [at, dense] = azimuth_node(ix, by, stretched);
        let delta = 0.5 * reach * at;
        let (sin, cos) = (delta.sin(), delta.cos());
        let sin_half = sin_centre * cos + cos_centre * sin;
        let cos_half = cos_centre * cos - sin_centre * sin;
        let from_light = sin_light * cos + cos_light * sin;
        let weight = dense * height(kappa, from_light);
        let eta = eta_at_azimuth(lag, sin_half, cos_half, fibre);
        let lobes = trt.lobes_at(eta, cos_theta_d);
        let step = step_of_t * dense;
        let value = lobes_at_azimuth(&lobes, sin_half, cos_half, step);
        let of_mean = lobes_at_azimuth(&mean, sin_half, cos_half, step);
        for channel in 0..3 {
            total[channel] += weight * (value[channel] - of_mean[channel]);
        }
    }
    // N_TRT is the lobes over 2 pi.
    let scale = step_of_t * (0.5 * FRAC_1_PI);
    let closed = azimuthal_lobes(kappa, lag.sin_half, lag.cos_half, &mean);
    std::array::from_fn(|channel| (closed[channel] + scale * total[channel]).max(0.0))
}

/// [`azimuthal_elliptic`] as two nodes of the outer integral weigh it: the inner integral by itself.
pub fn azimuthal_elliptic_of_two(
    kappa: f32,
    lag: &EllipticLag,
    cos_theta_d: f32,
    fibre: &Fibre,
    trt: &impl SampleLobes,
) -> [f32; 3] {
    let at = |u| azimuthal_elliptic(kappa, lag, cos_theta_d, u, fibre, trt);
    let (a, b) = (at(-FRAC_1_SQRT_2), at(FRAC_1_SQRT_2));
    std::array::from_fn(|channel| 0.5 * (a[channel] + b[channel]))
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
    let elliptic = elliptic_lag(view, &at, lag);
    for ix in 0..count {
        let constants = node_constants(extent, count, ix);
        let node = outer_node(&rule, constants);
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
            let cos_theta_d = incline.cos_theta_d;
            let value = if mode == 1 {
                azimuthal_tt(kappa, lag, &shading.tt.lobes_at(fibre.eta, cos_theta_d))
            } else if fibre.is_elliptic() {
                let [u, ..] = constants;
                azimuthal_elliptic(kappa, &elliptic, cos_theta_d, u, fibre, &shading.trt)
            } else {
                azimuthal_trt(kappa, lag, &shading.trt.lobes_at(fibre.eta, cos_theta_d))
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
