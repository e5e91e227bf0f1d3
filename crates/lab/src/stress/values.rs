//! The extremes evaluated on both sides: finite, non-negative, and twins of each other.

use rayon::prelude::*;
use serde_json::json;
use strandlight_scattering::Lobe;

use super::point::{Evaluation, Group, Point};
use super::report::{Check, NO_ADAPTER, Tally, finite};
use super::target::{StressError, Target};
use strandlight_scene::progress::Progress;

/// Groups sent to the adapter at once.
const GPU_GROUPS: usize = 256;
/// Bound on the twins, relative to the largest value of a function's batch.
const TWINS_BOUND: f64 = 1e-4;

/// The difference of twins as a share of `largest`; none where they are equal, all 0 included.
fn apart(a: f32, b: f32, largest: f32) -> f64 {
    if a == b {
        0.0
    } else {
        f64::from(a - b).abs() / f64::from(largest)
    }
}

/// Answers by group and point.
pub type Answers = Vec<Vec<[f32; 3]>>;

/// Groups with the answers of both sides.
pub struct Evaluated<P> {
    /// Where.
    pub groups: Vec<Group<P>>,
    /// The Rust functions' answers.
    pub cpu: Answers,
    /// The WGSL functions', if there is an adapter.
    pub gpu: Option<Answers>,
}

impl<P: Evaluation> Evaluated<P> {
    /// Evaluates `groups` on both sides.
    pub fn new(
        target: &Target,
        groups: Vec<Group<P>>,
        progress: &Progress,
    ) -> Result<Evaluated<P>, StressError> {
        let cpu = groups
            .par_iter()
            .map(|group| {
                let values = target.cpu(group);
                progress.advance(1);
                values
            })
            .collect::<Result<Answers, _>>()?;
        let mut gpu = None;
        for chunk in groups.chunks(GPU_GROUPS) {
            if let Some(values) = target.gpu(chunk)? {
                gpu.get_or_insert_with(Vec::new).extend(values);
            }
        }
        Ok(Evaluated { groups, cpu, gpu })
    }

    /// Every value finite and not negative.
    pub fn finite(&self, name: &str) -> [Check; 2] {
        let check = |answers: &Answers, backend| {
            let mut tally = Tally::new();
            for (group, values) in self.groups.iter().zip(answers) {
                for (point, rgb) in group.points.iter().zip(values) {
                    // NaN fails the comparison too.
                    let good = rgb.iter().all(|&x| x.is_finite() && x >= 0.0);
                    tally.see(f64::from(u8::from(!good)), || {
                        let found: Vec<_> = rgb.iter().map(|&x| finite(x.into())).collect();
                        [json!(found), json!(">= 0"), point.query(&group.hair)]
                    });
                }
            }
            let note = "1 where a channel is NaN, infinite or negative";
            tally.check(name, backend, Some(0.0), note)
        };
        let gpu = match &self.gpu {
            Some(answers) => check(answers, "gpu"),
            None => Check::not_run(name, "gpu", NO_ADAPTER),
        };
        [check(&self.cpu, "cpu"), gpu]
    }

    /// WGSL against Rust at the points that are `of_function`, whose name this is.
    pub fn twins(&self, function: &str, of_function: impl Fn(&P) -> bool) -> Check {
        let name = format!("twins {function}");
        let Some(gpu) = &self.gpu else {
            return Check::not_run(&name, "cpu, gpu", NO_ADAPTER);
        };
        let answers = || {
            self.groups
                .iter()
                .zip(self.cpu.iter().zip(gpu))
                .flat_map(|(group, (cpu, gpu))| {
                    let pairs = group.points.iter().zip(cpu.iter().zip(gpu));
                    pairs.map(move |(point, values)| (&group.hair, point, values))
                })
                .filter(|(_, point, _)| of_function(point))
        };
        let largest = answers()
            .flat_map(|(_, _, (cpu, _))| cpu)
            .fold(0.0f32, |largest, x| largest.max(x.abs()));
        let mut tally = Tally::with_percentiles();
        for (hair, point, (cpu, gpu)) in answers() {
            for (a, b) in cpu.iter().zip(gpu) {
                let error = apart(*a, *b, largest);
                tally.see(error, || [json!(gpu), json!(cpu), point.query(hair)]);
            }
        }
        let note = "difference over the largest value of the batch";
        tally.check(&name, "cpu, gpu", Some(TWINS_BOUND), note)
    }
}

impl Evaluated<Point> {
    /// WGSL against Rust, one check a function and mode.
    pub fn twins_by_mode(&self) -> Vec<Check> {
        let mut checks = Vec::new();
        for (is_single, function) in [(false, "azimuthal"), (true, "single")] {
            for lobe in Lobe::ALL {
                let wanted = |point: &Point| {
                    matches!(point, Point::Single { .. }) == is_single && point.lobe() == lobe
                };
                checks.push(self.twins(&format!("{function} {}", lobe.name()), wanted));
            }
        }
        checks
    }
}
