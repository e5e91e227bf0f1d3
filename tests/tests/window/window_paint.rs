//! Variation and brushes in a real window: the panel's sections, a photo, colours that are picked.

use strandlight_formats::BakedFile;
use strandlight_tests::project_root;

use crate::window_common::{Desktop, SAME, Shot, SmallScene, View};

/// Closes the section on top and opens another.
fn open_section(view: &mut View, closed: &str, opened: &str) {
    view.after("places", |view| view.click(view.middle(closed)));
    view.after("places", |view| view.click(view.middle(opened)));
    view.settle();
}

/// The middle of the view, most of which is hair.
fn hair_of(view: &mut View) -> Shot {
    let shot = view.without_mouse();
    let [left, top, right, bottom] = view.place("View");
    let size = [right - left, bottom - top].map(|size| size as usize / 2);
    shot.part([size[0] / 2, size[1] / 2], size)
}

#[test]
fn hair_varies_by_its_section_and_undo_takes_that_back() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    open_section(&mut view, "Hair", "Variation");
    let mut before = hair_of(&mut view);
    for (name, value) in [
        ("Melanin per strand", "0.6"),
        ("Grey", "0.3"),
        ("Frizz", "0.8"),
        ("Seed", "7"),
    ] {
        view.after("edit", |view| view.type_number(name, value));
        let now = hair_of(&mut view);
        now.assert_different(&before);
        before = now;
    }
    let count = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", count);
    let variation = scene.read().variation;
    assert_eq!((variation.melanin_strand, variation.seed), (0.6, 7));
    view.after("edit", |view| view.type_number("Clump", "0.9"));
    let count = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", count);
    assert_eq!(scene.read().variation.clump, 0.9);
    view.after("undo", |view| view.key("ctrl+z"));
    hair_of(&mut view).assert_same(&before);
    view.close_unsaved();
}

#[test]
fn brushes_flood_and_blur_and_colours_are_picked() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let photo = scene.path.with_file_name("photo.png");
    std::fs::write(&photo, green_png()).expect("written");
    let mut view = View::open(&desktop, &scene.path, &["--size", "860x900"]);
    let start = view.picture();
    open_section(&mut view, "Hair", "Paint");
    view.after("flood", |view| view.click(view.middle("Flood button")));
    let dyed = view.without_mouse();
    dyed.assert_different(&start);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);

    // A stroke with a hard edge, which is softened. Around it a picture shows more of that than as a whole.
    view.after("places", |view| view.click(view.middle("Paint toggle")));
    // Where hair is dense.
    let [left, top, right, bottom] = view.place("View");
    let hair = [left + (right - left) * 2 / 5, top + (bottom - top) * 2 / 5];
    let around = |shot: Shot| {
        let corner = [hair[0] - left - 40, hair[1] - top - 40].map(|at| at as usize);
        shot.part(corner, [140, 160])
    };
    let start = around(start);
    view.type_number("Soft edge", "0");
    view.after("stroke", |view| view.drag(1, hair, [60, 20]));
    let painted = around(view.without_mouse());
    painted.assert_different(&start);
    view.click(view.middle("Blur brush"));
    view.after("stroke", |view| {
        view.drag(1, [hair[0], hair[1] + 50], [60, 20]);
    });
    let blurred = around(view.without_mouse());
    assert!(
        blurred.difference(&painted) > 2.0 * SAME,
        "nothing is blurred"
    );
    view.click(view.middle("Smear brush"));
    view.after("stroke", |view| view.drag(1, hair, [-40, -10]));
    let smeared = around(view.without_mouse());
    assert!(
        smeared.difference(&blurred) > 2.0 * SAME,
        "nothing is smeared"
    );

    // The colour of the hair, and that of a photo.
    view.click(view.middle("Colour brush"));
    view.settle();
    view.click(view.middle("Pick colour button"));
    view.after("color", |view| view.click(hair));
    let picked = view.events();
    let picked = picked.iter().rev().find(|it| it["event"] == "color");
    let sigma_a = &picked.expect("logged")["sigma_a"];
    assert!(sigma_a[2].as_f64().is_some_and(|x| x > 0.0), "{sigma_a}");
    view.drop_files(&[&photo]);
    view.wait_for_place("Reference photo");
    view.settle();
    // Below the menus, which stay in reach.
    let window = view.place("Reference window");
    assert!(window[1] >= view.place("View")[1], "{window:?}");
    view.click(view.middle("Reference photo"));
    view.after("flood", |view| view.click(view.middle("Flood button")));
    let green = view.without_mouse();
    green.assert_different(&dyed);
    // A JPEG takes its place: red, white and blue meet in its middle. One for printers is refused.
    let samples = project_root().join("crates/runtime/src/ui/photo/samples");
    view.until_drawn("Reference photo", |view| {
        view.drop_files(&[&samples.join("baseline.jpg")]);
    });
    view.settle();
    view.click(view.middle("Reference photo"));
    view.after("flood", |view| view.click(view.middle("Flood button")));
    view.without_mouse().assert_different(&green);
    let count = view.count("error");
    view.drop_files(&[&samples.join("cmyk.jpg")]);
    view.wait_for_next("error", count);
    let events = view.events();
    let error = events.iter().rev().find(|it| it["event"] == "error");
    let message = error.expect("logged")["message"].as_str();
    assert!(message.is_some_and(|it| it.starts_with("cmyk.jpg has CMYK colours")));
    assert!(view.is_running());
}

