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

/// [`content_hash`] of the bytes of a regular file, however long it is.
///
/// # Errors
/// `Io`; the path is named.
pub fn file_hash(path: &Path) -> Result<String> {
    let hash = || -> Result<String> {
        let (mut file, _) = open_file(path)?;
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

/// Name and version of this program, as recorded in files.
pub fn tool_version() -> String {
    concat!("strandlight ", env!("CARGO_PKG_VERSION")).to_owned()
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
}
