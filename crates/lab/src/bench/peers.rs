//! What brute force costs to the error of a picture on the CPU, beside what that picture costs.
//!
//! Both have single scattering alone, of the same lights, in core-seconds. Brute force is
//! [`Directional`]: the exact fibre model under directional lights, a ray of shadow to each. Every
//! sample of a pixel has directions of its own (a set shared by all samples has an error that no
//! number of them removes), so the error falls as `n^-1/2` with the samples and is known at any
//! number once it was measured at some.
//!
//! Errors are relative RMSEs of means over 4x4 pixels against two estimates of the truth (see `truth`),
//! brute force of many samples each. What one run finds still scatters, all the more since the pixels
//! of a sample share its directions; other seeds tell by how much.
//!
//! [`total`] has all scattering, beside path tracing.

use serde_json::{Value, json};
use strandlight_cpu::CpuRenderer;
use strandlight_formats::{Background, Scattering, Scene};
use strandlight_reference::compare::Layer;
use strandlight_reference::environment::LightSampler;
use strandlight_reference::rays::Rays;
use strandlight_reference::{Directional, Environment, FibreTables, Fibres, Film, MeshRays};
use strandlight_scattering::exact::BcsdfError;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::{Backend, Picture, PreparedScene, RenderError};

pub mod total;

use super::edits;
use super::process_clock::clocked;
use super::truth::{BLOCK, Truth, blocks};

/// A sample of [`Directional`] takes one of its lights in so many.
const N_TURNS: u32 = 64;

/// Shadow rays of a sample of the truth, whatever brute force has.
const TRUTH_RAYS: u32 = 24;

/// What is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Width and height in pixels; the scene's without.
    pub size: Option<[u32; 2]>,
    /// Samples a pixel that brute force is measured at.
    pub samples: Vec<u32>,
    /// Rays of shadow of each.
    pub rays: u32,
    /// Samples a pixel of either estimate of the truth.
    pub truth_samples: u32,
    /// Pictures of each kind, after a first one.
    pub repetitions: u32,
    /// Seed of all samples.
    pub seed: u64,
}

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PeersError {
    /// A scene that cannot be loaded or drawn.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Fibres without an exact model.
    #[error(transparent)]
    Fibre(#[from] BcsdfError),
    /// No light reaches the eye.
    #[error("the truth is black, so relative errors are undefined: no light reaches the camera")]
    Black,
    /// The truth is noisier than the picture is wrong.
    #[error("the truth is too noisy to tell the picture's error; take more samples for it")]
    Noisy,
}

/// A picture and brute force at its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Peers {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Strands, points and lights.
    pub counts: [usize; 3],
    /// The picture of the renderer.
    pub ours: Ours,
    /// What it is compared with.
    pub brute_force: BruteForce,
    /// Relative RMSE of the truth's own noise, which the errors are without.
    pub truth_noise: f64,
}

/// The picture of the renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ours {
    /// Its error.
    pub relative_rmse: f64,
    /// Seconds of all cores from the loaded scene to the picture.
    pub core_seconds: Option<f64>,
    /// The same after an edit of the hair's colour, with shadows kept.
    pub edit_core_seconds: Option<f64>,
}

/// Brute force as measured, and its fit.
#[derive(Clone, Debug, PartialEq)]
pub struct BruteForce {
    /// Rays of shadow of a sample.
    pub rays: u32,
    /// Seconds of all cores for the hierarchy of the hair.
    pub hierarchy_core_seconds: Option<f64>,
    /// The same for the fibre's tables, which an edit of the hair makes again.
    pub fibre_core_seconds: Option<f64>,
    /// By number of samples.
    pub points: Vec<Point>,
}

/// Brute force at a number of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples a pixel.
    pub samples: u32,
    /// Error.
    pub relative_rmse: f64,
    /// Seconds of all cores, without hierarchy and tables.
    pub core_seconds: Option<f64>,
}

impl BruteForce {
    /// Error of one sample a pixel, if it falls as `n^-1/2`: the geometric mean over the points.
    pub fn relative_rmse_of_one(&self) -> f64 {
        let logs = self.points.iter().map(|point| {
            let of_one = point.relative_rmse * f64::from(point.samples).sqrt();
            of_one.ln()
        });
        (logs.sum::<f64>() / self.points.len() as f64).exp()
    }

