//! The baked lobes of one mode over (eta, alpha, absorption), and interpolation in them.

use std::f64::consts::FRAC_PI_2;

use super::fit::{ErrorNorm, best_shares, fit_path};
use super::moments::{Section, section_rule};
use super::shape::{LobeShape, N_SHAPE};
use crate::axis::{Axis, Spacing};
use crate::fresnel::Fresnel;
use crate::hair::Lobe;

/// Rows: index of refraction.
pub const LOBE_ETA: Axis = Axis {
    min: 1.0,
    max: 10.0,
    count: 12,
    spacing: Spacing::Reciprocal,
};

/// Columns: `alpha = asin(1 / eta')`, eta' the effective index; 0 at grazing theta_d. Only
/// alpha <= asin(1/eta) is reached by a theta_d.
pub const LOBE_ALPHA: Axis = Axis {
    min: 0.0,
    max: 1.56,
    count: 128,
    spacing: Spacing::Linear,
};

/// Layers: `s / (1 + s)`, s the effective absorption per radius
/// `sigma_a / sqrt(1 - sin^2 theta_d / eta^2)`.
pub const LOBE_ABSORPTION: Axis = Axis {
    min: 0.0,
    max: 0.98,
    count: 16,
    spacing: Spacing::Linear,
};

/// Channels of the tables of shapes.
pub const SHAPE_CHANNELS: [&str; N_SHAPE] = ["lambda_0", "lambda_1", "mu_1", "lambda_2", "mu_2"];
/// Channels of the tables of shares; `share_0` = 1 - share_1 - share_2.
pub const SHARE_CHANNELS: [&str; 2] = ["share_1", "share_2"];

/// Names of the axes of the tables of shapes.
pub const SHAPE_AXIS_NAMES: [&str; 2] = ["eta", "alpha"];
/// Names of the axes of the tables of shares.
pub const SHARE_AXIS_NAMES: [&str; 3] = ["eta", "alpha", "absorption"];

/// Names of the tables of shapes and of shares of TT or TRT (R has none; it is taken as TT).
pub const fn table_names(lobe: Lobe) -> [&'static str; 2] {
    match lobe {
        Lobe::R | Lobe::Tt => ["lobes_TT_shapes", "lobes_TT_shares"],
        Lobe::Trt => ["lobes_TRT_shapes", "lobes_TRT_shares"],
    }
}

/// The axes of a table of lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeAxes {
    /// See [`LOBE_ETA`].
    pub eta: Axis,
    /// See [`LOBE_ALPHA`].
    pub alpha: Axis,
    /// See [`LOBE_ABSORPTION`].
    pub absorption: Axis,
}

impl Default for LobeAxes {
    fn default() -> Self {
        LobeAxes {
            eta: LOBE_ETA,
            alpha: LOBE_ALPHA,
            absorption: LOBE_ABSORPTION,
        }
    }
}

/// Lobes of TT or TRT for every fibre.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeTable {
    /// Which mode.
    pub lobe: Lobe,
    /// Fresnel term that they are fitted to.
    pub fresnel: Fresnel,
    /// Axes of both arrays.
    pub axes: LobeAxes,
    /// `[eta][alpha]`, channels [`SHAPE_CHANNELS`].
    pub shapes: Vec<[f32; N_SHAPE]>,
    /// `[eta][alpha][absorption]`, channels [`SHARE_CHANNELS`].
    pub shares: Vec<[f32; 2]>,
}

/// One row of a table: what is fitted at one eta.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeRow {
    /// Shapes at every alpha.
    pub shapes: Vec<LobeShape>,
    /// `[alpha][absorption]`, shares of S_1 and S_2.
    pub shares: Vec<[f64; 2]>,
}

/// Index of the row to fit first, eta = 1.53; the others follow from neighbour to neighbour.
pub const FIRST_ROW: u32 = 3;

/// Fits the shapes of one row, starting from those of a neighbouring row (`None` for
/// [`FIRST_ROW`]).
pub fn fit_shapes(
    lobe: Lobe,
    fresnel: Fresnel,
    axes: &LobeAxes,
    row: u32,
    from: Option<&[LobeShape]>,
) -> Vec<LobeShape> {
    let eta = axes.eta.value_at(row);
    fit_path(lobe, fresnel, eta, &alphas(axes), &section_rule(), from)
}

