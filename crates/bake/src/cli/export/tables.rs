//! Tables as arrays for other programs.

use std::path::{Path, PathBuf};

use strandlight_formats::{Axis, Table, TableFile};
use strandlight_scattering::circular_gaussian::circular_gaussian_integral;
use strandlight_scattering::table_layout::{C_AXIS_NAMES, C_CHANNELS, C_FROM_B};

use super::super::{Failure, Outcome};
use super::npy;
use super::output::Output;
use strandlight_images::exr_file;

/// Refuses tables of `input` whose names would lead elsewhere than the files that are named after them.
pub fn check_names(input: &Path, file: &TableFile) -> Outcome {
    let axes = file.tables.iter().flat_map(|table| &table.axes);
    let names = file.tables.iter().map(|table| &table.name);
    for name in names.chain(axes.map(|axis| &axis.name)) {
        if name.contains(['/', '\\']) || name == ".." {
            let what = format!("{name:?} names a table or an axis, and cannot name a file");
            return Err(Failure::file(input, what));
        }
    }
    Ok(())
}

/// One `.npy` of shape [channel, axis 0, axis 1, ...] for each table, and one vector for each of
/// its axes.
pub fn to_npy(file: &TableFile, path_of: &dyn Fn(&str) -> PathBuf) -> Vec<Output> {
    let mut outputs = Vec::new();
    for table in &file.tables {
        let (channels, planes) = answers(table);
        let mut shape = vec![channels.len()];
        shape.extend(table.axes.iter().map(|axis| axis.count as usize));
        outputs.push(Output {
            path: path_of(&table.name),
            what: format!("npy float32 {shape:?}: {}", channels.join(", ")),
            bytes: npy::float32(&shape, &planes.concat()),
        });
        for axis in &table.axes {
            outputs.push(Output {
                path: path_of(&format!("{}_{}", table.name, axis.name)),
                what: format!(
                    "npy float64 [{}]: texel centres of {}",
                    axis.count, axis.name
                ),
                bytes: npy::float64(&centres(axis)),
            });
        }
    }
    outputs
}

/// One `.exr` for each table: columns are the last axis, rows all others, the first slowest.
pub fn to_exr(file: &TableFile, path_of: &dyn Fn(&str) -> PathBuf) -> Result<Vec<Output>, Failure> {
    let mut outputs = Vec::new();
    for table in &file.tables {
        let path = path_of(&table.name);
        let [rows @ .., columns] = &table.axes[..] else {
            let what = format!("table {} is no picture: no axes", table.name);
            return Err(Failure::file(&path, what));
        };
        let width = columns.count as usize;
        let height = rows.iter().map(|axis| axis.count as usize).product();
        let (channels, planes) = answers(table);
        let what = format!(
            "OpenEXR, {width} x {height} float32: {}",
            channels.join(", ")
        );
        let named = channels.into_iter().zip(planes);
        let named = named.map(|(name, plane)| exr_file::floats(name, plane));
        let bytes = exr_file::encode((width, height), named.collect(), &[])
            .map_err(|error| Failure::file(&path, format!("cannot be encoded: {error}")))?;
        outputs.push(Output { path, what, bytes });
    }
    Ok(outputs)
}

/// Names and planes of what a table answers: C_0 to C_6 for the table `C`, whose stored basis
/// b_i is over C_0 (see [`strandlight_scattering::table_layout`]), the channels as they are for
/// the others.
fn answers(table: &Table) -> (Vec<String>, Vec<Vec<f32>>) {
    let n_channels = table.channels.len();
    let basis: Option<Vec<usize>> = C_CHANNELS
        .iter()
        .map(|share| table.channels.iter().position(|name| name == share))
        .collect();
    let on_kappa = table
        .axes
        .first()
        .is_some_and(|axis| axis.name == C_AXIS_NAMES[0]);
    let Some(basis) = basis.filter(|_| table.name == "C" && on_kappa) else {
        let planes = (0..n_channels)
            .map(|channel| {
                table
                    .data
                    .iter()
                    .skip(channel)
                    .step_by(n_channels)
                    .copied()
                    .collect()
            })
            .collect();
        return (table.channels.clone(), planes);
    };
    let kappas = centres(&table.axes[0]);
    let texels_per_row = table.data.len() / n_channels / kappas.len();
    let mut planes = vec![Vec::new(); 7];
    for (texel_ix, texel) in table.data.chunks_exact(n_channels).enumerate() {
        let c_0 = circular_gaussian_integral(kappas[texel_ix / texels_per_row]);
        for (k, (row, plane)) in C_FROM_B.iter().zip(&mut planes).enumerate() {
            let sum: f64 = row[1..]
                .iter()
                .zip(&basis)
                .map(|(m, &at)| m * f64::from(texel[at]))
                .sum();
            // The shares sum to 1, b_0 included.
            let value = if k == 0 { c_0 } else { c_0 * sum };
            plane.push(value as f32);
        }
    }
    ((0..7).map(|k| format!("C{k}")).collect(), planes)
}

/// Values at the texel centres of `axis`.
fn centres(axis: &Axis) -> Vec<f64> {
    let unnamed = axis.unnamed();
    (0..axis.count).map(|ix| unnamed.value_at(ix)).collect()
}
