//! Ways to find what hair leaves of a light, behind one interface, to be measured side by side.
//!
//! [`Method::Sweep`] is what the renderer does. The others are baselines on the CPU; they answer
//! at the points where the renderer looks its records up.

use rayon::prelude::*;
use strandlight_runtime::PreparedScene;
use strandlight_runtime::scene::LightRecord;
use strandlight_runtime::volume::Grid;
use strandlight_scattering::closed_form::{PackedRecord, pack_record};

use crate::cpu;

/// How the transmittance of lights is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// Shares swept through a voxel volume, as on the GPU.
    #[default]
    Sweep,
}

impl Method {
    /// Name on command lines and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Method::Sweep => "sweep",
        }
    }
}

/// Packed records of `lights` at every point of `scene`, `[light][point]`, by `method`.
///
/// `lights` are some of [`PreparedScene::light_records`]' answer.
///
/// # Errors
/// A scene that the method cannot take, in words.
pub fn point_shadows(
    method: Method,
    scene: &PreparedScene,
    lights: &[LightRecord],
) -> Result<Vec<PackedRecord>, String> {
    match method {
        Method::Sweep => Ok(swept(scene, lights)),
    }
}

/// The volume's records where the renderer interpolates them.
fn swept(scene: &PreparedScene, lights: &[LightRecord]) -> Vec<PackedRecord> {
    let grid = Grid::around(&scene.strands);
    let volume = cpu::voxelise(&scene.strands, &grid);
    let (_, sweeps) = scene.light_records();
    let records = cpu::transmittance(&grid, &volume, lights, &sweeps);
    let n_points = scene.strands.points.len();
    let mut result = vec![[0; 2]; n_points * lights.len()];
    result
        .par_chunks_mut(n_points)
        .zip(records.par_chunks(grid.n_voxels()))
        .for_each(|(out, records)| {
            for (out, point) in out.iter_mut().zip(&scene.strands.points) {
                *out = pack_record(&cpu::record_at_point(&grid, records, point));
            }
        });
    result
}
