//! Long work beside the window: how far it is, how it is stopped, and the program `strandlight`, which
//! does what a lean viewer has no code for.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Long work that can be watched and stopped from another thread.
#[derive(Debug, Default)]
pub struct Work {
    /// Per mille done, plus one; 0 where that is not known.
    share: AtomicU32,
    is_stopped: AtomicBool,
    child: Mutex<Option<Child>>,
}

/// Work of `strandlight` that did not end well.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorkError {
    /// There is no such program.
    #[error(
        "{what} needs the program strandlight, beside strandview or in PATH: {} cannot be run: {source}",
        program.display()
    )]
    Program {
        /// What it was wanted for.
        what: String,
        /// Where it was looked for.
        program: PathBuf,
        /// What the system answered.
        source: std::io::Error,
    },
    /// It said why it failed.
    #[error("{0}")]
    Failed(String),
    /// It was stopped by [`Work::stop`].
    #[error("stopped")]
    Stopped,
}

impl Work {
    /// The share that is done, 0..=1; `None` where that is not known.
    pub fn share(&self) -> Option<f32> {
        let share = self.share.load(Ordering::Relaxed).checked_sub(1)?;
        Some(share as f32 / 1000.0)
    }

    /// Notes how far it is.
    pub fn reach(&self, share: f32) {
        let per_mille = (1000.0 * share.clamp(0.0, 1.0)) as u32;
        self.share.store(per_mille + 1, Ordering::Relaxed);
    }

    /// Stops it as soon as it can be: a program is asked to end, which takes away what it has half written, and ended if it is
    /// stopped once more (on Windows at once); other work ends at its next step.
    pub fn stop(&self) {
        let was_stopped = self.is_stopped.swap(true, Ordering::Relaxed);
        let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        match child.as_mut() {
            // One that has ended cannot be stopped.
            Some(child) if was_stopped => {
                let _ = child.kill();
            }
            Some(child) => end(child),
            None => {}
        }
    }

    /// Goes on, unless it was stopped.
    ///
    /// # Errors
    /// [`WorkError::Stopped`].
    pub fn check(&self) -> Result<(), WorkError> {
        match self.is_stopped.load(Ordering::Relaxed) {
            true => Err(WorkError::Stopped),
            false => Ok(()),
        }
    }

    /// Runs `strandlight` to its end and answers the last line that it prints. `what` is what for, in
    /// words that "needs" can follow.
    ///
    /// # Errors
    /// [`WorkError`].
    pub fn strandlight<S: AsRef<OsStr>>(
        &self,
        what: &str,
        arguments: impl IntoIterator<Item = S>,
    ) -> Result<String, WorkError> {
        let program = program();
        let mut command = Command::new(&program);
        command.args(arguments).stdin(Stdio::null());
        self.run(what, command, program)
    }

    fn run(&self, what: &str, mut command: Command, program: PathBuf) -> Result<String, WorkError> {
        self.check()?;
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let spawned = command.spawn();
        let mut child = spawned.map_err(|source| WorkError::Program {
            what: what.to_owned(),
            program,
            source,
        })?;
        let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
        *self.child.lock().unwrap_or_else(PoisonError::into_inner) = Some(child);
        // It may have been stopped before there was something to kill.
        if self.check().is_err() {
            self.stop();
        }
        // In a thread, so that neither pipe fills up while the other is read.
        let printed = std::thread::spawn(move || {
            let mut text = String::new();
            let _ = stdout.map(|mut pipe| pipe.read_to_string(&mut text));
            text
        });
        let mut last = String::new();
        for line in stderr
            .into_iter()
            .flat_map(|pipe| BufReader::new(pipe).lines())
        {
            let Ok(line) = line else { break };
            match percent(&line) {
                Some(share) => self.reach(share),
                None if !line.trim().is_empty() => last = line,
                None => {}
            }
        }
        let printed = printed.join().unwrap_or_default();
        let is_good = self.ended();
        self.check()?;
        if is_good {
            let last = printed.lines().rev().find(|line| !line.trim().is_empty());
            return Ok(last.unwrap_or_default().to_owned());
        }
        let said = last.trim_start_matches("strandlight: ").trim();
        Err(WorkError::Failed(match said {
            "" => format!("{what}: strandlight failed and did not say why"),
            said => said.to_owned(),
        }))
    }

