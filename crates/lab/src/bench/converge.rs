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
use strandlight_reference::converge::Convergence;
use strandlight_reference::environment::LightSampler;
use strandlight_reference::{Environment, PathTracer, TracedScene};
use strandlight_scattering::exact::BcsdfError;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::{Backend, LatLong, Picture, PreparedScene, RenderError};

use super::peers::log_slope;
use super::plot::{AxisStyle, Figure, Mark, Panel, Series};
use super::process_clock::clocked;
pub use super::tiles::MeanOfSeeds;
use super::tiles::{Tiles, TilesOfSeeds};
use super::truth::{Truth, blocks};

/// Errors to which core-seconds are found.
pub const GOALS: [f64; 3] = [0.05, 0.03, 0.01];

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
    /// What the means over the seeds say: of the samples' means, and of the converged pictures.
    pub means: [MeanOfSeeds; 2],
    /// Relative RMSE of the mean over the seeds of the samples' means, and of the converged pictures, less
    /// what is noise of these means; none where that hides it, as of one seed.
    pub bias: [Option<f64>; 2],
}

/// An error, and what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// The error.
    pub relative_rmse: f64,
    /// Core-seconds of `render --converge`, or of the fast picture where that is as good; none of what was not reached.
    pub converged: Option<f64>,
    /// Core-seconds of plain paths, whose error falls as `n^-1/2`.
    pub paths: Option<f64>,
    /// Whether the paths that were measured all err by more, or all by less.
    pub is_extrapolated: bool,
}

impl Goal {
    /// Paths over `render --converge`; above 1 paths take longer.
    pub fn ratio(&self) -> Option<f64> {
        let ratio = self.paths? / self.converged?;
        ratio.is_finite().then_some(ratio)
    }
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

    /// Core-seconds to an error of plain paths, which fall as the root of their samples, and of `render --converge` with its fast
    /// picture, between the two numbers of samples about it. None of what was not reached, or took less than the clock can
    /// tell.
    pub fn core_seconds_to(&self, goal: f64) -> [Option<f64>; 2] {
        [self.plain_seconds_to(goal), self.converged_seconds_to(goal)]
    }

    /// What `relative_rmse` costs.
    pub fn goal(&self, relative_rmse: f64) -> Goal {
        let [paths, converged] = self.core_seconds_to(relative_rmse);
        let errors = || self.points.iter().filter_map(|point| point.plain);
        let (least, most) = (
            errors().fold(f64::INFINITY, f64::min),
            errors().fold(0.0, f64::max),
        );
        Goal {
            relative_rmse,
            converged,
            paths,
            is_extrapolated: !(least..=most).contains(&relative_rmse),
        }
    }

    fn plain_seconds_to(&self, goal: f64) -> Option<f64> {
        let last = self.points.last()?;
        let samples = (last.plain? / goal).powi(2);
        let seconds = self.traced_core_seconds? + samples * last.plain_core_seconds?;
        Some(seconds).filter(|seconds| *seconds > 0.0)
    }

