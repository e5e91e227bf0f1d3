//! A window of `strandview` on a display of its own (Xvfb), driven by xdotool and looked at by
//! ImageMagick's `import`. `--log` tells when something is done and where the controls are.
//!
//! These tests fail where a tool is missing: `tests/run` installs them.

mod desktop;
mod drop;
mod latency;
mod shot;

use std::fmt::Write;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

pub use desktop::{Desktop, SmallScene};
pub use latency::{EventCounter, Pointer};
use serde_json::Value;
pub use shot::{DIFFERENT, SAME, Shot};
use strandlight_tests::strandview;

/// No step of a test takes nearly as long; a step that does hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// Events of the log after which a new picture is made.
const CHANGES: [&str; 9] = [
    "stroke", "edit", "view", "undo", "redo", "reloaded", "opened", "resized", "lost",
];

/// An open window.
pub struct View<'a> {
    desktop: &'a Desktop,
    child: Child,
    log: PathBuf,
    /// X's number of the window.
    window: String,
    folder: tempfile::TempDir,
}

impl<'a> View<'a> {
    /// Opens `scene` and waits for its finished picture.
    pub fn open(desktop: &'a Desktop, scene: &Path, more: &[&str]) -> View<'a> {
        Self::open_with(desktop, scene, more, &[])
    }

    /// The same with more of an environment.
    pub fn open_with(
        desktop: &'a Desktop,
        scene: &Path,
        more: &[&str],
        environment: &[(&str, &str)],
    ) -> View<'a> {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log.json");
        let mut command = strandview();
        // Without a file it opens the sample, for somebody in the folder.
        match scene.is_dir() {
            true => command.current_dir(scene),
            // What is written without a folder comes beside it.
            false => match scene.parent() {
                Some(parent) if scene.is_absolute() => command.arg(scene).current_dir(parent),
                _ => command.arg(scene),
            },
        };
        command.arg("--log").arg(&log);
        if !more.contains(&"--size") {
            command.args(["--size", "760x480"]);
        }
        // A software driver is no GPU, and yet these tests are of the GPU's renderer.
        if !more.contains(&"--backend") {
            command.args(["--backend", "gpu"]);
        }
        command.args(more).stderr(Stdio::piped());
        let mut command = desktop.on(command);
        command.envs(environment.iter().copied());
        let child = command.spawn().expect("strandview starts");
        let mut view = View {
            desktop,
            child,
            log,
            window: String::new(),
            folder,
        };
        view.wait_for("the first picture", |events| {
            events.iter().any(|event| event["event"] == "frame")
        });
        // Its own: there may be another on the same desktop.
        let pid = view.child.id().to_string();
        let search = ["search", "--all", "--pid", &pid, "--name", "^strandview - "];
        view.window = view.tool("xdotool", &search);
        view.window = view.window.lines().next().unwrap_or_default().to_owned();
        view.tool("xdotool", &["windowfocus", "--sync", &view.window]);
        view
    }

