//! Narrow and small windows, the panel, views and the clipboard.

use crate::window_common::{Desktop, SAME, SmallScene, View};

const CPU: [&str; 2] = ["--backend", "cpu"];

/// Width of the picture, pixels.
fn width_of_picture(view: &View) -> i32 {
    let [left, _, right, _] = view.place("View");
    right - left
}

#[test]
fn the_panel_is_dragged_wider_hidden_and_shown() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let size = ["--backend", "cpu", "--size", "1000x600"];
    let mut view = View::open(&desktop, &scene.path, &size);
    assert_eq!(width_of_picture(&view), 1000 - 348);
    let start = view.without_mouse();
    // Tab hides it: the picture has its room.
    view.key("Tab");
    view.wait_until_gone("IOR slider");
    view.settle();
    assert_eq!(width_of_picture(&view), 1000);
    view.key("Tab");
    view.wait_for_place("IOR slider");
    view.settle();
    view.without_mouse().assert_same(&start);
    // Its edge is dragged.
    let edge = width_of_picture(&view);
    view.drag(1, [edge, 300], [-80, 0]);
    view.settle();
    let wider = width_of_picture(&view);
    assert!((edge - 110..edge - 50).contains(&wider), "{edge} {wider}");
    view.after("edit", |view| view.type_number("IOR", "1.7"));
    view.close_unsaved();
}

#[test]
fn a_window_as_narrow_as_a_phone_has_the_panel_over_the_picture() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let size = ["--backend", "cpu", "--size", "390x844"];
    let mut view = View::open(&desktop, &scene.path, &size);
    assert_eq!(width_of_picture(&view), 390);
    assert!(!view.has_place("IOR slider"));
    let start = view.without_mouse();
    assert!(start.contrast() > 5.0, "the picture shows nothing");
    // All of the bar is inside.
    for name in [
        "File menu",
        "View menu",
        "Undo button",
        "Redo button",
        "Panel button",
    ] {
        let [left, _, right, _] = view.place(name);
        assert!(left >= 0 && right <= 390, "{name}: {left}..{right}");
    }
    view.click(view.middle("Panel button"));
    view.wait_for_place("IOR slider");
    for name in [
        "IOR slider",
        "IOR number",
        "Preset choice",
        "Save preset button",
    ] {
        let [left, top, right, bottom] = view.place(name);
        assert!(left >= 0 && right <= 390, "{name}: {left}..{right}");
        assert!(
            top > 844 * 4 / 10 && bottom <= 844,
            "{name}: {top}..{bottom}"
        );
    }
    let slider = view.middle("IOR slider");
    view.after("edit", |view| view.drag(1, slider, [25, 0]));
    // The upper part of the picture is seen, and follows the mouse.
    view.after("view", |view| view.drag(1, [190, 200], [40, 10]));
    view.after("view", |view| view.key("Home"));
    view.after("undo", |view| view.click(view.middle("Undo button")));
    view.key("Tab");
    view.wait_until_gone("IOR slider");
    view.without_mouse().assert_same(&start);
    // Questions fit too.
    view.asked("save as", |view| view.key("ctrl+shift+s"));
    for name in ["Path", "Save as button", "Cancel button"] {
        let [left, top, right, bottom] = view.place(name);
        assert!(
            left >= 0 && right <= 390 && top >= 0 && bottom <= 844,
            "{name}"
        );
    }
    view.key("Escape");
    view.wait_until_gone("Path");
    // On its side it lies beside the picture's left part.
    view.after("resized", |view| view.resize(590, 390));
    view.key("Tab");
    view.wait_for_place("IOR slider");
    let [left, ..] = view.place("IOR slider");
    assert!(left > 590 * 4 / 10, "{left}");
    view.close();
}

