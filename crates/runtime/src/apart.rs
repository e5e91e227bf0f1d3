//! Threads for what is worked on beside the window.

use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Does `work` by threads of its own: with those that edits and the renderer use, the window would wait for it.
pub(crate) fn apart<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static THREADS: OnceLock<Option<ThreadPool>> = OnceLock::new();
    match THREADS.get_or_init(|| ThreadPoolBuilder::new().build().ok()) {
        Some(threads) => threads.install(work),
        None => work(),
    }
}
