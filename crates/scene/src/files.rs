//! Where files come from and go to: the disk, or a map in memory for a web page that has fetched
//! them. Nothing else in this crate opens a file.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use strandlight_formats::container::{Container, Kind};
use strandlight_formats::{
    BakedFile, Error, FileName, Groom, GroomHeader, LightSet, Mesh, Scene, TableReader,
    check_writable, content_hash, file_hash, open_file, read_file, write_file,
};

use crate::error::SceneError;
pub use crate::limits::MAX_GROOM_BYTES;
use crate::limits::MAX_POINTS;
use crate::memory;

/// Bytes that a point of a groom takes while it is prepared, refinement included: the document's,
/// the strands' and their copies on the way to the device.
const BYTES_PER_POINT: u64 = 160;

type Bytes = Arc<[u8]>;

/// A place that files are read from and written to.
#[derive(Clone, Debug, Default)]
pub enum Files {
    /// The file system.
    #[default]
    Disk,
    /// Files in memory by their paths. Clones share them.
    Memory(Arc<Mutex<BTreeMap<PathBuf, Bytes>>>),
}

/// What a container is read from.
pub trait Source: Read + Seek {}

impl<T: Read + Seek> Source for T {}

impl Files {
    /// Files in memory, by path.
    pub fn in_memory<P: AsRef<Path>>(files: impl IntoIterator<Item = (P, Vec<u8>)>) -> Files {
        let files = files
            .into_iter()
            .map(|(path, bytes)| (plain(path.as_ref()), bytes.into()))
            .collect();
        Files::Memory(Arc::new(Mutex::new(files)))
    }

    /// All of a file of at most `limit` bytes.
    ///
    /// # Errors
    /// `Io` or `Value`, naming the path.
    pub fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
        match self {
            Files::Disk => read_file(path, limit),
            Files::Memory(_) => {
                let bytes = self.bytes(path)?;
                if bytes.len() as u64 > limit {
                    return Err(Error::Value {
                        file: FileName(Some(path.to_owned())),
                        line: None,
                        key: "file length".to_owned(),
                        value: format!("{} bytes", bytes.len()),
                        range: format!("at most {limit}"),
                    });
                }
                Ok(bytes.to_vec())
            }
        }
    }

    /// The content hash of a file: see [`strandlight_formats::content_hash`].
    ///
    /// # Errors
    /// `Io`, naming the path.
    pub fn hash(&self, path: &Path) -> Result<String, Error> {
        match self {
            Files::Disk => file_hash(path),
            Files::Memory(_) => Ok(content_hash(&self.bytes(path)?)),
        }
    }

    /// Writes a file whole or not at all.
    ///
    /// # Errors
    /// What the file system answers; the path is named.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        match self {
            Files::Disk => {
                write_file(path, bytes).map_err(|error| Error::from(error).in_file(path))
            }
            Files::Memory(files) => {
                let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.insert(plain(path), bytes.into());
                Ok(())
            }
        }
    }

    /// Could [`Files::write`] write here? Worth asking before long work.
    ///
    /// # Errors
    /// As [`Files::write`].
    pub fn check_writable(&self, path: &Path) -> Result<(), Error> {
        match self {
            Files::Disk => check_writable(path)
                .map(drop)
                .map_err(|error| Error::from(error).in_file(path)),
            Files::Memory(_) => Ok(()),
        }
    }

    /// Is there something at `path`?
    pub fn exists(&self, path: &Path) -> bool {
        match self {
            Files::Disk => path.symlink_metadata().is_ok(),
            Files::Memory(_) => self.bytes(path).is_ok(),
        }
    }

    /// When a file was last written; `None` where that is not known.
    pub fn modified(&self, path: &Path) -> Option<SystemTime> {
        match self {
            Files::Disk => path.metadata().and_then(|data| data.modified()).ok(),
            Files::Memory(_) => None,
        }
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        match self {
            Files::Disk => Scene::read(path),
            Files::Memory(_) => Scene::from_bytes(&self.read(path, Scene::MAX_BYTES)?, path),
        }
    }

    /// Reads a groom that can be drawn.
    ///
    /// # Errors
    /// As [`Groom::read`]; too many points or bytes, found out before anything is allocated.
    pub fn groom(&self, path: &Path) -> Result<Groom, SceneError> {
        let named = |error: Error| error.in_file(path);
        let mut file = self.container(path, Kind::Groom).map_err(named)?;
        let header = GroomHeader::read(&mut file).map_err(named)?;
        check_size(&header, memory::available_bytes()).map_err(|error| error.in_file(path))?;
        Ok(Groom::from_container(file).map_err(named)?)
    }

    /// Reads a light set.
    ///
    /// # Errors
    /// As [`LightSet::read`].
    pub fn lights(&self, path: &Path) -> Result<LightSet, Error> {
        self.container(path, Kind::Lights)
            .and_then(LightSet::from_container)
            .map_err(|error| error.in_file(path))
    }

    /// Reads a mesh.
    ///
    /// # Errors
    /// As [`Mesh::read`].
    pub fn mesh(&self, path: &Path) -> Result<Mesh, Error> {
        self.container(path, Kind::Mesh)
            .and_then(Mesh::from_container)
            .map_err(|error| error.in_file(path))
    }

    /// Opens tables to read single ones from.
    ///
    /// # Errors
    /// As [`strandlight_formats::TableFile::open`].
    pub fn tables(&self, path: &Path) -> Result<TableReader<Box<dyn Source>>, Error> {
        self.container(path, Kind::Tables)
            .and_then(TableReader::new)
            .map_err(|error| error.in_file(path))
    }

    fn container(&self, path: &Path, kind: Kind) -> Result<Container<Box<dyn Source>>, Error> {
        let (source, length): (Box<dyn Source>, u64) = match self {
            Files::Disk => {
                let (file, length) = open_file(path)?;
                (Box::new(file), length)
            }
            Files::Memory(_) => {
                let bytes = self.bytes(path)?;
                let length = bytes.len() as u64;
                (Box::new(Cursor::new(bytes)), length)
            }
        };
        Container::new(source, length, kind)
    }

    fn bytes(&self, path: &Path) -> Result<Bytes, Error> {
        let found = match self {
            Files::Disk => None,
            Files::Memory(files) => {
                let files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.get(&plain(path)).cloned()
            }
        };
        found.ok_or_else(|| {
            let missing = std::io::Error::new(std::io::ErrorKind::NotFound, "no such file");
            Error::from(missing).in_file(path)
        })
    }
}

