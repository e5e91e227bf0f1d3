//! Edits in a real window: mouse, keys, panel, undo, saving.

use crate::window_common::{Desktop, SAME, SmallScene, View};
use strandlight_formats::BakedFile;

/// Clicks the number `IOR` and types another one, which it does not take yet.
fn begin_to_type(view: &View, value: &str) {
    let place = "IOR number";
    view.until_drawn(place, |view| view.click(view.middle(place)));
    view.until_drawn(place, |view| {
        view.key("ctrl+a");
        view.tool("xdotool", &["type", "--delay", "40", value]);
    });
}

#[test]
fn looking_around_is_no_edit_until_the_view_is_saved() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    assert!(start.contrast() > 10.0, "the picture shows nothing");
    let middle = view.middle("View");

    view.after("view", |view| view.drag(1, middle, [60, 20]));
    let orbited = view.picture();
    orbited.assert_different(&start);
    view.after("view", |view| view.drag(2, middle, [50, -30]));
    let panned = view.picture();
    panned.assert_different(&orbited);
    view.after("view", |view| {
        view.move_to(middle);
        view.tool("xdotool", &["click", "4"]);
    });
    let near = view.picture();
    near.assert_different(&panned);
    view.after("view", |view| view.key("f"));
    view.picture().assert_different(&near);
    assert!(!view.title().contains('*'), "{}", view.title());
    assert_eq!([view.count("edit"), view.count("undo")], [0, 0]);

    // Undo takes edits back and leaves the view.
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    view.after("view", |view| view.drag(1, middle, [-50, 10]));
    view.after("undo", |view| view.key("ctrl+z"));
    let turned = view.picture();
    turned.assert_different(&start);
    assert!(!view.title().contains('*'), "{}", view.title());
    view.after("view", |view| view.key("Home"));
    view.picture().assert_same(&start);

    // Saving the scene keeps its camera, saving the view changes it.
    view.after("view", |view| view.drag(1, middle, [60, 20]));
    view.after("edit", |view| view.type_number("IOR", "1.6"));
    let before = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", before);
    assert_eq!(scene.read().camera, None);
    let kept = view.picture();
    view.after("edit", |view| view.key("v"));
    assert!(view.title().contains('*'), "{}", view.title());
    let before = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", before);
    assert!(scene.read().camera.is_some());
    view.after("view", |view| view.drag(1, middle, [-80, 0]));
    view.close();
    View::open(&desktop, &scene.path, &[])
        .picture()
        .assert_same(&kept);
}

#[test]
fn the_groom_keeps_its_own_widths_until_they_are_overridden() {
    use strandlight_formats::{Attribute, Domain, Groom};

    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let path = scene.read().groom_path();
    let mut groom = Groom::read(&path).expect("a groom");
    groom
        .attributes
        .retain(|attribute| attribute.name != "diameter");
    groom.attributes.push(Attribute {
        name: "diameter".to_owned(),
        domain: Domain::Groom,
        components: 1,
        data: vec![0.0401],
    });
    groom.write(&path).expect("written");
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    assert!(!view.has_place("Diameter slider"), "nothing to nudge");
    // Overriding begins with what is drawn.
    view.after("edit", |view| view.click(view.middle("Diameter override")));
    view.picture().assert_same(&start);
    let slider = view.middle("Diameter slider");
    view.after("edit", |view| view.drag(1, slider, [-20, 0]));
    assert!(view.picture().difference(&start) > 2.0 * SAME);
    view.after("edit", |view| view.type_number("Diameter", "80"));
    let thin = view.picture();
    thin.assert_different(&start);
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    assert_eq!(scene.read().hair.diameter_cm, Some(0.008));
    // Reset gives the groom's own back, and the key is gone.
    view.after("edit", |view| {
        let [_, top, right, bottom] = view.place("Diameter number");
        view.click([right + 16, (top + bottom) / 2]);
    });
    view.picture().assert_same(&start);
    view.key("ctrl+s");
    view.wait_for_next("saved", 1);
    assert_eq!(scene.read().hair.diameter_cm, None);
}

