//! What methods cost, side by side: a pass of the base before a pass of each, again and again.

use std::hint::black_box;
use std::time::Instant;

use strandlight_render::gpu::GpuError;
use strandlight_render::probe::{GpuBench, Scheme, Workload};
use strandlight_scattering::closed_form::{DirectionInFrame, LightInFrame};
use strandlight_scattering::{HairParams, ParamError};
use strandlight_scene::optics::Optics;

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

/// A method's slices of a repetition are cut at about this time.
const PASS_SECONDS: f64 = 2e-2;

/// Costs of `methods` on this thread; `methods[base]` is what ratios are taken to.
///
/// Timed are slices of one fibre, one view and all lights, some 10 us, the base's just before the
/// method's, so that most are not interrupted; each slice counts by its median over the
/// repetitions. Methods that need longer than 20 ms for `scene` see its first slices only. What an
/// edit costs ([`Prepared::on_fibre`]) is not in it.
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
    let places: Vec<(usize, &DirectionInFrame)> = scene
        .views
        .iter()
        .flat_map(|view| (0..scene.hair.len()).map(move |fibre| (fibre, view)))
        .collect();
    let mut all = Vec::with_capacity(methods.len());
    for method in methods {
        let on_fibres: Vec<OnFibre> = scene
            .hair
            .iter()
            .map(|hair| method.on_fibre(hair))
            .collect::<Result<_, _>>()?;
        all.push(on_fibres);
    }
    let ns_of = |on_fibres: &[OnFibre], (fibre, view): (usize, &DirectionInFrame)| {
        let start = Instant::now();
        black_box(on_fibres[fibre].lit(black_box(&scene.lights), black_box(view)));
        1e9 * start.elapsed().as_secs_f64() / scene.lights.len().max(1) as f64
    };
    // [method][slice][repetition]
    let mut samples: Vec<Vec<Vec<[f64; 2]>>> = Vec::with_capacity(methods.len());
    for on_fibres in &all {
        // One fibre's views warm up and tell how many slices are affordable.
        let start = Instant::now();
        let n_tried = places.len().min(scene.hair.len());
        for &place in &places[..n_tried] {
            ns_of(on_fibres, place);
        }
        let spent = start.elapsed().as_secs_f64().max(1e-9) / n_tried.max(1) as f64;
        let n_slices = (PASS_SECONDS / spent) as usize;
        samples.push(vec![Vec::new(); n_slices.clamp(8, places.len().max(8))]);
    }
    for _ in 0..n_repetitions {
        for (on_fibres, slices) in all.iter().zip(&mut samples) {
            for (&place, slice) in places.iter().zip(slices) {
                let before = ns_of(&all[base], place);
                slice.push([before, ns_of(on_fibres, place)]);
            }
        }
        done();
    }
    Ok(samples.iter().map(|slices| cost(slices)).collect())
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
                source: error.into(),
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
        all[*ix] = Some(cost(&[pairs]));
    }
    Ok(all)
}

/// The cost from `[slice][repetition]` pairs in ns: the base just before, and the method. Slices
/// weigh as much as the base needs for them.
fn cost(slices: &[Vec<[f64; 2]>]) -> Cost {
    let slices: Vec<&Vec<[f64; 2]>> = slices.iter().filter(|pairs| !pairs.is_empty()).collect();
    let of = |pairs: &[[f64; 2]], value: fn(&[f64; 2]) -> f64, q: f64| {
        quantile(&sorted(pairs.iter().map(value)), q)
    };
    let sum = |value: &dyn Fn(&[[f64; 2]]) -> f64| -> f64 {
        slices.iter().map(|pairs| value(pairs)).sum()
    };
    let base = sum(&|pairs| of(pairs, |pair| pair[0], 0.5));
    let ratio = |q: f64| {
        let part = |pairs: &[[f64; 2]]| {
            of(pairs, |pair| pair[0], 0.5) * of(pairs, |pair| pair[1] / pair[0], q)
        };
        sum(&part) / base
    };
    Cost {
        ns: sum(&|pairs| of(pairs, |pair| pair[1], 0.5)) / slices.len() as f64,
        ratio: ratio(0.5),
        ratio_quartiles: [0.25, 0.75].map(ratio),
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
        let pairs = vec![[10.0, 5.0], [30.0, 15.0], [10.0, 5.0], [12.0, 6.0]];
        let one = cost(std::slice::from_ref(&pairs));
        assert_eq!(one.ns, 5.5);
        assert_eq!(one.ratio, 0.5);
        assert_eq!(one.ratio_quartiles, [0.5, 0.5]);
        // A second slice, three times as long for the base and no shorter for the method, and
        // once interrupted.
        let other = vec![[33.0, 33.0], [33.0, 33.0], [33.0, 3300.0]];
        let two = cost(&[pairs, other]);
        assert_eq!(two.ns, 0.5 * (5.5 + 33.0));
        assert_eq!(two.ratio, (0.5 * 11.0 + 33.0) / 44.0);
        assert_eq!(quantile(&[1.0, 2.0], 0.25), 1.25);
    }
}
