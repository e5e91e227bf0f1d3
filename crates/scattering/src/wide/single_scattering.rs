//! Eq 11 for eight lights. Twin: `closed_form/single_scattering.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, f32x8};

use crate::closed_form::{
    DirectionInFrame, LN_CULL, LightInFrame, MAX_NODES, MODE_R, Shading, fisher_lobe,
    further_orders, inclination, single_scattering_mode,
};
use core::f32::consts::PI;

use super::LANES;
use super::azimuthal::azimuthal_lobes;
use super::azimuthal_r::{Columns, azimuthal_r};
use super::dispatch;
use super::eccentric::eta_star;
use super::fisher::{fisher_bound, fisher_density, fisher_rules};
use super::frame::{Directions, Lags, cos_view, lags_between};
use super::lights::WideLights;
use super::lobes::SampleLobes;
use super::math::{bessel_i0e_fast, cos, exp, sin};
use super::outer_integral::{OuterRules, outer_bound, outer_rules};

/// Keeps 1 / cos(theta_d) finite; as the twin.
const COS_THETA_D_MIN: f32 = 1e-6;

/// Where a fibre is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Axes (u, v, w) of the fibre in the world; u is the tangent.
    pub frame: [[f32; 3]; 3],
    /// Towards the eye.
    pub view: DirectionInFrame,
}

