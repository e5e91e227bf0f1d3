//! ACES 2 as a LUT, which pictures are shown by on the CPU and the GPU alike.

use std::sync::{Arc, OnceLock};

use strandlight_formats::{Cube, CubeTable, LutInput};

use super::bisection::bisected;
use super::transform::{OutputTransform, tone_scale, transform};
use crate::lut::{Lut, radiance};
use crate::tone::srgb::srgb_from_linear;

/// Samples along an edge of the grid. Largest difference of a channel from [`aces2`](super::aces2), in
/// levels of 255, in the mean, of 99 of 100 colours and at most, of 400 000: 0.37, 2.4 and 12.5 for any
/// colours within ten stops of middle grey, 0.12, 0.81 and 1.5 for colours of hair, 0.14, 0.39 and 0.52 for
/// those below 0.02. With 33 samples 99 of 100 colours of hair are within 0.94, with 49 within 0.53, in
/// 2.3 times the time: 37 take some 30 ms.
const GRID_SIZE: u32 = 37;

/// Samples of the curve before it: so many that it is straight between them to 1e-5.
const CURVE_SIZE: u32 = 1024;

/// How much samples crowd where the tone scale is steep, 0 for none. Less makes deep shadows of saturated
/// colours better, more the mid-tones.
const CROWDING: f32 = 0.4;

/// ACES 2 as a LUT: a grid behind a curve that gives mid-tones more of its samples than log2 does.
/// Made once.
pub fn lut() -> &'static Lut {
    static LUT: OnceLock<Lut> = OnceLock::new();
    LUT.get_or_init(|| Lut {
        cube: Arc::new(cube(transform())),
        input: LutInput::Log2,
    })
}

fn cube(transform: &OutputTransform) -> Cube {
    let edge = |ix: u32, size: u32| ix as f32 / (size - 1) as f32;
    let (low, high) = (place(0.0), place(1.0));
    let along_edge: Vec<f32> = (0..GRID_SIZE)
        .map(|ix| {
            let at = low + (high - low) * edge(ix, GRID_SIZE);
            let encoded = bisected(0.0, 1.0, 1e-7, |encoded| place(encoded as f32) > at);
            // The first is black, which has no logarithm.
            if ix == 0 {
                0.0
            } else {
                radiance(encoded as f32)
            }
        })
        .collect();
    let samples = (0..GRID_SIZE.pow(3)).map(|ix| {
        let rgb = [ix, ix / GRID_SIZE, ix / GRID_SIZE / GRID_SIZE];
        let rgb = rgb.map(|ix| along_edge[(ix % GRID_SIZE) as usize]);
        // Beyond 0..=1 too: the picture is clipped after interpolation, so its edges are sharp.
        transform.shown(rgb).map(srgb_from_linear)
    });
    Cube {
        title: Some("ACES 2".to_owned()),
        curves: Some(CubeTable {
            size: CURVE_SIZE,
            low: [0.0; 3],
            high: [1.0; 3],
            samples: (0..CURVE_SIZE)
                .map(|ix| [place(edge(ix, CURVE_SIZE)); 3])
                .collect(),
        }),
        grid: Some(CubeTable {
            size: GRID_SIZE,
            low: [low; 3],
            high: [high; 3],
            samples: samples.collect(),
        }),
    }
}

/// Where in the grid radiance is that is encoded as [`LutInput::Log2`] says.
fn place(encoded: f32) -> f32 {
    let shown = tone_scale(f64::from(radiance(encoded))) as f32;
    (1.0 - CROWDING) * encoded + CROWDING * srgb_from_linear(shown)
}
