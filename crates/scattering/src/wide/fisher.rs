//! M_t of model `energy` for eight lights. Twin: `closed_form/fisher.rs`.

use core::f32::consts::FRAC_PI_2;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{FISHER_SPREAD, FisherLobe, HALF_PI_SQUARED, INVERSE_FISHER_CLAMP};

use super::math::{bessel_i0e_fast, exp, sin};
use super::outer_integral::OuterRules;

/// -[`crate::closed_form::OuterRule::ln_bound`] of [`crate::closed_form::fisher_rule`]. `variance_j` =
/// lambda_j^2.
#[inline(always)]
pub(super) fn fisher_bound<S: Simd>(
    theta_j: f32x8<S>,
    variance_j: f32x8<S>,
    lobe: &FisherLobe,
) -> f32x8<S> {
    let apart = theta_j - lobe.mean;
    apart * apart / ((variance_j + 2.0 / lobe.inverse) * HALF_PI_SQUARED)
}

/// [`crate::closed_form::fisher_rule`], with the extents.
#[inline(always)]
pub(super) fn fisher_rules<S: Simd>(
    theta_j: f32x8<S>,
    variance_j: f32x8<S>,
    lobe: &FisherLobe,
) -> OuterRules<S> {
    let simd = theta_j.token();
    let variance_m = 2.0 / lobe.inverse;
    let apart = theta_j - lobe.mean;
    let sum = variance_j + variance_m;
    let product = variance_j * variance_m;
    let bump = product * FISHER_SPREAD;
    let spread = (product / (sum * sum + bump * bump).sqrt()).sqrt();
    let to_light = -apart * (variance_j / sum);
    let mean = theta_j + to_light;
    let inverse_k = f32x8::splat(simd, INVERSE_FISHER_CLAMP) / spread;
    let scaled = mean * (1.0 / FRAC_PI_2);
    let cosine = (f32x8::splat(simd, 1.0) - scaled * scaled).max(0.0);
    OuterRules {
        mean,
        to_light,
        to_lobe: apart * (f32x8::splat(simd, variance_m) / sum),
        spread,
        low: exp((-(mean + FRAC_PI_2) * inverse_k).min(80.0)),
        high: exp(((mean - FRAC_PI_2) * inverse_k).min(80.0)),
        inverse_width: f32x8::splat(simd, lobe.inverse),
        sharpness: f32x8::splat(simd, 4.0) / variance_j,
        extent: spread / (cosine + spread).min(1.0),
    }
}

/// [`crate::closed_form::fisher_density`].
#[inline(always)]
pub(super) fn fisher_density<S: Simd>(
    lobe: &FisherLobe,
    apart: f32x8<S>,
    cos_i: f32x8<S>,
    fall: f32x8<S>,
) -> f32x8<S> {
    let half = sin(apart * 0.5);
    let bessel = bessel_i0e_fast(cos_i * lobe.across);
    cos_i * lobe.norm * bessel * exp(half * half * (-2.0 * lobe.inverse) - fall)
}
