//! What a command puts on standard output and standard error, and into files.
//!
//! Standard output holds one thing: results in words, or one JSON document (`--json`), or the bytes
//! of an output named `-`. Which one is a property of the whole command line, so it is kept here,
//! and no command has to ask.

use std::collections::HashSet;
use std::fmt;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;
use strandlight_formats::{
    GROOM_FORMATS, GroomFormat, OutputTarget, Scene, TakenFiles, check_folder, output_target,
    write_file,
};
use strandlight_runtime::work::NewFolders;

use super::{Failure, Outcome, note};

/// Standard output, in messages.
pub const STDOUT: &str = "standard output";

/// `--json` is on the command line.
static WANTS_JSON: AtomicBool = AtomicBool::new(false);
/// An output goes to standard output, so results in words do not.
static HOLDS_FILE: AtomicBool = AtomicBool::new(false);
/// Something was printed on standard output: with `--json`, the document.
static HAS_PRINTED: AtomicBool = AtomicBool::new(false);

/// Says that standard output is to hold one JSON document.
pub fn want_json() {
    WANTS_JSON.store(true, Ordering::Relaxed);
}

/// Prints a line of the result on stdout, or on stderr if stdout holds an output; a closed pipe is
/// no error.
pub fn print_line(line: impl fmt::Display) -> Outcome {
    print_while_read(line).map(|_| ())
}

/// As [`print_line`]; answers whether stdout is still read, for commands that do nothing but print.
pub fn print_while_read(line: impl fmt::Display) -> Result<bool, Failure> {
    try_print(line).map_err(|error| Failure::file(Path::new(STDOUT), error))
}

/// As [`print_while_read`], for commands that tell errors of the system apart.
pub fn try_print(line: impl fmt::Display) -> io::Result<bool> {
    if HOLDS_FILE.load(Ordering::Relaxed) {
        note!("{line}");
        return Ok(true);
    }
    HAS_PRINTED.store(true, Ordering::Relaxed);
    match writeln!(io::stdout().lock(), "{line}") {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(error),
    }
}

/// Says on stderr why the command failed, and with `--json` on stdout as well, unless the command
/// has printed its document. The exit code tells it too, so a closed or full stream is no error.
pub fn print_failure(failure: &Failure) {
    let _ = writeln!(io::stderr(), "strandlight: {failure}");
    if WANTS_JSON.load(Ordering::Relaxed) && !HAS_PRINTED.load(Ordering::Relaxed) {
        let document = json!({ "error": {
            "message": failure.to_string(),
            "kind": failure.kind(),
            "exit_code": failure.exit_code(),
        }});
        let _ = writeln!(io::stdout().lock(), "{document}");
    }
}

/// Whether `path` is a pipe, a device or standard output, whose name need not end in a format.
pub fn is_stream(path: &Path) -> bool {
    output_target(path).is_ok_and(|target| target.is_stream())
}

/// Refuses a name that promises another format than `extension`. A stream promises none.
pub fn check_extension(path: &Path, extension: &str) -> Outcome {
    match path.extension() {
        Some(found) if found.eq_ignore_ascii_case(extension) => Ok(()),
        _ if is_stream(path) => Ok(()),
        _ => {
            let what = format!("the name must end in .{extension}");
            Err(Failure::file(path, what))
        }
    }
}

/// Extensions of files that commands here read, ours first, besides those of hair.
const KNOWN_EXTENSIONS: [&str; 20] = [
    "groom", "lights", "mesh", "panorama", "tables", "toml", "csv", "cube", "exr", "glb", "gltf",
    "hdr", "html", "jpeg", "jpg", "json", "npy", "obj", "ply", "png",
];

/// Extensions that hair has and much else, which promise nothing.
const ANY_EXTENSIONS: [&str; 3] = ["bin", "data", "txt"];

