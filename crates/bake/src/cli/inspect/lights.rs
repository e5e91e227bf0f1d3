//! Light sets.

use std::path::Path;

use serde::Serialize;
use strandlight_bake::lights::exchange;
use strandlight_formats::{BakedFile, FitReport, Kind, LightSet, SrbfLight, counted};

use super::super::Failure;
use super::parts::{as_map, parameters, version};

/// A light set as `inspect --json` and `export -o X.json` show it.
#[derive(Serialize)]
pub struct LightsInfo {
    kind: &'static str,
    format_version: String,
    map_hash: String,
    map_size: [u32; 2],
    requested_count: u32,
    seed: u64,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
    report: Option<FitReport>,
    /// Name of the kind of the lights.
    light_kind: &'static str,
    /// What the numbers of a light mean.
    formula: &'static str,
    up: &'static str,
    frame: &'static str,
    lights: Vec<LightInfo>,
    test_directions: [TestInfo; 8],
    sh9_basis: &'static str,
    sh9: [[f64; 3]; 9],
}

#[derive(Serialize)]
struct LightInfo {
    #[serde(flatten)]
    light: SrbfLight,
    sharpness: f64,
}

/// A direction, and the radiance of the set from there.
#[derive(Serialize)]
struct TestInfo {
    direction: [f64; 3],
    radiance: [f64; 3],
}

/// Reads the light set at `path`.
pub fn lights(path: &Path) -> Result<LightsInfo, Failure> {
    let format_version = version(path, Kind::Lights)?;
    let set = LightSet::read(path).map_err(Failure::input)?;
    let light_kind = set.kind().name();
    let LightSet { lights, info } = set;
    Ok(LightsInfo {
        kind: "lights",
        format_version,
        map_hash: info.map_hash,
        map_size: info.map_size,
        requested_count: info.requested_count,
        seed: info.seed,
        parameters: info.parameters,
        tool_version: info.tool_version,
        report: info.report,
        light_kind,
        formula: exchange::FORMULA,
        up: "+Y",
        frame: exchange::FRAME,
        test_directions: exchange::test_directions(&lights).map(|test| TestInfo {
            direction: test.direction,
            radiance: test.radiance,
        }),
        sh9_basis: exchange::SH9_BASIS,
        sh9: exchange::sh9(&lights),
        lights: lights
            .into_iter()
            .map(|light| LightInfo {
                sharpness: exchange::sharpness(light.lambda),
                light,
            })
            .collect(),
    })
}

pub(super) fn text_of_lights(info: &LightsInfo) -> Vec<String> {
    let mut lines = vec![format!("lights {}", info.format_version)];
    lines.push(format!(
        "{} ({}), {} asked for, seed {}",
        counted(info.lights.len(), "light", "lights"),
        info.light_kind,
        info.requested_count,
        info.seed
    ));
    if !info.map_hash.is_empty() {
        let [width, height] = info.map_size;
        lines.push(format!("map: {width} x {height}, hash {}", info.map_hash));
    }
    if let Some(report) = info.report {
        lines.push(format!(
            "rel_l2 {:.4}, energy_ratio {:.4?}, irradiance_error {:.4}, fibre_error {:.4}",
            report.rel_l2, report.energy_ratio, report.irradiance_error, report.fibre_error
        ));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines.push("direction x, y, z; lambda; r, g, b".to_owned());
    for LightInfo { light, .. } in &info.lights {
        let ([x, y, z], [r, g, b]) = (light.direction, light.rgb);
        lines.push(format!(
            "{x:8.4} {y:8.4} {z:8.4}  {:8.5}  {r:10.4} {g:10.4} {b:10.4}",
            light.lambda
        ));
    }
    lines
}
