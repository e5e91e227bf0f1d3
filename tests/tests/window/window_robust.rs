//! What happens to a window while it is open, and where none can be opened.

use std::time::Duration;

use crate::window_common::{Desktop, SmallScene, View};
use strandlight_tests::{assert_done, assert_refused, strandlight, strandview};

#[test]
fn a_window_can_be_made_tiny_and_large_again() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    for (width, height) in [(1, 1), (348, 20), (40, 400), (2, 900)] {
        view.resize(width, height);
        std::thread::sleep(Duration::from_millis(250));
        assert!(view.is_running(), "{width}x{height}");
    }
    view.after("resized", |view| view.resize(760, 480));
    view.picture().assert_same(&start);
    view.after("resized", |view| view.resize(900, 480));
    let [left, _, right, _] = view.place("View");
    assert_eq!(right - left, 900 - 348);
    view.close();
}

#[test]
fn a_scene_that_changes_on_disk_is_shown_and_a_broken_one_is_not() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    let dark = SmallScene::text("sigma_a = [6.0, 6.0, 6.0]");
    view.after("reloaded", |_| {
        std::fs::write(&scene.path, &dark).expect("it can be written");
    });
    let changed = view.picture();
    changed.assert_different(&start);

    std::fs::write(&scene.path, "version = 1\n[groom\n").expect("it can be written");
    view.wait_for("error", |events| {
        events.iter().any(|e| e["event"] == "error")
    });
    std::thread::sleep(Duration::from_millis(400));
    assert!(view.is_running());
    // The message takes a strip off the picture; the rest still shows hair.
    assert!(view.picture().contrast() > 5.0);

    view.after("reloaded", |_| {
        std::fs::write(&scene.path, &dark).expect("it can be written");
    });
    view.picture().assert_same(&changed);

    // With changes here, nothing is lost without being asked.
    view.after("edit", |view| view.type_number("IOR", "1.9"));
    let mine = view.count("reloaded");
    std::fs::write(&scene.path, SmallScene::text("")).expect("it can be written");
    std::thread::sleep(Duration::from_millis(1600));
    assert_eq!(view.count("reloaded"), mine);
    view.after("reloaded", |view| view.key("ctrl+r"));
    view.picture().assert_same(&start);
}

#[test]
fn a_finished_picture_is_left_alone() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.without_mouse();
    view.settle();
    view.assert_at_rest("opened");
    // After an edit, with the mouse and a brush over the hair.
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.key("b");
    view.move_to(view.middle("View"));
    view.assert_at_rest("painting");
    view.key("b");
    view.window("windowunmap");
    view.assert_at_rest("unmapped");
    // A scene that changes meanwhile is refined to the end by itself, seen or not.
    view.window("windowmap");
    view.window("windowfocus");
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    let long = SmallScene::text("").replace("samples = 8", "samples = 64");
    view.after("reloaded", |_| {
        std::fs::write(&scene.path, long).expect("it can be written");
    });
    assert!(view.title().ends_with("done"), "{}", view.title());
    view.move_to([2, 2]);
    view.assert_at_rest("refined");
}

#[test]
fn unsaved_edits_and_changes_on_disk_are_both_kept_until_the_user_decides() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    view.after("edit", |view| view.type_number("IOR", "1.9"));
    let theirs = SmallScene::text("eta = 1.45");
    std::fs::write(&scene.path, &theirs).expect("it can be written");
    let on_disk = || std::fs::read_to_string(&scene.path).expect("it is there");
    // Saving at the end does not write over what was not looked at.
    view.asked("unsaved", |view| view.key("ctrl+q"));
    view.asked("overwrite", |view| {
        view.click(view.middle("Save and close button"));
    });
    assert_eq!(on_disk(), theirs);
    view.answer("Cancel");
    assert!(view.is_running());
    assert_eq!((view.count("saved"), on_disk()), (0, theirs));
    view.asked("overwrite", |view| view.key("ctrl+s"));
    // A click while the question fades is lost.
    view.answer("Overwrite");
    view.wait_for_next("saved", 0);
    assert_eq!(scene.read().hair.eta, 1.9);
    // Once decided, it is not asked again.
    view.after("edit", |view| view.type_number("IOR", "1.8"));
    std::fs::write(&scene.path, SmallScene::text("")).expect("it can be written");
    view.wait_for("the notice", |events| {
        let places = events.iter().rev().find(|line| line["event"] == "places");
        places.is_some_and(|places| !places["places"]["Keep my changes button"].is_null())
    });
    view.click(view.middle("Keep my changes button"));
    let questions = view.count("question");
    view.key("ctrl+s");
    view.wait_for_next("saved", 1);
    assert_eq!(view.count("question"), questions);
    assert_eq!(scene.read().hair.eta, 1.8);
    view.close();
}

