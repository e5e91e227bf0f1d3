//! The inner integral of Eq 12 for R, of eight lights. Twins: `closed_form/azimuthal_r.rs` and, for the
//! table C, `closed_form/tables.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8, u16x16};

use crate::closed_form::{
    PACKED_ONE, PackedShares, Reflectance, SPACING_CONCAVE, SPACING_INVERSE_SQRT, SPACING_LOG,
    SPACING_RECIPROCAL, SPACING_ROOT_SQUARE, TableAxes, TableAxis,
};
use crate::reflectance::REFLECTANCE_DEGREE;
use crate::table_layout::C_DEGREE;

use super::LANES;
use super::math::{bessel_i0e_fast, clamp, ln, mul_add};
use super::rows::{cells, sums};

/// Where a value stands among the texels of an axis.
#[inline(always)]
fn texels_at<S: Simd>(axis: &TableAxis, x: f32x8<S>) -> f32x8<S> {
    let x = clamp(x, axis.min, axis.max);
    let one = f32x8::splat(x.token(), 1.0);
    let warped = match axis.spacing {
        SPACING_INVERSE_SQRT => {
            let t = one / (x + 1.0).sqrt();
            (t + t.sqrt()) * 0.5
        }
        SPACING_ROOT_SQUARE => x.sqrt() * 0.6 + x * x * 0.4,
        SPACING_RECIPROCAL => {
            let r = one - one / x;
            (r + r * r) * 0.5
        }
        SPACING_CONCAVE => x * (f32x8::splat(x.token(), 1.3) - x * 0.3),
        SPACING_LOG => ln(x),
        _ => x,
    };
    clamp((warped - axis.warp_min) * axis.scale, 0.0, axis.last)
}

/// Columns of the table C: what [`azimuthal_r`] needs of a light's azimuth, the same for all nodes.
#[derive(Clone, Copy)]
pub(super) struct Columns {
    first: [i32; LANES],
    fraction: [f32; LANES],
}

impl Columns {
    #[inline(always)]
    pub fn new<S: Simd>(axes: &TableAxes, cos_half: f32x8<S>) -> Columns {
        let (first, fraction) = cells(texels_at(&axes.c_columns, cos_half), axes.c_columns.last);
        Columns {
            first,
            fraction: fraction.into(),
        }
    }
}

/// Two texels mixed, the second by `fraction`.
#[inline(always)]
fn mix_texels<S: Simd>(simd: S, texels: &[PackedShares], fraction: f32x8<S>) -> f32x8<S> {
    let numbers: &[u16; 2 * C_DEGREE] = texels
        .as_flattened()
        .as_array()
        .expect("two texels are 16 numbers");
    let (left, right) = u16x16::load_array_ref(simd, numbers).widen();
    // The conversion of signed numbers is one instruction.
    let left = left.bitcast::<i32x8<S>>().to_float::<f32x8<S>>();
    let right = right.bitcast::<i32x8<S>>().to_float::<f32x8<S>>();
    mul_add(right - left, fraction, left)
}

/// [`crate::closed_form::azimuthal_r`].
#[inline(always)]
pub(super) fn azimuthal_r<S: Simd>(
    kappa: f32x8<S>,
    columns: &Columns,
    cos_theta_d: f32x8<S>,
    reflectance: &Reflectance,
    (table, axes): (&[PackedShares], &TableAxes),
) -> f32x8<S> {
    let simd = kappa.token();
    let (row, weight) = cells(texels_at(&axes.c_rows, kappa), axes.c_rows.last);
    let weight = <[f32; LANES]>::from(weight);
    let width = axes.c_columns.last as usize + 1;
    let x = cos_theta_d;
    let v = f32x8::splat(simd, reflectance.scale) / (x + reflectance.scale);
    let y = <[f32; LANES]>::from(v * (f32x8::splat(simd, 1.0) - x));
    // Here a vector is b_1..b_8 of one light, as in the twin; half of the lights at a time, so that
    // registers suffice.
    let mut terms = [x; LANES];
    for (half, terms) in terms.as_chunks_mut::<HALF>().0.iter_mut().enumerate() {
        let lanes = half * HALF..(half + 1) * HALF;
        let mut at = [x; HALF];
        for (at, y) in at.iter_mut().zip(&y[lanes.clone()]) {
            *at = f32x8::splat(simd, *y);
        }
        let highest = &reflectance.coefficients[REFLECTANCE_DEGREE];
        let mut f = [f32x8::load_array_ref(simd, highest); HALF];
        for row in reflectance.coefficients[..REFLECTANCE_DEGREE].iter().rev() {
            let row = f32x8::load_array_ref(simd, row);
            for (f, at) in f.iter_mut().zip(&at) {
                *f = mul_add(*f, *at, row);
            }
        }
        for ((term, f), lane) in terms.iter_mut().zip(&f).zip(lanes) {
            let ix = row[lane] as usize * width + columns.first[lane] as usize;
            let fraction = f32x8::splat(simd, columns.fraction[lane]);
            let top = mix_texels(simd, &table[ix..ix + 2], fraction);
            let bottom = mix_texels(simd, &table[ix + width..ix + width + 2], fraction);
            let b = mul_add(bottom - top, f32x8::splat(simd, weight[lane]), top);
            *term = *f * b;
        }
    }
    let sum = sums(terms) * (1.0 / PACKED_ONE);
    bessel_i0e_fast(kappa) * (v * v) * sum.max(0.0)
}

/// Lights that [`azimuthal_r`] has in registers.
const HALF: usize = LANES / 2;

const _: () = assert!(C_DEGREE == LANES);
