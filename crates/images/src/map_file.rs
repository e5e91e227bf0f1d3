//! Reading maps: which decoder takes a file.

use std::path::Path;

use strandlight_formats::{FileKind, content_hash, read_file_of_kind};

use crate::error::{DecodeError, MapError};
use crate::map::Map;
use crate::source::MapSelection;
use crate::{exr_map, radiance_map};

/// Longest file that is read: the largest map with eight float channels, uncompressed.
const MAX_FILE_BYTES: u64 = 16 << 30;

impl Map {
    /// Reads an OpenEXR or Radiance file, or standard input as `-`; the format is detected from its
    /// first bytes, not its name. Of an OpenEXR file with several images the one that
    /// [`MapSelection::default`] chooses.
    ///
    /// # Errors
    /// [`MapError`] naming the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Map, MapError> {
        Map::read_selected(path, &MapSelection::default())
    }

    /// As [`Map::read`], of a file with several images the one that `selection` names.
    ///
    /// # Errors
    /// [`MapError`] naming the file and what is wrong with it, or which images it has.
    pub fn read_selected(path: &Path, selection: &MapSelection) -> Result<Map, MapError> {
        let is_map = |kind| matches!(kind, FileKind::Map(_));
        let bytes = read_file_of_kind(path, MAX_FILE_BYTES, is_map)?;
        Map::decode_selected(&bytes, selection).map_err(|source| MapError::File {
            path: path.to_owned(),
            source,
        })
    }

    /// Decodes the bytes of an OpenEXR or Radiance file.
    ///
    /// # Errors
    /// What is wrong; its text is one line.
    pub fn decode(bytes: &[u8]) -> Result<Map, DecodeError> {
        Map::decode_selected(bytes, &MapSelection::default())
    }

    /// As [`Map::decode`], of a file with several images the one that `selection` names.
    ///
    /// # Errors
    /// What is wrong; its text is one line.
    pub(crate) fn decode_selected(
        bytes: &[u8],
        selection: &MapSelection,
    ) -> Result<Map, DecodeError> {
        let hash = content_hash(bytes);
        if bytes.starts_with(&exr_map::MAGIC) {
            exr_map::decode(bytes, hash, selection)
        } else if bytes.starts_with(radiance_map::MAGIC) {
            if *selection != MapSelection::default() {
                let what = "a Radiance file has no parts and layers to choose from";
                return Err(DecodeError::NoImage(what.to_owned()));
            }
            radiance_map::decode(bytes, hash)
        } else if bytes.is_empty() {
            Err(DecodeError::Empty)
        } else {
            let found = Some(FileKind::of(bytes)).filter(|found| found.is_known());
            let found = found.map(FileKind::describe);
            Err(DecodeError::NotThisKind { found })
        }
    }
}
