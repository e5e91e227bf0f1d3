//! Sums of what camera rays see.

use std::ops::Add;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use strandlight_scene::PreparedScene;
use strandlight_scene::camera::view_uniform;

use super::camera::{MAX_TRUTH_SAMPLES, N_IN_SQUARE, camera_ray, square_by_square};
use super::compare::Layer;
use super::integrator::{Integrator, Layers};
use super::spans::{Span, push, spans_of};
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::background::background_at;

/// Sums over a pixel's samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pixel {
    pub covered: f64,
    pub single: [f64; 3],
    pub global: [f64; 3],
    pub local: [f64; 3],
    /// Samples that meet a proxy, and its radiance.
    pub matte_covered: f64,
    pub matte: [f64; 3],
    /// Of the composited total.
    pub squares: [f64; 3],
}

/// The camera's picture as sums of consecutive samples, a few for each pixel: see the order of
/// addition in `spans`.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    pub(super) size: [u32; 2],
    /// Number of the first sample.
    pub(super) first: u32,
    pub(super) n_samples: u32,
    /// Samples of each sum.
    pub(super) spans: Vec<Span>,
    /// The sums of each pixel, as many as there are spans, one pixel after another.
    pub(super) sums: Vec<Pixel>,
}

impl Film {
    /// A film without samples, `size` as [`strandlight_scene::budget::check_target`] allows.
    pub fn new(size: [u32; 2]) -> Self {
        Film::from_sample(size, 0)
    }

