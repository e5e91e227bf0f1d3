//! Error and cost of every method: the run, and how it is written down.

use serde_json::{Value, json};
use strandlight_render::gpu::GpuError;
use strandlight_render::probe::GpuBench;
use strandlight_scattering::ParamError;

use super::accuracy::{Errors, Measured, Reference, SUM_NAMES};
use super::configuration::{Configuration, Set};
use super::method::{Method, MethodError, MethodTables, Prepared};
use super::plot::{AxisStyle, Figure, Mark, Panel, Series};
use super::timing::{Cost, Scene, adapter_costs, cpu_costs};
use crate::stress::hair_json;
use strandlight_scene::progress::Progress;

/// What to measure.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How configurations are drawn.
    pub set: Set,
    /// How many.
    pub n: usize,
    /// Seed of the draw.
    pub seed: u64,
    /// Timed passes of each method; 0 measures errors alone.
    pub repetitions: usize,
    /// Time on the adapter too.
    pub adapter: bool,
}

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrontierError {
    /// A method cannot be prepared.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A method refuses a fibre that was drawn.
    #[error(transparent)]
    Hair(#[from] ParamError),
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Fibres, lights and views of the CPU's timing and the adapter's; few and long dispatches, as in
/// rendering: on lavapipe each takes milliseconds of its own.
const CPU_SCENE: [usize; 3] = [8, 16, 16];
const ADAPTER_SCENE: [usize; 3] = [2, 16, 8192];

/// Families in the order of their colours in plots; black is the exact model's elsewhere.
const COLOURS: [&str; 5] = [
    "exact",
    "paper",
    "runtime",
    "quadrature",
    "paper, dielectric",
];

/// One method's measurement.
#[derive(Clone, Debug)]
pub struct Row {
    /// The method.
    pub method: Method,
    /// Errors, and how much is evaluated.
    pub measured: Measured,
    /// Cost on one thread of the CPU.
    pub cpu: Option<Cost>,
    /// Cost on the adapter.
    pub adapter: Option<Cost>,
}

/// All methods.
#[derive(Clone, Debug)]
pub struct Frontier {
    /// What was asked for.
    pub options: Options,
    /// The configuration that each worst value belongs to is found here.
    pub configurations: Vec<Configuration>,
    /// Methods in the order of [`Method::all_of`].
    pub rows: Vec<Row>,
    /// The adapter that was timed.
    pub adapter_name: Option<String>,
}

/// Measures every method. `progress` makes a reporter of a stage's name and steps.
///
/// Errors depend on set, seed and count alone; costs are this machine's.
///
/// # Errors
/// No adapter where one is asked for; see [`FrontierError`].
pub fn run(
    options: Options,
    tables: &MethodTables,
    progress: impl Fn(&str, u64) -> Progress,
) -> Result<Frontier, FrontierError> {
    let gpu = (options.adapter && options.repetitions > 0)
        .then(GpuBench::new)
        .transpose()?;
    let methods: Vec<Prepared> = Method::all_of(options.set.model())
        .into_iter()
        .map(|method| Prepared::new(method, tables))
        .collect();
    let base = methods
        .iter()
        .position(|method| method.method() == Method::base_of(options.set.model()))
        .unwrap_or(0);

    let stage = progress("exact model", options.n as u64);
    let reference = Reference::new(options.set, options.seed, options.n, &stage);
    stage.finish();
    let stage = progress("errors", options.n as u64);
    let measured = reference.measure(&methods, &stage)?;
    stage.finish();
    let mut rows: Vec<Row> = methods
        .iter()
        .zip(measured)
        .map(|(method, measured)| Row {
            method: method.method(),
            measured,
            cpu: None,
            adapter: None,
        })
        .collect();

    let n = options.repetitions;
    if n > 0 {
        let stage = progress("time, CPU", n as u64);
        let scene = Scene::new(options.set, options.seed, CPU_SCENE);
        let costs = cpu_costs(&methods, base, &scene, n, || stage.advance(1))?;
        for (row, cost) in rows.iter_mut().zip(costs) {
            row.cpu = Some(cost);
        }
        stage.finish();
    }
    if let Some(gpu) = &gpu {
        let stage = progress("time, adapter", n as u64);
        let scene = Scene::new(options.set, options.seed, ADAPTER_SCENE);
        let done = || stage.advance(1);
        let costs = adapter_costs(gpu, &methods, base, &scene, n, done)?;
        for (row, cost) in rows.iter_mut().zip(costs) {
            row.adapter = cost;
        }
        stage.finish();
    }
    Ok(Frontier {
        options,
        configurations: reference.configurations,
        rows,
        adapter_name: gpu.map(|gpu| gpu.context().adapter_name.clone()),
    })
}

impl Frontier {
    /// A header and one line a method; costs that were not measured are empty.
    pub fn to_csv(&self) -> String {
        let mut columns = vec!["family".to_owned(), "setting".to_owned()];
        let lower = SUM_NAMES.map(str::to_ascii_lowercase);
        columns.extend(lower[..3].iter().map(|name| format!("nodes_{name}")));
        columns.extend(["inner_mean", "fetches"].map(str::to_owned));
        for statistic in ["rel_rmse", "bias", "p95", "worst"] {
            columns.extend(lower.iter().map(|name| format!("{statistic}_{name}")));
        }
        for side in ["cpu", "adapter"] {
            let parts = ["ns", "ratio", "ratio_q1", "ratio_q3"];
            columns.extend(parts.map(|part| format!("{side}_{part}")));
        }
        let mut text = columns.join(",") + "\n";
        for row in &self.rows {
            let family = row.method.family().replace(", ", " ");
            let mut cells = vec![family, row.method.setting()];
            cells.extend(row.method.nodes().map(|n| n.to_string()));
            cells.push(format!("{:.3}", row.measured.inner_mean));
            cells.push(row.method.fetches().to_string());
            let statistics: [fn(&Errors) -> f64; 4] =
                [|e| e.rel_rmse, |e| e.bias, |e| e.p95, |e| e.worst];
            for statistic in statistics {
                cells.extend(
                    row.measured
                        .errors
                        .iter()
                        .map(|e| format!("{:.4e}", statistic(e))),
                );
            }
            for cost in [row.cpu, row.adapter] {
                cells.extend(match cost {
                    Some(cost) => [
                        format!("{:.1}", cost.ns),
                        format!("{:.4}", cost.ratio),
                        format!("{:.4}", cost.ratio_quartiles[0]),
                        format!("{:.4}", cost.ratio_quartiles[1]),
                    ],
                    None => Default::default(),
                });
            }
            text += &(cells.join(",") + "\n");
        }
        text
    }

    /// Everything, the worst configurations as queries of `strandlight probe` included.
    pub fn to_json(&self) -> Value {
        let options = &self.options;
        let base = Method::base_of(options.set.model());
        let rows: Vec<Value> = self.rows.iter().map(|row| self.row_json(row)).collect();
        json!({
            "set": options.set.name(),
            "n": options.n,
            "seed": options.seed,
            "repetitions": options.repetitions,
            "tool_version": strandlight_formats::tool_version(),
            "base": format!("{} {}", base.family(), base.setting()),
            "adapter": self.adapter_name,
            "methods": rows,
        })
    }

    fn row_json(&self, row: &Row) -> Value {
        let errors: serde_json::Map<String, Value> = SUM_NAMES
            .iter()
            .zip(&row.measured.errors)
            .map(|(name, errors)| {
                let worst = json!({
                    "value": errors.worst,
                    "exact": errors.worst_values[0],
                    "found": errors.worst_values[1],
                    "configuration": errors.worst_ix,
                    "query": self
                        .configurations
                        .get(errors.worst_ix)
                        .map(|drawn| query(name, drawn)),
                });
                let value = json!({
                    "rel_rmse": errors.rel_rmse,
                    "bias": errors.bias,
                    "p95": errors.p95,
                    "worst": worst,
                });
                ((*name).to_owned(), value)
            })
            .collect();
        let cost = |cost: Option<Cost>| {
            cost.map(|cost| {
                json!({
                    "ns": cost.ns,
                    "ratio": cost.ratio,
                    "ratio_quartiles": cost.ratio_quartiles,
                })
            })
        };
        json!({
            "family": row.method.family(),
            "setting": row.method.setting(),
            "nodes": row.method.nodes(),
            "inner_mean": row.measured.inner_mean,
            "fetches": row.method.fetches(),
            "errors": errors,
            "cpu": cost(row.cpu),
            "adapter": cost(row.adapter),
        })
    }

    /// Error of the sum against cost on the CPU and on the adapter, and of single modes against
    /// the size of what they look up; all logarithmic.
    pub fn figure(&self) -> Figure {
        let options = &self.options;
        let mut panels = vec![self.cost_panel("one CPU thread".to_owned(), |row| row.cpu)];
        if let Some(name) = &self.adapter_name {
            panels.push(self.cost_panel(format!("adapter: {name}"), |row| row.adapter));
        }
        panels.retain(|panel| !panel.series.is_empty());
        panels.push(self.size_panel());
        Figure {
            title: format!(
                "Single scattering of one light: {} configurations of the set '{}'",
                options.n,
                options.set.name()
            ),
            columns: panels.len(),
            colours: COLOURS.to_vec(),
            panels,
        }
    }

    /// A curve a family over `cost`.
    fn cost_panel(&self, title: String, cost: fn(&Row) -> Option<Cost>) -> Panel {
        let mut series: Vec<Series> = Vec::new();
        for row in self
            .rows
            .iter()
            .filter(|row| row.method.table_bytes().is_none())
        {
            let Some(cost) = cost(row) else { continue };
            let name = row.method.family();
            if series.last().is_none_or(|last| last.name != name) {
                series.push(points(name));
            }
            if let Some(last) = series.last_mut() {
                last.points
                    .push((cost.ns, 100.0 * row.measured.errors[3].rel_rmse));
                last.labels.push(row.method.setting());
            }
        }
        Panel {
            title,
            x: AxisStyle::log("ns per light and point"),
            y: AxisStyle::log("relative RMSE of R + TT + TRT, %"),
            series,
        }
    }

    /// Errors of the modes over the bytes of the tables that are varied.
    fn size_panel(&self) -> Panel {
        let mut series = vec![
            points("R, size of C"),
            points("TT, size of lobe textures"),
            points("TRT, size of lobe textures"),
        ];
        for row in &self.rows {
            let Some(bytes) = row.method.table_bytes() else {
                continue;
            };
            let modes = match row.method {
                Method::TableC { .. } => 0..1,
                _ => 1..3,
            };
            for (mode, series) in modes.clone().zip(&mut series[modes]) {
                let error = 100.0 * row.measured.errors[mode].rel_rmse;
                series.points.push((bytes as f64 / 1024.0, error));
                series.labels.push(row.method.setting());
            }
        }
        Panel {
            title: "default nodes, tables of other sizes".to_owned(),
            x: AxisStyle::log("KiB"),
            y: AxisStyle::log("relative RMSE of the mode, %"),
            series,
        }
    }
}

/// An empty series of labelled points on a line.
fn points(name: &str) -> Series {
    Series {
        name: name.to_owned(),
        mark: Mark::LinePoints,
        ..Series::default()
    }
}

/// The configuration as `strandlight probe` reads it.
fn query(mode: &str, drawn: &Configuration) -> Value {
    json!({
        "q": "single",
        "mode": mode,
        "light": {
            "theta": drawn.light.theta,
            "phi": drawn.light.phi,
            "lambda": drawn.light.lambda,
        },
        "view": {"theta": drawn.view.theta, "phi": drawn.view.phi},
        "hair": hair_json(&drawn.hair),
    })
}
