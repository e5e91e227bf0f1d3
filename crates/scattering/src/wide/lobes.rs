//! The lobes of TT and TRT for eight inclinations. Twin: `closed_form/lobes.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{EVEN_TEXELS, LobeDecode, LobeView, Lobes as OneLobes, N_LOBE_NUMBERS};
use crate::lobes::ELLIPTIC_ROWS;

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

impl<S: Simd> Lobes<S> {
    /// The same ones eight times.
    #[inline(always)]
    pub fn splat(simd: S, lobes: &OneLobes) -> Lobes<S> {
        let zero = f32x8::splat(simd, 0.0);
        let mut all = Lobes {
            lambda: [zero; 3],
            cos_half: [zero; 2],
            sin_half: [zero; 2],
            amplitude: [[zero; 3]; 3],
            square: f32x8::splat(simd, 1.0),
        };
        for lobe in 0..3 {
            all.lambda[lobe] = f32x8::splat(simd, lobes.lambda[lobe]);
            for channel in 0..3 {
                all.amplitude[lobe][channel] = f32x8::splat(simd, lobes.amplitude[lobe][channel]);
            }
        }
        for pair in 0..2 {
            all.cos_half[pair] = f32x8::splat(simd, lobes.cos_half[pair]);
            all.sin_half[pair] = f32x8::splat(simd, lobes.sin_half[pair]);
        }
        all
    }
}

/// [`crate::closed_form::lobe_place`].
#[inline(always)]
fn lobe_place<S: Simd>(warp: f32, cos_theta_d: f32x8<S>) -> f32x8<S> {
    let dense = f32x8::splat(cos_theta_d.token(), (1.0 - EVEN_TEXELS) * (1.0 + warp))
        / (cos_theta_d + warp);
    (cos_theta_d * (dense + EVEN_TEXELS)).min(1.0)
}

/// [`crate::closed_form::sample_lobes`] of a fibre of one index.
#[inline(always)]
pub(super) fn sample_lobes<S: Simd>(view: &LobeView, cos_theta_d: f32x8<S>) -> Lobes<S> {
    let simd = cos_theta_d.token();
    let decode = view.decode;
    let u = lobe_place(decode.warp, cos_theta_d);
    let (first, fraction) = cells(u * decode.last, decode.last);
    let fraction = <[f32; LANES]>::from(fraction);
    let mut halves = [[u; LANES]; 2];
    for lane in 0..LANES {
        let along = f32x8::splat(simd, fraction[lane]);
        let mixed = mix_texels(simd, view.texels, first[lane] as usize, along);
        halves[0][lane] = mixed[0];
        halves[1][lane] = mixed[1];
    }
    lobes_of(halves, u * u)
}

/// The lobes of numbers by lane.
#[inline(always)]
fn lobes_of<S: Simd>(mut halves: [[f32x8<S>; LANES]; 2], square: f32x8<S>) -> Lobes<S> {
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
        square,
    }
}

/// The lobes of an elliptic fibre at eight inclinations, of every index: numbers by row, lane and half.
pub(super) struct LobesByEta<'a, S: Simd> {
    rows: [[[f32x8<S>; 2]; LANES]; ELLIPTIC_ROWS],
    decode: &'a LobeDecode,
    /// Factor of all amplitudes.
    pub square: f32x8<S>,
}

impl<'a, S: Simd> LobesByEta<'a, S> {
    /// Of this view.
    #[inline(always)]
    pub fn new(view: &LobeView<'a>, cos_theta_d: f32x8<S>) -> LobesByEta<'a, S> {
        let simd = cos_theta_d.token();
        let decode = view.decode;
        let u = lobe_place(decode.warp, cos_theta_d);
        let (first, fraction) = cells(u * decode.last, decode.last);
        let fraction = <[f32; LANES]>::from(fraction);
        let width = decode.last as usize + 1;
        // One, all the same, next to a round fibre.
        let last_row = decode.last_row as usize;
        let mut rows = [[[u; 2]; LANES]; ELLIPTIC_ROWS];
        for (row, numbers) in rows.iter_mut().enumerate() {
            for lane in 0..LANES {
                let along = f32x8::splat(simd, fraction[lane]);
                let ix = first[lane] as usize + row.min(last_row) * width;
                numbers[lane] = mix_texels(simd, view.texels, ix, along);
            }
        }
        LobesByEta {
            rows,
            decode,
            square: u * u,
        }
    }

    /// Those of index `eta`: [`crate::closed_form::sample_lobes`].
    #[inline(always)]
    pub fn at(&self, eta: f32x8<S>) -> Lobes<S> {
        let simd = eta.token();
        let last = (ELLIPTIC_ROWS - 1) as f32;
        let at = (eta - self.decode.eta_first) * self.decode.eta_scale;
        let (row, weight) = cells(clamp(at, 0.0, last), last);
        let weight = <[f32; LANES]>::from(weight);
        let mut halves = [[eta; LANES]; 2];
        for lane in 0..LANES {
            let row = (row[lane] as usize).min(ELLIPTIC_ROWS - 2);
            let (below, above) = (self.rows[row][lane], self.rows[row + 1][lane]);
            let across = f32x8::splat(simd, weight[lane]);
            halves[0][lane] = mul_add(above[0] - below[0], across, below[0]);
            halves[1][lane] = mul_add(above[1] - below[1], across, below[1]);
        }
        lobes_of(halves, self.square)
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
