//! The baked tables as the renderer samples them. Twin: `shaders/lib/tables.wgsl`.
//!
//! Sampling is bilinear by hand: four texels, weights in single precision, clamped to the first
//! and last texel centre. The hardware's filter has 8 bit weights on some GPUs.

use super::circular_gaussian::c_0;

/// Linear spacing, `x = min + (max - min) u`: value of [`TableAxis::spacing`].
pub const SPACING_LINEAR: u32 = 0;
/// Logarithmic spacing, `x = min (max / min)^u`: value of [`TableAxis::spacing`].
pub const SPACING_LOG: u32 = 1;

/// One axis: texel coordinate = (warp(x) - offset) * scale, clamped to 0..=last.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TableAxis {
    /// Warp of the coordinate: [`SPACING_LINEAR`] or [`SPACING_LOG`].
    pub spacing: u32,
    /// Warped value at the first texel centre.
    pub offset: f32,
    /// Texels per unit of warped value.
    pub scale: f32,
    /// Index of the last texel, at least 1.
    pub last: f32,
}

/// What the shaders know of the tables, byte for byte the uniform `TableAxes` (80 bytes).
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TableAxes {
    /// Rows of C: lambda'.
    pub c_lambda: TableAxis,
    /// Columns of C: phi in 0..=pi.
    pub c_phi: TableAxis,
    /// Rows of H_TT and H_TRT: eta.
    pub h_eta: TableAxis,
    /// Columns of H_TT and H_TRT: theta_d in 0..=pi/2.
    pub h_theta_d: TableAxis,
    /// Fresnel term inside H: 0 dielectric, 1 Schlick.
    pub schlick: u32,
    /// Fills the uniform; always 0, as the next two.
    pub padding_0: u32,
    /// See `padding_0`.
    pub padding_1: u32,
    /// See `padding_0`.
    pub padding_2: u32,
}

/// Views of the three tables.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// `[lambda'][phi][2]` RGBA texels, b_1..b_4 then b_5, b_6 and two unused: shares of C_0 in
    /// the Bernstein integrals b_i of degree six in |cos(phi/2)|.
    pub c: &'a [[f32; 4]],
    /// `[eta][theta_d]` RGBA texels, H_0, H_2, H_4, H_6 of TT.
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

/// The cell of `axis` that `x` falls into; the ends are clamped.
pub fn table_cell(axis: &TableAxis, x: f32) -> Cell {
    let warped = if axis.spacing == SPACING_LOG {
        x.max(1e-30).ln()
    } else {
        x
    };
    let at = ((warped - axis.offset) * axis.scale).clamp(0.0, axis.last);
    let first = at.floor().min(axis.last - 1.0);
    Cell {
        first: first as u32,
        fraction: at - first,
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

/// H_0, H_2, H_4, H_6 from one of the H tables.
pub fn sample_h(table: &[[f32; 4]], axes: &TableAxes, row: Cell, theta_d: f32) -> [f32; 4] {
    let column = table_cell(&axes.h_theta_d, theta_d.abs());
    let width = axes.h_theta_d.last as usize + 1;
    let at = row.first as usize * width + column.first as usize;
    let texels = [
        table[at],
        table[at + 1],
        table[at + width],
        table[at + width + 1],
    ];
    mix_texels(texels, row.fraction, column.fraction)
}

/// b_1..b_4 and b_5, b_6 of the table C.
pub fn sample_c(table: &[[f32; 4]], axes: &TableAxes, lambda_p: f32, phi: f32) -> [[f32; 4]; 2] {
    let row = table_cell(&axes.c_lambda, lambda_p);
    let column = table_cell(&axes.c_phi, phi.abs());
    let width = 2 * (axes.c_phi.last as usize + 1);
    let at = row.first as usize * width + 2 * column.first as usize;
    std::array::from_fn(|half| {
        let at = at + half;
        let texels = [
            table[at],
            table[at + 2],
            table[at + width],
            table[at + width + 2],
        ];
        mix_texels(texels, row.fraction, column.fraction)
    })
}

impl Tables<'_> {
    /// Do the views have as many texels as the axes say?
    pub fn is_complete(&self) -> bool {
        let count = |rows: &TableAxis, columns: &TableAxis| {
            (rows.last as usize + 1) * (columns.last as usize + 1)
        };
        let h = count(&self.axes.h_eta, &self.axes.h_theta_d);
        self.c.len() == 2 * count(&self.axes.c_lambda, &self.axes.c_phi)
            && self.h_tt.len() == h
            && self.h_trt.len() == h
    }

    /// C_k(lambda', phi) for `k` in 0..=6 as the renderer samples it; phi in 0..=pi, either sign.
    ///
    /// C_0 is 2 pi exp(-kappa) I_0(kappa); C_k / C_0 = sum over i >= k of
    /// binom(i, k) / binom(6, k) b_i.
    pub fn c_k(&self, k: u32, lambda_p: f32, phi: f32) -> f32 {
        let clamped = self.clamp_lambda_p(lambda_p);
        let scale = c_0(2.0 / (clamped * clamped));
        if k == 0 {
            return scale;
        }
        let [first, second] = sample_c(self.c, &self.axes, clamped, phi);
        let b = [first[0], first[1], first[2], first[3], second[0], second[1]];
        let binomial = |n: u32| (0..k).fold(1.0f32, |c, i| c * (n - i) as f32 / (i + 1) as f32);
        let share: f32 = (k..=6).map(|i| binomial(i) * b[i as usize - 1]).sum();
        scale * share / binomial(6)
    }

    /// `lambda_p` inside the range of the table.
    fn clamp_lambda_p(&self, lambda_p: f32) -> f32 {
        let axis = &self.axes.c_lambda;
        let max = axis.offset + axis.last / axis.scale;
        let (min, max) = match axis.spacing {
            SPACING_LOG => (axis.offset.exp(), max.exp()),
            _ => (axis.offset, max),
        };
        lambda_p.clamp(min, max)
    }

    /// H_k of TT (`trt` false) or TRT for k = 0, 2, 4, 6 as the renderer samples them.
    pub fn h(&self, trt: bool, eta: f32, theta_d: f32) -> [f32; 4] {
        let table = if trt { self.h_trt } else { self.h_tt };
        sample_h(
            table,
            &self.axes,
            table_cell(&self.axes.h_eta, eta),
            theta_d,
        )
    }
}
