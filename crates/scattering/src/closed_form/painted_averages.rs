//! The averages of dual scattering of painted fibres, as shading samples them. Twin:
//! `shaders/lib/painted_averages.wgsl`.

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2};

use super::averages::{LocalAverages, SampleAverages};
use super::hair_layers::{HairLayers, LAYERS_SINE, LAYERS_THETA, layers_of, mean_of_signs};
use super::multiple_scattering::N_FORWARD;
use super::painted_lobes::LAYER_MIDDLE;
use crate::dual_scattering::N_INCLINATIONS;

/// How the texels are placed, byte for byte the struct `PaintedAverages` of the shaders (32
/// bytes).
///
/// Rows: `[shift][width][layer]`; layer = `layer_scale sqrt(sigma_a / (3 + sigma_a))`, factors of
/// widths and shifts evenly in x / (1 + x). Columns: A_b, Delta_b, sigma_b^2, 0 at 128 inclinations
/// evenly over -pi/2..=pi/2, then a_f, beta_f^2, 0, 0 at 64 sines of the inclination evenly over
/// 0..=1, means of +theta and -theta. Delta_b is over the factor of shifts, sigma_b^2 and beta_f^2
/// over the square of that of widths.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PaintedAverages {
    /// Index of the last layer, at least 1.
    pub last_layer: f32,
    /// See above.
    pub layer_scale: f32,
    /// Index of the last factor of widths; 0 where they are not painted.
    pub last_width: f32,
    /// Index of the last factor of shifts, likewise.
    pub last_shift: f32,
    /// x / (1 + x) of the first factor.
    pub scale_first: f32,
    /// x / (1 + x) of the last factor less that of the first.
    pub scale_range: f32,
    /// Fills the struct; always 0.
    pub padding_0: u32,
    /// Fills the struct; always 0.
    pub padding_1: u32,
}

crate::mirrors! {
    PaintedAverages as "PaintedAverages" in "lib/painted_averages" {
        last_layer, layer_scale, last_width, last_shift, scale_first, scale_range, padding_0,
        padding_1,
    }
}

impl PaintedAverages {
    /// Of so many layers, factors of widths and factors of shifts.
    pub fn new([layers, widths, shifts]: [usize; 3]) -> PaintedAverages {
        let top = SIGMA_A_MAX / (LAYER_MIDDLE + SIGMA_A_MAX);
        let scale_first = painted_place(SCALE_MIN);
        PaintedAverages {
            last_layer: (layers - 1) as f32,
            layer_scale: (layers - 1) as f32 / top.sqrt(),
            last_width: (widths - 1) as f32,
            last_shift: (shifts - 1) as f32,
            scale_first,
            scale_range: 1.0 - 2.0 * scale_first,
            padding_0: 0,
            padding_1: 0,
        }
    }
}

/// Largest sigma_a with a layer of its own, and the least factor; the largest is its inverse.
const SIGMA_A_MAX: f32 = 50.0;
const SCALE_MIN: f32 = 0.05;

/// Inclinations less one, the index of the last.
const LAST_INCLINATION: f32 = 127.0;
/// Where the columns over the sine begin, and the index of the last of those.
const FIRST_SINE: usize = 128;
const LAST_SINE: f32 = 63.0;
/// Columns.
pub const N_AVERAGE_COLUMNS: usize = N_INCLINATIONS + N_FORWARD;

const _: () = assert!(N_INCLINATIONS == FIRST_SINE && N_FORWARD == 64);

/// A view of the texels.
#[derive(Clone, Copy, Debug)]
pub struct PaintedAveragesView<'a> {
    /// `[shift][width][layer][column]`.
    pub texels: &'a [[f32; 4]],
    /// Their placement.
    pub decode: &'a PaintedAverages,
}

/// Where a point stands among the rows; the same for all lights and nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AverageRow {
    /// Row of the first of two layers of each channel.
    pub rows: [u32; 3],
    /// Weight of the second, 0..=1.
    pub fractions: [f32; 3],
    /// Weight of the next factor of widths.
    pub width_fraction: f32,
    /// Weight of the next factor of shifts.
    pub shift_fraction: f32,
    /// Rows to the next factor of widths; 0 where they are not painted.
    pub width_step: u32,
    /// Rows to the next factor of shifts, likewise.
    pub shift_step: u32,
    /// Square of the factor of widths.
    pub width_scale_2: f32,
    /// Factor of shifts.
    pub shift_scale: f32,
}

/// The averages of one painted point.
#[derive(Clone, Copy, Debug)]
pub struct PaintedPointAverages<'a> {
    /// Those of all.
    pub view: PaintedAveragesView<'a>,
    /// Where the point stands.
    pub row: AverageRow,
}

impl SampleAverages for PaintedPointAverages<'_> {
    fn averages_at(&self, theta: f32) -> LocalAverages {
        sample_averages(&self.view, &self.row, theta)
    }
}

/// Where a factor stands, 0..1.
pub fn painted_place(scale: f32) -> f32 {
    scale / (1.0 + scale)
}