/// How much bluer `shot` is than `other` in the mean: the tint of a mask.
fn bluer(shot: &Shot, other: &Shot) -> f64 {
    let blue = |shot: &Shot| -> f64 {
        let pixels = shot.rgb.as_chunks::<3>().0;
        let sum: f64 = pixels
            .iter()
            .map(|&[r, _, b]| f64::from(b) - f64::from(r))
            .sum();
        sum / pixels.len() as f64
    };
    blue(shot) - blue(other)
}

/// A window with the mask brush, which has gone over some hair; where that is, and pictures before and after.
fn with_mask<'a>(
    desktop: &'a Desktop,
    scene: &SmallScene,
    backend: &str,
) -> (View<'a>, [i32; 2], [Shot; 2]) {
    let more = ["--size", "860x640", "--backend", backend];
    let mut view = View::open(desktop, &scene.path, &more);
    let bare = view.picture();
    open_section(&mut view, "Hair", "Paint");
    view.after("places", |view| view.click(view.middle("Paint toggle")));
    // The overlay is there as soon as the brush is, and shows nothing yet.
    view.after("mask", |view| view.click(view.middle("Mask brush")));
    view.without_mouse().assert_same(&bare);
    view.type_number("Soft edge", "0");
    let [left, top, right, bottom] = view.place("View");
    let hair = [left + (right - left) * 2 / 5, top + (bottom - top) * 2 / 5];
    view.after("stroke", |view| view.drag(1, hair, [60, 20]));
    let masked = view.without_mouse();
    let around = |shot: &Shot| around(&view, shot, hair);
    let tint = bluer(&around(&masked), &around(&bare));
    println!("{backend}: the mask is {tint:.2} levels bluer");
    assert!(tint > 5.0, "{backend}: the mask is not seen: {tint}");
    (view, hair, [bare, masked])
}

/// The part of the picture that a stroke from `hair` on goes over.
fn around(view: &View, shot: &Shot, hair: [i32; 2]) -> Shot {
    let [left, top, ..] = view.place("View");
    let corner = [hair[0] - left - 40, hair[1] - top - 40].map(|at| at as usize);
    shot.part(corner, [140, 100])
}

