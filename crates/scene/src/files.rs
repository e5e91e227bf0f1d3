//! Where files come from and go to: the disk, or a map in memory for a web page that has fetched
//! them. Nothing else in this crate opens a file.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use strandlight_formats::container::{Container, Kind};
use strandlight_formats::{
    BakedFile, Cube, Error, FileName, Groom, GroomHeader, LightSet, Mesh, Panorama, Scene,
    TableReader, check_writable, content_hash, file_hash, open_file, read_file, write_file,
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
    /// The file system, and files in memory that hide those there: made and not written yet. Clones
    /// share them.
    Over(Arc<Mutex<BTreeMap<PathBuf, Bytes>>>),
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

    /// The file system, with nothing over it yet: see [`Files::hold`].
    pub fn over_disk() -> Files {
        Files::Over(Arc::default())
    }

    /// Keeps a file in memory until [`Files::write`] writes to its path. On the plain file system
    /// there is no such memory, and nothing happens.
    pub fn hold(&self, path: &Path, bytes: impl Into<Arc<[u8]>>) {
        if let Files::Memory(files) | Files::Over(files) = self {
            let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
            files.insert(self.key(path), bytes.into());
        }
    }

    /// A file that was made and is not written yet.
    pub fn held(&self, path: &Path) -> Option<Arc<[u8]>> {
        match self {
            Files::Over(_) => self.bytes_in_memory(path),
            _ => None,
        }
    }

    /// Forgets a file that [`Files::hold`] keeps.
    pub fn release(&self, path: &Path) {
        if let Files::Over(files) = self {
            let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
            files.remove(&self.key(path));
        }
    }

    /// What a file in memory is found by, however its path is written: in a page the path alone, since nothing else is known of
    /// its folders, otherwise from the root.
    fn key(&self, path: &Path) -> PathBuf {
        let Files::Over(_) = self else {
            return plain(path);
        };
        let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        // Links in folders that are there are known, so that `..` after one leads where the file system says.
        for folder in whole.ancestors().skip(1) {
            if let (Ok(found), Ok(rest)) = (folder.canonicalize(), whole.strip_prefix(folder)) {
                return plain(&found.join(rest));
            }
        }
        plain(&whole)
    }

    /// All of a file of at most `limit` bytes.
    ///
    /// # Errors
    /// `Io` or `Value`, naming the path.
    pub fn read(&self, path: &Path, limit: u64) -> Result<Vec<u8>, Error> {
        match self.bytes(path)? {
            None => read_file(path, limit),
            Some(bytes) => {
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
        match self.bytes(path)? {
            None => file_hash(path),
            Some(bytes) => Ok(content_hash(&bytes)),
        }
    }

    /// Writes a file whole or not at all.
    ///
    /// # Errors
    /// What the file system answers; the path is named.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Error> {
        match self {
            Files::Disk | Files::Over(_) => {
                write_file(path, bytes).map_err(|error| Error::from(error).in_file(path))?;
                self.release(path);
                Ok(())
            }
            Files::Memory(_) => {
                self.hold(path, bytes);
                Ok(())
            }
        }
    }

    /// Takes away what [`Files::write`] wrote, if it can be.
    pub fn remove(&self, path: &Path) {
        match self {
            Files::Disk | Files::Over(_) => {
                std::fs::remove_file(path).ok();
            }
            Files::Memory(files) => {
                let mut files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.remove(&plain(path));
            }
        }
    }

    /// Could [`Files::write`] write here? Worth asking before long work.
    ///
    /// # Errors
    /// As [`Files::write`].
    pub fn check_writable(&self, path: &Path) -> Result<(), Error> {
        match self {
            Files::Disk | Files::Over(_) => check_writable(path)
                .map(drop)
                .map_err(|error| Error::from(error).in_file(path)),
            Files::Memory(_) => Ok(()),
        }
    }

    /// Is there something at `path`?
    pub fn exists(&self, path: &Path) -> bool {
        match self.bytes(path) {
            Ok(None) => path.symlink_metadata().is_ok(),
            found => found.is_ok(),
        }
    }

    /// When a file was last written; `None` where that is not known, and of streams, which are read once.
    pub fn modified(&self, path: &Path) -> Option<SystemTime> {
        match self.bytes(path) {
            Ok(None) => {
                let data = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
                data.modified().ok()
            }
            _ => None,
        }
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        match self.bytes(path)? {
            None => Scene::read(path),
            Some(_) => Scene::from_bytes(&self.read(path, Scene::MAX_BYTES)?, path),
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

    /// Reads a panorama.
    ///
    /// # Errors
    /// As [`Panorama::read`].
    pub fn panorama(&self, path: &Path) -> Result<Panorama, Error> {
        self.container(path, Kind::Panorama)
            .and_then(Panorama::from_container)
            .map_err(|error| error.in_file(path))
    }

    /// Reads a LUT.
    ///
    /// # Errors
    /// As [`Cube::read`].
    pub fn cube(&self, path: &Path) -> Result<Cube, Error> {
        let bytes = self.read(path, Cube::MAX_BYTES)?;
        Cube::from_bytes(&bytes).map_err(|error| error.in_file(path))
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
        let (source, length): (Box<dyn Source>, u64) = match self.bytes(path)? {
            None => {
                let (file, length) = open_file(path)?;
                (Box::new(file), length)
            }
            Some(bytes) => {
                let length = bytes.len() as u64;
                (Box::new(Cursor::new(bytes)), length)
            }
        };
        Container::new(source, length, kind)
    }

    /// A file in memory; `None` where the file system is to be asked.
    fn bytes(&self, path: &Path) -> Result<Option<Bytes>, Error> {
        match (self.bytes_in_memory(path), self) {
            (None, Files::Memory(_)) => {
                let missing = std::io::Error::new(std::io::ErrorKind::NotFound, "no such file");
                Err(Error::from(missing).in_file(path))
            }
            (found, _) => Ok(found),
        }
    }

    fn bytes_in_memory(&self, path: &Path) -> Option<Bytes> {
        match self {
            Files::Disk => None,
            Files::Memory(files) | Files::Over(files) => {
                let files = files.lock().unwrap_or_else(PoisonError::into_inner);
                files.get(&self.key(path)).cloned()
            }
        }
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

    #[cfg(unix)]
    #[test]
    fn files_over_the_disk_are_found_however_their_paths_are_written() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let current = std::env::current_dir().expect("a folder");
        let up: PathBuf = current.components().skip(1).map(|_| "..").collect();
        let relative = up.join(folder.path().strip_prefix("/").expect("from the root"));
        for inner in ["scenes/links", "maps"] {
            std::fs::create_dir_all(folder.path().join(inner)).expect("made");
        }
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("scenes/links", link).expect("a link");
        let files = Files::over_disk();
        let whole = std::path::absolute(folder.path()).expect("a folder");
        files.hold(&whole.join("maps/a.lights"), *b"held");
        for written in [
            "maps/a.lights",
            "scenes/../maps/a.lights",
            "link/../../maps/./a.lights",
        ] {
            let path = relative.join(written);
            assert_eq!(files.read(&path, 10).expect(written), b"held");
            assert!(files.held(&path).is_some(), "{written}");
        }
        // A folder that is made later, on a way over a link.
        let later = folder.path().join("link/new/b.lights");
        files.hold(&later, *b"held");
        assert!(files.exists(&relative.join("link/later/../new/b.lights")));
        std::fs::create_dir(folder.path().join("scenes/links/new")).expect("made");
        assert!(files.exists(&later));
        files.release(&relative.join("scenes/../maps/a.lights"));
        assert!(!files.exists(&whole.join("maps/a.lights")));
    }

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
    fn files_over_the_disk_hide_it_until_they_are_written() {
        let folder = std::env::temp_dir().join(format!("strandlight-over-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("a.txt");
        std::fs::write(&path, "disk").expect("written");
        let files = Files::over_disk();
        let read = |path: &Path| files.read(path, 10).expect("there");
        assert_eq!((read(&path), files.held(&path)), (b"disk".to_vec(), None));
        files.hold(&path, *b"held");
        assert_eq!(read(&folder.join("./a.txt")), b"held");
        assert!(files.held(&path).is_some() && files.modified(&path).is_none());
        assert_eq!(std::fs::read(&path).expect("there"), b"disk");
        files.write(&path, b"new").expect("written");
        assert_eq!((read(&path), files.held(&path)), (b"new".to_vec(), None));
        assert_eq!(std::fs::read(&path).expect("there"), b"new");
        assert!(!files.exists(&folder.join("b.txt")));
        std::fs::remove_dir_all(&folder).expect("removed");
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
