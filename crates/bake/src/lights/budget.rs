//! The smallest light set within an error budget, and the error against the number of lights.
//!
//! The error falls with the number of lights but not at every step: another count is another
//! search. So the smallest set is sought among counts of a ladder first, from below, and then
//! between the last rung that misses and the first that meets the budget, until the count found
//! meets it and the one below, which was fitted too, does not.

use std::collections::BTreeMap;

use strandlight_images::Map;
use strandlight_scattering::HairParams;
use strandlight_scene::progress::{Progress, timed};

use super::fit::{Fit, FitError, FitOptions, Fitter, MAX_FITTED_LIGHTS};
use super::report::Judge;
use super::response::Response;

/// Counts that are tried first: steps of a third to a half.
const LADDER: [usize; 20] = [
    1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024,
];

/// Most counts tried between two rungs: halving the widest gap every other time.
const MOST_BETWEEN: u64 = 16;

/// The error that a budget limits; see [`evaluate`](super::evaluate).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metric {
    /// Of what fibres scatter.
    #[default]
    Fibre,
    /// Of the irradiance.
    Irradiance,
}

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 2] = [Metric::Fibre, Metric::Irradiance];

    /// Name in flags and JSON: `fibre`, `irradiance`.
    pub const fn name(self) -> &'static str {
        match self {
            Metric::Fibre => "fibre",
            Metric::Irradiance => "irradiance",
        }
    }

    /// The error of a point of a curve.
    pub fn of(self, point: &CountError) -> f64 {
        match self {
            Metric::Fibre => point.fibre_error,
            Metric::Irradiance => point.irradiance_error,
        }
    }
}

/// A limit on the error of a light set.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Largest error, a fraction.
    pub max_error: f64,
    /// Which error.
    pub metric: Metric,
    /// Most lights, 1..=[`MAX_FITTED_LIGHTS`].
    pub max_count: usize,
    /// Seed of every fit.
    pub seed: u64,
    /// Hair whose fibres measure the fibre error, instead of the default's.
    pub hair: Option<HairParams>,
}

impl Budget {
    /// Most steps that [`fit_to_budget`] reports to its progress, one a fit.
    pub fn steps(&self) -> u64 {
        ladder(self.max_count).count() as u64 + MOST_BETWEEN
    }
}

/// The errors of a fit of so many lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CountError {
    /// Lights asked for.
    pub count: usize,
    /// Lights found.
    pub lights: usize,
    /// Those of them that stand for compact sources.
    pub compact_lights: usize,
    /// Fibre error, of the hair asked for.
    pub fibre_error: f64,
    /// Irradiance error.
    pub irradiance_error: f64,
}

/// A fit chosen among several.
#[derive(Clone, Debug)]
pub struct ChosenFit {
    /// The fit, as [`fit`](super::fit()) with that count makes it, bit for bit; its `seconds` are
    /// those of all fits together, and of measuring them.
    pub fit: Fit,
    /// Its place on the curve.
    pub point: CountError,
    /// Every count that was fitted, ascending.
    pub curve: Vec<CountError>,
}

/// The smallest light set within a budget: its error is at most the limit; that of one light less
/// is not; nor is that of any rung of the ladder below. If no count that was tried keeps the budget,
/// the last of them being `max_count`, the fit of the smallest error is the answer: compare
/// [`Metric::of`] its point with the limit.
///
/// # Errors
/// As [`fit`](super::fit()).
pub fn fit_to_budget(
    map: &Map,
    budget: Budget,
    progress: &Progress,
) -> Result<ChosenFit, FitError> {
    check_count(budget.max_count)?;
    let mut trials = Trials::new(map, budget.seed, budget.hair.as_ref())?;
    let error_of = |(_, point): &(Fit, CountError)| budget.metric.of(point);
    // What misses and what meets the limit, or the best so far.
    let mut low: Option<(usize, f64)> = None;
    let mut best: Option<(Fit, CountError)> = None;
    let mut is_met = false;
    for count in ladder(budget.max_count) {
        let trial = trials.fit(count)?;
        progress.advance(1);
        let error = error_of(&trial);
        is_met = error <= budget.max_error;
        if is_met || best.as_ref().is_none_or(|best| error < error_of(best)) {
            best = Some(trial);
        }
        if is_met {
            break;
        }
        low = Some((count, error));
    }
    // The ladder has one rung at least.
    let Some(mut best) = best else {
        return Err(FitError::Count(0));
    };
    let mut is_slow = false;
    while let Some((below, error_below)) =
        low.filter(|(below, _)| is_met && best.1.count > below + 1)
    {
        let above = (best.1.count, error_of(&best));
        let gap = above.0 - below;
        let count = match is_slow {
            true => below + gap / 2,
            false => interpolated((below, error_below), above, budget.max_error),
        };
        let trial = trials.fit(count)?;
        progress.advance(1);
        let error = error_of(&trial);
        if error <= budget.max_error {
            best = trial;
        } else {
            low = Some((count, error));
        }
        let left = best.1.count - low.map_or(0, |(below, _)| below);
        is_slow = 2 * left > gap;
    }
    progress.reach(budget.steps());
    Ok(trials.chosen(best))
}

