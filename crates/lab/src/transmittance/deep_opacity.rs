//! Deep opacity maps (Yuksel and Keyser 2008): layers of opacity that begin where the hair does.
//!
//! One direction stands for the light. A texel's layers start at its nearest hair and grow
//! linearly in thickness; optical depth is linear inside a layer and bilinear between texels.

use glam::Vec3;
use strandlight_scattering::closed_form::ShadowRecord;
use strandlight_scene::strands::Strands;

use super::light_map::{LightMap, SIDE, taps};
use super::optical_depth::record_of_depth;

/// Layers; the last one's optical depth covers all behind it.
const N_LAYERS: usize = 16;

/// The map of one light.
pub struct DeepOpacityMap {
    map: LightMap,
    /// Depth of the nearest hair, cm, `[texel]`.
    nearest: Vec<f32>,
    /// Optical depth up to the end of each layer, and its integral of sin^2, `[texel][layer]`.
    depths: Vec<[[f64; 2]; N_LAYERS]>,
}

impl DeepOpacityMap {
    /// Draws the strands from `direction`, which points to the light.
    pub fn new(strands: &Strands, direction: [f32; 3]) -> DeepOpacityMap {
        let map = LightMap::new(strands, direction);
        let mut nearest = vec![f32::INFINITY; SIDE * SIDE];
        map.pieces(strands, |piece| {
            for (texel, _) in taps(piece.at) {
                nearest[texel] = nearest[texel].min(piece.depth);
            }
        });
        let mut depths = vec![[[0.0; 2]; N_LAYERS]; SIDE * SIDE];
        map.pieces(strands, |piece| {
            for (texel, weight) in taps(piece.at) {
                let layer = layer_of(&map, piece.depth - nearest[texel]) as usize;
                let tau = f64::from(weight) * piece.tau;
                let cell = &mut depths[texel][layer.min(N_LAYERS - 1)];
                cell[0] += tau;
                cell[1] += tau * f64::from(piece.sin_2);
            }
        });
        for layers in &mut depths {
            let mut before = [0.0; 2];
            for layer in layers {
                before = [before[0] + layer[0], before[1] + layer[1]];
                *layer = before;
            }
        }
        DeepOpacityMap {
            map,
            nearest,
            depths,
        }
    }

    /// The record at a point.
    pub fn record(&self, [x, y, z, _]: [f32; 4]) -> ShadowRecord {
        let (at, depth) = self.map.place(Vec3::new(x, y, z));
        let mut sum = [0.0; 2];
        for (texel, weight) in taps(at) {
            let behind = depth - self.nearest[texel];
            if behind <= 0.0 || behind.is_nan() {
                continue;
            }
            let layer = layer_of(&self.map, behind);
            let ix = (layer as usize).min(N_LAYERS - 1);
            let inside = f64::from(layer - ix as f32).min(1.0);
            for (k, sum) in sum.iter_mut().enumerate() {
                let before = if ix > 0 {
                    self.depths[texel][ix - 1][k]
                } else {
                    0.0
                };
                let after = self.depths[texel][ix][k];
                *sum += f64::from(weight) * (before + inside * (after - before));
            }
        }
        record_of_depth(sum)
    }
}

/// Layers from the nearest hair to `behind` it, cm: layer k is k + 1 times as thick as the first,
/// and all of them reach through the map.
fn layer_of(map: &LightMap, behind: f32) -> f32 {
    let first = 2.0 * map.reach * 2.0 / (N_LAYERS * (N_LAYERS + 1)) as f32;
    let x = behind.max(0.0) / first;
    let layer = (0.5 * ((1.0 + 8.0 * x).sqrt() - 1.0)).floor();
    let start = 0.5 * layer * (layer + 1.0);
    layer + ((x - start) / (layer + 1.0)).clamp(0.0, 0.999_999)
}