    /// Exponent with which the error falls in fact, by least squares; none of a single point.
    pub fn exponent(&self) -> Option<f64> {
        let points = self
            .points
            .iter()
            .map(|point| (f64::from(point.samples), point.relative_rmse));
        log_slope(points)
    }

    /// Seconds of all cores for one sample a pixel; none where all of them took less than the clock
    /// can tell.
    pub fn core_seconds_of_one(&self) -> Option<f64> {
        let seconds: Option<f64> = self.points.iter().map(|point| point.core_seconds).sum();
        let samples: u32 = self.points.iter().map(|point| point.samples).sum();
        let seconds = seconds.filter(|seconds| *seconds > 0.0)?;
        Some(seconds / f64::from(samples))
    }

    /// Samples a pixel to `relative_rmse`. Below one, some pixels go without.
    pub fn samples_to(&self, relative_rmse: f64) -> f64 {
        (self.relative_rmse_of_one() / relative_rmse).powi(2)
    }
}

impl Peers {
    /// Samples a pixel that brute force needs to our error.
    pub fn samples(&self) -> f64 {
        self.brute_force.samples_to(self.ours.relative_rmse)
    }

    /// Core-seconds of brute force to our error: from the loaded scene, and after an edit of the
    /// hair's colour, with its hierarchy kept.
    pub fn core_seconds(&self) -> [Option<f64>; 2] {
        let brute = &self.brute_force;
        let edited = || {
            let samples = self.samples() * brute.core_seconds_of_one()?;
            Some(brute.fibre_core_seconds? + samples)
        };
        let still = || Some(brute.hierarchy_core_seconds? + edited()?);
        [still(), edited()]
    }

    /// [`Peers::core_seconds`] over ours: of a still, and of the edit. Above 1 we are cheaper.
    pub fn ratios(&self) -> [Option<f64>; 2] {
        let [still, edited] = self.core_seconds();
        let over = |brute: Option<f64>, ours: Option<f64>| {
            let ratio = brute? / ours?;
            ratio.is_finite().then_some(ratio)
        };
        [
            over(still, self.ours.core_seconds),
            over(edited, self.ours.edit_core_seconds),
        ]
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let brute = &self.brute_force;
        let point = |point: &Point| {
            json!({
                "samples": point.samples,
                "relative_rmse": point.relative_rmse,
                "core_seconds": point.core_seconds,
            })
        };
        let [still, edited] = self.core_seconds();
        let [ratio, ratio_edit] = self.ratios();
        let [strands, points, lights] = self.counts;
        json!({
            "size": self.size,
            "strands": strands,
            "points": points,
            "lights": lights,
            "truth_noise": self.truth_noise,
            "ours": {
                "relative_rmse": self.ours.relative_rmse,
                "core_seconds": self.ours.core_seconds,
                "edit_core_seconds": self.ours.edit_core_seconds,
            },
            "brute_force": {
                "rays": brute.rays,
                "hierarchy_core_seconds": brute.hierarchy_core_seconds,
                "fibre_core_seconds": brute.fibre_core_seconds,
                "measured": brute.points.iter().map(point).collect::<Vec<_>>(),
                "exponent": brute.exponent(),
                "relative_rmse_of_one_sample": brute.relative_rmse_of_one(),
                "core_seconds_of_one_sample": brute.core_seconds_of_one(),
                "samples": self.samples(),
                "core_seconds": still,
                "edit_core_seconds": edited,
            },
            "ratio": ratio,
            "ratio_of_edit": ratio_edit,
        })
    }
}

/// Slope of `ln y` over `ln x` by least squares; none of fewer than two `x`.
pub(super) fn log_slope(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(|log| log.0), mean(|log| log.1));
    let product = |sum: f64, log: &(f64, f64)| sum + (log.0 - x) * (log.1 - y);
    let square = |sum: f64, log: &(f64, f64)| sum + (log.0 - x).powi(2);
    let spread = logs.iter().fold(0.0, square);
    (spread > 0.0).then(|| logs.iter().fold(0.0, product) / spread)
}

/// Steps that [`peers`] reports.
pub fn n_steps(options: &Options) -> u64 {
    let pictures = 2 * (u64::from(options.repetitions) + 1);
    let samples: u32 = options.samples.iter().sum();
    pictures + u64::from(samples) + 2 * u64::from(options.truth_samples)
}

