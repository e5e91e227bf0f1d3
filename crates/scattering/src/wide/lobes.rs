//! The lobes of TT and TRT for eight inclinations. Twin: `closed_form/lobes.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{EVEN_TEXELS, LobeView, N_LOBE_NUMBERS, PaintedPointLobes};

use super::LANES;
use super::math::{clamp, mul_add};
use super::rows::{cells, transpose};

/// The three lobes at eight inclinations.
#[derive(Clone, Copy, Debug)]
pub struct Lobes<S: Simd> {
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

/// Where shading finds the lobes of a mode for eight lanes; of [`crate::closed_form::SampleLobes`].
pub trait SampleLobes {
    /// The lobes at `cos_theta_d` >= 0; `eta` is looked at by elliptic fibres alone.
    fn lobes_at<S: Simd>(&self, eta: f32x8<S>, cos_theta_d: f32x8<S>) -> Lobes<S>;
}

impl SampleLobes for LobeView<'_> {
    #[inline(always)]
    fn lobes_at<S: Simd>(&self, eta: f32x8<S>, cos_theta_d: f32x8<S>) -> Lobes<S> {
        sample_lobes(self, eta, cos_theta_d)
    }
}

/// One lane after the other, by the scalar code: a painted point's lobes are some 30 numbers from six
/// places.
impl SampleLobes for PaintedPointLobes<'_> {
    #[inline(always)]
    fn lobes_at<S: Simd>(&self, eta: f32x8<S>, cos_theta_d: f32x8<S>) -> Lobes<S> {
        let simd = eta.token();
        let etas = <[f32; LANES]>::from(eta);
        let cosines = <[f32; LANES]>::from(cos_theta_d);
        let lanes: [_; LANES] = std::array::from_fn(|lane| {
            crate::closed_form::SampleLobes::lobes_at(self, etas[lane], cosines[lane])
        });
        let mut numbers = [[0.0; LANES]; N_LOBE_NUMBERS];
        for (lane, lobes) in lanes.iter().enumerate() {
            let [a_0, a_1, a_2] = lobes.amplitude;
            let row = [lobes.lambda, a_0, a_1, a_2];
            for (ix, number) in row.as_flattened().iter().enumerate() {
                numbers[ix][lane] = *number;
            }
            for ix in 0..2 {
                numbers[12 + ix][lane] = lobes.cos_half[ix];
                numbers[14 + ix][lane] = lobes.sin_half[ix];
            }
        }
        let mut x = [eta; N_LOBE_NUMBERS];
        for (x, numbers) in x.iter_mut().zip(&numbers) {
            *x = f32x8::load_array_ref(simd, numbers);
        }
        Lobes {
            lambda: [x[0], x[1], x[2]],
            cos_half: [x[12], x[13]],
            sin_half: [x[14], x[15]],
            amplitude: [[x[3], x[4], x[5]], [x[6], x[7], x[8]], [x[9], x[10], x[11]]],
            square: f32x8::splat(simd, 1.0),
        }
    }
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
fn sample_lobes<S: Simd>(view: &LobeView, eta: f32x8<S>, cos_theta_d: f32x8<S>) -> Lobes<S> {
    let simd = eta.token();
    let decode = view.decode;
    let u = lobe_place(decode.warp, cos_theta_d);
    let (first, fraction) = cells(u * decode.last, decode.last);
    let fraction = <[f32; LANES]>::from(fraction);
    let mut halves = [[f32x8::splat(simd, 0.0); LANES]; 2];
    let (mut row_offset, mut weight) = ([0; LANES], [0.0; LANES]);
    if decode.last_row > 0.0 {
        let at = (eta - decode.eta_first) * decode.eta_scale;
        let (row, of_second) = cells(clamp(at, 0.0, decode.last_row), decode.last_row);
        let width = decode.last as usize + 1;
        for (offset, row) in row_offset.iter_mut().zip(row) {
            *offset = row as usize * width;
        }
        weight = of_second.into();
    }
    for (half, columns) in halves.iter_mut().enumerate() {
        for lane in 0..LANES {
            let ix = first[lane] as usize + row_offset[lane];
            let along = f32x8::splat(simd, fraction[lane]);
            columns[lane] = mix_texels(simd, &view.texels[ix..ix + 2], half, along);
            if decode.last_row > 0.0 {
                let ix = ix + decode.last as usize + 1;
                let above = mix_texels(simd, &view.texels[ix..ix + 2], half, along);
                let below = columns[lane];
                columns[lane] = mul_add(above - below, f32x8::splat(simd, weight[lane]), below);
            }
        }
        *columns = transpose(*columns);
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

/// Half of the numbers of two texels mixed, the second by `fraction`.
#[inline(always)]
fn mix_texels<S: Simd>(
    simd: S,
    texels: &[[f32; N_LOBE_NUMBERS]],
    half: usize,
    fraction: f32x8<S>,
) -> f32x8<S> {
    let low = f32x8::load_array_ref(simd, &texels[0].as_chunks::<LANES>().0[half]);
    let high = f32x8::load_array_ref(simd, &texels[1].as_chunks::<LANES>().0[half]);
    mul_add(high - low, fraction, low)
}

const _: () = assert!(N_LOBE_NUMBERS == 2 * LANES);
