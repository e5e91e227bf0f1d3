//! Mean square errors that are to be expected of a shrunk correction, of means over blocks of one size.

use rayon::prelude::*;

use super::blocks::{Grid, Level};
use super::field::Field;

/// Places of the grid.
pub(super) const N_SHIFTS: usize = 8;

/// Mean square errors that are to be expected, of means over blocks of one size from the upper left corner
/// on.
#[derive(Clone, Debug)]
pub(crate) struct Errors {
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

/// Sums over the places of the grid, for blocks of one size.
pub(super) struct Means {
    side: usize,
    /// Blocks across and down.
    size: [usize; 2],
    blocks: Vec<Mean>,
    sum_of_zero: f64,
    square_of_doubt: f64,
}

/// Sums of a block.
#[derive(Clone, Copy, Default)]
struct Mean {
    /// Means of the correction.
    correction: [f32; 3],
    /// Their squares.
    square: [f32; 3],
    error: [f32; 3],
    /// Noise that was let in.
    noise: [f32; 3],
    /// Standard deviation of the error.
    spread: [f32; 3],
}

impl Means {
    pub fn new(field: &Field, side: usize) -> Means {
        let size = field.size.map(|n| n.div_ceil(side));
        Means {
            side,
            size,
            blocks: vec![Mean::default(); size[0] * size[1]],
            sum_of_zero: 0.0,
            square_of_doubt: 0.0,
        }
    }

    /// Adds one place of the grid, whose blocks of this size lie elsewhere: each has a part of theirs.
    pub fn add(&mut self, field: &Field, grid: &Grid, corrections: &[[f32; 3]], levels: &[Level]) {
        let levels = &levels[self.side.ilog2() as usize..];
        let Level {
            size, estimates, ..
        } = &levels[0];
        let (side, width) = (self.side, field.size[0]);
        let area = (side * side) as f32;
        let [columns, rows] = field.shown;
        let [first_column, first_row] = [columns[0] / side, rows[0] / side];
        let n_rows = rows[1].div_ceil(side) - first_row;
        self.blocks
            .par_chunks_mut(self.size[0])
            .enumerate()
            .skip(first_row)
            .take(n_rows)
            .for_each(|(row, blocks)| {
                let y = grid.within(1, row * side..((row + 1) * side).min(field.size[1]));
                let parts_down = grid.parts(1, &y, side);
                let end = columns[1].div_ceil(side);
                for (column, block) in (first_column..end).zip(&mut blocks[first_column..end]) {
                    let x = grid.within(0, column * side..((column + 1) * side).min(width));
                    let mut mean = [0.0; 3];
                    for y in y.clone() {
                        for correction in &corrections[y * width..][x.clone()] {
                            for c in 0..3 {
                                mean[c] += correction[c];
                            }
                        }
                    }
                    for c in 0..3 {
                        let mean = mean[c] / area;
                        block.correction[c] += mean;
                        block.square[c] += mean * mean;
                    }
                    let parts_across = grid.parts(0, &x, side);
                    for (down, n_down) in parts_down.into_iter().filter(|part| part.1 > 0) {
                        for (across, n_across) in parts_across.into_iter().filter(|part| part.1 > 0)
                        {
                            let estimate = &estimates[down * size[0] + across];
                            let share = (n_down * n_across) as f32 / (area * area * area);
                            for c in 0..3 {
                                block.error[c] += share * estimate.error[c];
                                block.noise[c] += share * estimate.noise[c];
                                block.spread[c] += share * estimate.spread[c].sqrt();
                            }
                        }
                    }
                }
            });
        let signals = estimates.iter().flat_map(|estimate| estimate.signal);
        let signal: f64 = signals.map(f64::from).sum();
        self.sum_of_zero += signal / f64::from(area * area) / N_SHIFTS as f64;
        for Level {
            estimates: of_level,
            ..
        } in levels
        {
            // Of a larger block its part has the share of its sum, and there are so many of them.
            let parts = estimates.len() as f64 / of_level.len() as f64;
            let doubts = of_level.iter().map(|estimate| f64::from(estimate.doubt));
            let squares: f64 = doubts.map(|doubt| doubt * doubt).sum();
            let scale = 1.0 / (parts * f64::from(area * area));
            self.square_of_doubt += squares * scale * scale / N_SHIFTS as f64;
        }
    }

    pub fn finish(self) -> Errors {
        let n = N_SHIFTS as f32;
        let mut total = 0.0;
        let errors = self.blocks.iter().map(|block| {
            std::array::from_fn(|c| {
                let mean = block.correction[c] / n;
                // The mean of several is less wrong than they are on average, by what they differ.
                let spread = (block.square[c] / n - mean * mean).max(0.0);
                let error = block.error[c] / n - spread;
                total += f64::from(error);
                // Of one block neither is known well: the noise that was let in, at least.
                likely(error, block.spread[c] / n).max(0.5 * block.noise[c] / n)
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

/// About the mean of what a square may be of which `value` was found, with this standard deviation of errors: it is
/// not negative, so more where the deviation is larger. Of a `value` of 0 that is 0.8 of the deviation, the mean of
/// half a normal distribution.
fn likely(value: f32, std_dev: f32) -> f32 {
    0.5 * (value + value.hypot(1.6 * std_dev))
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
