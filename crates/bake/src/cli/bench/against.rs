//! `strandlight bench frames --against PROGRAM`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};
use strandlight_lab::bench::pairs::{PairedFrame, PairedScene, pair};

use crate::cli::progress::progress;
use crate::cli::{Failure, Outcome, print_line};

/// Runs `bench frames --json` of this build and of `program` on `scenes`, with `options`, in turns.
pub fn run(program: &Path, scenes: &[PathBuf], options: &[OsString], wants_json: bool) -> Outcome {
    let this = std::env::current_exe()
        .map_err(|error| Failure::Input(format!("the program does not know its path: {error}")))?;
    let progress = progress("runs", 4);
    let measure = |program: &Path| {
        let document = frames(program, scenes, options)?;
        progress.advance(1);
        Ok::<_, Failure>(document)
    };
    let paired = |this: [&Value; 2], other: [&Value; 2]| {
        pair(this, other).map_err(|error| Failure::file(program, error))
    };
    let first = measure(&this)?;
    let other = measure(program)?;
    // Another shape is known before the rest is measured.
    paired([&first; 2], [&other; 2])?;
    let other_again = measure(program)?;
    let again = measure(&this)?;
    progress.finish();
    let paired = paired([&first, &again], [&other, &other_again])?;
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

/// One run of `program`.
fn frames(program: &Path, scenes: &[PathBuf], options: &[OsString]) -> Result<Value, Failure> {
    let run = Command::new(program)
        .args(["bench", "frames", "--json", "--quiet", "--threads"])
        .arg(rayon::current_num_threads().to_string())
        .args(options)
        .args(scenes)
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .output();
    let run = run.map_err(|error| Failure::file(program, format!("cannot be run: {error}")))?;
    if !run.status.success() {
        let said = String::from_utf8_lossy(&run.stderr);
        let text = format!(
            "`bench frames --json` failed ({}): {}",
            run.status,
            said.trim()
        );
        return Err(Failure::file(program, text));
    }
    serde_json::from_slice(&run.stdout).map_err(|error| {
        Failure::file(
            program,
            format!("`bench frames --json` is not JSON: {error}"),
        )
    })
}
