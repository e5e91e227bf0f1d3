//! The baked tables as the renderer samples them. Twin: `shaders/lib/tables.wgsl`.
//!
//! Sampling is bilinear by hand: four texels, weights in single precision, clamped to the first
//! and last texel centre. The hardware's filter has 8 bit weights on some GPUs. What rows,
//! columns and channels mean is written in [`crate::table_layout`].

use crate::axis::{Axis, Spacing};
use crate::table_layout::{C_DEGREE, h_column_f32};

use super::circular_gaussian::c_0;

/// Codes of [`TableAxis::spacing`], one for each [`Spacing`].
const SPACING_LINEAR: u32 = 0;
pub(crate) const SPACING_LOG: u32 = 1;
pub(crate) const SPACING_INVERSE_SQRT: u32 = 2;
pub(crate) const SPACING_ROOT_SQUARE: u32 = 3;
pub(crate) const SPACING_RECIPROCAL: u32 = 4;
pub(crate) const SPACING_CONCAVE: u32 = 5;

/// One axis, byte for byte the struct `TableAxis` of the shaders (32 bytes): texel coordinate =
/// (warp(x) - warp_min) * scale, 0..=last.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TableAxis {
    /// Value at the first texel centre.
    pub min: f32,
    /// Value at the last texel centre.
    pub max: f32,
    /// Warped value at the first texel centre.
    pub warp_min: f32,
    /// Texels per unit of warped value.
    pub scale: f32,
    /// Index of the last texel, at least 1.
    pub last: f32,
    /// Which warp: position in [`Spacing`].
    pub spacing: u32,
    /// Fills the struct; always 0.
    pub padding_0: u32,
    /// Fills the struct; always 0.
    pub padding_1: u32,
}

impl From<Axis> for TableAxis {
    fn from(axis: Axis) -> TableAxis {
        let axis = axis.to_f32();
        TableAxis {
            min: axis.min,
            max: axis.max,
            warp_min: axis.warp_min,
            scale: axis.scale,
            last: axis.last,
            spacing: match axis.spacing {
                Spacing::Linear => SPACING_LINEAR,
                Spacing::Log => SPACING_LOG,
                Spacing::InverseSqrt => SPACING_INVERSE_SQRT,
                Spacing::RootSquare => SPACING_ROOT_SQUARE,
                Spacing::Reciprocal => SPACING_RECIPROCAL,
                Spacing::Concave => SPACING_CONCAVE,
            },
            padding_0: 0,
            padding_1: 0,
        }
    }
}

/// What the shaders know of the tables, byte for byte the uniform `TableAxes` (144 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TableAxes {
    /// Rows of C: kappa = 2 / lambda'^2.
    pub c_rows: TableAxis,
    /// Columns of C: |cos(phi/2)|.
    pub c_columns: TableAxis,
    /// Rows of H_TT and H_TRT: eta.
    pub h_rows: TableAxis,
    /// Columns of H_TT and H_TRT: eta / eta' (dielectric) or cos(theta_d) (Schlick).
    pub h_columns: TableAxis,
    /// Fresnel term inside H: 0 dielectric, 1 Schlick.
    pub schlick: u32,
    /// Fills the uniform; always 0.
    pub padding_0: u32,
    /// Fills the uniform; always 0.
    pub padding_1: u32,
    /// Fills the uniform; always 0.
    pub padding_2: u32,
}

crate::mirrors! {
    TableAxis as "TableAxis" in "lib/tables" {
        min, max, warp_min, scale, last, spacing, padding_0, padding_1,
    }
    TableAxes as "TableAxes" in "lib/tables" {
        c_rows, c_columns, h_rows, h_columns, schlick, padding_0, padding_1, padding_2,
    }
}

/// Warp of an axis, by its code; as [`Spacing::warp_f32`].
fn table_warp(spacing: u32, x: f32) -> f32 {
    if spacing == SPACING_INVERSE_SQRT {
        let t = 1.0 / (1.0 + x).sqrt();
        return 0.5 * (t + t.sqrt());
    }
    if spacing == SPACING_ROOT_SQUARE {
        return 0.6 * x.sqrt() + 0.4 * x * x;
    }
    if spacing == SPACING_RECIPROCAL {
        let r = 1.0 - 1.0 / x;
        return 0.5 * (r + r * r);
    }
    if spacing == SPACING_CONCAVE {
        return x * (1.3 - 0.3 * x);
    }
    if spacing == SPACING_LOG {
        return x.ln();
    }
    x
}

