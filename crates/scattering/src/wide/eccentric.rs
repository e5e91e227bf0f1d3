//! TRT of an elliptic fibre for eight lights. Twin: `closed_form/eccentric.rs`.

use core::f32::consts::{FRAC_1_PI, PI};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{
    AZIMUTH_BLUR, AZIMUTH_BUMP, AZIMUTH_REACH, AZIMUTH_SHEAR, AZIMUTH_SHEAR_MAX, AZIMUTH_SIDE,
    AZIMUTH_STRETCH, AZIMUTH_STRETCHED, AZIMUTH_TILT, AZIMUTHS, DirectionInFrame, ETA_STAR_MAX,
    ETA_STAR_MIN, Fibre, LobeView, Lobes as OneLobes,
};

use super::azimuthal::{azimuthal_lobes, sharpnesses};
use super::frame::Lags;
use super::lobes::{Lobes, LobesByEta};
use super::math::{clamp, cos, exp, mul_add, sin};

/// [`crate::closed_form::eta_at`].
#[inline(always)]
fn eta_at<S: Simd>(cosine: f32x8<S>, fibre: &Fibre) -> f32x8<S> {
    clamp(
        cosine * fibre.eta_swing + fibre.eta_mean,
        fibre.eta.min(ETA_STAR_MIN),
        ETA_STAR_MAX,
    )
}

/// Sine and cosine of half the angle, within +-pi, of a vector of components `x`, `y` and this
/// `length` > 0; the cosine is not negative.
#[inline(always)]
fn half_angle<S: Simd>(x: f32x8<S>, y: f32x8<S>, length: f32x8<S>) -> [f32x8<S>; 2] {
    let large = (x.abs() / length * 0.5 + 0.5).sqrt();
    let small = y * 0.5 / (length * large);
    let is_near = x.simd_ge(0.0);
    [
        is_near.select(small, large.copysign(y)),
        is_near.select(large, small.abs()),
    ]
}

/// [`crate::closed_form::azimuthal_elliptic`].
#[inline(always)]
pub(super) fn azimuthal_elliptic<S: Simd>(
    kappa: f32x8<S>,
    lag: &Lags<S>,
    view: &DirectionInFrame,
    cos_theta_d: f32x8<S>,
    u: f32x8<S>,
    fibre: &Fibre,
    trt: &LobeView,
) -> [f32x8<S>; 3] {
    let simd = kappa.token();
    let cos_view = view.cos_phi * view.cos_phi - view.sin_phi * view.sin_phi;
    let sin_view = 2.0 * view.sin_phi * view.cos_phi;
    let sin_half_lag = lag.sin_half.copysign(lag.turn);
    let cos_lag = sin_half_lag * sin_half_lag * -2.0 + 1.0;
    let sin_lag = sin_half_lag * lag.cos_half * 2.0;
    let (x, y) = (kappa * cos_lag + AZIMUTH_BUMP, kappa * sin_lag);
    let kappa_3 = (x * x + y * y).sqrt().max(1e-6);
    let [sin_centre, cos_centre] = half_angle(x, y, kappa_3);
    let by_eta = LobesByEta::new(trt, cos_theta_d);
    let cosine = (x * cos_view - y * sin_view) / ((kappa_3 * kappa_3 + 2.25).sqrt() + 0.5);
    let mean = by_eta.at(eta_at(cosine, fibre));
    let (x, y) = (kappa + cos_lag * AZIMUTH_BUMP, sin_lag * -AZIMUTH_BUMP);
    let [sin_light, cos_light] = half_angle(x, y, kappa_3);
    let reach = (f32x8::splat(simd, AZIMUTH_REACH) / kappa_3.sqrt()).min(PI);
    let tilt = (AZIMUTH_TILT * fibre.alpha[2]).clamp(-1.0, 1.0);
    let growth = exp(clamp(
        u * (AZIMUTH_SHEAR * tilt) * clamp(sin_lag * AZIMUTH_SIDE, -1.0, 1.0),
        -AZIMUTH_SHEAR_MAX,
        AZIMUTH_SHEAR_MAX,
    ));
    let cosh = (growth + f32x8::splat(simd, 1.0) / growth) * 0.5;
    let sinh = growth - cosh;
    let stretched = (kappa_3 * AZIMUTH_STRETCHED).min(1.0);
    let is_even = f32x8::splat(simd, 1.0) - stretched;
    let half_reach = reach * 0.5;
    let step_of_t = reach * (0.25 * AZIMUTH_STRETCH);
    let mut total = [f32x8::splat(simd, 0.0); 3];
    for (ix, [at, dense]) in AZIMUTHS.into_iter().enumerate() {
        let [even, even_dense] = [0.25 * ix as f32 - 0.875, 1.0 / AZIMUTH_STRETCH];
        let place = is_even * even + stretched * (cosh * at + sinh * dense);
        let spread = is_even * even_dense + stretched * (cosh * dense + sinh * at);
        let delta = half_reach * place;
        let (sin, cos) = (sin(delta), cos(delta));
        let sin_half = sin_centre * cos + cos_centre * sin;
        let cos_half = cos_centre * cos - sin_centre * sin;
        let from_light = sin_light * cos + cos_light * sin;
        let cos_psi = sin_half * sin_half * -2.0 + 1.0;
        let sin_psi = sin_half * cos_half * 2.0;
        let eta = eta_at(cos_psi * cos_view - sin_psi * sin_view, fibre);
        let step = step_of_t * spread;
        let blur = step * step * AZIMUTH_BLUR;
        let value = lobes_at_azimuth(&by_eta.at(eta), sin_half, cos_half, blur);
        let weight = spread * height(kappa, from_light);
        let of_mean = lobes_at_azimuth(&mean, sin_half, cos_half, blur);
        for ((total, value), of_mean) in total.iter_mut().zip(value).zip(of_mean) {
            *total += weight * (value - of_mean);
        }
    }
    let closed = azimuthal_lobes(kappa, sin_half_lag, lag.cos_half, &mean);
    let scale = step_of_t * by_eta.square * (0.5 * FRAC_1_PI);
    for (total, closed) in total.iter_mut().zip(closed) {
        *total = (closed + scale * *total).max(0.0);
    }
    total
}

