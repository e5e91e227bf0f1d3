//! From the picture on screen to ground truth: while nothing changes, paths of the exact fibre model
//! correct the finished picture, in a thread of their own.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use strandlight_cpu::{DisplayPixels, levels};
use strandlight_formats::LightsSection;
use strandlight_reference::converge::{Converged, Convergence, next_step};
use strandlight_reference::environment::LightSampler;
use strandlight_reference::{Environment, MAX_TRUTH_SAMPLES, TracedScene};
use strandlight_scattering::exact::BcsdfError;
use strandlight_scene::DisplayTransform;
use strandlight_scene::interactive::PictureProgress;
use strandlight_scene::{Picture, PreparedScene, RenderError};

use crate::apart::apart;
use crate::interactive::new_version;
use crate::truth_map::{KeptMap, TruthMapError};
use crate::work::{Work, WorkError};

/// How long nothing changes before paths are traced: what they need takes a while to make.
const REST: Duration = Duration::from_millis(400);

/// How often there is something new to show, about.
pub const PERIOD: Duration = Duration::from_millis(150);

/// Expected error at which the picture is good enough.
const GOAL: f64 = 0.01;

/// Samples of a step take this long, or as long as its picture.
const LONGEST: Duration = Duration::from_millis(1000);

/// The seed of all samples, that of `strandlight render --converge`.
const SEED: u64 = 0;

/// How far the picture on screen is from ground truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TruthProgress {
    /// Samples of each pixel.
    pub samples: u32,
    /// Relative RMSE of means over 4x4 pixels that is to be expected; infinite before there are samples.
    pub relative_error: f64,
    /// What it was for the picture that the samples correct; [`None`] where noise hides it, and before there are samples.
    pub relative_error_of_fast: Option<f64>,
    /// It is good enough, and nothing is traced any more.
    pub is_done: bool,
}

/// What cannot be traced.
#[derive(Debug, thiserror::Error)]
pub enum TruthError {
    /// Fibres without an exact model.
    #[error(transparent)]
    Fibres(#[from] BcsdfError),
    /// There is no picture to be corrected.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// There is no light of the map that the scene names.
    #[error("{}: lights.map: {source}", scene.display())]
    Map {
        /// The scene's file.
        scene: PathBuf,
        /// What is wrong with the map.
        source: Box<TruthMapError>,
    },
}

/// Ground truth of what a [`Viewer`](crate::Viewer) shows, from when it is asked for on.
#[derive(Default)]
pub struct GroundTruth {
    run: Option<Run>,
    /// Is nothing traced any more, as far as it was told?
    is_done: bool,
    /// A thread that is no longer wanted, and may not have noticed.
    ending: Option<JoinHandle<()>>,
    /// Since when nothing changes.
    rest: Option<Instant>,
    /// What is shown of the last picture.
    shown: Option<Shown>,
    /// What is wrong with the scene as it is.
    error: Option<TruthError>,
    /// The map that it is lit by; the light set where there is none.
    map: Option<PathBuf>,
    /// That of the last thread.
    kept_map: Arc<KeptMap>,
    /// Of the program that reads maps.
    work: Arc<Work>,
}

/// What is to be corrected.
pub struct Subject {
    /// The finished picture, over nothing.
    pub fast: Picture,
    /// What it shows.
    pub scene: PreparedScene,
    /// What it is lit by in place of the light set.
    pub map: Option<MapLight>,
}

/// The light of a map.
pub struct MapLight {
    /// The map.
    pub path: PathBuf,
    /// How it is turned and multiplied, and what is added.
    pub section: LightsSection,
    /// The scene's file, for what is said of it.
    pub scene: PathBuf,
}

/// A thread that traces paths until it is no longer wanted.
struct Run {
    is_wanted: Arc<AtomicBool>,
    found: Arc<Mutex<Found>>,
    thread: Option<JoinHandle<()>>,
}

/// What a thread has found so far.
#[derive(Default)]
struct Found {
    converged: Option<Arc<Converged>>,
    error: Option<TruthError>,
    is_done: bool,
}

/// A picture as a screen has it.
struct Shown {
    converged: Arc<Converged>,
    grade: (f32, DisplayTransform),
    pixels: Vec<[u8; 4]>,
    version: u64,
}

impl GroundTruth {
    /// What is shown is another thing now.
    pub fn set_outdated(&mut self) {
        if let Some(mut run) = self.run.take() {
            self.ending = run.thread.take();
        }
        (self.is_done, self.rest, self.shown, self.error) = (false, None, None, None);
    }

