//! How long work on the device takes, and how much of it fits a budget.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use web_time::Instant;

use crate::gpu::Context;
use crate::passes::resources::failed;
use strandlight_scene::RenderError;

/// What a unit of work of a kind never seen before is taken for, seconds a step.
const UNKNOWN: f64 = 2e-3;

/// Work is waited for in lots of about this many seconds: waiting costs a
/// fast device more than small steps do.
const LOT: f64 = 5e-3;

/// Collected commands are submitted at least this often, seconds: the device works on them while others are recorded.
const SUBMISSION: f64 = 0.4e-3;

/// Most submissions in flight where the caller does not wait for them.
const MOST_IN_FLIGHT: u32 = 32;

/// A finished lot: its stage, runs, units and seconds.
pub(super) type Finished = (&'static str, u32, f64, f64);

/// Learns how fast the device is.
pub(super) struct Pacer {
    /// Waits for each lot; else the device's answers come when they come.
    is_waiting: bool,
    /// Seconds a unit, by stage.
    rates: Vec<(&'static str, f64)>,
    lot: Option<Lot>,
    flight: Arc<Mutex<Flight>>,
    start: Instant,
    budget: f64,
    /// Seconds of work submitted in this turn, by estimate.
    submitted: f64,
}

/// Steps that were not waited for: of one stage, or of all whose commands were collected together.
struct Lot {
    stages: Vec<InLot>,
    /// By estimate.
    seconds: f64,
    /// Of that, what was not submitted by the pacer.
    collected: f64,
    start: Instant,
}

/// What a lot has of a stage.
struct InLot {
    stage: &'static str,
    runs: u32,
    units: f64,
    /// By estimate.
    seconds: f64,
    /// It is not a guess.
    is_known: bool,
}

impl Lot {
    fn new(start: Instant) -> Lot {
        Lot {
            stages: Vec::new(),
            seconds: 0.0,
            collected: 0.0,
            start,
        }
    }

    fn add(&mut self, stage: &'static str, units: f64, (seconds, is_known): (f64, bool)) {
        self.seconds += seconds;
        self.collected += seconds;
        match self.stages.iter_mut().find(|of| of.stage == stage) {
            Some(of) => {
                of.runs += 1;
                of.units += units;
                of.seconds += seconds;
            }
            None => self.stages.push(InLot {
                stage,
                runs: 1,
                units,
                seconds,
                is_known,
            }),
        }
    }
}

/// What is under way.
#[derive(Default)]
struct Flight {
    n: u32,
    seconds: f64,
    last_done: Option<Instant>,
    finished: Vec<Finished>,
}

impl Pacer {
    /// Waits for the device where that is possible.
    pub fn new(is_waiting: bool) -> Pacer {
        Pacer {
            is_waiting,
            rates: Vec::new(),
            lot: None,
            flight: Arc::default(),
            start: Instant::now(),
            budget: 0.0,
            submitted: 0.0,
        }
    }

    /// Does it wait for the device?
    pub fn is_waiting(&self) -> bool {
        self.is_waiting
    }

    /// Starts a turn of `budget`; tells `note` of what was finished since the last one.
    pub fn begin(&mut self, budget: Duration, note: impl FnMut(Finished)) {
        self.start = Instant::now();
        self.budget = budget.as_secs_f64();
        let mut flight = self.flight.lock().unwrap_or_else(PoisonError::into_inner);
        self.submitted = flight.seconds;
        let finished = std::mem::take(&mut flight.finished);
        drop(flight);
        for &(stage, _, units, seconds) in &finished {
            if units > 0.0 {
                self.learn(stage, units, seconds);
            }
        }
        finished.into_iter().for_each(note);
    }

    /// Is there time for a step of `units`? The first step of a turn always is, unless the device
    /// is behind.
    pub fn has_time(&self, stage: &'static str, units: f64, is_first: bool) -> bool {
        let estimate = self.estimate(stage, units);
        if self.is_waiting {
            // The device works on a lot while the rest of it is recorded.
            let ahead = self.lot.as_ref().map_or(0.0, |lot| {
                (lot.seconds - lot.start.elapsed().as_secs_f64()).max(0.0)
            });
            let spent = self.start.elapsed().as_secs_f64() + ahead;
            return is_first || spent + 0.5 * estimate < self.budget;
        }
        let flight = self.flight.lock().unwrap_or_else(PoisonError::into_inner);
        if is_first {
            return flight.seconds < self.budget && flight.n < MOST_IN_FLIGHT;
        }
        flight.n < MOST_IN_FLIGHT && self.submitted + 0.5 * estimate < self.budget
    }

    /// Seconds that `units` of a stage take.
    fn estimate(&self, stage: &'static str, units: f64) -> f64 {
        self.rate(stage).map_or(UNKNOWN, |rate| rate * units)
    }

    /// Seconds a unit of a stage takes, once known.
    pub fn rate(&self, stage: &'static str) -> Option<f64> {
        let mut rates = self.rates.iter();
        rates
            .find(|(name, _)| *name == stage)
            .map(|(_, rate)| *rate)
    }

    /// The next step began at `start`, unless there were others before it.
    pub fn began(&mut self, start: Instant) {
        if self.is_waiting {
            self.lot.get_or_insert_with(|| Lot::new(start));
        }
    }

    /// Says that a step of so many units was submitted, or collected, and whether they were counted. Nothing is learnt
    /// from those that were not.
    ///
    /// # Errors
    /// The device failed.
    pub fn submitted(
        &mut self,
        context: &Context,
        stage: &'static str,
        (units, are_counted): (f64, bool),
        mut note: impl FnMut(Finished),
    ) -> Result<(), RenderError> {
        let (estimate, is_known) = (self.estimate(stage, units), self.rate(stage).is_some());
        let units = if are_counted { units } else { 0.0 };
        self.submitted += estimate;
        if !self.is_waiting {
            self.watch(context, stage, units, estimate);
            return Ok(());
        }
        let is_other = |lot: &Lot| lot.stages.last().is_some_and(|of| of.stage != stage);
        if !context.is_collecting() && self.lot.as_ref().is_some_and(is_other) {
            self.flush(context, &mut note)?;
        }
        let lot = (self.lot).get_or_insert_with(|| Lot::new(Instant::now()));
        lot.add(stage, units, (estimate, is_known));
        // What a stage takes that nothing is known of is measured alone.
        if lot.seconds >= LOT || !is_known {
            self.flush(context, note)?;
        } else if lot.collected >= SUBMISSION {
            lot.collected = 0.0;
            context.flush();
        }
        Ok(())
    }

    /// Waits for what was submitted, where anybody waits. Each stage has its share of the time by the estimates; those
    /// of which nothing was known have what the others leave.
    ///
    /// # Errors
    /// The device failed.
    pub fn flush(
        &mut self,
        context: &Context,
        mut note: impl FnMut(Finished),
    ) -> Result<(), RenderError> {
        let Some(lot) = self.lot.take() else {
            return Ok(());
        };
        let Some(last) = lot.stages.last() else {
            return Ok(());
        };
        context.wait(last.stage).map_err(failed)?;
        let elapsed = lot.start.elapsed().as_secs_f64();
        let of = |is_known| {
            let of = lot.stages.iter().filter(|of| of.is_known == is_known);
            of.map(|of| of.seconds).sum::<f64>()
        };
        let (known, guessed) = (of(true), of(false));
        let has_guess = guessed > 0.0 && elapsed > known;
        let [of_known, of_guessed] = match has_guess {
            true => [1.0, (elapsed - known) / guessed],
            false => [elapsed / (known + guessed).max(1e-12); 2],
        };
        for of in lot.stages {
            let seconds = of.seconds * if of.is_known { of_known } else { of_guessed };
            let is_measured = of.units > 0.0 && !(has_guess && of.is_known);
            if is_measured {
                self.learn(of.stage, of.units, seconds);
            }
            note((of.stage, of.runs, of.units, seconds));
        }
        Ok(())
    }

    /// Counts a submission as in flight until the device has done it.
    fn watch(&self, context: &Context, stage: &'static str, units: f64, estimate: f64) {
        let lock = |flight: &Arc<Mutex<Flight>>, work: &dyn Fn(&mut Flight)| {
            work(&mut flight.lock().unwrap_or_else(PoisonError::into_inner));
        };
        lock(&self.flight, &|flight| {
            flight.n += 1;
            flight.seconds += estimate;
        });
        let (flight, start) = (Arc::clone(&self.flight), Instant::now());
        context.queue.on_submitted_work_done(move || {
            lock(&flight, &|flight| {
                let now = Instant::now();
                let since = flight.last_done.map_or(start, |last| last.max(start));
                let seconds = now.duration_since(since).as_secs_f64();
                flight.last_done = Some(now);
                flight.n -= 1;
                flight.seconds = match flight.n {
                    0 => 0.0,
                    _ => (flight.seconds - estimate).max(0.0),
                };
                flight.finished.push((stage, 1, units, seconds));
            });
        });
    }

    /// Notes how long so many units took.
    pub fn learn(&mut self, stage: &'static str, units: f64, seconds: f64) {
        let rate = seconds / units.max(1e-9);
        match self.rates.iter_mut().find(|(name, _)| *name == stage) {
            Some((_, known)) => *known += 0.3 * (rate - *known),
            None => self.rates.push((stage, rate)),
        }
    }
}