#[test]
fn views_have_an_undo_of_their_own_and_sides() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    let middle = view.middle("View");
    view.after("view", |view| view.drag(1, middle, [60, 20]));
    let turned = view.without_mouse();
    turned.assert_different(&start);
    view.after("edit", |view| view.type_number("IOR", "1.9"));
    view.after("view", |view| view.key("3"));
    let side = view.without_mouse();
    side.assert_different(&turned);
    view.after("view", |view| view.key("alt+Left"));
    view.after("view", |view| view.key("alt+Left"));
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.after("view", |view| view.key("alt+Right"));
    view.without_mouse().assert_same(&turned);
    view.after("view", |view| view.key("alt+Right"));
    view.after("redo", |view| view.key("ctrl+y"));
    view.without_mouse().assert_same(&side);
    // Beyond the top nothing is upside down: a long drag down ends at the pole.
    view.after("view", |view| view.key("1"));
    let front = view.without_mouse();
    for _ in 0..3 {
        view.after("view", |view| view.drag(1, middle, [0, 150]));
    }
    let top = view.without_mouse();
    top.assert_different(&front);
    view.after("view", |view| view.drag(1, middle, [0, -60]));
    view.without_mouse().assert_different(&top);
    assert_eq!(view.count("edit"), 1);
}

#[test]
fn numbers_are_typed_as_people_do_and_refusals_are_seen() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let saved = |view: &mut View| {
        let before = view.count("saved");
        view.key("ctrl+s");
        view.wait_for_next("saved", before);
        scene.read()
    };
    for (typed, eta) in [("1,7", 1.7), ("2*0.9", 1.8), ("(1+2)/2", 1.5)] {
        view.after("edit", |view| view.type_number("IOR", typed));
        let scene = saved(&mut view);
        assert_eq!(scene.hair.eta, eta, "{typed}");
    }
    view.after("edit", |view| view.click(view.middle("Diameter override")));
    view.after("edit", |view| view.type_number("Diameter", "0.12mm"));
    assert_eq!(saved(&mut view).hair.diameter_cm, Some(0.012));
    let errors = view.count("error");
    view.type_number("IOR", "lots");
    view.wait_for_next("error", errors);
    let events = view.events();
    let error = events.iter().rev().find(|line| line["event"] == "error");
    let said = error
        .map(|line| line["message"].to_string())
        .unwrap_or_default();
    assert!(said.contains("IOR: lots"), "{said}");
    // The message moves the panel down.
    view.wait_for_place("Dismiss button");
    view.after("edit", |view| view.type_number("IOR", "9"));
    view.wait_for_next("error", errors + 1);
    assert_eq!(saved(&mut view).hair.eta, 3.0, "the nearest that there is");
}

#[test]
fn text_goes_from_window_to_window_by_the_clipboard() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut first = View::open(&desktop, &scene.path, &CPU);
    first.after("edit", |view| view.type_number("IOR", "1.85"));
    let place = "IOR number";
    first.until_drawn(place, |view| view.click(view.middle(place)));
    first.key("ctrl+a");
    first.key("ctrl+c");
    let other = SmallScene::new();
    let mut second = View::open(&desktop, &other.path, &CPU);
    second.focus();
    second.until_drawn(place, |view| view.click(view.middle(place)));
    second.until_drawn(place, |view| {
        view.key("ctrl+a");
        view.key("ctrl+v");
    });
    second.after("edit", |view| view.key("Return"));
    let before = second.count("saved");
    second.key("ctrl+s");
    second.wait_for_next("saved", before);
    assert_eq!(other.read().hair.eta, 1.85);
}

#[test]
fn a_preset_of_ones_own_is_saved_and_chosen_and_the_background_is_kept() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let size = ["--backend", "cpu", "--size", "900x900"];
    let mut view = View::open(&desktop, &scene.path, &size);
    view.after("edit", |view| view.type_number("Absorption red", "4"));
    let own = view.without_mouse();
    view.asked("preset", |view| {
        view.click(view.middle("Save preset button"))
    });
    view.tool("xdotool", &["type", "--delay", "40", "Mine"]);
    view.key("Return");
    view.wait_until_gone("Preset name");
    // One of that name is not replaced unasked.
    view.after("edit", |view| view.type_number("Absorption red", "0.1"));
    view.asked("preset", |view| {
        view.click(view.middle("Save preset button"))
    });
    view.tool("xdotool", &["type", "--delay", "40", "Mine"]);
    view.asked("replace", |view| view.key("Return"));
    view.click(view.middle("Cancel button"));
    view.wait_for_place("Preset name");
    view.key("Escape");
    view.wait_until_gone("Preset name");
    view.without_mouse().assert_different(&own);
    view.click(view.middle("Preset choice"));
    view.wait_for_place("Preset Mine");
    view.after("edit", |view| view.click(view.middle("Preset Mine")));
    view.without_mouse().assert_same(&own);
    view.close_unsaved();

    // Another window knows it; a background of one's own comes back after another kind.
    let mut view = View::open(&desktop, &scene.path, &size);
    view.click(view.middle("Preset choice"));
    view.wait_for_place("Preset Mine");
    view.key("Escape");
    view.after("places", |view| view.click(view.middle("Hair")));
    view.after("places", |view| view.click(view.middle("Render")));
    view.after("edit", |view| view.click(view.middle("Background Colour")));
    view.after("edit", |view| view.type_number("Backdrop green", "0.7"));
    let green = view.without_mouse();
    view.after("edit", |view| view.click(view.middle("Background None")));
    let none = view.without_mouse();
    none.assert_different(&green);
    view.after("edit", |view| view.click(view.middle("Background Colour")));
    let back = view.without_mouse();
    assert!(
        back.difference(&green) < SAME,
        "{}",
        back.difference(&green)
    );
}

