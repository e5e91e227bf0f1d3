//! How large pictures and scenes may be, whatever draws them.

pub use crate::limits::{
    LIGHT_BATCH, MAX_PIXELS, MAX_SAMPLES, MAX_SECONDS, MAX_SIDE, MAX_TARGET_PIXELS, MAX_TARGET_SIDE,
};

/// A size or a number of samples that no picture has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A side is zero or too long, or there are too many pixels.
    #[error(
        "size {width}x{height}: each side must be 1..={MAX_SIDE} and the picture at most \
         {MAX_PIXELS} pixels"
    )]
    Size {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// Samples a pixel out of range.
    #[error("{samples} samples: must be in 1..={MAX_SAMPLES}")]
    Samples {
        /// Samples asked for.
        samples: u32,
    },
    /// A picture that is drawn at once, as those of windows and ground truth are, is too large for
    /// that.
    #[error(
        "size {width}x{height}: each side must be 1..={MAX_TARGET_SIDE} and the picture at most \
         {MAX_TARGET_PIXELS} pixels here; rendered pictures may be larger"
    )]
    TargetSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
}

/// Refuses pictures that cannot be made.
///
/// # Errors
/// A side of zero or beyond [`MAX_SIDE`], more than [`MAX_PIXELS`], or samples that are not in
/// 1..=[`MAX_SAMPLES`].
pub fn check_frame(size: [u32; 2], samples: u32) -> Result<(), FrameError> {
    let [width, height] = size;
    let sides = (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height);
    if !sides || width * height > MAX_PIXELS {
        return Err(FrameError::Size { width, height });
    }
    if !(1..=MAX_SAMPLES).contains(&samples) {
        return Err(FrameError::Samples { samples });
    }
    Ok(())
}

/// Refuses pictures that are not drawn at once: those of windows, and of ground truth.
///
/// # Errors
/// A side of zero or beyond [`MAX_TARGET_SIDE`], or more than [`MAX_TARGET_PIXELS`].
pub fn check_target([width, height]: [u32; 2]) -> Result<(), FrameError> {
    let sides = 1..=MAX_TARGET_SIDE;
    let is_long = !sides.contains(&width) || !sides.contains(&height);
    if is_long || width * height > MAX_TARGET_PIXELS {
        return Err(FrameError::TargetSize { width, height });
    }
    Ok(())
}