/// Is a file of that name known, and none of those with these `extensions`?
fn promises_another(path: &Path, extensions: &[&str]) -> bool {
    let Some(found) = path.extension().and_then(|found| found.to_str()) else {
        return false;
    };
    let is = |other: &&str| found.eq_ignore_ascii_case(other);
    let is_of_hair = |format: &&dyn GroomFormat| format.info().extensions.iter().any(is);
    let is_known = KNOWN_EXTENSIONS.iter().any(is) || GROOM_FORMATS.iter().any(is_of_hair);
    is_known && !extensions.iter().chain(&ANY_EXTENSIONS).any(is)
}

/// Refuses a name that promises another file than one of ours with `extension`. Names of no promise are taken.
pub fn check_own_extension(path: &Path, extension: &str) -> Outcome {
    match promises_another(path, &[extension]) {
        true => check_extension(path, extension),
        false => Ok(()),
    }
}

/// The same of a report, a page or JSON.
pub fn check_report_extension(path: &Path) -> Outcome {
    if promises_another(path, &["html", "json"]) && !is_stream(path) {
        let what = "the name must end in .html or .json";
        return Err(Failure::file(path, what));
    }
    Ok(())
}

/// Refuses, before any work is done, outputs that cannot be written, that are one file, or that
/// are an input.
pub fn check_outputs(inputs: &[&Path], outputs: &[&Path]) -> Outcome {
    let mut targets = HashSet::with_capacity(outputs.len());
    let mut folders = HashSet::new();
    let mut taken = TakenFiles::default();
    taken.add(inputs, "an input");
    for path in outputs {
        let cannot = |error| Failure::file(path, format!("cannot be written: {error}"));
        let target = output_target(path).map_err(cannot)?;
        let refused = |what: &str| Err(Failure::file(path, what));
        if let Some(what) = taken.refusal(&target) {
            return refused(&what);
        }
        match &target {
            // What a device takes is gone, so it may be named twice.
            OutputTarget::Stream(file) if file.starts_with("/dev") => {}
            _ if targets.contains(&target) => return refused("is named for two outputs"),
            OutputTarget::Stdout if WANTS_JSON.load(Ordering::Relaxed) => {
                return refused("is standard output, where --json prints; name a file");
            }
            OutputTarget::Stdout => HOLDS_FILE.store(true, Ordering::Relaxed),
            OutputTarget::File(file) => {
                let folder = file.parent().unwrap_or(file).to_owned();
                if !folders.contains(&folder) {
                    check_folder(&folder).map_err(cannot)?;
                    folders.insert(folder);
                }
            }
            OutputTarget::Stream(_) => {}
        }
        targets.insert(target);
    }
    Ok(())
}

/// Refuses outputs that are a file that `scene` names.
pub fn check_not_of_scene(scene: &Scene, outputs: &[&Path]) -> Outcome {
    let mut taken = TakenFiles::default();
    taken.add(scene.file_paths(), "a file of the scene");
    check_not_taken(&taken, outputs)
}

/// Refuses outputs that are `taken`.
pub fn check_not_taken(taken: &TakenFiles, outputs: &[&Path]) -> Outcome {
    for path in outputs {
        if let Some(what) = output_target(path)
            .ok()
            .and_then(|target| taken.refusal(&target))
        {
            return Err(Failure::file(path, what));
        }
    }
    Ok(())
}

/// A folder for outputs, made if it is not there.
pub fn output_folder(folder: &Path) -> Result<NewFolders, Failure> {
    let refused = |what: &str| Err(Failure::file(folder, what));
    if folder == Path::new("-") {
        return refused("is standard output, and several files are written; name a folder");
    }
    // Asked once: another shard may make it at the same time.
    let is_other = |data: fs::Metadata| !data.is_symlink() && !data.is_dir();
    if folder.symlink_metadata().is_ok_and(is_other) {
        return refused("is not a folder, and several files are written; name a folder");
    }
    let made = NewFolders::make(folder)
        .map_err(|error| Failure::file(folder, format!("cannot be made: {error}")))?;
    check_folder(folder).map_err(|error| Failure::file(folder, error))?;
    Ok(made)
}

/// Writes a file whole or not at all, or bytes to a stream.
pub fn write_output(path: &Path, bytes: &[u8]) -> Outcome {
    write_file(path, bytes)
        .map_err(|error| Failure::file(path, format!("cannot be written: {error}")))
}
