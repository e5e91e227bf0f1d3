//! What an edit of each hair parameter costs.

use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::material::{EditError, EditReport, HairMaterial, LobeTables, Parameter};

/// What an edit may take.
pub const BUDGET_MICROSECONDS: f64 = 1000.0;

/// One part that an edit recomputes.
#[derive(Clone, Debug, PartialEq)]
pub struct PartCost {
    /// Its name.
    pub name: &'static str,
    /// Bytes to write on the GPU; 0 for what stays in memory.
    pub bytes: usize,
    /// Median time.
    pub microseconds: f64,
}

/// The cost of one kind of edit.
#[derive(Clone, Debug, PartialEq)]
pub struct EditCost {
    /// The parameter, or `all` for making everything the first time.
    pub parameter: &'static str,
    /// Parts that are recomputed; the others are kept.
    pub rebuilt: Vec<PartCost>,
    /// Bytes to write on the GPU.
    pub bytes: usize,
    /// Median time of the whole edit.
    pub microseconds: f64,
}

impl EditCost {
    /// Is the median within [`BUDGET_MICROSECONDS`]?
    pub fn is_within_budget(&self) -> bool {
        self.microseconds <= BUDGET_MICROSECONDS
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        let part = |part: &PartCost| json!({ "name": part.name, "bytes": part.bytes, "microseconds": part.microseconds });
        json!({
            "parameter": self.parameter,
            "rebuilt": self.rebuilt.iter().map(part).collect::<Vec<_>>(),
            "bytes": self.bytes,
            "microseconds": self.microseconds,
            "within_budget": self.is_within_budget(),
        })
    }
}

/// Edits each parameter of `hair` `repetitions` times to and fro, all modes and multiple scattering
/// enabled, on this thread;
/// then recomputes everything as often.
///
/// # Errors
/// Lobes that are not there, hair outside its range.
pub fn edit_costs(
    tables: &Arc<LobeTables>,
    fresnel: Fresnel,
    hair: &HairParams,
    repetitions: usize,
) -> Result<Vec<EditCost>, EditError> {
    let make = |hair: &HairParams| {
        HairMaterial::new(Arc::clone(tables), fresnel, hair, &Lobe::ALL, SEGMENTS).map(
            |mut textures| {
                textures.enable_multiple(true);
                textures
            },
        )
    };
    let mut costs = Vec::with_capacity(Parameter::ALL.len() + 1);
    for parameter in Parameter::ALL {
        let mut textures = make(hair)?;
        let ends = [edited(hair, parameter), *hair];
        let mut runs = Vec::with_capacity(repetitions);
        for ix in 0..repetitions.max(1) {
            let start = Instant::now();
            let report = textures.apply(&ends[ix % 2])?;
            runs.push((1e6 * start.elapsed().as_secs_f64(), report));
        }
        costs.push(summary(parameter.name(), &runs));
    }
    let mut runs = Vec::with_capacity(repetitions);
    for _ in 0..repetitions.max(1) {
        // Nothing but the fibre is there before.
        let mut textures = HairMaterial::new(Arc::clone(tables), fresnel, hair, &[], SEGMENTS)?;
        let start = Instant::now();
        let mut report = textures.enable(&Lobe::ALL)?;
        let averages = textures.enable_multiple(true);
        report.parts.extend(averages.rebuilt());
        runs.push((1e6 * start.elapsed().as_secs_f64(), report));
    }
    costs.push(summary("all", &runs));
    Ok(costs)
}

/// Segments of the paper's outer integral; no texture depends on them.
const SEGMENTS: u32 = 4;

/// `hair` with another value of `parameter`.
fn edited(hair: &HairParams, parameter: Parameter) -> HairParams {
    let mut hair = *hair;
    let values = match parameter {
        Parameter::Eta => [1.52; 3],
        Parameter::SigmaA => [0.1, 0.9, 1.7],
        Parameter::Width | Parameter::CausticWidth => parameter.get(&hair).map(|beta| 1.1 * beta),
        Parameter::Eccentricity => [(0.99 * hair.eccentricity).max(0.51); 3],
        _ => parameter.get(&hair).map(|value| 0.9 * value),
    };
    parameter.set(&mut hair, values);
    hair
}

/// Medians over `runs`, which all make the same parts.
fn summary(parameter: &'static str, runs: &[(f64, EditReport)]) -> EditCost {
    let Some((_, first)) = runs.first() else {
        return EditCost {
            parameter,
            rebuilt: Vec::new(),
            bytes: 0,
            microseconds: 0.0,
        };
    };
    let rebuilt = first.rebuilt().map(|part| PartCost {
        name: part.name,
        bytes: part.gpu_bytes,
        microseconds: median(runs.iter().map(|(_, report)| {
            let mut same = report.rebuilt().filter(|other| other.part == part.part);
            same.next().map_or(0.0, |part| part.microseconds)
        })),
    });
    EditCost {
        parameter,
        rebuilt: rebuilt.collect(),
        bytes: first.bytes_to_upload(),
        microseconds: median(runs.iter().map(|(microseconds, _)| *microseconds)),
    }
}

/// The middle value, the upper one of two; 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