/// A fit of `options.count` lights with the errors of the counts of the ladder below, and of one
/// above: whether fewer lights would do, or more would help.
///
/// # Errors
/// As [`fit`](super::fit()).
pub fn fit_with_curve(
    map: &Map,
    options: FitOptions,
    hair: Option<&HairParams>,
    progress: &Progress,
) -> Result<ChosenFit, FitError> {
    check_count(options.count)?;
    let mut trials = Trials::new(map, options.seed, hair)?;
    for count in counts_about(options.count).filter(|count| *count != options.count) {
        trials.fit(count)?;
        progress.advance(1);
    }
    let chosen = trials.fit(options.count)?;
    progress.advance(1);
    Ok(trials.chosen(chosen))
}

/// Steps that [`fit_with_curve`] reports to its progress.
pub fn curve_steps(count: usize) -> u64 {
    counts_about(count).count() as u64
}

/// The error of a set by the fibres of a given hair; see [`evaluate`](super::evaluate).
pub fn fibre_error_of(lights: &strandlight_formats::LightSet, map: &Map, hair: &HairParams) -> f64 {
    Judge::new(map, &Response::of(hair)).errors(lights).fibre
}

fn check_count(count: usize) -> Result<(), FitError> {
    match (1..=MAX_FITTED_LIGHTS).contains(&count) {
        true => Ok(()),
        false => Err(FitError::Count(count)),
    }
}

/// The rungs below `top`, and `top`.
fn ladder(top: usize) -> impl Iterator<Item = usize> {
    let below = LADDER.into_iter().take_while(move |rung| *rung < top);
    below.chain([top])
}

/// The rungs below `count`, `count`, and a rung above by a third at least.
fn counts_about(count: usize) -> impl Iterator<Item = usize> {
    let mut above = LADDER.into_iter();
    let above = above.find(move |rung| 3 * rung >= 4 * count);
    ladder(count).chain(above)
}

/// A count between both, which are not neighbours: where a line through their errors, both axes
/// logarithmic, reaches `limit`.
fn interpolated(below: (usize, f64), above: (usize, f64), limit: f64) -> usize {
    let [x0, x1] = [below.0, above.0].map(|count| (count as f64).ln());
    let share = (below.1 / limit).ln() / (below.1 / above.1).ln();
    let x = (x0 + share.clamp(0.0, 1.0) * (x1 - x0)).exp().ceil();
    // An error of 0 makes no number of it.
    let count = if x.is_finite() { x as usize } else { above.0 };
    count.clamp(below.0 + 1, above.0 - 1)
}

/// Fits of one map, and their errors.
struct Trials<'a> {
    fitter: Fitter<'a>,
    judge: Judge<'a>,
    curve: BTreeMap<usize, CountError>,
    seconds: Vec<(&'static str, f64)>,
}

impl<'a> Trials<'a> {
    fn new(map: &'a Map, seed: u64, hair: Option<&HairParams>) -> Result<Trials<'a>, FitError> {
        let fitter = Fitter::new(map, seed)?;
        let response = hair.map_or_else(Response::default, Response::of);
        let (judge, time) = timed(|| Judge::new(map, &response));
        Ok(Trials {
            fitter,
            judge,
            curve: BTreeMap::new(),
            seconds: vec![("errors", time)],
        })
    }

    fn fit(&mut self, count: usize) -> Result<(Fit, CountError), FitError> {
        let fit = self.fitter.fit(count, &Progress::silent())?;
        let (errors, time) = timed(|| self.judge.errors(&fit.lights));
        for (name, seconds) in fit.seconds.iter().copied().chain([("errors", time)]) {
            match self.seconds.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += seconds,
                None => self.seconds.push((name, seconds)),
            }
        }
        let point = CountError {
            count,
            lights: fit.lights.lights.len(),
            compact_lights: fit.suns,
            fibre_error: errors.fibre,
            irradiance_error: errors.irradiance,
        };
        self.curve.insert(count, point);
        Ok((fit, point))
    }

