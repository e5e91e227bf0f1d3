//! Global and local multiple scattering at extremes: finite, non-negative, twins.

use super::draw::{POINTS_PER_HAIR, Random, hair};
use super::multiple_point::{FUNCTIONS, Point, name};
use super::point::Group;
use super::report::Check;
use super::run::Run;
use super::target::StressError;

/// Purpose of the draws.
const PURPOSE: u64 = 40;

/// The checks, on about `n` random points.
pub(super) fn checks(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let groups = (0..n.div_ceil(POINTS_PER_HAIR).max(1) as u64).map(|stream| {
        let mut random = Random::new(run.options.seed, PURPOSE, stream);
        let hair = hair(&mut random);
        let points = (0..POINTS_PER_HAIR).map(|_| Point::draw(&mut random));
        let points = points.collect();
        Group { hair, points }
    });
    let evaluated = run.evaluate("multiple scattering", groups.collect())?;
    let mut checks = evaluated.finite("finite, multiple scattering").to_vec();
    let twins = |function| evaluated.twins(name(function), |point| point.function == function);
    checks.extend(FUNCTIONS.map(twins));
    Ok(checks)
}
