//! Global and local multiple scattering of one light: error against the exact integrals, and time.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::{Value, json};
use strandlight_scattering::closed_form::paper::{self, PublishedAverages};
use strandlight_scattering::closed_form::{
    AverageTexel, DirectionInFrame, global_scattering, global_scattering_mode, local_scattering,
    pack_averages,
};
use strandlight_scattering::dual_scattering::{AverageTable, Events, all_orders};
use strandlight_scattering::exact::{Forward, global, local};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe, ParamError};

use super::accuracy::{Errors, errors_of};
use super::configuration::{Configuration, Set};
use super::method::{Method, MethodError, MethodTables, OnFibre, Prepared};
use super::timing::Scene;
use strandlight_scattering::random::SplitMix64;
use strandlight_scene::progress::Progress;

/// What is integrated: global scattering of R, TT, TRT and of their sum, local scattering.
pub const INTEGRAL_NAMES: [&str; 5] = ["R", "TT", "TRT", "global", "local"];
const N_INTEGRALS: usize = INTEGRAL_NAMES.len();

/// Linear RGB of each of [`INTEGRAL_NAMES`].
type Values = [[f64; 3]; N_INTEGRALS];

/// What to measure.
#[derive(Clone, Copy, Debug)]
pub struct MultipleOptions {
    /// How configurations are drawn; sigma_f besides, log-uniform in 0.05..1.5.
    pub set: Set,
    /// How many.
    pub n: usize,
    /// Seed of the draw.
    pub seed: u64,
    /// Timed passes of each method; 0 measures errors alone.
    pub repetitions: usize,
}

/// One method's measurement.
#[derive(Clone, Debug)]
pub struct MultipleRow {
    /// The method.
    pub method: Method,
    /// Errors of [`INTEGRAL_NAMES`], in their order.
    pub errors: [Errors; N_INTEGRALS],
    /// Of global (all modes) and of local scattering, a light at a point.
    pub costs: Option<[MultipleCost; 2]>,
}

/// Time on one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MultipleCost {
    /// Nanoseconds: the median over the passes.
    pub ns: f64,
    /// Over the base method's in the same pass: the median.
    pub ratio: f64,
}

/// All methods, [`Method::BASE`] among them.
#[derive(Clone, Debug)]
pub struct Multiple {
    /// What was asked for.
    pub options: MultipleOptions,
    /// One for each method.
    pub rows: Vec<MultipleRow>,
}

/// The methods compared: the paper's scheme and the renderer's, at their defaults and finer.
const METHODS: [Method; 5] = [
    Method::Paper { segments: 2 },
    Method::BASE,
    Method::Paper { segments: 12 },
    Method::DEFAULT,
    Method::Runtime { nodes: [8, 8, 8] },
];
const BASE_IX: usize = 1;

/// A method with all it needs for one fibre.
struct MultipleOnFibre<'a> {
    on_fibre: OnFibre<'a>,
    averages: Averages,
}

enum Averages {
    Published(PublishedAverages),
    Runtime(Vec<AverageTexel>),
}

impl<'a> MultipleOnFibre<'a> {
    fn new(prepared: &'a Prepared, hair: &HairParams) -> Result<Self, ParamError> {
        let averages = match prepared.method() {
            Method::Paper { .. } => {
                Averages::Published(PublishedAverages::new(hair, Fresnel::Schlick))
            }
            _ => Averages::Runtime(pack_averages(&AverageTable::new(hair, Fresnel::Dielectric))),
        };
        Ok(MultipleOnFibre {
            on_fibre: prepared.on_fibre(hair)?,
            averages,
        })
    }

    /// Eq 27 of one mode, or of all.
    fn global(
        &self,
        lobe: Option<Lobe>,
        light: &DirectionInFrame,
        view: &DirectionInFrame,
        sigma_f: f32,
    ) -> [f32; 3] {
        let (fibre, tables) = (self.on_fibre.fibre(), self.on_fibre.tables());
        match (self.on_fibre.shading(), lobe) {
            (None, Some(lobe)) => {
                paper::global_scattering_mode(lobe.p(), light, view, sigma_f, fibre, &tables)
            }
            (None, None) => paper::global_scattering(light, view, sigma_f, fibre, &tables),
            (Some(shading), Some(lobe)) => {
                global_scattering_mode(lobe.p(), light, view, sigma_f, &shading)
            }
            (Some(shading), None) => global_scattering(light, view, sigma_f, &shading),
        }
    }

