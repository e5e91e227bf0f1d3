//! Why pictures cannot be compared.

use std::path::PathBuf;

use strandlight_images::{DecodeError, DecoderPanic};

/// Why two pictures could not be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// A file that could not be read.
    #[error(transparent)]
    Read(#[from] strandlight_formats::Error),
    /// A file that is no picture.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: LayerError,
    },
    /// Pictures of different sizes.
    #[error("the pictures have {}x{} and {}x{} pixels", a[0], a[1], b[0], b[1])]
    Sizes {
        /// Width and height of the picture.
        a: [usize; 2],
        /// Those of the reference.
        b: [usize; 2],
    },
    /// Pictures of different sizes, whose difference was to be drawn.
    #[error("the pictures have different sizes")]
    DifferenceSizes,
    /// Pictures of different sizes, or whose rows do not fit their width, for FLIP.
    #[error("FLIP needs two pictures of one size")]
    FlipSizes,
    /// One picture shows radiance, the other what a display shows.
    #[error(
        "one picture is linear (OpenEXR), the other tone-mapped (PNG); use two pictures of the \
         same kind"
    )]
    Kinds,
    /// Nothing can be relative to a black reference.
    #[error("the reference is black: relative errors are undefined")]
    BlackReference,
    /// The picture of the difference cannot be encoded.
    #[error(transparent)]
    Png(#[from] png::EncodingError),
}

/// Why bytes are no layer that can be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LayerError {
    /// A file of another format.
    #[error("neither OpenEXR nor PNG")]
    NotThisKind,
    /// What the decoder of OpenEXR refuses.
    #[error(transparent)]
    OpenExr(#[from] DecodeError),
    /// What the decoder of PNG refuses.
    #[error("not a readable PNG: {0}")]
    Png(#[from] png::DecodingError),
    /// A PNG was asked for a layer.
    #[error("a PNG has no layer {0}")]
    PngLayer(String),
    /// The file does not have the layer that was asked for.
    #[error("no layer {layer}; the file has {found}")]
    NoLayer {
        /// The layer asked for.
        layer: String,
        /// Those there are.
        found: String,
    },
    /// A layer of other channels.
    #[error("layer {layer} has no colour to compare: its channels are {channels}")]
    LayerWithoutColor {
        /// The layer.
        layer: String,
        /// What it has.
        channels: String,
    },
    /// The file has no plain colour.
    #[error("no channels R, G, B; the file has {found}")]
    NoColor {
        /// The layers there are.
        found: String,
    },
    /// More pixels than are compared.
    #[error(
        "{width} x {height} pixels; at most {max_side} a side and {max_pixels} in all are compared"
    )]
    TooLarge {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// The most along a side.
        max_side: usize,
        /// The most in all.
        max_pixels: usize,
    },
    /// A pixel that is NaN or infinite.
    #[error("pixel ({x}, {y}) is not a finite number")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row, 0 on top.
        y: usize,
    },
    /// Something of the format that is not read, such as deep data.
    #[error("{0}")]
    Unsupported(String),
    /// Damaged, cut short or contradicting itself.
    #[error("{0}")]
    Damaged(String),
}

impl From<exr::error::Error> for LayerError {
    fn from(error: exr::error::Error) -> Self {
        LayerError::OpenExr(error.into())
    }
}

impl From<DecoderPanic> for LayerError {
    fn from(error: DecoderPanic) -> Self {
        LayerError::OpenExr(error.into())
    }
}
