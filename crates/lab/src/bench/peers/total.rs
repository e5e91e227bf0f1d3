//! All scattering: what path tracing costs to an error, on its own and with `render --converge`, beside
//! the fast picture.
//!
//! All core-seconds count from the loaded scene: those of paths have what paths read of it, those of
//! `render --converge` the fast picture as well. Errors are those of [`converge`](super::super::converge).

use serde_json::{Value, json};
use strandlight_formats::{Scattering, Scene};
use strandlight_scene::LatLong;

use super::super::converge::{
    self, ConvergeError, Convergences, FastPicture, GOALS, Goal, converge_from, environment_of,
    prepared,
};
use super::Drawing;

/// What is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Of `render --converge` and of plain paths.
    pub converge: converge::Options,
    /// Fast pictures, after a first one.
    pub repetitions: u32,
}

/// The fast picture, `render --converge` and plain paths.
#[derive(Clone, Debug, PartialEq)]
pub struct TotalPeers {
    /// All that was measured.
    pub measured: Convergences,
}

/// One of the two ways to the truth after so many samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Samples a pixel.
    pub samples: u32,
    /// Error; none if the truth's noise hides it.
    pub relative_rmse: Option<f64>,
    /// Seconds of all cores from the loaded scene.
    pub core_seconds: Option<f64>,
}

impl Point {
    fn to_json(self) -> Value {
        json!({
            "samples": self.samples,
            "relative_rmse": self.relative_rmse,
            "core_seconds": self.core_seconds,
        })
    }
}

impl TotalPeers {
    /// Of 5, 3 and 1 %.
    pub fn goals(&self) -> [Goal; 3] {
        GOALS.map(|goal| self.measured.goal(goal))
    }

    /// Of the fast picture's own error; none where the truth's noise hides that.
    pub fn to_ours(&self) -> Option<Goal> {
        Some(self.measured.goal(self.measured.fast_error?))
    }

    /// Of `render --converge`.
    pub fn converged(&self) -> Vec<Point> {
        let before = self.measured.fast_core_seconds;
        self.points(before, |point| (point.converged, point.core_seconds))
    }

    /// Of plain paths.
    pub fn paths(&self) -> Vec<Point> {
        self.points(Some(0.0), |point| (point.plain, point.plain_core_seconds))
    }

    /// With what paths read of the scene, and `before`.
    fn points(
        &self,
        before: Option<f64>,
        of: fn(&converge::Point) -> (Option<f64>, Option<f64>),
    ) -> Vec<Point> {
        let point = |point: &converge::Point| {
            let (relative_rmse, seconds) = of(point);
            let all = [before, self.measured.traced_core_seconds, seconds];
            Point {
                samples: point.samples,
                relative_rmse,
                core_seconds: all.into_iter().sum(),
            }
        };
        self.measured.points.iter().map(point).collect()
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let found = &self.measured;
        let [strands, points, lights] = found.counts;
        let [exponent, _] = found.slopes();
        let goal = |goal: &Goal| {
            json!({
                "relative_rmse": goal.relative_rmse,
                "converge_core_seconds": goal.converged,
                "path_core_seconds": goal.paths,
                "path_extrapolated": goal.is_extrapolated,
                "ratio": goal.ratio(),
            })
        };
        let list = |points: Vec<Point>| points.into_iter().map(Point::to_json).collect::<Vec<_>>();
        json!({
            "size": found.size,
            "strands": strands,
            "points": points,
            "lights": lights,
            "scattering": found.scattering.name(),
            "truth_noise": found.truth_noise,
            "ours": {
                "relative_rmse": found.fast_error,
                "core_seconds": found.fast_core_seconds,
            },
            "traced_core_seconds": found.traced_core_seconds,
            "converge": list(self.converged()),
            "path": list(self.paths()),
            "exponent_of_path": exponent,
            "to_ours": self.to_ours().as_ref().map(goal),
            "goals": self.goals().each_ref().map(goal),
        })
    }
}

