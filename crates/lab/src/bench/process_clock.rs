//! Time that this process has been on any core, which other programs on the machine do not add to.

/// Seconds of all cores together, ended threads included, where the system tells: on Linux, in steps
/// of 10 ms.
pub(super) fn core_seconds() -> Option<f64> {
    ticks(&std::fs::read_to_string("/proc/self/stat").ok()?).map(|ticks| 1e-2 * ticks as f64)
}

/// Seconds since [`core_seconds`] was `before`.
pub(super) fn since(before: Option<f64>) -> Option<f64> {
    Some(core_seconds()? - before?)
}

/// What `work` answers, and the seconds of all cores that it took.
pub(super) fn clocked<T>(work: impl FnOnce() -> T) -> (T, Option<f64>) {
    let before = core_seconds();
    let value = work();
    (value, since(before))
}

/// `utime` and `stime` of a line of `/proc/PID/stat`, in 1/100 s. The program's name before them may
/// have spaces and parentheses.
fn ticks(stat: &str) -> Option<u64> {
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_whitespace().skip(11);
    let mut field = || fields.next()?.parse::<u64>().ok();
    Some(field()? + field()?)
}

#[cfg(test)]
mod tests {
    #[test]
    fn user_and_system_time_add_up() {
        let stat = "7 (a (b) c) R 1 1 1 0 -1 4194304 99 0 0 0 250 31 5 6 20 0 1 0 2873218";
        assert_eq!(super::ticks(stat), Some(281));
        assert_eq!(super::ticks("7 (a) R 1 2"), None);
        assert_eq!(super::ticks(""), None);
    }
}
