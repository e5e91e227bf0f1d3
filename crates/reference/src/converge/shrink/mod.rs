//! A noisy correction of a picture, taken apart by scale and believed as far as it exceeds its noise.
//!
//! The model: the correction `d` of a pixel is its scale `D` (about its radiance) times a ratio that
//! changes slowly, `d = D rho`. Over a block `rho = sum d / sum D`. From the whole picture by blocks of
//! [`TOP`] pixels a side, each of the whole, down to single pixels, what the ratio of a block differs from
//! that of the larger one is multiplied by
//!
//! `g = max(0, 1 - (1 + CAUTION sqrt(2/n)) noise / measured)`,
//!
//! both summed over the n blocks around it (James and Stein 1961): where the differences are no larger
//! than noise may be there is none. A block of [`FROM_ITSELF`] pixels a side and more whose own difference is
//! far above noise, as along a rim of light that the picture lacks, is believed by itself. The whole picture
//! differs from 0, the picture as it was. All is averaged over several places of the grid of blocks, so that
//! its lines do not show.
//!
//! The error that is left is told by Stein's estimate (1981), without knowing the truth, less what the
//! places of the grid differ.

mod blocks;
mod errors;

use rayon::prelude::*;

use blocks::{Cell, Detail, Grid, Level};
use errors::{Errors, Means};

/// Levels of blocks below the whole picture: sides of 1, 2, 4, ... 64 pixels.
const N_LEVELS: usize = 7;

/// Side of the largest of them.
const TOP: usize = 1 << (N_LEVELS - 1);

/// Side of the blocks that errors are told of.
const BLOCK: usize = 4;

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

/// Places of the grid.
const N_SHIFTS: usize = 8;

/// A correction, its noise and what it goes with.
#[derive(Clone, Debug)]
pub(super) struct Field {
    size: [usize; 2],
    /// Rows one after another.
    pixels: Vec<Cell>,
    /// Columns and rows of the pixels that have any scale, first and one past the last.
    shown: [[usize; 2]; 2],
    /// Degrees of freedom of the variances: how many differences each is known from.
    freedom: f32,
}

/// What [`shrink`] finds; rows one after another.
#[derive(Clone, Debug)]
pub(super) struct Shrunk {
    /// Of each pixel.
    pub correction: Vec<[f32; 3]>,
    /// Errors of pixels.
    pub pixels: Errors,
    /// Errors of means over 4x4 pixels.
    pub blocks: Errors,
    /// Errors of means over tiles.
    pub tiles: Errors,
}

/// The correction of a pixel, its variance, and what it is likely to go with, above 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub correction: [f32; 3],
    pub variance: [f32; 3],
    pub scale: [f32; 3],
}

impl Field {
    /// No correction but in the `samples`, pixels by their places and what is known of them. Their variances
    /// have so many degrees of freedom, the mean, 1 or more.
    pub fn new(
        size: [usize; 2],
        samples: impl Iterator<Item = (usize, Sample)>,
        freedom: f32,
    ) -> Field {
        let mut pixels = vec![Cell::default(); size[0] * size[1]];
        let mut shown = size.map(|side| [side, 0]);
        for (pixel, sample) in samples {
            pixels[pixel] = Cell::of(sample);
            for (shown, at) in shown.iter_mut().zip([pixel % size[0], pixel / size[0]]) {
                *shown = [shown[0].min(at), shown[1].max(at + 1)];
            }
        }
        Field {
            size,
            pixels,
            shown: shown.map(|[first, end]| [first.min(end), end]),
            freedom,
        }
    }
}

/// Estimates by block.
#[derive(Clone, Copy, Debug, Default)]
struct Estimate {
    /// The ratio.
    rho: [f32; 3],
    /// Mean square error of the block's sum, without bias (Stein 1981): it may be negative.
    error: [f32; 3],
    /// The part of it that is noise of the samples.
    noise: [f32; 3],
    /// Mean square of the block's sum without noise, its error without correction; likewise.
    signal: [f32; 3],
    /// How far the own part of the error may be off, all channels.
    doubt: f32,
}

