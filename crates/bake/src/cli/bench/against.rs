//! `strandlight bench frames --against PROGRAM`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use strandlight_formats::{BakedFile, Error, Groom, LightSet, Scene, SrbfLight, write_file};
use strandlight_lab::bench::pairs::{PairedFrame, PairedScene, pair};
use strandlight_runtime::work::{self, Scratch};

use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, print_line};

/// Options of a run.
pub struct Options {
    /// Those that cost nothing.
    pub kept: Vec<OsString>,
    /// Those that decide how long it takes.
    pub costly: Vec<OsString>,
    /// The least of each of them.
    pub least: Vec<OsString>,
}

/// Runs `bench frames --json` of this build and of `program` on `scenes` in turns.
pub fn run(program: &Path, scenes: &[PathBuf], options: &Options, wants_json: bool) -> Outcome {
    let this = std::env::current_exe()
        .map_err(|error| Failure::Input(format!("the program does not know its path: {error}")))?;
    check(program, &this, scenes, options)?;
    let options = [&options.kept[..], &options.costly].concat();
    let progress = progress("runs", 4);
    let measure = |program: &Path| {
        let document = frames(program, scenes, &options)?;
        progress.advance(1);
        Ok::<_, Failure>(document)
    };
    let first = measure(&this)?;
    let other = measure(program)?;
    let other_again = measure(program)?;
    let again = measure(&this)?;
    progress.finish();
    let paired = pair([&first, &again], [&other, &other_again])
        .map_err(|error| Failure::file(program, error))?;
    if wants_json {
        return print_line(json!({
            "this": this.display().to_string(),
            "other": program.display().to_string(),
            "runs": ["this", "other", "other", "this"],
            "scenes": paired.iter().map(PairedScene::to_json).collect::<Vec<_>>(),
        }));
    }
    print_line(format_args!(
        "this build against {}; ratios above 1: this one takes less",
        program.display()
    ))?;
    paired.iter().try_for_each(print_scene)
}

fn print_scene(scene: &PairedScene) -> Outcome {
    print_line(format_args!("{}:", scene.scene))?;
    print_line(format_args!(
        "  {:46} {:>9} {:>9} {:>6}  {:>8} {:>8} {:>6}",
        "", "ms", "other", "ratio", "core-s", "other", "ratio"
    ))?;
    let ratio = |ratio: Option<f64>| ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
    let line = |frame: &PairedFrame| {
        let [ours, other] = frame.milliseconds;
        let [core, other_core] = match frame.core_seconds {
            Some(seconds) => seconds.map(|seconds| format!("{seconds:.3}")),
            None => ["-".to_owned(), "-".to_owned()],
        };
        print_line(format_args!(
            "  {:46} {ours:9.1} {other:9.1} {:>6}  {core:>8} {other_core:>8} {:>6}",
            frame.name,
            ratio(frame.ratio()),
            ratio(frame.core_seconds_ratio()),
        ))
    };
    scene.frames.iter().try_for_each(line)
}

/// Refuses, before minutes of measuring, a program that cannot be compared: it has no such command, prints something else,
/// or does not read `scenes`.
fn check(program: &Path, this: &Path, scenes: &[PathBuf], options: &Options) -> Outcome {
    let not_written = |error: &dyn std::fmt::Display| {
        Failure::Input(format!("no files to try the program with: {error}"))
    };
    let folder = Scratch::new().map_err(|error| not_written(&error))?;
    let scene = folder.join("a.toml");
    write_smallest(&folder).map_err(|error| not_written(&error))?;
    let options = [&options.kept[..], &options.least].concat();
    let tried = |program: &Path| frames(program, std::slice::from_ref(&scene), &options);
    let other = tried(program)?;
    pair([&tried(this)?; 2], [&other; 2]).map_err(|error| Failure::file(program, error))?;
    scenes.iter().try_for_each(|scene| {
        let words = ["inspect", "--json", "--quiet"].map(OsString::from);
        let words = words.into_iter().chain([scene.into()]);
        output(program, "inspect", words).map(drop)
    })
}

/// A scene of one strand and one light.
fn write_smallest(folder: &Scratch) -> strandlight_formats::Result<()> {
    let groom = Groom {
        points: vec![[0.0; 3], [0.0, -1.0, 0.0], [0.0, -2.0, 0.0]],
        strand_offsets: vec![0, 3],
        ..Groom::default()
    };
    groom.write(&folder.join("a.groom"))?;
    let lights = LightSet {
        lights: vec![SrbfLight {
            direction: [0.0, 1.0, 0.0],
            lambda: 1.0,
            rgb: [1.0; 3],
        }],
        ..LightSet::default()
    };
    lights.write(&folder.join("a.lights"))?;
    let scene = Scene::new("a.groom", "a.lights").to_toml_string()?;
    let path = folder.join("a.toml");
    write_file(&path, scene.as_bytes()).map_err(|error| Error::from(error).in_file(&path))
}

/// One run of `program`.
fn frames(program: &Path, scenes: &[PathBuf], options: &[OsString]) -> Result<Value, Failure> {
    let words = ["bench", "frames", "--json", "--quiet", "--threads"].map(OsString::from);
    let threads = rayon::current_num_threads().to_string();
    let words = words.into_iter().chain([threads.into()]);
    let words = words.chain(options.iter().cloned());
    let words = words.chain(scenes.iter().map(OsString::from));
    let printed = output(program, "bench frames --json", words)?;
    serde_json::from_slice(&printed).map_err(|error| {
        Failure::file(
            program,
            format!("`bench frames --json` is not JSON: {error}"),
        )
    })
}

/// What `program` prints for `words`, of which `command` is the part that is worth saying.
fn output(
    program: &Path,
    command: &str,
    words: impl Iterator<Item = OsString>,
) -> Result<Vec<u8>, Failure> {
    let run = work::output(Command::new(program).args(words).stdin(Stdio::null()));
    let run = run.map_err(|error| Failure::file(program, format!("cannot be run: {error}")))?;
    if run.status.success() {
        return Ok(run.stdout);
    }
    let said = String::from_utf8_lossy(&run.stderr);
    let text = format!("`{command}` failed ({}): {}", run.status, said.trim());
    Err(Failure::file(program, text))
}
