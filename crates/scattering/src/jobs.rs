//! Work that whoever has threads may do at once.

/// A part of some work; all parts can be done at once.
pub struct Job<'a>(Box<dyn FnOnce() + Send + 'a>);

impl<'a> Job<'a> {
    /// Of what `work` does.
    pub(crate) fn new(work: impl FnOnce() + Send + 'a) -> Job<'a> {
        Job(Box::new(work))
    }

    /// Does it.
    pub fn run(self) {
        (self.0)();
    }
}

/// Runs all jobs, one after the other.
pub fn in_turn(jobs: Vec<Job>) {
    jobs.into_iter().for_each(Job::run);
}

/// Fills `places` with what `value` answers for each, so many in a job.
pub(crate) fn fill<T: Send>(
    places: &mut [T],
    in_a_job: usize,
    value: impl Fn(usize) -> T + Sync,
    run: impl FnOnce(Vec<Job>),
) {
    let value = &value;
    let parts = places.chunks_mut(in_a_job).enumerate();
    let job = |(part, places): (usize, &mut [T])| {
        for (ix, place) in places.iter_mut().enumerate() {
            *place = value(part * in_a_job + ix);
        }
    };
    run(parts.map(|part| Job::new(move || job(part))).collect());
}
