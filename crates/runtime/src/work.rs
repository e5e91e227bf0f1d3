//! Long work beside the window: how far it is, how it is stopped, and the program `strandlight`, which
//! does what a lean viewer has no code for.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Long work that can be watched and stopped from another thread.
#[derive(Debug, Default)]
pub struct Work {
    /// Per mille done, plus one; 0 where that is not known.
    share: AtomicU32,
    is_stopped: AtomicBool,
    child: SharedChild,
}

/// A program that runs, for those who wait for it and those who end it.
type SharedChild = Arc<Mutex<Option<Child>>>;

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
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
        match lock(&self.child).as_mut() {
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
        let spawned = STARTED.spawn(&mut command, &self.child);
        let (stdout, stderr) = match spawned {
            Ok(Some(pipes)) => pipes,
            Ok(None) => return Err(WorkError::Stopped),
            Err(source) => {
                return Err(WorkError::Program {
                    what: what.to_owned(),
                    program,
                    source,
                });
            }
        };
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
        waited_for(&self.child).is_ok_and(|status| status.success())
    }
}

/// Waits for a program whose pipes are closed.
fn waited_for(place: &SharedChild) -> std::io::Result<ExitStatus> {
    loop {
        {
            let mut child = lock(place);
            match child.as_mut().map(Child::try_wait) {
                // It ends now. Held open, the lock would keep `stop` out.
                Some(Ok(None)) => {}
                Some(answer) => {
                    *child = None;
                    return answer.and_then(|status| {
                        status.ok_or_else(|| std::io::ErrorKind::NotFound.into())
                    });
                }
                None => return Err(std::io::ErrorKind::NotFound.into()),
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Runs a program to its end, as [`Command::output`], but that [`end_all`] ends it too.
///
/// # Errors
/// What the system answers; `Interrupted` once this process is about to end.
pub fn output(command: &mut Command) -> std::io::Result<Output> {
    let place = SharedChild::default();
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let Some((stdout, stderr)) = STARTED.spawn(command, &place)? else {
        return Err(std::io::ErrorKind::Interrupted.into());
    };
    let read = |mut pipe: Option<Box<dyn Read + Send>>| {
        let mut bytes = Vec::new();
        pipe.as_mut().map(|pipe| pipe.read_to_end(&mut bytes));
        bytes
    };
    // In a thread, so that neither pipe fills up while the other is read.
    let said = stderr.map(|pipe| Box::new(pipe) as Box<dyn Read + Send>);
    let said = std::thread::spawn(move || read(said));
    let printed = read(stdout.map(|pipe| Box::new(pipe) as Box<dyn Read + Send>));
    let stderr = said.join().unwrap_or_default();
    let status = waited_for(&place);
    // Who ended it may have been this process: then it ends here, and nobody reports that the program failed.
    drop(lock(&STARTED.0));
    Ok(Output {
        status: status?,
        stdout: printed,
        stderr,
    })
}

/// Asks a program to end.
#[cfg(unix)]
fn end(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process};
    // Of one that has ended the number may be another's by now. SIGKILL would leave its temporary files.
    if let Ok(None) = child.try_wait() {
        let _ = kill_process(Pid::from_child(child), Signal::TERM);
    }
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
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let name = format!("strandview-{}-{number}", std::process::id());
            let folder = std::env::temp_dir().join(name);
            match STARTED.make_folder(&folder) {
                // That of another machine or container, which shares the disk.
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
                made => return made.map(|()| Scratch(folder)),
            }
        }
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
        STARTED.remove_folder(&self.0);
    }
}

/// Folders that were made for outputs: in the end those go that nothing was written to.
#[derive(Debug)]
#[must_use = "what is not held removes the folders at once"]
pub struct NewFolders(Vec<PathBuf>);

impl NewFolders {
    /// Makes `folder` and those above it that are not there.
    ///
    /// # Errors
    /// What the system answers.
    pub fn make(folder: &Path) -> std::io::Result<NewFolders> {
        let missing = folder.ancestors();
        let missing = missing.take_while(|path| !path.as_os_str().is_empty() && !path.exists());
        // From the deepest up, as they can be removed.
        let made = NewFolders(missing.map(Path::to_owned).collect());
        std::fs::create_dir_all(folder)?;
        Ok(made)
    }

    /// Lets them stay, empty or not: another process may be about to write there.
    pub fn keep(&mut self) {
        self.0.clear();
    }
}

impl Drop for NewFolders {
    fn drop(&mut self) {
        for folder in &self.0 {
            // Only an empty one can be removed.
            let _ = std::fs::remove_dir(folder);
        }
    }
}

/// For an interrupt: ends the programs that run for this process, removes its folders and what it has half
/// written, and lets nothing else be begun, because the process is about to end.
pub fn end_all() {
    strandlight_formats::remove_temporary_files();
    STARTED.close();
}

/// What is done at an interrupt before [`end_all`], while files can still be written.
type LastAct = Box<dyn FnOnce() + Send>;

static LAST_ACT: Mutex<Option<LastAct>> = Mutex::new(None);

/// Has `act` called once at an interrupt, in place of what was given before, before programs end and files can no longer be
/// written: see [`end_all_when_interrupted`], which tells where it never is.
pub fn before_interrupted_end(act: impl FnOnce() + Send + 'static) {
    *lock(&LAST_ACT) = Some(Box::new(act));
}

/// Calls what [`before_interrupted_end`] was given, and [`end_all`], at SIGINT, SIGTERM and SIGHUP and ends the process, with the
/// exit code that a shell gives to those signals. Where no handler can be installed, and on Windows, they end it as ever.
pub fn end_all_when_interrupted() {
    #[cfg(unix)]
    {
        use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
        let mut ending = vec![SIGINT, SIGTERM];
        if !ignores_closed_terminals() {
            ending.push(SIGHUP);
        }
        let Ok(mut signals) = signal_hook::iterator::Signals::new(ending) else {
            return;
        };
        std::thread::spawn(move || {
            // At once: graphics drivers do not take it well when the process exits under them.
            let exit = |signal| signal_hook::low_level::exit(128 + signal);
            let mut signals = signals.forever();
            if let Some(signal) = signals.next() {
                std::thread::spawn(move || {
                    let act = lock(&LAST_ACT).take();
                    if let Some(act) = act {
                        act();
                    }
                    end_all();
                    exit(signal);
                });
            }
            // Who asks twice does not wait for programs and disks.
            if let Some(signal) = signals.next() {
                exit(signal);
            }
        });
    }
}

/// Whether this process was started to outlive its terminal, as `nohup` does: SIGHUP is ignored. Only Linux tells; elsewhere
/// SIGHUP ends the process, or does not, as if there were no handler.
#[cfg(unix)]
fn ignores_closed_terminals() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mut lines = status.lines();
    let ignored = lines.find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    // SIGHUP is signal 1, the lowest bit.
    ignored.is_none_or(|mask| mask & 1 != 0)
}

