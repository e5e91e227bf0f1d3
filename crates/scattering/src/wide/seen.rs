//! Lights in the frame of a fibre, and which mode may answer to which.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{LN_CULL, Shading, fisher_lobe};

use super::LANES;
use super::fisher::fisher_bound;
use super::frame::{Directions, Place, lags_between};
use super::lights::WideLights;
use super::math::exp;
use super::outer_integral::outer_bound;
use super::roulette::Expected;

/// Lights in the frame of a fibre.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// Their places in [`WideLights`].
    pub wanted: Vec<u32>,
    /// theta_j, lambda_j^2, kappa_j = 2 cos(theta_j) / lambda_j^2, and the lag: sin(phi/2), cos(phi/2),
    /// sin(phi_j - phi_o). Each by place in `wanted`, of whole vectors.
    pub numbers: [Vec<f32>; 6],
    /// Places in `wanted` of the lights that a mode answers to, and about how much, times their weight.
    pub of_mode: Expected,
    /// Those that are evaluated, and how much each counts.
    pub asked: Vec<(u32, f32)>,
}

impl Seen {
    pub fn clear(&mut self) {
        self.wanted.clear();
        for numbers in &mut self.numbers {
            numbers.clear();
        }
        for places in &mut self.of_mode {
            places.clear();
        }
    }
}

/// Finds the lights' places in the frame and which mode may answer to which.
#[inline(always)]
pub(super) fn see<S: Simd>(
    simd: S,
    lights: &WideLights,
    weights: &[f32],
    place: &Place,
    shading: &Shading,
    seen: &mut Seen,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let Seen {
                wanted,
                numbers,
                of_mode,
                ..
            } = seen;
            let view = &place.view;
            let fibre = shading.fibre;
            for (chunk_ix, chunk) in wanted.chunks(LANES).enumerate() {
                // Missing lanes repeat the last one.
                let mut columns = [[0.0; LANES]; 5];
                for lane in 0..LANES {
                    let ix = chunk[lane.min(chunk.len() - 1)] as usize;
                    let light = &lights.lights[ix];
                    for (column, number) in columns.iter_mut().zip(light) {
                        column[lane] = *number;
                    }
                    columns[4][lane] = weights[lights.order[ix] as usize];
                }
                let [x, y, z, lambda, weight] = &columns;
                let lambda = f32x8::load_array_ref(simd, lambda);
                let mut direction = [f32x8::splat(simd, 0.0); 3];
                for (along, axis) in direction.iter_mut().zip(&place.frame) {
                    *along = f32x8::load_array_ref(simd, x) * axis[0]
                        + f32x8::load_array_ref(simd, y) * axis[1]
                        + f32x8::load_array_ref(simd, z) * axis[2];
                }
                let at = Directions::from_vectors(direction);
                let lag = lags_between(view, &at);
                let variance_j = lambda * lambda;
                let kappa_j = at.cos_theta * 2.0 / variance_j;
                let all = [
                    at.theta,
                    variance_j,
                    kappa_j,
                    lag.sin_half,
                    lag.cos_half,
                    lag.turn,
                ];
                for (numbers, all) in numbers.iter_mut().zip(all) {
                    numbers.extend_from_slice(&<[f32; LANES]>::from(all));
                }
                let weight = f32x8::load_array_ref(simd, weight) * variance_j;
                for (mode, places) in of_mode.iter_mut().enumerate() {
                    if fibre.modes & (1 << mode) == 0 {
                        continue;
                    }
                    let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
                    let bound = if fibre.is_energy() {
                        let lobe = fisher_lobe(2.0 * alpha - view.theta, 4.0 * beta * beta);
                        fisher_bound(at.theta, variance_j, &lobe)
                    } else {
                        let lobe = [f32x8::splat(simd, alpha), f32x8::splat(simd, beta)];
                        let theta_o = f32x8::splat(simd, view.theta);
                        outer_bound(at.theta, variance_j, theta_o, lobe)
                    };
                    let mut lanes = bound.simd_le(-LN_CULL).to_bitmask() as u32;
                    lanes &= (1 << chunk.len()) - 1;
                    // Light in both inclination and azimuth, spread by the longitudinal lobe.
                    let width = (variance_j + 4.0 * beta * beta).sqrt();
                    let expected = weight * exp(-bound) / width;
                    let expected = <[f32; LANES]>::from(expected);
                    while lanes != 0 {
                        let lane = lanes.trailing_zeros();
                        places.push((
                            (LANES * chunk_ix) as u32 + lane,
                            expected[lane as usize % LANES],
                        ));
                        lanes &= lanes - 1;
                    }
                }
            }
        },
    );
}
