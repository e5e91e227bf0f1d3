//! The inner integrals of Eq 12 for TT and TRT, of eight lights. Twin: `closed_form/azimuthal.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::lobes::Lobes;
use super::math::{bessel_i0e_parts, exp, mul_add};

/// [`crate::closed_form::lobe_integral`], sharpnesses summing up to at most 2.5e6.
#[inline(always)]
pub(super) fn lobe_integral<S: Simd>(
    kappa_1: f32x8<S>,
    kappa_2: f32x8<S>,
    sin_half_2: f32x8<S>,
) -> f32x8<S> {
    let sum = kappa_1 + kappa_2;
    let fall = kappa_1 * kappa_2 * 4.0 * sin_half_2;
    let kappa_3 = (sum * sum - fall).max(0.0).sqrt();
    let [above, below] = bessel_i0e_parts(kappa_3);
    // One division for both quotients; at 2.5e6 the product is 1.5e38.
    let whole = sum + kappa_3;
    let inverse = f32x8::splat(sum.token(), 1.0) / (whole * below);
    exp(-(fall * (below * inverse))) * (above * (whole * inverse)).sqrt()
}

/// Sharpnesses of the lobes, 2 / lambda^2.
#[inline(always)]
pub(super) fn sharpnesses<S: Simd>([square_0, square_1, square_2]: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let whole = square_0 * square_1 * square_2;
    let inverse = f32x8::splat(whole.token(), 2.0) / whole;
    [
        square_1 * square_2 * inverse,
        square_0 * square_2 * inverse,
        square_0 * square_1 * inverse,
    ]
}

/// TT where `sin_half` and `cos_half` are lag's cosine and sine, TRT where they are its sine and cosine:
/// [`crate::closed_form::azimuthal_tt`], [`crate::closed_form::azimuthal_trt`].
#[inline(always)]
pub(super) fn azimuthal_lobes<S: Simd>(
    kappa: f32x8<S>,
    sin_half: f32x8<S>,
    cos_half: f32x8<S>,
    lobes: &Lobes<S>,
) -> [f32x8<S>; 3] {
    let [lambda_0, lambda_1, lambda_2] = lobes.lambda;
    let [kappa_0, kappa_1, kappa_2] = sharpnesses([
        lambda_0 * lambda_0,
        lambda_1 * lambda_1,
        lambda_2 * lambda_2,
    ]);
    let middle_1 = sin_half * lobes.cos_half[0];
    let apart_1 = cos_half * lobes.sin_half[0];
    let middle_2 = sin_half * lobes.cos_half[1];
    let apart_2 = cos_half * lobes.sin_half[1];
    let (near_1, far_1) = (middle_1 - apart_1, middle_1 + apart_1);
    let (near_2, far_2) = (middle_2 - apart_2, middle_2 + apart_2);
    // A loop over pairs: two chains of dependent steps at a time, and one body for both pairs.
    let mut pairs = [[kappa_1, near_1, far_1], [kappa_2, near_2, far_2]];
    for [kappa_l, near, far] in &mut pairs {
        let near = lobe_integral(kappa, *kappa_l, *near * *near);
        *kappa_l = (near + lobe_integral(kappa, *kappa_l, *far * *far)) * lobes.square;
    }
    let p_0 = lobe_integral(kappa, kappa_0, sin_half * sin_half) * lobes.square;
    let [[p_1, ..], [p_2, ..]] = pairs;
    let mut rgb = [p_0; 3];
    for (channel, value) in rgb.iter_mut().enumerate() {
        let amplitude = &lobes.amplitude;
        let sum = mul_add(amplitude[1][channel], p_1, amplitude[0][channel] * p_0);
        *value = mul_add(amplitude[2][channel], p_2, sum);
    }
    rgb
}
