//! Progress of long work: a bar on a terminal, plain lines otherwise, always on stderr.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// From now on nothing is said on stderr by the way.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Is nothing to be said on stderr but errors?
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Reports progress of one piece of work; share it freely between threads.
pub struct Progress {
    sink: Sink,
}

enum Sink {
    Silent,
    Bar(ProgressBar),
    Lines {
        label: String,
        total: u64,
        start: Instant,
        state: Mutex<(u64, u64)>,
    },
}

/// Work shorter than this says nothing where there is no bar.
const QUIET_SECONDS: f64 = 1.0;

impl Progress {
    /// Reports nothing; for tests and library callers.
    pub const fn silent() -> Self {
        Progress { sink: Sink::Silent }
    }

    /// A bar called `label` over `total` steps if stderr is a terminal; otherwise one line for
    /// each quarter done of work that takes longer than a second; nothing after [`be_quiet`].
    pub fn new(label: &str, total: u64) -> Self {
        if is_quiet() {
            return Progress::silent();
        }
        if std::io::stderr().is_terminal() {
            let style = ProgressStyle::with_template("{msg:20} [{bar:40}] {pos}/{len} {elapsed}")
                .unwrap_or_else(|_| ProgressStyle::default_bar())
                .progress_chars("=> ");
            let bar = ProgressBar::new(total)
                .with_style(style)
                .with_message(label.to_owned());
            Progress {
                sink: Sink::Bar(bar),
            }
        } else {
            let state = Mutex::new((0, 0));
            Progress {
                sink: Sink::Lines {
                    label: label.to_owned(),
                    total,
                    start: Instant::now(),
                    state,
                },
            }
        }
    }

    /// `steps` more are done.
    pub fn advance(&self, steps: u64) {
        match &self.sink {
            Sink::Silent => {}
            Sink::Bar(bar) => bar.inc(steps),
            Sink::Lines {
                label,
                total,
                start,
                state,
            } => {
                let Ok(mut state) = state.lock() else { return };
                state.0 += steps;
                let quarter = (state.0 * 4).checked_div(*total).unwrap_or(4).min(4);
                if quarter > state.1 && start.elapsed().as_secs_f64() > QUIET_SECONDS {
                    state.1 = quarter;
                    // The work goes on where nobody listens.
                    let _ = writeln!(std::io::stderr(), "{label}: {}%", quarter * 25);
                }
            }
        }
    }

    /// At least the first `steps` are done.
    pub fn reach(&self, steps: u64) {
        match &self.sink {
            Sink::Silent => {}
            Sink::Bar(bar) => bar.set_position(steps.max(bar.position())),
            Sink::Lines { state, .. } => {
                let before = state.lock().map_or(steps, |state| state.0);
                self.advance(steps.saturating_sub(before));
            }
        }
    }

    /// A line about the work, above the bar.
    pub fn say(&self, line: &str) {
        match &self.sink {
            Sink::Silent => {}
            Sink::Bar(bar) => bar.println(line),
            Sink::Lines { .. } => {
                let _ = writeln!(std::io::stderr(), "{line}");
            }
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        if let Sink::Bar(bar) = &self.sink {
            bar.finish_and_clear();
        }
    }
}

/// Runs `work` and returns its value and the seconds it took.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = work();
    (value, start.elapsed().as_secs_f64())
}
