//! Why a photo cannot be shown.

use strandlight_formats::Error;
use zune_jpeg::errors::DecodeErrors;

/// Most pixels of a file: 64 Mi.
pub const MAX_PIXELS: u64 = 64 << 20;

/// A photo that cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum PhotoError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] Error),
    /// It is neither PNG nor JPEG, or a damaged PNG.
    #[error("{name}: {source}")]
    Png {
        /// Name of the file.
        name: String,
        /// What is wrong.
        source: png::DecodingError,
    },
    /// It is a damaged JPEG, or one of a kind that is not read.
    #[error("{name}: {}", fault(source))]
    Jpeg {
        /// Name of the file.
        name: String,
        /// What is wrong.
        source: DecodeErrors,
    },
    /// Its colours are those of inks.
    #[error("{name} has CMYK colours: save it as RGB, or as PNG")]
    Colors {
        /// Name of the file.
        name: String,
    },
    /// It has more pixels than are decoded.
    #[error("{name} has {pixels} pixels, more than {MAX_PIXELS}")]
    TooLarge {
        /// Name of the file.
        name: String,
        /// Width times height.
        pixels: u64,
    },
}

/// What is wrong with a file, in one line.
fn fault(error: &DecodeErrors) -> String {
    match error {
        DecodeErrors::IoErrors(_) | DecodeErrors::ExhaustedData => {
            "the file is cut short".to_owned()
        }
        other => other
            .to_string()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" "),
    }
}
