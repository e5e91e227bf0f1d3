//! Edits in a real window: mouse, keys, panel, undo, saving.

mod window_common;

use window_common::{Desktop, SAME, SmallScene, View};

#[test]
fn the_camera_follows_the_mouse_and_undo_brings_it_back() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    assert!(start.contrast() > 10.0, "the picture shows nothing");
    let middle = view.middle("View");

    let before = view.count("edit");
    view.after("edit", |view| view.drag(1, middle, [60, 20]));
    assert!(view.count("edit") > before);
    let orbited = view.picture();
    orbited.assert_different(&start);
    // One step for the whole drag.
    view.after("undo", |view| view.key("ctrl+z"));
    view.picture().assert_same(&start);
    assert!(!view.title().contains('*'), "{}", view.title());
    view.after("redo", |view| view.key("ctrl+y"));
    view.picture().assert_same(&orbited);

    view.after("edit", |view| view.drag(2, middle, [50, -30]));
    let panned = view.picture();
    panned.assert_different(&orbited);
    view.after("edit", |view| {
        view.move_to(middle);
        view.tool("xdotool", &["click", "4"]);
    });
    let near = view.picture();
    near.assert_different(&panned);
    view.after("edit", |view| view.key("f"));
    view.picture().assert_different(&near);
    view.after("edit", |view| view.key("Home"));
    view.picture().assert_same(&start);
}

#[test]
fn values_are_dragged_typed_reset_undone_and_saved() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    let plain = scene.read().hair.eta;

    let slider = view.middle("Index eta slider");
    view.after("edit", |view| view.drag(1, slider, [25, 0]));
    let dragged = view.picture();
    assert!(dragged.difference(&start) > 2.0 * SAME);
    assert!(view.title().contains('*'), "{}", view.title());

    view.after("edit", |view| {
        view.type_number("Absorption red", "6.25");
    });
    let typed = view.picture();
    typed.assert_different(&dragged);

    view.after("undo", |view| view.key("ctrl+z"));
    view.picture().assert_same(&dragged);
    view.after("undo", |view| view.key("ctrl+z"));
    view.picture().assert_same(&start);
    view.after("redo", |view| view.key("ctrl+shift+z"));
    view.after("redo", |view| view.key("ctrl+y"));
    view.picture().assert_same(&typed);

    view.key("ctrl+s");
    view.wait_for("saved", |events| {
        events.iter().any(|e| e["event"] == "saved")
    });
    let saved = scene.read();
    assert_eq!(saved.hair.sigma_a[0], 6.25);
    assert!(saved.hair.eta > plain + 0.01, "{}", saved.hair.eta);
    view.close();

    // The same picture when it is opened again; another one is noticed.
    let mut view = View::open(&desktop, &scene.path, &[]);
    view.picture().assert_same(&typed);
    view.picture().assert_different(&start);
    view.after("edit", |view| {
        let [_, top, right, bottom] = view.place("Absorption red number");
        view.click([right + 16, (top + bottom) / 2]);
    });
    let reset = view.picture();
    reset.assert_same(&dragged);
}

#[test]
fn closing_with_changes_asks_first() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let before = std::fs::read(&scene.path).expect("it is there");
    let mut view = View::open(&desktop, &scene.path, &[]);
    view.after("edit", |view| view.type_number("Index eta", "1.8"));
    view.key("ctrl+q");
    std::thread::sleep(std::time::Duration::from_millis(500));
    assert!(view.is_running());
    view.key("Escape");
    view.after("undo", |view| view.key("ctrl+z"));
    view.key("ctrl+q");
    view.ended();
    assert_eq!(std::fs::read(&scene.path).expect("it is there"), before);
}

#[test]
fn escape_leaves_things_as_they_were() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let before = std::fs::read(&scene.path).expect("it is there");
    let view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    // A number that is being typed.
    let place = "Index eta number";
    view.until_drawn(place, |view| view.click(view.middle(place)));
    view.until_drawn(place, |view| {
        view.key("ctrl+a");
        view.tool("xdotool", &["type", "--delay", "40", "1.9"]);
    });
    view.key("Escape");
    // The name to save as: twice, or the first would not have been closed.
    for _ in 0..2 {
        view.key("ctrl+shift+s");
        std::thread::sleep(std::time::Duration::from_millis(300));
        view.without_mouse().assert_different(&start);
        view.key("Escape");
        std::thread::sleep(std::time::Duration::from_millis(300));
        view.without_mouse().assert_same(&start);
    }
    assert_eq!([view.count("edit"), view.count("saved")], [0, 0]);
    assert!(!view.title().contains('*'), "{}", view.title());
    assert_eq!(std::fs::read(&scene.path).expect("it is there"), before);
    view.close();
}

