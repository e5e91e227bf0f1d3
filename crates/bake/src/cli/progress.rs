//! Progress of long work: a bar on a terminal, plain lines otherwise, always on stderr.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use strandlight_scene::progress::{Progress, ProgressDisplay};

static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// From now on only errors are written to stderr.
pub fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// Are only errors written to stderr?
pub fn is_quiet() -> bool {
    IS_QUIET.load(Ordering::Relaxed)
}

/// Where there is no bar, work shorter than this prints no progress.
const QUIET_SECONDS: f64 = 1.0;

/// A bar called `label` over `total` steps if stderr is a terminal; otherwise one line for each
/// quarter of work that takes longer than a second; nothing after [`be_quiet`].
pub fn progress(label: &str, total: u64) -> Progress {
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
        Progress::new(Bar(bar))
    } else {
        Progress::new(Lines {
            label: label.to_owned(),
            total,
            start: Instant::now(),
            state: Mutex::new((0, 0)),
        })
    }
}

/// A bar on a terminal.
struct Bar(ProgressBar);

impl ProgressDisplay for Bar {
    fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }

    fn reach(&self, steps: u64) {
        self.0.set_position(steps.max(self.0.position()));
    }

    fn say(&self, line: &str) {
        self.0.println(line);
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Lines in a log.
struct Lines {
    label: String,
    total: u64,
    start: Instant,
    /// Steps done, and quarters printed.
    state: Mutex<(u64, u64)>,
}

impl ProgressDisplay for Lines {
    fn advance(&self, steps: u64) {
        let Ok(mut state) = self.state.lock() else {
            return;
        };
        state.0 += steps;
        let quarter = (state.0 * 4).checked_div(self.total).unwrap_or(4).min(4);
        if quarter > state.1 && self.start.elapsed().as_secs_f64() > QUIET_SECONDS {
            state.1 = quarter;
            // A closed stderr does not stop the work.
            let _ = writeln!(std::io::stderr(), "{}: {}%", self.label, quarter * 25);
        }
    }

    fn reach(&self, steps: u64) {
        let before = self.state.lock().map_or(steps, |state| state.0);
        self.advance(steps.saturating_sub(before));
    }

    fn say(&self, line: &str) {
        let _ = writeln!(std::io::stderr(), "{line}");
    }

    fn finish(&self) {}
}
