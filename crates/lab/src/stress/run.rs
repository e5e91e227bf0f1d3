//! What all checks share: the target, the seed, and streams of random numbers.

use std::ops::Range;

use rayon::prelude::*;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scene::progress::Progress;

use super::draw::Random;
use super::point::{Evaluation, Group};
use super::report::{Tally, merge};
use super::target::{StressError, Target};
use super::values::Evaluated;

/// What to run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Random points a function; the checks that cost more take a fixed share of it.
    pub n: usize,
    /// Seed of every draw.
    pub seed: u64,
}

/// A run under way.
pub(super) struct Run<'a> {
    pub(super) target: &'a Target<'a>,
    pub(super) fresnel: Fresnel,
    pub(super) options: Options,
    pub(super) progress: &'a (dyn Fn(&str, u64) -> Progress + Sync),
}

impl Run<'_> {
    /// `work` of `n` (at least 1) streams of random numbers, in order.
    pub(super) fn each<T: Send>(
        &self,
        n: usize,
        purpose: u64,
        label: &str,
        work: impl Fn(&mut Random) -> Result<T, StressError> + Sync,
    ) -> Result<Vec<T>, StressError> {
        self.streams(0..n.max(1) as u64, purpose, label, work)
    }

    /// `groups` evaluated on both sides.
    pub(super) fn evaluate<P: Evaluation>(
        &self,
        label: &str,
        groups: Vec<Group<P>>,
    ) -> Result<Evaluated<P>, StressError> {
        let progress = (self.progress)(label, groups.len() as u64);
        let evaluated = Evaluated::new(self.target, groups, &progress);
        progress.finish();
        evaluated
    }

    /// As [`Run::each`], for work that fills tallies: those of all streams, merged place by place.
    ///
    /// Not every stream has a value for every tally. Where a small run leaves one empty, more
    /// streams are drawn, at most [`MAX_MORE`]: a check compares something, however small the run.
    pub(super) fn tallies<const N: usize>(
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