/// Compares the picture of `scene` with brute force. Things beside the hair are black, and nothing is
/// behind it. `done` is called after each of [`n_steps`].
///
/// # Errors
/// As [`PeersError`] has them.
pub fn peers(scene: &Scene, options: &Options, done: &dyn Fn()) -> Result<Peers, PeersError> {
    let base = hair_alone(scene, options).map_err(PeersError::Render)?;
    let (picture, core_seconds, edit_core_seconds) = ours(&base, options, done)?;

    let (rays, hierarchy_core_seconds) = clocked(|| Rays::new(&base.strands));
    let (fibre, fibre_core_seconds) = clocked(|| FibreTables::new(&base));
    let fibre = fibre?;
    let brute = Tracer {
        scene: &base,
        rays: &rays,
        fibres: fibre.fibres(),
        environment: Environment::Lights(LightSampler::new(&base.lights)),
        done,
    };
    let mut seeds = SplitMix64(options.seed);
    let halves = [0, 1].map(|_| brute.trace(options.truth_samples, TRUTH_RAYS, seeds.next_u64()));
    let truth = Truth::new(&halves).ok_or(PeersError::Black)?;
    let mut points = Vec::new();
    for &samples in &options.samples {
        let seed = seeds.next_u64();
        let (found, core_seconds) = clocked(|| brute.trace(samples, options.rays, seed));
        points.push(Point {
            samples,
            relative_rmse: truth.relative_rmse(&found).ok_or(PeersError::Noisy)?,
            core_seconds,
        });
    }
    let relative_rmse = truth.relative_rmse(&picture).ok_or(PeersError::Noisy)?;
    Ok(Peers {
        size: base.size,
        counts: [
            base.strands.n_strands,
            base.strands.points.len(),
            base.lights.len(),
        ],
        ours: Ours {
            relative_rmse,
            core_seconds,
            edit_core_seconds,
        },
        brute_force: BruteForce {
            rays: options.rays,
            hierarchy_core_seconds,
            fibre_core_seconds,
            points,
        },
        truth_noise: truth.noise(),
    })
}

/// The scene with single scattering of its hair as all that is seen.
fn hair_alone(scene: &Scene, options: &Options) -> Result<PreparedScene, RenderError> {
    let mut loaded = PreparedScene::load(scene)?;
    loaded.size = options.size.unwrap_or(loaded.size);
    loaded.background = Background::None;
    for proxy in &mut loaded.proxies {
        *proxy.albedo_mut() = [0.0; 3];
    }
    loaded.set_scattering(Scattering::Single);
    Ok(loaded)
}

/// The picture in blocks; mean core-seconds of one from nothing, and of one after an edit.
fn ours(
    base: &PreparedScene,
    options: &Options,
    done: &dyn Fn(),
) -> Result<(Layer, Option<f64>, Option<f64>), RenderError> {
    let mut drawing = Drawing::new(base, options.repetitions, done);
    let (picture, still) = drawing.stills()?;
    let (_, edit) = drawing.drawn(&|live, there| edits::color(live, base, there))?;
    Ok((blocks(&picture), still, edit))
}

/// Pictures of the renderer, one after the other.
struct Drawing<'a> {
    base: &'a PreparedScene,
    live: CpuRenderer,
    repetitions: u32,
    done: &'a dyn Fn(),
}

impl<'a> Drawing<'a> {
    fn new(base: &'a PreparedScene, repetitions: u32, done: &'a dyn Fn()) -> Self {
        Drawing {
            base,
            live: CpuRenderer::new(base.clone()),
            repetitions,
            done,
        }
    }

    /// From the loaded scene: the picture, and mean core-seconds of one.
    fn stills(&mut self) -> Result<(Picture, Option<f64>), RenderError> {
        let base = self.base;
        self.drawn(&|live, _| live.set_scene(base.clone()))
    }

