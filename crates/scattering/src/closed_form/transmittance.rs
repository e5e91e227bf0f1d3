//! What hair leaves of a light: records of the sweep and the shares made of them. Twin:
//! `shaders/lib/transmittance.wgsl`.
//!
//! Along a ray the number n of crossed fibres is Poisson's with mean tau, the optical depth. So
//! the unblocked share is `E[n = 0] = exp(-tau)` and the share that n forward scatterings of
//! factor a_f leave is `T_f = E[a_f^n] = exp(-tau (1 - a_f))`: both are exp(-p tau), averaged over
//! the rays of the light's lobe, at p = 1 and p = 1 - a_f. A record holds that mean at three
//! exponents; it depends on the geometry and the lobe alone, and any a_f reads its T_f from it.

/// Second exponent of a record; the first is 1. A quarter, for [`pass_through`].
pub const P_1: f32 = 0.25;

/// Third exponent of a record. A quarter of [`P_1`]; white hair asks for p down to 0.05.
pub const P_2: f32 = 0.0625;

/// Factor of shares in half floats: 1 becomes 2^15, and shares keep three digits down to 2e-9.
pub const RECORD_SCALE: f32 = 32768.0;

/// Smallest share that is distinguished from zero: the smallest normal half float over
/// [`RECORD_SCALE`].
pub const LEAST_SHARE: f32 = 2e-9;

/// The smallest normal half float, 2^-14, and the largest.
pub(crate) const LEAST_HALF: f32 = 6.103_515_6e-5;
pub(crate) const MOST_HALF: f32 = 65504.0;

/// The difference of the exponents' biases, 112, where a float has its exponent.
pub(crate) const HALF_BIAS: u32 = 112 << 23;

/// Shadow of a light at a place.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShadowRecord {
    /// E exp(-p tau) over the light's lobe at p = 1, [`P_1`], [`P_2`]; 0..=1, growing.
    pub shares: [f32; 3],
    /// Sine of the light's inclination to the crossed fibres, root of the mean square over
    /// optical depth; 0..=1, and 0 where nothing is crossed.
    pub sin_theta: f32,
}

/// A [`ShadowRecord`] in four half floats: shares times [`RECORD_SCALE`], then the sine.
pub type PackedRecord = [u32; 2];

/// Packs a record; relative rounding 2^-11 of each number.
pub fn pack_record(record: &ShadowRecord) -> PackedRecord {
    let [a, b, c] = record.shares.map(|share| half_bits(share * RECORD_SCALE));
    [a | (b << 16), c | (half_bits(record.sin_theta) << 16)]
}

/// The record in `packed`.
pub fn unpack_record(packed: &PackedRecord) -> ShadowRecord {
    let half = |word: u32, high: u32| from_half_bits((word >> (16 * high)) & 0xffff);
    ShadowRecord {
        shares: [half(packed[0], 0), half(packed[0], 1), half(packed[1], 0)]
            .map(|share| share / RECORD_SCALE),
        sin_theta: half(packed[1], 1),
    }
}

/// Shares after optical depth `depth`, and the integral of sin^2 of the inclination over depth:
/// `entering` is what arrives. One exponential serves all three exponents.
pub fn pass_through(entering: [f32; 4], depth: f32, sin_2: f32) -> [f32; 4] {
    let [at_1, at_p_1, at_p_2] = shares_of_ray((-P_2 * depth).exp());
    [
        entering[0] * at_1,
        entering[1] * at_p_1,
        entering[2] * at_p_2,
        entering[3] + depth * sin_2,
    ]
}

/// Shares of a single ray at p = 1, [`P_1`] and [`P_2`], of which the last is `at_p_2`: its 16th and 4th
/// power and itself.
pub fn shares_of_ray(at_p_2: f32) -> [f32; 3] {
    let squared = at_p_2 * at_p_2;
    let at_p_1 = squared * squared;
    [(at_p_1 * at_p_1) * (at_p_1 * at_p_1), at_p_1, at_p_2]
}

/// Effective optical depth -ln(share) / P_2 of a share at [`P_2`].
pub fn depth_of_share(share: f32) -> f32 {
    -share.max(1e-30).ln() / P_2
}

/// Adds direction `k` (from 0) of a lobe's `n` to the sum of those before it; `here` is what
/// [`pass_through`] answers at the place. After the last, `shares` are means.
pub fn add_to_record(sum: &ShadowRecord, here: [f32; 4], k: f32, n: f32) -> ShadowRecord {
    let depth = depth_of_share(here[2]);
    let depth_before = if k > 0.0 {
        k * depth_of_share(sum.shares[2] * n / k.max(1.0))
    } else {
        0.0
    };
    let sin_2_depth = here[3] + depth_before * sum.sin_theta * sum.sin_theta;
    let sin_2 = (sin_2_depth / (depth + depth_before).max(1e-6)).clamp(0.0, 1.0);
    ShadowRecord {
        shares: [0, 1, 2].map(|ix| sum.shares[ix] + here[ix] / n),
        sin_theta: sin_2.sqrt(),
    }
}