    fn converged_seconds_to(&self, goal: f64) -> Option<f64> {
        let fast = self.fast_core_seconds.filter(|seconds| *seconds > 0.0)?;
        if self.fast_error.is_some_and(|error| error <= goal) {
            return Some(fast);
        }
        let before = fast + self.traced_core_seconds?;
        let of_point = |point: &Point| Some((before + point.core_seconds?, point.converged?));
        let points: Vec<(f64, f64)> = self.points.iter().filter_map(of_point).collect();
        let ix = points.iter().position(|(_, error)| *error <= goal)?;
        let (seconds, error) = points[ix];
        let (less, more) = match ix {
            0 => (before, self.fast_error?),
            _ => points[ix - 1],
        };
        let along = (more / goal).ln() / (more / error).ln();
        Some(less * (seconds / less).powf(along))
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let mean = |mean: &MeanOfSeeds| {
            json!({
                "ratio": mean.ratio,
                "standard_error": mean.standard_error,
                "tiles_beyond": mean.tiles_beyond,
            })
        };
        let goal = |&goal: &f64| {
            let [plain, converged] = self.core_seconds_to(goal);
            json!({
                "relative_rmse": goal,
                "plain_core_seconds": plain,
                "core_seconds": converged,
            })
        };
        let point = |point: &Point| {
            json!({
                "samples": point.samples,
                "core_seconds": point.core_seconds,
                "plain_core_seconds": point.plain_core_seconds,
                "plain": point.plain,
                "converged": point.converged,
                "expected": point.expected,
                "inside": point.inside,
                "mean_ratio": point.means[1].ratio,
                "mean_plain": mean(&point.means[0]),
                "mean_converged": mean(&point.means[1]),
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
            "goals": GOALS.iter().map(goal).collect::<Vec<_>>(),
        })
    }

    /// Errors over core-seconds, with what paths read of the scene, and of `render --converge` with its fast picture.
    pub fn panel(&self, title: &str) -> Panel {
        let fast = self.fast_core_seconds.unwrap_or(f64::NAN);
        let traced = self.traced_core_seconds.unwrap_or(f64::NAN);
        type Of = fn(&Point) -> Option<f64>;
        let of = |name: &str, before: f64, seconds: Of, error: Of| Series {
            name: name.to_owned(),
            mark: Mark::LinePoints,
            points: (self.points.iter())
                .map(|point| {
                    let seconds = seconds(point).unwrap_or(f64::NAN);
                    (before + seconds, 100.0 * error(point).unwrap_or(f64::NAN))
                })
                .collect(),
            ..Series::default()
        };
        let seconds: Of = |point| point.core_seconds;
        let plain_seconds: Of = |point| point.plain_core_seconds;
        let before = fast + traced;
        let fast = Series {
            name: "fast picture".to_owned(),
            mark: Mark::Points,
            points: vec![(fast, 100.0 * self.fast_error.unwrap_or(f64::NAN))],
            ..Series::default()
        };
        let paths = of("path tracing", traced, plain_seconds, |point| point.plain);
        let guide = Series {
            name: "falls as n^-1/2".to_owned(),
            mark: Mark::Dashed,
            points: guide(&paths.points),
            ..Series::default()
        };
        Panel {
            title: title.to_owned(),
            x: AxisStyle::log("core-seconds"),
            y: AxisStyle::log("relative RMSE of 4x4 means, %"),
            series: vec![
                fast,
                guide,
                paths,
                of("converged", before, seconds, |point| point.converged),
                of("expected by converged", before, seconds, |point| {
                    Some(point.expected)
                }),
            ],
        }
    }
}

/// Through the last point, as far as the others, with a slope of -1/2.
fn guide(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let Some(&(seconds, error)) = points.last() else {
        return Vec::new();
    };
    let at = |&(x, _): &(f64, f64)| (x, error * (seconds / x).sqrt());
    points.iter().map(at).collect()
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
    let base = prepared(scene, options.size)?;
    let (picture, core_seconds) = clocked(|| {
        let mut renderer = CpuRenderer::new(base.clone());
        renderer.render(base.size, 1, &|_| ())
    });
    let (picture, _) = picture?;
    done();
    let fast = FastPicture {
        picture,
        core_seconds,
    };
    let environment = environment_of(map, scene, &base);
    converge_from(&base, fast, &environment, options, done)
}

/// The scene with nothing behind it.
pub(super) fn prepared(
    scene: &Scene,
    size: Option<[u32; 2]>,
) -> Result<PreparedScene, RenderError> {
    let mut base = PreparedScene::load(scene)?;
    base.size = size.unwrap_or(base.size);
    base.background = Background::None;
    Ok(base)
}

/// The light of the map, or without one that of the light set.
pub(super) fn environment_of(
    map: Option<(LatLong, &[[f32; 3]])>,
    scene: &Scene,
    base: &PreparedScene,
) -> Environment {
    match map {
        None => Environment::Lights(LightSampler::new(&base.lights)),
        Some((grid, pixels)) => Environment::of_map(grid, pixels, &scene.lights, &base.lights),
    }
}

/// What is converged from.
pub(super) struct FastPicture {
    pub picture: Picture,
    /// Seconds of all cores from the loaded scene.
    pub core_seconds: Option<f64>,
}

/// [`converge`] once there is the fast picture.
pub(super) fn converge_from(
    base: &PreparedScene,
    fast: FastPicture,
    environment: &Environment,
    options: &Options,
    done: &dyn Fn(),
) -> Result<Convergences, ConvergeError> {
    let FastPicture {
        picture: fast,
        core_seconds: fast_core_seconds,
    } = fast;
    let (traced, traced_core_seconds) = clocked(|| TracedScene::new(base));
    let traced = traced?;
    let tracer = traced.tracer(environment);
    let tracer = tracer.with_scattering(base.scattering());
    let mut seeds = SplitMix64(options.seed);
    let halves = [0, 1].map(|_| {
        let half = estimate(base, &tracer, &fast, options.truth_samples, &mut seeds);
        done();
        half
    });
    let layers = [0, 1].map(|ix: usize| blocks(&halves[ix].0));
    let truth = Truth::new(&layers).ok_or(ConvergeError::Black)?;
    let tiles = Tiles::new(&halves);
    let mut runs: Vec<[Runs; 2]> = vec![Default::default(); options.samples.len()];
    let mut tiles_of_seeds: Vec<[TilesOfSeeds; 2]> = vec![Default::default(); runs.len()];
    let mut points = vec![Point::default(); options.samples.len()];
    let share = 1.0 / f64::from(options.seeds);
    for _ in 0..options.seeds {
        let mut convergence = Convergence::new(fast.clone(), base, seeds.next_u64());
        let mut even = Convergence::new(fast.clone(), base, seeds.next_u64()).evenly();
        let mut core_seconds = [Some(0.0); 2];
        let of_samples = options.samples.iter().zip(&mut points);
        let of_seeds = runs.iter_mut().zip(&mut tiles_of_seeds);
        for ((&samples, point), (runs, means)) in of_samples.zip(of_seeds) {
            let more = samples - convergence.samples();
            let (_, seconds) = clocked(|| convergence.trace(base, &tracer, more));
            let (_, plain_seconds) = clocked(|| even.trace(base, &tracer, more));
            let of_point = [&mut point.core_seconds, &mut point.plain_core_seconds];
            let found = [seconds, plain_seconds].into_iter().zip(of_point);
            for (sum, (more, of_point)) in core_seconds.iter_mut().zip(found) {
                *sum = sum.zip(more).map(|(sum, more)| sum + more);
                *of_point = sum.map(|s| of_point.unwrap_or(0.0) + share * s);
            }
            let converged = convergence.converged();
            point.samples = samples;
            let (plain, _) = even.plain();
            let of_pictures = runs.iter_mut().zip(means);
            for ((runs, means), picture) in of_pictures.zip([&plain, &converged.picture]) {
                runs.add(blocks(picture), &truth);
                means.add(picture, &tiles);
            }
            point.expected += share * converged.relative_error.powi(2);
            point.inside += share * tiles.inside(&converged);
            done();
        }
    }
    for ((point, runs), means) in points.iter_mut().zip(&runs).zip(&tiles_of_seeds) {
        point.means = means.each_ref().map(|means| means.mean(&tiles));
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

    #[test]
    fn core_seconds_to_errors_are_read_between_the_points() {
        let point = |samples: u32, error: f64| Point {
            samples,
            core_seconds: Some(f64::from(samples)),
            plain_core_seconds: Some(f64::from(samples)),
            plain: Some(0.4 / f64::from(samples).sqrt()),
            converged: Some(error),
            ..Point::default()
        };
        let found = Convergences {
            size: [1, 1],
            counts: [1; 3],
            scattering: Scattering::Total,
            fast_core_seconds: Some(2.0),
            fast_error: Some(0.08),
            traced_core_seconds: Some(1.0),
            points: vec![point(4, 0.04), point(16, 0.02)],
            seeds: 1,
            truth_noise: 0.0,
        };
        let near = |found: Option<f64>, expected: f64| {
            assert!(
                found.is_some_and(|x| (x / expected - 1.0).abs() < 1e-9),
                "{found:?} {expected}"
            );
        };
        let at = |goal| found.core_seconds_to(goal);
        near(at(0.1)[1], 2.0);
        near(at(0.04)[1], 7.0);
        near(at(0.02)[1], 19.0);
        // Half of the way in logarithms.
        near(at(0.04 / 2.0_f64.sqrt())[1], (7.0_f64 * 19.0).sqrt());
        near(at(0.04 * 2.0_f64.sqrt())[1], (3.0_f64 * 7.0).sqrt());
        assert_eq!(at(0.01)[1], None);
        near(at(0.01)[0], 1.0 + 1600.0);
        // The paths' last error is 10 %.
        assert!(found.goal(0.09).is_extrapolated && !found.goal(0.1).is_extrapolated);
        assert!(found.goal(0.21).is_extrapolated && !found.goal(0.19).is_extrapolated);
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