#[test]
fn masks_are_painted_shown_kept_off_and_saved() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let (mut view, hair, [bare, masked]) = with_mask(&desktop, &scene, "cpu");
    let around = |view: &View, shot: &Shot| around(view, shot, hair);

    // Without its brush, or without the tick, the picture is as it was: masks are in no picture.
    view.click(view.middle("Show mask"));
    view.without_mouse().assert_same(&bare);
    view.click(view.middle("Show mask"));
    view.without_mouse().assert_same(&masked);
    view.click(view.middle("Colour brush"));
    view.without_mouse().assert_same(&bare);

    // Where it is masked, colour keeps off.
    view.settle();
    view.after("flood", |view| view.click(view.middle("Flood button")));
    let spared = view.without_mouse();
    view.after("undo", |view| view.key("ctrl+z"));
    view.after("flood", |view| view.click(view.middle("Clear mask button")));
    view.after("flood", |view| view.click(view.middle("Flood button")));
    let dyed = view.without_mouse();
    let inside = around(&view, &spared).difference(&around(&view, &dyed));
    assert!(inside > 2.0 * SAME, "the mask let dye through: {inside}");
    spared.assert_different(&bare);
    for _ in 0..2 {
        view.after("undo", |view| view.key("ctrl+z"));
    }
    view.without_mouse().assert_same(&bare);

    // The mask is back; released by Shift, and that undone; inverted; all of it by a flood.
    view.after("mask", |view| view.click(view.middle("Mask brush")));
    view.without_mouse().assert_same(&masked);
    view.after("stroke", |view| {
        view.tool("xdotool", &["keydown", "shift"]);
        view.drag(1, hair, [60, 20]);
        view.tool("xdotool", &["keyup", "shift"]);
    });
    view.without_mouse().assert_same(&bare);
    view.after("undo", |view| view.key("ctrl+z"));
    view.after("flood", |view| {
        view.click(view.middle("Invert mask button"));
    });
    let inverted = view.without_mouse();
    let tint = bluer(&around(&view, &inverted), &around(&view, &masked));
    assert!(tint < -2.0, "not inverted: {tint}");
    assert!(bluer(&inverted, &masked) > 0.0);
    view.after("flood", |view| view.click(view.middle("Flood button")));
    assert!(bluer(&view.without_mouse(), &inverted) > 0.0);
    // Another view has the mask where its hair is.
    let count = view.count("mask");
    view.after("view", |view| view.key("3"));
    view.wait_for("the mask of the other view", |events| {
        let told: Vec<_> = events.iter().filter(|it| it["event"] == "mask").collect();
        told.len() >= count + 2 && told.last().is_some_and(|it| it["is_shown"] == true)
    });
    let side = view.without_mouse();
    view.click(view.middle("Show mask"));
    let tint = bluer(&side, &view.without_mouse());
    assert!(tint > 1.0, "the view has no mask: {tint}");

    view.after("saved", |view| view.key("ctrl+s"));
    let groom = scene.path.with_file_name("small-painted.groom");
    let groom = strandlight_formats::Groom::read(&groom).expect("a groom");
    let mask = groom.attribute("mask").expect("saved");
    assert!(mask.components == 1 && mask.data.iter().all(|&it| it == 1.0));
    assert!(groom.attribute("dye").is_none());
    view.close();
}

/// What the log tells of the mask from an event on: whether it is shown, and made for the view.
fn mask_events(events: &[serde_json::Value]) -> Vec<(bool, bool)> {
    let told = events.iter().filter(|it| it["event"] == "mask");
    told.map(|it| (it["is_shown"] == true, it["is_of_view"] == true))
        .collect()
}

#[test]
fn the_mask_goes_along_with_the_hair_while_the_view_turns() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    for backend in ["cpu", "gpu"] {
        let (mut view, hair, _) = with_mask(&desktop, &scene, backend);
        let n_before = view.events().len();
        // With Ctrl the mouse turns the view while the brush is on.
        view.tool("xdotool", &["keydown", "ctrl"]);
        view.drag(1, hair, [80, 10]);
        view.tool("xdotool", &["keyup", "ctrl"]);
        view.wait_for("the mask of the other view", |events| {
            mask_events(&events[n_before..]).last() == Some(&(true, true))
        });
        let told = mask_events(&view.events()[n_before..]);
        assert!(told.contains(&(true, false)), "{backend}: it stays behind");
        assert!(
            told.iter().all(|it| it.0),
            "{backend}: it vanishes: {told:?}"
        );
        // An edit of the same view moves nothing.
        let n_before = view.events().len();
        view.after("flood", |view| view.click(view.middle("Flood button")));
        let told = mask_events(&view.events()[n_before..]);
        assert!(
            told.iter().all(|it| it.0),
            "{backend}: it vanishes: {told:?}"
        );
        view.close_unsaved();
    }
}

#[test]
fn masks_are_shown_over_pictures_of_a_device_too() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let (view, _, [bare, masked]) = with_mask(&desktop, &scene, "gpu");
    view.click(view.middle("Show mask"));
    view.without_mouse().assert_same(&bare);
    view.click(view.middle("Show mask"));
    view.without_mouse().assert_same(&masked);
    view.close_unsaved();
}

/// 40 x 30 pixels.
fn green_png() -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 40, 30);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("a header");
    let pixels = [60, 160, 40].repeat(1200);
    writer.write_image_data(&pixels).expect("pixels");
    writer.finish().expect("an end");
    file
}