/// 1 / (-ln T(p) / p), the inverse of the effective depth, and its slope in p, by channel.
struct Reach {
    value: [f32; 3],
    slope: [f32; 3],
}

/// The reach is a straight line in p both where all rays cross the same depth and where a share of
/// them is open and the rest closed; through the three known values goes a parabola.
fn reach_at(record: &ShadowRecord, p: [f32; 3]) -> Reach {
    let exponents = [1.0, P_1, P_2];
    let reach = [0, 1, 2].map(|ix| {
        let depth = -record.shares[ix].max(LEAST_SHARE).ln();
        exponents[ix] / depth.max(1e-6 * exponents[ix])
    });
    let slope_low = (reach[1] - reach[2]) / (P_1 - P_2);
    let slope_high = (reach[0] - reach[1]) / (1.0 - P_1);
    let bend = (slope_high - slope_low) / (1.0 - P_2);
    let slope = p.map(|p| slope_low + (p - P_1) * bend);
    let of_channel = [0, 1, 2];
    Reach {
        value: of_channel.map(|c| (reach[2] + (p[c] - P_2) * slope[c]).max(1e-3)),
        slope: of_channel.map(|c| slope[c] + (p[c] - P_2) * bend),
    }
}

/// E exp(-p tau) at `p` in 0.03..=1 for each channel; 0..=1 and never below the share at 1.
///
/// Largest error of the share against sums over 4 to 64 rays of gamma, log-normal, two-valued and
/// power-law depths from 0.1 to 80: 0.048, 99 % below 0.014, RMS 0.003.
pub fn transmitted(record: &ShadowRecord, p: [f32; 3]) -> [f32; 3] {
    let reach = reach_at(record, p);
    [0, 1, 2].map(|c| {
        let share = (-p[c] / reach.value[c]).exp();
        share.clamp(record.shares[0].min(1.0), 1.0)
    })
}

/// Mean number of forward scatterings, `E[n a^n; n >= 1] / E[a^n; n >= 1]` with a = 1 - `p`, of the
/// light that underwent at least one; `share` is [`transmitted`]'s answer. At least 1.
///
/// The numerator is -a dT/dp. Where all rays cross one depth this is s / (1 - e^-s) with
/// s = ln(T_f / T); over a lobe that is half open that quotient tells little of the closed half
/// (its square root is 9 to 20 % low over the depths of [`transmitted`], this one's RMS error is
/// 2 %).
pub fn forward_events(record: &ShadowRecord, p: [f32; 3], share: [f32; 3]) -> [f32; 3] {
    let reach = reach_at(record, p);
    let most = depth_of_share(record.shares[2]);
    [0, 1, 2].map(|c| {
        let a_f = 1.0 - p[c];
        let depth = (1.0 - p[c] * reach.slope[c] / reach.value[c]) / reach.value[c];
        let events = a_f * share[c] * depth / (share[c] - record.shares[0]).max(1e-6);
        // Rounding of shares next to 1 can make it anything; no path crosses 16 times the mean.
        events.min(1.0 + a_f * (16.0 * most)).max(1.0)
    })
}

/// Bits of the half float nearest to `x`, 0..=65504; below its smallest normal number, zero.
pub(super) fn half_bits(x: f32) -> u32 {
    if x < LEAST_HALF {
        return 0;
    }
    let bits = x.min(MOST_HALF).to_bits();
    let rounded = bits + 0xfff + ((bits >> 13) & 1);
    (rounded - HALF_BIAS) >> 13
}

