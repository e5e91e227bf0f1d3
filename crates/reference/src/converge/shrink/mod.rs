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
//! than noise may be there is none. A block of 8 pixels a side and more whose own difference is
//! far above noise, as along a rim of light that the picture lacks, is believed by itself. The whole picture
//! differs from 0, the picture as it was. All is averaged over several places of the grid of blocks, so that
//! its lines do not show.
//!
//! The error that is left is told by Stein's estimate (1981), without knowing the truth, less what the
//! places of the grid differ. Where noise hides the correction of a block, that estimate is as often below 0 as above:
//! what is stated of the block is about the mean of what its error may be then.

mod blocks;
mod errors;
mod estimate;
mod field;

use rayon::prelude::*;
use strandlight_scattering::random::R2;

use blocks::{Grid, TOP};
use errors::{Errors, Means, N_SHIFTS};
use estimate::BLOCK;
pub(super) use field::{Cell, Field};

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
    R2.map(|step| ((ix as f64 * step).fract() * TOP as f64) as usize)
}