#[test]
fn another_scene_is_replaced_only_after_a_question() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let other = scene.folder.path().join("other.toml");
    std::fs::write(&other, SmallScene::text("eta = 1.4")).expect("it can be written");
    let theirs = std::fs::read(&other).expect("it is there");
    let mut view = View::open(&desktop, &scene.path, &[]);
    view.after("edit", |view| view.type_number("IOR", "1.8"));
    view.asked("save as", |view| view.key("ctrl+shift+s"));
    view.asked("replace", |view| view.type_path(&other));
    assert_eq!(std::fs::read(&other).expect("it is there"), theirs);
    // Cancel goes back to the path that was typed: entering it asks the same again.
    view.click(view.middle("Cancel button"));
    view.asked("replace", |view| view.key("Return"));
    assert_eq!(std::fs::read(&other).expect("it is there"), theirs);
    view.click(view.middle("Replace button"));
    view.wait_for_next("saved", 0);
    let saved = strandlight_formats::Scene::read(&other).expect("a scene");
    assert_eq!(saved.hair.eta, 1.8);

    // What cannot be written keeps the path too, and says why.
    view.asked("save as", |view| view.key("ctrl+shift+s"));
    let nowhere = scene.folder.path().join("no-folder").join("a.toml");
    view.asked("save as", |view| view.type_path(&nowhere));
    view.asked("save as", |view| view.key("Return"));
    let events = view.events();
    let errors: Vec<_> = events.iter().filter(|e| e["event"] == "error").collect();
    assert_eq!(errors.len(), 2, "{errors:?}");
    assert!(errors[1]["message"].to_string().contains("no-folder"));
    // Nor is a scene written over its own groom.
    let groom = scene.folder.path().join("small.groom");
    let hair = std::fs::read(&groom).expect("it is there");
    view.asked("save as", |view| view.type_path(&groom));
    assert_eq!(std::fs::read(&groom).expect("it is there"), hair);
    view.key("Escape");
    // The own scene is saved by one key.
    view.after("edit", |view| view.type_number("IOR", "1.7"));
    let questions = view.count("question");
    view.key("ctrl+s");
    view.wait_for_next("saved", 1);
    assert_eq!(view.count("question"), questions);
}

#[test]
fn what_comes_in_one_slow_frame_is_not_lost() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.without_mouse();
    let [left, top, right, bottom] = view.place("View");
    let [x, y] = [(left + right) / 2, (top + bottom) / 2];
    let swipe = |view: &View, to: [[i32; 2]; 2]| {
        view.move_to([x, y]);
        view.in_one_frame(|view| {
            view.tool("xdotool", &["mousedown", "1"]);
            for place in to {
                view.move_to(place);
            }
            view.tool("xdotool", &["mouseup", "1"]);
        });
    };
    view.after("view", |view| swipe(view, [[x + 40, y], [x + 80, y + 20]]));
    view.without_mouse().assert_different(&start);
    view.after("view", |view| view.key("Home"));
    // A stroke goes through every place: there and back again, it would else end where it began.
    view.key("b");
    view.move_to([x, y]);
    view.after("stroke", |view| swipe(view, [[x - 90, y], [x, y]]));
    let painted = view.without_mouse();
    assert!(
        painted.difference(&start) > 1.2 * SAME,
        "{}",
        painted.difference(&start)
    );
    view.key("b");
    for eta in ["1.6", "1.7", "1.8"] {
        view.after("edit", |view| view.type_number("IOR", eta));
    }
    // Every key press counts, in order.
    view.after("undo", |view| {
        view.in_one_frame(|view| {
            for key in ["ctrl+z", "ctrl+z", "ctrl+s", "ctrl+z"] {
                view.tool("xdotool", &["key", key]);
            }
        });
    });
    assert_eq!([view.count("undo"), view.count("saved")], [3, 1]);
    assert_eq!(scene.read().hair.eta, 1.6);
}

#[test]
fn values_are_dragged_typed_reset_undone_and_saved() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    let plain = scene.read().hair.eta;

    let slider = view.middle("IOR slider");
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
    view.after("edit", |view| view.type_number("IOR", "1.8"));
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
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    // A number that is being typed.
    begin_to_type(&view, "1.9");
    view.key("Escape");
    // The name to save as: twice, or the first would not have been closed.
    for _ in 0..2 {
        view.asked("save as", |view| view.key("ctrl+shift+s"));
        view.without_mouse().assert_different(&start);
        view.key("Escape");
        view.wait_until_gone("Path");
        view.without_mouse().assert_same(&start);
    }
    assert_eq!([view.count("edit"), view.count("saved")], [0, 0]);
    assert!(!view.title().contains('*'), "{}", view.title());
    assert_eq!(std::fs::read(&scene.path).expect("it is there"), before);
    view.close();
}

