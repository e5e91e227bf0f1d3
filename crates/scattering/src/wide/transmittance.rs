//! What hair leaves of a light, in eight voxels at a time. Twin: `closed_form/transmittance.rs`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, i32x8};

use crate::closed_form::{HALF_BIAS, LEAST_HALF, MOST_HALF, P_1, P_2, RECORD_SCALE};

use super::math::{clamp, exp, ln};

/// Eight of [`crate::closed_form::ShadowRecord`] as they are added up.
#[derive(Clone, Copy, Debug)]
pub struct RecordSums<S: Simd> {
    /// As there.
    pub shares: [f32x8<S>; 3],
    /// As there.
    pub sin_theta: f32x8<S>,
}

/// What [`crate::closed_form::pass_through`] does along a stretch of hair; one stretch may follow the
/// other.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<S: Simd> {
    /// The factor of each share.
    factors: [f32x8<S>; 3],
    /// Integral of sin^2 of the inclination over depth.
    sin_2_depth: f32x8<S>,
}

impl<S: Simd> Stretch<S> {
    /// Of an optical depth; 0 or more.
    #[inline(always)]
    pub fn new(depth: f32x8<S>, sin_2: f32x8<S>) -> Stretch<S> {
        Stretch {
            factors: shares_of_ray(exp(depth * -P_2)),
            sin_2_depth: depth * sin_2,
        }
    }

    /// What is left of `entering`.
    #[inline(always)]
    pub fn pass_through(&self, entering: [f32x8<S>; 4]) -> [f32x8<S>; 4] {
        [
            entering[0] * self.factors[0],
            entering[1] * self.factors[1],
            entering[2] * self.factors[2],
            entering[3] + self.sin_2_depth,
        ]
    }
}

/// [`crate::closed_form::shares_of_ray`].
#[inline(always)]
fn shares_of_ray<S: Simd>(at_p_2: f32x8<S>) -> [f32x8<S>; 3] {
    let squared = at_p_2 * at_p_2;
    let at_p_1 = squared * squared;
    [(at_p_1 * at_p_1) * (at_p_1 * at_p_1), at_p_1, at_p_2]
}

/// -ln(share) / P_2.
#[inline(always)]
fn depth_of_share<S: Simd>(share: f32x8<S>) -> f32x8<S> {
    ln(share.max(1e-30)) * (-1.0 / P_2)
}

/// [`crate::closed_form::add_to_record`]; `k` of each lane.
#[inline(always)]
pub fn add_to_record<S: Simd>(
    sum: &RecordSums<S>,
    here: [f32x8<S>; 4],
    k: f32x8<S>,
    n: f32,
) -> RecordSums<S> {
    let share = 1.0 / n;
    let depth = depth_of_share(here[2]);
    // None before the first: k is 0 then.
    let mean_before = sum.shares[2] * n / k.max(1.0);
    let depth_before = k * depth_of_share(mean_before);
    let sin_2_depth = here[3] + depth_before * sum.sin_theta * sum.sin_theta;
    let sin_2 = clamp(sin_2_depth / (depth + depth_before).max(1e-6), 0.0, 1.0);
    RecordSums {
        shares: [
            sum.shares[0] + here[0] * share,
            sum.shares[1] + here[1] * share,
            sum.shares[2] + here[2] * share,
        ],
        sin_theta: sin_2.sqrt(),
    }
}

/// [`crate::closed_form::pack_record`] of each lane: the words of all, word by word.
#[inline(always)]
pub fn pack_records<S: Simd>(record: &RecordSums<S>) -> [i32x8<S>; 2] {
    let [a, b, c] = record.shares;
    let (a, b) = (half_bits(a * RECORD_SCALE), half_bits(b * RECORD_SCALE));
    let c = half_bits(c * RECORD_SCALE);
    [a | (b << 16), c | (half_bits(record.sin_theta) << 16)]
}

/// The bits of half floats, as [`crate::closed_form::pack_record`] finds them.
#[inline(always)]
fn half_bits<S: Simd>(x: f32x8<S>) -> i32x8<S> {
    let bits: i32x8<S> = x.min(MOST_HALF).bitcast();
    let rounded = bits + 0xfff + ((bits >> 13) & 1);
    let bits = (rounded - HALF_BIAS as i32) >> 13;
    x.simd_ge(LEAST_HALF)
        .select(bits, i32x8::splat(x.token(), 0))
}

const _: () = assert!(
    P_1 == 4.0 * P_2,
    "`Stretch` takes powers of one exponential"
);