#[test]
fn values_of_the_command_line_are_no_changes_and_colours_are_typed() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let more = ["--samples", "12", "--set", "lights.intensity=2"];
    let mut view = View::open(&desktop, &scene.path, &more);
    let start = view.picture();
    assert!(
        view.title().ends_with("small.toml - 12/12"),
        "{}",
        view.title()
    );
    view.after("places", |view| view.click(view.middle("Hair")));
    view.after("places", |view| view.click(view.middle("Lights")));
    view.after("edit", |view| view.type_number("Tint blue", "0"));
    view.picture().assert_different(&start);
    assert!(view.title().contains('*'), "{}", view.title());
    view.key("ctrl+s");
    view.wait_for("saved", |events| {
        events.iter().any(|e| e["event"] == "saved")
    });
    // What was seen is saved.
    let saved = scene.read();
    assert_eq!(saved.lights.tint, [1.0, 1.0, 0.0]);
    assert_eq!((saved.lights.intensity, saved.render.samples), (2.0, 12));
    view.after("edit", |view| {
        let [_, top, right, bottom] = view.place("Tint blue number");
        view.click([right + 14, (top + bottom) / 2]);
    });
    view.picture().assert_same(&start);
}

#[test]
fn a_stroke_is_painted_undone_and_saved_with_the_groom() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    let [left, top, right, bottom] = view.place("View");
    let from = [left + (right - left) / 3, (top + bottom) / 2];
    view.key("b");
    view.after("stroke", |view| view.drag(1, from, [(right - left) / 3, 0]));
    let painted = view.without_mouse();
    // A band of the hair alone: 1.6 levels of the whole picture.
    assert!(painted.difference(&start) > 2.0 * SAME);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.after("redo", |view| view.key("ctrl+y"));
    view.without_mouse().assert_same(&painted);
    view.key("ctrl+s");
    view.wait_for("saved", |events| {
        events.iter().any(|e| e["event"] == "saved")
    });
    view.close();

    let view = View::open(&desktop, &scene.path, &[]);
    view.without_mouse().assert_same(&painted);
    let groom = strandlight_formats::Groom::read(&scene.read().groom_path()).expect("a groom");
    assert!(groom.attribute("dye").is_some());
}

#[test]
fn a_highlight_names_its_light_and_lights_go_out() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &["--size", "760x900"]);
    let start = view.without_mouse();
    // Sections are closed and opened by their headings.
    view.after("places", |view| view.click(view.middle("Hair")));
    view.after("places", |view| view.click(view.middle("Lights")));
    // Down the left half of the head until there is a strand.
    let [left, top, right, bottom] = view.place("View");
    let mut light = None;
    for step in 4..14 {
        let picks = view.count("picked");
        view.click(view.middle("Pick button"));
        let y = top + (bottom - top) * step / 20;
        view.click([left + (right - left) * 2 / 5, y]);
        view.wait_for("picked", |events| {
            events.iter().filter(|e| e["event"] == "picked").count() > picks
        });
        let events = view.events();
        let picked = events.iter().rev().find(|e| e["event"] == "picked");
        light = picked.and_then(|e| e["light"].as_u64());
        if light.is_some() {
            break;
        }
    }
    let light = light.expect("hair in the left half of the picture");
    // Rows for the picked light move the list down.
    view.wait_for("places of the list", |events| {
        let last = |name: &str| events.iter().rposition(|e| e["event"] == name);
        last("places") > last("picked")
    });
    view.after("edit", |view| {
        view.click(view.middle(&format!("Mute {light}")));
    });
    view.without_mouse().assert_different(&start);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.after("edit", |view| {
        view.click(view.middle(&format!("Solo {light}")));
    });
    view.without_mouse().assert_different(&start);
}
