//! How fast `render --converge` goes to the truth, and whether it knows how far it is.
//!
//! For some numbers of samples: the error of the plain means of as many of each pixel, that of the converged picture,
//! the error that it expects of itself, and how many tiles lie within the 95 % interval that it states;
//! all over several seeds. Errors are relative RMSEs of means over 4x4 pixels against two estimates of
//! the truth by path tracing (see `truth`).

use serde_json::{Value, json};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, Scattering, Scene};
use strandlight_reference::compare::Layer;
use strandlight_reference::converge::{Converged, Convergence, TILE};
use strandlight_reference::environment::LightSampler;
use strandlight_reference::{Environment, PathTracer, TracedScene};
use strandlight_scattering::exact::BcsdfError;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::{Backend, LatLong, Picture, PreparedScene, RenderError};

use super::peers::log_slope;
use super::plot::{AxisStyle, Figure, Mark, Panel, Series};
use super::process_clock::clocked;
use super::truth::{Truth, blocks};

/// Quantile of a 95 % interval.
const INTERVAL: f64 = 1.96;

/// What is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Width and height in pixels; the scene's without.
    pub size: Option<[u32; 2]>,
    /// Samples a pixel, growing.
    pub samples: Vec<u32>,
    /// Samples a pixel of either estimate of the truth.
    pub truth_samples: u32,
    /// Runs of other random numbers.
    pub seeds: u32,
    /// Seed of all samples.
    pub seed: u64,
}

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConvergeError {
    /// A scene that cannot be loaded or drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Fibres without an exact model.
    #[error(transparent)]
    Fibre(#[from] BcsdfError),
    /// No light reaches the eye.
    #[error("the truth is black, so relative errors are undefined: no light reaches the camera")]
    Black,
}

/// What was measured of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergences {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Strands, points and lights.
    pub counts: [usize; 3],
    /// What of the hair's light is converged.
    pub scattering: Scattering,
    /// Seconds of all cores to the fast picture, and its error.
    pub fast_core_seconds: Option<f64>,
    /// See `fast_core_seconds`; none if the truth's noise hides it.
    pub fast_error: Option<f64>,
    /// Seconds of all cores for what paths read of the scene.
    pub traced_core_seconds: Option<f64>,
    /// By number of samples.
    pub points: Vec<Point>,
    /// Runs.
    pub seeds: u32,
    /// Relative RMSE of the truth's own noise, which the errors are without.
    pub truth_noise: f64,
}

/// After so many samples; means over the seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Samples a pixel.
    pub samples: u32,
    /// Seconds of all cores for the samples.
    pub core_seconds: Option<f64>,
    /// Those for as many samples of each pixel.
    pub plain_core_seconds: Option<f64>,
    /// Relative RMSE of the means of these.
    pub plain: Option<f64>,
    /// Of the converged picture.
    pub converged: Option<f64>,
    /// That which it expects.
    pub expected: f64,
    /// Share of the tiles that lie within the interval that it states.
    pub inside: f64,
    /// Mean of the converged picture over that of the truth.
    pub mean_ratio: f64,
    /// Relative RMSE of the mean over the seeds of the samples' means, and of the converged pictures, less
    /// what is noise of these means; none where that hides it, as of one seed.
    pub bias: [Option<f64>; 2],
}

impl Convergences {
    /// Slopes of the plain and the converged errors over the samples, log-log.
    pub fn slopes(&self) -> [Option<f64>; 2] {
        let of = |error: fn(&Point) -> Option<f64>| {
            let points = self.points.iter();
            let pairs = points.filter_map(|point| Some((f64::from(point.samples), error(point)?)));
            log_slope(pairs)
        };
        [of(|point| point.plain), of(|point| point.converged)]
    }

