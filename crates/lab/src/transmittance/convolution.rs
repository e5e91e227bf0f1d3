//! Ren's convolution optical depth map (Ren et al. 2010), as far as it is known: optical depth in
//! layers across the light's centre, filtered by a kernel that widens with the distance, by
//! summed-area tables.
//!
//! ```text
//! tau(x) = sum_k mean over the box of half width r_k of dtau_k,   T = exp(-tau)
//! r_k    = sqrt(3/2) lambda (z_x - z_k)
//! ```
//!
//! The box has the variance of the light's lobe in the tangent plane. As published, tau is averaged
//! before the exponential, which by Jensen's inequality makes wide lights too dark.

use glam::Vec3;
use strandlight_scattering::closed_form::ShadowRecord;
use strandlight_scene::strands::Strands;

use super::light_map::{LightMap, SIDE, taps};
use super::optical_depth::record_of_depth;

/// Layers through the map's depth, evenly.
const N_LAYERS: usize = 32;
/// Entries along a side of a summed-area table, zeros first.
const ROW: usize = SIDE + 1;

/// The map of one light.
pub struct ConvolutionMap {
    map: LightMap,
    lambda: f32,
    /// `[layer][row][column]`: sums over all texels before, of tau and of tau sin^2.
    sums: Vec<[f64; 2]>,
}

impl ConvolutionMap {
    /// Draws the strands from `direction`, which points to the light of width `lambda`.
    pub fn new(strands: &Strands, direction: [f32; 3], lambda: f32) -> ConvolutionMap {
        let map = LightMap::new(strands, direction);
        let thickness = 2.0 * map.reach / N_LAYERS as f32;
        let mut sums = vec![[0.0; 2]; N_LAYERS * ROW * ROW];
        map.pieces(strands, |piece| {
            let layer = ((piece.depth / thickness) as usize).min(N_LAYERS - 1);
            for (texel, weight) in taps(piece.at) {
                let (column, row) = (texel % SIDE + 1, texel / SIDE + 1);
                let cell = &mut sums[(layer * ROW + row) * ROW + column];
                let tau = f64::from(weight) * piece.tau;
                cell[0] += tau;
                cell[1] += tau * f64::from(piece.sin_2);
            }
        });
        for layer in sums.chunks_exact_mut(ROW * ROW) {
            for row in 1..ROW {
                for column in 1..ROW {
                    let at = row * ROW + column;
                    let [left, above, both] = [1, ROW, ROW + 1].map(|back| layer[at - back]);
                    for (k, sum) in layer[at].iter_mut().enumerate() {
                        *sum += left[k] + above[k] - both[k];
                    }
                }
            }
        }
        ConvolutionMap { map, lambda, sums }
    }

    /// The record at a point.
    pub fn record(&self, [x, y, z, _]: [f32; 4]) -> ShadowRecord {
        let (at, depth) = self.map.place(Vec3::new(x, y, z));
        let thickness = 2.0 * self.map.reach / N_LAYERS as f32;
        let mut sum = [0.0; 2];
        for layer in 0..N_LAYERS {
            let start = layer as f32 * thickness;
            if start >= depth {
                break;
            }
            let end = (start + thickness).min(depth);
            let distance = depth - 0.5 * (start + end);
            // At least the texel itself.
            let half = (1.5_f32.sqrt() * self.lambda * distance / self.map.texel).max(0.5);
            let share = f64::from((end - start) / thickness);
            for (sum, mean) in sum.iter_mut().zip(self.mean(layer, at, half)) {
                *sum += share * mean;
            }
        }
        record_of_depth(sum)
    }

    /// Mean over the box of `half` texels around `at`; outside the map is nothing.
    fn mean(&self, layer: usize, at: [f32; 2], half: f32) -> [f64; 2] {
        // The middle of texel 0 is at 0, its edges are 0 and 1 in the table.
        let [low, high] = [-half, half].map(|half| at.map(|x| x + 0.5 + half));
        let area = f64::from(2.0 * half).powi(2);
        let [a, b, c, d] = [
            self.sum(layer, high),
            self.sum(layer, [low[0], high[1]]),
            self.sum(layer, [high[0], low[1]]),
            self.sum(layer, low),
        ];
        [0, 1].map(|k| ((a[k] - b[k] - c[k] + d[k]) / area).max(0.0))
    }

    /// The summed-area table at a place, bilinear.
    fn sum(&self, layer: usize, at: [f32; 2]) -> [f64; 2] {
        let at = at.map(|x| x.clamp(0.0, SIDE as f32));
        let base = at.map(|x| (x as usize).min(SIDE - 1));
        let f = [0, 1].map(|axis| f64::from(at[axis] - base[axis] as f32));
        let corner = (layer * ROW + base[1]) * ROW + base[0];
        [0, 1].map(|k| {
            let value = |ix: usize| self.sums[ix][k];
            let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
            let near = mix(value(corner), value(corner + 1), f[0]);
            let far = mix(value(corner + ROW), value(corner + ROW + 1), f[0]);
            mix(near, far, f[1])
        })
    }
}
