//! Lights in the window: those that are added by hand, sets in place of each other, and parts of the light.

use strandlight_formats::{Background, BakedFile, LightSet};
use strandlight_tests::panoramas::striped;
use strandlight_tests::project_root;

use crate::window_common::{Desktop, SAME, SmallScene, View};

const CPU: [&str; 4] = ["--backend", "cpu", "--size", "860x900"];

/// Opens the section on lights and leaves that on hair.
fn open_lights(view: &mut View) {
    view.click(view.middle("Hair"));
    view.wait_until_gone("IOR slider");
    view.click(view.middle("Lights"));
    view.wait_for_place("Add light button");
}

/// Where the light map has azimuth and elevation, degrees.
fn on_map(view: &View, [azimuth, elevation]: [f64; 2]) -> [i32; 2] {
    let [left, top, right, bottom] = view.place("Light map").map(f64::from);
    let (u, v) = (0.5 - azimuth / 360.0, 0.5 - elevation / 180.0);
    let x = left + u * (right - left);
    let y = top + v * (bottom - top);
    [x, y].map(|at| at.round() as i32)
}

#[test]
fn lights_are_added_dragged_placed_and_removed() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    open_lights(&mut view);
    view.after("edit", |view| view.click(view.middle("Add light button")));
    view.wait_for_place("Remove light button");
    let added = view.without_mouse();
    assert!(added.difference(&start) > SAME, "it adds nothing");

    // It comes from the upper left of the eye. On the map it is dragged by itself.
    let saved = |view: &mut View| {
        let before = view.count("saved");
        view.key("ctrl+s");
        view.wait_for_next("saved", before);
        scene.read().lights
    };
    let light = saved(&mut view).added[0];
    let (azimuth, elevation) = (light.azimuth_deg, light.elevation_deg);
    assert!(
        (-90.0..0.0).contains(&azimuth) && (20.0..70.0).contains(&elevation),
        "{light:?}"
    );
    assert_eq!(light.width_deg, 8.0);
    let from = on_map(&view, [light.azimuth_deg, light.elevation_deg]);
    let to = on_map(&view, [60.0, 20.0]);
    view.after("edit", |view| {
        view.drag(1, from, [to[0] - from[0], to[1] - from[1]]);
    });
    let moved = view.without_mouse();
    assert!(moved.difference(&added) > SAME, "it stays");
    let lights = saved(&mut view);
    let near = |found: f64, wanted: f64| (found - wanted).abs() < 3.0;
    let light = lights.added[0];
    assert!(
        near(light.azimuth_deg, 60.0) && near(light.elevation_deg, 20.0),
        "{light:?}"
    );
    assert_eq!(lights.rotate_deg, 0.0, "the set was turned");

    // Beside it the set is turned, and it stays.
    let beside = on_map(&view, [-100.0, -60.0]);
    view.after("edit", |view| view.drag(1, beside, [30, 0]));
    let lights = saved(&mut view);
    assert_ne!(lights.rotate_deg, 0.0);
    assert_eq!(lights.added, [light]);
    view.after("undo", |view| view.key("ctrl+z"));

    // A click on a strand says where its highlight is.
    view.click(view.middle("Place highlight button"));
    view.after("edit", |view| view.click(view.middle("View")));
    let placed = saved(&mut view).added[0];
    assert_ne!(placed.azimuth_deg, light.azimuth_deg);
    view.without_mouse();

    // A double click on the map adds another; both go, and come back.
    let at = on_map(&view, [120.0, -50.0]);
    view.after("edit", |view| {
        view.move_to(at);
        view.tool("xdotool", &["click", "--repeat", "2", "--delay", "80", "1"]);
    });
    let lights = saved(&mut view);
    assert_eq!(lights.added.len(), 2);
    assert!(near(lights.added[1].azimuth_deg, 120.0) && near(lights.added[1].elevation_deg, -50.0));
    view.after("edit", |view| {
        view.click(view.middle("Remove light button"))
    });
    assert_eq!(saved(&mut view).added, [placed]);
    // Added, dragged, placed, added, removed.
    for _ in 0..5 {
        view.after("undo", |view| view.key("ctrl+z"));
    }
    view.without_mouse().assert_same(&start);
    view.close_unsaved();
}

#[test]
fn the_lights_of_the_set_are_turned_in_the_view() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    let middle = view.middle("View");
    view.after("edit", |view| {
        view.tool("xdotool", &["keydown", "ctrl", "keydown", "shift"]);
        view.drag(1, middle, [80, 0]);
        view.tool("xdotool", &["keyup", "shift", "keyup", "ctrl"]);
    });
    assert_eq!(view.count("view"), 0, "the camera was moved");
    let turned = view.without_mouse();
    assert!(turned.difference(&start) > 2.0 * SAME);
    let before = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", before);
    let degrees = scene.read().lights.rotate_deg;
    // 80 points of 0.008 radians, less what is no drag yet.
    assert!(degrees > 25.0 && degrees < 38.0, "{degrees}");
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.close_unsaved();
}

