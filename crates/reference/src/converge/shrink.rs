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

use rayon::prelude::*;

/// Levels of blocks below the whole picture: sides of 1, 2, 4, ... 64 pixels.
const N_LEVELS: usize = 7;

/// Side of the largest of them.
const TOP: usize = 1 << (N_LEVELS - 1);

/// Side of the blocks that errors are told of.
const BLOCK: usize = 4;

/// Blocks to each side over which noise and signal are told apart.
const REACH: usize = 7;

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
    pixels: Vec<Cell>,
    /// Degrees of freedom of the variances: how many differences each is known from.
    freedom: f32,
}

/// Sums over a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    correction: [f32; 3],
    variance: [f32; 3],
    scale: [f32; 3],
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

/// Mean square errors that are to be expected, of means over blocks of one size from the upper left corner
/// on.
#[derive(Clone, Debug)]
pub(super) struct Errors {
    /// Side of a block, pixels.
    side: usize,
    /// Of each block.
    pub of: Vec<[f32; 3]>,
    /// Sum over blocks and channels, and how far that may be off.
    pub sum: f64,
    /// See `sum`.
    pub doubt: f64,
    /// The same without any correction.
    pub sum_of_zero: f64,
}

impl Field {
    /// No correction; `scales` of pixels that get none are 0. Variances will have so many degrees of freedom,
    /// the mean, 1 or more.
    pub fn new(size: [usize; 2], scales: Vec<[f32; 3]>, freedom: f32) -> Field {
        let cell = |scale| Cell {
            scale,
            ..Cell::default()
        };
        Field {
            size,
            pixels: scales.into_iter().map(cell).collect(),
            freedom,
        }
    }

    /// The correction of a pixel and its variance.
    pub fn set(&mut self, pixel: usize, correction: [f32; 3], variance: [f32; 3]) {
        let cell = &mut self.pixels[pixel];
        (cell.correction, cell.variance) = (correction, variance);
    }
}

