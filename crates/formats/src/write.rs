//! Writing files whole or not at all, and streams as they are.

use std::collections::HashSet;
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use xxhash_rust::xxh3::xxh3_64;

use crate::input::STANDARD_STREAM;

/// Where an output goes.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum OutputTarget {
    /// A regular file, made or replaced by a temporary one beside it. Links are followed.
    File(PathBuf),
    /// A pipe, a device such as `/dev/null`, or an open descriptor: written through.
    Stream(PathBuf),
    /// Standard output, by the name `-`, `/dev/stdout` or another of its names.
    Stdout,
}

impl OutputTarget {
    /// Whether the bytes go to something that keeps its place, whatever its name ends in.
    pub fn is_stream(&self) -> bool {
        !matches!(self, OutputTarget::File(_))
    }
}

fn refused<T>(kind: io::ErrorKind, what: &str) -> io::Result<T> {
    Err(io::Error::new(kind, what))
}

/// What writing to `path` writes to. Nothing is opened.
///
/// # Errors
/// When [`write_file`] could not write there: no such folder, a directory, a loop of links, a
/// socket or a disk; a write-protected file.
pub fn output_target(path: &Path) -> io::Result<OutputTarget> {
    let target = target_of(path)?;
    if let OutputTarget::File(path) = &target
        && path
            .symlink_metadata()
            .is_ok_and(|there| is_write_protected(&there))
    {
        return refused(io::ErrorKind::PermissionDenied, "is write-protected");
    }
    Ok(target)
}

/// [`output_target`], of a file that may be write-protected.
pub(crate) fn target_of(path: &Path) -> io::Result<OutputTarget> {
    if path == Path::new(STANDARD_STREAM) {
        return Ok(OutputTarget::Stdout);
    }
    if path.as_os_str().as_encoded_bytes().ends_with(b"/") && !path.is_dir() {
        return refused(io::ErrorKind::InvalidInput, "names a folder, not a file");
    }
    let (folder, path) = end_of_links(path)?;
    if holds_descriptors(&folder) {
        if is_own_stdout(&path) {
            return Ok(OutputTarget::Stdout);
        }
        fs::metadata(&path)?;
        return Ok(OutputTarget::Stream(path));
    }
    match path.symlink_metadata() {
        Ok(metadata) if metadata.is_dir() => refused(io::ErrorKind::IsADirectory, "is a directory"),
        Ok(metadata) if metadata.is_file() => Ok(OutputTarget::File(path)),
        Ok(metadata) if takes_streams(metadata.file_type()) => Ok(OutputTarget::Stream(path)),
        Ok(_) => refused(
            io::ErrorKind::InvalidInput,
            "is neither a regular file nor a pipe or character device",
        ),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(OutputTarget::File(path)),
        Err(error) => Err(error),
    }
}

/// Has somebody said that the file is not to be written? A rename over it would not ask, nor does the system ask root.
fn is_write_protected(metadata: &fs::Metadata) -> bool {
    !is_writable_by_owner(metadata)
}

#[cfg(unix)]
fn is_writable_by_owner(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::PermissionsExt;
    metadata.permissions().mode() & 0o200 != 0
}

#[cfg(not(unix))]
fn is_writable_by_owner(metadata: &fs::Metadata) -> bool {
    !metadata.permissions().readonly()
}

/// Longest chain of links that is followed, as on Linux.
const MAX_LINKS: usize = 40;

/// The folder and the path that `path` leads to in the end, whether or not something is there.
fn end_of_links(path: &Path) -> io::Result<(PathBuf, PathBuf)> {
    let mut path = path.to_owned();
    for _ in 0..=MAX_LINKS {
        let Some(name) = path.file_name() else {
            return match path.is_dir() {
                true => refused(io::ErrorKind::IsADirectory, "is a directory"),
                false => refused(io::ErrorKind::InvalidInput, "the path names no file"),
            };
        };
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let folder = folder.canonicalize().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => io::Error::new(error.kind(), "no such folder"),
            _ => error,
        })?;
        let here = folder.join(name);
        // The links in there lead to what need not have a name.
        if holds_descriptors(&folder) {
            return Ok((folder, here));
        }
        match here.read_link() {
            Ok(target) => path = folder.join(target),
            Err(_) => return Ok((folder, here)),
        }
    }
    refused(io::ErrorKind::InvalidInput, "a link that leads in a circle")
}

/// Is `folder`, without links, one whose entries are open descriptors of a process?
fn holds_descriptors(folder: &Path) -> bool {
    folder == Path::new("/dev/fd") || (folder.starts_with("/proc") && folder.ends_with("fd"))
}

