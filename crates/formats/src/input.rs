//! Reading input files: regular ones, pipes, and standard input by the name `-`.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::provenance::content_hash;
pub(crate) use crate::provenance::tool_version;
use crate::sniff::{FileKind, SNIFF_BYTES};

/// The name of standard input, and of standard output.
pub(crate) const STANDARD_STREAM: &str = "-";

/// Most bytes taken from a pipe: it is kept in memory, where a file would stay on the disk.
const MAX_PIPE_BYTES: u64 = 1 << 32;
/// Most bytes taken from a device: `/dev/zero` never ends, and assets are not kept in one.
const MAX_DEVICE_BYTES: u64 = 64 << 20;

/// What an opened input is read from.
#[derive(Debug)]
pub enum Input {
    /// A regular file.
    File(File),
    /// All that came out of a pipe.
    Memory(Cursor<Arc<[u8]>>),
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Input::File(file) => file.read(buffer),
            Input::Memory(bytes) => bytes.read(buffer),
        }
    }
}

impl Seek for Input {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Input::File(file) => file.seek(to),
            Input::Memory(bytes) => bytes.seek(to),
        }
    }
}

/// A pipe, a device or standard input. What has come out stays: it cannot be read twice, and
/// whoever asks what kind of file it is reads the start before another reads it all.
struct Pipe {
    source: Box<dyn Read + Send>,
    bytes: Vec<u8>,
    /// Most bytes that are taken.
    limit: u64,
}

/// Those that were opened, by the names they were asked for.
static PIPES: Mutex<BTreeMap<PathBuf, Pipe>> = Mutex::new(BTreeMap::new());

impl Pipe {
    /// Reads on until `wanted` bytes are here or there are no more.
    fn fill(&mut self, wanted: u64) -> io::Result<()> {
        let missing = wanted.saturating_sub(self.bytes.len() as u64);
        self.source
            .by_ref()
            .take(missing)
            .read_to_end(&mut self.bytes)?;
        Ok(())
    }

    /// All bytes, at most `limit`.
    fn whole(&mut self, limit: u64) -> Result<&[u8]> {
        let limit = limit.min(self.limit);
        self.fill(limit.saturating_add(1))?;
        if self.bytes.len() as u64 > limit {
            return Err(too_long(format!("over {limit} bytes"), limit));
        }
        Ok(&self.bytes)
    }

    /// The first `n` bytes, or fewer if it ends before.
    fn start(&mut self, n: u64) -> Result<&[u8]> {
        self.fill(n)?;
        Ok(&self.bytes[..self.bytes.len().min(n as usize)])
    }
}

fn too_long(length: String, limit: u64) -> Error {
    Error::value("file length", length, format!("at most {limit}"))
}

/// A regular file and its length, or `None` for what is read as a pipe.
fn regular_file(path: &Path) -> Result<Option<(File, u64)>> {
    if path == Path::new(STANDARD_STREAM) {
        return Ok(None);
    }
    // Asked before opening, since opening a pipe waits for its writer.
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory").into());
    }
    if !metadata.is_file() {
        return Ok(None);
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok(Some((file, length)))
}

/// What standard input or the file at `path` is taken for, and most bytes of it.
fn open_pipe(path: &Path) -> io::Result<Pipe> {
    let (source, metadata): (Box<dyn Read + Send>, _) = if path == Path::new(STANDARD_STREAM) {
        (Box::new(io::stdin()), standard_input()?)
    } else {
        let file = File::open(path)?;
        let metadata = file.metadata()?;
        (Box::new(file), Some(metadata))
    };
    if metadata.as_ref().is_some_and(fs::Metadata::is_dir) {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a directory",
        ));
    }
    let limit = match metadata.is_some_and(|metadata| is_device(&metadata)) {
        true => MAX_DEVICE_BYTES,
        false => MAX_PIPE_BYTES,
    };
    Ok(Pipe {
        source,
        bytes: Vec::new(),
        limit,
    })
}

