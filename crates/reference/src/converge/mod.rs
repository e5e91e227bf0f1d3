//! From a fast picture to the truth: path tracing corrects a picture only as far as it is surer than
//! the picture.
//!
//! Pixels that show anything take camera samples of an [`Integrator`], more where they are noisier (see
//! `allocation`); what counts is by how much they differ from the fast picture. Their mean would be the truth with all its noise. Instead the
//! difference is taken apart by scale (in `shrink`), from the whole picture down to single pixels, and
//! each part is believed as far as it exceeds its own noise. So a few samples mend what is wrong over
//! large areas, noise never adds more than it mends, and with more samples the picture goes to the
//! truth, which the samples' means are without bias.
//!
//! The same numbers say how wrong the picture still is: see [`Converged`].

mod allocation;
mod shrink;
#[cfg(all(test, feature = "files"))]
mod tests;

use std::time::Duration;

use rayon::prelude::*;
use strandlight_formats::Scattering;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::camera::view_uniform;
use strandlight_scene::{Picture, PreparedScene};

use crate::backdrop::Backdrop;
use crate::camera::{MAX_TRUTH_SAMPLES, N_IN_SQUARE, camera_ray, square_by_square};
use crate::integrator::Integrator;
use allocation::{Allocation, Noise};
use shrink::{Cell, Field, Shrunk, shrink};

/// Side in pixels of the tiles whose error is told.
pub const TILE: u32 = 16;

/// A fast picture, and how samples of the truth differ from it.
#[derive(Clone, Debug)]
pub struct Convergence {
    /// Radiance times coverage, and coverage, over nothing.
    fast: Picture,
    /// Radiance behind each pixel; none where the picture is transparent.
    behind: Vec<Option<[f32; 3]>>,
    /// Pixels that take samples: those that show anything, and their neighbours; square by square.
    pixels: Vec<u32>,
    /// What differences of each of them are likely to go with.
    scales: Vec<[f32; 3]>,
    /// Of each of them.
    sums: Vec<Sums>,
    /// Samples that each of them takes.
    allocation: Allocation,
    is_even: bool,
    /// What of the hair's light the picture has.
    scattering: Scattering,
    /// Mean over them.
    n_samples: u32,
    seed: u64,
}

/// Samples of the next step, at most this share of those there are.
const GROWTH: f64 = 0.5;

/// How many samples to take after `samples`, where each takes `of_one` seconds and the picture of a step
/// `of_picture` seconds: as many as take as long as its picture, or `longest`, and not too many at once.
pub fn next_step(samples: u32, [of_one, of_picture]: [f64; 2], longest: Duration) -> u32 {
    let by_time = longest.as_secs_f64().max(of_picture) / of_one.max(1e-9);
    let by_growth = GROWTH * f64::from(samples);
    (by_time.min(by_growth) as u32).clamp(1, MAX_TRUTH_SAMPLES.saturating_sub(samples).max(1))
}

/// Sequences of samples of a pixel, independent of each other: what their means differ tells the noise,
/// which samples of one sequence, spread evenly as they are, do not.
const N_SEQUENCES: u32 = 4;

/// Sums over the samples of a pixel, by sequence: sample less fast picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    n_samples: u32,
    of: [[f64; 3]; N_SEQUENCES as usize],
}

/// The picture so far, and how far it may be from the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Converged {
    /// Over the scene's background.
    pub picture: Picture,
    /// Standard error of each pixel, rows one after another.
    pub error: Vec<[f32; 3]>,
    /// Standard errors of means over tiles of [`TILE`] pixels from the upper left corner on, rows of
    /// tiles one after another.
    pub tile_error: Vec<[f32; 3]>,
    /// Samples of each pixel, the mean.
    pub samples: u32,
    /// Relative RMSE of means over 4x4 pixels that is to be expected, no less than what can be told from noise. Infinite before
    /// there are two samples.
    pub relative_error: f64,
    /// What it was for the fast picture; [`None`] where noise hides it, and before there are two samples.
    pub relative_error_of_fast: Option<f64>,
}

impl Convergence {
    /// From `fast`, radiance times coverage over nothing, to what `scene` has over its background, both
    /// with the scattering that `scene` has, with the random numbers of `seed`.
    pub fn new(fast: Picture, scene: &PreparedScene, seed: u64) -> Self {
        let [width, height] = [fast.width as usize, fast.height as usize];
        // Samples meet what lists do not have, along edges.
        let shows = |x: usize, y: usize| {
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            rows.flat_map(|y| {
                let columns = x.saturating_sub(1)..(x + 2).min(width);
                columns.map(move |x| y * width + x)
            })
            .any(|ix| fast.rgba[ix][3] > 0.0)
        };
        let pixels: Vec<u32> = square_by_square([fast.width, fast.height])
            .filter(|ix| shows(ix % width, ix / width))
            .map(|ix| ix as u32)
            .collect();
        Convergence {
            scales: scales(&fast, &pixels),
            sums: vec![Sums::default(); pixels.len()],
            allocation: Allocation::even(pixels.len()),
            is_even: false,
            scattering: scene.scattering(),
            pixels,
            behind: Backdrop::of(scene, [fast.width, fast.height]).behind,
            fast,
            n_samples: 0,
            seed,
        }
    }