    /// Eq 29.
    fn local(&self, light: &DirectionInFrame, view: &DirectionInFrame, sigma_f: f32) -> [f32; 3] {
        match &self.averages {
            Averages::Published(averages) => {
                let segments = self.on_fibre.fibre().segments;
                paper::local_scattering(light, view, sigma_f, averages, segments)
            }
            Averages::Runtime(texels) => local_scattering(light, view, sigma_f, &texels[..]),
        }
    }
}

/// Measures every method. `progress` makes a reporter of a stage's name and steps.
///
/// Errors depend on set, seed and count alone; costs are this machine's.
///
/// # Errors
/// The bundled tables cannot be read.
pub fn run_multiple(
    options: MultipleOptions,
    tables: &MethodTables,
    progress: impl Fn(&str, u64) -> Progress,
) -> Result<Multiple, MethodError> {
    let methods = METHODS.map(|method| Prepared::new(method, tables));
    let stage = progress("errors", options.n as u64);
    // [configuration]: the exact values, then each method's.
    let found: Vec<Vec<Values>> = (0..options.n as u64)
        .into_par_iter()
        .map(|ix| {
            let drawn = options.set.draw(options.seed, ix);
            let sigma_f = sigma_f_of(options.seed, ix);
            let mut values = vec![exact(&drawn, sigma_f)];
            let (light, view) = drawn.in_frame();
            for method in &methods {
                // Drawn fibres are valid.
                let Ok(on_fibre) = MultipleOnFibre::new(method, &drawn.hair) else {
                    continue;
                };
                let (light, sigma_f) = (&light.direction, sigma_f as f32);
                let global = |lobe| on_fibre.global(lobe, light, &view, sigma_f).map(f64::from);
                let [r, tt, trt] = Lobe::ALL.map(|lobe| global(Some(lobe)));
                let local = on_fibre.local(light, &view, sigma_f).map(f64::from);
                values.push([r, tt, trt, global(None), local]);
            }
            stage.advance(1);
            values
        })
        .collect();
    stage.finish();
    let mut rows: Vec<MultipleRow> = METHODS
        .iter()
        .enumerate()
        .map(|(ix, &method)| MultipleRow {
            method,
            errors: std::array::from_fn(|integral| {
                let pair = |values: &Vec<Values>| (values[ix + 1][integral], values[0][integral]);
                errors_of(found.iter().map(pair))
            }),
            costs: None,
        })
        .collect();
    if options.repetitions > 0 {
        let stage = progress("time", options.repetitions as u64);
        let costs = costs(&methods, options, || stage.advance(1));
        stage.finish();
        for (row, costs) in rows.iter_mut().zip(costs) {
            row.costs = Some(costs);
        }
    }
    Ok(Multiple { options, rows })
}

/// Spread of configuration `ix`.
fn sigma_f_of(seed: u64, ix: u64) -> f64 {
    // Another stream than that of the configurations.
    SplitMix64::of_item(seed ^ 0x5f0e_57a1, ix).log_uniform(0.05, 1.5)
}

fn exact(drawn: &Configuration, sigma_f: f64) -> Values {
    let term = Fresnel::Dielectric;
    let forward = Forward {
        theta: drawn.light.theta,
        phi: drawn.light.phi,
        sigma_f,
    };
    let [r, tt, trt] = Lobe::ALL.map(|lobe| global(lobe, forward, drawn.view, &drawn.hair, term));
    let events = Events::new(&drawn.hair, term);
    let back = local(forward, drawn.view, |theta| all_orders(&events.at(theta)));
    let sum = std::array::from_fn(|c| r[c] + tt[c] + trt[c]);
    [r, tt, trt, sum, back]
}

/// Fibres, lights and views that are timed.
const SCENE: [usize; 3] = [4, 16, 16];

