//! Variation and brushes in a real window: the panel's sections, a photo, colours that are picked.

use crate::window_common::{Desktop, SAME, Shot, SmallScene, View};

/// Closes the section on top and opens another.
fn open_section(view: &mut View, closed: &str, opened: &str) {
    view.after("places", |view| view.click(view.middle(closed)));
    view.after("places", |view| view.click(view.middle(opened)));
    view.settle();
}

#[test]
fn hair_varies_by_its_section_and_undo_takes_that_back() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &[]);
    let start = view.picture();
    open_section(&mut view, "Hair", "Variation");
    let mut before = start;
    for (name, value) in [
        ("Melanin per strand", "0.6"),
        ("Grey", "0.3"),
        ("Frizz", "0.8"),
        ("Seed", "7"),
    ] {
        view.after("edit", |view| view.type_number(name, value));
        let now = view.without_mouse();
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
    view.without_mouse().assert_same(&before);
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
    view.click(view.middle("Reference photo"));
    view.after("flood", |view| view.click(view.middle("Flood button")));
    view.without_mouse().assert_different(&dyed);
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