/// A texel of C: b_1..b_8 as unorm16, so value times 65535. As four u32, the texture's
/// components, b_1 is the low half of the first.
pub type PackedShares = [u16; C_DEGREE];

/// What 1 is in a [`PackedShares`].
pub(crate) const PACKED_ONE: f32 = 65535.0;

/// Rounds shares to texels of C: off by at most 7.7e-6 each. Values outside 0..=1 are clamped.
pub fn pack_shares(shares: &[f32; C_DEGREE]) -> PackedShares {
    shares.map(|share| (share.clamp(0.0, 1.0) * PACKED_ONE).round() as u16)
}

/// Views of the three tables.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// `[kappa][cos_half_phi]` texels of 16 bytes, b_1..b_8: shares of C_0 in the Bernstein
    /// integrals b_i of degree eight in |cos(phi/2)|.
    pub c: &'a [PackedShares],
    /// `[eta][h column]` RGBA texels, H_0, H_2, H_4, H_6 of TT.
    pub h_tt: &'a [[f32; 4]],
    /// As `h_tt`, of TRT.
    pub h_trt: &'a [[f32; 4]],
    /// Axes of all three.
    pub axes: TableAxes,
}

/// Two neighbouring texels of an axis and the weight of the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Index of the first texel.
    pub first: u32,
    /// Weight of the second texel, 0..=1.
    pub fraction: f32,
}