/// Steps that [`total_peers`] reports.
pub fn n_steps(options: &Options) -> u64 {
    // The first fast picture is among those of `converge`.
    u64::from(options.repetitions) + converge::n_steps(&options.converge)
}

/// Compares the fast picture of all scattering in `scene`, with nothing behind it, with `render --converge`
/// and plain paths; these in the light of a `map`, its pixels from the top row on, or without one in that of the light set. `done` is called
/// after each of [`n_steps`].
///
/// # Errors
/// As [`ConvergeError`] has them.
pub fn total_peers(
    scene: &Scene,
    map: Option<(LatLong, &[[f32; 3]])>,
    options: &Options,
    done: &dyn Fn(),
) -> Result<TotalPeers, ConvergeError> {
    let mut base = prepared(scene, options.converge.size)?;
    base.set_scattering(Scattering::Total);
    let (picture, core_seconds) = Drawing::new(&base, options.repetitions, done).stills()?;
    let fast = FastPicture {
        picture,
        core_seconds,
    };
    let environment = environment_of(map, scene, &base);
    let measured = converge_from(&base, fast, &environment, &options.converge, done)?;
    Ok(TotalPeers { measured })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paths err by 20 and 10 %, converged pictures by 4 and 2 %, the fast picture by 8 %.
    fn found() -> TotalPeers {
        let point = |samples: u32, converged: f64| converge::Point {
            samples,
            core_seconds: Some(2.0 * f64::from(samples)),
            plain_core_seconds: Some(f64::from(samples)),
            plain: Some(0.4 / f64::from(samples).sqrt()),
            converged: Some(converged),
            ..converge::Point::default()
        };
        TotalPeers {
            measured: Convergences {
                size: [8, 8],
                counts: [1, 2, 3],
                scattering: Scattering::Total,
                fast_core_seconds: Some(2.0),
                fast_error: Some(0.08),
                traced_core_seconds: Some(1.0),
                points: vec![point(4, 0.04), point(16, 0.02)],
                seeds: 1,
                truth_noise: 0.0,
            },
        }
    }

    fn near(found: Option<f64>, expected: f64) {
        let found = found.expect("measured");
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn core_seconds_count_from_the_loaded_scene() {
        let seconds = |points: Vec<Point>| points.into_iter().map(|point| point.core_seconds);
        let found = found();
        assert!(seconds(found.converged()).eq([Some(11.0), Some(35.0)]));
        assert!(seconds(found.paths()).eq([Some(5.0), Some(17.0)]));
        let mut unknown = found.clone();
        unknown.measured.fast_core_seconds = None;
        assert!(seconds(unknown.converged()).eq([None; 2]));
        assert_eq!(unknown.paths(), found.paths());
    }

    #[test]
    fn ratios_are_of_paths_over_what_gets_there_first() {
        let found = found();
        // 25 samples, and what they read, over the fast picture.
        let ours = found.to_ours().expect("an error");
        near(ours.paths, 26.0);
        near(ours.converged, 2.0);
        near(ours.ratio(), 13.0);
        // 10 % is measured, 8 % is not.
        assert!(ours.is_extrapolated && !found.measured.goal(0.1).is_extrapolated);
        let goal = found.measured.goal(0.02);
        near(goal.paths, 401.0);
        near(goal.ratio(), 401.0 / 35.0);
        // No picture of `--converge` got to 1 %, and it is not said when one would.
        let [five, _, one] = found.goals();
        assert_eq!((five.relative_rmse, one.relative_rmse), (0.05, 0.01));
        assert_eq!((one.converged, one.ratio()), (None, None));
        near(one.paths, 1601.0);
        let mut hidden = found.clone();
        hidden.measured.fast_error = None;
        assert_eq!(hidden.to_ours(), None);
        assert!(hidden.to_json()["to_ours"].is_null());
    }
}