    /// Core-seconds of plain paths to the error of the last converged picture, over those of its samples;
    /// none where either took less than the clock can tell.
    pub fn gain(&self) -> Option<f64> {
        let last = self.points.last()?;
        let samples = (last.plain? / last.converged?).powi(2);
        let gain = samples * last.plain_core_seconds? / last.core_seconds?;
        (gain.is_finite() && gain > 0.0).then_some(gain)
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let point = |point: &Point| {
            json!({
                "samples": point.samples,
                "core_seconds": point.core_seconds,
                "plain_core_seconds": point.plain_core_seconds,
                "plain": point.plain,
                "converged": point.converged,
                "expected": point.expected,
                "inside": point.inside,
                "mean_ratio": point.mean_ratio,
                "bias_plain": point.bias[0],
                "bias_converged": point.bias[1],
            })
        };
        let [strands, points, lights] = self.counts;
        let [plain, converged] = self.slopes();
        json!({
            "size": self.size,
            "strands": strands,
            "points": points,
            "lights": lights,
            "scattering": self.scattering.name(),
            "seeds": self.seeds,
            "truth_noise": self.truth_noise,
            "fast": { "core_seconds": self.fast_core_seconds, "relative_rmse": self.fast_error },
            "traced_core_seconds": self.traced_core_seconds,
            "measured": self.points.iter().map(point).collect::<Vec<_>>(),
            "slope_plain": plain,
            "slope_converged": converged,
            "gain": self.gain(),
        })
    }

    /// Errors over core-seconds.
    pub fn panel(&self, title: &str) -> Panel {
        let fast = self.fast_core_seconds.unwrap_or(f64::NAN);
        type Of = fn(&Point) -> Option<f64>;
        let of = |name: &str, seconds: Of, error: Of| Series {
            name: name.to_owned(),
            mark: Mark::LinePoints,
            points: (self.points.iter())
                .map(|point| {
                    let seconds = seconds(point).unwrap_or(f64::NAN);
                    (fast + seconds, 100.0 * error(point).unwrap_or(f64::NAN))
                })
                .collect(),
            ..Series::default()
        };
        let seconds: Of = |point| point.core_seconds;
        let plain_seconds: Of = |point| point.plain_core_seconds;
        let fast = Series {
            name: "fast picture".to_owned(),
            mark: Mark::Points,
            points: vec![(fast, 100.0 * self.fast_error.unwrap_or(f64::NAN))],
            ..Series::default()
        };
        Panel {
            title: title.to_owned(),
            x: AxisStyle::log("core-seconds"),
            y: AxisStyle::log("relative RMSE of 4x4 means, %"),
            series: vec![
                fast,
                of("path tracing", plain_seconds, |point| point.plain),
                of("converged", seconds, |point| point.converged),
                of("expected by converged", seconds, |point| {
                    Some(point.expected)
                }),
            ],
        }
    }
}

/// All scenes beside each other.
pub fn figure(panels: Vec<Panel>) -> Figure {
    Figure {
        title: "Convergence to path tracing".to_owned(),
        columns: panels.len().min(3),
        panels,
        colours: vec!["fast picture", "path tracing", "converged"],
    }
}

/// Steps that [`converge`] reports.
pub fn n_steps(options: &Options) -> u64 {
    let of_a_seed = options.samples.len() as u64;
    1 + 2 + u64::from(options.seeds) * of_a_seed
}

