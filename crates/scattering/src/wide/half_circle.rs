//! Shares of circular Gaussians within half circles, of eight lights. Twin: `closed_form/half_circle.rs`.

use core::f32::consts::PI;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::math::{erf_pair, mul_add, polynomial};

/// [`crate::closed_form::half_circle`].
#[inline(always)]
pub(crate) fn half_circle<S: Simd>(kappa: f32x8<S>, cosine: f32x8<S>) -> f32x8<S> {
    let above = polynomial(kappa, [1.0, 0.454_857_64, 0.169_984, 0.088_943_85]);
    let below = polynomial(
        kappa,
        [PI, 1.416_983_8, 1.130_757_6, 0.380_746_27, 0.177_887_7],
    );
    let slope = kappa * (above / below).sqrt();
    let square = kappa * kappa;
    let t_1 = square / polynomial(kappa, [7.897_07, 12.5801, 8.0]);
    let t_2 = square * square
        / mul_add(
            square,
            polynomial(kappa, [44.119_74, -18.460_45, 8.413_51]),
            f32x8::splat(kappa.token(), 46.940_235),
        );
    let c_2 = cosine * cosine;
    let bend = mul_add(
        c_2,
        mul_add(t_2, c_2, t_1),
        f32x8::splat(kappa.token(), 1.0),
    );
    erf_pair(slope * cosine * bend)[1] * 0.5 + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form;
    use crate::wide::{LANES, dispatch, levels};

    #[test]
    fn half_circles_are_those_of_one_light() {
        for (name, level) in levels() {
            for exponent in -30..70 {
                let kappa = (0.2 * exponent as f32).exp();
                let cosine = std::array::from_fn(|lane| 0.28 * lane as f32 - 0.98);
                let found: [f32; LANES] = dispatch!(level, simd => half_circle(
                    f32x8::splat(simd, kappa),
                    f32x8::simd_from(simd, cosine),
                ).into());
                for (found, cosine) in found.into_iter().zip(cosine) {
                    let one = closed_form::half_circle(kappa, cosine);
                    assert!((found - one).abs() < 2e-6, "{name} {kappa} {cosine}");
                }
            }
        }
    }
}
