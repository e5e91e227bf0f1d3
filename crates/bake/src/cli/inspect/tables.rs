//! Tables.

use std::path::Path;

use serde::Serialize;
use strandlight_formats::{Axis, BakedFile, Kind, TableFile};

use super::super::Failure;
use super::parts::{as_map, parameters, version};

#[derive(Serialize)]
struct AxisInfo {
    name: String,
    min: f64,
    max: f64,
    count: u32,
    spacing: &'static str,
    texel_centres: &'static str,
}

#[derive(Serialize)]
struct TableEntry {
    name: String,
    axes: Vec<AxisInfo>,
    channels: Vec<String>,
    format: String,
    max_interpolation_error: f32,
}

#[derive(Serialize)]
pub(super) struct TablesInfo {
    kind: &'static str,
    format_version: String,
    fresnel: String,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
    tables: Vec<TableEntry>,
}

/// Reads everything, so that damage anywhere is found, and keeps the headers.
pub(super) fn tables(path: &Path) -> Result<TablesInfo, Failure> {
    let format_version = version(path, Kind::Tables)?;
    let file = TableFile::read(path).map_err(Failure::input)?;
    let entries = file.tables.iter().map(|table| TableEntry {
        name: table.name.clone(),
        axes: table
            .axes
            .iter()
            .map(|axis| AxisInfo {
                name: axis.name.clone(),
                min: axis.min,
                max: axis.max,
                count: axis.count,
                spacing: axis.spacing.name(),
                texel_centres: Axis::TEXEL_CENTRES,
            })
            .collect(),
        channels: table.channels.clone(),
        format: table.header().format(),
        max_interpolation_error: table.max_interpolation_error,
    });
    Ok(TablesInfo {
        kind: "tables",
        format_version,
        tables: entries.collect(),
        fresnel: file.fresnel,
        parameters: file.info.parameters,
        tool_version: file.info.tool_version,
    })
}

pub(super) fn text_of_tables(info: &TablesInfo) -> Vec<String> {
    let mut lines = vec![
        format!("tables {}", info.format_version),
        format!("fresnel {}", info.fresnel),
    ];
    lines.extend(parameters(&info.parameters, &info.tool_version));
    for table in &info.tables {
        lines.push(format!(
            "{}: {}, channels {}, max interpolation error {:.2e}",
            table.name,
            table.format,
            table.channels.join(" "),
            table.max_interpolation_error
        ));
        for axis in &table.axes {
            lines.push(format!(
                "  {}: {} texels, {} to {}, {}, {}",
                axis.name, axis.count, axis.min, axis.max, axis.spacing, axis.texel_centres
            ));
        }
    }
    lines
}
