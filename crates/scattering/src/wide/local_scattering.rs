//! What the hair behind a fibre sends back, for eight pairs of a light and a view, of model `marschner`. Twin:
//! `closed_form/local_scattering.rs`.

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{AverageTexel, LAST_INCLINATION, LOCAL_NODES, SHARE_MIN, SQRT_PI};

use super::LANES;
use super::half_circle::half_circle;
use super::math::{bessel_i0e_fast, clamp, cos, exp, mul_add, sin};
use super::mean_cosine::mean_cosine;
use super::outer_integral::{NodePlaces, OuterRules, outer_rules};
use super::rows::{cells, transpose};

/// Eight of [`crate::closed_form::LocalAverages`].
struct LocalAverages<S: Simd> {
    attenuation_b: [f32x8<S>; 3],
    shift_b: [f32x8<S>; 3],
    width_b_2: [f32x8<S>; 3],
}

/// What a light that comes straight is sent back of.
pub(crate) struct DirectLocal<S: Simd> {
    /// M^{L,dir} as if light came from everywhere in azimuth.
    pub whole: [f32x8<S>; 3],
    /// The channels' sum of it within the half circle.
    pub within: f32x8<S>,
    /// [`crate::closed_form::OuterRule::mean`] of the nodes.
    pub mean: f32x8<S>,
}

/// [`crate::closed_form::SampleAverages::averages_at`] of a fibre's texels.
#[inline(always)]
fn averages_at<S: Simd>(averages: &[AverageTexel], theta: f32x8<S>) -> LocalAverages<S> {
    let simd = theta.token();
    let zero = f32x8::splat(simd, 0.0);
    let at = (theta + FRAC_PI_2) * (FRAC_1_PI * LAST_INCLINATION);
    let (first, fraction) = cells(clamp(at, 0.0, LAST_INCLINATION), LAST_INCLINATION);
    let fraction: [f32; LANES] = fraction.into();
    let mut halves = [[zero; LANES]; 2];
    for lane in 0..LANES {
        let first = first[lane] as usize;
        let [below, above] = [&averages[first], &averages[first + 1]];
        let fraction = f32x8::splat(simd, fraction[lane]);
        let of_halves = below.as_chunks().0.iter().zip(above.as_chunks().0);
        for (rows, (below, above)) in halves.iter_mut().zip(of_halves) {
            let below = f32x8::load_array_ref(simd, below);
            let above = f32x8::load_array_ref(simd, above);
            rows[lane] = mul_add(fraction, above - below, below);
        }
    }
    let [a, b, c, _, d, e, f, _] = transpose(halves[0]);
    let [g, h, i, ..] = transpose(halves[1]);
    LocalAverages {
        attenuation_b: [a, b, c],
        shift_b: [d, e, f],
        width_b_2: [g, h, i],
    }
}

/// [`crate::closed_form::local_rule`].
#[inline(always)]
fn local_rules<S: Simd>(
    theta_j: f32x8<S>,
    sigma_f: f32,
    theta_o: f32x8<S>,
    averages: &[AverageTexel],
) -> OuterRules<S> {
    let at = averages_at(averages, (theta_j - theta_o) * 0.5);
    let zero = f32x8::splat(theta_j.token(), 0.0);
    let (mut sum, mut shift, mut width_2) = (zero, zero, zero);
    for channel in 0..3 {
        let share = at.attenuation_b[channel] + SHARE_MIN;
        sum += share;
        shift += share * at.shift_b[channel];
        width_2 += share * at.width_b_2[channel];
    }
    let variance_j = f32x8::splat(theta_j.token(), sigma_f * sigma_f);
    let lobe = [shift * 0.5 / sum, (width_2 * 0.25 / sum).sqrt()];
    outer_rules(theta_j, variance_j, theta_o, lobe)
}

