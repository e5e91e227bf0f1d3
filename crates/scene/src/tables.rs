//! Baked tables in the form that shading reads, in memory and on the GPU.

use strandlight_formats::{Axis, Table, TableFile};
use strandlight_scattering::Lobe;
use strandlight_scattering::axis;
use strandlight_scattering::closed_form::{PackedShares, TableAxes, Tables, pack_shares};
use strandlight_scattering::fresnel::UnknownFresnel;
use strandlight_scattering::lobes::{
    LobeAxes, LobeTable, SHAPE_AXIS_NAMES, SHAPE_CHANNELS, SHARE_AXIS_NAMES, SHARE_CHANNELS,
    table_names,
};
use strandlight_scattering::table_layout::{
    C_AXIS_NAMES, C_CHANNELS, H_AXIS_NAMES_DIELECTRIC, H_AXIS_NAMES_SCHLICK, H_CHANNELS,
};

/// Why a `.tables` file cannot be used for shading.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShadingTablesError {
    /// A table is not in the file.
    #[error("table '{0}' is missing")]
    Missing(&'static str),
    /// A table has other axes than shading knows how to read.
    #[error("table '{table}' has the axes {found}, expected {expected}")]
    Axes {
        /// The table.
        table: &'static str,
        /// Names of its axes.
        found: String,
        /// Names of the axes that are understood.
        expected: String,
    },
    /// A channel is not in a table.
    #[error("table '{table}' has no channel '{channel}'")]
    Channel {
        /// The table.
        table: &'static str,
        /// The missing channel.
        channel: &'static str,
    },
    /// The table has another amount of data than its axes ask for, or too much of it.
    #[error("table '{table}' holds {found} floats in axes of {rows} x {columns}")]
    Size {
        /// The table.
        table: &'static str,
        /// Floats in the file.
        found: usize,
        /// Count of the first axis.
        rows: u32,
        /// Count of the second axis.
        columns: u32,
    },
    /// Tables of lobes on other axes than each other, on fewer than four texels, or with widths
    /// that are not positive.
    #[error("the tables '{shapes}' and '{shares}' make no lobes: {what}")]
    Lobes {
        /// The table of shapes.
        shapes: &'static str,
        /// The table of shares.
        shares: &'static str,
        /// What is wrong.
        what: &'static str,
    },
    /// H_TT and H_TRT do not share their axes.
    #[error("tables 'H_TT' and 'H_TRT' have different axes")]
    Different,
    /// The tables were made for a Fresnel term that is not known.
    #[error(transparent)]
    Fresnel(#[from] UnknownFresnel),
}

/// Name of the file beside a web page with the tables of scenes that name none.
#[cfg(target_arch = "wasm32")]
pub const DEFAULT_FILE: &str = "default.tables";

/// Name of the table that shading with `mode` reads.
pub(crate) const fn table_of(mode: Lobe) -> &'static str {
    match mode {
        Lobe::R => "C",
        Lobe::Tt => "H_TT",
        Lobe::Trt => "H_TRT",
    }
}

/// Axes and texels of a table.
type TexelTable<T> = ([axis::Axis; 2], Vec<T>);

/// Axis of a table that is not there.
const NO_AXIS: axis::Axis = axis::Axis {
    min: 0.0,
    max: 1.0,
    count: 2,
    spacing: axis::Spacing::Linear,
};

/// Most texels along a side, the least that every WebGPU device takes.
const MAX_SIDE: u32 = 8192;

/// The tables C, packed, and H_TT and H_TRT as RGBA texels, row by row; see
/// [`strandlight_scattering::closed_form::Tables`] for their layout.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadingTables {
    c: Vec<PackedShares>,
    h_tt: Vec<[f32; 4]>,
    h_trt: Vec<[f32; 4]>,
    axes: TableAxes,
}