#[test]
fn light_sets_of_the_folder_take_each_other_s_place() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    let mut other = LightSet::read(&at("small.lights")).expect("a light set");
    other.lights.truncate(2);
    for light in &mut other.lights {
        light.rgb = [light.rgb[2], light.rgb[1], 4.0 * light.rgb[0]];
    }
    other.write(&at("zenith.lights")).expect("written");
    std::fs::write(at("broken.lights"), "no light set").expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    view.after("edit", |view| view.key("period"));
    let swapped = view.without_mouse();
    assert!(swapped.difference(&start) > 2.0 * SAME);
    let before = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", before);
    assert_eq!(scene.read().lights.file.to_str(), Some("zenith.lights"));
    // Round, past what is no light set, and back.
    view.after("edit", |view| view.key("period"));
    view.without_mouse().assert_same(&start);
    view.after("edit", |view| view.key("comma"));
    view.without_mouse().assert_same(&swapped);
    for _ in 0..3 {
        view.after("undo", |view| view.key("ctrl+z"));
    }
    view.without_mouse().assert_same(&start);
    view.close_unsaved();
}

/// Opens the section that chooses the background.
fn open_render(view: &mut View) {
    view.click(view.middle("Hair"));
    view.wait_until_gone("IOR slider");
    view.click(view.middle("Render"));
    view.wait_for_place("Background Map");
}

#[test]
fn the_map_is_chosen_turned_and_follows_the_light_set() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    let other = LightSet::read(&at("small.lights")).expect("a light set");
    other.write(&at("tall.lights")).expect("written");
    other.write(&at("zenith.lights")).expect("written");
    for backend in ["cpu", "gpu"] {
        let words = ["--backend", backend, "--size", "860x900"];
        std::fs::write(&scene.path, SmallScene::text("")).expect("written");
        for name in ["small.panorama", "zenith.panorama"] {
            let _ = std::fs::remove_file(at(name));
        }
        // Without a map there is nothing to choose.
        let mut view = View::open(&desktop, &scene.path, &words);
        open_render(&mut view);
        let start = view.without_mouse();
        let edits = view.count("edit");
        view.click(view.middle("Background Map"));
        view.settle();
        view.without_mouse().assert_same(&start);
        assert_eq!(
            view.count("edit"),
            edits,
            "a map that is not there was chosen"
        );

        // A map that is dropped comes with its lights, and takes its place in the background.
        striped(256).write(&at("small.panorama")).expect("written");
        view.after("edit", |view| view.drop_files(&[&at("small.panorama")]));
        let dropped = view.without_mouse();
        dropped.assert_different(&start);
        view.after("edit", |view| view.click(view.middle("Background Lights")));
        view.without_mouse().assert_same(&start);
        view.after("edit", |view| view.click(view.middle("Background Map")));
        view.without_mouse().assert_same(&dropped);

        // It turns with the lights, and back.
        let middle = view.middle("View");
        view.after("edit", |view| {
            view.tool("xdotool", &["keydown", "ctrl", "keydown", "shift"]);
            view.drag(1, middle, [80, 0]);
            view.tool("xdotool", &["keyup", "shift", "keyup", "ctrl"]);
        });
        view.without_mouse().assert_different(&dropped);
        view.after("undo", |view| view.key("ctrl+z"));
        view.without_mouse().assert_same(&dropped);

        // The next light set of the folder has no map: its lights are seen, and one step back takes all of it back.
        view.after("edit", |view| view.key("period"));
        let lights = view.without_mouse();
        lights.assert_different(&dropped);
        let before = view.count("saved");
        view.key("ctrl+s");
        view.wait_for_next("saved", before);
        let saved = scene.read();
        assert_eq!(saved.lights.file.to_str(), Some("tall.lights"));
        assert_eq!(saved.lights.panorama, None);
        assert_eq!(saved.render.background, Background::Lights);
        view.after("undo", |view| view.key("ctrl+z"));
        view.without_mouse().assert_same(&dropped);

        // The one before it has one, which is there with it.
        striped(64).write(&at("zenith.panorama")).expect("written");
        view.after("edit", |view| view.key("comma"));
        view.without_mouse().assert_different(&lights);
        let before = view.count("saved");
        view.key("ctrl+s");
        view.wait_for_next("saved", before);
        let saved = scene.read();
        assert_eq!(saved.lights.file.to_str(), Some("zenith.lights"));
        let panorama = saved.lights.panorama.as_deref();
        assert_eq!(panorama.and_then(|it| it.to_str()), Some("zenith.panorama"));
        assert_eq!(saved.render.background, Background::Panorama);
        view.close();
    }
}

