//! What the shading of painted hair reads besides the paint.

use strandlight_scattering::closed_form::{N_AVERAGE_COLUMNS, PaintedAverages};
use strandlight_scattering::dual_scattering::PaintedAverageTable;
use strandlight_scattering::lobes::PaintedTexture;

/// Lobes and averages of painted hair, whatever its colours; those that are not needed are empty and
/// must not be sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct PaintedOptics {
    /// Lobes of TT.
    pub tt: PaintedTexture,
    /// Lobes of TRT.
    pub trt: PaintedTexture,
    /// Averages for multiple scattering.
    pub averages: PaintedAverageTable,
}

impl PaintedOptics {
    /// Bytes of the textures.
    pub fn bytes(&self) -> u64 {
        let lobes = |lobes: &PaintedTexture| {
            let rows = 1 + lobes.decode.last_layer as usize;
            16 * lobes.shapes.len() * rows
        };
        let averages = size_of_val(&self.averages.texels[..]);
        (lobes(&self.tt) + lobes(&self.trt) + averages) as u64
    }
}

impl Default for PaintedOptics {
    fn default() -> Self {
        PaintedOptics {
            tt: no_painted_lobes(),
            trt: no_painted_lobes(),
            averages: no_painted_averages(),
        }
    }
}

/// Stands for the lobes of a mode that is not enabled.
pub(crate) fn no_painted_lobes() -> PaintedTexture {
    PaintedTexture {
        decode: strandlight_scattering::closed_form::PaintedDecode {
            warp: 1.0,
            last: 1.0,
            last_layer: 1.0,
            ..bytemuck::Zeroable::zeroed()
        },
        shapes: vec![[0; 4]; 2],
        amplitudes: vec![[0; 2]; 4],
        decoded_shapes: vec![[0.0; 7]; 2],
        decoded_amplitudes: vec![[0.0; 3]; 4],
    }
}

/// Stands for the averages where multiple scattering is switched off.
pub(crate) fn no_painted_averages() -> PaintedAverageTable {
    PaintedAverageTable {
        decode: PaintedAverages::new([2, 1, 1]),
        texels: vec![[0.0; 4]; 2 * N_AVERAGE_COLUMNS],
    }
}
