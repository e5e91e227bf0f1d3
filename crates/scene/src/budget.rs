//! How large pictures and scenes may be, whatever draws them.

use crate::error::RenderError;

pub use crate::limits::{
    LIGHT_BATCH, MAX_PIXELS, MAX_SAMPLES, MAX_SIDE, MAX_TARGET_PIXELS, MAX_TARGET_SIDE,
};

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