/// Circular Gaussian of this sharpness, `sin_half` of half the azimuth from its centre.
#[inline(always)]
fn height<S: Simd>(kappa: f32x8<S>, sin_half: f32x8<S>) -> f32x8<S> {
    exp(kappa * -2.0 * (sin_half * sin_half))
}

/// Sum over the lobes of amplitude times height, over `square`, with `blur` more of the square of their
/// widths; `sin_half` and `cos_half` of half the azimuth from their common centre.
#[inline(always)]
fn lobes_at_azimuth<S: Simd>(
    lobes: &Lobes<S>,
    sin_half: f32x8<S>,
    cos_half: f32x8<S>,
    blur: f32x8<S>,
) -> [f32x8<S>; 3] {
    let mut squares = [blur; 3];
    for (square, lambda) in squares.iter_mut().zip(lobes.lambda) {
        *square += lambda * lambda;
    }
    let kappas = sharpnesses(squares);
    let mut heights = [height(kappas[0], sin_half); 3];
    for pair in 0..2 {
        let middle = sin_half * lobes.cos_half[pair];
        let apart = cos_half * lobes.sin_half[pair];
        let kappa = kappas[pair + 1];
        heights[pair + 1] = height(kappa, middle - apart) + height(kappa, middle + apart);
    }
    // They keep their mass.
    for ((height, lambda), kappa) in heights.iter_mut().zip(lobes.lambda).zip(kappas) {
        *height *= lambda * (kappa * 0.5).sqrt();
    }
    let mut rgb = heights;
    for (channel, value) in rgb.iter_mut().enumerate() {
        let amplitude = &lobes.amplitude;
        let sum = mul_add(
            amplitude[1][channel],
            heights[1],
            amplitude[0][channel] * heights[0],
        );
        *value = mul_add(amplitude[2][channel], heights[2], sum);
    }
    rgb
}

/// The same of one fibre's `lobes` at one inclination, and with their whole amplitudes.
#[inline(always)]
pub(crate) fn one_at_azimuths<S: Simd>(
    simd: S,
    lobes: &OneLobes,
    sin_half: f32x8<S>,
    cos_half: f32x8<S>,
    blur: f32,
) -> [f32x8<S>; 3] {
    let lobes = Lobes::splat(simd, lobes);
    lobes_at_azimuth(&lobes, sin_half, cos_half, f32x8::splat(simd, blur))
}