/// The value of [`half_bits`].
pub(super) fn from_half_bits(bits: u32) -> f32 {
    if bits == 0 {
        return 0.0;
    }
    f32::from_bits((bits << 13) + HALF_BIAS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The record of equally likely `depths`.
    fn record_of(depths: &[f64]) -> ShadowRecord {
        let share = |p: f32| share_of(depths, f64::from(p)) as f32;
        ShadowRecord {
            shares: [share(1.0), share(P_1), share(P_2)],
            sin_theta: 0.5,
        }
    }

    fn share_of(depths: &[f64], p: f64) -> f64 {
        depths.iter().map(|tau| (-p * tau).exp()).sum::<f64>() / depths.len() as f64
    }

    #[test]
    fn records_survive_packing() {
        for shares in [[1.0, 1.0, 1.0], [3e-9, 0.01, 0.4], [0.1, 0.3, 0.9]] {
            let record = ShadowRecord {
                shares,
                sin_theta: 0.3,
            };
            let again = unpack_record(&pack_record(&record));
            for (a, b) in again.shares.iter().zip(shares) {
                assert!((a / b - 1.0).abs() <= 1.0 / 2048.0, "{a} {b}");
            }
            assert!((again.sin_theta - 0.3).abs() < 2e-4);
        }
        let zero = ShadowRecord::default();
        assert_eq!(unpack_record(&pack_record(&zero)), zero);
        let whole = ShadowRecord {
            shares: [1.0; 3],
            sin_theta: 0.0,
        };
        assert_eq!(unpack_record(&pack_record(&whole)), whole);
    }

    #[test]
    fn shares_of_one_depth_are_exact() {
        for tau in [0.0, 0.01, 0.5, 2.0, 10.0] {
            let record = record_of(&[tau]);
            for p in [0.03_f32, 0.05, 0.11, 0.3, 0.6, 0.9, 1.0] {
                let [share, ..] = transmitted(&record, [p; 3]);
                let exact = (-f64::from(p) * tau).exp() as f32;
                assert!((share - exact).abs() < 1e-5, "{tau} {p}: {share} {exact}");
            }
        }
    }

    #[test]
    fn shares_of_mixed_depths_are_close_and_ordered() {
        let (mut worst, mut sum, mut n) = (0.0_f64, 0.0, 0);
        for scale in [0.2, 1.0, 4.0, 16.0, 60.0] {
            for spread in [0.5_f64, 1.0, 2.0, 4.0] {
                for open in [0, 2, 5] {
                    let depths: Vec<f64> = (0..8)
                        .map(|ix| scale * ((f64::from(ix) + 0.5) / 8.0).powf(spread))
                        .enumerate()
                        .map(|(ix, tau)| if ix < open { 0.0 } else { tau })
                        .collect();
                    let record = unpack_record(&pack_record(&record_of(&depths)));
                    for ix in 1..=20 {
                        let p = 0.05 * ix as f32;
                        let [share, ..] = transmitted(&record, [p; 3]);
                        let error = f64::from(share) - share_of(&depths, f64::from(p));
                        assert!((record.shares[0]..=1.0).contains(&share));
                        worst = worst.max(error.abs());
                        sum += error * error;
                        n += 1;
                    }
                }
            }
        }
        let rms = (sum / f64::from(n)).sqrt();
        println!("worst {worst:.4}, RMS {rms:.4}");
        assert!(worst < 0.03 && rms < 0.005, "{worst} {rms}");
    }

    #[test]
    fn shares_of_any_record_are_shares() {
        let values = [0.0, 1e-9, 1e-4, 0.3, 0.9995, 1.0, 1.0001];
        for a in values {
            for b in values {
                for c in values {
                    let record = ShadowRecord {
                        shares: [a, b, c],
                        sin_theta: 0.0,
                    };
                    let p = [0.03, 0.3, 1.0];
                    let shares = transmitted(&record, p);
                    let events = forward_events(&record, p, shares);
                    for (share, events) in shares.into_iter().zip(events) {
                        assert!((0.0..=1.0).contains(&share), "{record:?}: {share}");
                        assert!((1.0..=20_000.0).contains(&events), "{record:?}: {events}");
                    }
                }
            }
        }
    }

    #[test]
    fn events_of_one_depth_and_of_mixed_depths() {
        let events = |depths: &[f64], p: f32| {
            let record = unpack_record(&pack_record(&record_of(depths)));
            let [share, ..] = transmitted(&record, [p; 3]);
            f64::from(forward_events(&record, [p; 3], [share; 3])[0])
        };
        for tau in [0.3_f64, 1.0, 3.0, 10.0] {
            for p in [0.07_f32, 0.3, 0.7] {
                let s = tau * (1.0 - f64::from(p));
                let exact = s / -(-s).exp_m1();
                let value = events(&[tau], p);
                assert!(
                    (value / exact - 1.0).abs() < 0.02,
                    "{tau} {p}: {value} {exact}"
                );
            }
        }
        // What counts is the light that has this many: errors matter by its share.
        for depths in [&[0.0, 0.0, 4.0, 6.0][..], &[1.0, 3.0, 8.0, 20.0]] {
            for p in [0.07_f32, 0.3, 0.7] {
                let (a, p64) = (1.0 - f64::from(p), f64::from(p));
                let gathered: f64 = depths.iter().map(|t| a * t * (-p64 * t).exp()).sum();
                let rest = share_of(depths, p64) - share_of(depths, 1.0);
                let exact = gathered / depths.len() as f64 / rest;
                let value = events(depths, p);
                println!("{depths:?} {p}: {value:.3} {exact:.3} of {rest:.3}");
                assert!(
                    (value / exact - 1.0).abs() * rest < 0.02,
                    "{p}: {value} {exact}"
                );
            }
        }
        assert_eq!(events(&[0.0], 0.3), 1.0);
    }

    #[test]
    fn directions_add_up_to_their_mean() {
        let mut sum = ShadowRecord::default();
        let inputs = [(1.0_f32, 0.2_f32), (3.0, 0.6), (0.0, 0.0), (2.0, 1.0)];
        for (k, (depth, sin_2)) in inputs.into_iter().enumerate() {
            let here = pass_through([1.0, 1.0, 1.0, 0.0], depth, sin_2);
            sum = add_to_record(&sum, here, k as f32, 4.0);
        }
        let mean = |p: f32| inputs.iter().map(|(d, _)| (-p * d).exp()).sum::<f32>() / 4.0;
        for (share, p) in sum.shares.iter().zip([1.0, P_1, P_2]) {
            assert!((share - mean(p)).abs() < 1e-6);
        }
        // Mean over depth: (0.2 + 1.8 + 2) / 6, but that P_2 weighs deep rays a little less.
        assert!((sum.sin_theta.powi(2) - 0.667).abs() < 0.03, "{sum:?}");
    }
}