#[test]
fn dropped_files_are_opened_swapped_or_refused_by_name() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    let dark = SmallScene::text("sigma_a = [6.0, 6.0, 6.0]");
    std::fs::write(at("dark.toml"), dark).expect("it can be written");
    std::fs::write(at("broken.toml"), "version = 1\n[groom\n").expect("it can be written");
    std::fs::write(at("notes.txt"), "hair").expect("it can be written");
    let mut groom = strandlight();
    groom.args(["groom", "generate", "--style", "bob", "--strands", "200"]);
    groom.args(["--points-per-strand", "6", "-o"]);
    assert_done(groom.arg(at("bob.groom")));

    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.without_mouse();
    for (name, needle) in [("notes.txt", "notes.txt"), ("broken.toml", "broken.toml")] {
        let errors = view.count("error");
        view.drop_files(&[&at(name)]);
        view.wait_for_next("error", errors);
        let events = view.events();
        let error = events.iter().rev().find(|line| line["event"] == "error");
        let message = error.map(|line| line["message"].to_string());
        assert!(
            message.is_some_and(|text| text.contains(needle)),
            "{error:?}"
        );
    }
    assert!(view.title().contains("small.toml"), "{}", view.title());

    // Another groom under the same look is an edit.
    view.after("edit", |view| view.drop_files(&[&at("bob.groom")]));
    let bob = view.without_mouse();
    bob.assert_different(&start);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.after("redo", |view| view.key("ctrl+y"));

    // Another scene is opened, not before it is clear what becomes of the edits here.
    view.asked("unsaved", |view| view.drop_files(&[&at("dark.toml")]));
    view.answer("Cancel");
    view.without_mouse().assert_same(&bob);
    view.asked("unsaved", |view| view.drop_files(&[&at("dark.toml")]));
    view.after("opened", |view| view.answer("Don't save"));
    assert!(view.title().contains("dark.toml - "), "{}", view.title());
    let dark = view.without_mouse();
    dark.assert_different(&bob);
    view.after("opened", |view| view.drop_files(&[&scene.path]));
    view.without_mouse().assert_same(&start);
    assert_eq!(scene.read().groom.file.to_str(), Some("small.groom"));
}

#[test]
fn a_lost_device_is_opened_again() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    drop(view);
    view = View::open(&desktop, &scene.path, &["--lose-device"]);
    view.wait_for("lost", |events| events.iter().any(|e| e["event"] == "lost"));
    view.settle();
    view.picture().assert_same(&start);
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.picture().assert_different(&start);
}

#[test]
fn a_dense_screen_gets_a_picture_of_its_pixels() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let dense = [("WINIT_X11_SCALE_FACTOR", "2")];
    let size = ["--size", "1520x960"];
    let mut view = View::open_with(&desktop, &scene.path, &size, &dense);
    let [left, top, right, bottom] = view.place("View");
    // Twice the points of the panel, bar and status.
    assert_eq!([left, right], [0, 1520 - 2 * 348]);
    assert_eq!([top, bottom], [2 * 32, 960 - 2 * 24]);
    let start = view.picture();
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.picture().assert_different(&start);
}

/// No Vulkan driver, wherever this runs.
const NO_DRIVER: [(&str, &str); 2] = [
    ("VK_DRIVER_FILES", "/nowhere"),
    ("VK_ICD_FILENAMES", "/nowhere"),
];

#[test]
fn without_a_driver_the_cpu_draws() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let auto = ["--backend", "auto"];
    let mut view = View::open_with(&desktop, &scene.path, &auto, &NO_DRIVER);
    let events = view.events();
    let line = events.iter().find(|event| event["event"] == "renderer");
    let line = line.expect("the renderer is logged");
    assert_eq!(line["name"], "cpu");
    let reason = line["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("no GPU adapter"), "{reason}");
    let start = view.without_mouse();
    assert!(start.contrast() > 10.0, "the picture shows nothing");
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.without_mouse().assert_different(&start);
}

#[test]
fn without_a_display_or_a_driver_one_line_says_what_to_do() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut command = strandview();
    command
        .arg(&scene.path)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    assert_refused(&mut command, &["display", "--frame"]);

    let mut command = strandview();
    command.arg(&scene.path);
    let mut command = desktop.on(command);
    command.args(["--backend", "gpu"]);
    command.envs(NO_DRIVER);
    assert_refused(&mut command, &["adapter", "--backend cpu"]);

    let mut command = strandview();
    command.arg(scene.folder.path().join("missing.toml"));
    assert_refused(&mut desktop.on(command), &["missing.toml"]);

    let broken = scene.folder.path().join("broken.toml");
    let text = SmallScene::text("").replace("small.groom", "gone.groom");
    std::fs::write(&broken, text).expect("it can be written");
    let mut command = strandview();
    command.arg(&broken);
    assert_refused(&mut desktop.on(command), &["gone.groom"]);
}

/// Processes that `pid` started and that run.
fn children_of(pid: u32) -> Vec<String> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).expect("it runs");
    let children = threads.flatten().map(|thread| {
        let list = std::fs::read_to_string(thread.path().join("children"));
        list.unwrap_or_default()
    });
    let all: String = children.collect();
    all.split_whitespace().map(str::to_owned).collect()
}

