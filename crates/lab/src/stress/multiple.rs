//! Global and local multiple scattering at extremes: finite, non-negative, twins.

use serde_json::json;
use strandlight_render::probe::Function;

use super::draw::{POINTS_PER_HAIR, hair};
use super::multiple_point::{FUNCTIONS, Point, Points, name};
use super::report::{Check, NO_ADAPTER, Tally, finite};
use super::run::Run;
use super::target::StressError;
use super::values::apart;

/// Purpose of the draws.
const PURPOSE: u64 = 40;
/// Fibres sent to the adapter at once.
const GPU_FIBRES: usize = 256;
/// Bound on the twins, relative to the largest value of a function's batch.
const TWINS_BOUND: f64 = 1e-4;

/// Answers by fibre and point.
type Answers = Vec<Vec<[f32; 3]>>;

/// The checks, on about `n` random points.
pub(super) fn checks(run: &Run, n: usize) -> Result<Vec<Check>, StressError> {
    let label = "multiple scattering";
    let drawn = run.each(n.div_ceil(POINTS_PER_HAIR), PURPOSE, label, |random| {
        let hair = hair(random);
        let points = (0..POINTS_PER_HAIR).map(|_| Point::draw(random));
        let all: Points = (hair, points.collect());
        let values = run.target.multiple_cpu(&all)?;
        Ok((all, values))
    })?;
    let (groups, cpu): (Vec<Points>, Answers) = drawn.into_iter().unzip();
    let mut gpu: Option<Answers> = None;
    for chunk in groups.chunks(GPU_FIBRES) {
        if let Some(values) = run.target.multiple_gpu(chunk)? {
            gpu.get_or_insert_with(Vec::new).extend(values);
        }
    }
    let mut checks = vec![are_finite(&groups, Some(&cpu), "cpu")];
    checks.push(are_finite(&groups, gpu.as_ref(), "gpu"));
    checks.extend(FUNCTIONS.map(|function| twins(&groups, &cpu, gpu.as_ref(), function)));
    Ok(checks)
}

fn are_finite(groups: &[Points], answers: Option<&Answers>, backend: &'static str) -> Check {
    let name = "finite, multiple scattering";
    let Some(answers) = answers else {
        return Check::not_run(name, backend, NO_ADAPTER);
    };
    let mut tally = Tally::new();
    for ((hair, points), values) in groups.iter().zip(answers) {
        for (point, rgb) in points.iter().zip(values) {
            // NaN fails the comparison too.
            let good = rgb.iter().all(|&x| x.is_finite() && x >= 0.0);
            tally.see(f64::from(u8::from(!good)), || {
                let found: Vec<_> = rgb.iter().map(|&x| finite(x.into())).collect();
                [json!(found), json!(">= 0"), point.json(hair)]
            });
        }
    }
    let note = "1 where a channel is NaN, infinite or negative";
    tally.check(name, backend, Some(0.0), note)
}

fn twins(groups: &[Points], cpu: &Answers, gpu: Option<&Answers>, function: Function) -> Check {
    let name = format!("twins {}", name(function));
    let Some(gpu) = gpu else {
        return Check::not_run(&name, "cpu, gpu", NO_ADAPTER);
    };
    let answers = || {
        groups
            .iter()
            .zip(cpu.iter().zip(gpu))
            .flat_map(|((hair, points), (cpu, gpu))| {
                let pairs = points.iter().zip(cpu.iter().zip(gpu));
                pairs.map(move |(point, values)| (hair, point, values))
            })
            .filter(|(_, point, _)| point.function == function)
    };
    let largest = answers()
        .flat_map(|(_, _, (cpu, _))| cpu)
        .fold(0.0f32, |largest, x| largest.max(x.abs()));
    let mut tally = Tally::with_percentiles();
    for (hair, point, (cpu, gpu)) in answers() {
        for (a, b) in cpu.iter().zip(gpu) {
            let error = apart(*a, *b, largest);
            tally.see(error, || [json!(gpu), json!(cpu), point.json(hair)]);
        }
    }
    let note = "difference over the largest value of the batch";
    tally.check(&name, "cpu, gpu", Some(TWINS_BOUND), note)
}
