//! Eq 11 for eight lights. Twin: `closed_form/single_scattering.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x8};

use crate::closed_form::{DirectionInFrame, MODE_R, Shading};

use super::LANES;
use super::azimuthal::azimuthal_lobes;
use super::azimuthal_r::{Columns, azimuthal_r};
use super::eccentric::eta_star;
use super::frame::{Directions, lags_between};
use super::lights::{Responses, WideLights};
use super::lobes::SampleLobes;
use super::math::cos;
use super::outer_integral::{OuterRules, outer_rules};

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

/// [`crate::closed_form::single_scattering_mode`] of every light that is `wanted`, by its index, and
/// of every enabled mode; 0 of other lights and modes. What a light gets does not depend on which
/// others are wanted.
///
/// To be called inside [`dispatch!`], around a loop over points.
#[inline(always)]
pub fn single_scattering<S: Simd, L: SampleLobes>(
    simd: S,
    lights: &WideLights,
    wanted: impl Fn(usize) -> bool,
    place: &Place,
    shading: &Shading<L>,
    responses: &mut Responses,
) {
    responses.clear(lights.len());
    let mut places = std::mem::take(&mut responses.wanted);
    let asked = lights.order.iter().zip(0..);
    places.extend(
        asked
            .filter(|(light, _)| wanted(**light as usize))
            .map(|(_, place)| place),
    );
    for chunk in places.chunks(LANES) {
        // Missing lanes repeat the last one.
        let mut columns = [[0.0; LANES]; 4];
        for lane in 0..LANES {
            let light = &lights.lights[chunk[lane.min(chunk.len() - 1)] as usize];
            for (column, number) in columns.iter_mut().zip(light) {
                column[lane] = *number;
            }
        }
        let values = modes(simd, &columns, place, shading);
        responses.put(&lights.order, chunk, &values);
    }
    responses.wanted = places;
}

/// [`single_scattering`] of all lights at several places; `responses` by place.
pub fn single_scattering_at<L: SampleLobes>(
    level: Level,
    lights: &WideLights,
    places: &[Place],
    shading: &Shading<L>,
    responses: &mut [Responses],
) {
    dispatch!(level, simd => {
        for (place, responses) in places.iter().zip(responses) {
            single_scattering(simd, lights, |_| true, place, shading, responses);
        }
    });
}

/// R, then TT and TRT in linear RGB.
#[inline(always)]
fn modes<S: Simd, L: SampleLobes>(
    simd: S,
    [x, y, z, lambda]: &[[f32; LANES]; 4],
    place: &Place,
    shading: &Shading<L>,
) -> [[f32; LANES]; 7] {
    let view = &place.view;
    let zero = f32x8::splat(simd, 0.0);
    let lambda = f32x8::load_array_ref(simd, lambda);
    let mut direction = [zero; 3];
    for (along, axis) in direction.iter_mut().zip(&place.frame) {
        *along = f32x8::load_array_ref(simd, x) * axis[0]
            + f32x8::load_array_ref(simd, y) * axis[1]
            + f32x8::load_array_ref(simd, z) * axis[2];
    }
    let at = Directions::from_vectors(direction);
    let fibre = shading.fibre;
    let lag = lags_between(view, &at);
    let columns = Columns::new(&shading.tables.axes, lag.cos_half);
    let variance_j = lambda * lambda;
    let kappa_j = at.cos_theta * 2.0 / variance_j;
    let mut modes = [[zero; 3]; 3];
    // One loop and not three, whose code would be three times as much.
    for (mode, total) in modes.iter_mut().enumerate() {
        if fibre.modes & (1 << mode) == 0 {
            continue;
        }
        let (alpha, beta) = (fibre.alpha[mode], fibre.beta[mode]);
        let Some(rules) = outer_rules(at.theta, variance_j, view.theta, alpha, beta) else {
            continue;
        };
        let counts = OuterRules::<S>::node_counts(fibre.node_count(mode as u32));
        for ix in 0..rules.most_nodes(counts) {
            let node = rules.node(counts, ix);
            let cos_i = cos(node.theta_i).max(0.0);
            let theta_d = (-node.theta_i + view.theta) * 0.5;
            let cos_theta_d = cos(theta_d).max(COS_THETA_D_MIN);
            let kappa = kappa_j * cos_i;
            let ratio = (cos_i / cos_theta_d).min(2.0);
            let factor = node.weight * (ratio * ratio);
            if mode == 0 {
                let table = (shading.tables.c, &shading.tables.axes);
                let value = azimuthal_r(kappa, &columns, cos_theta_d, shading.reflectance, table);
                total[0] += factor * value;
                continue;
            }
            // TT is seen from phi = pi: sin((phi - pi)/2) = -cos(phi/2); lobes are even.
            let (lobes, sin_half, cos_half, eta) = match mode {
                1 => {
                    let eta = f32x8::splat(simd, fibre.eta);
                    (&shading.tt, lag.cos_half, lag.sin_half, eta)
                }
                _ => {
                    let eta = eta_star(kappa, &lag, fibre);
                    (&shading.trt, lag.sin_half, lag.cos_half, eta)
                }
            };
            let lobes = lobes.lobes_at(eta, cos_theta_d);
            let value = azimuthal_lobes(kappa, sin_half, cos_half, &lobes);
            for (total, value) in total.iter_mut().zip(value) {
                *total += factor * value;
            }
        }
        for total in total {
            *total = rules.counts.select(*total, zero);
        }
    }
    let mut values = [[0.0; LANES]; 7];
    for (value, total) in values.iter_mut().zip(modes.as_flattened()[2..].iter()) {
        total.store_array(value);
    }
    modes[0][0].store_array(&mut values[0]);
    values
}

