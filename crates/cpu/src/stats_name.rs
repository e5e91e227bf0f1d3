//! What draws, as statistics name it.

use strandlight_formats::counted;

/// The processor, and how many threads it draws with.
pub(super) fn stats_name() -> String {
    let threads = counted(rayon::current_num_threads(), "thread", "threads");
    format!("cpu: {threads}")
}
