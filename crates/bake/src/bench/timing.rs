//! What methods cost, side by side: a pass of the base before a pass of each, again and again.

use std::hint::black_box;
use std::time::Instant;

use strandlight_runtime::gpu::GpuError;
use strandlight_runtime::optics::Optics;
use strandlight_runtime::probe::{GpuBench, Scheme, Workload};
use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame};
use strandlight_scattering::{HairParams, ParamError};

use super::configuration::Set;
use super::method::{OnFibre, Prepared};

/// Cost of a light at a point, all modes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Nanoseconds: the median over the repetitions.
    pub ns: f64,
    /// Cost over that of the base method just before: median over the repetitions.
    pub ratio: f64,
    /// Lower and upper quartile of the ratio.
    pub ratio_quartiles: [f64; 2],
}

/// Fibres, lights and views that are timed: all lights at all views under all fibres. Each kind
/// is drawn as the configurations of `set` are, so lights fall outside of lobes as often.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The fibres.
    pub hair: Vec<HairParams>,
    /// The lights, over the whole sphere.
    pub lights: Vec<LightInFrame>,
    /// The views.
    pub views: Vec<DirectionInFrame>,
}

impl Scene {
    /// Draws a scene: fibres, lights and views.
    pub fn new(set: Set, seed: u64, [n_fibres, n_lights, n_views]: [usize; 3]) -> Scene {
        // Three streams: an item of one kind does not come with another's.
        let draw = |kind: u64, n: usize| {
            (0..n as u64).map(move |ix| set.draw(seed.wrapping_mul(3).wrapping_add(kind), ix))
        };
        Scene {
            hair: draw(0, n_fibres).map(|drawn| drawn.hair).collect(),
            lights: draw(1, n_lights).map(|drawn| drawn.in_frame().0).collect(),
            views: draw(2, n_views).map(|drawn| drawn.in_frame().1).collect(),
        }
    }
}

/// A pass of the CPU is cut at about this time.
const PASS_SECONDS: f64 = 2e-2;

/// Costs of `methods` on this thread; `methods[base]` is what ratios are taken to.
///
/// Methods that need longer than 20 ms for `scene` see its first views only.
/// What an edit costs ([`Prepared::on_fibre`]) is not in it.
///
/// # Errors
/// A fibre that a method refuses.
pub fn cpu_costs(
    methods: &[Prepared],
    base: usize,
    scene: &Scene,
    n_repetitions: usize,
    mut done: impl FnMut(),
) -> Result<Vec<Cost>, ParamError> {
    let mut passes = Vec::with_capacity(methods.len());
    for method in methods {
        let on_fibres: Vec<OnFibre> = scene
            .hair
            .iter()
            .map(|hair| method.on_fibre(hair))
            .collect::<Result<_, _>>()?;
        // The first view warms up, the second is the measure.
        let second = scene.views.len().min(2);
        cpu_pass(&on_fibres, scene, second);
        let n_views = scene.views.len() as f64;
        let spent = cpu_pass(&on_fibres, scene, second) / second.max(1) as f64;
        let enough = (PASS_SECONDS / spent.max(1e-9)).clamp(1.0, n_views.max(1.0));
        passes.push((on_fibres, enough as usize));
    }
    let n_lights = (scene.lights.len() * scene.hair.len()).max(1) as f64;
    let ns_of = |(on_fibres, n_views): &(Vec<OnFibre>, usize)| {
        1e9 * cpu_pass(on_fibres, scene, *n_views) / (*n_views as f64 * n_lights)
    };
    let mut samples = vec![Vec::with_capacity(n_repetitions); methods.len()];
    for _ in 0..n_repetitions {
        for (pass, samples) in passes.iter().zip(&mut samples) {
            let before = ns_of(&passes[base]);
            samples.push([before, ns_of(pass)]);
        }
        done();
    }
    Ok(samples.iter().map(|pairs| cost(pairs)).collect())
}

/// Seconds for the first `n_views`.
fn cpu_pass(on_fibres: &[OnFibre], scene: &Scene, n_views: usize) -> f64 {
    let start = Instant::now();
    for on_fibre in on_fibres {
        for view in &scene.views[..n_views] {
            black_box(on_fibre.lit(black_box(&scene.lights), black_box(view)));
        }
    }
    start.elapsed().as_secs_f64()
}

/// Costs of those of `methods` that have a shader, on the adapter of `bench`; the base must have
/// one. Wall clock, all threads or units that the adapter has.
///
/// # Errors
/// A fibre that a method refuses, as text, or a lost device.
pub fn adapter_costs(
    bench: &GpuBench,
    methods: &[Prepared],
    base: usize,
    scene: &Scene,
    n_repetitions: usize,
    mut done: impl FnMut(),
) -> Result<Vec<Option<Cost>>, GpuError> {
    let mut passes: Vec<(usize, Scheme, Workload)> = Vec::new();
    for (ix, method) in methods.iter().enumerate() {
        let Some(scheme) = method.method().scheme() else {
            continue;
        };
        let fibres: Vec<Optics> = scene
            .hair
            .iter()
            .map(|hair| {
                method
                    .on_fibre(hair)
                    .map(|on_fibre| on_fibre.optics().clone())
            })
            .collect::<Result<_, _>>()
            .map_err(|error: ParamError| GpuError::Failed {
                what: "bench",
                reason: error.to_string(),
            })?;
        let workload = bench.workload(method.tables(), &fibres, &scene.lights, &scene.views)?;
        bench.run(scheme, &workload)?;
        passes.push((ix, scheme, workload));
    }
    let base = passes.iter().position(|(ix, ..)| *ix == base).unwrap_or(0);
    let ns_of = |(_, scheme, workload): &(usize, Scheme, Workload)| {
        let seconds = bench.run(*scheme, workload)?;
        Ok(1e9 * seconds / workload.n_evaluations().max(1) as f64)
    };
    let mut samples = vec![Vec::with_capacity(n_repetitions); passes.len()];
    for _ in 0..n_repetitions {
        for (pass, samples) in passes.iter().zip(&mut samples) {
            let before = ns_of(&passes[base])?;
            samples.push([before, ns_of(pass)?]);
        }
        done();
    }
    let mut all = vec![None; methods.len()];
    for ((ix, ..), pairs) in passes.iter().zip(samples) {
        all[*ix] = Some(cost(&pairs));
    }
    Ok(all)
}

/// The cost from pairs in ns: the base just before, and the method.
fn cost(pairs: &[[f64; 2]]) -> Cost {
    let ratios = sorted(pairs.iter().map(|[base, own]| own / base));
    Cost {
        ns: quantile(&sorted(pairs.iter().map(|[_, own]| *own)), 0.5),
        ratio: quantile(&ratios, 0.5),
        ratio_quartiles: [0.25, 0.75].map(|q| quantile(&ratios, q)),
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Linear between neighbours of `sorted`; NaN of nothing.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let at = q * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    sorted[low] + (sorted[high] - sorted[low]) * (at - low as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_paired() {
        // The machine is three times slower in the second repetition; the ratio does not care.
        let cost = cost(&[[10.0, 5.0], [30.0, 15.0], [10.0, 5.0], [12.0, 6.0]]);
        assert_eq!(cost.ns, 5.5);
        assert_eq!(cost.ratio, 0.5);
        assert_eq!(cost.ratio_quartiles, [0.5, 0.5]);
        assert_eq!(quantile(&[1.0, 2.0], 0.25), 1.25);
    }
}
