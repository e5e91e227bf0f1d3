//! What the hair between eight lights and a point makes of them. Twins:
//! `closed_form/multiple_scattering.rs` and `closed_form/transmittance.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::closed_form::{
    AxisDensities, BETWEEN_LAYERS_SHARE, DENSITY_BLOCKED, DENSITY_OPEN, ForwardTable, HairLayers,
    LAST_FORWARD, LEAST_LOST, LEAST_SHARE, P_1, P_2,
};

use super::LANES;
use super::math::{clamp, exp, ln, mul_add};
use super::rows::{cells, transpose};

/// Eight of [`crate::closed_form::ShadowRecord`].
#[derive(Clone, Copy, Debug)]
pub struct ShadowRecords<S: Simd> {
    /// -ln of the shares there, 0..=[`MOST_DEPTH`].
    pub depths: [f32x8<S>; 3],
    /// As there.
    pub sin_theta: f32x8<S>,
}

/// -ln([`LEAST_SHARE`]).
pub const MOST_DEPTH: f32 = 20.030_119;

/// The depths of [`ShadowRecords`].
#[inline(always)]
pub fn depths_of_shares<S: Simd>(shares: [f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let mut depths = shares;
    for depth in &mut depths {
        *depth = clamp(-ln(depth.max(LEAST_SHARE)), 0.0, MOST_DEPTH);
    }
    depths
}

/// Eight of [`crate::closed_form::ForwardLight`].
#[derive(Clone, Copy, Debug)]
pub struct ForwardLights<S: Simd> {
    /// T_f - T_vol + T_b, 0..=1.
    pub gained: [f32x8<S>; 3],
    /// f_global (T_f - T_vol) + T_b.
    pub global: [f32x8<S>; 3],
    /// Width in inclination, Xu's, radians.
    pub sigma_f: f32x8<S>,
}

/// The averages that forward scattering needs, at the inclinations of eight records.
#[derive(Clone, Copy, Debug)]
pub struct ForwardAverages<S: Simd> {
    /// a_f.
    pub a_f: [f32x8<S>; 3],
    /// beta_f^2.
    pub beta_f_2: [f32x8<S>; 3],
}

/// [`crate::closed_form::sample_forward`].
#[inline(always)]
pub fn sample_forward<S: Simd>(table: &ForwardTable, sin_theta: f32x8<S>) -> ForwardAverages<S> {
    let simd = sin_theta.token();
    let (first, fraction) = cells(clamp(sin_theta, 0.0, 1.0) * LAST_FORWARD, LAST_FORWARD);
    let fraction = <[f32; LANES]>::from(fraction);
    let mut rows = [sin_theta; LANES];
    for (lane, mixed) in rows.iter_mut().enumerate() {
        // a_f and beta_f^2 of one sine are eight numbers.
        let ix = 2 * first[lane] as usize;
        let entries = table[ix..ix + 4].as_flattened().as_chunks::<LANES>().0;
        let low = f32x8::load_array_ref(simd, &entries[0]);
        let high = f32x8::load_array_ref(simd, &entries[1]);
        *mixed = low * (1.0 - fraction[lane]) + high * fraction[lane];
    }
    let [a, b, c, _, d, e, f, _] = transpose(rows);
    ForwardAverages {
        a_f: [a, b, c],
        beta_f_2: [d, e, f],
    }
}

/// p / -ln T(p) of the depth -ln T(p).
#[inline(always)]
fn reach_at<S: Simd>(depth: f32x8<S>, p: f32) -> f32x8<S> {
    f32x8::splat(depth.token(), p) / depth.max(1e-6 * p)
}

/// 1 / (-ln T(p) / p) as a parabola in p, for all channels.
struct Reach<S: Simd> {
    at_p_2: f32x8<S>,
    slope_low: f32x8<S>,
    bend: f32x8<S>,
}

impl<S: Simd> Reach<S> {
    #[inline(always)]
    fn new(record: &ShadowRecords<S>) -> Reach<S> {
        let at_1 = reach_at(record.depths[0], 1.0);
        let at_p_1 = reach_at(record.depths[1], P_1);
        let at_p_2 = reach_at(record.depths[2], P_2);
        let slope_low = (at_p_1 - at_p_2) * (1.0 / (P_1 - P_2));
        let slope_high = (at_1 - at_p_1) * (1.0 / (1.0 - P_1));
        Reach {
            at_p_2,
            slope_low,
            bend: (slope_high - slope_low) * (1.0 / (1.0 - P_2)),
        }
    }

    /// Value and slope at `p`.
    #[inline(always)]
    fn at(&self, p: f32x8<S>) -> [f32x8<S>; 2] {
        let slope = mul_add(p - P_1, self.bend, self.slope_low);
        let beyond = p - P_2;
        [
            mul_add(beyond, slope, self.at_p_2).max(1e-3),
            mul_add(beyond, self.bend, slope),
        ]
    }
}

/// [`crate::closed_form::transmitted`] of one channel, by its reach.
#[inline(always)]
fn transmitted<S: Simd>(open: f32x8<S>, p: f32x8<S>, reach: f32x8<S>) -> f32x8<S> {
    exp(-(p / reach)).max(open.min(1.0)).min(1.0)
}

/// [`crate::closed_form::global_density`].
#[inline(always)]
fn global_density<S: Simd>(open: f32x8<S>) -> f32x8<S> {
    open * (DENSITY_OPEN - DENSITY_BLOCKED) + DENSITY_BLOCKED
}

/// [`crate::closed_form::local_density`] of eight lights from the unit vectors `towards`.
#[inline(always)]
pub fn local_density<S: Simd>(densities: &AxisDensities, towards: &[f32x8<S>; 3]) -> [f32x8<S>; 3] {
    let simd = towards[0].token();
    let zero = f32x8::splat(simd, 0.0);
    let mut found = [zero; 3];
    for (axis, along) in towards.iter().enumerate() {
        let is_up = along.simd_gt(zero);
        let share = *along * *along;
        for (found, densities) in found.iter_mut().zip(densities) {
            let above = f32x8::splat(simd, densities[axis]);
            let below = f32x8::splat(simd, densities[3 + axis]);
            *found = mul_add(share, is_up.select(below, above), *found);
        }
    }
    found
}

/// `between_layers` of `closed_form/hair_layers.rs`, of one channel.
#[inline(always)]
fn between_layers<S: Simd>(
    layers: &HairLayers,
    channel: usize,
    u: f32x8<S>,
    density_back: f32x8<S>,
) -> f32x8<S> {
    let r = layers.reflected[channel];
    // R (R - R_2).
    let r_missing = (1.0 - density_back) * (r * layers.attenuation_b[channel]);
    let one_minus_r_2 = 1.0 - r * r;
    let below = f32x8::splat(u.token(), one_minus_r_2);
    (u * one_minus_r_2 / mul_add(r_missing, 1.0 - u * u, below)).min(1.0)
}

/// [`crate::closed_form::forward_light`] of eight lights of colours `rgb` and bandwidths `lambda`.
#[inline(always)]
pub fn forward_light<S: Simd>(
    record: &ShadowRecords<S>,
    averages: &ForwardAverages<S>,
    rgb: &[f32x8<S>; 3],
    lambda: f32x8<S>,
    (layers, density_back): (&HairLayers, &[f32x8<S>; 3]),
) -> ForwardLights<S> {
    let simd = lambda.token();
    let one = f32x8::splat(simd, 1.0);
    let open = exp(-record.depths[0]);
    let reach = Reach::new(record);
    // Of a black light, too.
    let brightest = one / rgb[0].max(rgb[1]).max(rgb[2]).max(1e-30);
    let most = record.depths[2] * (16.0 / P_2);
    let global_factor = global_density(open);
    let (mut gained, mut global) = ([open; 3], [open; 3]);
    let (mut carried_sum, mut mean) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 0.0));
    for channel in 0..3 {
        let a_f = averages.a_f[channel];
        let p_a_f = clamp(one - a_f, LEAST_LOST, 1.0);
        let [value, _] = reach.at(p_a_f);
        let t_f = transmitted(open, p_a_f, value);
        let p_q = clamp(one - a_f * layers.gain[channel], LEAST_LOST, 1.0);
        let [value, slope] = reach.at(p_q);
        let u = transmitted(open, p_q, value);
        let f = between_layers(layers, channel, u, density_back[channel]);
        let forward = (t_f - open).max(0.0);
        let t_b = (f - t_f).max(0.0) * BETWEEN_LAYERS_SHARE;
        gained[channel] = forward + t_b;
        global[channel] = mul_add(forward, global_factor, t_b);
        // One width for all channels: each counts by what it carries.
        let carried = mul_add(
            gained[channel],
            rgb[channel] * brightest,
            f32x8::splat(simd, 1e-12),
        );
        // The number of forward scatterings.
        let sent_on = one - p_q;
        let inverse = one / value;
        let depth = (one - p_q * slope * inverse) * inverse;
        let events = sent_on * u * depth / (u - open).max(1e-6);
        let events = events.min(mul_add(sent_on, most, one)).max(1.0);
        carried_sum += carried;
        mean += carried * (averages.beta_f_2[channel] * events);
    }
    ForwardLights {
        gained,
        global,
        sigma_f: (lambda * lambda + mean / carried_sum).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_form::{self, NO_LAYERS, ShadowRecord};
    use crate::random::SplitMix64;
    use crate::wide::{dispatch, levels};

    /// Eight lights, one after the other.
    struct Lights {
        records: [ShadowRecord; LANES],
        rgb: [[f32; LANES]; 3],
        lambda: [f32; LANES],
    }

    /// Records of up to eight rays whose depths are anything from nothing to opaque.
    fn lights(random: &mut SplitMix64) -> Lights {
        let record = |random: &mut SplitMix64| {
            let n_rays = 1 + random.next_u64() % 8;
            let depth = |random: &mut SplitMix64| match random.next_u64() % 4 {
                0 => 0.0,
                _ => random.log_uniform(1e-3, 80.0),
            };
            let depths: Vec<f64> = (0..n_rays).map(|_| depth(random)).collect();
            let share = |p: f32| {
                let rays = depths.iter().map(|depth| (-f64::from(p) * depth).exp());
                (rays.sum::<f64>() / n_rays as f64) as f32
            };
            ShadowRecord {
                shares: [share(1.0), share(P_1), share(P_2)],
                sin_theta: random.uniform(-0.1, 1.1) as f32,
            }
        };
        let records: [ShadowRecord; LANES] = std::array::from_fn(|_| record(random));
        let mut numbers = |low: f64, high: f64| -> [f32; LANES] {
            std::array::from_fn(|_| random.uniform(low, high) as f32)
        };
        Lights {
            rgb: [numbers(0.0, 3.0), numbers(0.0, 1.0), numbers(0.1, 2.0)],
            lambda: numbers(0.01, 1.2),
            records,
        }
    }

    #[test]
    fn eight_lights_are_forwarded_as_one_is() {
        let mut random = SplitMix64(1);
        let (mut worst_gained, mut worst_width, mut n) = (0.0f32, 0.0f32, 0);
        // Channels of lights to which light between layers adds something.
        let mut n_between = 0;
        for case in 0..3000 {
            let mut table = [[0.0; 4]; 128];
            for (ix, entry) in table.iter_mut().enumerate() {
                let high = if ix % 2 == 0 { 0.99 } else { 0.2 };
                *entry = std::array::from_fn(|_| random.uniform(0.001, high) as f32);
            }
            let lights = lights(&mut random);
            let mut below = |high: f64| [0; 3].map(|_| random.uniform(0.001, high) as f32);
            let layers = match case % 20 {
                1 => NO_LAYERS,
                _ => closed_form::layers_of(below(0.8), below(0.5)),
            };
            let density_back = match case % 20 {
                0 => [0.0; 3],
                10 => [1.0; 3],
                _ => below(1.0),
            };
            for (name, level) in levels() {
                let (gained, global, sigma_f) = dispatch!(level, simd => {
                    let of = |ix: usize| {
                        f32x8::from_fn(simd, |lane| lights.records[lane].shares[ix])
                    };
                    let record = ShadowRecords {
                        depths: depths_of_shares([of(0), of(1), of(2)]),
                        sin_theta: f32x8::from_fn(simd, |lane| lights.records[lane].sin_theta),
                    };
                    let found = forward_light(
                        &record,
                        &sample_forward(&table, record.sin_theta),
                        &lights.rgb.map(|channel| f32x8::load_array(simd, channel)),
                        f32x8::load_array_ref(simd, &lights.lambda),
                        (&layers, &density_back.map(|density| f32x8::splat(simd, density))),
                    );
                    (
                        found.gained.map(<[f32; LANES]>::from),
                        found.global.map(<[f32; LANES]>::from),
                        <[f32; LANES]>::from(found.sigma_f),
                    )
                });
                for lane in 0..LANES {
                    let record = &lights.records[lane];
                    let (a_f, beta_f_2) = closed_form::sample_forward(&table, record.sin_theta);
                    let light = (lights.rgb.map(|channel| channel[lane]), lights.lambda[lane]);
                    let with = |layers: &HairLayers| {
                        closed_form::forward_light(
                            record,
                            a_f,
                            beta_f_2,
                            light,
                            (layers, density_back),
                        )
                    };
                    let (expected, alone) = (with(&layers), with(&NO_LAYERS));
                    for (gained, forward) in expected.gained.into_iter().zip(alone.gained) {
                        n_between += u32::from(gained > forward + 1e-3);
                    }
                    let allowed = 1e-5f32;
                    let mut most = 0.0f32;
                    for (found, expected) in gained.iter().zip(expected.gained) {
                        let error = (found[lane] - expected).abs();
                        assert!(error < allowed, "{name} {error} {record:?}");
                        worst_gained = worst_gained.max(error / allowed);
                        most = most.max(expected);
                    }
                    for (found, expected) in global.iter().zip(expected.global) {
                        let error = (found[lane] - expected).abs();
                        assert!(error < allowed, "{name} {error} {record:?}");
                    }
                    // The width of no light does not matter, and is rounding's.
                    let ratio = sigma_f[lane] / expected.sigma_f;
                    let error = most * (ratio - 1.0).abs();
                    assert!(error < allowed, "{name} {error} {record:?}");
                    worst_width = worst_width.max(error / allowed);
                    n += 1;
                }
            }
        }
        println!(
            "{n} lights: errors {worst_gained:.2} of the allowed in share, {worst_width:.2} in width; {n_between} channels with light between layers"
        );
        assert!(n > 20_000 && n_between > n / 2, "{n} {n_between}");
    }

    #[test]
    fn hair_behind_eight_lights_is_as_behind_one() {
        let mut random = SplitMix64(2);
        let mut n_between = 0;
        for _ in 0..2000 {
            let densities: AxisDensities =
                std::array::from_fn(|_| std::array::from_fn(|_| random.uniform(0.0, 1.0) as f32));
            let towards: [[f32; 3]; LANES] = std::array::from_fn(|_| {
                let d = [0; 3].map(|_| random.uniform(-1.0, 1.0) as f32);
                let length = d.iter().map(|x| x * x).sum::<f32>().sqrt();
                d.map(|x| x / length.max(1e-3))
            });
            for (name, level) in levels() {
                let found = dispatch!(level, simd => {
                    let along = |axis: usize| f32x8::from_fn(simd, |lane| towards[lane][axis]);
                    local_density(&densities, &[along(0), along(1), along(2)])
                        .map(<[f32; LANES]>::from)
                });
                for (lane, towards) in towards.into_iter().enumerate() {
                    let expected = closed_form::local_density(&densities, towards);
                    for (found, expected) in found.iter().zip(expected) {
                        let error = (found[lane] - expected).abs();
                        assert!(error < 1e-6, "{name} {} {expected}", found[lane]);
                        n_between += u32::from(expected > 0.0 && expected < 1.0);
                    }
                }
            }
        }
        assert!(n_between > 10_000, "{n_between}");
    }
}