/// [`crate::closed_form::single_scattering_mode`] of every light whose weight is above 0, by its index,
/// and of every enabled mode; others have no entry. What a light gets does not depend on which
/// others there are, unless some are left to `roulette`.
///
/// `weights`, by light, say what a response counts: the light's brightest channel times the share of
/// it that arrives.
///
/// To be called inside [`dispatch!`], around a loop over points.
#[inline(always)]
pub fn single_scattering<S: Simd, L: SampleLobes>(
    simd: S,
    lights: &WideLights,
    weights: &[f32],
    place: &Place,
    shading: &Shading<L>,
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
        Some(roulette) => roulette.least(&seen),
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

/// Leaves out most of what hardly counts, and counts the rest of it for that: right in the mean.
#[derive(Clone, Copy, Debug)]
pub struct Roulette {
    /// What is expected to be less than this share of all is left to chance.
    pub tolerance: f32,
    /// Of the fibre.
    pub peaks: Peaks,
    /// Another number, other chances; neighbouring numbers share them out evenly.
    pub seed: u32,
}

/// Largest response of each mode over what its longitudinal lobe alone lets expect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks([f32; 3]);

impl Peaks {
    /// Of a fibre, by a light that moves around it.
    pub fn of(shading: &Shading<impl SampleLobes + crate::closed_form::SampleLobes>) -> Peaks {
        const LAMBDA: f32 = 0.15;
        const N_AZIMUTHS: u32 = 12;
        let mut peaks = [0.0f32; 3];
        for (mode, peak) in peaks.iter_mut().enumerate() {
            let (alpha, beta) = (shading.fibre.alpha[mode], shading.fibre.beta[mode]);
            let expected = LAMBDA * LAMBDA / (LAMBDA * LAMBDA + 4.0 * beta * beta).sqrt();
            for theta_o in [-0.8f32, 0.0, 0.8] {
                for ix in 0..=N_AZIMUTHS {
                    let phi = PI * ix as f32 / N_AZIMUTHS as f32;
                    let (theta, view) =
                        (2.0 * alpha - theta_o, [theta_o.sin(), theta_o.cos(), 0.0]);
                    let light = [
                        theta.sin(),
                        theta.cos() * phi.cos(),
                        theta.cos() * phi.sin(),
                    ];
                    let light = LightInFrame::from_vector(light, LAMBDA);
                    let view = DirectionInFrame::from_vector(view);
                    let rgb = single_scattering_mode(mode as u32, &light, &view, shading);
                    *peak = rgb
                        .into_iter()
                        .fold(*peak, |peak, x| peak.max(x / expected));
                }
            }
        }
        Peaks(peaks)
    }
}

impl Roulette {
    /// What is expected to be less than this is left to chance.
    fn least(&self, seen: &Seen) -> f32 {
        let mut sum = 0.0;
        for (places, peak) in seen.of_mode.iter().zip(self.peaks.0) {
            for (_, expected) in places {
                sum += peak * expected;
            }
        }
        self.tolerance * sum
    }

    /// A number in 0..1, of a sequence over `seed` that is spread evenly, for each light and mode.
    fn draw(&self, light: u32, mode: u32) -> f32 {
        /// Parts of 1 in 2^32: the golden ratio and sqrt(2), less their whole parts.
        const GOLDEN: u32 = 0x9e37_79b9;
        const ROOT_2: u32 = 0x6a09_e667;
        let at = self
            .seed
            .wrapping_mul(GOLDEN)
            .wrapping_add((3 * light + mode).wrapping_mul(ROOT_2));
        (at >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}

/// Lights in the frame of a fibre.
#[derive(Clone, Debug, Default)]
struct Seen {
    /// Their places in [`WideLights`].
    wanted: Vec<u32>,
    /// theta_j, lambda_j^2, kappa_j = 2 cos(theta_j) / lambda_j^2, and the lag: sin(phi/2), cos(phi/2),
    /// cos(phi_o + phi_j). Each by place in `wanted`, of whole vectors.
    numbers: [Vec<f32>; 6],
    /// Places in `wanted` of the lights that a mode answers to, and about how much, times their weight.
    of_mode: [Vec<(u32, f32)>; 3],
    /// Those that are evaluated, and how much each counts.
    asked: Vec<(u32, f32)>,
}

impl Seen {
    fn clear(&mut self) {
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
fn see<S: Simd, L: SampleLobes>(
    simd: S,
    lights: &WideLights,
    weights: &[f32],
    place: &Place,
    shading: &Shading<L>,
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
                    lag.cos_sum,
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
                        outer_bound(at.theta, variance_j, view.theta, alpha, beta)
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

/// [`single_scattering`] at several places; `responses` by place.
pub fn single_scattering_at<L: SampleLobes>(
    level: Level,
    lights: &WideLights,
    weights: &[f32],
    places: &[Place],
    shading: &Shading<L>,
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
fn row<S: Simd, L: SampleLobes>(
    simd: S,
    mode: usize,
    seen: &Seen,
    places: &[(u32, f32)],
    place: &Place,
    shading: &Shading<L>,
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
fn mode_of_lights<S: Simd, L: SampleLobes>(
    simd: S,
    mode: usize,
    seen: &[[f32; LANES]; 6],
    place: &Place,
    shading: &Shading<L>,
) -> [[f32; LANES]; 3] {
    let view = &place.view;
    let zero = f32x8::splat(simd, 0.0);
    let mut numbers = [zero; 6];
    for (number, seen) in numbers.iter_mut().zip(seen) {
        *number = f32x8::load_array_ref(simd, seen);
    }
    let [theta_j, variance_j, kappa_j, sin_half, cos_half, cos_sum] = numbers;
    let lag = Lags {
        sin_half,
        cos_half,
        cos_sum,
        cos_view: cos_view(view),
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
    let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
    let rules = outer_rules(theta_j, variance_j, view.theta, alpha, beta);
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
    } else {
        for [kappa, cos_theta_d, factor] in nodes[..n_nodes].iter().copied() {
            // TT is seen from phi = pi: sin((phi - pi)/2) = -cos(phi/2); lobes are even.
            let (lobes, sin_half, cos_half, eta) = match mode {
                1 => {
                    let eta = f32x8::splat(simd, fibre.eta);
                    (&shading.tt, cos_half, sin_half, eta)
                }
                _ => {
                    let eta = eta_star(kappa, &lag, fibre);
                    (&shading.trt, sin_half, cos_half, eta)
                }
            };
            let lobes = lobes.lobes_at(eta, cos_theta_d);
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
fn energy_of_lights<S: Simd, L: SampleLobes>(
    simd: S,
    mode: usize,
    [theta_j, variance_j, kappa_j]: [f32x8<S>; 3],
    lag: &Lags<S>,
    place: &Place,
    shading: &Shading<L>,
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
        let eta = f32x8::splat(simd, fibre.eta);
        let (lobes, sin_half, cos_half, further) = match mode {
            1 => (&shading.tt, lag.cos_half, lag.sin_half, [0.0; 3]),
            _ => {
                let further = further_orders(fibre, inclination(place.view.theta).cos_theta_d);
                (&shading.trt, lag.sin_half, lag.cos_half, further)
            }
        };
        let lobes = lobes.lobes_at(eta, cos_theta_d);
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
mod tests {
    use super::*;
    use crate::closed_form::{self, LightInFrame};
    use crate::random::SplitMix64;
    use crate::wide::fixture::{Fixture, lights, params, place};
    use crate::wide::levels;
    use crate::{HairParams, Model};

    /// A direction in the frame of a place.
    fn along(place: &Place, light: [f32; 3]) -> [f32; 3] {
        let along = |axis: [f32; 3]| axis[0] * light[0] + axis[1] * light[1] + axis[2] * light[2];
        place.frame.map(along)
    }

    /// R, TT, TRT of the scalar code.
    fn scalar(
        shading: &Shading<impl closed_form::SampleLobes>,
        place: &Place,
        light: [f32; 3],
        lambda: f32,
    ) -> [f32; 7] {
        let source = LightInFrame::from_vector(along(place, light), lambda);
        let [r, tt, trt] = [0, 1, 2]
            .map(|mode| closed_form::single_scattering_mode(mode, &source, &place.view, shading));
        [r[0], tt[0], tt[1], tt[2], trt[0], trt[1], trt[2]]
    }

    fn all(responses: &Responses, light: usize) -> [f32; 7] {
        let mut numbers = [0.0; 7];
        for entry in responses
            .entries()
            .iter()
            .filter(|entry| entry.light as usize == light)
        {
            match entry.mode {
                0 => numbers[0] = entry.rgb[0],
                mode => numbers[3 * mode as usize - 2..][..3].copy_from_slice(&entry.rgb),
            }
        }
        numbers
    }

    /// Time that this thread has had a core, ns; where the system does not say, wall time.
    fn thread_ns() -> f64 {
        static START: std::sync::LazyLock<std::time::Instant> =
            std::sync::LazyLock::new(std::time::Instant::now);
        let statistics = std::fs::read_to_string("/proc/thread-self/schedstat");
        let first = statistics
            .ok()
            .and_then(|text| text.split(' ').next()?.parse().ok());
        first.unwrap_or_else(|| START.elapsed().as_nanos() as f64)
    }

    /// Prints what a product (a point, a light, three modes) costs, in core time:
    /// `cargo test --release -p strandlight-scattering single_scattering_cost -- --ignored --nocapture`.
    #[test]
    #[ignore = "measures"]
    fn single_scattering_cost() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(11);
        let (directions, mut lambdas) = lights(&mut random, 40);
        for (ix, lambda) in lambdas.iter_mut().enumerate() {
            *lambda = 0.03 * (1.0f32 / 0.03).powf(ix as f32 / 39.0);
        }
        for model in Model::ALL {
            let hair = fixture.hair_of(&HairParams {
                model,
                ..HairParams::default()
            });
            let shading = hair.shading(&fixture);
            let wide = WideLights::new(&directions, &lambdas);
            let places: Vec<Place> = (4..1004).map(|view| place(&mut random, view)).collect();
            let products = (places.len() * directions.len()) as f64;
            let least_ns = |run: &mut dyn FnMut()| {
                // The system counts in steps of some milliseconds.
                let timed = |run: &mut dyn FnMut()| {
                    let start = thread_ns();
                    (0..30).for_each(|_| run());
                    (thread_ns() - start) / (30.0 * products)
                };
                (0..5).map(|_| timed(run)).fold(f64::INFINITY, f64::min)
            };
            let one = least_ns(&mut || {
                for place in &places {
                    for (light, lambda) in directions.iter().zip(&lambdas) {
                        let source = LightInFrame::from_vector(along(place, *light), *lambda);
                        let all = closed_form::single_scattering(&source, &place.view, &shading);
                        std::hint::black_box(all);
                    }
                }
            });
            println!(
                "{}: one light at a time: {one:.0} ns a product",
                model.name()
            );
            for (name, level) in levels() {
                let mut responses = vec![Responses::default(); places.len()];
                let eight = least_ns(&mut || {
                    single_scattering_at(
                        level,
                        &wide,
                        &[1.0; 40],
                        &places,
                        &shading,
                        None,
                        &mut responses,
                    );
                });
                println!("eight, {name}: {eight:.0} ns, {:.1} times", one / eight);
            }
        }
    }

    /// Largest errors of R, TT and TRT, of the value and a hundredth of the largest `expected`.
    fn errors(found: &[[f32; 7]], expected: &[[f32; 7]]) -> [f32; 3] {
        assert_eq!(found.len(), expected.len());
        [0..1, 1..4, 4..7].map(|mode| {
            let values = |all: &[[f32; 7]]| -> Vec<f32> {
                all.iter().flat_map(|x| x[mode.clone()].to_vec()).collect()
            };
            let (found, expected) = (values(found), values(expected));
            let largest = expected.iter().fold(0.0f32, |a, b| a.max(*b));
            let error = |(found, expected): (&f32, &f32)| {
                assert!(*found >= 0.0 && found.is_finite(), "{found}");
                (found - expected).abs() / (expected + 0.01 * largest + 1e-20)
            };
            let errors = found.iter().zip(&expected).map(error);
            errors.fold(0.0, f32::max)
        })
    }

    #[test]
    fn eight_lights_answer_as_one_does() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(7);
        let mut n = 0;
        let mut worst = [0.0f32; 3];
        for ix in 0..48 {
            let model = match ix % 3 {
                1 => Model::Energy,
                _ => Model::Marschner,
            };
            let hair = fixture.hair_of(&HairParams {
                model,
                ..params(&mut random, ix % 3 == 0)
            });
            let shading = hair.shading(&fixture);
            let (directions, lambdas) = lights(&mut random, 37);
            let wide = WideLights::new(&directions, &lambdas);
            let places: Vec<Place> = (0..16).map(|view| place(&mut random, view)).collect();
            let mut expected = Vec::new();
            for place in &places {
                for (direction, lambda) in directions.iter().zip(&lambdas) {
                    expected.push(scalar(&shading, place, *direction, *lambda));
                }
            }
            n += expected.len();
            for (name, level) in levels() {
                let mut responses = vec![Responses::default(); places.len()];
                single_scattering_at(
                    level,
                    &wide,
                    &[1.0; 40],
                    &places,
                    &shading,
                    None,
                    &mut responses,
                );
                let found: Vec<_> = responses
                    .iter()
                    .flat_map(|responses| (0..37).map(|light| all(responses, light)))
                    .collect();
                let errors = errors(&found, &expected);
                assert!(
                    errors.iter().all(|error| *error < 1e-5),
                    "{name} {ix} {errors:?}"
                );
                worst = std::array::from_fn(|mode| worst[mode].max(errors[mode]));
            }
        }
        println!("{n} products, largest errors {worst:?}");
        assert!(n > 20_000);
    }

    #[test]
    fn an_error_is_seen() {
        let expected = [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], [0.0; 7]];
        let mut found = expected;
        assert_eq!(errors(&found, &expected), [0.0; 3]);
        found[0][5] += 2e-4;
        found[1][0] = 2e-6;
        let errors = errors(&found, &expected);
        assert!(errors[0] > 1e-5 && errors[1] == 0.0 && errors[2] > 1e-5);
    }

    /// What a light gets depends on it alone; others get nothing.
    #[test]
    fn wanted_lights_get_the_same_among_any_others() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(3);
        let hair = fixture.hair(&mut random, false);
        let shading = hair.shading(&fixture);
        let (directions, lambdas) = lights(&mut random, 29);
        let wide = WideLights::new(&directions, &lambdas);
        assert_eq!((wide.len(), wide.is_empty()), (29, false));
        let mut lit = 0;
        for (_, level) in levels() {
            for view in 0..20 {
                let place = place(&mut random, view);
                let bits = random.next_u64();
                let wanted = |light: usize| bits >> light & 1 == 1;
                let weights: Vec<f32> = (0..29)
                    .map(|light| f32::from(wanted(light) as u8))
                    .collect();
                let respond = |wanted: &[f32]| {
                    let mut responses = [Responses::default()];
                    single_scattering_at(
                        level,
                        &wide,
                        wanted,
                        &[place],
                        &shading,
                        None,
                        &mut responses,
                    );
                    let [responses] = responses;
                    responses
                };
                let (every, some) = (respond(&[1.0; 29]), respond(&weights));
                for light in 0..29 {
                    let expected = match wanted(light) {
                        true => all(&every, light),
                        false => [0.0; 7],
                    };
                    assert_eq!(all(&some, light), expected);
                    lit += usize::from(expected[0] > 0.0);
                }
            }
        }
        assert!(lit > 500, "{lit}");
    }

    #[test]
    fn modes_that_are_off_and_no_lights_are_black() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(5);
        let hair = fixture.hair(&mut random, false);
        let place = place(&mut random, 9);
        let at = |modes: u32, n: usize| {
            let fibre = crate::closed_form::Fibre {
                modes,
                ..hair.fibre
            };
            let shading = Shading {
                fibre: &fibre,
                ..hair.shading(&fixture)
            };
            let wide = WideLights::new(&vec![[0.0, 0.6, 0.8]; n], &vec![1.0; n]);
            let mut responses = [Responses::default()];
            single_scattering_at(
                Level::new(),
                &wide,
                &[1.0; 64],
                &[place],
                &shading,
                None,
                &mut responses,
            );
            let [responses] = responses;
            responses
        };
        let full = all(&at(7, 3), 2);
        assert!(full.iter().all(|x| *x > 0.0), "{full:?}");
        for modes in 0..8 {
            let found = all(&at(modes, 3), 2);
            for (ix, (found, full)) in found.into_iter().zip(full).enumerate() {
                let is_on = modes >> ix.div_ceil(3) & 1 == 1;
                assert_eq!(found, if is_on { full } else { 0.0 });
            }
        }
        assert!(at(7, 0).entries().is_empty());
    }

    /// Numbers that are none give what they may, but no panic.
    #[test]
    fn nonsense_is_survived() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(5);
        let shading_of = fixture.hair(&mut random, true);
        let shading = shading_of.shading(&fixture);
        let nasty = [
            f32::NAN,
            f32::INFINITY,
            -f32::INFINITY,
            0.0,
            -1.0,
            1e30,
            1e-30,
        ];
        let mut n = 0;
        for (_, level) in levels() {
            for x in nasty {
                for lambda in nasty {
                    let wide = WideLights::new(&[[x, 0.3, x]; 9], &[lambda; 9]);
                    let places = [place(&mut random, 9)];
                    let mut responses = [Responses::default()];
                    single_scattering_at(
                        level,
                        &wide,
                        &[1.0; 64],
                        &places,
                        &shading,
                        None,
                        &mut responses,
                    );
                    n += 1;
                }
            }
        }
        assert_eq!(n, levels().len() * 49);
    }

    /// Painted points, whose lobes are found one lane after the other.
    #[test]
    fn painted_hair_answers_as_in_scalar_code() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(13);
        let hair = fixture.hair(&mut random, false);
        let [tt, trt] = fixture.painted(&hair);
        let layers = |texture: &crate::lobes::PaintedTexture| {
            [0.1, 0.5, 2.0].map(|sigma_a| closed_form::lobe_layer(&texture.decode, sigma_a))
        };
        let uniform = hair.shading(&fixture);
        let lobes = |texture| closed_form::PaintedPointLobes {
            view: crate::lobes::PaintedTexture::view(texture),
            layers: layers(texture),
        };
        let shading = Shading {
            fibre: uniform.fibre,
            tables: uniform.tables,
            reflectance: uniform.reflectance,
            tt: lobes(&tt),
            trt: lobes(&trt),
        };
        let (directions, lambdas) = lights(&mut random, 21);
        let wide = WideLights::new(&directions, &lambdas);
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        for view in 0..40 {
            let place = place(&mut random, view);
            let mut responses = [Responses::default()];
            single_scattering_at(
                Level::new(),
                &wide,
                &[1.0; 64],
                &[place],
                &shading,
                None,
                &mut responses,
            );
            for (ix, (direction, lambda)) in directions.iter().zip(&lambdas).enumerate() {
                found.push(all(&responses[0], ix));
                expected.push(scalar(&shading, &place, *direction, *lambda));
            }
        }
        let errors = errors(&found, &expected);
        assert!(errors.iter().all(|error| *error < 1e-5), "{errors:?}");
    }

    #[test]
    fn roulette_is_right_in_the_mean_and_leaves_work_out() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(17);
        let hair = fixture.hair_of(&crate::HairParams::default());
        let shading = hair.shading(&fixture);
        let (directions, lambdas) = lights(&mut random, 40);
        let wide = WideLights::new(&directions, &lambdas);
        let weights: Vec<f32> = (0..40).map(|ix| 0.8_f32.powi(ix)).collect();
        let place = place(&mut random, 12);
        let respond = |roulette: Option<Roulette>| {
            let mut responses = [Responses::default()];
            let level = Level::new();
            let places = [place];
            single_scattering_at(
                level,
                &wide,
                &weights,
                &places,
                &shading,
                roulette,
                &mut responses,
            );
            let entries = responses[0].entries();
            let sum: f64 = entries
                .iter()
                .map(|entry| f64::from(weights[entry.light as usize] * entry.rgb[1]))
                .sum();
            (sum, entries.len())
        };
        let (exact, all) = respond(None);
        let peaks = Peaks::of(&shading);
        let n = 2000;
        let (mut mean, mut square, mut asked) = (0.0, 0.0, 0);
        for seed in 0..n {
            let tolerance = 0.01;
            let (sum, n_asked) = respond(Some(Roulette {
                tolerance,
                peaks,
                seed,
            }));
            mean += sum / f64::from(n);
            square += (sum / exact - 1.0).powi(2) / f64::from(n);
            asked += n_asked;
        }
        let deviation = square.sqrt();
        println!("{all} of {asked}, deviation {deviation}");
        assert!(asked < all * n as usize * 2 / 3, "{asked} {all}");
        assert!(deviation > 0.0 && deviation < 0.1, "{deviation}");
        // Seeds are spread evenly, so the mean is closer than that of independent ones.
        let error = (mean / exact - 1.0).abs();
        assert!(
            error < 3.0 * deviation / f64::from(n).sqrt(),
            "{error} {deviation}"
        );
    }
}
