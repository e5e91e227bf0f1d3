//! What the end-to-end tests in `tests/tests/` share: the binaries, sample data, generators.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// The root of the project.
pub fn project_root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."))
}

/// A command that runs `strandlight`, built in the profile of this test.
pub fn strandlight() -> Command {
    Command::new(binary("strandlight"))
}

/// A command that runs `strandview`, built in the profile of this test.
pub fn strandview() -> Command {
    Command::new(binary("strandview"))
}

/// Cargo builds a package's binaries for that package's own tests only, so the first caller
/// builds them here, into the folder this test runs from.
fn binary(name: &str) -> PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let test = std::env::current_exe().unwrap_or_default();
        // target/<profile>/deps/<test>
        let folder = test
            .parent()
            .and_then(Path::parent)
            .unwrap_or(Path::new("."))
            .to_path_buf();
        let target = folder.parent().unwrap_or(Path::new("."));
        let profile = match folder.file_name().and_then(|name| name.to_str()) {
            Some("debug") | None => "dev",
            Some(profile) => profile,
        };
        let status = Command::new(env!("CARGO"))
            .current_dir(project_root())
            .args([
                "build",
                "--locked",
                "--quiet",
                "--bins",
                "--profile",
                profile,
            ])
            .args(["-p", "strandlight-bake", "-p", "strandlight-runtime"])
            .arg("--target-dir")
            .arg(target)
            // With it, which the times of tests want, cargo would build everything anew.
            .env_remove("RUSTC_BOOTSTRAP")
            .status();
        assert!(
            status.is_ok_and(|status| status.success()),
            "the binaries do not build"
        );
        folder
    });
    folder.join(format!("{name}{}", std::env::consts::EXE_SUFFIX))
}

/// Runs `command` and asserts that it refuses as promised: exit code 2, nothing on stdout, one
/// line on stderr that contains every one of `needles`.
pub fn assert_refused(command: &mut Command, needles: &[&str]) {
    let output = run(command);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(2),
        "{command:?} answered {stderr}"
    );
    assert!(output.stdout.is_empty(), "{command:?} wrote to stdout");
    let said: Vec<&str> = stderr.lines().collect();
    assert_eq!(
        said.len(),
        1,
        "{command:?} said more or less than one line:\n{stderr}"
    );
    for needle in needles {
        assert!(
            said[0].contains(needle),
            "{command:?} does not name {needle:?}: {stderr}"
        );
    }
}

/// Runs `command`, asserts exit code 0 and returns what it printed.
pub fn assert_done(command: &mut Command) -> String {
    let output = run(command);
    assert!(
        output.status.success(),
        "{command:?} failed:\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn run(command: &mut Command) -> Output {
    match command.output() {
        Ok(output) => output,
        Err(error) => panic!("{command:?} does not start: {error}"),
    }
}

pub mod corners;
pub mod generated;
pub mod luts;
pub mod optics;
pub mod oracle;
pub mod panoramas;
pub mod random;
pub mod render_common;
pub mod samples;
pub mod scenes;