#[cfg(test)]
mod tests {
    use crate::closed_form::{self, ShadowRecord};
    use crate::random::SplitMix64;
    use crate::wide::{LANES, dispatch, levels};

    use super::*;

    #[test]
    fn records_are_those_of_the_scalar_twin() {
        let mut random = SplitMix64(3);
        for (name, level) in levels() {
            for round in 0..300 {
                let mut number = |low, high| {
                    std::array::from_fn::<f32, LANES, _>(|_| random.uniform(low, high) as f32)
                };
                let most = [0.3, 5.0, 40.0][round % 3];
                let (depth, sin_2) = (number(0.0, most), number(0.0, 1.0));
                let entering = [number(0.0, 1.0), number(0.0, 1.0), number(1e-3, 1.0)];
                let (so_far, before) = (number(0.0, 20.0), number(1e-3, 1.0));
                let sin_theta = number(0.0, 1.0);
                let n = 1.0 + (round % 8) as f32;
                let k = std::array::from_fn::<f32, LANES, _>(|lane| (lane as f32).min(n - 1.0));
                let sums: [ShadowRecord; LANES] = std::array::from_fn(|lane| ShadowRecord {
                    shares: [0.5, 0.7, 1.0].map(|x| x * before[lane] * k[lane] / n),
                    sin_theta: sin_theta[lane],
                });
                let found: [[f32; LANES]; 8] = dispatch!(level, simd => {
                    let of = |numbers: [f32; LANES]| f32x8::simd_from(simd, numbers);
                    let [a, b, c] = [entering[0], entering[1], entering[2]];
                    let entering = [of(a), of(b), of(c), of(so_far)];
                    let stretch = Stretch::new(of(depth), of(sin_2));
                    let here = stretch.pass_through(entering);
                    let sum = RecordSums {
                        shares: [
                            of(sums.map(|sum| sum.shares[0])),
                            of(sums.map(|sum| sum.shares[1])),
                            of(sums.map(|sum| sum.shares[2])),
                        ],
                        sin_theta: of(sin_theta),
                    };
                    let RecordSums { shares: [d, e, f], sin_theta } =
                        add_to_record(&sum, here, of(k), n);
                    let [a, b, c, so_far] = here;
                    [a.into(), b.into(), c.into(), so_far.into(), d.into(), e.into(), f.into(), sin_theta.into()]
                });
                for lane in 0..LANES {
                    let [a, b, c] = [0, 1, 2].map(|ix: usize| entering[ix][lane]);
                    let here = [a, b, c, so_far[lane]];
                    let here = closed_form::pass_through(here, depth[lane], sin_2[lane]);
                    let record = closed_form::add_to_record(&sums[lane], here, k[lane], n);
                    let exact = here.into_iter().chain(record.shares);
                    for (ix, exact) in exact.chain([record.sin_theta]).enumerate() {
                        let found = found[ix][lane];
                        assert!(
                            (found - exact).abs() <= 3e-6 * exact + 1e-6,
                            "{name} {ix}: {found} {exact}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn packed_records_are_those_of_the_scalar_twin() {
        let mut random = SplitMix64(4);
        // Nothing, all, next to the least and the most that a half float holds, and a tie.
        let least = LEAST_HALF / RECORD_SCALE;
        let fixed = [
            0.0,
            1.0,
            0.999 * least,
            least,
            1.9999,
            3.0,
            0.5 + 1.0 / 4096.0,
            1e-5,
        ];
        for (name, level) in levels() {
            for round in 0..200 {
                let records: [ShadowRecord; LANES] = std::array::from_fn(|lane| {
                    let mut number = || random.uniform(-22.0, 0.1).exp() as f32;
                    ShadowRecord {
                        shares: match round {
                            0 => [fixed[lane]; 3],
                            _ => [number(), number(), number()],
                        },
                        sin_theta: number().min(1.0),
                    }
                });
                let found: [[i32; LANES]; 2] = dispatch!(level, simd => {
                    let of = |numbers: [f32; LANES]| f32x8::simd_from(simd, numbers);
                    let [low, high] = pack_records(&RecordSums {
                        shares: [
                            of(records.map(|record| record.shares[0])),
                            of(records.map(|record| record.shares[1])),
                            of(records.map(|record| record.shares[2])),
                        ],
                        sin_theta: of(records.map(|record| record.sin_theta)),
                    });
                    [low.into(), high.into()]
                });
                for (lane, record) in records.iter().enumerate() {
                    let found = found.map(|words| words[lane] as u32);
                    assert_eq!(found, closed_form::pack_record(record), "{name} {record:?}");
                }
            }
        }
    }
}