    /// The map that it is to be lit by; none for the light set.
    pub fn set_map(&mut self, map: Option<PathBuf>) {
        if self.map == map {
            return;
        }
        let old = std::mem::replace(&mut self.map, map);
        let files = [&old, &self.map].map(|map| map.as_ref()?.canonicalize().ok());
        // A scene that is saved elsewhere names the same file otherwise.
        if !matches!(&files, [Some(old), Some(new)] if old == new) {
            self.set_outdated();
        }
    }

    /// Is the finished picture wanted, to be corrected? `progress` is how far it is.
    pub fn wants_subject(&mut self, progress: &PictureProgress) -> bool {
        if !(progress.is_done && progress.is_shown) {
            self.rest = None;
            return false;
        }
        let rest = *self.rest.get_or_insert_with(Instant::now);
        // One scene after another: threads keep theirs until they end.
        let is_ending = self.ending.as_ref().is_some_and(|it| !it.is_finished());
        let is_free = self.run.is_none() && self.error.is_none() && !is_ending;
        is_free && rest.elapsed() >= REST
    }

    /// Traces nothing until something is changed.
    pub fn refuse(&mut self, error: TruthError) {
        self.error = Some(error);
    }

    /// Starts to trace, once [`GroundTruth::wants_subject`].
    pub fn start(&mut self, subject: Subject) {
        self.run = Some(Run::start(
            subject,
            self.kept_map.clone(),
            self.work.clone(),
        ));
    }

    /// Takes up what was found meanwhile, to be shown with `grade`: exposure in stops and display
    /// transform.
    pub fn follow(&mut self, (exposure, display): (f32, &DisplayTransform)) {
        let Some(run) = &self.run else {
            return;
        };
        // Before the lock: what was found last is there then.
        let is_over = run.thread.as_ref().is_none_or(JoinHandle::is_finished);
        let mut found = run.found.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(error) = found.error.take() {
            self.error = Some(error);
        }
        self.is_done = found.is_done || is_over;
        let Some(converged) = found.converged.clone() else {
            return;
        };
        drop(found);
        let scale = exposure.exp2();
        let is_shown = |shown: &Shown| {
            let (own_scale, own_display) = &shown.grade;
            let is_graded = *own_scale == scale && own_display == display;
            Arc::ptr_eq(&shown.converged, &converged) && is_graded
        };
        if self.shown.as_ref().is_some_and(is_shown) {
            return;
        }
        let mut pixels = self.shown.take().map_or(Vec::new(), |shown| shown.pixels);
        levels(&converged.picture, (scale, display), &mut pixels);
        self.shown = Some(Shown {
            converged,
            grade: (scale, display.clone()),
            pixels,
            version: new_version(),
        });
    }

    /// The picture; none before there is one.
    pub fn display(&self) -> Option<DisplayPixels<'_>> {
        let shown = self.shown.as_ref()?;
        let Picture { width, height, .. } = shown.converged.picture;
        Some(DisplayPixels {
            pixels: &shown.pixels,
            size: [width, height],
            version: shown.version,
        })
    }

    /// What is shown.
    pub fn converged(&self) -> Option<&Converged> {
        Some(&self.shown.as_ref()?.converged)
    }

    /// How far it is.
    pub fn progress(&self) -> TruthProgress {
        let is_done = self.is_done;
        let of_none = TruthProgress {
            samples: 0,
            relative_error: f64::INFINITY,
            relative_error_of_fast: None,
            is_done,
        };
        self.shown.as_ref().map_or(of_none, |shown| TruthProgress {
            samples: shown.converged.samples,
            relative_error: known(shown.converged.relative_error),
            relative_error_of_fast: shown.converged.relative_error_of_fast.map(known),
            is_done,
        })
    }

