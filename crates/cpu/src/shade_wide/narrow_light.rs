//! Narrow lights, whose shadows are found along segments.

use strandlight_scene::scene::LightRecord;

use super::super::along_segments::{Nodes, PLACES};
use super::super::frame::kept::{N_NODES, narrow_columns};

/// A narrow light.
pub(super) struct Narrow {
    /// Its place among the lights that are not black.
    pub light: usize,
    pub record: LightRecord,
    /// Its first column in what is kept.
    pub column: usize,
}

impl Narrow {
    /// Those of the lights that are `lit`, with their columns among `lights`, indices into `all`.
    pub fn of(lit: &[(usize, &LightRecord)], lights: &[u32], all: &[LightRecord]) -> Vec<Narrow> {
        let columns = narrow_columns(lights, all);
        (0..)
            .zip(lit)
            .filter(|(_, (_, light))| light.is_narrow())
            .map(|(light, (column, record))| {
                let rank = columns.partition_point(|of| of < column);
                Narrow {
                    light,
                    record: **record,
                    column: lights.len() + N_NODES * rank,
                }
            })
            .collect()
    }
}

/// Of a narrow light: the shares that reach the places about a point, if any is lit, and what single
/// scattering comes to at the nodes, unblocked, for an amplitude of 1.
#[derive(Clone, Copy, Default)]
pub(super) struct AlongOf {
    pub shares: Option<[f32; PLACES]>,
    pub nodes: Nodes<[f32; 3]>,
    /// The side of what is scattered at the point itself, see [`Radiance::at`](crate::radiance::Radiance::at).
    pub side: f32,
}