/// Converges the scattering that `scene` has, with nothing behind it, in the light of a `map`, its pixels from the top row
/// on, or without one in that of the light set. `done` is called after each of [`n_steps`].
///
/// # Errors
/// As [`ConvergeError`] has them.
pub fn converge(
    scene: &Scene,
    map: Option<(LatLong, &[[f32; 3]])>,
    options: &Options,
    done: &dyn Fn(),
) -> Result<Convergences, ConvergeError> {
    let mut base = PreparedScene::load(scene).map_err(RenderError::from)?;
    base.size = options.size.unwrap_or(base.size);
    base.background = Background::None;
    let (fast, fast_core_seconds) = clocked(|| {
        let mut renderer = CpuRenderer::new(base.clone());
        renderer.render(base.size, 1, &|_| ())
    });
    let (fast, _) = fast?;
    done();
    let (traced, traced_core_seconds) = clocked(|| TracedScene::new(&base));
    let traced = traced?;
    let environment = match map {
        None => Environment::Lights(LightSampler::new(&base.lights)),
        Some((grid, pixels)) => Environment::of_map(grid, pixels, &scene.lights, &base.lights),
    };
    let tracer = traced.tracer(&environment);
    let tracer = tracer.with_scattering(base.scattering());
    let mut seeds = SplitMix64(options.seed);
    let halves = [0, 1].map(|_| {
        let half = estimate(&base, &tracer, &fast, options.truth_samples, &mut seeds);
        done();
        half
    });
    let layers = [0, 1].map(|ix: usize| blocks(&halves[ix].0));
    let truth = Truth::new(&layers).ok_or(ConvergeError::Black)?;
    let tiles = Tiles::new(&halves);
    let mut runs: Vec<[Runs; 2]> = vec![Default::default(); options.samples.len()];
    let mut points = vec![Point::default(); options.samples.len()];
    let share = 1.0 / f64::from(options.seeds);
    for _ in 0..options.seeds {
        let mut convergence = Convergence::new(fast.clone(), &base, seeds.next_u64());
        let mut even = Convergence::new(fast.clone(), &base, seeds.next_u64()).evenly();
        let mut core_seconds = [Some(0.0); 2];
        for ((&samples, point), runs) in options.samples.iter().zip(&mut points).zip(&mut runs) {
            let more = samples - convergence.samples();
            let (_, seconds) = clocked(|| convergence.trace(&base, &tracer, more));
            let (_, plain_seconds) = clocked(|| even.trace(&base, &tracer, more));
            let of_point = [&mut point.core_seconds, &mut point.plain_core_seconds];
            let found = [seconds, plain_seconds].into_iter().zip(of_point);
            for (sum, (more, of_point)) in core_seconds.iter_mut().zip(found) {
                *sum = sum.zip(more).map(|(sum, more)| sum + more);
                *of_point = sum.map(|s| of_point.unwrap_or(0.0) + share * s);
            }
            let converged = convergence.converged();
            point.samples = samples;
            let (plain, _) = even.plain();
            for (runs, picture) in runs.iter_mut().zip([&plain, &converged.picture]) {
                runs.add(blocks(picture), &truth);
            }
            point.expected += share * converged.relative_error.powi(2);
            point.inside += share * tiles.inside(&converged);
            point.mean_ratio += share * tiles.mean_ratio(&converged.picture);
            done();
        }
    }
    for (point, runs) in points.iter_mut().zip(&runs) {
        [point.plain, point.converged] = runs.each_ref().map(Runs::error);
        point.bias = runs.each_ref().map(|runs| runs.bias(&truth));
        point.expected = point.expected.sqrt();
    }
    Ok(Convergences {
        size: base.size,
        counts: [
            base.strands.n_strands,
            base.strands.points.len(),
            base.lights.len(),
        ],
        scattering: base.scattering(),
        fast_core_seconds,
        fast_error: truth.relative_rmse(&blocks(&fast)),
        traced_core_seconds,
        points,
        seeds: options.seeds,
        truth_noise: truth.noise(),
    })
}

/// Pictures of several seeds, as means over blocks.
#[derive(Clone, Default)]
struct Runs {
    n: f64,
    /// Their sum.
    sum: Option<Layer>,
    /// Sum of the squares of their relative RMSEs.
    squares: f64,
}

impl Runs {
    fn add(&mut self, picture: Layer, truth: &Truth) {
        self.n += 1.0;
        self.squares += truth.mean_square(&picture);
        match &mut self.sum {
            None => self.sum = Some(picture),
            Some(sum) => {
                for (sum, value) in sum.rgb.iter_mut().zip(&picture.rgb) {
                    for (sum, value) in sum.iter_mut().zip(value) {
                        *sum += value;
                    }
                }
            }
        }
    }

    fn error(&self) -> Option<f64> {
        root(self.squares / self.n)
    }

