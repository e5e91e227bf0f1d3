//! Reading maps: which decoder takes a file.

use std::path::Path;

use strandlight_formats::{Error, FileKind, content_hash, read_file_of_kind};

use crate::map::{Map, MapError};
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
        let io = |source| MapError::Io {
            path: path.to_owned(),
            source,
        };
        let invalid = |what| MapError::Invalid {
            path: path.to_owned(),
            what,
        };
        let is_map = |kind| matches!(kind, FileKind::Map(_));
        let bytes =
            read_file_of_kind(path, MAX_FILE_BYTES, is_map).map_err(|error| match error {
                Error::Io { source, .. } => io(source),
                Error::Value {
                    key, value, range, ..
                } => invalid(format!("{key} is {value}, must be {range}")),
                other => invalid(other.to_string()),
            })?;
        Map::decode_selected(&bytes, selection).map_err(invalid)
    }

    /// Decodes the bytes of an OpenEXR or Radiance file.
    ///
    /// # Errors
    /// What is wrong, in one line.
    pub fn decode(bytes: &[u8]) -> Result<Map, String> {
        Map::decode_selected(bytes, &MapSelection::default())
    }

    /// As [`Map::decode`], of a file with several images the one that `selection` names.
    ///
    /// # Errors
    /// What is wrong, in one line.
    pub fn decode_selected(bytes: &[u8], selection: &MapSelection) -> Result<Map, String> {
        let hash = content_hash(bytes);
        if bytes.starts_with(&exr_map::MAGIC) {
            exr_map::decode(bytes, hash, selection)
        } else if bytes.starts_with(radiance_map::MAGIC) {
            if *selection != MapSelection::default() {
                return Err("a Radiance file has no parts and layers to choose from".to_owned());
            }
            radiance_map::decode(bytes, hash)
        } else if bytes.is_empty() {
            Err("the file is empty".to_owned())
        } else {
            let what = "neither OpenEXR nor Radiance .hdr, by its first bytes";
            Err(match FileKind::of(bytes) {
                found if found.is_known() => format!("{what}: {}", found.describe()),
                _ => what.to_owned(),
            })
        }
    }
}