/// See the top of this file. Tiles have a side of `tile` pixels, a power of two up to [`TOP`].
pub(super) fn shrink(field: &Field, tile: usize) -> Shrunk {
    let mut correction = vec![[0.0; 3]; field.pixels.len()];
    let mut of_shift = correction.clone();
    let mut scales = [1, BLOCK, tile].map(|side| Means::new(field, side));
    let mut levels = Vec::new();
    let mut rows = Vec::new();
    let is_empty = field.shown.iter().any(|[first, end]| first == end);
    for ix in 0..if is_empty { 0 } else { N_SHIFTS } {
        let grid = Grid::new(field.shown, shift(ix));
        blocks::sum_up(field, &grid, &mut levels);
        for ix in (0..levels.len()).rev() {
            let (own, above) = levels[ix..].split_at_mut(1);
            own[0].compare(above.first(), &mut rows);
            own[0].estimate(above.first(), &rows, 1 << ix, field.freedom);
        }
        let pixels = &levels[0].estimates;
        (correction.par_chunks_mut(field.size[0]))
            .zip(of_shift.par_chunks_mut(field.size[0]))
            .enumerate()
            .skip(field.shown[1][0])
            .take(field.shown[1][1] - field.shown[1][0])
            .for_each(|(y, (sums, corrections))| {
                let from = grid.at([field.shown[0][0], y]);
                let pixels = &pixels[from..];
                let columns = field.shown[0][0]..field.shown[0][1];
                let scales = &field.pixels[y * field.size[0]..][columns.clone()];
                let to = sums[columns.clone()].iter_mut();
                for (((sum, value), pixel), cell) in
                    to.zip(&mut corrections[columns]).zip(pixels).zip(scales)
                {
                    for c in 0..3 {
                        value[c] = pixel.rho[c] * cell.scale[c];
                        sum[c] += value[c] / N_SHIFTS as f32;
                    }
                }
            });
        for scale in &mut scales {
            scale.add(field, &grid, &of_shift, &levels);
        }
    }
    let [pixels, blocks, tiles] = scales.map(Means::finish);
    Shrunk {
        correction,
        pixels,
        blocks,
        tiles,
    }
}

/// Pixels left of and above the picture in one place of the grid: the points of a plane that an additive
/// sequence fills evenly.
fn shift(ix: usize) -> [usize; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    STEPS.map(|step| ((ix as f64 * step).fract() * TOP as f64) as usize)
}

impl Level {
    /// Estimates all blocks, of `side` pixels, from those of the level `above`. `rows` are what
    /// [`Level::compare`] made of this level, and `freedom` that of the variances.
    fn estimate(&mut self, above: Option<&Level>, rows: &[Detail], side: usize, freedom: f32) {
        let size = self.size;
        let (cells, details) = (&self.cells, &self.details);
        let caution = match side < BLOCK {
            true => FINE_CAUTION / freedom,
            false => CAUTION,
        };
        self.estimates
            .par_chunks_mut(size[0])
            .enumerate()
            .for_each_init(Vec::new, |around, (y, estimates)| {
                blocks::around_row(rows, size, y, around);
                let own = y * size[0]..(y + 1) * size[0];
                let of_row = cells[own.clone()].iter().zip(&details[own]);
                for (((x, estimate), (cell, own)), around) in
                    (0..).zip(estimates).zip(of_row).zip(&*around)
                {
                    if !cell.is_shown() {
                        *estimate = Estimate::default();
                        continue;
                    }
                    let parent = above.map(|above| above.around([x, y]));
                    let parent = parent.unwrap_or_default();
                    let mut evidence = Evidence::new(around, caution);
                    let mut local = around.as_bright_as(own);
                    if side >= FROM_ITSELF {
                        evidence = evidence.or_more(Evidence::new(own, OWN_CAUTION));
                        local.noise = own.noise;
                    }
                    *estimate = Estimate::new(cell, own, &local, &evidence, &parent);
                }
            });
    }

    /// The block of this level that the block `at` of the level below is a part of, and its estimate.
    fn around(&self, at: [usize; 2]) -> (Cell, Estimate) {
        let from = self.parent(at);
        (self.cells[from], self.estimates[from])
    }
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
    /// The estimate of a block from that of the larger one around it.
    fn new(
        cell: &Cell,
        detail: &Detail,
        local: &Local,
        evidence: &Evidence,
        (parent, above): &(Cell, Estimate),
    ) -> Estimate {
        let mut estimate = Estimate::default();
        let Evidence { gain, slope } = *evidence;
        for c in 0..3 {
            let share = match parent.scale[c] > 0.0 {
                true => cell.scale[c] / parent.scale[c],
                false => 0.0,
            };
            let (noise, signal) = (local.noise[c], local.signal[c]);
            let risk = (1.0 - gain).powi(2) * signal + (gain * gain + slope) * noise;
            estimate.rho[c] = above.rho[c] + gain * detail.difference[c];
            estimate.error[c] = share * share * above.error[c] + risk;
            estimate.noise[c] = share * share * above.noise[c] + gain * gain * noise;
            estimate.signal[c] = share * share * above.signal[c] + signal;
            // Channels share their paths.
            estimate.doubt += (1.0 - gain).powi(2) * std::f32::consts::SQRT_2 * noise;
        }
        estimate
    }
}