/// Is `path` this process's descriptor 1?
fn is_own_stdout(path: &Path) -> bool {
    ["/proc/self/fd", "/proc/thread-self/fd", "/dev/fd"]
        .iter()
        .any(|folder| fs::canonicalize(folder).is_ok_and(|folder| folder.join("1") == path))
}

#[cfg(unix)]
fn takes_streams(kind: fs::FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_fifo() || kind.is_char_device()
}

#[cfg(not(unix))]
fn takes_streams(_: fs::FileType) -> bool {
    false
}

/// Where an output goes, after a try: a temporary file beside it is made and removed. Worth
/// asking before long work.
///
/// # Errors
/// As [`output_target`]; a folder that takes no files.
pub fn check_writable(path: &Path) -> io::Result<OutputTarget> {
    let target = output_target(path)?;
    if let OutputTarget::File(file) = &target {
        Temporary::beside(file, &REGISTRY)?;
    }
    Ok(target)
}

/// Name for which [`check_folder`] makes its file.
const PROBE: &str = "output";

/// Tries whether files can be made in `folder`: a temporary one is made and removed.
///
/// # Errors
/// What making a file answers.
pub fn check_folder(folder: &Path) -> io::Result<()> {
    Temporary::beside(&folder.join(PROBE), &REGISTRY).map(drop)
}

/// Writes `bytes` to `path`. A file is written through a temporary one in the same folder, so that
/// it holds either what it held before or all of `bytes`, and keeps its permissions; one that is
/// write-protected is refused. A stream is written through.
///
/// # Errors
/// See [`check_writable`]; whatever creating, writing or renaming answers. The temporary file is
/// removed.
pub fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match output_target(path)? {
        OutputTarget::Stdout => {
            let mut stdout = io::stdout().lock();
            stdout.write_all(bytes)?;
            stdout.flush()
        }
        // Whatever was written to a descriptor before stays.
        OutputTarget::Stream(path) => OpenOptions::new().append(true).open(path)?.write_all(bytes),
        OutputTarget::File(path) => {
            let mut temporary = Temporary::beside(&path, &REGISTRY)?;
            if let Ok(metadata) = fs::metadata(&path) {
                temporary.file.set_permissions(metadata.permissions())?;
            }
            temporary.file.write_all(bytes)?;
            temporary.replace(&path)
        }
    }
}

/// For who handles an interrupt: removes every file that is half written, and lets no other be
/// begun, because the process is about to end.
pub fn remove_temporary_files() {
    REGISTRY.close();
}

/// The age after which a temporary file is taken for left behind where files cannot be locked.
const STALE_AFTER: Duration = Duration::from_secs(24 * 3600);

/// Removes from `folder` the temporary files of outputs called `names`, and of [`check_folder`],
/// whose makers were killed. Whoever writes holds a lock, so that those of other processes, on this
/// machine or another, stay. Answers how many went; what cannot be listed or removed stays.
pub fn remove_stale_temporary_files<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a OsStr>,
) -> usize {
    let starts: HashSet<String> = names
        .into_iter()
        .chain([OsStr::new(PROBE)])
        .map(temporary_start)
        .collect();
    let is_ours = |name: &OsStr| {
        let name = name.to_str().unwrap_or_default();
        let start = name.match_indices('-').nth(1).map(|(at, _)| &name[..=at]);
        name.ends_with(TEMPORARY_END) && start.is_some_and(|start| starts.contains(start))
    };
    let Ok(entries) = fs::read_dir(folder) else {
        return 0;
    };
    let ours = entries
        .flatten()
        .filter(|entry| is_ours(&entry.file_name()));
    ours.filter(|entry| left_behind(&entry.path()).is_some_and(LeftBehind::remove))
        .count()
}

/// A temporary file whose maker has ended, or has not locked it yet: then it is to find it locked or gone, and to take another
/// name, so that the lock is held until the file is removed.
struct LeftBehind {
    path: PathBuf,
    _lock: File,
}

impl LeftBehind {
    /// Removes it, if it can be; answers whether it went.
    fn remove(self) -> bool {
        fs::remove_file(&self.path).is_ok()
    }
}

/// The temporary file at `path`, if it is left behind.
fn left_behind(path: &Path) -> Option<LeftBehind> {
    // For writing: network file systems lock nothing else.
    let file = OpenOptions::new().write(true).open(path).ok()?;
    let is_left = match file.try_lock() {
        Ok(()) => true,
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => {
            let made = file.metadata().and_then(|metadata| metadata.modified());
            made.is_ok_and(|made| made.elapsed().is_ok_and(|age| age > STALE_AFTER))
        }
    };
    is_left.then(|| LeftBehind {
        path: path.to_owned(),
        _lock: file,
    })
}

/// The temporary files that are there.
struct Registry(Mutex<Temporaries>);

