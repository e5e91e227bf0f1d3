//! LUTs.

use std::path::Path;

use serde::Serialize;
use strandlight_formats::{Cube, CubeTable};

use super::super::Failure;

/// Curves or a grid: samples along an axis, and the inputs at the first and the last.
#[derive(Serialize)]
struct CubeTableInfo {
    size: u32,
    input_min: [f32; 3],
    input_max: [f32; 3],
}

#[derive(Serialize)]
pub(super) struct LutInfo {
    kind: &'static str,
    title: Option<String>,
    /// Null where there are none.
    curves: Option<CubeTableInfo>,
    /// Null where there is none.
    grid: Option<CubeTableInfo>,
    /// Least and largest value of each channel, of the grid where there is one.
    output_min: [f32; 3],
    output_max: [f32; 3],
}

pub(super) fn lut(path: &Path) -> Result<LutInfo, Failure> {
    let cube = Cube::read(path).map_err(Failure::input)?;
    let last = cube.grid.as_ref().or(cube.curves.as_ref());
    let samples = last.map_or(&[][..], |table| &table.samples);
    let extreme = |pick: fn(f32, f32) -> f32| {
        let of = |channel: usize| samples.iter().map(|rgb| rgb[channel]).reduce(pick);
        [0, 1, 2].map(|channel| of(channel).unwrap_or_default())
    };
    let table = |table: &CubeTable| CubeTableInfo {
        size: table.size,
        input_min: table.low,
        input_max: table.high,
    };
    Ok(LutInfo {
        kind: "lut",
        curves: cube.curves.as_ref().map(table),
        grid: cube.grid.as_ref().map(table),
        output_min: extreme(f32::min),
        output_max: extreme(f32::max),
        title: cube.title,
    })
}

pub(super) fn text_of_lut(info: &LutInfo) -> Vec<String> {
    let of = |what: String, table: &CubeTableInfo| {
        let (min, max) = (table.input_min, table.input_max);
        format!("{what}, input {min:?} to {max:?}")
    };
    let title = info.title.as_deref().unwrap_or_default();
    let mut lines = vec![format!("LUT (.cube) {title}").trim_end().to_owned()];
    if let Some(table) = &info.curves {
        lines.push(of(format!("1D: {} samples", table.size), table));
    }
    if let Some(table) = &info.grid {
        let n = table.size;
        lines.push(of(format!("3D: {n} x {n} x {n} samples"), table));
    }
    let (min, max) = (info.output_min, info.output_max);
    lines.push(format!("output {min:?} to {max:?}"));
    lines
}
