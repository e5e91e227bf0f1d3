//! Sessions of random input: whatever is pressed, clicked, dragged and typed, the window lives, answers,
//! and saves what it shows.
//!
//! `STRANDLIGHT_SESSION_SECONDS` has each of the three sizes take longer than 12 s,
//! `STRANDLIGHT_SESSION_SEED` another way, and `STRANDLIGHT_SESSION_BACKEND=gpu` the GPU's renderer.

use std::fmt::Debug;
use std::path::Path;
use std::str::FromStr;
use std::time::{Duration, Instant};

use strandlight_formats::Scene;
use strandlight_scattering::random::SplitMix64;
use strandlight_tests::{assert_done, strandview};

use crate::window_common::{Desktop, SmallScene, View};
use crate::window_cpu::png;

/// The value of an environment variable, or `plain`.
fn setting<T: FromStr<Err: Debug>>(name: &str, plain: T) -> T {
    match std::env::var(name) {
        Ok(value) => value
            .parse()
            .unwrap_or_else(|error| panic!("{name}: {error:?}")),
        Err(_) => plain,
    }
}

/// Keys that do something, but for that which closes the window.
const KEYS: [&str; 45] = [
    "ctrl+z",
    "ctrl+shift+z",
    "ctrl+y",
    "ctrl+shift+s",
    "ctrl+s",
    "ctrl+o",
    "ctrl+r",
    "f",
    "Home",
    "v",
    "alt+Left",
    "alt+Right",
    "1",
    "ctrl+1",
    "3",
    "ctrl+3",
    "7",
    "ctrl+7",
    "shift+p",
    "p",
    "ctrl+shift+c",
    "ctrl+shift+v",
    "k",
    "x",
    "w",
    "g",
    "n",
    "Tab",
    "b",
    "bracketright",
    "bracketleft",
    "space",
    "h",
    "F1",
    "Escape",
    "Escape",
    "Return",
    "Up",
    "Down",
    "BackSpace",
    "Delete",
    "ctrl+a",
    "ctrl+c",
    "ctrl+v",
    "shift+Tab",
];

/// What people type into fields, and what they should not.
const WORDS: [&str; 10] = [
    "0.5", "1,6", "2*0.8", "1.6mm", "-3", "1e9", "nan", "abc", "50%", "../x",
];

struct Session {
    random: SplitMix64,
    size: [i32; 2],
    /// What was done, newest last.
    done: Vec<String>,
}

impl Session {
    fn pick<'a, T: ?Sized>(&mut self, from: &[&'a T]) -> &'a T {
        from[(self.random.next_u64() % from.len() as u64) as usize]
    }

    fn place(&mut self) -> [i32; 2] {
        self.size
            .map(|side| self.random.uniform(0.0, f64::from(side)) as i32)
    }

    /// One thing that a user may do.
    fn step(&mut self, view: &View) {
        let [x, y] = self.place();
        let at = format!("{x},{y}");
        let did = match self.random.next_u64() % 16 {
            0..5 => {
                view.tool("xdotool", &["mousemove", &x.to_string(), &y.to_string()]);
                let button = self.pick(&["1", "1", "1", "1", "2", "3"]);
                view.tool("xdotool", &["click", button]);
                format!("click {button} at {at}")
            }
            5..9 => {
                let [to_x, to_y] = self.place();
                let button = self.pick(&["1", "1", "2", "3"]);
                view.tool("xdotool", &["mousemove", &x.to_string(), &y.to_string()]);
                view.tool("xdotool", &["mousedown", button]);
                for step in 1..=3 {
                    let [x, y] = [x + (to_x - x) * step / 3, y + (to_y - y) * step / 3];
                    view.tool("xdotool", &["mousemove", &x.to_string(), &y.to_string()]);
                }
                view.tool("xdotool", &["mouseup", button]);
                format!("drag {button} from {at} to {to_x},{to_y}")
            }
            9..13 => {
                let key = self.pick(&KEYS);
                view.tool("xdotool", &["key", key]);
                format!("key {key}")
            }
            13 => {
                let word = self.pick(&WORDS);
                view.tool("xdotool", &["type", "--delay", "5", "--", word]);
                format!("type {word}")
            }
            14 => {
                view.tool("xdotool", &["mousemove", &x.to_string(), &y.to_string()]);
                let button = self.pick(&["4", "5"]);
                view.tool("xdotool", &["click", "--repeat", "3", button]);
                format!("wheel {button} at {at}")
            }
            _ => {
                view.tool("xdotool", &["mousemove", &x.to_string(), &y.to_string()]);
                view.tool("xdotool", &["click", "--repeat", "2", "--delay", "40", "1"]);
                format!("double click at {at}")
            }
        };
        self.done.push(did);
    }

    /// The last of what was done.
    fn tail(&self) -> &[String] {
        &self.done[self.done.len().saturating_sub(25)..]
    }
}