/// Controls at the right end of the panel's rows are inside of windows that are low and narrow.
#[test]
fn a_low_and_narrow_window_shows_whole_rows_of_the_panel() {
    for (size, right) in [("480x360", 480), ("320x240", 320)] {
        let (desktop, scene) = (Desktop::start(), SmallScene::new());
        let size = ["--backend", "cpu", "--size", size];
        let mut view = View::open(&desktop, &scene.path, &size);
        view.click(view.middle("Panel button"));
        view.wait_for_place("Absorption red number");
        let number = view.place("Absorption red number");
        let slider = view.place("Absorption red slider");
        // The reset is beside it.
        assert!(number[2] + 20 <= right, "{number:?} of {right}");
        assert!(
            slider[2] - slider[0] >= 20 && slider[2] <= number[0],
            "{slider:?}"
        );
        view.after("edit", |view| view.type_number("Absorption red", "5"));
        view.close_unsaved();
    }
}

/// Turns the wheel over a place until a control is above `bottom`.
fn scroll_to(view: &mut View, over: [i32; 2], name: &str, bottom: i32) {
    view.move_to(over);
    for _ in 0..30 {
        if view.place(name)[3] <= bottom {
            return;
        }
        let before = view.count("places");
        view.tool("xdotool", &["click", "5"]);
        view.wait_for_next("places", before);
        std::thread::sleep(std::time::Duration::from_millis(250));
    }
    panic!("{name} stays below the window: {:?}", view.place(name));
}

#[test]
fn dialogs_and_menus_of_a_low_and_narrow_window_are_reached() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let size = ["--backend", "cpu", "--size", "360x480"];
    let mut view = View::open(&desktop, &scene.path, &size);
    view.asked("picture", |view| view.key("shift+p"));
    for name in [
        "Picture size",
        "OpenEXR format",
        "Width number",
        "Path",
        "Save picture button",
        "Cancel button",
    ] {
        let [left, top, right, bottom] = view.place(name);
        assert!(
            left >= 0 && right <= 360 && top >= 0 && bottom <= 480,
            "{name}"
        );
    }
    view.answer("Cancel");
    // What is larger than the window is scrolled to.
    view.after("resized", |view| view.resize(320, 240));
    view.asked("picture", |view| view.key("shift+p"));
    assert!(view.place("Cancel button")[3] > 240);
    scroll_to(&mut view, [60, 60], "Cancel button", 225);
    view.answer("Cancel");
    view.click(view.middle("File menu"));
    view.wait_for_place("Close entry");
    assert!(view.place("Close entry")[3] > 240);
    scroll_to(&mut view, [60, 100], "Close entry", 235);
    view.click(view.middle("Close entry"));
    view.ended();
}

#[test]
fn hair_that_is_out_of_view_is_said_to_be() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let away = "[camera]\nposition = [0, 0, 60]\ntarget = [0, 0, 200]\nfov_deg = 30\n";
    let text = SmallScene::text("") + away;
    std::fs::write(&scene.path, text).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    assert!(view.has_place("Out of view"));
    view.after("view", |view| view.key("f"));
    view.wait_until_gone("Out of view");
    assert!(view.without_mouse().contrast() > 5.0, "it shows nothing");
    view.close();
}

