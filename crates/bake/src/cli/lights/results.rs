//! What a fit found, as JSON; nothing in it changes from run to run. Times are a document of their
//! own.

use serde_json::{Map as Object, Value, json};
use strandlight_bake::lights::{CountError, Metric};
use strandlight_formats::{FitReport, LightSet};
use strandlight_images::Map;

use super::saturated::{Saturated, saturated};

/// What was found.
pub struct Results {
    /// The set with all that its file records.
    pub set: LightSet,
    /// Its errors, if they were measured; with the residual, if there is one.
    pub report: Option<FitReport>,
    /// Lights of it that stand for compact sources.
    pub compact_lights: usize,
    pub energy_scale: [f64; 3],
    /// The limit of `--max-error` and what came of it.
    pub budget: Option<BudgetResult>,
    /// Every count that was fitted, ascending, if there are several.
    pub curve: Option<Vec<CountError>>,
    pub hair: Option<HairResult>,
    /// The rest of the map, if the lights are its compact sources alone.
    pub residual: Option<ResidualResult>,
}

/// What is left of a map without its compact sources.
pub struct ResidualResult {
    /// Of the map's energy, by channel.
    pub energy_share: [f64; 3],
}

/// What came of a budget.
pub struct BudgetResult {
    pub max_error: f64,
    pub metric: Metric,
    pub max_count: usize,
    /// The error of the set.
    pub error: f64,
}

impl BudgetResult {
    pub fn is_met(&self) -> bool {
        self.error <= self.max_error
    }
}

/// The set judged by the fibres of `--hair`.
pub struct HairResult {
    /// As given: a preset or a scene.
    pub name: String,
    pub fibre_error: f64,
}

impl Results {
    /// Is the light set to be written?
    pub fn is_kept(&self) -> bool {
        self.budget.as_ref().is_none_or(BudgetResult::is_met)
    }

    /// The report; without the figures of the fit they are null.
    pub fn document(&self, map: &Map) -> Value {
        let set = &self.set;
        let report = self.report;
        let curve = self.curve.as_ref().map(|curve| {
            let points = curve.iter().map(|point| {
                json!({
                    "count": point.count,
                    "lights": point.lights,
                    "compact_lights": point.compact_lights,
                    "fibre_error": point.fibre_error,
                    "irradiance_error": point.irradiance_error,
                })
            });
            points.collect::<Value>()
        });
        let budget = self.budget.as_ref().map(|budget| {
            json!({
                "max_error": budget.max_error,
                "metric": budget.metric.name(),
                "max_count": budget.max_count,
                "error": budget.error,
                "met": budget.is_met(),
            })
        });
        let hair = self
            .hair
            .as_ref()
            .map(|hair| json!({ "name": hair.name, "fibre_error": hair.fibre_error }));
        json!({
            "count": set.lights.len(),
            "requested_count": set.info.requested_count,
            "compact_lights": self.compact_lights,
            "sun_found": self.compact_lights > 0,
            "seed": set.info.seed,
            "rel_l2": report.map(|report| report.rel_l2),
            "energy_ratio": report.map(|report| report.energy_ratio),
            "irradiance_error": report.map(|report| report.irradiance_error),
            "fibre_error": report.map(|report| report.fibre_error),
            "energy_scale": self.energy_scale,
            "budget": budget,
            "curve": curve,
            "hair": hair,
            "residual": self.residual.as_ref().map(|residual| {
                json!({ "energy_share": residual.energy_share })
            }),
            "map": {
                "format": map.source().format,
                "hash": map.source().hash,
                "width": map.width(),
                "height": map.height(),
                "image": map.source().image,
                "windows": map.source().windows,
                "clamped_pixels": map.faults(),
                "saturated_pixels": saturated(map).into_iter().map(Saturated::to_json).collect::<Value>(),
            },
            "tool_version": set.info.tool_version,
        })
    }
}

/// The times of a run: all of it, and each stage.
pub fn timings(seconds: f64, stages: &[(&str, f64)]) -> Object<String, Value> {
    let stages: Object<String, Value> = stages
        .iter()
        .map(|(name, seconds)| ((*name).to_owned(), json!(seconds)))
        .collect();
    let mut document = Object::new();
    document.insert("seconds".to_owned(), json!(seconds));
    document.insert("stage_seconds".to_owned(), Value::Object(stages));
    document
}
