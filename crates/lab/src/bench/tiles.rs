//! Means over tiles of the truth, of one picture and of those of many seeds.

use strandlight_reference::converge::{Converged, TILE};
use strandlight_scene::Picture;

/// Quantile of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// Standard errors beyond which a mean counts as wrong: 0.3 % of normal numbers.
const BEYOND: f64 = 3.0;

/// Means of the truth over tiles.
pub(super) struct Tiles {
    /// Mean of the channels and its variance; none where nothing is seen.
    means: Vec<Option<[f64; 2]>>,
    /// Sum over the pixels.
    sum: f64,
    /// Of that, over its square.
    relative_variance: f64,
}

impl Tiles {
    pub fn new(halves: &[(Picture, Vec<[f32; 3]>); 2]) -> Tiles {
        let pictures = halves
            .each_ref()
            .map(|(picture, _)| tile_sums(picture, |ix| picture.rgba[ix]));
        let variances = halves.each_ref().map(|(picture, variances)| {
            // Channels of a path go together.
            tile_sums(picture, |ix| {
                let [r, g, b] = variances[ix].map(f32::sqrt);
                let all = (r + g + b) * (r + g + b) / 3.0;
                [all, all, all, picture.rgba[ix][3]]
            })
        });
        let means = (0..pictures[0].len()).map(|ix| {
            let [a, b] = [0, 1].map(|half: usize| pictures[half][ix]);
            let [u, v] = [0, 1].map(|half: usize| variances[half][ix]);
            let n = a[2];
            (a[1] > 0.0).then(|| {
                [
                    0.5 * (a[0] + b[0]) / n,
                    0.25 / 3.0 * (u[0] + v[0]) / (n * n),
                ]
            })
        });
        let sum = |picture: &[[f64; 3]]| picture.iter().map(|tile| tile[0]).sum::<f64>();
        let all = 0.5 * (sum(&pictures[0]) + sum(&pictures[1]));
        let variance = 0.25 / 3.0 * (sum(&variances[0]) + sum(&variances[1]));
        Tiles {
            means: means.collect(),
            sum: all,
            relative_variance: variance / (all * all),
        }
    }

    /// Share of the tiles of `converged` whose error is as stated.
    pub fn inside(&self, converged: &Converged) -> f64 {
        let found = tile_sums(&converged.picture, |ix| converged.picture.rgba[ix]);
        let (mut inside, mut all) = (0, 0);
        for ((found, truth), error) in found.iter().zip(&self.means).zip(&converged.tile_error) {
            let Some([mean, variance]) = truth else {
                continue;
            };
            let [r, g, b] = error.map(f64::from);
            let stated = (r + g + b) / 3.0;
            let off = (found[0] / found[2] - mean).abs();
            inside += u32::from(off <= INTERVAL * (stated * stated + variance).sqrt());
            all += 1;
        }
        f64::from(inside) / f64::from(all.max(1))
    }

    pub fn mean_ratio(&self, picture: &Picture) -> f64 {
        let found = tile_sums(picture, |ix| picture.rgba[ix]);
        found.iter().map(|tile| tile[0]).sum::<f64>() / self.sum
    }
}

/// Of each tile: the sum of the mean of the channels, that of coverage, and the number of pixels.
fn tile_sums(picture: &Picture, of: impl Fn(usize) -> [f32; 4]) -> Vec<[f64; 3]> {
    let [width, height, tile] = [picture.width, picture.height, TILE].map(|n| n as usize);
    let across = width.div_ceil(tile);
    let mut sums = vec![[0.0; 3]; across * height.div_ceil(tile)];
    for ix in 0..width * height {
        let [r, g, b, a] = of(ix).map(f64::from);
        let sum = &mut sums[ix / width / tile * across + ix % width / tile];
        for (sum, value) in sum.iter_mut().zip([(r + g + b) / 3.0, a, 1.0]) {
            *sum += value;
        }
    }
    sums
}

/// Tiles of pictures of several seeds.
#[derive(Clone, Default)]
pub(super) struct TilesOfSeeds {
    n: f64,
    /// By tile, of its means: their sum and that of their squares.
    sums: Vec<[f64; 2]>,
    /// Of the picture's mean over the truth's, likewise.
    of_ratio: [f64; 2],
}

/// What the mean over several seeds says: is it right but for noise?
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeanOfSeeds {
    /// The picture's mean over the truth's.
    pub ratio: f64,
    /// Standard error of that, the truth's included; none of one seed.
    pub standard_error: Option<f64>,
    /// Share of the tiles that are more than three standard errors off, 0.3 % if they are right and normal; none of one
    /// seed.
    pub tiles_beyond: Option<f64>,
}

