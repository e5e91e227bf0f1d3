//! The index of an elliptic fibre for eight lights. Twin: `closed_form/eccentric.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{BUMP_SHARPNESS, ETA_STAR_MAX, ETA_STAR_MIN, Fibre};

use super::frame::Lags;
use super::math::clamp;

/// [`crate::closed_form::eta_star`].
#[inline(always)]
pub(super) fn eta_star<S: Simd>(kappa: f32x8<S>, lag: &Lags<S>, fibre: &Fibre) -> f32x8<S> {
    let simd = kappa.token();
    if fibre.eta_swing == 0.0 {
        return f32x8::splat(simd, fibre.eta);
    }
    let sum = kappa + BUMP_SHARPNESS;
    let fall = kappa * (4.0 * BUMP_SHARPNESS) * (lag.sin_half * lag.sin_half);
    let kappa_3_2 = (sum * sum - fall).max(0.0);
    let root = (kappa_3_2 + 2.25).sqrt() + 0.5;
    let cosine = (kappa * lag.cos_sum + BUMP_SHARPNESS * lag.cos_view) / root;
    clamp(
        cosine * fibre.eta_swing + fibre.eta_mean,
        fibre.eta.min(ETA_STAR_MIN),
        ETA_STAR_MAX,
    )
}
