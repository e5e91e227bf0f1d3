//! Numerical stress of single and multiple scattering: what the renderer evaluates, in f32 on the
//! CPU and as WGSL on the adapter, against the exact model in f64, at corners and random extremes.
//!
//! - [`Target`]: the scheme under test.
//! - [`run()`]: all checks; the same seed gives the same [`Report`] on any number of threads.
//! - [`Report`]: checks with their worst cases and all inputs of these.

mod accuracy;
mod continuity;
mod draw;
mod energy;
mod invalid;
mod multiple;
mod point;
mod report;
mod symmetry;
mod target;
mod values;

use std::ops::Range;

use rayon::prelude::*;
use strandlight_scattering::closed_form::MAX_NODES;
use strandlight_scattering::fresnel::Fresnel;

use draw::{Domain, Random};
use report::{Tally, merge};
use strandlight_scene::progress::Progress;
use values::Evaluated;

pub use invalid::ParseQuery;
pub(crate) use point::hair_json;
pub use report::{Check, Report, Status, Worst};
pub use target::{StressError, Target};

/// Why checks of the adapter were not run.
const NO_ADAPTER: &str = "no adapter";

/// What to run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Random points a function; the checks that cost more take a fixed share of it.
    pub n: usize,
    /// Seed of every draw.
    pub seed: u64,
}

/// A run under way.
struct Run<'a> {
    target: &'a Target<'a>,
    fresnel: Fresnel,
    options: Options,
    progress: &'a (dyn Fn(&str, u64) -> Progress + Sync),
}

impl Run<'_> {
    /// `work` of `n` (at least 1) streams of random numbers, in order.
    fn each<T: Send>(
        &self,
        n: usize,
        purpose: u64,
        label: &str,
        work: impl Fn(&mut Random) -> Result<T, StressError> + Sync,
    ) -> Result<Vec<T>, StressError> {
        self.streams(0..n.max(1) as u64, purpose, label, work)
    }

    /// As [`Run::each`], for work that fills tallies: those of all streams, merged place by place.
    ///
    /// Not every stream has a value for every tally. Where a small run leaves one empty, more
    /// streams are drawn, at most [`MAX_MORE`]: a check compares something, however small the run.
    fn tallies<const N: usize>(
        &self,
        n: usize,
        purpose: u64,
        label: &str,
        work: impl Fn(&mut Random) -> Result<[Tally; N], StressError> + Sync,
    ) -> Result<[Tally; N], StressError> {
        let mut tallies = merge(self.each(n, purpose, label, &work)?);
        let mut drawn = n.max(1) as u64;
        let end = drawn + MAX_MORE;
        while drawn < end && tallies.iter().any(Tally::is_empty) {
            let more = self.streams(drawn..drawn + MORE, purpose, label, &work)?;
            tallies = merge([vec![tallies], more].concat());
            drawn += MORE;
        }
        Ok(tallies)
    }

    /// `work` of some streams of random numbers, in order.
    fn streams<T: Send>(
        &self,
        streams: Range<u64>,
        purpose: u64,
        label: &str,
        work: impl Fn(&mut Random) -> Result<T, StressError> + Sync,
    ) -> Result<Vec<T>, StressError> {
        let progress = (self.progress)(label, streams.end - streams.start);
        let all = streams
            .into_par_iter()
            .map(|stream| {
                let value = work(&mut Random::new(self.options.seed, purpose, stream));
                progress.advance(1);
                value
            })
            .collect();
        progress.finish();
        all
    }
}

/// Streams drawn at a time where a tally is empty, and at most.
const MORE: u64 = 8;
/// See [`MORE`].
const MAX_MORE: u64 = 512;

/// Runs all checks of `target`.
///
/// # Errors
/// The adapter failed. Failed checks are in the report.
pub fn run(
    target: &Target,
    options: Options,
    parse_query: ParseQuery,
    progress: &(dyn Fn(&str, u64) -> Progress + Sync),
) -> Result<Report, StressError> {
    let run = Run {
        target,
        fresnel: target.fresnel(),
        options,
        progress,
    };
    let n = options.n;
    let mut checks = Vec::new();
    let evaluate = |label: &str, groups: Vec<point::Group>| {
        let progress = (run.progress)(label, groups.len() as u64);
        let evaluated = Evaluated::new(target, groups, &progress);
        progress.finish();
        evaluated
    };
    checks.extend(evaluate("corners", draw::corners())?.finite("finite, corners"));
    let extremes = evaluate("extremes", draw::extremes(options.seed, 0, n))?;
    checks.extend(extremes.finite("finite, random extremes"));
    checks.extend(extremes.twins());
    drop(extremes);
    if target.has_nodes() {
        checks.extend(multiple::checks(&run, n)?);
    }
    let share = |part: usize| n.div_ceil(part);
    checks.extend(energy::under_constant_light(&run, share(25))?);
    checks.extend(energy::over_azimuth(&run, share(200))?);
    for domain in [Domain::Ordinary, Domain::Extreme] {
        checks.extend(energy::wide_light(&run, share(250), domain)?);
        checks.extend(energy::over_views(&run, share(500), domain, None)?);
        checks.extend(energy::furnace(&run, share(250), domain)?);
    }
    if target.has_nodes() {
        let nodes = Some(MAX_NODES);
        checks.extend(energy::over_views(
            &run,
            share(500),
            Domain::Extreme,
            nodes,
        )?);
    }
    checks.extend(symmetry::checks(&run, n)?);
    checks.extend(continuity::checks(&run, share(2000))?);
    checks.extend(accuracy::against_exact(&run, share(200))?);
    checks.extend(accuracy::rounding(&run, share(4))?);
    checks.extend(invalid::checks(parse_query));
    Ok(Report {
        scheme: target.scheme(),
        adapter: target.adapter().map(str::to_owned),
        n: n as u64,
        seed: options.seed,
        checks,
    })
}