/// The programs that run and the folders that are there.
struct Registry(Mutex<Started>);

struct Started {
    children: Vec<SharedChild>,
    folders: Vec<PathBuf>,
    is_closed: bool,
}

static STARTED: Registry = Registry::new();

/// Standard output and standard error of a program.
type Pipes = (Option<ChildStdout>, Option<ChildStderr>);

/// How long a program that is asked to end may take.
const END_PATIENCE: Duration = Duration::from_secs(2);

impl Registry {
    const fn new() -> Self {
        Registry(Mutex::new(Started {
            children: Vec::new(),
            folders: Vec::new(),
            is_closed: false,
        }))
    }

    /// Starts a program; `None` once the process is about to end.
    fn spawn(&self, command: &mut Command, place: &SharedChild) -> std::io::Result<Option<Pipes>> {
        let mut started = lock(&self.0);
        if started.is_closed {
            return Ok(None);
        }
        let mut child = command.spawn()?;
        let pipes = (child.stdout.take(), child.stderr.take());
        *lock(place) = Some(child);
        started.children.retain(|child| lock(child).is_some());
        started.children.push(place.clone());
        Ok(Some(pipes))
    }

    fn make_folder(&self, folder: &Path) -> std::io::Result<()> {
        let mut started = lock(&self.0);
        if started.is_closed {
            return Err(std::io::ErrorKind::Interrupted.into());
        }
        std::fs::create_dir(folder)?;
        started.folders.push(folder.to_owned());
        Ok(())
    }

    fn remove_folder(&self, folder: &Path) {
        lock(&self.0).folders.retain(|path| path != folder);
        // What cannot be removed now, the system removes later.
        let _ = std::fs::remove_dir_all(folder);
    }

    fn close(&self) {
        let mut started = lock(&self.0);
        started.is_closed = true;
        for child in &started.children {
            let _ = lock(child).as_mut().map(end);
        }
        let start = Instant::now();
        for child in started.children.drain(..) {
            // Its folder goes after it, or it would make it again.
            while is_running(&child) {
                if start.elapsed() > END_PATIENCE {
                    if let Some(child) = lock(&child).as_mut() {
                        let _ = child.kill();
                        let _ = child.wait();
                    }
                    break;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
        }
        for folder in started.folders.drain(..) {
            let _ = std::fs::remove_dir_all(folder);
        }
        // Who waited for a program would report that it failed: it waits on, for this lock, until the process ends.
        std::mem::forget(started);
    }
}

fn is_running(child: &SharedChild) -> bool {
    let mut child = lock(child);
    matches!(child.as_mut().map(Child::try_wait), Some(Ok(None)))
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

    #[test]
    fn new_folders_go_unless_they_are_used_or_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let (old, deep) = (folder.path().join("a"), folder.path().join("a/b/c"));
        std::fs::create_dir(&old).expect("made");
        drop(NewFolders::make(&deep).expect("made"));
        assert!(old.is_dir() && !old.join("b").exists());
        let made = NewFolders::make(&deep).expect("made");
        std::fs::write(old.join("b/file"), "").expect("written");
        drop(made);
        assert!(old.join("b/file").is_file() && !deep.exists());
        NewFolders::make(&deep).expect("made").keep();
        assert!(deep.is_dir());
    }
}
