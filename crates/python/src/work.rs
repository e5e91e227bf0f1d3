//! Long work: without the GIL, with progress, until Ctrl+C.
//!
//! The work runs in threads of its own while the calling one looks after Python: it asks for signals
//! and calls `progress`. If either raises, the work ends at the next step it reports, by unwinding.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use strandlight_scene::progress::{Progress, ProgressDisplay};

use crate::fault::{Fault, Outcome};

/// How often Python is looked after.
const TICK: Duration = Duration::from_millis(20);

/// What unwinds through cancelled work.
struct Cancelled;

/// How far some work is, and whether it is still wanted.
#[derive(Clone, Default)]
pub struct Watch(Arc<State>);

#[derive(Default)]
struct State {
    /// Bits of the share that is done: of floats from 0 on, they grow as the floats do.
    share: AtomicU64,
    steps: AtomicU64,
    is_cancelled: AtomicBool,
}

impl Watch {
    /// The share `done` of the work, 0..=1, is done. Does not return if the work was cancelled.
    pub fn reach(&self, done: f64) {
        let bits = done.clamp(0.0, 1.0).to_bits();
        self.0.share.fetch_max(bits, Ordering::Relaxed);
        self.check();
    }

    /// Does not return if the work was cancelled.
    pub fn check(&self) {
        if self.0.is_cancelled.load(Ordering::Relaxed) {
            // Unlike a panic, without a message.
            resume_unwind(Box::new(Cancelled));
        }
    }

    /// Progress of `total` steps.
    pub fn steps(&self, total: u64) -> Progress {
        Progress::new(Steps {
            watch: self.clone(),
            total,
        })
    }

    fn share(&self) -> f64 {
        f64::from_bits(self.0.share.load(Ordering::Relaxed))
    }
}

struct Steps {
    watch: Watch,
    total: u64,
}

impl ProgressDisplay for Steps {
    fn advance(&self, steps: u64) {
        let done = self.watch.0.steps.fetch_add(steps, Ordering::Relaxed) + steps;
        self.watch.reach(done as f64 / self.total.max(1) as f64);
    }

    fn reach(&self, steps: u64) {
        let done = self
            .watch
            .0
            .steps
            .fetch_max(steps, Ordering::Relaxed)
            .max(steps);
        self.watch.reach(done as f64 / self.total.max(1) as f64);
    }

    fn say(&self, _line: &str) {}

    fn finish(&self) {}
}

/// The threads that work; made anew in a forked process, which has none of its parent's.
fn pool() -> Outcome<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((owner, pool)) = &*kept
        && *owner == process
    {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool = Arc::new(pool.map_err(|error| Fault::new("io", error.to_string()))?);
    // Joining threads that are not there would hang.
    std::mem::forget(kept.replace((process, pool.clone())));
    Ok(pool)
}

/// Does `work`, and meanwhile calls `progress` with the share that is done: at least once, with 1 at
/// the end.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Watch) -> Outcome<T> + Send,
) -> PyResult<T> {
    let pool = pool().map_err(|fault| fault.raise(py))?;
    let watch = Watch::default();
    let progress = progress.as_ref();
    let (done, raised) = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = sync_channel::<()>(1);
            let worker = scope.spawn(|| {
                let watch = &watch;
                let done = catch_unwind(AssertUnwindSafe(|| pool.install(|| work(watch))));
                drop(sender);
                done
            });
            let mut raised = None;
            let mut shown = -1.0;
            while receiver.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = look_after_python(progress, watch.share(), &mut shown).err();
                    if raised.is_some() {
                        watch.0.is_cancelled.store(true, Ordering::Relaxed);
                    }
                }
            }
            let done = worker.join().unwrap_or_else(Err);
            (done, raised)
        })
    });
    // Work that was done before it saw that it was cancelled is not answered either.
    if let Some(error) = raised {
        return match done {
            Err(payload) if !payload.is::<Cancelled>() => Err(bug(py, payload)),
            _ => Err(error),
        };
    }
    let value = match done {
        Ok(done) => done.map_err(|fault| fault.raise(py))?,
        Err(payload) => return Err(bug(py, payload)),
    };
    py.check_signals()?;
    if let Some(progress) = progress {
        progress.call1(py, (1.0,))?;
    }
    Ok(value)
}

fn look_after_python(progress: Option<&Py<PyAny>>, share: f64, shown: &mut f64) -> PyResult<()> {
    Python::attach(|py| {
        py.check_signals()?;
        match progress {
            Some(progress) if share > *shown && share < 1.0 => {
                *shown = share;
                progress.call1(py, (share,)).map(drop)
            }
            _ => Ok(()),
        }
    })
}

/// A panic, which no input should lead to.
fn bug(py: Python<'_>, payload: Box<dyn Any + Send>) -> PyErr {
    let text = payload.downcast_ref::<String>().cloned();
    let text = text.or_else(|| {
        payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
    });
    let what = text.unwrap_or_else(|| "unknown".to_owned());
    Fault::new("bug", format!("this should not happen: {what}")).raise(py)
}