    /// The same with as many samples of each pixel, whatever their noise.
    pub fn evenly(self) -> Self {
        Convergence {
            is_even: true,
            ..self
        }
    }

    /// Samples of each pixel so far, the mean of those that show anything.
    pub fn samples(&self) -> u32 {
        self.n_samples
    }

    /// Adds `n_samples` samples, on average, of what `scene`'s camera sees to each pixel that shows anything.
    /// The samples of two calls are those of one, whatever the number of threads.
    ///
    /// # Panics
    /// If there would be more than [`MAX_TRUTH_SAMPLES`].
    pub fn trace(&mut self, scene: &PreparedScene, integrator: &dyn Integrator, n_samples: u32) {
        // Never none: it is always wanted.
        let _ = self.trace_while(scene, integrator, n_samples, &|| true);
    }

    /// [`Convergence::trace`] as long as it `is_wanted`, which any thread asks before each pixel.
    /// Answers [`None`] where it was no longer: then some pixels have more samples than others, and
    /// nothing can be done with them.
    ///
    /// # Panics
    /// As [`Convergence::trace`].
    pub fn trace_while(
        &mut self,
        scene: &PreparedScene,
        integrator: &dyn Integrator,
        n_samples: u32,
        is_wanted: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        assert!(
            n_samples <= MAX_TRUTH_SAMPLES - self.n_samples,
            "too many samples"
        );
        let end = self.n_samples + n_samples;
        while self.n_samples < end {
            let next = Allocation::next(self.n_samples);
            self.trace_until(scene, integrator, next.min(end), is_wanted)?;
            if self.n_samples == next && !self.is_even {
                self.allocate();
            }
        }
        Some(())
    }

    /// Samples as they are allocated now, until pixels have `n_samples` on average.
    fn trace_until(
        &mut self,
        scene: &PreparedScene,
        integrator: &dyn Integrator,
        n_samples: u32,
        is_wanted: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let width = self.fast.width as usize;
        let size = [self.fast.width, self.fast.height];
        let view = view_uniform(&scene.camera, &scene.strands, size, 1.0);
        let (fast, behind, seed) = (&self.fast.rgba, &self.behind, self.seed);
        let scattering = self.scattering;
        let allocation = &self.allocation;
        self.pixels
            .par_chunks(N_IN_SQUARE)
            .zip(self.sums.par_chunks_mut(N_IN_SQUARE))
            .enumerate()
            .try_for_each(|(chunk, (pixels, sums))| {
                for ((&pixel, sums), number) in pixels.iter().zip(sums).zip(N_IN_SQUARE * chunk..) {
                    if !is_wanted() {
                        return None;
                    }
                    let ix = pixel as usize;
                    let at = [ix % width, ix / width].map(|x| x as f64);
                    let behind = behind[ix].unwrap_or_default().map(f64::from);
                    let [r, g, b, alpha] = fast[ix].map(f64::from);
                    let shown: [f64; 3] =
                        std::array::from_fn(|c| [r, g, b][c] + (1.0 - alpha) * behind[c]);
                    let mut keys = keys_of(seed, pixel);
                    let keys: [u64; N_SEQUENCES as usize] =
                        std::array::from_fn(|_| keys.next_u64());
                    let until = allocation.samples(number, n_samples);
                    for sample in sums.n_samples..until {
                        let sequence = (sample % N_SEQUENCES) as usize;
                        let (key, sample) = (keys[sequence], sample / N_SEQUENCES);
                        let sum = &mut sums.of[sequence];
                        let mut random = SplitMix64::of_item(key, u64::from(sample));
                        let ray = camera_ray(&view, at, key, sample);
                        let seen = integrator.sample(&ray, &mut random);
                        let hair = seen.of(scattering);
                        let is_open = !seen.is_covered && !seen.is_matte;
                        for c in 0..3 {
                            let open = if is_open { behind[c] } else { 0.0 };
                            sum[c] += hair[c] + seen.matte[c] + open - shown[c];
                        }
                    }
                    sums.n_samples = until;
                }
                Some(())
            })?;
        self.n_samples = n_samples;
        Some(())
    }

