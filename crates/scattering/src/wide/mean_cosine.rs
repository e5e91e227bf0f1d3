//! Z_j of eight inclinations. Twin: `closed_form/mean_cosine.rs`.

use core::f32::consts::FRAC_PI_2;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{HUMLICEK_ABOVE, HUMLICEK_BELOW, MEAN_COSINE_MIN};

use super::math::exp;

/// Imaginary part of the Faddeeva function.
#[inline(always)]
fn faddeeva_imaginary<S: Simd>(x: f32, y: f32x8<S>) -> f32x8<S> {
    let one = f32x8::splat(y.token(), 1.0);
    let leading = HUMLICEK_ABOVE[0];
    let a = horner(
        x,
        y,
        [y * leading, one * (-leading * x)],
        &HUMLICEK_ABOVE[1..],
    );
    let b = horner(x, y, [y, one * -x], &HUMLICEK_BELOW);
    (a[1] * b[0] - a[0] * b[1]) / (b[0] * b[0] + b[1] * b[1])
}

/// Horner's scheme at y - i x: each step adds one of `added`.
#[inline(always)]
fn horner<S: Simd>(x: f32, y: f32x8<S>, first: [f32x8<S>; 2], added: &[f32]) -> [f32x8<S>; 2] {
    let [mut real, mut imaginary] = first;
    real += added[0];
    for c in &added[1..] {
        let next = real * y + imaginary * x + *c;
        imaginary = imaginary * y - real * x;
        real = next;
    }
    [real, imaginary]
}

/// [`crate::closed_form::mean_cosine`].
#[inline(always)]
pub(crate) fn mean_cosine<S: Simd>(
    theta_j: f32x8<S>,
    cos_theta_j: f32x8<S>,
    sigma_f: f32,
) -> f32x8<S> {
    let x = 0.5 * sigma_f;
    let inverse = 1.0 / sigma_f;
    let size = theta_j.abs();
    let near = ((-size + FRAC_PI_2).max(0.0) * inverse).min(9.0);
    let far = ((size + FRAC_PI_2) * inverse).min(9.0);
    let ends = exp(-near * near) * faddeeva_imaginary(x, near)
        + exp(-far * far) * faddeeva_imaginary(x, far);
    (cos_theta_j * (-x * x).exp() + ends * 0.5).max(MEAN_COSINE_MIN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form;
    use crate::wide::{LANES, dispatch, levels};

    #[test]
    fn eight_are_as_one_by_one() {
        for (name, level) in levels() {
            for exponent in -20..7 {
                let sigma_f = (0.34 * exponent as f32).exp();
                let theta: [f32; LANES] = std::array::from_fn(|lane| 0.44 * lane as f32 - 1.55);
                let cosine = theta.map(f32::cos);
                let found: [f32; LANES] = dispatch!(level, simd => mean_cosine(
                    f32x8::simd_from(simd, theta),
                    f32x8::simd_from(simd, cosine),
                    sigma_f,
                ).into());
                for lane in 0..LANES {
                    let one = closed_form::mean_cosine(theta[lane], cosine[lane], sigma_f);
                    let off = (found[lane] / one - 1.0).abs();
                    assert!(off < 2e-6, "{name} {sigma_f} {lane}: {off}");
                }
            }
        }
    }
}