impl ShadingTables {
    /// Takes what shading with all modes needs out of a file; see [`ShadingTables::for_modes`].
    ///
    /// # Errors
    /// As there.
    pub fn from_file(file: &TableFile) -> Result<ShadingTables, ShadingTablesError> {
        ShadingTables::for_modes(file, &Lobe::ALL)
    }

    /// Takes what shading with `modes` needs out of a file: one table a mode, see
    /// `table_of`; the others stay empty and must not be sampled. Channels are found by name, so
    /// their order in the file does not matter.
    ///
    /// # Errors
    /// A missing table or channel, axes of another meaning, or an amount of data that does not
    /// fit the axes.
    pub fn for_modes(
        file: &TableFile,
        modes: &[Lobe],
    ) -> Result<ShadingTables, ShadingTablesError> {
        let schlick = file.fresnel == "schlick";
        let h_names = if schlick {
            H_AXIS_NAMES_SCHLICK
        } else {
            H_AXIS_NAMES_DIELECTRIC
        };
        let read_h = |mode: Lobe| {
            let wanted = modes.contains(&mode);
            wanted
                .then(|| texels(file, table_of(mode), h_names, &H_CHANNELS))
                .transpose()
        };
        let c = modes
            .contains(&Lobe::R)
            .then(|| texels(file, table_of(Lobe::R), C_AXIS_NAMES, &C_CHANNELS))
            .transpose()?;
        let h_tt = read_h(Lobe::Tt)?;
        let h_trt = read_h(Lobe::Trt)?;
        if let (Some((tt_axes, _)), Some((trt_axes, _))) = (&h_tt, &h_trt)
            && tt_axes != trt_axes
        {
            return Err(ShadingTablesError::Different);
        }
        let (c_axes, c) = c.unwrap_or_else(nothing);
        let h_axes = match (&h_tt, &h_trt) {
            (Some((axes, _)), _) | (None, Some((axes, _))) => *axes,
            (None, None) => [NO_AXIS; 2],
        };
        // As many rows as the other H table has.
        let blank = || (h_axes, vec![[0.0; 4]; h_axes[0].count as usize]);
        Ok(ShadingTables {
            c: c.iter().map(pack_shares).collect(),
            h_tt: h_tt.unwrap_or_else(blank).1,
            h_trt: h_trt.unwrap_or_else(blank).1,
            axes: TableAxes {
                c_rows: c_axes[0].into(),
                c_columns: c_axes[1].into(),
                h_rows: h_axes[0].into(),
                h_columns: h_axes[1].into(),
                schlick: u32::from(schlick),
                padding_0: 0,
                padding_1: 0,
                padding_2: 0,
            },
        })
    }

    /// Takes what the renderer's scheme needs out of a file: as [`ShadingTables::from_file`], but of a
    /// lean one ([`is_lean`]) `C` alone; `H_TT` and `H_TRT` must not be sampled then.
    ///
    /// # Errors
    /// As there.
    pub fn whole_or_lean(file: &TableFile) -> Result<ShadingTables, ShadingTablesError> {
        let modes = if is_lean(file) {
            &Lobe::ALL[..1]
        } else {
            &Lobe::ALL
        };
        ShadingTables::for_modes(file, modes)
    }

    /// The view that the closed forms sample.
    pub fn view(&self) -> Tables<'_> {
        Tables {
            c: &self.c,
            h_tt: &self.h_tt,
            h_trt: &self.h_trt,
            axes: self.axes,
        }
    }

    /// The uniform of the shaders.
    pub fn axes(&self) -> &TableAxes {
        &self.axes
    }
}

/// Whether `file` has neither `H_TT` nor `H_TRT`, which only the paper's scheme reads: what
/// `strandlight tables --lean` writes.
pub fn is_lean(file: &TableFile) -> bool {
    [Lobe::Tt, Lobe::Trt]
        .iter()
        .all(|&mode| file.table(table_of(mode)).is_none())
}

