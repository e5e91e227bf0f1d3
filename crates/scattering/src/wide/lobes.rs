//! The lobes of TT and TRT for eight inclinations. Twin: `closed_form/lobes.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{EVEN_TEXELS, LobeView, N_LOBE_NUMBERS};

use super::LANES;
use super::math::{clamp, mul_add};
use super::rows::{cells, transpose};

/// The three lobes at eight inclinations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobes<S: Simd> {
    /// Widths.
    pub lambda: [f32x8<S>; 3],
    /// cos(mu/2) of the two pairs.
    pub cos_half: [f32x8<S>; 2],
    /// sin(mu/2) of the two pairs.
    pub sin_half: [f32x8<S>; 2],
    /// Amplitudes per lobe, then channel, over `square`.
    pub amplitude: [[f32x8<S>; 3]; 3],
    /// Factor of all amplitudes.
    pub square: f32x8<S>,
}

/// [`crate::closed_form::lobe_place`].
#[inline(always)]
fn lobe_place<S: Simd>(warp: f32, cos_theta_d: f32x8<S>) -> f32x8<S> {
    let dense = f32x8::splat(cos_theta_d.token(), (1.0 - EVEN_TEXELS) * (1.0 + warp))
        / (cos_theta_d + warp);
    (cos_theta_d * (dense + EVEN_TEXELS)).min(1.0)
}

/// [`crate::closed_form::sample_lobes`].
#[inline(always)]
pub(super) fn sample_lobes<S: Simd>(
    view: &LobeView,
    eta: f32x8<S>,
    cos_theta_d: f32x8<S>,
) -> Lobes<S> {
    let simd = eta.token();
    let decode = view.decode;
    let u = lobe_place(decode.warp, cos_theta_d);
    let (first, fraction) = cells(u * decode.last, decode.last);
    let fraction = <[f32; LANES]>::from(fraction);
    let mut halves = [[u; LANES]; 2];
    if decode.last_row > 0.0 {
        let at = (eta - decode.eta_first) * decode.eta_scale;
        let (row, weight) = cells(clamp(at, 0.0, decode.last_row), decode.last_row);
        let weight = <[f32; LANES]>::from(weight);
        let width = decode.last as usize + 1;
        for lane in 0..LANES {
            let ix = first[lane] as usize + row[lane] as usize * width;
            let along = f32x8::splat(simd, fraction[lane]);
            let below = mix_texels(simd, view.texels, ix, along);
            let above = mix_texels(simd, view.texels, ix + width, along);
            let across = f32x8::splat(simd, weight[lane]);
            halves[0][lane] = mul_add(above[0] - below[0], across, below[0]);
            halves[1][lane] = mul_add(above[1] - below[1], across, below[1]);
        }
    } else {
        for lane in 0..LANES {
            let along = f32x8::splat(simd, fraction[lane]);
            let mixed = mix_texels(simd, view.texels, first[lane] as usize, along);
            halves[0][lane] = mixed[0];
            halves[1][lane] = mixed[1];
        }
    }
    // A loop, and not twice the code.
    for half in &mut halves {
        *half = transpose(*half);
    }
    let [a, b] = halves;
    Lobes {
        lambda: [a[0], a[1], a[2]],
        cos_half: [a[3], a[5]],
        sin_half: [a[4], a[6]],
        amplitude: [[a[7], b[2], b[5]], [b[0], b[3], b[6]], [b[1], b[4], b[7]]],
        square: u * u,
    }
}

/// The numbers of texel `ix` and the next mixed, the second by `fraction`.
#[inline(always)]
fn mix_texels<S: Simd>(
    simd: S,
    texels: &[[f32; N_LOBE_NUMBERS]],
    ix: usize,
    fraction: f32x8<S>,
) -> [f32x8<S>; 2] {
    let texels = &texels[ix..ix + 2];
    let ([low_0, low_1], [high_0, high_1]) = (halves(&texels[0]), halves(&texels[1]));
    let low_0 = f32x8::load_array_ref(simd, low_0);
    let low_1 = f32x8::load_array_ref(simd, low_1);
    let high_0 = f32x8::load_array_ref(simd, high_0);
    let high_1 = f32x8::load_array_ref(simd, high_1);
    [
        mul_add(high_0 - low_0, fraction, low_0),
        mul_add(high_1 - low_1, fraction, low_1),
    ]
}

/// The two vectors of a texel.
#[inline(always)]
fn halves(texel: &[f32; N_LOBE_NUMBERS]) -> [&[f32; LANES]; 2] {
    let halves = texel.as_chunks::<LANES>().0;
    [&halves[0], &halves[1]]
}

const _: () = assert!(N_LOBE_NUMBERS == 2 * LANES);