struct Temporaries {
    paths: Vec<PathBuf>,
    is_closed: bool,
}

static REGISTRY: Registry = Registry::new();

impl Registry {
    const fn new() -> Self {
        Registry(Mutex::new(Temporaries {
            paths: Vec::new(),
            is_closed: false,
        }))
    }

    fn lock(&self) -> MutexGuard<'_, Temporaries> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn close(&self) {
        let mut temporaries = self.lock();
        temporaries.is_closed = true;
        for path in temporaries.paths.drain(..) {
            let _ = fs::remove_file(path);
        }
    }
}

/// A file that becomes an output, or else goes when this does.
struct Temporary<'a> {
    path: PathBuf,
    file: File,
    registry: &'a Registry,
}

/// Locks the new file at `path`, so that it is not taken for left behind; whether another process has
/// done so already. Where there are no locks, none is held.
fn is_taken(file: &File, path: &Path) -> bool {
    matches!(file.try_lock(), Err(TryLockError::WouldBlock)) || path.symlink_metadata().is_err()
}

/// How temporary files of an output called `name` start: the name itself may be too long to be part
/// of another.
fn temporary_start(name: &OsStr) -> String {
    let hash = xxh3_64(name.as_encoded_bytes()) as u32;
    format!(".strandlight-{hash:08x}-")
}

const TEMPORARY_END: &str = ".tmp";

/// Most names tried; others may be taken by what a killed process left behind.
const MAX_NAMES: usize = 1000;

impl<'a> Temporary<'a> {
    /// An empty file in the folder of `path`, under a name that no one else has.
    fn beside(path: &Path, registry: &'a Registry) -> io::Result<Self> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let process = std::process::id();
        let mut temporaries = registry.lock();
        if temporaries.is_closed {
            return refused(io::ErrorKind::Interrupted, "the program was interrupted");
        }
        let start = temporary_start(path.file_name().unwrap_or_default());
        let mut error = None;
        for _ in 0..MAX_NAMES {
            let number = NEXT.fetch_add(1, Ordering::Relaxed);
            let path = path.with_file_name(format!("{start}{process}-{number}{TEMPORARY_END}"));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                // Another process took it for left behind before it was locked.
                Ok(file) if is_taken(&file, &path) => {}
                Ok(file) => {
                    temporaries.paths.push(path.clone());
                    return Ok(Temporary {
                        path,
                        file,
                        registry,
                    });
                }
                Err(taken) if taken.kind() == io::ErrorKind::AlreadyExists => error = Some(taken),
                Err(other) => {
                    error = Some(other);
                    break;
                }
            }
        }
        let error = error.unwrap_or_else(|| io::ErrorKind::AlreadyExists.into());
        let folder = path.parent().unwrap_or(path).display();
        let what = format!("the folder {folder} takes no new file: {error}");
        Err(io::Error::new(error.kind(), what))
    }

    /// Becomes the file at `path`.
    fn replace(self, path: &Path) -> io::Result<()> {
        fs::rename(&self.path, path)
    }
}

