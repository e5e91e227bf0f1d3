//! How large pictures and scenes may be, whatever draws them.

use crate::error::RenderError;

/// Most pixels of a picture: at 16 bytes each, 2 GiB in memory. Files and 8-bit pictures made of it
/// take about as much again.
pub const MAX_PIXELS: u32 = 128 << 20;

/// Longest side of a picture.
pub const MAX_SIDE: u32 = 16_384;

/// Most pixels that are drawn at once: 16 bytes each fill the 128 MiB that every adapter binds.
/// Windows are no larger; larger pictures are drawn in tiles.
pub const MAX_TARGET_PIXELS: u32 = 8 << 20;

/// Longest side of what is drawn at once, as every adapter renders it.
pub const MAX_TARGET_SIDE: u32 = 8192;

/// Most samples a pixel.
pub const MAX_SAMPLES: u32 = 65_536;

/// Lights whose records share a buffer: at the largest grid the 128 MiB that every adapter binds.
pub const LIGHT_BATCH: usize = 64;

/// Refuses pictures that cannot be made.
///
/// # Errors
/// A side of zero or beyond [`MAX_SIDE`], more than [`MAX_PIXELS`], or samples that are not in
/// 1..=[`MAX_SAMPLES`].
pub fn check_frame(size: [u32; 2], samples: u32) -> Result<(), RenderError> {
    let [width, height] = size;
    let sides = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if !sides || width * height > MAX_PIXELS {
        return Err(RenderError::Size { width, height });
    }
    if !(1..=MAX_SAMPLES).contains(&samples) {
        return Err(RenderError::Samples { samples });
    }
    Ok(())
}

/// Refuses pictures that are not drawn at once: those of windows, and of ground truth.
///
/// # Errors
/// A side of zero or beyond [`MAX_TARGET_SIDE`], or more than [`MAX_TARGET_PIXELS`].
pub fn check_target([width, height]: [u32; 2]) -> Result<(), RenderError> {
    let sides = 1..=MAX_TARGET_SIDE;
    let is_long = !sides.contains(&width) || !sides.contains(&height);
    if is_long || width * height > MAX_TARGET_PIXELS {
        return Err(RenderError::TargetSize { width, height });
    }
    Ok(())
}
