//! How far the difference of a block from the larger one around it is believed, and how wrong that may be.

use super::field::{Cell, Detail};

/// Side of the blocks that errors are told of.
pub(super) const BLOCK: usize = 4;

/// Differences count as far as they exceed what noise comes to by so many of its standard deviations. 3
/// leaves a tenth more error; 0.5 shows a seventh more noise where the picture is right.
const CAUTION: f32 = 1.0;

/// As [`CAUTION`], of blocks smaller than [`BLOCK`], over the degrees of freedom of their variances: noise of
/// single pixels is seen as grain.
const FINE_CAUTION: f32 = 15.0;

/// Side of the smallest blocks that may be believed by themselves: of fewer pixels the noise is not known
/// well enough.
const FROM_ITSELF: usize = 8;

/// As [`CAUTION`], of a block by itself: its square counts as far as it exceeds four times its noise.
const OWN_CAUTION: f32 = 2.1;

/// Estimates by block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    /// The ratio.
    pub rho: [f32; 3],
    /// Mean square error of the block's sum, without bias (Stein 1981): it may be negative.
    pub error: [f32; 3],
    /// The part of it that is noise of the samples.
    pub noise: [f32; 3],
    /// Mean square of the block's sum without noise, its error without correction; likewise.
    pub signal: [f32; 3],
    /// How far the own part of the error may be off, all channels.
    pub doubt: f32,
    /// Variance of what `error` says of the signal that is left.
    pub spread: [f32; 3],
}

/// What is expected of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    /// Mean square of its difference.
    signal: [f32; 3],
    /// That of the noise.
    noise: [f32; 3],
}

impl Detail {
    /// The mean of what this is the sum of, as large as it is to be where `block` is as bright: without the
    /// noise what is measured goes with the scale, and so about does the noise.
    fn as_bright_as(&self, block: &Detail) -> Local {
        let mut local = Local::default();
        for c in 0..3 {
            let weight = match self.weight[c] > 0.0 {
                true => block.weight[c] / self.weight[c],
                false => 0.0,
            };
            local.noise[c] = weight * self.noise[c];
            local.signal[c] = weight * (self.measured[c] - self.noise[c]);
        }
        local
    }
}

/// How far the difference of a block is believed.
#[derive(Clone, Copy, Debug)]
struct Evidence {
    /// What the difference is multiplied by.
    gain: f32,
    /// How the gain follows the differences themselves, in Stein's estimate.
    slope: f32,
}

impl Evidence {
    /// By `of`, sums over blocks. A mean square of n numbers scatters by sqrt(2 / n) of itself; noise counts
    /// as so much more than it is expected to be, times `caution`.
    fn new(of: &Detail, caution: f32) -> Evidence {
        let caution = 1.0 + caution * (2.0 / of.count).sqrt();
        let total = |values: &[f32; 3]| values.iter().sum::<f32>();
        let (measured, noise) = (total(&of.measured), total(&of.noise));
        // Both are 0 without samples.
        let share_of_noise = match measured > 0.0 {
            true => noise / measured,
            false => 1.0,
        };
        let gain = (1.0 - caution * share_of_noise).max(0.0);
        let slope = match gain > 0.0 {
            true => 4.0 * caution * share_of_noise / of.count,
            false => 0.0,
        };
        Evidence { gain, slope }
    }

    fn or_more(self, other: Evidence) -> Evidence {
        match self.gain > other.gain {
            true => self,
            false => other,
        }
    }
}

impl Estimate {
    /// The estimate of a block of `side` pixels from that of the larger one around it. `own` is what it differs
    /// from that by, and `around` the sum of that over the blocks around; `freedom` is that of the variances.
    pub fn new(
        cell: &Cell,
        (own, around): (&Detail, &Detail),
        (side, freedom): (usize, f32),
        (parent, above): &(Cell, Estimate),
    ) -> Estimate {
        let mut estimate = Estimate::default();
        if !cell.is_shown() {
            return estimate;
        }
        let caution = match side < BLOCK {
            true => FINE_CAUTION / freedom,
            false => CAUTION,
        };
        let mut evidence = Evidence::new(around, caution);
        let mut local = around.as_bright_as(own);
        let count = around.count.max(1.0);
        if side >= FROM_ITSELF {
            evidence = evidence.or_more(Evidence::new(own, OWN_CAUTION));
            local.noise = own.noise;
        }
        let Evidence { gain, slope } = evidence;
        for c in 0..3 {
            let share = match parent.scale[c] > 0.0 {
                true => cell.scale[c] / parent.scale[c],
                false => 0.0,
            };
            let (noise, signal) = (local.noise[c], local.signal[c]);
            let risk = (1.0 - gain).powi(2) * signal + (gain * gain + slope) * noise;
            estimate.rho[c] = above.rho[c] + gain * own.difference[c];
            estimate.error[c] = share * share * above.error[c] + risk;
            estimate.noise[c] = share * share * above.noise[c] + gain * gain * noise;
            estimate.signal[c] = share * share * above.signal[c] + signal;
            let off = (1.0 - gain).powi(2) * noise * (2.0 / count).sqrt();
            estimate.spread[c] = share.powi(4) * above.spread[c] + off * off;
            // Channels share their paths.
            estimate.doubt += (1.0 - gain).powi(2) * std::f32::consts::SQRT_2 * noise;
        }
        estimate
    }
}
