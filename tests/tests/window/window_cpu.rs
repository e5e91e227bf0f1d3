//! The window with the CPU renderer: the same edits, and no work at rest.

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;
use strandlight_tests::{assert_done, project_root, strandview};

use crate::window_common::{Desktop, SAME, Shot, SmallScene, View};

const CPU: [&str; 2] = ["--backend", "cpu"];

/// The `renderer` line of the log: its name, and why it was taken.
fn renderer(view: &View) -> [String; 2] {
    let events = view.events();
    let line = events.iter().find(|event| event["event"] == "renderer");
    let line = line.expect("the renderer is logged");
    ["name", "reason"].map(|key| line[key].as_str().unwrap_or_default().to_owned())
}

/// Milliseconds from the last `event` of the log to the frame that shows it.
fn latency(view: &View, event: &str) -> f64 {
    let events = view.events();
    let at = events.iter().rposition(|line| line["event"] == event);
    let rest = &events[at.expect("it is logged")..];
    let drawn = rest.iter().find(|line| line["event"] == "drawn");
    let ms = |line: &Value| line["ms"].as_f64().unwrap_or(f64::NAN);
    ms(drawn.expect("it is drawn")) - ms(&rest[0])
}

pub fn png(path: &Path) -> Shot {
    let bytes = std::fs::read(path).expect("a picture");
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes))
        .read_info()
        .expect("a PNG");
    let mut buffer = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut buffer).expect("a PNG");
    let channels = info.color_type.samples();
    let texels = buffer[..info.buffer_size()].chunks_exact(channels);
    Shot {
        width: info.width as usize,
        height: info.height as usize,
        rgb: texels.flat_map(|texel| texel[..3].to_vec()).collect(),
    }
}

#[test]
fn the_cpu_follows_edits_views_strokes_and_sizes() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let [name, reason] = renderer(&view);
    assert_eq!(name, "cpu");
    assert!(reason.contains("--backend cpu"), "{reason}");
    assert!(
        view.title().ends_with("small.toml - done"),
        "{}",
        view.title()
    );
    let start = view.without_mouse();
    assert!(start.contrast() > 10.0, "the picture shows nothing");

    // A slider.
    let slider = view.middle("IOR slider");
    view.after("edit", |view| view.drag(1, slider, [25, 0]));
    println!("slider to pixels: {:.1} ms", latency(&view, "edit"));
    assert!(view.without_mouse().difference(&start) > 2.0 * SAME);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);

    // The view.
    let middle = view.middle("View");
    view.after("view", |view| view.drag(1, middle, [60, 20]));
    println!("orbit to pixels: {:.1} ms", latency(&view, "view"));
    view.without_mouse().assert_different(&start);
    view.after("view", |view| view.key("Home"));
    view.without_mouse().assert_same(&start);

    // A stroke.
    let [left, top, right, bottom] = view.place("View");
    let from = [left + (right - left) / 3, (top + bottom) / 2];
    view.key("b");
    view.after("stroke", |view| view.drag(1, from, [(right - left) / 3, 0]));
    view.key("b");
    let painted = view.without_mouse();
    assert!(painted.difference(&start) > 2.0 * SAME);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);

    // Another size and back: the picture has as many pixels as there is room for.
    view.after("resized", |view| view.resize(900, 560));
    let large = view.without_mouse();
    assert_eq!([large.width, large.height], [900 - 348, 560 - 32 - 24]);
    assert!(large.contrast() > 10.0, "the picture shows nothing");
    view.after("resized", |view| view.resize(760, 480));
    view.without_mouse().assert_same(&start);

    // A picture as a file is what is on screen, and what is drawn without a window.
    view.key("p");
    view.wait_for_next("picture", 0);
    let kept = png(&scene.folder.path().join("small-001.png"));
    kept.assert_same(&start);
    let frame = scene.folder.path().join("frame.png");
    let size = format!("{}x{}", start.width, start.height);
    let mut command = strandview();
    command.arg(&scene.path).args(CPU).args(["--size", &size]);
    let said = assert_done(command.arg("--frame").arg(&frame));
    assert!(said.contains("visibility list"), "{said}");
    png(&frame).assert_same(&start);

    // So it is where it was asked for before it was finished.
    view.after("picture", |view| {
        view.drag(1, middle, [60, 20]);
        view.key("p");
    });
    let turned = view.without_mouse();
    turned.assert_different(&start);
    png(&scene.folder.path().join("small-002.png")).assert_same(&turned);
    view.close();
}

#[test]
fn a_finished_picture_of_the_cpu_is_left_alone() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.assert_at_rest("opened");
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.move_to(view.middle("View"));
    view.assert_at_rest("edited");
}

/// Of the last line on ground truth: samples and expected error.
fn truth(events: &[Value]) -> Option<(u64, Option<f64>)> {
    let line = events.iter().rfind(|event| event["event"] == "truth")?;
    Some((line["samples"].as_u64()?, line["relative_error"].as_f64()))
}