/// Blocks of a size.
struct Level {
    size: [usize; 2],
    cells: Vec<Cell>,
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

/// What a block differs from the larger one by.
#[derive(Clone, Copy, Debug, Default)]
struct Detail {
    /// Of the ratio.
    difference: [f32; 3],
    /// Square of that of the block's sum, and its noise.
    measured: [f32; 3],
    noise: [f32; 3],
    /// Square of the scale; 0 where nothing is shown.
    weight: [f32; 3],
    /// 1, or 0 where nothing is shown.
    count: f32,
}

impl Detail {
    fn add(&mut self, other: &Detail) {
        for c in 0..3 {
            self.measured[c] += other.measured[c];
            self.noise[c] += other.noise[c];
            self.weight[c] += other.weight[c];
        }
        self.count += other.count;
    }

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

/// What is expected of a block.
#[derive(Clone, Copy, Debug, Default)]
struct Local {
    /// Mean square of its difference.
    signal: [f32; 3],
    /// That of the noise.
    noise: [f32; 3],
}

/// See the top of this file. Tiles have a side of `tile` pixels, a power of two up to [`TOP`].
pub(super) fn shrink(field: &Field, tile: usize) -> Shrunk {
    let width = field.size[0];
    let mut correction = vec![[0.0; 3]; field.pixels.len()];
    let mut scales = [1, BLOCK, tile].map(|side| Means::new(field.size, side));
    for ix in 0..N_SHIFTS {
        let shift = shift(ix);
        let levels = pass(field, shift);
        let (_, pixels) = &levels[0];
        let across = width + shift[0];
        let corrections: Vec<[f32; 3]> = (0..field.pixels.len())
            .into_par_iter()
            .map(|at| {
                let from = (at / width + shift[1]) * across + at % width + shift[0];
                std::array::from_fn(|c| pixels[from].rho[c] * field.pixels[at].scale[c])
            })
            .collect();
        for (sum, value) in correction.iter_mut().zip(&corrections) {
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += value / N_SHIFTS as f32;
            }
        }
        for scale in &mut scales {
            scale.add(field.size, shift, &corrections, &levels);
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

/// Sums over the places of the grid, for blocks of one size.
struct Means {
    side: usize,
    /// Blocks across and down.
    size: [usize; 2],
    /// By block: the means of the correction and their squares, errors, and noise let in.
    blocks: Vec<[[f32; 3]; 4]>,
    sum_of_zero: f64,
    square_of_doubt: f64,
}

impl Means {
    fn new(size: [usize; 2], side: usize) -> Means {
        let size = size.map(|n| n.div_ceil(side));
        Means {
            side,
            size,
            blocks: vec![[[0.0; 3]; 4]; size[0] * size[1]],
            sum_of_zero: 0.0,
            square_of_doubt: 0.0,
        }
    }

    /// One place of the grid, whose blocks of this size lie elsewhere: each pixel has a part of theirs.
    fn add(
        &mut self,
        picture: [usize; 2],
        shift: [usize; 2],
        corrections: &[[f32; 3]],
        levels: &[([usize; 2], Vec<Estimate>)],
    ) {
        let (size, estimates) = &levels[self.side.ilog2() as usize];
        let area = (self.side * self.side) as f32;
        let across = self.size[0];
        let (side, width) = (self.side, picture[0]);
        self.blocks
            .par_iter_mut()
            .enumerate()
            .for_each(|(ix, [sum, squares, errors, noise])| {
                let [x, y] = [ix % across * side, ix / across * side];
                let mut mean = [0.0; 3];
                for row in y..(y + side).min(picture[1]) {
                    for column in x..(x + side).min(width) {
                        let at = (row + shift[1]) / side * size[0] + (column + shift[0]) / side;
                        let estimate = &estimates[at];
                        for c in 0..3 {
                            mean[c] += corrections[row * width + column][c] / area;
                            errors[c] += estimate.error[c] / (area * area * area);
                            noise[c] += estimate.noise[c] / (area * area * area);
                        }
                    }
                }
                for c in 0..3 {
                    sum[c] += mean[c];
                    squares[c] += mean[c] * mean[c];
                }
            });
        let signals = estimates.iter().flat_map(|estimate| estimate.signal);
        let signal: f64 = signals.map(f64::from).sum();
        self.sum_of_zero += signal / f64::from(area * area) / N_SHIFTS as f64;
        for (_, estimates) in &levels[self.side.ilog2() as usize..] {
            // Of a larger block its part has the share of its sum, and there are so many of them.
            let parts = (size[0] * size[1]) as f64 / estimates.len() as f64;
            let doubts = estimates.iter().map(|estimate| f64::from(estimate.doubt));
            let squares: f64 = doubts.map(|doubt| doubt * doubt).sum();
            let scale = 1.0 / (parts * f64::from(area * area));
            self.square_of_doubt += squares * scale * scale / N_SHIFTS as f64;
        }
    }

    fn finish(self) -> Errors {
        let n = N_SHIFTS as f32;
        let mut total = 0.0;
        let errors = self.blocks.iter().map(|[sum, squares, errors, noise]| {
            std::array::from_fn(|c| {
                let mean = sum[c] / n;
                // The mean of several is less wrong than they are on average, by what they differ.
                let spread = (squares[c] / n - mean * mean).max(0.0);
                total += f64::from(errors[c] / n - spread);
                // Of one block neither is known well: the noise that was let in, at least.
                (errors[c] / n - spread).max(0.5 * noise[c] / n)
            })
        });
        Errors {
            side: self.side,
            of: errors.collect(),
            sum: total,
            doubt: self.square_of_doubt.sqrt(),
            sum_of_zero: self.sum_of_zero,
        }
    }
}

impl Errors {
    /// Errors of the means over the pixels that there are of blocks at the right and the lower edge of a
    /// picture of `size`.
    pub fn within(mut self, size: [usize; 2]) -> Errors {
        let across = size[0].div_ceil(self.side);
        for (ix, of) in self.of.iter_mut().enumerate() {
            let n = |at: usize, size: usize| (size - at * self.side).min(self.side);
            let pixels = n(ix % across, size[0]) * n(ix / across, size[1]);
            let share = (self.side * self.side) as f32 / pixels as f32;
            *of = of.map(|x| x * share * share);
        }
        self
    }
}

/// Pixels left of and above the picture in one place of the grid: the points of a plane that an additive
/// sequence fills evenly.
fn shift(ix: usize) -> [usize; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    STEPS.map(|step| ((ix as f64 * step).fract() * TOP as f64) as usize)
}

/// One place of the grid: number of blocks and estimates by level, from pixels to the whole picture.
fn pass(field: &Field, shift: [usize; 2]) -> Vec<([usize; 2], Vec<Estimate>)> {
    let levels = levels(field, shift);
    let mut found: Vec<([usize; 2], Vec<Estimate>)> = Vec::with_capacity(levels.len());
    for (ix, level) in levels.iter().enumerate().rev() {
        let above = levels.get(ix + 1);
        let details = details(level, above);
        let around = around(&details, level.size);
        let above = above.zip(found.last());
        let estimates = (0..level.cells.len()).into_par_iter().map(|at| {
            let parent = above.map(|(level_above, (size, estimates))| {
                let from = parent_of(at, level.size, *size);
                (level_above.cells[from], estimates[from])
            });
            let parent = parent.unwrap_or_default();
            let own = &details[at];
            let side = 1 << ix;
            let caution = match side < BLOCK {
                true => FINE_CAUTION / field.freedom,
                false => CAUTION,
            };
            let mut evidence = Evidence::new(&around[at], caution);
            let mut local = around[at].as_bright_as(own);
            if side >= FROM_ITSELF {
                evidence = evidence.or_more(Evidence::new(own, OWN_CAUTION));
                local.noise = own.noise;
            }
            estimate(&level.cells[at], own, &local, &evidence, &parent)
        });
        let estimates = estimates.collect();
        found.push((level.size, estimates));
    }
    found.reverse();
    found
}

/// Sums over blocks of all sizes, from pixels to the whole picture.
fn levels(field: &Field, [x, y]: [usize; 2]) -> Vec<Level> {
    let [width, height] = field.size;
    let size = [width + x, height + y];
    let mut cells = vec![Cell::default(); size[0] * size[1]];
    for row in 0..height {
        let to = (row + y) * size[0] + x;
        cells[to..to + width].copy_from_slice(&field.pixels[row * width..(row + 1) * width]);
    }
    let mut levels = vec![Level { size, cells }];
    while levels.len() <= N_LEVELS {
        let below = &levels[levels.len() - 1];
        let size = match levels.len() {
            N_LEVELS => [1, 1],
            _ => below.size.map(|side| side.div_ceil(2)),
        };
        let mut cells = vec![Cell::default(); size[0] * size[1]];
        for (ix, cell) in below.cells.iter().enumerate() {
            let sum = &mut cells[parent_of(ix, below.size, size)];
            for c in 0..3 {
                sum.correction[c] += cell.correction[c];
                sum.variance[c] += cell.variance[c];
                sum.scale[c] += cell.scale[c];
            }
        }
        levels.push(Level { size, cells });
    }
    levels
}

fn parent_of(ix: usize, size: [usize; 2], above: [usize; 2]) -> usize {
    if above == [1, 1] {
        return 0;
    }
    let [x, y] = [ix % size[0], ix / size[0]];
    y / 2 * above[0] + x / 2
}

fn ratio(cell: &Cell, c: usize) -> f32 {
    match cell.scale[c] > 0.0 {
        true => cell.correction[c] / cell.scale[c],
        false => 0.0,
    }
}

/// What each block of `level` differs from that of the level `above` by.
fn details(level: &Level, above: Option<&Level>) -> Vec<Detail> {
    let of = |(ix, cell): (usize, &Cell)| {
        if cell.scale[0] <= 0.0 {
            return Detail::default();
        }
        let mut detail = Detail {
            count: 1.0,
            ..Detail::default()
        };
        let parent = above.map(|above| &above.cells[parent_of(ix, level.size, above.size)]);
        for c in 0..3 {
            let (difference, variance) = match parent {
                None => (ratio(cell, c), cell.variance[c]),
                Some(parent) => {
                    // The block is a part of the larger one.
                    let share = cell.scale[c] / parent.scale[c];
                    let rest = (parent.variance[c] - cell.variance[c]).max(0.0);
                    let noise = (1.0 - share).powi(2) * cell.variance[c] + share * share * rest;
                    (ratio(cell, c) - ratio(parent, c), noise)
                }
            };
            detail.difference[c] = difference;
            detail.measured[c] = (difference * cell.scale[c]).powi(2);
            detail.noise[c] = variance;
            detail.weight[c] = cell.scale[c] * cell.scale[c];
        }
        detail
    };
    level.cells.par_iter().enumerate().map(of).collect()
}

/// Sums over the blocks around each, along rows and then along columns.
fn around(details: &[Detail], [width, height]: [usize; 2]) -> Vec<Detail> {
    let mut rows = vec![Detail::default(); details.len()];
    rows.par_chunks_mut(width)
        .zip(details.par_chunks(width))
        .for_each(|(sums, details)| {
            for (x, sum) in sums.iter_mut().enumerate() {
                for detail in &details[x.saturating_sub(REACH)..(x + REACH + 1).min(width)] {
                    sum.add(detail);
                }
            }
        });
    let mut sums = vec![Detail::default(); details.len()];
    sums.par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, sums)| {
            for from in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
                for (sum, row) in sums.iter_mut().zip(&rows[from * width..]) {
                    sum.add(row);
                }
            }
        });
    sums
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

/// The estimate of a block from that of the larger one around it.
fn estimate(
    cell: &Cell,
    detail: &Detail,
    local: &Local,
    evidence: &Evidence,
    (parent, above): &(Cell, Estimate),
) -> Estimate {
    let mut estimate = Estimate::default();
    if cell.scale[0] <= 0.0 {
        return estimate;
    }
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