/// The shares of S_1 and S_2 for the `shapes` of one row, `[alpha][absorption]`.
pub fn fit_shares(
    lobe: Lobe,
    fresnel: Fresnel,
    axes: &LobeAxes,
    row: u32,
    shapes: &[LobeShape],
) -> Vec<[f64; 2]> {
    let rule = section_rule();
    let eta = axes.eta.value_at(row);
    let sigmas: Vec<f64> = (0..axes.absorption.count)
        .map(|ix| sigma_from_absorption(axes.absorption.value_at(ix)))
        .collect();
    let norm = ErrorNorm::fitting(lobe);
    let mut shares = Vec::with_capacity(shapes.len() * sigmas.len());
    for (shape, alpha) in shapes.iter().zip(alphas(axes)) {
        let moments = shape.moments();
        for target in Section::new(lobe, fresnel, eta, alpha, &rule).moments(&sigmas) {
            let [_, w_1, w_2] = best_shares(&moments, &target, &norm.weights(&target));
            shares.push([w_1, w_2]);
        }
    }
    shares
}

fn alphas(axes: &LobeAxes) -> Vec<f64> {
    (0..axes.alpha.count)
        .map(|ix| axes.alpha.value_at(ix))
        .collect()
}

/// The effective absorption at a position of [`LOBE_ABSORPTION`].
pub fn sigma_from_absorption(t: f64) -> f64 {
    t / (1.0 - t)
}

/// Inverse of [`sigma_from_absorption`].
pub fn absorption_from_sigma(sigma: f64) -> f64 {
    sigma / (1.0 + sigma)
}

/// `alpha = asin(1/eta')` of index `eta` >= 1 at `cos_theta_d` in 0..=1.
pub fn alpha_from_cos_theta_d(eta: f64, cos_theta_d: f64) -> f64 {
    // tan(alpha) = cos(theta_d) / sqrt(eta^2 - 1).
    cos_theta_d
        .max(0.0)
        .atan2(((eta - 1.0) * (eta + 1.0)).max(0.0).sqrt())
}

/// Four neighbouring texels and their weights: cubic through the four centres around the point,
/// at the ends through the last four. Weights sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stencil {
    /// Index of the first texel.
    pub first: usize,
    /// Weights of the four.
    pub weights: [f64; 4],
}

impl Stencil {
    /// The stencil at `value` on `axis` (at least four texels); clamped to the ends.
    pub fn new(axis: &Axis, value: f64) -> Stencil {
        let last = axis.count.max(4) - 1;
        Stencil::at(f64::from(last) * axis.unit_from_value(value), last as usize)
    }

    /// The stencil at texel coordinate `at` in 0..=`last`.
    pub fn at(at: f64, last: usize) -> Stencil {
        let first = (at.floor() - 1.0).clamp(0.0, (last - 3) as f64);
        let x = at - first;
        // Lagrange through 0, 1, 2, 3.
        let (a, b, c) = (x - 1.0, x - 2.0, x - 3.0);
        Stencil {
            first: first as usize,
            weights: [
                -a * b * c / 6.0,
                0.5 * x * b * c,
                -0.5 * x * a * c,
                x * a * b / 6.0,
            ],
        }
    }
}

/// A table at one eta: `[alpha]` shapes, `[alpha][absorption]` shares.
#[derive(Clone, Debug, PartialEq)]
pub struct LobeSection {
    alpha: Axis,
    absorption: Axis,
    shapes: Vec<[f64; N_SHAPE]>,
    shares: Vec<[f64; 2]>,
}

impl LobeTable {
    /// Fits a whole table, row by row; `first` is the row whose eta is nearest to 1.5.
    pub fn fit(lobe: Lobe, fresnel: Fresnel, axes: LobeAxes, first: u32) -> LobeTable {
        let n = axes.eta.count as usize;
        let first = (first as usize).min(n - 1);
        let mut shapes = vec![Vec::new(); n];
        shapes[first] = fit_shapes(lobe, fresnel, &axes, first as u32, None);
        for row in (first + 1..n).chain((0..first).rev()) {
            let from = if row > first { row - 1 } else { row + 1 };
            shapes[row] = fit_shapes(lobe, fresnel, &axes, row as u32, Some(&shapes[from]));
        }
        let rows: Vec<LobeRow> = (0..)
            .zip(shapes)
            .map(|(row, shapes)| LobeRow {
                shares: fit_shares(lobe, fresnel, &axes, row, &shapes),
                shapes,
            })
            .collect();
        LobeTable::from_rows(lobe, fresnel, axes, &rows)
    }

