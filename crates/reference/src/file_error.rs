//! What can be wrong with files of reference pictures.

use strandlight_images::DecoderPanic;

/// Why a file cannot be gone on with, or merged with others.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// Not an OpenEXR file that can be read.
    #[error("not a readable OpenEXR file: {0}")]
    OpenExr(#[source] exr::error::Error),
    /// The decoder panicked.
    #[error("not a readable OpenEXR file: {0}")]
    Decoder(#[from] DecoderPanic),
    /// Its content is not what was written.
    #[error("damaged: its checksum is not that of its content")]
    Checksum,
    /// Sums of samples that are NaN or infinite.
    #[error("not a readable OpenEXR file: values that are not finite")]
    NotFinite,
    /// Another kind of picture.
    #[error("not a reference picture of this program: no {0}")]
    Missing(String),
    /// A picture of something else.
    #[error("a picture of other inputs: its {what} {found}, not {expected}")]
    Other {
        /// What differs.
        what: &'static str,
        /// What the file has.
        found: String,
        /// What was asked for.
        expected: String,
    },
    /// A picture of something else, and it does not tell of what.
    #[error("a picture of other inputs: its scene or options differ")]
    OtherInputs,
    /// A whole picture where a part is asked for, or a part that does not fit its own description.
    #[error("not a part of a reference picture: {0}")]
    NotAPart(&'static str),
    /// A part where a whole picture is asked for.
    #[error("a part of a picture, {0}: its parts are joined by reference merge")]
    IsAPart(String),
    /// It cannot be written.
    #[error("cannot be encoded: {0}")]
    Encoder(#[source] exr::error::Error),
}