#[test]
fn keys_that_save_and_close_take_what_is_being_typed_first() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    begin_to_type(&view, "1.7");
    assert_eq!(view.count("edit"), 0);
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    assert_eq!((scene.read().hair.eta, view.count("edit")), (1.7, 1));
    // All of it at once, as in a slow frame.
    let place = "IOR number";
    view.until_drawn(place, |view| view.click(view.middle(place)));
    view.in_one_frame(|view| {
        view.key("ctrl+a");
        view.tool("xdotool", &["type", "1.8"]);
        view.key("ctrl+s");
    });
    view.wait_for_next("saved", 1);
    assert_eq!(scene.read().hair.eta, 1.8);
    // With Shift alone a letter is typed.
    begin_to_type(&view, "1.6P");
    assert_eq!(view.count("question"), 0);
    view.key("Escape");
    begin_to_type(&view, "1.9");
    view.asked("unsaved", |view| view.key("ctrl+q"));
    view.key("Escape");
    view.wait_until_gone("Don't save button");
    view.key("ctrl+s");
    view.wait_for_next("saved", 2);
    assert_eq!(scene.read().hair.eta, 1.9);
    view.close();
}

#[test]
fn a_number_that_is_clicked_and_left_keeps_the_digits_that_it_does_not_show() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let text = SmallScene::text("eta = 1.55371\nsigma_a = [0.123456, 0.2, 0.3]");
    std::fs::write(&scene.path, text).expect("written");
    let mut view = View::open(&desktop, &scene.path, &[]);
    for place in ["IOR number", "Absorption red number"] {
        // That it looks otherwise under the mouse is not the click.
        view.move_to(view.middle(place));
        view.until_drawn(place, |view| view.click(view.middle(place)));
        view.until_drawn(place, |view| view.key("Return"));
    }
    view.after("edit", |view| view.type_number("Absorption blue", "0.4"));
    assert_eq!(view.count("edit"), 1, "only the number that was typed");
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    let hair = scene.read().hair;
    assert_eq!((hair.eta, hair.sigma_a), (1.55371, [0.123456, 0.2, 0.4]));
}

#[test]
fn values_of_the_command_line_are_no_changes_and_colours_are_typed() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let more = ["--samples", "12", "--set", "lights.intensity=2"];
    let mut view = View::open(&desktop, &scene.path, &more);
    let start = view.picture();
    assert!(
        view.title().ends_with("small.toml - done"),
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

#[test]
fn lights_are_turned_by_their_map() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.without_mouse();
    view.after("places", |view| view.click(view.middle("Hair")));
    view.after("places", |view| view.click(view.middle("Lights")));
    let [left, top, right, bottom] = view.place("Light map");
    assert_eq!((right - left + 1) / 2, bottom - top);
    view.after("edit", |view| {
        view.drag(1, [left + 20, bottom - 10], [(right - left) / 4, 0]);
    });
    view.without_mouse().assert_different(&start);
    view.key("ctrl+s");
    view.wait_for("saved", |events| {
        events.iter().any(|e| e["event"] == "saved")
    });
    // A quarter of the map is a quarter of a turn; the drag loses what it takes to be one.
    let rotate_deg = scene.read().lights.rotate_deg;
    assert!((-91.0..-80.0).contains(&rotate_deg), "{rotate_deg}");
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
}

#[test]
fn views_are_locked_kept_and_set_by_focal_length() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &["--size", "760x900"]);
    for closed in ["Hair", "Camera"] {
        view.after("places", |view| view.click(view.middle(closed)));
    }
    let start = view.without_mouse();
    view.after("places", |view| view.click(view.middle("Keep view button")));
    view.type_number("Focal length", "85");
    let nearer = view.without_mouse();
    nearer.assert_different(&start);
    // Looking around is no edit.
    assert_eq!(view.count("edit"), 0);
    view.click(view.middle("View 1"));
    view.without_mouse().assert_same(&start);
    let [left, top, right, bottom] = view.place("View");
    let click_twice = |view: &View, at: [i32; 2]| {
        view.move_to(at);
        let twice = ["click", "--repeat", "2", "--delay", "60", "1"];
        view.tool("xdotool", &twice);
        view.without_mouse();
    };
    // Down the left half of the head until there is a strand to look at.
    let mut places = (4..14).map(|step| {
        let [x, y] = [(right - left) * 2 / 5, (bottom - top) * step / 20];
        [left + x, top + y]
    });
    let moves = view.count("view");
    let strand = places.find(|&at| {
        click_twice(&view, at);
        view.count("view") > moves
    });
    let strand = strand.expect("hair in the left half of the picture");
    view.after("view", |view| view.key("Home"));
    view.without_mouse().assert_same(&start);
    view.click(view.middle("Lock"));
    view.drag(1, [(left + right) / 2, (top + bottom) / 2], [60, 0]);
    click_twice(&view, strand);
    view.without_mouse().assert_same(&start);
    view.click(view.middle("Lock"));
    view.drag(1, [(left + right) / 2, (top + bottom) / 2], [60, 0]);
    view.without_mouse().assert_different(&start);
    view.close();
}