/// `x` clamped to `low..=high`, `low` for NaN: two instructions, clamp is ten.
fn within(x: f32, low: f32, high: f32) -> f32 {
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

/// The cell of `axis` that `x` falls into; the ends are clamped.
pub fn table_cell(axis: &TableAxis, x: f32) -> Cell {
    let warped = table_warp(axis.spacing, within(x, axis.min, axis.max));
    let at = within((warped - axis.warp_min) * axis.scale, 0.0, axis.last);
    // Truncation, at >= 0; floor would be a call.
    let first = within(at, 0.0, axis.last - 1.0) as u32;
    Cell {
        first,
        fraction: at - first as f32,
    }
}

/// Bilinear mix of four texels: 0 and 1 along the row, the second pair one row on.
fn mix_texels(t: [[f32; 4]; 4], row: f32, column: f32) -> [f32; 4] {
    std::array::from_fn(|i| {
        let top = t[0][i] + (t[1][i] - t[0][i]) * column;
        let bottom = t[2][i] + (t[3][i] - t[2][i]) * column;
        top + (bottom - top) * row
    })
}

/// H_0, H_2, H_4, H_6 from one of the H tables; `row` is the cell of `eta`.
pub fn sample_h(
    table: &[[f32; 4]],
    axes: &TableAxes,
    row: Cell,
    eta: f32,
    cos_theta_d: f32,
) -> [f32; 4] {
    let column = table_cell(
        &axes.h_columns,
        h_column_f32(eta, cos_theta_d, axes.schlick == 0),
    );
    let width = axes.h_columns.last as usize + 1;
    let at = row.first as usize * width + column.first as usize;
    let texels = [
        table[at],
        table[at + 1],
        table[at + width],
        table[at + width + 1],
    ];
    mix_texels(texels, row.fraction, column.fraction)
}

/// b_1..b_8 of the table C: one bilinear fetch of packed texels.
pub fn sample_c(
    table: &[PackedShares],
    axes: &TableAxes,
    kappa: f32,
    cos_half: f32,
) -> [f32; C_DEGREE] {
    let row = table_cell(&axes.c_rows, kappa);
    let column = table_cell(&axes.c_columns, cos_half);
    let width = axes.c_columns.last as u32 as usize + 1;
    let at = row.first as usize * width + column.first as usize;
    // Loops over whole texels become vector instructions; closures a channel do not.
    let mix = |row: &[PackedShares]| {
        let mut mixed = [0.0; C_DEGREE];
        for i in 0..C_DEGREE {
            let (left, right) = (f32::from(row[0][i]), f32::from(row[1][i]));
            mixed[i] = left + (right - left) * column.fraction;
        }
        mixed
    };
    let mut b = mix(&table[at..at + 2]);
    let bottom = mix(&table[at + width..at + width + 2]);
    for i in 0..C_DEGREE {
        b[i] = (b[i] + (bottom[i] - b[i]) * row.fraction) * (1.0 / PACKED_ONE);
    }
    b
}

/// C_k at a cell of the table, k in 1..=6: `scale` = C_0 times the sum over i >= k of
/// binom(i, k) / binom(8, k) b_i.
pub fn c_from_b(b: [f32; C_DEGREE], k: u32, scale: f32) -> f32 {
    let mut binomial_ik = 1.0;
    let mut sum = 0.0;
    for i in k..9 {
        sum += binomial_ik * b[i as usize - 1];
        binomial_ik *= (i as f32 + 1.0) / (i as f32 + 1.0 - k as f32);
    }
    // The last step made binom(9, k) = binom(8, k) 9 / (9 - k).
    scale * sum / (binomial_ik * (9.0 - k as f32) / 9.0)
}

impl Tables<'_> {
    /// Do the views have as many texels as the axes say, at least two a side?
    pub fn is_complete(&self) -> bool {
        let count = |rows: &TableAxis, columns: &TableAxis| {
            let enough = rows.last >= 1.0 && columns.last >= 1.0;
            enough.then_some((rows.last as usize + 1) * (columns.last as usize + 1))
        };
        let h = count(&self.axes.h_rows, &self.axes.h_columns);
        let c = count(&self.axes.c_rows, &self.axes.c_columns);
        c == Some(self.c.len()) && h == Some(self.h_tt.len()) && h == Some(self.h_trt.len())
    }

    /// C_k(lambda', phi) for `k` in 0..=6 as the renderer samples it; any phi.
    /// C_0 is 2 pi exp(-kappa) I_0(kappa), not stored.
    pub fn c_k(&self, k: u32, lambda_p: f32, phi: f32) -> f32 {
        let kappa = 2.0 / (lambda_p * lambda_p);
        let scale = c_0(kappa);
        if k == 0 {
            return scale;
        }
        let cos_half = (0.5 * phi).cos().abs();
        c_from_b(
            sample_c(self.c, &self.axes, kappa, cos_half),
            k.min(6),
            scale,
        )
    }

    /// H_k of TT (`trt` false) or TRT for k = 0, 2, 4, 6 as the renderer samples them.
    pub fn h(&self, trt: bool, eta: f32, theta_d: f32) -> [f32; 4] {
        let table = if trt { self.h_trt } else { self.h_tt };
        let row = table_cell(&self.axes.h_rows, eta);
        sample_h(table, &self.axes, row, eta, theta_d.cos().max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_warp_is_that_of_its_axis() {
        for (spacing, min, max) in [
            (Spacing::Linear, -1.0, 3.0),
            (Spacing::Log, 0.001, 10.0),
            (Spacing::InverseSqrt, 0.0, 2e6),
            (Spacing::RootSquare, 0.0, 1.0),
            (Spacing::Reciprocal, 1.0, 10.0),
            (Spacing::Concave, 0.0, 1.0),
        ] {
            let axis = Axis {
                min,
                max,
                count: 17,
                spacing,
            };
            let twin = TableAxis::from(axis);
            for step in -2..=102 {
                let x = (min + (max - min) * f64::from(step) / 100.0) as f32;
                let cell = table_cell(&twin, x);
                let at = cell.first as f32 + cell.fraction;
                assert_eq!(at, axis.to_f32().texel_from_value(x), "{spacing:?} {x}");
                assert!(cell.first <= 15 && (0.0..=1.0).contains(&cell.fraction));
            }
        }
    }

    #[test]
    fn powers_come_back_from_the_bernstein_basis() {
        // b_i of a light so narrow that c is one number: binom(8, i) c^i (1 - c)^(8 - i).
        let c = 0.7f32;
        let binomials = [8.0f32, 28.0, 56.0, 70.0, 56.0, 28.0, 8.0, 1.0];
        let b = std::array::from_fn(|ix| {
            binomials[ix] * c.powi(ix as i32 + 1) * (1.0 - c).powi(7 - ix as i32)
        });
        for k in 1..=6 {
            assert!((c_from_b(b, k, 2.0) - 2.0 * c.powi(k as i32)).abs() < 1e-6);
        }
    }
}