    /// Shares out the samples to come by the noise of those there are.
    fn allocate(&mut self) {
        let sum = |values: [f32; 3]| values.map(f64::from).iter().sum::<f64>();
        let of_pixels = self.pixels.iter().zip(&self.scales).zip(&self.sums);
        let noise = of_pixels.map(|((&pixel, &scale), sums)| {
            let (_, variance) = self.mean_and_variance(pixel, sums);
            Noise {
                pixel,
                scale: sum(scale),
                variance: f64::from(sums.n_samples) * sum(variance),
            }
        });
        let noise: Vec<Noise> = noise.collect();
        let seed = self.seed;
        let dither = |pixel: &u32| SplitMix64(!keys_of(seed, *pixel).next_u64()).uniform(0.0, 1.0);
        let dithers = self.pixels.iter().map(dither);
        self.allocation
            .decide(self.n_samples, &noise, self.fast.width as usize, dithers);
    }

    /// The mean of the samples, noise and all, and its variance in each pixel: pictures without any
    /// shrinking.
    pub fn plain(&self) -> (Picture, Vec<[f32; 3]>) {
        let mut picture = self.over_background();
        let mut variances = vec![[0.0; 3]; picture.rgba.len()];
        for (&pixel, sums) in self.pixels.iter().zip(&self.sums) {
            let (mean, variance) = self.mean_and_variance(pixel, sums);
            let rgba = &mut picture.rgba[pixel as usize];
            for (value, mean) in rgba.iter_mut().zip(mean) {
                *value += mean;
            }
            variances[pixel as usize] = variance;
        }
        (picture, variances)
    }

    /// The picture as far as the samples so far tell.
    pub fn converged(&self) -> Converged {
        let size = [self.fast.width as usize, self.fast.height as usize];
        if self.n_samples < 2 {
            // No sample says how noisy it is.
            let tiles = size.map(|side| side.div_ceil(TILE as usize));
            return Converged {
                picture: self.over_background(),
                error: vec![[f32::INFINITY; 3]; size[0] * size[1]],
                tile_error: vec![[f32::INFINITY; 3]; tiles[0] * tiles[1]],
                samples: self.n_samples,
                relative_error: f64::INFINITY,
                relative_error_of_fast: None,
            };
        }
        let known = self.pixels.iter().zip(&self.sums).zip(&self.scales);
        let known = known.map(|((&pixel, sums), &scale)| {
            let (correction, variance) = self.mean_and_variance(pixel, sums);
            let cell = Cell {
                correction,
                variance,
                scale,
            };
            (pixel as usize, cell)
        });
        let field = Field::new(size, known, self.freedom());
        let Shrunk {
            correction,
            pixels,
            blocks,
            tiles,
        } = shrink(&field, TILE as usize);
        let mut picture = self.over_background();
        for (rgba, correction) in picture.rgba.iter_mut().zip(&correction) {
            for (value, correction) in rgba.iter_mut().zip(correction) {
                *value += *correction;
            }
        }
        // Where nothing is seen but the background errors would look small.
        let mut shown = Picture {
            rgba: vec![[0.0; 4]; picture.rgba.len()],
            ..picture
        };
        for &pixel in &self.pixels {
            shown.rgba[pixel as usize] = picture.rgba[pixel as usize];
        }
        let radiance = block_norm(&shown);
        let deviation = |variance: &[f32; 3]| variance.map(f32::sqrt);
        let tiles = tiles.within(size);
        Converged {
            error: pixels.of.iter().map(deviation).collect(),
            tile_error: tiles.of.iter().map(deviation).collect(),
            samples: self.n_samples,
            relative_error: (blocks.sum.max(blocks.doubt) / radiance).sqrt(),
            relative_error_of_fast: (blocks.sum_of_zero > 0.0)
                .then(|| (blocks.sum_of_zero / radiance).sqrt()),
            picture,
        }
    }

    /// Degrees of freedom of the pixels' variances, those of most of the noise.
    fn freedom(&self) -> f32 {
        let [mut sum, mut of] = [0.0; 2];
        for (&pixel, sums) in self.pixels.iter().zip(&self.sums) {
            let (_, variance) = self.mean_and_variance(pixel, sums);
            let variance: f32 = variance.iter().sum();
            let freedom = sums.n_samples.clamp(2, N_SEQUENCES) - 1;
            sum += f64::from(variance) * f64::from(freedom);
            of += f64::from(variance);
        }
        match of > 0.0 {
            true => (sum / of) as f32,
            false => 1.0,
        }
    }