/// The rows of a point of this absorption >= 0 and these factors.
pub fn average_row(
    decode: &PaintedAverages,
    sigma_a: [f32; 3],
    width_scale: f32,
    shift_scale: f32,
) -> AverageRow {
    let at = sigma_a.map(|s| {
        (decode.layer_scale * (s / (LAYER_MIDDLE + s)).sqrt()).clamp(0.0, decode.last_layer)
    });
    let first = at.map(|at| at.floor().min(decode.last_layer - 1.0));
    let place = |scale: f32, last: f32| {
        let share = (painted_place(scale) - decode.scale_first) / decode.scale_range;
        (share * last).clamp(0.0, last)
    };
    let width_at = place(width_scale, decode.last_width);
    let shift_at = place(shift_scale, decode.last_shift);
    let width_first = width_at.floor().min(decode.last_width - 1.0).max(0.0);
    let shift_first = shift_at.floor().min(decode.last_shift - 1.0).max(0.0);
    let layers = decode.last_layer as u32 + 1;
    let widths = decode.last_width as u32 + 1;
    let base = layers * (width_first as u32 + widths * shift_first as u32);
    AverageRow {
        rows: first.map(|first| base + first as u32),
        fractions: [0, 1, 2].map(|c| at[c] - first[c]),
        width_fraction: width_at - width_first,
        shift_fraction: shift_at - shift_first,
        width_step: if decode.last_width > 0.0 { layers } else { 0 },
        shift_step: if decode.last_shift > 0.0 {
            layers * widths
        } else {
            0
        },
        width_scale_2: width_scale * width_scale,
        shift_scale,
    }
}

fn mix_texels(a: [f32; 4], b: [f32; 4], t: f32) -> [f32; 4] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// Between a column and its right neighbour.
fn mix_columns(texels: &[[f32; 4]], column: usize, fraction: f32, row: u32) -> [f32; 4] {
    let at = row as usize * N_AVERAGE_COLUMNS + column;
    mix_texels(texels[at], texels[at + 1], fraction)
}

/// Between a layer and the next, too.
fn mix_layers(texels: &[[f32; 4]], column: usize, fraction: f32, row: u32, layer: f32) -> [f32; 4] {
    let near = mix_columns(texels, column, fraction, row);
    let far = mix_columns(texels, column, fraction, row + 1);
    mix_texels(near, far, layer)
}

/// Between a factor of widths and the next, too, where they are painted.
fn mix_widths(
    texels: &[[f32; 4]],
    column: usize,
    fraction: f32,
    row: u32,
    layer: f32,
    at: &AverageRow,
) -> [f32; 4] {
    let near = mix_layers(texels, column, fraction, row, layer);
    if at.width_step == 0 {
        return near;
    }
    let far = mix_layers(texels, column, fraction, row + at.width_step, layer);
    mix_texels(near, far, at.width_fraction)
}

/// Between a factor of shifts and the next, too, where they are painted.
fn mix_slices(
    texels: &[[f32; 4]],
    column: usize,
    fraction: f32,
    row: u32,
    layer: f32,
    at: &AverageRow,
) -> [f32; 4] {
    let near = mix_widths(texels, column, fraction, row, layer, at);
    if at.shift_step == 0 {
        return near;
    }
    let far = mix_widths(texels, column, fraction, row + at.shift_step, layer, at);
    mix_texels(near, far, at.shift_fraction)
}

/// The averages that local scattering needs at incident inclination `theta`; beyond the ends the
/// ends.
pub fn sample_averages(view: &PaintedAveragesView, row: &AverageRow, theta: f32) -> LocalAverages {
    let at = ((theta + FRAC_PI_2) * (FRAC_1_PI * LAST_INCLINATION)).clamp(0.0, LAST_INCLINATION);
    let first = at.floor().min(LAST_INCLINATION - 1.0);
    let (column, fraction) = (first as usize, at - first);
    let [r, g, b] = [0, 1, 2].map(|c| {
        let (at, layer) = (row.rows[c], row.fractions[c]);
        mix_slices(view.texels, column, fraction, at, layer, row)
    });
    LocalAverages {
        attenuation_b: [r[0], g[0], b[0]],
        shift_b: [r[1], g[1], b[1]].map(|x| row.shift_scale * x),
        width_b_2: [r[2], g[2], b[2]].map(|x| row.width_scale_2 * x),
        // Painted hair is not of model `energy`.
        energy: 0.0,
    }
}

/// a_f and beta_f^2 at the sine of the inclination, 0..=1.
pub fn sample_painted_forward(
    view: &PaintedAveragesView,
    row: &AverageRow,
    sin_theta: f32,
) -> ([f32; 3], [f32; 3]) {
    let at = sin_theta.clamp(0.0, 1.0) * LAST_SINE;
    let first = at.floor().min(LAST_SINE - 1.0);
    let (column, fraction) = (FIRST_SINE + first as usize, at - first);
    let [r, g, b] = [0, 1, 2].map(|c| {
        let (at, layer) = (row.rows[c], row.fractions[c]);
        mix_slices(view.texels, column, fraction, at, layer, row)
    });
    (
        [r[0], g[0], b[0]],
        [r[1], g[1], b[1]].map(|x| row.width_scale_2 * x),
    )
}

/// The layers of hair that is painted as a point is.
pub fn painted_layers(averages: &PaintedPointAverages) -> HairLayers {
    let (a_f, _) = sample_painted_forward(&averages.view, &averages.row, LAYERS_SINE);
    let [up, down] =
        [LAYERS_THETA, -LAYERS_THETA].map(|theta| averages.averages_at(theta).attenuation_b);
    layers_of(a_f, mean_of_signs(up, down))
}
