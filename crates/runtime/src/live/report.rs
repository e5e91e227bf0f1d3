//! What [`Live`](super::Live) did.

use crate::edit::EditReport;
use crate::gpu::Counts;
use crate::stats::Stats;

/// One kind of work since the last edit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StageReport {
    /// Its name: `voxelise`, `shadow maps`, `transmittance`, `shade`, `project`, `draw`, `display`.
    pub name: &'static str,
    /// How often it ran: maps, directions of light, slices of points, passes.
    pub runs: u32,
    /// Wall-clock milliseconds until its results were there; 0 where nobody waited for them.
    pub milliseconds: f64,
    /// Milliseconds by the device's time stamps, where it has them.
    pub gpu_milliseconds: Option<f64>,
}

/// What the device did since the last edit, and what the scene is.
#[derive(Clone, Debug, Default)]
pub struct LiveReport {
    /// Work by kind, in the order it first ran; what is not there was not needed.
    pub stages: Vec<StageReport>,
    /// Counts of the scene, and of the products of points and lights.
    pub stats: Stats,
    /// Which textures the last edit of the hair made anew.
    pub edit: Option<EditReport>,
    /// What was made on the device since the last edit.
    pub counts: Counts,
    /// Bytes on the device.
    pub device_bytes: u64,
}
