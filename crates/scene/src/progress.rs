//! Progress of long work, reported to whoever started it.

use std::time::Duration;

use web_time::Instant;

/// Shows the progress of one piece of work; called from any thread.
pub trait ProgressDisplay: Send + Sync {
    /// `steps` more are done.
    fn advance(&self, steps: u64);

    /// At least the first `steps` are done.
    fn reach(&self, steps: u64);

    /// A line about the work.
    fn say(&self, line: &str);

    /// The work is done.
    fn finish(&self);
}

/// Reports the progress of one piece of work; share it freely between threads.
pub struct Progress {
    display: Option<Box<dyn ProgressDisplay>>,
}

impl Progress {
    /// Reports nothing; for tests and library callers.
    pub const fn silent() -> Self {
        Progress { display: None }
    }

    /// Reports to `display`.
    pub fn new(display: impl ProgressDisplay + 'static) -> Self {
        Progress {
            display: Some(Box::new(display)),
        }
    }

    /// `steps` more are done.
    pub fn advance(&self, steps: u64) {
        if let Some(display) = &self.display {
            display.advance(steps);
        }
    }

    /// At least the first `steps` are done.
    pub fn reach(&self, steps: u64) {
        if let Some(display) = &self.display {
            display.reach(steps);
        }
    }

    /// A line about the work.
    pub fn say(&self, line: &str) {
        if let Some(display) = &self.display {
            display.say(line);
        }
    }

    /// The work is done.
    pub fn finish(&self) {
        if let Some(display) = &self.display {
            display.finish();
        }
    }
}

/// The end of some time.
#[derive(Clone, Copy, Debug)]
pub struct Deadline(Instant);

/// Longest time to a deadline: a year.
const LONGEST: Duration = Duration::from_secs(365 * 24 * 3600);

impl Deadline {
    /// After so much time from now.
    pub fn after(time: Duration) -> Deadline {
        // Clocks end somewhere.
        Deadline(Instant::now() + time.min(LONGEST))
    }

    /// Time until then.
    pub fn left(&self) -> Duration {
        self.0.saturating_duration_since(Instant::now())
    }

    /// Is it still to come?
    pub fn is_to_come(&self) -> bool {
        Instant::now() < self.0
    }
}

/// Runs `work` and returns its value and the seconds it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = work();
    (value, start.elapsed().as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deadlines_can_be_as_late_as_may_be() {
        assert!(Deadline::after(Duration::MAX).is_to_come());
        let now = Deadline::after(Duration::ZERO);
        assert!(!now.is_to_come() && now.left().is_zero());
    }
}