#[test]
fn a_map_that_is_fitted_can_be_seen_too() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let map = scene.folder.path().join("studio.exr");
    std::fs::copy(project_root().join("data/sample/studio.exr"), &map).expect("copied");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    open_render(&mut view);
    view.after("edit", |view| view.drop_files(&[&map]));
    let lights = view.without_mouse();
    view.after("edit", |view| view.click(view.middle("Background Map")));
    let seen = view.without_mouse();
    // The same light, sharper.
    assert!(seen.difference(&lights) > 2.0 * SAME);
    assert!(!scene.folder.path().join("studio.panorama").exists());
    let before = view.count("saved");
    view.key("ctrl+s");
    view.wait_for_next("saved", before);
    let saved = scene.read();
    let file = |name: &str| Some(std::path::PathBuf::from(name));
    assert_eq!(saved.lights.file.to_str(), Some("studio.lights"));
    assert_eq!(saved.lights.panorama, file("studio.panorama"));
    // Ground truth goes to its light.
    assert_eq!(saved.lights.map, file("studio.exr"));
    view.close();
    let view = View::open(&desktop, &scene.path, &CPU);
    view.without_mouse().assert_same(&seen);
    view.close();
    // Opened alone, it is what one sees.
    let lone = scene.folder.path().join("lone");
    std::fs::create_dir(&lone).expect("made");
    std::fs::copy(&map, lone.join("sky.exr")).expect("copied");
    let mut view = View::open(&desktop, &lone.join("sky.exr"), &CPU);
    view.asked("save as", |view| view.key("ctrl+s"));
    view.key("Return");
    view.wait_for_next("saved", 0);
    let saved = view.saved().expect("a scene");
    let saved = strandlight_formats::Scene::read(saved).expect("a scene");
    assert_eq!(saved.render.background, Background::Panorama);
    assert_eq!(saved.lights.panorama, file("sky.panorama"));
    assert_eq!(saved.lights.map, file("sky.exr"));
    view.close();
}

#[test]
fn parts_of_the_light_are_shown_on_both_renderers() {
    for backend in ["cpu", "gpu"] {
        let (desktop, scene) = (Desktop::start(), SmallScene::new());
        let mut view = View::open(&desktop, &scene.path, &["--backend", backend]);
        let picture = view.without_mouse();
        let mut before = picture.clone();
        for name in [
            "R",
            "TT",
            "TRT",
            "Single scattering",
            "Multiple scattering",
            "Global scattering",
            "Local scattering",
            "Transmittance",
        ] {
            view.key("shift+n");
            view.wait_for(name, |events| {
                let last = events.iter().rfind(|event| event["event"] == "inspected");
                last.is_some_and(|event| event["inspection"] == name)
            });
            let shown = view.without_mouse();
            assert!(shown.difference(&before) > SAME, "{backend}: {name}");
            before = shown;
        }
        // An edit is followed.
        let edits = view.count("inspected");
        view.after("edit", |view| {
            view.drag(1, view.middle("IOR slider"), [25, 0])
        });
        view.wait_for_next("inspected", edits);
        view.after("undo", |view| view.key("ctrl+z"));
        // From the menu, and back.
        view.click(view.middle("View menu"));
        view.wait_for_place("Parts of the light menu");
        view.click(view.middle("Parts of the light menu"));
        view.wait_for_place("TT entry");
        // All of it is within this low window.
        for name in ["Transmittance entry", "Panel entry", "Frame all hair entry"] {
            let [left, top, right, bottom] = view.place(name);
            assert!(
                left >= 0 && top >= 0 && right <= 760 && bottom <= 480,
                "{name}"
            );
        }
        view.click(view.middle("TT entry"));
        view.wait_until_gone("TT entry");
        view.wait_for("TT", |events| {
            let last = events.iter().rfind(|event| event["event"] == "inspected");
            last.is_some_and(|event| event["inspection"] == "TT")
        });
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
fn the_history_has_thumbnails_and_goes_to_any_step() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    let thumbnails = view.count("thumbnail");
    assert_eq!(thumbnails, 1, "that of the scene as it was opened");
    view.after("edit", |view| view.type_number("Absorption red", "6"));
    let red = view.without_mouse();
    view.after("edit", |view| view.type_number("Absorption green", "0.1"));
    let green = view.without_mouse();
    view.click(view.middle("Hair"));
    view.wait_until_gone("IOR slider");
    view.click(view.middle("Looks"));
    view.wait_for_place("Step 2");
    assert_eq!(view.count("thumbnail"), 3);
    // Each shows its picture: they differ from one another.
    let thumbnail = |view: &View, step: usize| {
        let [left, top, right, _] = view.place(&format!("Step {step}")).map(|x| x as usize);
        // Within the frame of the one that is shown.
        view.shot()
            .part([left + 3, top + 3], [right - left - 6, 42])
    };
    view.move_to([3, 3]);
    let shown: Vec<_> = (0..3).map(|step| thumbnail(&view, step)).collect();
    assert!(
        shown.iter().all(|shot| shot.contrast() > 5.0),
        "they show nothing"
    );
    assert!(shown[0].difference(&shown[1]) > SAME && shown[1].difference(&shown[2]) > SAME);
    view.after("undo", |view| view.click(view.middle("Step 0")));
    view.without_mouse().assert_same(&start);
    view.after("redo", |view| view.click(view.middle("Step 2")));
    view.without_mouse().assert_same(&green);
    view.after("undo", |view| view.click(view.middle("Step 1")));
    view.without_mouse().assert_same(&red);
    // No picture is taken twice, and the window rests.
    assert_eq!(view.count("thumbnail"), 3);
    view.assert_at_rest("gone to");
    view.close_unsaved();
}