/// Refuses a groom that cannot be drawn, or not in the memory there is.
fn check_size(header: &GroomHeader, available: Option<u64>) -> Result<(), SceneError> {
    let n_points = u64::from(header.n_points);
    if n_points > MAX_POINTS as u64 {
        return Err(SceneError::GroomPoints { points: n_points });
    }
    if header.bytes > MAX_GROOM_BYTES {
        let bytes = header.bytes;
        return Err(SceneError::GroomBytes { bytes });
    }
    let needed = header.bytes + BYTES_PER_POINT * n_points;
    match available {
        Some(available) if needed > available => Err(SceneError::GroomMemory { needed, available }),
        _ => Ok(()),
    }
}

/// The path without `.` and with `..` taken back, as far as the path itself tells.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_in_memory_are_found_by_their_paths() {
        let files = Files::in_memory([("a/b.txt", b"hello".to_vec())]);
        assert_eq!(
            files.read(Path::new("./a/c/../b.txt"), 10).expect("there"),
            b"hello"
        );
        let long = files.read(Path::new("a/b.txt"), 4).expect_err("too long");
        assert!(long.to_string().contains("b.txt: file length"), "{long}");
        let missing = files.read(Path::new("b.txt"), 10).expect_err("not there");
        assert!(
            missing.to_string().contains("b.txt: no such file"),
            "{missing}"
        );
        files
            .clone()
            .write(Path::new("b.txt"), b"x")
            .expect("written");
        assert!(files.exists(Path::new("b.txt")), "clones share their files");
        let not = files.lights(Path::new("b.txt")).expect_err("no light set");
        assert!(not.to_string().contains("b.txt"), "{not}");
    }

    #[test]
    fn grooms_too_large_are_refused_by_their_header() {
        let header = |n_points, bytes| GroomHeader {
            n_strands: 1,
            n_points,
            bytes,
        };
        let check = |header, free| {
            let path = Path::new("big.groom");
            check_size(&header, free).map_err(|error| error.in_file(path))
        };
        assert!(check(header(1000, 12_000), None).is_ok());
        assert!(check(header(1000, 12_000), Some(172_000)).is_ok());
        for (header, free, needle) in [
            (header(MAX_POINTS as u32 + 1, 1), None, "points"),
            (header(1000, MAX_GROOM_BYTES + 1), None, "are read"),
            (header(1000, 12_000), Some(171_999), "are free"),
        ] {
            let error = check(header, free).expect_err(needle).to_string();
            assert!(
                error.contains("big.groom") && error.contains(needle),
                "{error}"
            );
        }
    }
}