    /// The table of these rows, in single precision.
    pub fn from_rows(lobe: Lobe, fresnel: Fresnel, axes: LobeAxes, rows: &[LobeRow]) -> LobeTable {
        LobeTable {
            lobe,
            fresnel,
            axes,
            shapes: rows
                .iter()
                .flat_map(|row| &row.shapes)
                .map(|shape| shape.to_array().map(|x| x as f32))
                .collect(),
            shares: rows
                .iter()
                .flat_map(|row| &row.shares)
                .map(|shares| shares.map(|x| x as f32))
                .collect(),
        }
    }

    /// Do the arrays have as many texels as the axes say, at least four along each, and are all
    /// widths positive?
    pub fn is_complete(&self) -> bool {
        let LobeAxes {
            eta,
            alpha,
            absorption,
        } = &self.axes;
        let n_shapes = eta.count as usize * alpha.count as usize;
        [eta, alpha, absorption].iter().all(|axis| axis.count >= 4)
            && self.shapes.len() == n_shapes
            && self.shares.len() == n_shapes * absorption.count as usize
            && self
                .shapes
                .iter()
                .all(|s| s[0] > 0.0 && s[1] > 0.0 && s[3] > 0.0)
    }

    /// The table at `eta`, cubic; clamped to the ends of the axis.
    pub fn at_eta(&self, eta: f64) -> LobeSection {
        let stencil = Stencil::new(&self.axes.eta, eta);
        LobeSection {
            alpha: self.axes.alpha,
            absorption: self.axes.absorption,
            shapes: mix_rows(&self.shapes, stencil, self.axes.eta.count as usize),
            shares: mix_rows(&self.shares, stencil, self.axes.eta.count as usize),
        }
    }
}

fn mix_rows<const N: usize>(data: &[[f32; N]], stencil: Stencil, n_rows: usize) -> Vec<[f64; N]> {
    let width = data.len() / n_rows;
    let mut mixed = vec![[0.0; N]; width];
    for (k, weight) in stencil.weights.iter().enumerate() {
        let row = &data[(stencil.first + k) * width..][..width];
        for (mixed, texel) in mixed.iter_mut().zip(row) {
            for i in 0..N {
                mixed[i] += weight * f64::from(texel[i]);
            }
        }
    }
    mixed
}

impl LobeSection {
    /// The stencil at `alpha` in 0..=pi/2.
    pub fn stencil(&self, alpha: f64) -> Stencil {
        Stencil::new(&self.alpha, alpha.min(FRAC_PI_2))
    }

    /// Widths and offsets; widths at least `lambda_min`.
    pub fn shape(&self, stencil: &Stencil, lambda_min: f64) -> LobeShape {
        let mut mixed = [0.0; N_SHAPE];
        for (k, weight) in stencil.weights.iter().enumerate() {
            let texel = &self.shapes[stencil.first + k];
            for i in 0..N_SHAPE {
                mixed[i] += weight * texel[i];
            }
        }
        let mut shape = LobeShape::from_array(mixed);
        shape.lambda = shape.lambda.map(|lambda| lambda.max(lambda_min));
        shape
    }

    /// Shares of the three lobes at effective absorption `sigma`: not negative, of sum 1.
    pub fn shares(&self, stencil: &Stencil, sigma: f64) -> [f64; 3] {
        let layer = Stencil::new(&self.absorption, absorption_from_sigma(sigma));
        let depth = self.absorption.count as usize;
        let mut mixed = [0.0; 2];
        for (k, weight) in stencil.weights.iter().enumerate() {
            let column = &self.shares[(stencil.first + k) * depth + layer.first..][..4];
            for (texel, layer_weight) in column.iter().zip(layer.weights) {
                mixed[0] += weight * layer_weight * texel[0];
                mixed[1] += weight * layer_weight * texel[1];
            }
        }
        // Cubics overshoot a little where a share ends at 0.
        let [w_1, w_2] = mixed.map(|w| w.max(0.0));
        let scale = 1.0 / (w_1 + w_2).max(1.0);
        let (w_1, w_2) = (w_1 * scale, w_2 * scale);
        [(1.0 - w_1 - w_2).max(0.0), w_1, w_2]
    }
}
