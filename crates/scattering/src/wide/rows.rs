//! Rows of a table, one for each lane.
//!
//! Eight loads of whole rows and a transposition cost less than gathers of their numbers, on every
//! processor so far.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

use super::LANES;

/// Numbers `[column][lane]` from rows `[lane][column]`.
#[inline(always)]
pub fn transpose<S: Simd>(rows: [f32x8<S>; LANES]) -> [f32x8<S>; LANES] {
    // A zip of rows four apart turns the six bits (lane, column) of a number's place by one.
    let mut rows = rows;
    for _ in 0..3 {
        let [a, b, c, d, e, f, g, h] = rows;
        rows = [
            a.zip_low(e),
            a.zip_high(e),
            b.zip_low(f),
            b.zip_high(f),
            c.zip_low(g),
            c.zip_high(g),
            d.zip_low(h),
            d.zip_high(h),
        ];
    }
    rows
}

/// Sums of the numbers of each row.
#[inline(always)]
pub fn sums<S: Simd>([a, b, c, d, e, f, g, h]: [f32x8<S>; LANES]) -> f32x8<S> {
    let ae = a.zip_low(e) + a.zip_high(e);
    let bf = b.zip_low(f) + b.zip_high(f);
    let cg = c.zip_low(g) + c.zip_high(g);
    let dh = d.zip_low(h) + d.zip_high(h);
    let even = ae.zip_low(cg) + ae.zip_high(cg);
    let odd = bf.zip_low(dh) + bf.zip_high(dh);
    even.zip_low(odd) + even.zip_high(odd)
}

/// The cells of an axis of texels 0..=`last` in which `at` lies: the index of the first of two texels,
/// within 0..`last` whatever `at` is, and the weight of the second.
#[inline(always)]
pub(crate) fn cells<S: Simd>(at: f32x8<S>, last: f32) -> ([i32; LANES], f32x8<S>) {
    let first = at.to_int::<i32x8<S>>().max(0).min(last as i32 - 1);
    (first.into(), at - first.to_float::<f32x8<S>>())
}