const _: () = assert!(MODE_R == 1, "modes are bits in the order of p");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{self, LightInFrame};
    use crate::random::SplitMix64;
    use crate::wide::fixture::{Fixture, Hair, lights, place};
    use crate::wide::levels;

    /// A direction in the frame of a place.
    fn along(place: &Place, light: [f32; 3]) -> [f32; 3] {
        let along = |axis: [f32; 3]| axis[0] * light[0] + axis[1] * light[1] + axis[2] * light[2];
        place.frame.map(along)
    }

    /// R, TT, TRT of the scalar code.
    fn scalar(
        hair: &Hair,
        fixture: &Fixture,
        place: &Place,
        light: [f32; 3],
        lambda: f32,
    ) -> [f32; 7] {
        let source = LightInFrame::from_vector(along(place, light), lambda);
        let shading = hair.shading(fixture);
        let [r, tt, trt] = [0, 1, 2]
            .map(|mode| closed_form::single_scattering_mode(mode, &source, &place.view, &shading));
        [r[0], tt[0], tt[1], tt[2], trt[0], trt[1], trt[2]]
    }

    fn all(responses: &Responses, light: usize) -> [f32; 7] {
        let [a, b, c] = responses.tt().map(|values| values[light]);
        let [d, e, f] = responses.trt().map(|values| values[light]);
        [responses.r()[light], a, b, c, d, e, f]
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
        let hair = fixture.hair_of(&crate::HairParams::default());
        let shading = hair.shading(&fixture);
        let (directions, mut lambdas) = lights(&mut random, 40);
        for (ix, lambda) in lambdas.iter_mut().enumerate() {
            *lambda = 0.03 * (1.0f32 / 0.03).powf(ix as f32 / 39.0);
        }
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
        println!("one light at a time: {one:.0} ns a product");
        for (name, level) in levels() {
            let mut responses = vec![Responses::default(); places.len()];
            let eight = least_ns(&mut || {
                single_scattering_at(level, &wide, &places, &shading, &mut responses);
            });
            println!("eight, {name}: {eight:.0} ns, {:.1} times", one / eight);
        }
    }

    #[test]
    fn eight_lights_answer_as_one_does() {
        let fixture = Fixture::new();
        let mut random = SplitMix64(7);
        let mut n = 0;
        let mut worst = vec![[0.0f32; 3]; levels().len()];
        for ix in 0..48 {
            let hair = fixture.hair(&mut random, ix % 3 == 0);
            let shading = hair.shading(&fixture);
            let (directions, lambdas) = lights(&mut random, 37);
            let wide = WideLights::new(&directions, &lambdas);
            let places: Vec<Place> = (0..16).map(|view| place(&mut random, view)).collect();
            let mut expected = Vec::new();
            for place in &places {
                for (direction, lambda) in directions.iter().zip(&lambdas) {
                    expected.push(scalar(&hair, &fixture, place, *direction, *lambda));
                }
            }
            let largest: [f32; 3] = [0..1, 1..4, 4..7].map(|mode| {
                expected
                    .iter()
                    .flat_map(|x| &x[mode.clone()])
                    .fold(0.0, |a: f32, b| a.max(*b))
            });
            for (worst, (name, level)) in worst.iter_mut().zip(levels()) {
                let mut responses = vec![Responses::default(); places.len()];
                single_scattering_at(level, &wide, &places, &shading, &mut responses);
                for (pair, expected) in expected.iter().enumerate() {
                    let found = all(&responses[pair / 37], pair % 37);
                    for i in 0..7 {
                        let mode = (i + 2) / 3;
                        let error = (found[i] - expected[i]).abs()
                            / (expected[i] + 0.01 * largest[mode] + 1e-20);
                        assert!(found[i] >= 0.0 && found[i].is_finite(), "{name}");
                        if error > 1e-5 && name == "AVX2" {
                            println!(
                                "{name} {ix} {} {i} {found:?} {expected:?} {largest:?} {} {:?} {:?} {:?}",
                                pair / 37,
                                lambdas[pair % 37],
                                hair.fibre,
                                directions[pair % 37],
                                places[pair / 37]
                            );
                        }
                        worst[mode] = worst[mode].max(error);
                        n += 1;
                    }
                }
            }
        }
        println!("{n} {worst:?}");
        assert!(n > 20_000 * 7);
    }
}
