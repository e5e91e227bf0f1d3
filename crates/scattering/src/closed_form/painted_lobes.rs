//! The lobes of TT and TRT of a fibre whose absorption is painted. Twin:
//! `shaders/lib/painted_lobes.wgsl`.

use super::lobes::{LobeDecode, LobeView, Lobes, N_LOBE_NUMBERS, SampleLobes, lobe_place};

/// Absorption in the middle of the layers, as far as those went to infinity.
pub const LAYER_MIDDLE: f32 = 3.0;

/// How the texels of one mode are placed and decoded, byte for byte the struct `PaintedDecode` of
/// the shaders (32 bytes).
///
/// Along theta_d as [`super::LobeDecode`] says. Shapes: the first seven of its numbers, one texel
/// of four words. Amplitudes: `[layer][texel]`, three 16 bit floats, one for each lobe (in the
/// shaders' texture with those of the next layer), times
/// `amplitude_scale`, to be multiplied by `u^2 exp(-decay sigma_a)`; layer =
/// `layer_scale sigma_a / (3 + sigma_a)`, clamped to `last_layer`, interpolated linearly.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PaintedDecode {
    /// As [`super::LobeDecode::warp`].
    pub warp: f32,
    /// Index of the last texel, at least 1.
    pub last: f32,
    /// Width of a full fraction.
    pub lambda_scale: f32,
    /// Amplitude of 1.
    pub amplitude_scale: f32,
    /// Index of the last layer, at least 1.
    pub last_layer: f32,
    /// See above.
    pub layer_scale: f32,
    /// See above.
    pub decay: f32,
    /// Fills the struct; always 0.
    pub padding: u32,
}

crate::mirrors! {
    PaintedDecode as "PaintedDecode" in "lib/painted_lobes" {
        warp, last, lambda_scale, amplitude_scale, last_layer, layer_scale, decay, padding,
    }
}

/// A view of one mode's texels.
#[derive(Clone, Copy, Debug)]
pub struct PaintedView<'a> {
    /// Decoded shapes, `last + 1` of them.
    pub shapes: &'a [[f32; 7]],
    /// Decoded amplitudes, `[layer][texel]`.
    pub amplitudes: &'a [[f32; 3]],
    /// Their placement.
    pub decode: &'a PaintedDecode,
}

/// Where an absorption stands among the layers; the same for all lights and nodes of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeLayer {
    /// Index of the first of two layers.
    pub first: u32,
    /// Weight of the second, 0..=1.
    pub fraction: f32,
    /// exp(-decay sigma_a).
    pub factor: f32,
}

/// The lobes of one mode of one painted point.
#[derive(Clone, Copy, Debug)]
pub struct PaintedPointLobes<'a> {
    /// Those of all.
    pub view: PaintedView<'a>,
    /// Where the point's channels stand.
    pub layers: [LobeLayer; 3],
}

/// The same as texels of one fibre: what neighbours share, and what is read more often than there are texels, is made once.
#[derive(Clone, Debug)]
pub struct PointLobes {
    texels: Vec<[f32; N_LOBE_NUMBERS]>,
    decode: LobeDecode,
}

impl Default for PointLobes {
    fn default() -> Self {
        PointLobes {
            texels: Vec::new(),
            decode: bytemuck::Zeroable::zeroed(),
        }
    }
}

impl PointLobes {
    /// Those of `point` in the place of what they were.
    pub fn take(&mut self, point: &PaintedPointLobes) {
        let PaintedPointLobes { view, layers } = point;
        let width = view.decode.last as usize + 1;
        self.decode = LobeDecode {
            warp: view.decode.warp,
            last: view.decode.last,
            lambda_scale: 1.0,
            amplitude_scale: 1.0,
            ..bytemuck::Zeroable::zeroed()
        };
        self.texels.clear();
        self.texels.resize(width, [0.0; N_LOBE_NUMBERS]);
        for (texel, shapes) in self.texels.iter_mut().zip(view.shapes) {
            texel[..7].copy_from_slice(shapes);
        }
        for (channel, layer) in layers.iter().enumerate() {
            let near = &view.amplitudes[width * layer.first as usize..][..width];
            let far = &view.amplitudes[width * (layer.first as usize + 1)..][..width];
            let at = 7 + 3 * channel;
            for (texel, (near, far)) in self.texels.iter_mut().zip(near.iter().zip(far)) {
                for l in 0..3 {
                    let between = near[l] + (far[l] - near[l]) * layer.fraction;
                    texel[at + l] = layer.factor * between;
                }
            }
        }
    }

    /// As shading samples them.
    pub fn view(&self) -> LobeView<'_> {
        LobeView {
            texels: &self.texels,
            decode: &self.decode,
        }
    }
}

impl SampleLobes for PaintedPointLobes<'_> {
    fn lobes_at(&self, _eta: f32, cos_theta_d: f32) -> Lobes {
        sample_painted_lobes(&self.view, &self.layers, cos_theta_d)
    }
}

/// The layer of absorption `sigma_a` >= 0.
pub fn lobe_layer(decode: &PaintedDecode, sigma_a: f32) -> LobeLayer {
    let at = (decode.layer_scale * (sigma_a / (LAYER_MIDDLE + sigma_a))).min(decode.last_layer);
    let first = at.floor().min(decode.last_layer - 1.0);
    LobeLayer {
        first: first as u32,
        fraction: at - first,
        factor: (-decode.decay * sigma_a).exp(),
    }
}

/// Amplitudes of the three lobes for the channel of this layer, over u^2.
fn painted_amplitude(
    view: &PaintedView,
    first: usize,
    fraction: f32,
    layer: &LobeLayer,
) -> [f32; 3] {
    let width = view.decode.last as usize + 1;
    let texel = layer.first as usize * width + first;
    std::array::from_fn(|l| {
        let a = view.amplitudes[texel][l];
        let b = view.amplitudes[texel + 1][l];
        let c = view.amplitudes[texel + width][l];
        let d = view.amplitudes[texel + width + 1][l];
        let near = a + (b - a) * fraction;
        let far = c + (d - c) * fraction;
        layer.factor * (near + (far - near) * layer.fraction)
    })
}

/// The lobes at `cos_theta_d` >= 0 of a point whose channels have these `layers`.
pub fn sample_painted_lobes(
    view: &PaintedView,
    layers: &[LobeLayer; 3],
    cos_theta_d: f32,
) -> Lobes {
    let u = lobe_place(view.decode.warp, cos_theta_d);
    let at = u * view.decode.last;
    let first = at.floor().min(view.decode.last - 1.0);
    let fraction = at - first;
    let first = first as usize;
    let low = &view.shapes[first];
    let high = &view.shapes[first + 1];
    let x: [f32; 7] = std::array::from_fn(|i| low[i] + (high[i] - low[i]) * fraction);
    let height = u * u;
    let rgb = [0, 1, 2].map(|c| painted_amplitude(view, first, fraction, &layers[c]));
    Lobes {
        lambda: [x[0], x[1], x[2]],
        cos_half: [x[3], x[5]],
        sin_half: [x[4], x[6]],
        amplitude: std::array::from_fn(|l| std::array::from_fn(|c| height * rgb[c][l])),
    }
}
