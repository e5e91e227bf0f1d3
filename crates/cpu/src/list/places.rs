//! The places of a pixel at which coverage is kept.

use strandlight_scattering::wide::{LANES, Simd, f32x8, prelude::*};

/// Places along a side of a pixel.
pub(super) const PLACES_SIDE: usize = 4;

/// Places of a pixel, row by row: two vectors.
pub(super) const PLACES: usize = 16;

/// How far along either axis the outermost places lie from the middle of their pixel, px.
pub(super) const FARTHEST: f32 = 0.375;

const _: () = assert!(PLACES == PLACES_SIDE * PLACES_SIDE && PLACES == 2 * LANES);
const _: () = assert!(FARTHEST == place(PLACES - 1)[0]);

/// Where a place lies from the middle of its pixel, px.
pub(super) const fn place(ix: usize) -> [f32; 2] {
    let (x, y) = (ix % PLACES_SIDE, ix / PLACES_SIDE);
    [
        (x as f32 + 0.5) / PLACES_SIDE as f32 - 0.5,
        (y as f32 + 0.5) / PLACES_SIDE as f32 - 0.5,
    ]
}

/// An axis of all places.
const fn axis(axis: usize) -> [f32; PLACES] {
    let mut along = [0.0; PLACES];
    let mut ix = 0;
    while ix < PLACES {
        along[ix] = place(ix)[axis];
        ix += 1;
    }
    along
}

const X: [f32; PLACES] = axis(0);
const Y: [f32; PLACES] = axis(1);

/// The product of `growth` with where each place lies from the middle.
#[inline(always)]
pub(super) fn linear(growth: [f32; 2]) -> [f32; PLACES] {
    let mut values = [0.0; PLACES];
    for ix in 0..PLACES {
        values[ix] = growth[0] * X[ix] + growth[1] * Y[ix];
    }
    values
}

/// Of all places.
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, values: &[f32; PLACES]) -> f32 {
    let (a, b) = values.split_at(LANES);
    (f32x8::from_slice(simd, a) + f32x8::from_slice(simd, b)).reduce_sum()
}