    /// A film without samples whose first is to be number `first`, for a part of a picture.
    pub fn from_sample(size: [u32; 2], first: u32) -> Self {
        Film {
            size,
            first,
            n_samples: 0,
            spans: Vec::new(),
            sums: Vec::new(),
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Samples of each pixel.
    pub fn n_samples(&self) -> u32 {
        self.n_samples
    }

    /// Number of pixels.
    pub(super) fn n_pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Sums of all samples of pixel `ix`.
    pub(super) fn pixel(&self, ix: usize) -> Pixel {
        let n = self.spans.len();
        let sums = self.sums[ix * n..(ix + 1) * n].iter().copied();
        sums.reduce(Pixel::add).unwrap_or_default()
    }

    /// Sums of all samples of each pixel, rows one after another.
    pub(super) fn pixels(&self) -> impl Iterator<Item = Pixel> {
        (0..self.n_pixels()).map(|ix| self.pixel(ix))
    }

    /// Means of the single scattering of the hair alone, black before any sample, and the share of
    /// each pixel that hair covers.
    pub fn single(&self) -> Layer {
        let scale = 1.0 / f64::from(self.n_samples.max(1));
        let mean = |sum: f64| (sum * scale) as f32;
        let rgb = self.pixels().map(|pixel| pixel.single.map(mean));
        let alpha = self.pixels().map(|pixel| mean(pixel.covered));
        let [width, height] = self.size.map(|side| side as usize);
        Layer::new(width, height, rgb.collect(), alpha.collect())
    }

    /// Adds `n_samples` samples to each pixel of what `scene`'s camera sees. `observer` receives
    /// the share that is done, by any thread.
    ///
    /// Samples lie evenly in the pixel (a box filter): the additive sequence of the plastic
    /// number, turned for each pixel. Those of two calls are those of one.
    ///
    /// # Panics
    /// If there would be a sample beyond [`MAX_TRUTH_SAMPLES`].
    pub fn expose(
        &mut self,
        scene: &PreparedScene,
        integrator: &dyn Integrator,
        n_samples: u32,
        seed: u64,
        observer: &(dyn Fn(f64) + Sync),
    ) {
        let start = self.first + self.n_samples;
        assert!(n_samples <= MAX_TRUTH_SAMPLES - start, "too many samples");
        let samples = start..start + n_samples;
        if samples.is_empty() {
            return;
        }
        let view = view_uniform(&scene.camera, &scene.strands, self.size, 1.0);
        let (width, n_pixels) = (self.size[0] as usize, self.n_pixels());
        let spans = spans_of(self.first..samples.end);
        let order: Vec<usize> = square_by_square(self.size).collect();
        // In that order.
        let mut exposed = vec![Pixel::default(); n_pixels * spans.len()];
        let done = AtomicU64::new(0);
        exposed
            .par_chunks_mut(N_IN_SQUARE * spans.len())
            .zip(order.par_chunks(N_IN_SQUARE))
            .for_each(|(pixels, order)| {
                let pixels = pixels.chunks_exact_mut(spans.len());
                let n = pixels.len() as u64;
                let mut sums = Vec::new();
                for (pixel, &ix) in pixels.zip(order) {
                    sums.clear();
                    sums.extend(self.sums_of(ix));
                    let at = [ix % width, ix / width].map(|x| x as f64);
                    let background = background_at(scene, &view, at.map(|x| x as f32 + 0.5));
                    let background = background.unwrap_or([0.0; 3]).map(f64::from);
                    let pixel_key = SplitMix64::of_item(seed, ix as u64).next_u64();
                    for sample in samples.clone() {
                        let mut random = SplitMix64::of_item(pixel_key, u64::from(sample));
                        let ray = camera_ray(&view, at, pixel_key, sample);
                        let seen = integrator.sample(&ray, &mut random);
                        let span = Span {
                            first: sample,
                            n: 1,
                        };
                        push(&mut sums, span, Pixel::of(&seen, background), Pixel::add);
                    }
                    for (pixel, (_, sum)) in pixel.iter_mut().zip(&sums) {
                        *pixel = *sum;
                    }
                }
                let done = done.fetch_add(n, Ordering::Relaxed) + n;
                observer(done as f64 / n_pixels as f64);
            });
        self.n_samples += n_samples;
        // What was there goes before there is room for as much again.
        self.sums = Vec::new();
        self.sums.resize(n_pixels * spans.len(), Pixel::default());
        for (pixel, ix) in exposed.chunks_exact(spans.len()).zip(order) {
            self.sums[ix * spans.len()..][..spans.len()].copy_from_slice(pixel);
        }
        self.spans = spans;
    }

    /// Adds the samples of `next`, a film of the same size, whose first comes after the last of these.
    ///
    /// # Panics
    /// If it is no such film.
    pub(super) fn append(&mut self, next: &Film) {
        assert_eq!(self.size, next.size, "films of two sizes");
        assert_eq!(self.first + self.n_samples, next.first, "samples apart");
        self.n_samples += next.n_samples;
        let spans = spans_of(self.first..self.first + self.n_samples);
        let mut added = Vec::with_capacity(self.n_pixels() * spans.len());
        for ix in 0..self.n_pixels() {
            let mut sums: Vec<_> = self.sums_of(ix).collect();
            for (span, sum) in next.sums_of(ix) {
                push(&mut sums, span, sum, Pixel::add);
            }
            added.extend(sums.into_iter().map(|(_, sum)| sum));
        }
        (self.spans, self.sums) = (spans, added);
    }

    /// The sums of pixel `ix`, each with its samples.
    fn sums_of(&self, ix: usize) -> impl Iterator<Item = (Span, Pixel)> {
        let n = self.spans.len();
        let sums = self.sums[ix * n..(ix + 1) * n].iter().copied();
        self.spans.iter().copied().zip(sums)
    }
}

impl Pixel {
    /// Sums of the hair alone.
    pub fn total(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.single[c] + self.global[c] + self.local[c])
    }

    pub fn is_finite(&self) -> bool {
        let sums = [
            self.single,
            self.global,
            self.local,
            self.matte,
            self.squares,
        ];
        let counts = [self.covered, self.matte_covered];
        counts.iter().all(|count| count.is_finite())
            && sums.iter().flatten().all(|sum| sum.is_finite())
    }

    /// One sample.
    fn of(seen: &Layers, background: [f64; 3]) -> Pixel {
        let is_open = !seen.is_covered && !seen.is_matte;
        let total = seen.total();
        let shown = |c: usize| total[c] + seen.matte[c] + if is_open { background[c] } else { 0.0 };
        Pixel {
            covered: f64::from(u8::from(seen.is_covered)),
            single: seen.single,
            global: seen.global,
            local: seen.local,
            matte_covered: f64::from(u8::from(seen.is_matte)),
            matte: seen.matte,
            squares: std::array::from_fn(|c| shown(c).powi(2)),
        }
    }
}

impl Add for Pixel {
    type Output = Pixel;

    fn add(self, other: Pixel) -> Pixel {
        let rgb = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|c| a[c] + b[c]);
        Pixel {
            covered: self.covered + other.covered,
            single: rgb(self.single, other.single),
            global: rgb(self.global, other.global),
            local: rgb(self.local, other.local),
            matte_covered: self.matte_covered + other.matte_covered,
            matte: rgb(self.matte, other.matte),
            squares: rgb(self.squares, other.squares),
        }
    }
}
