//! What happens to a window while it is open, and where none can be opened.

mod window_common;

use std::time::Duration;

use strandlight_tests::{assert_refused, strandview};
use window_common::{Desktop, SmallScene, View};

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
    view.after("edit", |view| view.type_number("Index eta", "1.9"));
    let mine = view.count("reloaded");
    std::fs::write(&scene.path, SmallScene::text("")).expect("it can be written");
    std::thread::sleep(Duration::from_millis(1600));
    assert_eq!(view.count("reloaded"), mine);
    view.after("reloaded", |view| view.key("ctrl+r"));
    view.picture().assert_same(&start);
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
    command
        .env("VK_DRIVER_FILES", "/nowhere")
        .env("VK_ICD_FILENAMES", "/nowhere");
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