    /// The first picture after `edit`, there and back, and mean core-seconds of those that follow.
    fn drawn(
        &mut self,
        edit: &dyn Fn(&mut CpuRenderer, bool) -> Result<(), RenderError>,
    ) -> Result<(Picture, Option<f64>), RenderError> {
        let mut draw = |there: bool| {
            edit(&mut self.live, there)?;
            let (picture, _) = self.live.render(self.base.size, 1, &|_| ())?;
            (self.done)();
            Ok::<_, RenderError>(picture)
        };
        let first = draw(true)?;
        let (all, core_seconds) = clocked(|| {
            let mut turns = (0..self.repetitions).map(|ix| ix % 2 == 1);
            turns.try_for_each(|there| draw(there).map(|_| ()))
        });
        all?;
        let share = 1.0 / f64::from(self.repetitions);
        Ok((first, core_seconds.map(|seconds| seconds * share)))
    }
}

/// Brute force at work.
struct Tracer<'a> {
    scene: &'a PreparedScene,
    rays: &'a Rays,
    fibres: Fibres<'a>,
    environment: Environment,
    done: &'a dyn Fn(),
}

impl Tracer<'_> {
    /// A picture of `samples` samples a pixel with `rays` shadow rays each, in blocks.
    fn trace(&self, samples: u32, rays: u32, seed: u64) -> Layer {
        let records = self.scene.proxy_records();
        let beside = self.scene.beside();
        let meshes: Vec<MeshRays> = beside.meshes().iter().map(MeshRays::new).collect();
        let mut film = Film::new(self.scene.size);
        for sample in 0..samples {
            // Directions of its own.
            let lights = SplitMix64::of_item(seed, u64::from(sample)).next_u64();
            let strands = &self.scene.strands;
            let integrator = Directional::new(
                strands,
                self.rays,
                self.fibres,
                &self.environment,
                rays * N_TURNS,
                lights,
            )
            .with_proxies(records.list())
            .with_meshes(&meshes);
            film.expose(self.scene, &integrator, 1, seed, &|_| ());
            (self.done)();
        }
        film.single().boxed(BLOCK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brute(points: &[(u32, f64, f64)]) -> BruteForce {
        let point = |&(samples, relative_rmse, core_seconds)| Point {
            samples,
            relative_rmse,
            core_seconds: Some(core_seconds),
        };
        BruteForce {
            rays: 24,
            hierarchy_core_seconds: Some(0.5),
            fibre_core_seconds: Some(0.25),
            points: points.iter().map(point).collect(),
        }
    }

    #[test]
    fn the_fit_is_that_of_numbers_by_hand() {
        let exact = brute(&[(1, 0.2, 1.0), (4, 0.1, 4.0), (16, 0.05, 16.0)]);
        assert!((exact.relative_rmse_of_one() - 0.2).abs() < 1e-12);
        assert!((exact.exponent().expect("three points") + 0.5).abs() < 1e-12);
        assert_eq!(exact.core_seconds_of_one(), Some(1.0));
        // Half the error, four times the samples; twice the error, a quarter.
        assert!((exact.samples_to(0.1) - 4.0).abs() < 1e-12);
        assert!((exact.samples_to(0.4) - 0.25).abs() < 1e-12);
        assert_eq!(brute(&[(2, 0.1, 1.0)]).exponent(), None);

        let mut peers = Peers {
            size: [8, 8],
            counts: [1, 2, 3],
            ours: Ours {
                relative_rmse: 0.1,
                core_seconds: Some(9.5),
                edit_core_seconds: Some(0.5),
            },
            brute_force: exact,
            truth_noise: 0.01,
        };
        let close = |found: Option<f64>, expected: f64| {
            assert!((found.expect("measured") - expected).abs() < 1e-12);
        };
        let [still, edited] = peers.core_seconds();
        close(still, 4.75);
        close(edited, 4.25);
        let [still, edited] = peers.ratios();
        close(still, 0.5);
        close(edited, 8.5);
        peers.ours.core_seconds = Some(0.0);
        assert_eq!(peers.ratios()[0], None);
        peers.ours.edit_core_seconds = None;
        assert_eq!(peers.ratios()[1], None);
        // Brute force that is too short for the clock costs something all the same.
        peers.ours.core_seconds = Some(0.1);
        peers.brute_force = brute(&[(1, 0.2, 0.0), (4, 0.1, 0.0)]);
        assert_eq!(peers.brute_force.core_seconds_of_one(), None);
        assert_eq!(peers.core_seconds(), [None; 2]);
        assert_eq!(peers.ratios(), [None; 2]);
    }
}