#[test]
fn the_finished_picture_goes_on_to_ground_truth_on_both_renderers() {
    for backend in ["cpu", "gpu"] {
        let (desktop, scene) = (Desktop::start(), SmallScene::new());
        let mut view = View::open(&desktop, &scene.path, &["--backend", backend]);
        let fast = view.without_mouse();

        view.key("g");
        let is_traced = |events: &[Value]| truth(events).is_some_and(|(samples, _)| samples >= 8);
        view.wait_for("8 samples", is_traced);
        assert!(view.has_place("Ground truth"), "the status line tells");
        let (samples, error) = truth(&view.events()).expect("traced");
        let error = error.expect("an error");
        assert!(error > 0.0 && error < 0.5, "{backend}: {samples}, {error}");
        // The mouse is elsewhere, and the window makes frames as long as it traces.
        let traced = view.picture();
        assert!(traced.difference(&fast) > SAME, "{backend}: nothing shows");

        // Looking from elsewhere goes back to fast pictures, which are traced in turn.
        let middle = view.middle("View");
        view.drag(1, middle, [60, 20]);
        let is_back = |events: &[Value]| {
            let view = events.iter().rposition(|event| event["event"] == "view");
            let rest = view.map_or(&[][..], |view| &events[view..]);
            let lines = rest.iter().filter(|event| event["event"] == "truth");
            let mut samples = lines.filter_map(|line| line["samples"].as_u64());
            // From the start again.
            samples.find(|&samples| samples > 0) == Some(2)
                && truth(rest).is_some_and(|(samples, _)| samples >= 4)
        };
        view.wait_for("samples of another view", is_back);

        // Back, and off: the picture of before, and nothing to do.
        view.after("view", |view| view.key("Home"));
        view.after("ground_truth", |view| view.key("g"));
        view.settle();
        view.without_mouse().assert_same(&fast);
        assert!(!view.has_place("Ground truth"));
        view.assert_at_rest("off again");
        view.close();
    }
}

/// It lies over the picture, whose size and samples stay, and moves no button.
#[test]
fn a_message_leaves_ground_truth_as_it_is() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.key("g");
    let is_traced = |events: &[Value]| truth(events).is_some_and(|(samples, _)| samples >= 8);
    view.wait_for("8 samples", is_traced);
    let slider = view.middle("IOR slider");
    let broken = SmallScene::text("") + "hair = [";
    std::fs::write(&scene.path, broken).expect("written");
    view.wait_for_next("error", 0);
    view.wait_for_place("Dismiss button");
    assert_eq!(view.middle("IOR slider"), slider);
    let before = truth(&view.events()).expect("traced").0;
    let is_more = |events: &[Value]| truth(events).is_some_and(|(samples, _)| samples > before);
    view.wait_for("more samples", is_more);
    let events = view.events();
    let lines = events.iter().filter(|event| event["event"] == "truth");
    let samples: Vec<u64> = lines.filter_map(|line| line["samples"].as_u64()).collect();
    assert!(samples.is_sorted(), "{samples:?}");
    view.click(view.middle("Dismiss button"));
    view.wait_until_gone("Dismiss button");
    view.key("ctrl+q");
    view.ended();
}

#[test]
fn ground_truth_goes_to_the_map_of_the_scene_or_says_why_not() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    std::fs::copy(project_root().join("data/sample/studio.exr"), at("sky.exr")).expect("copied");
    let text = |map: &str| {
        let lights = format!("[lights]\nmap = '{map}'\n");
        SmallScene::text("").replace("[lights]\n", &lights)
    };
    std::fs::write(&scene.path, text("sky.exr")).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.key("g");
    let is_traced = |events: &[Value]| truth(events).is_some_and(|(samples, _)| samples >= 4);
    view.wait_for("4 samples", is_traced);
    assert_eq!(view.count("error"), 0);
    view.close();

    std::fs::write(&scene.path, text("gone.exr")).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let fast = view.without_mouse();
    view.key("g");
    view.wait_for_next("error", 0);
    let events = view.events();
    let error = events.iter().find(|event| event["event"] == "error");
    let error = error.and_then(|error| error["message"].as_str());
    let error = error.expect("a message");
    for needle in ["small.toml: lights.map: ", "gone.exr"] {
        assert!(error.contains(needle), "{error}");
    }
    assert!(truth(&events).is_none_or(|(samples, _)| samples == 0));
    assert!(view.has_place("Ground truth"), "the status line tells");
    // Off, and the message goes.
    view.after("ground_truth", |view| view.key("g"));
    view.settle();
    view.without_mouse().assert_same(&fast);
    view.assert_at_rest("off again");
    view.key("ctrl+q");
    view.ended();
}