impl TilesOfSeeds {
    pub fn add(&mut self, picture: &Picture, truth: &Tiles) {
        let tiles = tile_sums(picture, |ix| picture.rgba[ix]);
        self.sums.resize(tiles.len(), [0.0; 2]);
        for ([sum, squares], tile) in self.sums.iter_mut().zip(tiles) {
            let mean = tile[0] / tile[2];
            *sum += mean;
            *squares += mean * mean;
        }
        let ratio = truth.mean_ratio(picture);
        self.of_ratio[0] += ratio;
        self.of_ratio[1] += ratio * ratio;
        self.n += 1.0;
    }

    pub fn mean(&self, truth: &Tiles) -> MeanOfSeeds {
        let [ratio, squared_error] = self.estimate(self.of_ratio);
        let is_known = self.n > 1.0;
        let (mut beyond, mut all) = (0, 0);
        for (sums, truth) in self.sums.iter().zip(&truth.means) {
            let Some([mean, variance]) = truth else {
                continue;
            };
            let [found, squared_error] = self.estimate(*sums);
            let limit = BEYOND * (squared_error + variance).sqrt();
            beyond += u32::from((found - mean).abs() > limit);
            all += 1;
        }
        let share = f64::from(beyond) / f64::from(all.max(1));
        let squared_error = squared_error + truth.relative_variance;
        MeanOfSeeds {
            ratio,
            standard_error: is_known.then(|| squared_error.sqrt()),
            tiles_beyond: is_known.then_some(share),
        }
    }

    /// Mean, and the square of its standard error, of numbers of these sums.
    fn estimate(&self, [sum, squares]: [f64; 2]) -> [f64; 2] {
        let mean = sum / self.n;
        let spread = (squares / self.n - mean * mean).max(0.0);
        [mean, spread / (self.n - 1.0).max(1.0)]
    }
}

#[cfg(test)]
mod tests {
    use strandlight_scattering::random::SplitMix64;

    use super::*;

    const SIDE: u32 = 4 * TILE;

    /// A picture of noise of this standard deviation about `mean`, and its variance.
    fn noisy(random: &mut SplitMix64, mean: f64, std_dev: f64) -> (Picture, Vec<[f32; 3]>) {
        let reach = std_dev * 3.0_f64.sqrt();
        let mut pixel = || {
            let value = (mean + random.uniform(-reach, reach)) as f32;
            [value, value, value, 1.0]
        };
        let n = (SIDE * SIDE) as usize;
        let picture = Picture {
            width: SIDE,
            height: SIDE,
            rgba: (0..n).map(|_| pixel()).collect(),
        };
        (picture, vec![[(std_dev * std_dev) as f32; 3]; n])
    }

    /// Means that are right lie within three standard errors, and those that are off by more do not.
    #[test]
    fn means_over_seeds_tell_bias_from_noise() {
        let mut random = SplitMix64(9);
        let halves = [0, 1].map(|_| noisy(&mut random, 1.0, 0.05));
        let truth = Tiles::new(&halves);
        for (mean, is_right) in [(1.0, true), (1.02, false)] {
            let mut tiles = TilesOfSeeds::default();
            let (first, _) = noisy(&mut random, mean, 0.3);
            tiles.add(&first, &truth);
            assert_eq!(tiles.mean(&truth).standard_error, None);
            for _ in 0..31 {
                let (picture, _) = noisy(&mut random, mean, 0.3);
                tiles.add(&picture, &truth);
            }
            let MeanOfSeeds {
                ratio,
                standard_error,
                tiles_beyond,
            } = tiles.mean(&truth);
            let error = standard_error.expect("of several seeds");
            // That of 32 pictures of so many pixels, and of two halves of the truth.
            let expected =
                (0.3_f64.powi(2) / 32.0 + 0.05_f64.powi(2) / 2.0).sqrt() / f64::from(SIDE);
            assert!((error / expected - 1.0).abs() < 0.3, "{error} {expected}");
            assert!((ratio - mean).abs() < 3.0 * error, "{ratio} {error}");
            assert_eq!((ratio - 1.0).abs() < 3.0 * error, is_right);
            let beyond = tiles_beyond.expect("of several seeds");
            assert!(
                if is_right { beyond < 0.1 } else { beyond > 0.5 },
                "{beyond}"
            );
        }
    }
}
