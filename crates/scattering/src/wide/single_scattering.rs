//! Eq 11 for eight lights. Twin: `closed_form/single_scattering.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x8};

use crate::closed_form::{
    COS_THETA_D_MIN, MAX_NODES, MODE_R, Shading, fisher_lobe, further_orders, inclination,
};

use super::LANES;
use super::azimuthal::azimuthal_lobes;
use super::azimuthal_r::{Columns, azimuthal_r};
use super::dispatch;
use super::eccentric::azimuthal_elliptic;
use super::fisher::{fisher_density, fisher_rules};
use super::frame::{Lags, Place};
use super::lights::WideLights;
use super::lobes::sample_lobes;
use super::math::{bessel_i0e_fast, cos, sin};
use super::outer_integral::{OuterRules, outer_rules};
use super::roulette::Roulette;
use super::seen::{Seen, see};

/// [`crate::closed_form::single_scattering_mode`] of every light whose weight is above 0, by its index,
/// and of every enabled mode; others have no entry. What a light gets does not depend on which
/// others there are, unless some are left to `roulette`.
///
/// `weights`, by light, say what a response counts: the light's brightest channel times the share of
/// it that arrives.
///
/// To be called inside [`dispatch!`], around a loop over points.
#[inline(always)]
pub fn single_scattering<S: Simd>(
    simd: S,
    lights: &WideLights,
    weights: &[f32],
    place: &Place,
    shading: &Shading,
    roulette: Option<Roulette>,
    responses: &mut Responses,
) {
    responses.entries.clear();
    let mut seen = std::mem::take(&mut responses.seen);
    seen.clear();
    for (ix, &light) in lights.order.iter().enumerate() {
        if weights[light as usize] > 0.0 {
            seen.wanted.push(ix as u32);
        }
    }
    // A light matters to one mode and not to another: each has vectors of its own.
    see(simd, lights, weights, place, shading, &mut seen);
    let least = match &roulette {
        Some(roulette) => roulette.least(&seen.of_mode),
        None => 0.0,
    };
    for mode in 0..3 {
        let mut asked = std::mem::take(&mut seen.asked);
        asked.clear();
        for &(place, expected) in &seen.of_mode[mode] {
            let share = match &roulette {
                Some(roulette) => roulette.peaks.0[mode] * expected / least,
                None => 1.0,
            };
            if share >= 1.0 || least <= 0.0 {
                asked.push((place, 1.0));
                continue;
            }
            let light = lights.order[seen.wanted[place as usize] as usize];
            if roulette.is_some_and(|roulette| roulette.draw(light, mode as u32) < share) {
                asked.push((place, 1.0 / share));
            }
        }
        for chunk in asked.chunks(LANES) {
            let [r, g, b] = row(simd, mode, &seen, chunk, place, shading);
            for (lane, (at, factor)) in chunk.iter().enumerate() {
                // R is of one colour.
                let rgb = if mode == 0 {
                    [r[lane]; 3]
                } else {
                    [r[lane], g[lane], b[lane]]
                };
                responses.entries.push(Response {
                    light: lights.order[seen.wanted[*at as usize] as usize],
                    mode: mode as u32,
                    rgb: rgb.map(|value| factor * value),
                });
            }
        }
        seen.asked = asked;
    }
    responses.seen = seen;
}

/// What a point sends to the eye of lights by single scattering: integrals of a light of amplitude 1
/// against S cos(theta_i), without shadow. One buffer serves many points.
#[derive(Clone, Debug, Default)]
pub struct Responses {
    /// One for each light and mode that was evaluated.
    entries: Vec<Response>,
    seen: Seen,
}

/// Of one light, by one mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Response {
    /// Index of the light in the list.
    pub light: u32,
    /// 0, 1, 2: R, TT, TRT.
    pub mode: u32,
    /// Linear RGB.
    pub rgb: [f32; 3],
}

impl Responses {
    /// All of the last point.
    pub fn entries(&self) -> &[Response] {
        &self.entries
    }
}

