//! The map that ground truth is lit by. `strandlight` decodes it, and hands over its pixels.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use strandlight_formats::{Error, FileKind, NpyArray, SNIFF_BYTES, read_start};
use strandlight_scene::LatLong;
use strandlight_scene::files::Files;

use crate::work::{Scratch, Work, WorkError};

/// Why ground truth cannot be lit by a map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TruthMapError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] Error),
    /// It is another kind of file.
    #[error("{}: neither OpenEXR nor Radiance .hdr, by its first bytes: {found}", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// What `strandlight` says of it, or that there is no such program.
    #[error(transparent)]
    Work(#[from] WorkError),
}

/// An environment map, decoded.
pub struct TruthMap {
    /// Where its pixels lie.
    pub grid: LatLong,
    /// Linear Rec.709 radiance, the top row first.
    pub pixels: Vec<[f32; 3]>,
}

impl TruthMap {
    /// The map in the OpenEXR or Radiance file at `path`, by `strandlight export`.
    fn read(path: &Path, work: &Work) -> Result<TruthMap, TruthMapError> {
        let kind = FileKind::of(&read_start(path, SNIFF_BYTES as u64)?);
        if !matches!(kind, FileKind::Map(_)) {
            return Err(TruthMapError::Kind {
                path: path.to_owned(),
                found: kind.describe(),
            });
        }
        // Names that start with a dash are no flags then.
        let whole = std::path::absolute(path).map_err(Error::from)?;
        let scratch = Scratch::new().map_err(Error::from)?;
        let pixels = scratch.join("map.npy");
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let words = ["export".as_ref(), whole.as_os_str(), "-o".as_ref()];
        let words = words.into_iter().chain([pixels.as_os_str()]);
        work.strandlight(&format!("reading the map {name}"), words)?;
        let bytes = Files::Disk.read(&pixels, u64::MAX)?;
        Ok(TruthMap::of_array(&bytes).map_err(|error| error.in_file(&pixels))?)
    }

    fn of_array(bytes: &[u8]) -> Result<TruthMap, Error> {
        let is_map =
            |shape: &[u64]| matches!(shape, [h, w, 3] if *h > 0 && w % 2 == 0 && w / 2 == *h);
        let array = NpyArray::of(bytes, "(height, twice as much, 3)", is_map)?;
        let grid = LatLong {
            width: array.shape[1] as usize,
            height: array.shape[0] as usize,
        };
        // Numbers that were single precision stay as they were.
        let pixel = |ix: usize| [0, 1, 2].map(|c| array.value(3 * ix + c) as f32);
        let pixels = (0..grid.width * grid.height).map(pixel).collect();
        Ok(TruthMap { grid, pixels })
    }
}

/// The map that was read last, for the next picture in its light. One at a time: they are large.
#[derive(Default)]
pub struct KeptMap(Mutex<Option<Kept>>);

struct Kept {
    path: PathBuf,
    /// When it was written.
    time: SystemTime,
    map: Arc<TruthMap>,
}

impl KeptMap {
    /// The map at `path`, read unless it is the one that is kept.
    pub fn get(&self, path: &Path, work: &Work) -> Result<Arc<TruthMap>, TruthMapError> {
        let whole = path.canonicalize();
        let time = Files::Disk.modified(path);
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some(kept), Ok(whole)) = (&*kept, &whole)
            && kept.path == *whole
            && Some(kept.time) == time
        {
            return Ok(kept.map.clone());
        }
        *kept = None;
        let map = Arc::new(TruthMap::read(path, work)?);
        if let (Ok(path), Some(time)) = (whole, time) {
            let map = map.clone();
            *kept = Some(Kept { path, time, map });
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `strandlight export` writes them.
    fn array(shape: &str, values: &[f32]) -> Vec<u8> {
        let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.bytes());
        file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        file
    }

    #[test]
    fn pixels_are_taken_as_they_are() {
        let values: Vec<f32> = (0..24).map(|ix| 0.1 * ix as f32).collect();
        let map = TruthMap::of_array(&array("2, 4, 3,", &values)).expect("a map");
        assert_eq!((map.grid.width, map.grid.height), (4, 2));
        assert_eq!(map.pixels.as_flattened(), values);
        for shape in ["4, 2, 3,", "2, 3, 4,", "24,", "1, 2, 12,"] {
            let error = TruthMap::of_array(&array(shape, &values)).err();
            let error = error.expect(shape).to_string();
            assert!(error.contains("twice as much"), "{error}");
        }
    }

    #[test]
    fn what_is_no_map_is_named_without_the_program() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("photo.png"), b"\x89PNG\r\n\x1a\n").expect("written");
        let (kept, work) = (KeptMap::default(), Work::default());
        for (name, needle) in [("gone.exr", "gone.exr: "), ("photo.png", "a PNG picture")] {
            let error = kept.get(&at(name), &work).err().expect(name).to_string();
            assert!(
                error.starts_with(&at(name).display().to_string()),
                "{error}"
            );
            assert!(error.contains(needle), "{error}");
        }
    }
}
