//! Opening input files safely.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// Opens a regular file and says how long it is. Directories, pipes and devices are refused
/// before opening, because reading those may block or never end.
///
/// # Errors
/// `Io`; the path is not named.
pub fn open_file(path: &Path) -> Result<(File, u64)> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory").into());
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file").into());
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    Ok((file, length))
}

/// Reads a whole regular file of at most `limit` bytes.
///
/// # Errors
/// `Io`, or `Value` when the file is longer; the path is named.
pub fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let read = || -> Result<Vec<u8>> {
        let (file, length) = open_file(path)?;
        if length > limit {
            return Err(Error::value(
                "file length",
                format!("{length} bytes"),
                format!("at most {limit}"),
            ));
        }
        let mut bytes = Vec::new();
        file.take(limit).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|error| error.in_file(path))
}

/// xxh3-64 of `bytes` as 16 hexadecimal digits: how files name what they were made from.
pub fn content_hash(bytes: &[u8]) -> String {
    format!("{:016x}", xxhash_rust::xxh3::xxh3_64(bytes))
}

/// Name and version of this program, as recorded in files.
pub fn tool_version() -> String {
    concat!("strandlight ", env!("CARGO_PKG_VERSION")).to_owned()
}