    /// What is wrong with the scene as it is.
    pub fn error(&self) -> Option<&TruthError> {
        self.error.as_ref()
    }

    /// Will there be something new without an edit?
    pub fn is_working(&self) -> bool {
        let has_begun = self.run.is_some() || self.rest.is_some();
        self.error.is_none() && has_begun && !self.is_done
    }
}

/// An error that is no number is not known.
fn known(error: f64) -> f64 {
    match error.is_nan() {
        true => f64::INFINITY,
        false => error,
    }
}

impl Run {
    fn start(subject: Subject, kept_map: Arc<KeptMap>, work: Arc<Work>) -> Run {
        let mut run = Run {
            is_wanted: Arc::new(AtomicBool::new(true)),
            found: Arc::default(),
            thread: None,
        };
        let (is_wanted, found) = (run.is_wanted.clone(), run.found.clone());
        run.thread = Some(std::thread::spawn(move || {
            // Not among the threads that trace: another program is waited for.
            match environment(&subject, &kept_map, &work) {
                Ok(Some(environment)) => {
                    apart(|| trace(subject, &environment, &is_wanted, &found));
                }
                Ok(None) => {}
                Err(error) => tell(&found, |found| {
                    (found.error, found.is_done) = (Some(error), true);
                }),
            }
        }));
        run
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        self.is_wanted.store(false, Ordering::Relaxed);
    }
}

impl Drop for GroundTruth {
    /// While it is there a map that is being read is read to its end, for the next picture.
    fn drop(&mut self) {
        self.work.stop();
    }
}

fn tell(found: &Mutex<Found>, change: impl FnOnce(&mut Found)) {
    change(&mut found.lock().unwrap_or_else(PoisonError::into_inner));
}

/// What `subject` is lit by; none where nobody waits for it any more.
fn environment(
    subject: &Subject,
    kept_map: &KeptMap,
    work: &Work,
) -> Result<Option<Environment>, TruthError> {
    let lights = &subject.scene.lights;
    let Some(light) = &subject.map else {
        return Ok(Some(Environment::Lights(LightSampler::new(lights))));
    };
    match kept_map.get(&light.path, work) {
        Ok(map) => {
            let section = &light.section;
            let environment = Environment::of_map(map.grid, &map.pixels, section, lights);
            Ok(Some(environment))
        }
        Err(TruthMapError::Work(WorkError::Stopped)) => Ok(None),
        Err(source) => Err(TruthError::Map {
            scene: light.scene.clone(),
            source: Box::new(source),
        }),
    }
}

/// Traces `subject` until it is good enough or no longer wanted, and tells each picture.
fn trace(
    subject: Subject,
    environment: &Environment,
    is_wanted: &AtomicBool,
    found: &Mutex<Found>,
) {
    let Subject { fast, scene, .. } = subject;
    let wanted = || is_wanted.load(Ordering::Relaxed);
    if !wanted() {
        return;
    }
    let traced = match TracedScene::new(&scene) {
        Ok(traced) => traced,
        Err(error) => {
            return tell(found, |found| {
                (found.error, found.is_done) = (Some(error.into()), true);
            });
        }
    };
    let tracer = traced.tracer(environment);
    let tracer = tracer.with_scattering(scene.scattering());
    if !wanted() {
        return;
    }
    let mut convergence = Convergence::new(fast, &scene, SEED);
    let mut next = 2;
    loop {
        let start = Instant::now();
        if convergence
            .trace_while(&scene, &tracer, next, &wanted)
            .is_none()
        {
            return;
        }
        let traced = start.elapsed();
        let converged = Arc::new(convergence.converged());
        let samples = converged.samples;
        let is_done = converged.relative_error <= GOAL || samples >= MAX_TRUTH_SAMPLES;
        tell(found, |found| {
            (found.converged, found.is_done) = (Some(converged.clone()), is_done);
        });
        if is_done || !wanted() {
            return;
        }
        let of_one = traced.as_secs_f64() / f64::from(next);
        let of_picture = (start.elapsed() - traced).as_secs_f64();
        next = next_step(samples, [of_one, of_picture], LONGEST);
    }
}
