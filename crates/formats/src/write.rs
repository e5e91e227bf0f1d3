//! Writing files whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file that writing to `path` makes or replaces: `path` itself, or what it links to. Worth
/// asking before long work.
///
/// # Errors
/// When [`write_file`] could not write there: no such folder, a directory, or something that is
/// not a regular file and must not be replaced by one.
pub fn check_writable(path: &Path) -> io::Result<PathBuf> {
    let refused = |kind, what| Err(io::Error::new(kind, what));
    let Some(name) = path.file_name() else {
        return refused(io::ErrorKind::InvalidInput, "the path names no file");
    };
    // A link that leads to a file stays a link.
    if let Ok(target) = path.canonicalize() {
        if target.is_dir() {
            return refused(io::ErrorKind::IsADirectory, "is a directory");
        }
        if !target.is_file() {
            return refused(io::ErrorKind::InvalidInput, "is not a regular file");
        }
        return Ok(target);
    }
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    match folder.canonicalize() {
        Ok(folder) if folder.is_dir() => Ok(folder.join(name)),
        _ => refused(io::ErrorKind::NotFound, "no such folder"),
    }
}

/// Writes `bytes` to `path` through a temporary name in the same folder, so that `path` holds
/// either what it held before or all of `bytes`.
///
/// # Errors
/// See [`check_writable`]; whatever creating, writing or renaming answers. The temporary file is
/// removed.
pub fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let target = check_writable(path)?;
    let mut temporary = target.file_name().unwrap_or_default().to_os_string();
    temporary.push(format!(".{}.tmp", std::process::id()));
    let temporary = target.with_file_name(temporary);
    let result = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, &target));
    if result.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    result
}