/// Takes the lobes of TT or TRT out of a file, to be sliced for a fibre.
///
/// # Errors
/// A missing table or channel, axes of another meaning, or an amount of data that does not fit
/// the axes.
pub fn lobe_table(file: &TableFile, mode: Lobe) -> Result<LobeTable, ShadingTablesError> {
    let [shapes, shares] = table_names(mode);
    let invalid = |what| ShadingTablesError::Lobes {
        shapes,
        shares,
        what,
    };
    let (shape_axes, shape_texels) = entries(file, shapes, &SHAPE_AXIS_NAMES, &SHAPE_CHANNELS)?;
    let (share_axes, share_texels) = entries(file, shares, &SHARE_AXIS_NAMES, &SHARE_CHANNELS)?;
    if share_axes[..2] != shape_axes[..] {
        return Err(invalid("their axes differ"));
    }
    let table = LobeTable {
        lobe: mode,
        fresnel: file.fresnel.parse()?,
        axes: LobeAxes {
            eta: share_axes[0],
            alpha: share_axes[1],
            absorption: share_axes[2],
        },
        shapes: shape_texels,
        shares: share_texels,
    };
    if !table.is_complete() {
        return Err(invalid("fewer than four texels or a width not above 0"));
    }
    Ok(table)
}

/// Axes and entries of the table `name`, `channels` in this order; at least two `axis_names`.
fn entries<const N: usize>(
    file: &TableFile,
    name: &'static str,
    axis_names: &[&'static str],
    channels: &[&'static str; N],
) -> Result<(Vec<axis::Axis>, Vec<[f32; N]>), ShadingTablesError> {
    let table: &Table = file.table(name).ok_or(ShadingTablesError::Missing(name))?;
    let found: Vec<&str> = table.axes.iter().map(|axis| axis.name.as_str()).collect();
    if found != axis_names {
        return Err(other_axes(table, name, axis_names));
    }
    let mut from = [0; N];
    for (from, &channel) in from.iter_mut().zip(channels) {
        let position = table.channels.iter().position(|found| found == channel);
        *from = position.ok_or(ShadingTablesError::Channel {
            table: name,
            channel,
        })?;
    }
    let n_channels = table.channels.len();
    let n_entries = table
        .axes
        .iter()
        .try_fold(1usize, |n, axis| n.checked_mul(axis.count as usize));
    if n_entries.and_then(|n| n.checked_mul(n_channels)) != Some(table.data.len()) {
        return Err(ShadingTablesError::Size {
            table: name,
            found: table.data.len(),
            rows: table.axes[0].count,
            columns: table.axes[1].count,
        });
    }
    let entries = table
        .data
        .chunks_exact(n_channels)
        .map(|entry| from.map(|channel| entry[channel]))
        .collect();
    Ok((table.axes.iter().map(Axis::unnamed).collect(), entries))
}

/// A table that nothing reads: one column, since a texture cannot be empty.
fn nothing<const N: usize>() -> TexelTable<[f32; N]> {
    ([NO_AXIS; 2], vec![[0.0; N]; NO_AXIS.count as usize])
}

/// Axes and texels of the table `name`, `channels` in this order.
fn texels<const N: usize>(
    file: &TableFile,
    name: &'static str,
    axis_names: [&'static str; 2],
    channels: &[&'static str; N],
) -> Result<TexelTable<[f32; N]>, ShadingTablesError> {
    let (axes, texels) = entries(file, name, &axis_names, channels)?;
    let [rows, columns] = [axes[0], axes[1]];
    if [rows, columns]
        .iter()
        .any(|side| !(2..=MAX_SIDE).contains(&side.count))
    {
        return Err(ShadingTablesError::Size {
            table: name,
            found: texels.len() * N,
            rows: rows.count,
            columns: columns.count,
        });
    }
    Ok(([rows, columns], texels))
}

fn other_axes(table: &Table, name: &'static str, expected: &[&'static str]) -> ShadingTablesError {
    let found: Vec<&str> = table.axes.iter().map(|axis| axis.name.as_str()).collect();
    ShadingTablesError::Axes {
        table: name,
        found: found.join(", "),
        expected: expected.join(", "),
    }
}
