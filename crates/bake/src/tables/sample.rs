//! Reading tables as the renderer does: bilinear in single precision, clamped to the ends.

use strandlight_formats::Table;
use strandlight_scattering::axis::AxisF32;

use super::layout::scattering_axis;

/// A 2D table prepared for sampling.
#[derive(Clone, Debug)]
pub struct TableSampler<'a> {
    table: &'a Table,
    rows: AxisF32,
    columns: AxisF32,
    n_columns: usize,
}

impl<'a> TableSampler<'a> {
    /// Prepares `table`; `None` if it is not two-dimensional with at least 2 x 2 texels, all of
    /// them there.
    pub fn new(table: &'a Table) -> Option<Self> {
        let [rows, columns] = table.axes.as_slice() else {
            return None;
        };
        let n_columns = columns.count as usize;
        let complete = table.data.len() == rows.count as usize * n_columns * table.channels.len();
        if !complete || rows.count < 2 || n_columns < 2 {
            return None;
        }
        Some(TableSampler {
            table,
            rows: scattering_axis(rows).to_f32(),
            columns: scattering_axis(columns).to_f32(),
            n_columns,
        })
    }

    /// The first `N` channels at `(row, column)`, in units of the axes; channels that the table
    /// does not have are 0.
    pub fn sample<const N: usize>(&self, row: f32, column: f32) -> [f32; N] {
        let (r, fr) = split(self.rows.texel_from_value(row), self.rows.last);
        let (c, fc) = split(self.columns.texel_from_value(column), self.columns.last);
        let n_channels = self.table.channels.len();
        let texel = |r: usize, c: usize| &self.table.data[(r * self.n_columns + c) * n_channels..];
        let (t00, t01) = (texel(r, c), texel(r, c + 1));
        let (t10, t11) = (texel(r + 1, c), texel(r + 1, c + 1));
        std::array::from_fn(|i| {
            if i >= n_channels {
                return 0.0;
            }
            let top = t00[i] + fc * (t01[i] - t00[i]);
            let bottom = t10[i] + fc * (t11[i] - t10[i]);
            top + fr * (bottom - top)
        })
    }
}

/// Index of the lower texel (at most `last - 1`) and the fraction towards the next.
fn split(texel: f32, last: f32) -> (usize, f32) {
    let lower = texel.floor().min(last - 1.0).max(0.0);
    (lower as usize, texel - lower)
}