impl Drop for Temporary<'_> {
    fn drop(&mut self) {
        let mut temporaries = self.registry.lock();
        temporaries.paths.retain(|path| *path != self.path);
        // Not there any more once it has become the output.
        let _ = fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let name = |entry: io::Result<fs::DirEntry>| entry.expect("readable").file_name();
        let mut names: Vec<_> = entries
            .map(|entry| name(entry).to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn temporary_files_do_not_outlive_their_makers_or_an_interrupt() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        let registry = Registry::new();
        let out = at.join("out");
        let one = Temporary::beside(&out, &registry).expect("made");
        let two = Temporary::beside(&out, &registry).expect("made under another name");
        assert_eq!(names_in(at).len(), 2);
        drop(one);
        assert_eq!(names_in(at).len(), 1);
        registry.close();
        assert!(names_in(at).is_empty());
        let late = Temporary::beside(&out, &registry).map(|_| ());
        assert_eq!(
            late.expect_err("too late").kind(),
            io::ErrorKind::Interrupted
        );
        drop(two);
        assert!(names_in(at).is_empty());
    }

    #[test]
    fn names_left_behind_are_passed_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        let registry = Registry::new();
        let first = Temporary::beside(&at.join("out"), &registry).expect("made");
        let name = first.path.file_name().and_then(|name| name.to_str());
        let number = name.and_then(|name| name.split(['-', '.']).nth_back(1)?.parse::<u64>().ok());
        let number = number.expect("the name ends in a number");
        for next in 1..20 {
            let (start, process) = (temporary_start("out".as_ref()), std::process::id());
            let name = format!("{start}{process}-{}{TEMPORARY_END}", number + next);
            fs::write(at.join(name), "stale").expect("written");
        }
        let other = Temporary::beside(&at.join("out"), &registry).expect("made");
        assert_eq!(fs::read(&other.path).expect("there"), b"");
        drop(other);
        drop(first);
        assert_eq!(names_in(at).len(), 19);
    }

    #[test]
    fn files_of_killed_makers_go_and_those_of_others_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        let registry = Registry::new();
        let alive = Temporary::beside(&at.join("out"), &registry).expect("made");
        let left = |name: &str, end: &str| {
            let name = temporary_start(name.as_ref()) + end;
            fs::write(at.join(&name), "half").expect("written");
            name
        };
        left("out", "1-0.tmp");
        left("output", "1-0.tmp");
        let others = [
            left("other", "1-0.tmp"),
            left("out", "1-0.lights"),
            ".strandlight-x.tmp".to_owned(),
        ];
        fs::write(at.join(&others[2]), "").expect("written");
        assert_eq!(remove_stale_temporary_files(at, ["out".as_ref()]), 2);
        let names = names_in(at);
        assert_eq!(names.len(), 4, "{names:?}");
        assert!(
            others.iter().all(|other| names.contains(other)),
            "{names:?}"
        );
        drop(alive);
        assert_eq!(names_in(at).len(), 3);
        let nowhere = at.join("nowhere");
        assert_eq!(remove_stale_temporary_files(&nowhere, []), 0);
    }

    #[test]
    fn a_file_that_is_cleaned_up_before_it_is_locked_gets_another_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("fresh.tmp");
        let mut options = OpenOptions::new();
        let fresh = options.write(true).create_new(true).open(&path);
        let fresh = fresh.expect("made");
        let found = left_behind(&path).expect("nobody has locked it");
        assert!(is_taken(&fresh, &path), "it is about to go");
        assert!(found.remove());
        assert!(is_taken(&fresh, &path), "it is gone");
    }

    #[test]
    fn outputs_with_the_longest_name_are_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("n".repeat(255));
        check_writable(&path).expect("writable");
        write_file(&path, b"x").expect("written");
        assert_eq!(fs::read(&path).expect("there"), b"x");
        assert_eq!(names_in(folder.path()).len(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_permissions_stay() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        fs::create_dir(at.join("sub")).expect("a folder");
        symlink("sub/b", at.join("a")).expect("a link");
        symlink("../c", at.join("sub/b")).expect("a link");
        assert_eq!(
            output_target(&at.join("a")).expect("dangling"),
            output_target(&at.join("c")).expect("not there yet")
        );
        write_file(&at.join("a"), b"1").expect("written");
        assert_eq!(fs::read(at.join("c")).expect("the end of the links"), b"1");
        fs::set_permissions(at.join("c"), fs::Permissions::from_mode(0o640)).expect("set");
        write_file(&at.join("a"), b"2").expect("written");
        assert_eq!(fs::read(at.join("c")).expect("the end of the links"), b"2");
        for link in ["a", "sub/b"] {
            assert!(
                at.join(link)
                    .symlink_metadata()
                    .expect("there")
                    .is_symlink()
            );
        }
        let mode = fs::metadata(at.join("c"))
            .expect("there")
            .permissions()
            .mode();
        assert_eq!(mode & 0o777, 0o640);

        symlink("y", at.join("x")).expect("a link");
        symlink("x", at.join("y")).expect("a link");
        symlink("nowhere/z", at.join("z")).expect("a link");
        symlink("sub/..", at.join("up")).expect("a link");
        let before = names_in(at);
        for (name, needle) in [
            ("x", "circle"),
            ("z", "no such folder"),
            ("sub", "is a directory"),
            ("up", "is a directory"),
            ("new/", "names a folder"),
        ] {
            let error = write_file(&at.join(name), b"3")
                .expect_err(name)
                .to_string();
            assert!(error.contains(needle), "{name}: {error}");
        }
        assert_eq!(names_in(at), before);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn streams_are_written_through_and_folders_tried() {
        for path in ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"] {
            let target = output_target(Path::new(path)).expect(path);
            assert_eq!(target, OutputTarget::Stdout, "{path}");
        }
        let null = Path::new("/dev/null");
        assert!(check_writable(null).expect("a device").is_stream());
        write_file(null, b"x").expect("swallowed");
        let full = write_file(Path::new("/dev/full"), b"x").expect_err("full");
        assert_eq!(full.kind(), io::ErrorKind::StorageFull);
        let error = check_writable(Path::new("/proc/out.lights")).expect_err("no disk");
        let error = error.to_string();
        assert!(
            error.contains("the folder /proc takes no new file"),
            "{error}"
        );
    }
}