    fn chosen(self, (fit, point): (Fit, CountError)) -> ChosenFit {
        ChosenFit {
            fit: Fit {
                seconds: self.seconds,
                ..fit
            },
            point,
            curve: self.curve.into_values().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lights::{evaluate, fit};

    /// A map of lobes and an edge, which takes some lights.
    fn map() -> Map {
        let (width, height) = (128, 64);
        let grid = strandlight_images::LatLong { width, height };
        let pixels = (0..width * height).map(|ix| {
            let [x, y, z] = grid.direction((ix % width) as f64 + 0.5, (ix / width) as f64 + 0.5);
            let sky = if y > 0.1 { 1.0 } else { 0.1 };
            let lamp = (20.0 * (x - 1.0)).exp() * 8.0;
            [
                sky + lamp,
                sky + 0.3 * (3.0 * z).sin().abs(),
                0.6 * sky + 0.2 * lamp,
            ]
            .map(|value| value as f32)
        });
        Map::new(width, height, pixels.collect()).unwrap()
    }

    fn budget(max_error: f64, max_count: usize) -> Budget {
        Budget {
            max_error,
            metric: Metric::Fibre,
            max_count,
            seed: 0,
            hair: None,
        }
    }

    #[test]
    fn slow_the_smallest_set_meets_the_budget_and_one_less_does_not() {
        let map = map();
        for metric in Metric::ALL {
            let budget = Budget {
                metric,
                ..budget(0.03, 64)
            };
            let chosen = fit_to_budget(&map, budget, &Progress::silent()).unwrap();
            let count = chosen.point.count;
            assert!(count > 2, "{count}");
            assert!(metric.of(&chosen.point) <= 0.03);
            let below = chosen.curve.iter().find(|point| point.count == count - 1);
            assert!(metric.of(below.expect("it was fitted")) > 0.03);
            assert!(chosen.curve.is_sorted_by_key(|point| point.count));
            // The fit is the one that anybody makes with that count, and so are its errors.
            let options = FitOptions { count, seed: 0 };
            let plain = fit(&map, options, &Progress::silent()).unwrap();
            assert_eq!(chosen.fit.lights, plain.lights);
            let report = evaluate(&plain.lights, &map);
            assert_eq!(report.fibre_error, chosen.point.fibre_error);
            assert_eq!(report.irradiance_error, chosen.point.irradiance_error);
        }
    }

    #[test]
    fn what_cannot_be_met_is_the_best_there_is() {
        let map = map();
        let chosen = fit_to_budget(&map, budget(1e-6, 5), &Progress::silent()).unwrap();
        let counts: Vec<usize> = chosen.curve.iter().map(|point| point.count).collect();
        assert_eq!(counts, [1, 2, 3, 4, 5]);
        let best = chosen.curve.iter().map(|point| point.fibre_error);
        assert_eq!(best.fold(f64::MAX, f64::min), chosen.point.fibre_error);
        // And what one light meets takes one.
        let chosen = fit_to_budget(&map, budget(1.0, 256), &Progress::silent()).unwrap();
        assert_eq!((chosen.point.count, chosen.curve.len()), (1, 1));
        for max_count in [0, MAX_FITTED_LIGHTS + 1] {
            let error = fit_to_budget(&map, budget(1.0, max_count), &Progress::silent());
            assert_eq!(error.unwrap_err(), FitError::Count(max_count));
        }
    }

    #[test]
    fn curves_have_their_ladder() {
        let counts = |count| counts_about(count).collect::<Vec<_>>();
        assert_eq!(counts(1), [1, 2]);
        assert_eq!(counts(5), [1, 2, 3, 4, 5, 8]);
        assert_eq!(counts(8), [1, 2, 3, 4, 6, 8, 12]);
        assert_eq!(counts(1024).last(), Some(&1024));
        assert_eq!(curve_steps(5), 6);
        // Whatever the errors: between both.
        for (below, above) in [(0.5, 0.1), (0.5, 0.0), (f64::INFINITY, 0.1), (0.2, 0.2)] {
            for limit in [0.0, 0.15, 0.3] {
                let count = interpolated((8, below), (12, above), limit);
                assert!(
                    (9..=11).contains(&count),
                    "{below} {above} {limit}: {count}"
                );
            }
        }
    }

    #[test]
    fn a_smooth_hair_asks_for_more() {
        let map = map();
        let options = FitOptions { count: 4, seed: 0 };
        let fitted = fit(&map, options, &Progress::silent()).unwrap();
        let error_at = |factor: f64| {
            let plain = HairParams::default();
            let hair = HairParams {
                width: plain.width.map(|width| factor * width),
                ..plain
            };
            fibre_error_of(&fitted.lights, &map, &hair)
        };
        let (smooth, rough) = (error_at(0.5), error_at(2.0));
        assert!(smooth > rough && rough > 0.0, "{smooth} {rough}");
        // The default's own formulas against the default's rounded ones.
        let plain = evaluate(&fitted.lights, &map).fibre_error;
        let ratio = error_at(1.0) / plain;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
    }
}