#[test]
fn a_signal_ends_what_the_window_has_begun_too() {
    let (desktop, folder) = (Desktop::start(), tempfile::tempdir().expect("a folder"));
    // A map whose fit takes longer than this test.
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1024 +X 2048\n".to_vec();
    map.extend((0..1024 * 2048u32).flat_map(|ix| [90, (ix / 7) as u8, (ix / 4096) as u8, 128]));
    let path = folder.path().join("sky.hdr");
    std::fs::write(&path, map).expect("written");
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let temporary = tempfile::tempdir().expect("a folder");
        let n_left = || std::fs::read_dir(temporary.path()).map_or(0, Iterator::count);
        let mut command = strandview();
        command.arg(&path).args(["--backend", "cpu"]);
        let mut command = desktop.on(command);
        command.env("TMPDIR", temporary.path());
        let mut view = command.spawn().expect("it starts");
        let start = std::time::Instant::now();
        let mut children = Vec::new();
        while children.is_empty() || n_left() == 0 {
            assert!(start.elapsed().as_secs() < 60, "no fit is begun");
            std::thread::sleep(std::time::Duration::from_millis(20));
            children = children_of(view.id());
        }
        let pid = view.id().to_string();
        let sent = std::process::Command::new("kill")
            .args([signal, &pid])
            .status();
        assert!(sent.is_ok_and(|status| status.success()));
        assert_eq!(view.wait().expect("it ends").code(), Some(code));
        assert_eq!(n_left(), 0, "{signal}: its folder stays");
        for child in children {
            let there = std::path::Path::new("/proc").join(&child);
            assert!(!there.exists(), "{signal}: process {child} runs on");
        }
    }
}

#[test]
fn a_signal_keeps_unsaved_work_beside_the_scene_and_the_next_start_says_so() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    let n_files = || std::fs::read_dir(scene.folder.path()).map_or(0, Iterator::count);
    let before = std::fs::read(&scene.path).expect("it is there");
    let cpu = ["--backend", "cpu"];
    // What is saved needs no other file.
    let view = View::open(&desktop, &scene.path, &cpu);
    assert_eq!(view.end_by("-TERM"), (Some(143), String::new()));
    assert_eq!(n_files(), 3);
    for (signal, code, name, eta) in [
        ("-INT", 130, "small-recovery.toml", 1.9),
        ("-TERM", 143, "small-recovery-2.toml", 1.8),
    ] {
        let mut view = View::open(&desktop, &scene.path, &cpu);
        view.after("edit", |view| {
            view.type_number("IOR", &eta.to_string());
        });
        // A question that is open is not waited for.
        view.asked("unsaved", |view| view.key("ctrl+q"));
        let (ended, said) = view.end_by(signal);
        assert_eq!(ended, Some(code), "{said}");
        let file = at(name).display().to_string();
        assert!(said.contains(&file) && said.lines().count() == 1, "{said}");
        let kept = strandlight_formats::Scene::read(at(name)).expect("a scene");
        assert_eq!(kept.hair.eta, eta);
        assert_eq!(std::fs::read(&scene.path).expect("it is there"), before);
        // The next start tells of it.
        let view = View::open(&desktop, &scene.path, &cpu);
        let events = view.events();
        let found = events.iter().find(|event| event["event"] == "recovery");
        assert_eq!(found.expect("it is told")["path"], file);
        view.close();
    }
    assert_eq!(n_files(), 5);
    // It is opened as any scene, and what is saved later makes it old.
    let mut view = View::open(&desktop, &at("small-recovery-2.toml"), &cpu);
    assert_eq!(view.count("recovery"), 0);
    view.after("opened", |view| view.drop_files(&[&scene.path]));
    assert_eq!(view.count("recovery"), 1);
    view.after("edit", |view| view.type_number("IOR", "1.7"));
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    view.close();
    let view = View::open(&desktop, &scene.path, &cpu);
    assert_eq!(view.count("recovery"), 0);
    view.close();
}

#[test]
fn a_signal_keeps_unsaved_work_of_a_scene_without_a_file() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let groom = scene.folder.path().join("small.groom");
    std::fs::remove_file(&scene.path).expect("removed");
    let mut view = View::open(&desktop, &groom, &["--backend", "cpu"]);
    let middle = view.middle("View");
    // A stroke that is being made is kept too.
    view.key("b");
    view.move_to(middle);
    view.tool("xdotool", &["mousedown", "1"]);
    view.move_to([middle[0] + 30, middle[1]]);
    view.move_to([middle[0] + 60, middle[1]]);
    view.wait_for_next("drawn", view.count("drawn"));
    let (code, said) = view.end_by("-INT");
    assert_eq!(code, Some(130), "{said}");
    let path = scene.folder.path().join("small-recovery.toml");
    assert!(said.contains(&path.display().to_string()), "{said}");
    assert!(!scene.path.exists());
    let mut again = View::open(&desktop, &path, &["--backend", "cpu"]);
    assert_eq!(again.count("recovery"), 0);
    let kept = strandlight_formats::Scene::read(&path).expect("a scene");
    assert!(kept.groom_path().ends_with("small-recovery-painted.groom"));
    assert!(again.is_running());
}