/// [`single_scattering`] at several places; `responses` by place.
pub fn single_scattering_at(
    level: Level,
    lights: &WideLights,
    weights: &[f32],
    places: &[Place],
    shading: &Shading,
    roulette: Option<Roulette>,
    responses: &mut [Responses],
) {
    dispatch!(level, simd => {
        for (place, responses) in places.iter().zip(responses) {
            single_scattering(simd, lights, weights, place, shading, roulette, responses);
        }
    });
}

/// [`mode_of_lights`], not inlined further, so that there is one for all callers.
#[inline(always)]
fn row<S: Simd>(
    simd: S,
    mode: usize,
    seen: &Seen,
    places: &[(u32, f32)],
    place: &Place,
    shading: &Shading,
) -> [[f32; LANES]; 3] {
    simd.vectorize(
        #[inline(always)]
        || {
            // Missing lanes repeat the last one.
            let mut columns = [[0.0; LANES]; 6];
            for lane in 0..LANES {
                let at = places[lane.min(places.len() - 1)].0 as usize;
                for (column, numbers) in columns.iter_mut().zip(&seen.numbers) {
                    column[lane] = numbers[at];
                }
            }
            mode_of_lights(simd, mode, &columns, place, shading)
        },
    )
}

/// What a mode scatters of eight lights, linear RGB; R in the first channel alone.
#[inline(always)]
fn mode_of_lights<S: Simd>(
    simd: S,
    mode: usize,
    seen: &[[f32; LANES]; 6],
    place: &Place,
    shading: &Shading,
) -> [[f32; LANES]; 3] {
    let view = &place.view;
    let zero = f32x8::splat(simd, 0.0);
    let mut numbers = [zero; 6];
    for (number, seen) in numbers.iter_mut().zip(seen) {
        *number = f32x8::load_array_ref(simd, seen);
    }
    let [theta_j, variance_j, kappa_j, sin_half, cos_half, turn] = numbers;
    let lag = Lags {
        sin_half,
        cos_half,
        turn,
    };
    let fibre = shading.fibre;
    if fibre.is_energy() {
        return energy_of_lights(
            simd,
            mode,
            [theta_j, variance_j, kappa_j],
            &lag,
            place,
            shading,
        );
    }
    let [alpha, beta] = [fibre.alpha[mode], fibre.beta[mode]];
    let lobe = [f32x8::splat(simd, alpha), f32x8::splat(simd, beta)];
    let theta_o = f32x8::splat(simd, view.theta);
    let rules = outer_rules(theta_j, variance_j, theta_o, lobe);
    let counts = OuterRules::<S>::node_counts(fibre.node_count(mode as u32));
    // All nodes before the first inner integral: their long chains of dependent steps overlap.
    let n_nodes = (rules.most_nodes(counts) as usize).min(MAX_NODES as usize);
    let mut nodes = [[zero; 3]; MAX_NODES as usize];
    for (ix, node) in nodes[..n_nodes].iter_mut().enumerate() {
        let at = rules.node(counts, ix as u32);
        let cos_i = cos(at.theta_i).max(0.0);
        let theta_d = (-at.theta_i + view.theta) * 0.5;
        let cos_theta_d = cos(theta_d).max(COS_THETA_D_MIN);
        let ratio = (cos_i / cos_theta_d).min(2.0);
        *node = [kappa_j * cos_i, cos_theta_d, at.weight * (ratio * ratio)];
    }
    let mut total = [zero; 3];
    if mode == 0 {
        let table = (shading.tables.c, &shading.tables.axes);
        let columns = Columns::new(&shading.tables.axes, cos_half);
        for [kappa, cos_theta_d, factor] in nodes[..n_nodes].iter().copied() {
            let value = azimuthal_r(kappa, &columns, cos_theta_d, shading.reflectance, table);
            total[0] += factor * value;
        }
    } else if mode == 2 && fibre.is_elliptic() {
        for (ix, [kappa, cos_theta_d, factor]) in nodes[..n_nodes].iter().copied().enumerate() {
            let u = rules.node_u(counts, ix as u32);
            let value = azimuthal_elliptic(kappa, &lag, view, cos_theta_d, u, fibre, &shading.trt);
            for (total, value) in total.iter_mut().zip(value) {
                *total += factor * value;
            }
        }
    } else {
        // TT is seen from phi = pi: sin((phi - pi)/2) = -cos(phi/2); lobes are even.
        let (lobes, sin_half, cos_half) = match mode {
            1 => (&shading.tt, cos_half, sin_half),
            _ => (&shading.trt, sin_half, cos_half),
        };
        for [kappa, cos_theta_d, factor] in nodes[..n_nodes].iter().copied() {
            let lobes = sample_lobes(lobes, cos_theta_d);
            let value = azimuthal_lobes(kappa, sin_half, cos_half, &lobes);
            for (total, value) in total.iter_mut().zip(value) {
                *total += factor * value;
            }
        }
    }
    let mut values = [[0.0; LANES]; 3];
    for (value, total) in values.iter_mut().zip(total) {
        total.store_array(value);
    }
    values
}