/// Costs of each method, all lights at a view of a fibre timed at once; the base's beside each.
fn costs(
    methods: &[Prepared],
    options: MultipleOptions,
    mut done: impl FnMut(),
) -> Vec<[MultipleCost; 2]> {
    let scene = Scene::new(options.set, options.seed, SCENE);
    let sigma_f: Vec<f32> = (0..scene.lights.len() as u64)
        .map(|ix| sigma_f_of(options.seed, ix) as f32)
        .collect();
    let fibres: Vec<Vec<MultipleOnFibre>> = methods
        .iter()
        .map(|method| {
            let on_fibre = |hair| MultipleOnFibre::new(method, hair).ok();
            scene.hair.iter().filter_map(on_fibre).collect()
        })
        .collect();
    // Nanoseconds of a light, of global and of local scattering.
    let time = |fibre: &MultipleOnFibre, view: &DirectionInFrame| -> [f64; 2] {
        let pass = |is_local: bool| {
            let start = Instant::now();
            for (light, &sigma_f) in scene.lights.iter().zip(&sigma_f) {
                let (light, view) = (black_box(&light.direction), black_box(view));
                black_box(if is_local {
                    fibre.local(light, view, sigma_f)
                } else {
                    fibre.global(None, light, view, sigma_f)
                });
            }
            1e9 * start.elapsed().as_secs_f64() / scene.lights.len() as f64
        };
        [pass(false), pass(true)]
    };
    // [method][global, local]: nanoseconds and ratio of each pass.
    let mut samples = vec![[Vec::new(), Vec::new()]; methods.len()];
    for _ in 0..options.repetitions {
        let mut sums = vec![[0.0; 2]; methods.len()];
        for view in &scene.views {
            for fibre in 0..scene.hair.len() {
                for (sums, fibres) in sums.iter_mut().zip(&fibres) {
                    let [global, local] = time(&fibres[fibre], view);
                    sums[0] += global;
                    sums[1] += local;
                }
            }
        }
        let n = (scene.views.len() * scene.hair.len()) as f64;
        let base = sums[BASE_IX];
        for (samples, sums) in samples.iter_mut().zip(&sums) {
            for kind in 0..2 {
                samples[kind].push([sums[kind] / n, sums[kind] / base[kind]]);
            }
        }
        done();
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    samples
        .iter()
        .map(|kinds| {
            [0, 1].map(|kind| {
                let column = |ix: usize| kinds[kind].iter().map(move |pair: &[f64; 2]| pair[ix]);
                MultipleCost {
                    ns: median(column(0).collect()),
                    ratio: median(column(1).collect()),
                }
            })
        })
        .collect()
}

impl Multiple {
    /// The document of `--json`.
    pub fn to_json(&self) -> Value {
        let errors = |row: &MultipleRow| -> Value {
            let entry = |(name, errors): (&str, &Errors)| {
                let value = json!({
                    "rel_rmse": errors.rel_rmse,
                    "bias": errors.bias,
                    "p95": errors.p95,
                    "worst": errors.worst,
                    "worst_ix": errors.worst_ix,
                });
                (name.to_owned(), value)
            };
            let entries = INTEGRAL_NAMES.into_iter().zip(&row.errors).map(entry);
            Value::Object(entries.collect())
        };
        let cost = |costs: &[MultipleCost; 2]| {
            let [global, local] = costs.map(|cost| json!({ "ns": cost.ns, "ratio": cost.ratio }));
            json!({ "global": global, "local": local })
        };
        let rows = self.rows.iter().map(|row| {
            json!({
                "family": row.method.family(),
                "setting": row.method.setting(),
                "errors": errors(row),
                "cpu": row.costs.as_ref().map(cost),
            })
        });
        json!({
            "set": self.options.set.name(),
            "n": self.options.n,
            "seed": self.options.seed,
            "methods": rows.collect::<Vec<_>>(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_bake::tables::bake_c_and_h;
    use strandlight_scattering::fresnel::Fresnel;

    #[test]
    fn slow_errors_are_within_their_bounds() {
        let options = MultipleOptions {
            set: Set::Accuracy,
            n: 150,
            seed: 1,
            repetitions: 0,
        };
        let schlick = bake_c_and_h(Fresnel::Schlick, &Progress::silent());
        let tables = MethodTables::new(&schlick).unwrap();
        let multiple = run_multiple(options, &tables, |_, _| Progress::silent()).unwrap();
        for row in &multiple.rows {
            println!(
                "{:?} {:.5?}",
                row.method,
                row.errors.map(|errors| errors.rel_rmse)
            );
        }
        let of = |method| {
            let row = multiple.rows.iter().find(|row| row.method == method);
            row.unwrap().errors.map(|errors| errors.rel_rmse)
        };
        let [.., global, local] = of(Method::DEFAULT);
        assert!(global < 0.01 && local < 0.01, "{global} {local}");
        let [.., global, local] = of(Method::BASE);
        assert!((0.01..0.1).contains(&global), "{global}");
        assert!((0.03..0.5).contains(&local), "{local}");
    }
}
