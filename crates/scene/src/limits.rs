//! The largest pictures and scenes.

pub use strandlight_formats::{MAX_SAMPLES, MAX_SIDE};

/// Most pixels of a picture: at 16 bytes each, 2 GiB in memory. Files and 8-bit pictures made of it
/// take about as much again.
pub const MAX_PIXELS: u32 = 128 << 20;

/// Most pixels that are drawn at once: 16 bytes each fill the 128 MiB that every adapter binds.
/// Windows are no larger; larger pictures are drawn in tiles.
pub const MAX_TARGET_PIXELS: u32 = 8 << 20;

/// Longest side of what is drawn at once, as every adapter renders it.
pub const MAX_TARGET_SIDE: u32 = 8192;

/// Latest animation time, seconds: single precision still tells frames apart in hours, and days are
/// a typing error.
pub const MAX_SECONDS: f64 = 1e6;

/// Lights whose records share a buffer: at the largest grid the 128 MiB that every adapter binds.
pub const LIGHT_BATCH: usize = 64;

/// Most points of a prepared groom: three buffers of 16 bytes a point stay below the 128 MiB that
/// every adapter binds.
pub const MAX_POINTS: usize = 8 << 20;

/// Longest `.groom` file: all points that can be drawn with some 60 floats each.
pub const MAX_GROOM_BYTES: u64 = 2 << 30;