#[test]
fn looks_are_kept_swapped_and_wiped() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    let before = view.count("kept");
    view.key("k");
    view.wait_for_next("kept", before);
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    let changed = view.without_mouse();
    changed.assert_different(&start);
    // One after the other, as edits.
    view.after("edit", |view| view.key("x"));
    view.without_mouse().assert_same(&start);
    view.after("edit", |view| view.key("x"));
    view.without_mouse().assert_same(&changed);
    // Beside each other: the kept one on the left.
    view.key("w");
    view.wait_for_place("Wipe line");
    let wiped = view.without_mouse();
    let (width, height) = (start.width / 2 - 40, start.height - 60);
    let left = |shot: &crate::window_common::Shot| shot.part([0, 50], [width, height]);
    let right =
        |shot: &crate::window_common::Shot| shot.part([start.width / 2 + 40, 50], [width, height]);
    left(&wiped).assert_same(&left(&start));
    right(&wiped).assert_same(&right(&changed));
    assert!(left(&wiped).difference(&left(&changed)) > 2.0 * SAME);
    // The line is dragged to the right edge: all of it is the kept one.
    let line = view.middle("Wipe line");
    view.drag(1, line, [width as i32 / 2, 0]);
    let moved = view.without_mouse();
    let strip = [start.width / 2 + 40, 50];
    let size = [width / 4, height];
    moved
        .part(strip, size)
        .assert_same(&start.part(strip, size));
    // For another view the kept look is drawn again.
    let drawn = view.count("look");
    let at = [40, view.middle("View")[1]];
    let is_drawn = |line: &serde_json::Value| !line["places"]["Drawn look"].is_null();
    assert!(!view.has_place("Drawn look"), "it is there");
    let n_before = view.events().len();
    view.after("view", |view| view.drag(1, at, [60, 20]));
    view.wait_for_next("look", drawn);
    // Meanwhile the status line says so.
    assert!(view.events()[n_before..].iter().any(is_drawn));
    view.wait_until_gone("Drawn look");
    // And after a stroke, which it has too.
    let drawn = view.count("look");
    let [left, top, right, bottom] = view.place("View");
    let from = [left + (right - left) / 3, (top + bottom) / 2];
    view.key("b");
    view.after("stroke", |view| view.drag(1, from, [(right - left) / 4, 0]));
    view.key("b");
    view.wait_for_next("look", drawn);
    view.after("undo", |view| view.key("ctrl+z"));
    view.key("w");
    view.wait_until_gone("Wipe line");
    // Pasted from text, as an edit.
    view.key("ctrl+shift+c");
    view.after("edit", |view| view.type_number("Absorption red", "0.2"));
    view.after("edit", |view| view.key("ctrl+shift+v"));
    view.after("view", |view| view.key("Home"));
    view.without_mouse().assert_same(&changed);
    view.close_unsaved();
}

#[test]
fn kept_looks_are_those_of_the_scene_also_when_it_is_saved_elsewhere() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    // Kept in the frame of an edit, before there is a picture of it: one is drawn.
    let place = "Absorption red number";
    view.until_drawn(place, |view| view.click(view.middle(place)));
    view.after("edit", |view| {
        view.in_one_frame(|view| {
            view.key("ctrl+a");
            view.tool("xdotool", &["type", "6"]);
            view.key("Return");
            view.key("k");
        });
    });
    assert_eq!([view.count("kept"), view.count("look")], [1, 0]);
    let edited = view.without_mouse();
    edited.assert_different(&start);
    // Nothing moves in this scene, and nothing waits for it to stop.
    view.key("space");
    view.key("w");
    view.wait_for_next("look", 0);
    view.wait_for_place("Wipe line");
    let (width, height) = (start.width / 2 - 40, start.height - 60);
    let left = |shot: &crate::window_common::Shot| shot.part([0, 50], [width, height]);
    left(&view.without_mouse()).assert_same(&left(&edited));
    view.key("w");
    view.wait_until_gone("Wipe line");
    // From another folder the look's light set is where it was.
    view.after("edit", |view| view.type_number("Absorption red", "0.2"));
    let below = scene.folder.path().join("below");
    std::fs::create_dir(&below).expect("made");
    view.asked("save as", |view| view.key("ctrl+shift+s"));
    view.type_path(&below.join("moved.toml"));
    view.wait_for_next("saved", 0);
    view.after("edit", |view| view.key("x"));
    view.without_mouse().assert_same(&edited);
    view.close_unsaved();
}