    /// Waits for the program; did it end well?
    fn ended(&self) -> bool {
        loop {
            {
                let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
                match child.as_mut().map(Child::try_wait) {
                    // Its pipes are closed: it ends now. Held open, the lock would keep `stop` out.
                    Some(Ok(None)) => {}
                    Some(Ok(Some(status))) => {
                        *child = None;
                        return status.success();
                    }
                    Some(Err(_)) | None => {
                        *child = None;
                        return false;
                    }
                }
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Asks a program to end.
#[cfg(unix)]
fn end(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process};
    // SIGKILL would leave its temporary files.
    let _ = kill_process(Pid::from_child(child), Signal::TERM);
}

/// Ends a program: it cannot be asked to.
#[cfg(not(unix))]
fn end(child: &mut Child) {
    let _ = child.kill();
}

/// The share in a line like `fitting lights: 25%`.
fn percent(line: &str) -> Option<f32> {
    let (_, number) = line.trim().strip_suffix('%')?.rsplit_once(' ')?;
    Some(number.trim().parse::<f32>().ok()? / 100.0)
}

/// `strandlight` beside this program, or the one in PATH.
fn program() -> PathBuf {
    let name = format!("strandlight{}", std::env::consts::EXE_SUFFIX);
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name(&name));
    match beside {
        Some(beside) if beside.is_file() => beside,
        _ => PathBuf::from(name),
    }
}

/// A folder for files on the way, removed in the end.
#[derive(Debug)]
pub struct Scratch(PathBuf);

impl Scratch {
    /// A new folder below the system's folder for such files.
    ///
    /// # Errors
    /// What the system answers.
    pub fn new() -> std::io::Result<Scratch> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("strandview-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder)?;
        Ok(Scratch(folder))
    }

    /// A file in it.
    pub fn join(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed now, the system removes later.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    fn shell(line: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", line]);
        command
    }

    #[test]
    #[cfg(unix)]
    fn programs_are_watched_and_their_last_words_are_kept() {
        let work = Work::default();
        assert_eq!(work.share(), None);
        let line = "echo fitting lights: 25% >&2; echo fitting lights: 75% >&2; echo a; echo done";
        let said = work
            .run("a fit", shell(line), PathBuf::new())
            .expect("it runs");
        assert_eq!((said.as_str(), work.share()), ("done", Some(0.75)));
        let line = "echo strandlight: studio.exr: is no map >&2; exit 2";
        let error = work
            .run("a fit", shell(line), PathBuf::new())
            .expect_err("it fails");
        assert_eq!(error.to_string(), "studio.exr: is no map");
        let missing = Command::new("/nowhere/strandlight");
        let error = work.run("a fit", missing, "/nowhere/strandlight".into());
        let error = error.expect_err("it is not there").to_string();
        assert!(
            error.starts_with("a fit needs the program strandlight"),
            "{error}"
        );
    }

    #[test]
    #[cfg(unix)]
    fn work_is_stopped_at_once() {
        let work = std::sync::Arc::new(Work::default());
        let other = work.clone();
        let start = std::time::Instant::now();
        let running =
            std::thread::spawn(move || other.run("a fit", shell("exec sleep 60"), PathBuf::new()));
        std::thread::sleep(Duration::from_millis(100));
        work.stop();
        let answer = running.join().expect("no panic");
        assert!(matches!(answer, Err(WorkError::Stopped)), "{answer:?}");
        assert!(start.elapsed() < Duration::from_secs(30));
    }

    #[test]
    #[cfg(unix)]
    fn stopped_programs_take_away_what_they_have_half_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let half = folder.path().join("half");
        let line = format!(
            "trap 'rm \"{0}\"; exit 143' TERM; : > \"{0}\"; echo writing: 50% >&2; while :; do sleep 0.01; done",
            half.display()
        );
        let work = std::sync::Arc::new(Work::default());
        let other = work.clone();
        let running =
            std::thread::spawn(move || other.run("a picture", shell(&line), PathBuf::new()));
        while work.share() != Some(0.5) && !running.is_finished() {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(half.is_file());
        work.stop();
        let answer = running.join().expect("no panic");
        assert!(matches!(answer, Err(WorkError::Stopped)), "{answer:?}");
        assert!(!half.exists());
    }
}