const _: () = assert!(MODE_R == 1, "modes are bits in the order of p");

/// [`mode_of_lights`] of model `energy`, for `[theta_j, variance_j, kappa_j]` of the lights: N_t is that at
/// theta_o, the same for all lights and nodes.
#[inline(always)]
fn energy_of_lights<S: Simd>(
    simd: S,
    mode: usize,
    [theta_j, variance_j, kappa_j]: [f32x8<S>; 3],
    lag: &Lags<S>,
    place: &Place,
    shading: &Shading,
) -> [[f32; LANES]; 3] {
    let zero = f32x8::splat(simd, 0.0);
    let fibre = shading.fibre;
    let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
    let lobe = fisher_lobe(2.0 * alpha - place.view.theta, 4.0 * beta * beta);
    let rules = fisher_rules(theta_j, variance_j, &lobe);
    let counts = OuterRules::<S>::node_counts(fibre.node_count(mode as u32));
    let n_nodes = (rules.most_nodes(counts) as usize).min(MAX_NODES as usize);
    let mut nodes = [[zero; 2]; MAX_NODES as usize];
    for (ix, node) in nodes[..n_nodes].iter_mut().enumerate() {
        let at = rules.fisher_place(counts, ix as u32);
        let light = sin((rules.to_light + at.step) * 0.5);
        let cos_i = cos(at.theta_i).max(0.0);
        let fall = rules.sharpness * (light * light);
        let density = fisher_density(&lobe, rules.to_lobe + at.step, cos_i, fall);
        *node = [kappa_j * cos_i, at.weight * density];
    }
    let cos_theta_d = f32x8::splat(simd, inclination(place.view.theta).cos_theta_d);
    let mut total = [zero; 3];
    if mode == 0 {
        let table = (shading.tables.c, &shading.tables.axes);
        let columns = Columns::new(&shading.tables.axes, lag.cos_half);
        for [kappa, factor] in nodes[..n_nodes].iter().copied() {
            let value = azimuthal_r(kappa, &columns, cos_theta_d, shading.reflectance, table);
            total[0] += factor * value;
        }
    } else {
        let (lobes, sin_half, cos_half, further) = match mode {
            1 => (&shading.tt, lag.cos_half, lag.sin_half, [0.0; 3]),
            _ => {
                let further = further_orders(fibre, inclination(place.view.theta).cos_theta_d);
                (&shading.trt, lag.sin_half, lag.cos_half, further)
            }
        };
        let lobes = sample_lobes(lobes, cos_theta_d);
        for [kappa, factor] in nodes[..n_nodes].iter().copied() {
            let value = azimuthal_lobes(kappa, sin_half, cos_half, &lobes);
            let even = bessel_i0e_fast(kappa);
            for ((total, value), further) in total.iter_mut().zip(value).zip(further) {
                *total += factor * (value + even * further);
            }
        }
    }
    let mut values = [[0.0; LANES]; 3];
    for (value, total) in values.iter_mut().zip(total) {
        total.store_array(value);
    }
    values
}

#[cfg(test)]
mod tests;