#[test]
fn other_than_colours_is_shown_on_both_renderers() {
    for backend in ["cpu", "gpu"] {
        let (desktop, scene) = (Desktop::start(), SmallScene::new());
        let mut view = View::open(&desktop, &scene.path, &["--backend", backend]);
        let picture = view.without_mouse();
        let mut before = picture.clone();
        for name in ["False colour", "Clipping", "Coverage", "Depth"] {
            view.key("n");
            view.wait_for(name, |events| {
                let last = events.iter().rfind(|event| event["event"] == "inspect");
                last.is_some_and(|event| event["inspection"] == name)
            });
            view.settle();
            let shown = view.without_mouse();
            assert!(shown.difference(&before) > 2.0 * SAME, "{backend}: {name}");
            before = shown;
        }
        // From the menu, and back.
        view.click(view.middle("View menu"));
        view.wait_for_place("Show menu");
        view.click(view.middle("Show menu"));
        view.wait_for_place("Tangent entry");
        view.click(view.middle("Tangent entry"));
        view.wait_until_gone("Tangent entry");
        assert!(view.without_mouse().difference(&before) > 2.0 * SAME);
        view.click(view.middle("View menu"));
        view.wait_for_place("Picture entry");
        view.click(view.middle("Picture entry"));
        view.wait_until_gone("Picture entry");
        view.settle();
        view.without_mouse().assert_same(&picture);
        view.assert_at_rest("the picture again");
        view.close();
    }
}

#[test]
fn without_a_hardware_gpu_the_cpu_draws_and_the_window_says_why() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let view = View::open(&desktop, &scene.path, &["--samples", "64"]);
    assert!(renderer(&view)[0].starts_with("gpu: "));
    let of_gpu = view.without_mouse();
    view.close();
    let view = View::open(&desktop, &scene.path, &["--backend", "auto"]);
    let [name, reason] = renderer(&view);
    // Whoever runs this on a machine with a GPU sees that one drawing.
    if name == "cpu" {
        assert!(reason.contains("is a software driver"), "{reason}");
    }
    // The same picture up to the noise of samples.
    let difference = view.without_mouse().difference(&of_gpu);
    println!("{name} against the GPU renderer: {difference:.2} levels");
    assert!(difference < 8.0, "{difference}");
}

/// Milliseconds from a mouse's movement to the first picture of what it did, over a drag in `n` steps.
fn latencies(view: &View, name: &str, from: [i32; 2], step: [i32; 2], n: i32) {
    view.move_to(from);
    view.tool("xdotool", &["mousedown", "1"]);
    let (pointer, mut pictures) = (view.pointer(), view.counter("shown"));
    let mut found = Vec::new();
    for ix in 1..=n {
        // Back and forth.
        let turn = if ix <= n / 2 { ix } else { n - ix };
        let at = [from[0] + step[0] * turn, from[1] + step[1] * turn];
        let before = pictures.count();
        let start = Instant::now();
        pointer.move_to(at);
        while pictures.count() == before && start.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(2));
        }
        // The first few pixels may be no drag yet.
        if ix > 2 {
            found.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    view.tool("xdotool", &["mouseup", "1"]);
    found.sort_by(f64::total_cmp);
    let at = |share: f64| found[((found.len() - 1) as f64 * share).round() as usize];
    println!(
        "{name}: {:.0} ms in the middle, {:.0} ms at the 95th percentile, {:.0} ms at most",
        at(0.5),
        at(0.95),
        at(1.0)
    );
}

/// Hair in the wind moves while it plays, and rests when it stops.
#[test]
fn wind_plays_and_stops() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let text = SmallScene::text("") + "\n[motion.wind]\nspeed = 6.0\n";
    std::fs::write(&scene.path, text).expect("it can be written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.settle();
    let start = view.without_mouse();
    view.key("space");
    let mut before = start.clone();
    for _ in 0..3 {
        std::thread::sleep(Duration::from_secs(1));
        let now = view.picture();
        assert!(now.difference(&before) > SAME, "the hair stands still");
        before = now;
    }
    view.key("space");
    view.assert_at_rest("after the wind");
    let stopped = view.without_mouse();
    assert!(stopped.difference(&start) > SAME);
    view.without_mouse().assert_same(&stopped);
    view.close();
}

/// `cargo test --release -p strandlight-tests --test window latency -- --ignored --nocapture`
#[test]
#[ignore = "a measurement: from input to pixels, of the sample, on the CPU"]
fn measure_latency() {
    let desktop = Desktop::start();
    let folder = tempfile::tempdir().expect("a folder");
    let mut view = View::open_in(
        &desktop,
        folder.path(),
        &["--backend", "cpu", "--size", "1072x560"],
    );
    let [left, top, right, bottom] = view.place("View");
    println!("picture of {} x {}", right - left, bottom - top);
    let middle = view.middle("View");
    for round in ["first", "again"] {
        println!("{round}:");
        latencies(&view, "orbit", middle, [6, 1], 30);
        view.settle();
        let slider = view.place("IOR slider");
        let start = [slider[0] + 8, (slider[1] + slider[3]) / 2];
        latencies(&view, "slider", start, [2, 0], 40);
        view.settle();
        view.key("b");
        std::thread::sleep(Duration::from_millis(500));
        latencies(&view, "brush", [middle[0], middle[1] - 60], [4, 3], 40);
        view.key("b");
        view.settle();
    }
}
