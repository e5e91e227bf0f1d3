//! What can go wrong between a scene file and a picture.

/// A scene that cannot be prepared for rendering.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file of the scene, or a value in it, cannot be used; the text names it.
    #[error("{0}")]
    File(String),
    /// Nothing to draw.
    #[error("the groom has no strand with two different points")]
    EmptyGroom,
    /// Strand offsets are not a partition of the points.
    #[error("the groom's strand offsets do not fit its points")]
    Offsets,
    /// A coordinate is NaN, infinite or beyond 1e7 cm.
    #[error("point {point} of the groom is not within 1e7 cm of the origin")]
    Point {
        /// Index of the point.
        point: usize,
    },
    /// A fibre diameter is not a positive number.
    #[error("the fibre diameter of strand {strand} is {value} cm; it must be positive")]
    Diameter {
        /// Index of the strand.
        strand: usize,
        /// The offending value.
        value: f32,
    },
    /// More points than the buffers hold.
    #[error(
        "the groom has {points} points or more; at most {} can be drawn",
        crate::limits::MAX_POINTS
    )]
    TooManyPoints {
        /// Points counted until then.
        points: usize,
    },
}

impl SceneError {
    /// The same error, about a file or a value of the scene file at `path`.
    #[must_use]
    pub fn in_scene(self, path: &std::path::Path) -> SceneError {
        SceneError::File(format!("{}: {self}", path.display()))
    }
}

/// A picture that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A side is zero or too long, or there are too many pixels.
    #[error(
        "size {width}x{height}: each side must be 1..={} and the picture at most {} pixels",
        crate::limits::MAX_SIDE,
        crate::limits::MAX_PIXELS
    )]
    Size {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// Samples a pixel out of range.
    #[error("{samples} samples: must be in 1..={}", crate::limits::MAX_SAMPLES)]
    Samples {
        /// Samples asked for.
        samples: u32,
    },
    /// A picture that is drawn at once, as those of windows and ground truth are, is too large for
    /// that.
    #[error(
        "size {width}x{height}: each side must be 1..={} and the picture at most {} pixels here; \
         rendered pictures may be larger",
        crate::limits::MAX_TARGET_SIDE,
        crate::limits::MAX_TARGET_PIXELS
    )]
    TargetSize {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// Not one colour for each light.
    #[error("{colors} colours for {lights} lights")]
    Colors {
        /// Colours given.
        colors: usize,
        /// Lights there are.
        lights: usize,
    },
    /// Lights or points that a renderer was given cannot be drawn.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The adapter or its driver failed.
    #[error("GPU: {0}")]
    Gpu(String),
    /// The device is gone, and all that was on it. Another may be opened and the scene put there.
    #[error("GPU: the device was lost: {0}")]
    DeviceLost(String),
    /// The scene does not fit the device.
    #[error("{what}: {bytes} bytes are needed, and {limit} are allowed")]
    TooLarge {
        /// What is too large.
        what: String,
        /// Bytes needed.
        bytes: u64,
        /// Bytes there may be.
        limit: u64,
    },
    /// The PNG encoder failed.
    #[error("PNG: {0}")]
    Png(String),
}
