//! Lobes of a fibre whose absorption is painted: over theta_d and sigma_a.
//!
//! Shapes do not depend on absorption, so they stay one row over theta_d; amplitudes of one channel
//! are a plane over (sigma_a, theta_d), which each channel reads at its own absorption.

use super::slice::{
    EnergyRule, FLOAT16_HIGHEST, FLOAT16_LOWEST, LobePlaces, LobeRows, N_SHAPE_NUMBERS,
    PackedShapes, cos_theta_d_at, decode_shape, float16, from_float16, move_lost, texel_at,
};
use super::table::LobeTable;
use crate::closed_form::{LAYER_MIDDLE, PaintedDecode, PaintedView};
use crate::hair::Lobe;

/// Texels over cos(theta_d), and layers over absorption.
pub const DEFAULT_PAINTED_TEXELS: [usize; 2] = [192, 64];
/// Largest sigma_a with a layer of its own, the largest of a hair.
const SIGMA_A_MAX: f64 = 50.0;

/// The lobes of TT or TRT of a painted fibre, see [`PaintedDecode`] for the layout.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintedTexture {
    /// How texels are placed and decoded; a uniform of the shaders.
    pub decode: PaintedDecode,
    /// Shapes, eight numbers of 16 bits a texel, low half first, the last unused: `rgba32uint`.
    pub shapes: Vec<[u32; 4]>,
    /// Amplitudes, `[layer][texel]`, four 16 bit floats, the last unused: `rg32uint`.
    pub amplitudes: Vec<[u32; 2]>,
    /// The shapes, decoded.
    pub decoded_shapes: Vec<[f32; N_SHAPE_NUMBERS]>,
    /// The amplitudes, decoded.
    pub decoded_amplitudes: Vec<[f32; 3]>,
}

impl PaintedTexture {
    /// The texture of the shaders, `rgba32uint`, `shapes.len()` texels wide: the shapes, then
    /// amplitudes, a row a layer but the last, each with those of the next layer.
    pub fn texels(&self) -> Vec<[u32; 4]> {
        let layers = self.amplitudes.chunks_exact(self.shapes.len());
        let mut texels = self.shapes.clone();
        for (near, far) in layers.clone().zip(layers.skip(1)) {
            let pairs = near.iter().zip(far);
            texels.extend(pairs.map(|(&[a, b], &[c, d])| [a, b, c, d]));
        }
        texels
    }

    /// The lobes times `intensity`, as [`super::LobeTexture::scaled`].
    pub fn scaled(mut self, intensity: f64) -> PaintedTexture {
        let factor = intensity as f32;
        self.decode.amplitude_scale *= factor;
        for number in self.decoded_amplitudes.as_flattened_mut() {
            *number *= factor;
        }
        self
    }

    /// The texture as the closed form samples it.
    pub fn view(&self) -> PaintedView<'_> {
        PaintedView {
            shapes: &self.decoded_shapes,
            amplitudes: &self.decoded_amplitudes,
            decode: &self.decode,
        }
    }
}

/// The lobes of the table's mode for index `eta` >= 1, any absorption; `caustic_width` (w_c) widens
/// those of TRT; `[texels, layers]`, at least 2 each. Depends on neither sigma_a nor paint.
pub fn slice_painted(
    table: &LobeTable,
    eta: f64,
    caustic_width: f64,
    [n, n_layers]: [usize; 2],
) -> PaintedTexture {
    let (eta, n, n_layers) = (eta.max(1.0), n.max(2), n_layers.max(2));
    let rows = LobeRows::new(table, &LobePlaces::circular(table.lobe, eta, n));
    let shapes = PackedShapes::new(&rows, caustic_width);
    let warp = f64::from(shapes.decode.warp);
    let trt = rows.lobe == Lobe::Trt;
    let crossings = if trt { 2.0 } else { 1.0 };
    // The shortest crossing of all theta_d and h, so that what is left falls with sigma_a.
    let decay = 2.0 * crossings * (1.0 - 1.0 / (eta * eta)).sqrt();
    let middle = f64::from(LAYER_MIDDLE);
    let top = SIGMA_A_MAX / (middle + SIGMA_A_MAX);
    let layers: Vec<f64> = (0..n_layers)
        .map(|layer| {
            let t = top * layer as f64 / (n_layers - 1) as f64;
            middle * t / (1.0 - t)
        })
        .collect();
    let rule = EnergyRule::new(eta, table.fresnel);
    let mut amplitudes = vec![[0.0; 3]; n_layers * n];
    let mut highest = 1e-30f64;
    for (ix, (section, stencil, path)) in rows.each().enumerate() {
        let mut energies = vec![0.0; n_layers];
        let c = cos_theta_d_at(warp, ix, n);
        rule.add(c, texel_at(ix, n), |kept, reflected, crossing| {
            let (kept, exponent) = if trt {
                (reflected, 2.0 * crossing + decay)
            } else {
                (kept, crossing + decay)
            };
            for (energy, sigma) in energies.iter_mut().zip(&layers) {
                *energy += kept * (exponent * sigma).exp();
            }
        });
        for (layer, (energy, sigma)) in energies.iter().zip(&layers).enumerate() {
            let shares = section.shares(stencil, sigma * path);
            let amplitude: [f64; 3] =
                std::array::from_fn(|l| energy * shares[l] * shapes.heights[ix][l]);
            highest = amplitude.into_iter().fold(highest, f64::max);
            amplitudes[layer * n + ix] = amplitude;
        }
    }
    let scale = highest / FLOAT16_HIGHEST;
    let decode = PaintedDecode {
        warp: shapes.decode.warp,
        last: shapes.decode.last,
        lambda_scale: shapes.decode.lambda_scale,
        amplitude_scale: scale as f32,
        last_layer: (n_layers - 1) as f32,
        layer_scale: ((n_layers - 1) as f64 / top) as f32,
        decay: decay as f32,
        padding: 0,
    };
    let lowest = scale * f64::from(FLOAT16_LOWEST);
    let (words, decoded_amplitudes) = amplitudes
        .iter_mut()
        .enumerate()
        .map(|(ix, amplitude)| {
            move_lost(amplitude, &shapes.heights[ix % n], lowest);
            let bits = amplitude.map(|a| float16((a / scale) as f32));
            let [a, b, c] = bits.map(u32::from);
            let decoded = bits.map(|bits| decode.amplitude_scale * from_float16(bits));
            ([a | b << 16, c], decoded)
        })
        .unzip();
    PaintedTexture {
        decode,
        shapes: shapes
            .packed
            .iter()
            .map(|packed| {
                let number = |ix: usize| packed.get(ix).map_or(0, |&x| u32::from(x));
                std::array::from_fn(|word| number(2 * word) | number(2 * word + 1) << 16)
            })
            .collect(),
        amplitudes: words,
        decoded_shapes: shapes
            .packed
            .iter()
            .map(|packed| decode_shape(packed, &shapes.decode))
            .collect(),
        decoded_amplitudes,
    }
}