    /// The error of their mean. What a picture is off by on average is more than that, by the noise of a
    /// picture; of the noise the mean has a share of `1 / n`.
    fn bias(&self, truth: &Truth) -> Option<f64> {
        let mut mean = self.sum.clone()?;
        for value in mean.rgb.iter_mut().flatten() {
            *value /= self.n as f32;
        }
        let of_mean = truth.mean_square(&mean);
        let spread = self.squares / self.n - of_mean;
        (self.n > 1.0).then(|| root(of_mean - spread / (self.n - 1.0)))?
    }
}

fn root(square: f64) -> Option<f64> {
    (square > 0.0).then(|| square.sqrt())
}

/// Means of paths alone, and their variance.
fn estimate(
    scene: &PreparedScene,
    tracer: &PathTracer,
    fast: &Picture,
    samples: u32,
    seeds: &mut SplitMix64,
) -> (Picture, Vec<[f32; 3]>) {
    let mut convergence = Convergence::new(fast.clone(), scene, seeds.next_u64()).evenly();
    convergence.trace(scene, tracer, samples);
    convergence.plain()
}

/// Means of the truth over tiles.
struct Tiles {
    /// Mean of the channels and its variance; none where nothing is seen.
    means: Vec<Option<[f64; 2]>>,
    /// Mean over the picture.
    mean: f64,
}

impl Tiles {
    fn new(halves: &[(Picture, Vec<[f32; 3]>); 2]) -> Tiles {
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
        Tiles {
            means: means.collect(),
            mean: 0.5 * (sum(&pictures[0]) + sum(&pictures[1])),
        }
    }

    /// Share of the tiles of `converged` whose error is as stated.
    fn inside(&self, converged: &Converged) -> f64 {
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

    fn mean_ratio(&self, picture: &Picture) -> f64 {
        let found = tile_sums(picture, |ix| picture.rgba[ix]);
        found.iter().map(|tile| tile[0]).sum::<f64>() / self.mean
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_below_the_clocks_step_have_no_ratio() {
        let gain = |seconds: [f64; 2]| {
            let point = Point {
                core_seconds: Some(seconds[0]),
                plain_core_seconds: Some(seconds[1]),
                plain: Some(0.2),
                converged: Some(0.1),
                ..Point::default()
            };
            let found = Convergences {
                size: [1, 1],
                counts: [1; 3],
                scattering: Scattering::Total,
                fast_core_seconds: None,
                fast_error: None,
                traced_core_seconds: None,
                points: vec![point],
                seeds: 1,
                truth_noise: 0.0,
            };
            found.gain()
        };
        assert_eq!(gain([2.0, 1.0]), Some(2.0));
        for seconds in [[0.0, 1.0], [1.0, 0.0], [0.0, 0.0]] {
            assert_eq!(gain(seconds), None);
        }
    }

    /// Pictures that are off by 5 % in the mean, and by 20 % each.
    #[test]
    fn the_noise_of_runs_is_no_bias() {
        let n = 2000;
        let layer = |value: &mut dyn FnMut() -> f32| {
            let rgb = (0..n).map(|_| [value(), value(), value()]).collect();
            Layer::new(n, 1, rgb, vec![1.0; n])
        };
        let halves = [0, 1].map(|_| layer(&mut || 1.0));
        let truth = Truth::new(&halves).expect("not black");
        let mut random = SplitMix64(3);
        let mut runs_about = |mean: f64| {
            let mut runs = Runs::default();
            for _ in 0..8 {
                let noise = 0.2 * 3.0_f64.sqrt();
                runs.add(
                    layer(&mut || (mean + random.uniform(-noise, noise)) as f32),
                    &truth,
                );
            }
            runs
        };
        let runs = runs_about(1.05);
        let error = runs.error().expect("wrong");
        assert!((error - 0.2_f64.hypot(0.05)).abs() < 5e-3, "{error}");
        let bias = runs.bias(&truth).expect("wrong in the mean");
        assert!((bias - 0.05).abs() < 5e-3, "{bias}");
        // A share of 1/8 of the noise would be 7 %.
        let none = runs_about(1.0).bias(&truth).unwrap_or(0.0);
        assert!(none < 0.02, "{none}");
        let mut one = Runs::default();
        one.add(layer(&mut || 1.05), &truth);
        assert_eq!(one.bias(&truth), None);
    }
}
