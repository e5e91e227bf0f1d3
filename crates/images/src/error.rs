//! Why a map cannot be read.

use std::path::PathBuf;

use crate::source::Window;

/// Why a map could not be read or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// The file could not be opened or read, or is too long.
    #[error(transparent)]
    Read(#[from] strandlight_formats::Error),
    /// The file holds no map that can be used.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: DecodeError,
    },
    /// Pixels in memory are no map that can be used.
    #[error(transparent)]
    Pixels(#[from] DecodeError),
}

/// Why bytes or pixels are no map that can be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// No bytes.
    #[error("the file is empty")]
    Empty,
    /// A file of another format.
    #[error(
        "neither OpenEXR nor Radiance .hdr, by its first bytes{}",
        found.as_ref().map_or(String::new(), |found| format!(": {found}"))
    )]
    NotThisKind {
        /// What it is instead, where that is known.
        found: Option<String>,
    },
    /// Not the image that was asked for, or none with colour: names those that the file has.
    #[error("{0}")]
    NoImage(String),
    /// Something of the format that is not read, such as a cube map.
    #[error("{0}")]
    Unsupported(String),
    /// Damaged, cut short or contradicting itself.
    #[error("{0}")]
    Damaged(String),
    /// A Radiance file that is damaged, or uses what is not read.
    #[error("not a readable Radiance file: {0}")]
    Radiance(String),
    /// What the `exr` crate does not decode.
    #[error("{}", in_our_words(.0))]
    OpenExr(#[from] exr::error::Error),
    /// The decoder panicked.
    #[error(transparent)]
    Decoder(#[from] DecoderPanic),
    /// Too much for the memory that a file of its length is worth.
    #[error("{0}")]
    TooLarge(String),
    /// More pixels than a map may have.
    #[error("{width} x {height} pixels are too many, at most {max_width} x {}", max_width / 2)]
    TooManyPixels {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// The most across: twice the most down.
        max_width: usize,
    },
    /// Not twice as wide as high.
    #[error(
        "{width} x {height} pixels are no latitude-longitude map: it must be twice as wide as \
         high, at least 4 x 2"
    )]
    NotLatLong {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
    },
    /// The display window is no sphere; the data window is another.
    #[error("{source}; this is the display window, the data window is {data}")]
    DisplayWindow {
        /// The data window.
        data: Window,
        /// What is wrong with the display window.
        source: Box<DecodeError>,
    },
    /// Not the number of pixels that the size asks for.
    #[error("a {width} x {height} map needs {} pixels, not {pixels}", width * height)]
    PixelCount {
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Pixels given.
        pixels: usize,
    },
    /// Primaries that do not span a triangle.
    #[error("the colour primaries {0:?} span no colour space")]
    Primaries(
        /// CIE 1931 xy of red, green, blue and white.
        [[f64; 2]; 4],
    ),
    /// Too many pixels that are not finite.
    #[error(
        "the map is damaged: of {pixels} pixels {nan} are NaN and {infinite} infinite; at most \
         {most} are replaced (one in {one_in})"
    )]
    NotFinite {
        /// Pixels of the map.
        pixels: usize,
        /// Those with a NaN sample.
        nan: u64,
        /// Those with an infinite sample.
        infinite: u64,
        /// The most that are replaced.
        most: usize,
        /// The share of pixels that this is.
        one_in: usize,
    },
}

/// A decoder of another crate panicked: the file is damaged in a way it did not expect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the file is damaged: the decoder failed")]
pub struct DecoderPanic;

/// What the `exr` crate says, in our words where its own do not help.
fn in_our_words(error: &exr::error::Error) -> String {
    use exr::error::Error;
    match error {
        Error::NotSupported(what) => format!("OpenEXR with {what}, which is not supported"),
        Error::Io(error) => format!("not a readable OpenEXR file: {error}"),
        Error::Invalid(what) if what.contains("missing bytes") => TRUNCATED.to_owned(),
        error => format!("not a readable OpenEXR file: {error}"),
    }
}

/// Said of a file that ends too early.
pub(crate) const TRUNCATED: &str =
    "not a readable OpenEXR file: it is truncated, or refers to bytes that are not there";

#[cfg(test)]
mod tests {
    use std::error::Error;
    use std::io;
    use std::path::Path;

    use super::*;
    use crate::Map;

    #[test]
    fn a_missing_file_leads_to_what_the_system_answered() {
        let error = Map::read(Path::new("not/there.exr")).expect_err("no such file");
        assert!(matches!(error, MapError::Read(_)), "{error:?}");
        let system = error
            .source()
            .and_then(|cause| cause.downcast_ref::<io::Error>());
        let system = system.expect("the system's answer");
        assert_eq!(system.kind(), io::ErrorKind::NotFound);
        assert_eq!(error.to_string(), format!("not/there.exr: {system}"));
    }

    #[test]
    fn a_decoder_that_gives_up_is_named_as_the_cause() {
        let cut = [&crate::exr_map::MAGIC[..], &[2, 0, 0, 0]].concat();
        let error = Map::decode(&cut).expect_err("no headers");
        assert!(matches!(error, DecodeError::OpenExr(_)), "{error:?}");
        let cause = error.source().expect("the decoder's answer");
        assert!(cause.is::<exr::error::Error>());
        assert_eq!(error.to_string(), TRUNCATED);
        let error = Map::new(6, 4, vec![[0.0; 3]; 24]).expect_err("not twice as wide");
        assert!(
            matches!(
                error,
                MapError::Pixels(DecodeError::NotLatLong {
                    width: 6,
                    height: 4
                })
            ),
            "{error:?}"
        );
    }
}