    /// Opens the sample from within `folder`.
    pub fn open_in(desktop: &'a Desktop, folder: &Path, more: &[&str]) -> View<'a> {
        Self::open_with(desktop, folder, more, &[])
    }

    /// All lines of the log.
    pub fn events(&self) -> Vec<Value> {
        let text = std::fs::read_to_string(&self.log).unwrap_or_default();
        // The last line may be half written.
        text.lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .collect()
    }

    /// Where the document was saved last.
    pub fn saved(&self) -> Option<PathBuf> {
        let events = self.events();
        let saved = events.iter().rfind(|event| event["event"] == "saved")?;
        Some(PathBuf::from(saved["path"].as_str()?))
    }

    /// How often the log has `event`.
    pub fn count(&self, event: &str) -> usize {
        let events = self.events();
        events.iter().filter(|line| line["event"] == event).count()
    }

    /// Waits until the log is as `is_so` wants.
    pub fn wait_for(&mut self, what: &str, is_so: impl Fn(&[Value]) -> bool) {
        let start = Instant::now();
        while !is_so(&self.events()) {
            if let Ok(Some(status)) = self.child.try_wait() {
                let mut said = String::new();
                let stderr = self.child.stderr.take();
                stderr.map(|mut pipe| pipe.read_to_string(&mut said));
                panic!("strandview ended ({status}) before {what}: {said}");
            }
            if start.elapsed() > PATIENCE {
                let mut log = String::new();
                for event in self.events().iter().rev().take(8) {
                    let _ = writeln!(log, "{event}");
                }
                panic!("no {what}; the log ends with\n{log}");
            }
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// Does something that the log tells of as `event`, and waits until its picture is finished
    /// and nothing else happens.
    pub fn after(&mut self, event: &str, act: impl FnOnce(&mut Self)) {
        let before = self.count(event);
        act(self);
        self.wait_for(event, |events| {
            events.iter().filter(|line| line["event"] == event).count() > before
        });
        self.settle();
    }

    /// Waits until the picture of the last change is finished, and a moment without another.
    pub fn settle(&mut self) {
        let last_change = |events: &[Value]| {
            let is_change = |line: &Value| CHANGES.iter().any(|change| line["event"] == *change);
            events.iter().rposition(is_change)
        };
        loop {
            self.wait_for("a finished picture", |events| {
                let rest = &events[last_change(events).unwrap_or(0)..];
                rest.iter().any(|line| line["event"] == "frame")
            });
            let before = last_change(&self.events());
            std::thread::sleep(Duration::from_millis(300));
            if last_change(&self.events()) == before {
                return;
            }
        }
    }

    /// Runs a tool on this display; answers what it printed.
    pub fn tool(&self, name: &str, arguments: &[&str]) -> String {
        let mut command = self.desktop.on(Command::new(name));
        let output = command.args(arguments).output();
        let output = output.unwrap_or_else(|error| panic!("window tests need {name}: {error}"));
        assert!(
            output.status.success(),
            "{name} {arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    }

    /// Left, top, right and bottom of a control in pixels of the window.
    pub fn place(&self, name: &str) -> [i32; 4] {
        let events = self.events();
        let places = events.iter().rev().find(|line| line["event"] == "places");
        let places = &places.expect("places are logged")["places"];
        let corner = |ix: usize| places[name][ix].as_f64();
        match [corner(0), corner(1), corner(2), corner(3)] {
            [Some(left), Some(top), Some(right), Some(bottom)] => {
                [left, top, right, bottom].map(|x| x as i32)
            }
            _ => panic!("no control {name:?} among {places}"),
        }
    }

    /// Is the control on screen?
    pub fn has_place(&self, name: &str) -> bool {
        let events = self.events();
        let places = events.iter().rev().find(|line| line["event"] == "places");
        places.is_some_and(|places| !places["places"][name].is_null())
    }

    /// The middle of a control.
    pub fn middle(&self, name: &str) -> [i32; 2] {
        let [left, top, right, bottom] = self.place(name);
        [(left + right) / 2, (top + bottom) / 2]
    }

    pub fn move_to(&self, [x, y]: [i32; 2]) {
        let (x, y) = (x.to_string(), y.to_string());
        self.tool("xdotool", &["mousemove", "--window", &self.window, &x, &y]);
        pause();
    }

    /// The mouse over this window, for measurements.
    pub fn pointer(&self) -> Pointer {
        let window = self.window.parse().expect("X's number");
        Pointer::over(&self.desktop.display, window)
    }

    /// [`View::count`], for measurements.
    pub fn counter(&self, event: &str) -> EventCounter {
        EventCounter::new(&self.log, event)
    }

    pub fn click(&self, place: [i32; 2]) {
        self.move_to(place);
        self.tool("xdotool", &["mousedown", "1"]);
        pause();
        self.tool("xdotool", &["mouseup", "1"]);
        pause();
    }

    /// Drags with a mouse button in a few steps, as a hand does: each is seen before the next.
    pub fn drag(&self, button: u8, from: [i32; 2], by: [i32; 2]) {
        let button = button.to_string();
        self.move_to(from);
        self.tool("xdotool", &["mousedown", &button]);
        pause();
        for step in 1..=4 {
            let moves = |view: &Self| view.count("edit") + view.count("view");
            let before = moves(self);
            self.move_to([from[0] + by[0] * step / 4, from[1] + by[1] * step / 4]);
            // The first few pixels may be no drag yet, and strokes are no edits until they end.
            let start = Instant::now();
            while moves(self) == before && start.elapsed() < Duration::from_millis(700) {
                pause();
            }
        }
        self.tool("xdotool", &["mouseup", &button]);
        pause();
    }

    pub fn key(&self, key: &str) {
        self.tool("xdotool", &["key", "--clearmodifiers", key]);
        pause();
    }

    /// Clicks a number, types another and enters it.
    pub fn type_number(&self, name: &str, value: &str) {
        let place = format!("{name} number");
        let middle = self.middle(&place);
        self.move_to(middle);
        self.until_drawn(&place, |view| view.click(middle));
        self.until_drawn(&place, |view| {
            view.key("ctrl+a");
            view.tool("xdotool", &["type", "--delay", "40", value]);
        });
        pause();
        self.key("Return");
    }

    /// Does something and waits until a control looks another way for it.
    pub fn until_drawn(&self, name: &str, act: impl FnOnce(&Self)) {
        let look = || {
            let [left, top, right, bottom] = self.place(name).map(|x| x as usize);
            self.shot().cut([left, top], [right - left, bottom - top])
        };
        let before = look();
        act(self);
        let start = Instant::now();
        while look() == before {
            assert!(start.elapsed() < PATIENCE, "{name} looks as before");
            pause();
        }
    }

    /// Does something of which the window hears all at once, as it does after a slow frame.
    pub fn in_one_frame(&self, act: impl FnOnce(&Self)) {
        let pid = self.child.id().to_string();
        self.tool("kill", &["-STOP", &pid]);
        act(self);
        self.tool("kill", &["-CONT", &pid]);
    }

    /// Seconds of processor time that the program has used.
    pub fn processor_seconds(&self) -> f64 {
        let path = format!("/proc/{}/stat", self.child.id());
        let stat = std::fs::read_to_string(path).expect("it runs");
        // After the name, which may hold blanks: the 12th and 13th field.
        let rest = stat.rsplit(')').next().unwrap_or_default();
        let ticks = rest.split_whitespace().skip(11).take(2);
        let ticks: u64 = ticks
            .map(|field| field.parse::<u64>().expect("ticks"))
            .sum();
        // USER_HZ is 100 on every Linux.
        ticks as f64 / 100.0
    }

    /// Asserts that the window makes no frame and uses no processor while there is no input.
    pub fn assert_at_rest(&self, what: &str) {
        // The last frames that were asked for may take a while on a busy machine.
        let start = Instant::now();
        let mut frames = usize::MAX;
        while frames != self.count("drawn") {
            assert!(start.elapsed() < PATIENCE, "{what}: it never rests");
            frames = self.count("drawn");
            std::thread::sleep(Duration::from_secs(3));
        }
        let before = (self.count("drawn"), self.processor_seconds());
        std::thread::sleep(Duration::from_secs(5));
        let frames = self.count("drawn") - before.0;
        let seconds = self.processor_seconds() - before.1;
        println!("{what}: {frames} frames, {seconds:.2} s of the processor in 5 s");
        assert_eq!(frames, 0, "{what}: frames without a cause");
        // A spinning window takes seconds; looking at the scene's files once a second nothing.
        assert!(seconds < 0.25, "{what}: {seconds} s of the processor");
    }

    /// Drags files over the window and drops them there.
    pub fn drop_files(&self, files: &[&Path]) {
        let window = self.window.parse().expect("X's number");
        drop::files(&self.desktop.display, window, files);
    }

    /// Waits until the log has `event` more often than `before`.
    pub fn wait_for_next(&mut self, event: &str, before: usize) {
        self.wait_for(event, |events| {
            events.iter().filter(|line| line["event"] == event).count() > before
        });
    }

    /// Does something after which the window asks `question`, and waits until it is drawn.
    pub fn asked(&mut self, question: &str, act: impl FnOnce(&mut Self)) {
        let before = self.count("question");
        act(self);
        self.wait_for_next("question", before);
        let events = self.events();
        let at = events.iter().rposition(|line| line["event"] == "question");
        assert_eq!(events[at.expect("there")]["name"], question);
        // The frame that asked may not show it yet.
        self.wait_for("the question on screen", |events| {
            let rest = events.iter().rev();
            let since = rest.take_while(|line| line["event"] != "question");
            since.filter(|line| line["event"] == "drawn").count() >= 2
        });
        pause();
    }

    /// Clicks a button of a question and waits until the question is gone.
    pub fn answer(&mut self, button: &str) {
        let place = format!("{button} button");
        self.click(self.middle(&place));
        self.wait_until_gone(&place);
    }

    /// Waits until a control is no longer on screen.
    pub fn wait_until_gone(&mut self, place: &str) {
        self.wait_for("the end of a question", |events| {
            let at = events.iter().rposition(|line| line["event"] == "places");
            let rest = at.map_or(&[][..], |at| &events[at..]);
            let is_gone = |line: &Value| line["places"][place].is_null();
            rest.first().is_some_and(is_gone) && rest.iter().any(|line| line["event"] == "drawn")
        });
    }

    /// Waits until a control is on screen.
    pub fn wait_for_place(&mut self, place: &str) {
        self.wait_for(place, |events| {
            let at = events.iter().rposition(|line| line["event"] == "places");
            let rest = at.map_or(&[][..], |at| &events[at..]);
            let is_there = |line: &Value| !line["places"][place].is_null();
            rest.first().is_some_and(is_there) && rest.iter().any(|line| line["event"] == "drawn")
        });
        pause();
    }

    /// Gives the window the keyboard.
    pub fn focus(&self) {
        self.tool("xdotool", &["windowfocus", "--sync", &self.window]);
        pause();
    }

    /// Types a path over the one in the field, and enters it.
    pub fn type_path(&self, path: &Path) {
        self.key("ctrl+a");
        self.tool(
            "xdotool",
            &["type", "--delay", "20", &path.to_string_lossy()],
        );
        pause();
        self.key("Return");
    }

    pub fn window(&self, verb: &str) {
        self.tool("xdotool", &[verb, "--sync", &self.window]);
    }

    pub fn resize(&self, width: u32, height: u32) {
        let (width, height) = (width.to_string(), height.to_string());
        self.tool("xdotool", &["windowsize", &self.window, &width, &height]);
    }

    pub fn title(&self) -> String {
        self.tool("xdotool", &["getwindowname", &self.window])
    }

    /// The whole window.
    pub fn shot(&self) -> Shot {
        let path = self.folder.path().join("shot.ppm");
        let file = format!("ppm:{}", path.display());
        self.tool("import", &["-window", &self.window, "-depth", "8", &file]);
        let bytes = std::fs::read(&path).expect("import writes it");
        if let Some(folder) = std::env::var_os("STRANDLIGHT_KEEP_SHOTS") {
            shot::keep(Path::new(&folder), &path);
        }
        Shot::from_ppm(&bytes)
    }

    /// The picture once the mouse, and what is drawn around it, is elsewhere.
    pub fn without_mouse(&self) -> Shot {
        let before = self.count("drawn");
        // Two places: the mouse may be at one of them already.
        self.move_to([3, 3]);
        self.move_to([2, 2]);
        let start = Instant::now();
        let mut frames = before;
        // A frame without the mouse, and the one after it in which everything has its place.
        while frames < before + 2 || frames != self.count("drawn") {
            assert!(start.elapsed() < PATIENCE, "the window does not rest");
            frames = self.count("drawn");
            std::thread::sleep(Duration::from_millis(400));
        }
        self.picture()
    }

    /// The picture of the hair alone.
    pub fn picture(&self) -> Shot {
        let [left, top, right, bottom] = self.place("View").map(|x| x as usize);
        self.shot().cut([left, top], [right - left, bottom - top])
    }

    /// Closes it without saving; asserts that it ended well.
    pub fn close(mut self) {
        self.key("ctrl+q");
        std::thread::sleep(Duration::from_millis(200));
        assert_eq!(self.count("error"), 0, "{:?}", self.events().last());
        self.ended();
    }

    /// Closes it and leaves its changes unsaved; asserts that it ended well.
    pub fn close_unsaved(mut self) {
        self.asked("unsaved", |view| view.key("ctrl+q"));
        let place = "Don't save button";
        self.click(self.middle(place));
        assert_eq!(self.count("error"), 0, "{:?}", self.events().last());
        self.ended();
    }

    /// Sends it a signal that ends it; answers its exit code, and what it said on standard error.
    pub fn end_by(mut self, signal: &str) -> (Option<i32>, String) {
        let pid = self.child.id().to_string();
        self.tool("kill", &[signal, &pid]);
        let status = self.status();
        let mut said = String::new();
        let stderr = self.child.stderr.take();
        stderr.map(|mut pipe| pipe.read_to_string(&mut said));
        (status.code(), said)
    }

    /// Waits for the end and asserts that it was a good one.
    pub fn ended(&mut self) {
        let status = self.status();
        assert!(status.success(), "{status}");
    }

    /// Waits for the end.
    fn status(&mut self) -> ExitStatus {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Ok(Some(status)) = self.child.try_wait() {
                return status;
            }
            std::thread::sleep(Duration::from_millis(30));
        }
        panic!("strandview does not end");
    }

    pub fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for View<'_> {
    fn drop(&mut self) {
        // What the window looked like when the test failed.
        if std::thread::panicking() && std::env::var_os("STRANDLIGHT_KEEP_SHOTS").is_some() {
            let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.shot()));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Longer than a frame of a small scene: the next event is in another frame.
fn pause() {
    std::thread::sleep(Duration::from_millis(60));
}