    /// The mean of the differences of a pixel, and the variance of that mean. Samples that all miss the hair differ in
    /// nothing, which is no certainty: then the variance is that of the fast picture's coverage. Over proxies, whose coverage
    /// is in it as well, that says nothing.
    fn mean_and_variance(&self, pixel: u32, sums: &Sums) -> ([f32; 3], [f32; 3]) {
        /// Share of the square of the mean that is rounding.
        const ROUNDING: f32 = 1e-9;
        let (mean, variance) = sums.mean_and_variance();
        let mut channels = mean.iter().zip(&variance);
        if !channels.all(|(mean, variance)| *variance <= ROUNDING * mean * mean) {
            return (mean, variance);
        }
        let [r, g, b, alpha] = self.fast.rgba[pixel as usize];
        let behind = self.behind[pixel as usize].unwrap_or_default();
        let odds = (1.0 - alpha).max(0.0) / alpha.max(f32::MIN_POSITIVE);
        let n = sums.n_samples.max(1) as f32;
        let of_channel = |c: usize| {
            let between = [r, g, b][c] - alpha * behind[c];
            odds * between * between / n
        };
        (mean, [0, 1, 2].map(of_channel))
    }

    /// The fast picture over what is behind it.
    fn over_background(&self) -> Picture {
        let over = |(&[r, g, b, a], behind): (&[f32; 4], &Option<[f32; 3]>)| match behind {
            None => [r, g, b, a],
            Some(behind) => {
                let [x, y, z] = behind.map(|behind| (1.0 - a) * behind);
                [r + x, g + y, b + z, 1.0]
            }
        };
        Picture {
            rgba: self.fast.rgba.iter().zip(&self.behind).map(over).collect(),
            ..self.fast
        }
    }
}

impl Sums {
    /// The mean of the differences, and the variance of that mean.
    fn mean_and_variance(&self) -> ([f32; 3], [f32; 3]) {
        let n = f64::from(self.n_samples.max(1));
        let mean: [f64; 3] =
            std::array::from_fn(|c| self.of.iter().map(|sum| sum[c]).sum::<f64>() / n);
        let mut variance = [0.0; 3];
        for (ix, sum) in (0..).zip(&self.of) {
            // The first sequences have one more where they do not share evenly.
            let of_sequence = f64::from((self.n_samples + N_SEQUENCES - 1 - ix) / N_SEQUENCES);
            for c in 0..3 {
                variance[c] += (sum[c] - of_sequence * mean[c]).powi(2) / (n * n);
            }
        }
        let n_sequences = f64::from(self.n_samples.clamp(2, N_SEQUENCES));
        let unbiased = n_sequences / (n_sequences - 1.0);
        (
            mean.map(|x| x as f32),
            variance.map(|x| (unbiased * x) as f32),
        )
    }
}

/// What differences of `pixels` are likely to go with: the `fast` picture, and where it is black some of
/// what is elsewhere.
fn scales(fast: &Picture, pixels: &[u32]) -> Vec<[f32; 3]> {
    /// Share of the mean radiance of the hair.
    const FLOOR: f64 = 0.05;
    /// Coverage that pixels have at least.
    const LEAST: f64 = 1.0 / 64.0;
    let mut mean = [0.0; 3];
    let mut coverage = 0.0;
    for rgba in &fast.rgba {
        for (mean, value) in mean.iter_mut().zip(rgba) {
            *mean += f64::from(*value);
        }
        coverage += f64::from(rgba[3]);
    }
    let overall = mean.iter().sum::<f64>() / 3.0;
    let floor = mean.map(|x| FLOOR * (x + 0.1 * overall) / f64::max(coverage, 1.0));
    let scale = |&pixel: &u32| {
        let rgba = fast.rgba[pixel as usize].map(f64::from);
        let covered = rgba[3].max(LEAST);
        std::array::from_fn(|c| (rgba[c].max(0.0) + floor[c] * covered + 1e-12) as f32)
    };
    pixels.iter().map(scale).collect()
}

/// Keys of the sequences of a pixel.
fn keys_of(seed: u64, pixel: u32) -> SplitMix64 {
    SplitMix64::of_item(seed, u64::from(pixel))
}

/// Sum of the squares of means over 4x4 pixels, channels together.
fn block_norm(picture: &Picture) -> f64 {
    let [width, height] = [picture.width as usize, picture.height as usize];
    let blocks = [width.div_ceil(4), height.div_ceil(4)];
    let mut sums = vec![[0.0_f64; 3]; blocks[0] * blocks[1]];
    for (ix, rgba) in picture.rgba.iter().enumerate() {
        let sum = &mut sums[ix / width / 4 * blocks[0] + ix % width / 4];
        for (sum, value) in sum.iter_mut().zip(rgba) {
            *sum += f64::from(*value);
        }
    }
    let squares = sums.iter().flatten().map(|sum| sum * sum).sum::<f64>();
    (squares / 256.0).max(f64::MIN_POSITIVE)
}