/// A_b g^u(theta_i; Delta_b - theta_o, sigma_b) cos^2(theta_i) / cos^2(theta_d) at a node, times its weight and
/// exp(-fall), per channel.
#[inline(always)]
fn local_term<S: Simd>(
    theta_o: f32x8<S>,
    place: &NodePlaces<S>,
    (cos_i, fall): (f32x8<S>, f32x8<S>),
    averages: &[AverageTexel],
) -> [f32x8<S>; 3] {
    let one = f32x8::splat(theta_o.token(), 1.0);
    let at = averages_at(averages, (place.theta_i - theta_o) * 0.5);
    let cos_d = cos((theta_o - place.theta_i) * 0.5).max(1e-6);
    let ratio = (cos_i / cos_d).min(2.0);
    let factor = place.weight * (ratio * ratio) * (1.0 / SQRT_PI);
    let mut term = at.attenuation_b;
    for (channel, term) in term.iter_mut().enumerate() {
        let apart = place.theta_i + theta_o - at.shift_b[channel];
        let inverse = one / at.width_b_2[channel];
        *term = factor * *term * inverse.sqrt() * exp(-(apart * apart * inverse) - fall);
    }
    term
}

/// [`crate::closed_form::local_scattering()`] of light of width `sigma_f`, over the overlap of the half circles.
#[inline(always)]
pub(crate) fn local_scattering<S: Simd>(
    theta_j: f32x8<S>,
    theta_o: f32x8<S>,
    sigma_f: f32,
    averages: &[AverageTexel],
) -> [f32x8<S>; 3] {
    let zero = f32x8::splat(theta_j.token(), 0.0);
    let cosine = mean_cosine(theta_j, cos(theta_j).max(0.0), sigma_f);
    let scale = FRAC_1_PI * FRAC_1_PI / (SQRT_PI * sigma_f);
    let rules = local_rules(theta_j, sigma_f, theta_o, averages);
    let counts = OuterRules::<S>::node_counts(LOCAL_NODES);
    let mut total = [zero; 3];
    for ix in 0..rules.most_nodes(counts) {
        let place = rules.place(counts, ix);
        let from_light = (rules.to_light + place.step) * (1.0 / sigma_f);
        let cos_i = cos(place.theta_i).max(0.0);
        let of_node = (cos_i, from_light * from_light);
        let term = local_term(theta_o, &place, of_node, averages);
        for (total, term) in total.iter_mut().zip(term) {
            *total += term;
        }
    }
    let scale = f32x8::splat(theta_j.token(), scale) / cosine;
    [scale * total[0], scale * total[1], scale * total[2]]
}

/// [`crate::closed_form::direct_local_scattering()`] of light of width `lambda`, as if it came from everywhere in
/// azimuth, and what of it lies within the half circle around a direction whose lag has this cosine.
#[inline(always)]
pub(crate) fn direct_local_scattering<S: Simd>(
    theta_j: f32x8<S>,
    theta_o: f32x8<S>,
    lambda: f32,
    cosine: f32,
    averages: &[AverageTexel],
) -> DirectLocal<S> {
    let zero = f32x8::splat(theta_j.token(), 0.0);
    let cosine = f32x8::splat(theta_j.token(), cosine);
    let variance = lambda * lambda;
    let kappa_j = cos(theta_j).max(0.0) * (2.0 / variance);
    let scale = 2.0 / (PI * variance * (1.0 - (-4.0 / variance).exp()));
    let rules = local_rules(theta_j, lambda, theta_o, averages);
    let counts = OuterRules::<S>::node_counts(LOCAL_NODES);
    let mut found = DirectLocal {
        whole: [zero; 3],
        within: zero,
        mean: rules.mean,
    };
    for ix in 0..rules.most_nodes(counts) {
        let place = rules.place(counts, ix);
        let from_light = sin((rules.to_light + place.step) * 0.5);
        let cos_i = cos(place.theta_i).max(0.0);
        let kappa = kappa_j * cos_i;
        let in_azimuth = bessel_i0e_fast(kappa) * scale;
        let of_node = (cos_i, rules.sharpness * (from_light * from_light));
        let term = local_term(theta_o, &place, of_node, averages);
        let mut sum = zero;
        for (whole, term) in found.whole.iter_mut().zip(term) {
            *whole += in_azimuth * term;
            sum += in_azimuth * term;
        }
        found.within += sum * half_circle(kappa, cosine);
    }
    found
}
