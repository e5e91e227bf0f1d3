//! Reading and writing of the kinds of file that are containers.

use std::io::{Read, Seek};
use std::path::Path;

use crate::container::{Container, Kind};
use crate::error::{Error, Result};
use crate::write::write_file;

/// A kind of file that is a [`Container`]: [`Groom`](crate::Groom), [`LightSet`](crate::LightSet),
/// [`Mesh`](crate::Mesh), [`Panorama`](crate::Panorama), [`TableFile`](crate::TableFile).
///
/// A kind says how it is laid out in sections; reading from and writing to files, with errors that
/// name them, is the same for all.
pub trait BakedFile: Sized {
    /// The kind that the container announces.
    const KIND: Kind;

    /// Reads what an opened container holds, and checks all of it.
    ///
    /// # Errors
    /// Any of [`Error`]; the path is not named.
    fn from_container<R: Read + Seek>(file: Container<R>) -> Result<Self>;

    /// The bytes of the file. Equal content gives equal bytes.
    ///
    /// # Errors
    /// `Value` when the content breaks a promise.
    fn to_bytes(&self) -> Result<Vec<u8>>;

    /// Decodes a file in memory.
    ///
    /// # Errors
    /// Any of [`Error`].
    fn from_bytes(bytes: &[u8]) -> Result<Self> {
        Self::from_container(Container::from_bytes(bytes, Self::KIND)?)
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// Any of [`Error`], naming the path.
    fn read(path: &Path) -> Result<Self> {
        Container::open(path, Self::KIND)
            .and_then(Self::from_container)
            .map_err(|error| error.in_file(path))
    }

    /// Validates and writes, whole or not at all; answers the number of bytes written.
    ///
    /// # Errors
    /// `Value` when the content breaks a promise, `Io`; the path is named.
    fn write(&self, path: &Path) -> Result<u64> {
        let bytes = self.to_bytes().map_err(|error| error.in_file(path))?;
        write_file(path, &bytes).map_err(|error| Error::from(error).in_file(path))?;
        Ok(bytes.len() as u64)
    }
}