/// What standard input is, where the system tells.
#[cfg(unix)]
fn standard_input() -> io::Result<Option<fs::Metadata>> {
    use std::os::fd::AsFd;
    let descriptor = io::stdin().as_fd().try_clone_to_owned()?;
    File::from(descriptor).metadata().map(Some)
}

#[cfg(not(unix))]
fn standard_input() -> io::Result<Option<fs::Metadata>> {
    Ok(None)
}

#[cfg(unix)]
fn is_device(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = metadata.file_type();
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: &fs::Metadata) -> bool {
    false
}

/// What `read` makes of the pipe at `path`, which is opened once in the life of the process.
fn with_pipe<T>(path: &Path, read: impl FnOnce(&mut Pipe) -> Result<T>) -> Result<T> {
    let mut pipes = PIPES.lock().unwrap_or_else(PoisonError::into_inner);
    if !pipes.contains_key(path) {
        pipes.insert(path.to_owned(), open_pipe(path)?);
    }
    match pipes.get_mut(path) {
        Some(pipe) => read(pipe),
        None => Err(io::Error::from(io::ErrorKind::NotFound).into()),
    }
}

/// Opens a container and says how long it is. A pipe, or standard input as `-`, is read into
/// memory; one that does not start like a container no further than that start.
///
/// # Errors
/// `Io`, or `Value` when a pipe does not end; the path is not named.
pub fn open_file(path: &Path) -> Result<(Input, u64)> {
    if let Some((file, length)) = regular_file(path)? {
        return Ok((Input::File(file), length));
    }
    with_pipe(path, |pipe| {
        let start = pipe.start(SNIFF_BYTES as u64)?;
        let bytes: Arc<[u8]> = match FileKind::of(start) {
            FileKind::Ours(_) | FileKind::OursUnknown => pipe.whole(u64::MAX)?.into(),
            _ => start.into(),
        };
        let length = bytes.len() as u64;
        Ok((Input::Memory(Cursor::new(bytes)), length))
    })
}

/// Reads a whole file of at most `limit` bytes: a regular one, a pipe, or standard input as `-`.
///
/// # Errors
/// `Io`, or `Value` when the file is longer; the path is named.
pub fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    read_file_of_kind(path, limit, |_| true)
}

/// As [`read_file`], for a reader of the kinds that `is_wanted` names. Of a pipe of another kind
/// only the start is read, so that the decoder refuses at once what may never end.
///
/// # Errors
/// As [`read_file`].
pub fn read_file_of_kind(
    path: &Path,
    limit: u64,
    is_wanted: impl Fn(FileKind) -> bool,
) -> Result<Vec<u8>> {
    let read = || -> Result<Vec<u8>> {
        if let Some((file, length)) = regular_file(path)? {
            if length > limit {
                return Err(too_long(format!("{length} bytes"), limit));
            }
            let mut bytes = Vec::new();
            file.take(limit).read_to_end(&mut bytes)?;
            return Ok(bytes);
        }
        with_pipe(path, |pipe| {
            let start = pipe.start(SNIFF_BYTES as u64)?;
            match is_wanted(FileKind::of(start)) {
                true => Ok(pipe.whole(limit)?.to_vec()),
                false => Ok(start.to_vec()),
            }
        })
    };
    read().map_err(|error| error.in_file(path))
}

/// The first `n` bytes of a file, a pipe or standard input, or all if there are fewer. A pipe can
/// still be read from its start.
///
/// # Errors
/// `Io`; the path is named.
pub fn read_start(path: &Path, n: u64) -> Result<Vec<u8>> {
    let read = || -> Result<Vec<u8>> {
        let Some((file, _)) = regular_file(path)? else {
            return with_pipe(path, |pipe| Ok(pipe.start(n)?.to_vec()));
        };
        let mut bytes = Vec::new();
        file.take(n).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|error| error.in_file(path))
}

/// The folder that names inside the file at `path` are relative to: its own, or the current one
/// for standard input and what a shell hands over as `/dev/fd/63`.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match ["/dev", "/proc"].iter().any(|root| path.starts_with(root)) {
        true => PathBuf::new(),
        false => path.parent().map(Path::to_owned).unwrap_or_default(),
    }
}

