//! Global and local multiple scattering at extremes: finite, non-negative, twins.

use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};
use strandlight_render::probe::{Function, MODE_ALL, Query};
use strandlight_scattering::HairParams;
use strandlight_scattering::closed_form::{DirectionInFrame, Fibre};

use super::Run;
use super::draw::{LAMBDA, POINTS_PER_HAIR, Random, hair};
use super::point::{hair_json, inclination, single};
use super::report::{Check, Tally, finite};
use super::target::StressError;
use super::values::apart;

/// Purpose of the draws.
const PURPOSE: u64 = 40;
/// Fibres sent to the adapter at once.
const GPU_FIBRES: usize = 256;
/// Bound on the twins, relative to the largest value of a function's batch.
const TWINS_BOUND: f64 = 1e-4;

/// What is evaluated.
const FUNCTIONS: [Function; 3] = [Function::Global, Function::Local, Function::DirectLocal];

/// Light and view; the light's width is sigma_f, or its lambda where it is unscattered.
#[derive(Clone, Copy)]
pub(super) struct Point {
    function: Function,
    light: [f64; 2],
    width: f64,
    view: [f64; 2],
}

/// Points of one fibre.
pub(super) type Points = (HairParams, Vec<Point>);

impl Point {
    fn draw(random: &mut Random) -> Point {
        let mut direction = || {
            let theta = match random.pick(&[0, 1, 2]) {
                0 => random.pick(&[-FRAC_PI_2, -1.57, 0.0, 1.57, FRAC_PI_2]),
                _ => random.uniform(-1.0, 1.0).asin(),
            };
            [inclination(theta), single(random.uniform(-PI, PI))]
        };
        let (light, mut view) = (direction(), direction());
        if random.chance(0.2) {
            // The same azimuth, the opposite one, and the edge of the half circle.
            view[1] = single(light[1] + random.pick(&[0.0, FRAC_PI_2, PI]));
        }
        let width = match random.pick(&[0, 1, 2, 3]) {
            0 => random.pick(&LAMBDA),
            _ => random.log_uniform(LAMBDA[0], LAMBDA[1]),
        };
        Point {
            function: random.pick(&FUNCTIONS),
            light,
            width: single(width),
            view,
        }
    }

    /// As the probe of the runtime takes it.
    pub fn query(&self, fibre: Fibre, optics: u32) -> Query {
        let [light, view] = [self.light, self.view]
            .map(|[theta, phi]| DirectionInFrame::from_angles(theta as f32, phi as f32));
        let query = Query::single(MODE_ALL, light, self.width as f32, view, fibre);
        Query {
            function: self.function as u32,
            ..query.with_optics(optics)
        }
    }

    fn json(&self, hair: &HairParams) -> Value {
        let [[theta_j, phi_j], [theta_o, phi_o]] = [self.light, self.view];
        json!({
            "q": name(self.function),
            "mode": "all",
            "light": { "theta": theta_j, "phi": phi_j },
            "sigma_f": self.width,
            "view": { "theta": theta_o, "phi": phi_o },
            "hair": hair_json(hair),
        })
    }
}

fn name(function: Function) -> &'static str {
    match function {
        Function::Global => "global",
        Function::Local => "local",
        _ => "direct_local",
    }
}

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
        return Check::not_run(name, backend, super::NO_ADAPTER);
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
        return Check::not_run(&name, "cpu, gpu", super::NO_ADAPTER);
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