/// Puts everything away that lies over the picture or changes it, but is no edit.
fn put_away(view: &mut View) {
    for button in ["Cancel job button", "Cancel button"] {
        if view.has_place(button) {
            view.click(view.middle(button));
        }
    }
    for _ in 0..4 {
        view.key("Escape");
    }
    if view.has_place("Keep my changes button") {
        view.click(view.middle("Keep my changes button"));
    }
    for (place, key) in [("Ground truth", "g"), ("Wipe line", "w")] {
        if view.has_place(place) {
            view.key(key);
        }
    }
    let is_inspected = |view: &View| {
        let events = view.events();
        let last = events.iter().rfind(|event| event["event"] == "inspect");
        last.is_some_and(|event| !event["inspection"].is_null())
    };
    for _ in 0..10 {
        if !is_inspected(view) {
            break;
        }
        // However busy the machine is: a second one would go on to the first of what can be shown.
        let before = view.count("inspect");
        view.key("n");
        let start = Instant::now();
        while view.count("inspect") == before && start.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

fn session(size: [u32; 2], seed: u64) {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let text = format!("{}x{}", size[0], size[1]);
    let backend = setting("STRANDLIGHT_SESSION_BACKEND", "cpu".to_owned());
    let more = ["--size", &text, "--backend", &backend];
    let mut view = View::open(&desktop, &scene.path, &more);
    let mut session = Session {
        random: SplitMix64(seed),
        size: size.map(|side| side as i32),
        done: Vec::new(),
    };
    let duration = Duration::from_secs(setting("STRANDLIGHT_SESSION_SECONDS", 12));
    let start = Instant::now();
    while start.elapsed() < duration {
        session.step(&view);
        if !view.is_running() {
            // Closed from the menu: only that ends well.
            println!("closed after {:?}", session.done.last());
            view.ended();
            view = View::open(&desktop, &scene.path, &more);
        }
    }
    put_away(&mut view);
    let is_alive = view.is_running();
    assert!(
        is_alive,
        "seed {seed}: it ended after {:#?}",
        session.tail()
    );
    for event in view.events().iter().filter(|it| it["event"] == "error") {
        println!("refused: {}", event["message"]);
    }
    // It answers, and what it saves is what it shows.
    let before = view.count("saved");
    view.key("ctrl+s");
    std::thread::sleep(Duration::from_millis(500));
    put_away(&mut view);
    println!(
        "seed {seed}, {text}: {} steps, {} edits, {} saved",
        session.done.len(),
        view.count("edit"),
        view.count("saved") - before
    );
    let saved = view.saved().unwrap_or(scene.path.clone());
    let document = Scene::read(&saved).expect("what was saved is a scene");
    if document.motion.is_some() {
        // It may be anywhere by now.
        println!("the hair moves");
        return;
    }
    view.after("resized", |view| view.resize(1000, 700));
    view.after("view", |view| {
        view.key("1");
        view.key("Home");
    });
    let shown = view.without_mouse();
    let frame = saved.with_file_name("frame.png");
    let _ = std::fs::remove_file(&frame);
    render(&saved, &backend, [shown.width, shown.height], &frame);
    let difference = png(&frame).difference(&shown);
    if let Some(folder) = std::env::var_os("STRANDLIGHT_KEEP_SHOTS") {
        let name = format!("saved-{seed}.png");
        std::fs::copy(&frame, Path::new(&folder).join(name)).expect("the folder is there");
    }
    if difference >= crate::window_common::SAME {
        let scene = std::fs::read_to_string(&saved).expect("readable");
        panic!(
            "seed {seed}: what is saved differs by {difference} after {:#?}\n{scene}",
            session.tail()
        );
    }
}

fn render(scene: &Path, backend: &str, [width, height]: [usize; 2], to: &Path) {
    let mut command = strandview();
    let size = format!("{width}x{height}");
    command
        .arg(scene)
        .args(["--backend", backend, "--size", &size]);
    assert_done(command.arg("--frame").arg(to));
}

#[test]
fn random_input_in_a_wide_window_is_survived_and_saved() {
    session([1280, 720], setting("STRANDLIGHT_SESSION_SEED", 1));
}

#[test]
fn random_input_in_a_small_window_is_survived_and_saved() {
    session([760, 480], setting("STRANDLIGHT_SESSION_SEED", 2));
}

#[test]
fn random_input_in_a_narrow_window_is_survived_and_saved() {
    session([390, 844], setting("STRANDLIGHT_SESSION_SEED", 3));
}