/// [`content_hash`](crate::content_hash) of all bytes of a file, however long a regular one is. A
/// pipe is read to its end, whatever kind of file comes out of it.
///
/// # Errors
/// `Io`, or `Value` when a pipe does not end; the path is named.
pub fn file_hash(path: &Path) -> Result<String> {
    let hash = || -> Result<String> {
        let Some((mut file, _)) = regular_file(path)? else {
            return with_pipe(path, |pipe| Ok(content_hash(pipe.whole(u64::MAX)?)));
        };
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        let mut buffer = vec![0; 1 << 18];
        loop {
            match file.read(&mut buffer)? {
                0 => return Ok(format!("{:016x}", hasher.digest())),
                n => hasher.update(&buffer[..n]),
            }
        }
    };
    hash().map_err(|error| error.in_file(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_hash_of_its_bytes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a");
        for length in [0, 100, 1 << 18, (1 << 19) + 7] {
            let bytes: Vec<u8> = (0..length)
                .map(|ix: u32| (ix.wrapping_mul(ix) >> 3) as u8)
                .collect();
            fs::write(&path, &bytes).expect("written");
            assert_eq!(file_hash(&path).expect("read"), content_hash(&bytes));
        }
        let error = file_hash(&folder.path().join("none")).expect_err("not there");
        assert!(error.to_string().contains("none"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn endless_devices_end_at_the_limit() {
        let error = read_file(Path::new("/dev/zero"), 1000).expect_err("endless");
        assert!(error.to_string().contains("over 1000 bytes"), "{error}");
        assert!(
            read_file(Path::new("/dev/null"), 10)
                .expect("empty")
                .is_empty()
        );
        // What is no container is not read on.
        let (_, length) = open_file(Path::new("/dev/zero")).expect("opened");
        assert_eq!(length, SNIFF_BYTES as u64);
        let is_hair = |kind| matches!(kind, FileKind::Hair(_));
        let start = read_file_of_kind(Path::new("/dev/zero"), u64::MAX, is_hair);
        assert_eq!(start.expect("the start"), [0; SNIFF_BYTES]);
    }

    #[test]
    fn a_pipe_is_there_for_every_reader() {
        let (reader, mut writer) = io::pipe().expect("a pipe");
        let path = PathBuf::from(format!(
            "/dev/fd/{}",
            std::os::fd::AsRawFd::as_raw_fd(&reader)
        ));
        io::Write::write_all(&mut writer, b"hello").expect("room for it");
        drop(writer);
        assert_eq!(read_start(&path, 2).expect("read"), b"he");
        assert_eq!(read_file(&path, 5).expect("read"), b"hello");
        assert_eq!(read_file(&path, 5).expect("read again"), b"hello");
        let error = read_file(&path, 4).expect_err("too long").to_string();
        assert!(
            error.contains("file length is over 4 bytes, must be at most 4"),
            "{error}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_has_the_hash_of_all_its_bytes() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo starts").success());
        let text = "no container\n".repeat(SNIFF_BYTES);
        let writer = {
            let (path, text) = (path.clone(), text.clone());
            std::thread::spawn(move || fs::write(path, text))
        };
        let hash = file_hash(&path).expect("read");
        writer.join().expect("no panic").expect("written");
        assert_eq!(hash, content_hash(text.as_bytes()));
        // Nobody writes again, so that a second opening would wait for ever.
        assert_eq!(file_hash(&path).expect("kept"), hash);
        let read = read_file(&path, u64::MAX).expect("kept");
        assert_eq!(read, text.as_bytes());
    }

    #[test]
    fn directories_are_refused() {
        for result in [
            read_file(Path::new("/tmp"), 10).map(|_| ()),
            open_file(Path::new("/tmp")).map(|_| ()),
            read_start(Path::new("/tmp"), 10).map(|_| ()),
        ] {
            let error = result.expect_err("a directory").to_string();
            assert!(error.contains("is a directory"), "{error}");
        }
    }
}
