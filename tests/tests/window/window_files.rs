//! Files in and out of a window: chosen from the list, dropped, fitted, saved for the first time.

use std::path::Path;

use strandlight_formats::{BakedFile, Groom, LightSet, Scene};
use strandlight_tests::luts::grid_cube;
use strandlight_tests::{assert_done, project_root, strandlight};

use crate::window_common::{DIFFERENT, Desktop, SmallScene, View};

const CPU: [&str; 2] = ["--backend", "cpu"];

/// What the window says of the last thing that failed.
fn last_error(view: &View) -> String {
    let events = view.events();
    let error = events.iter().rev().find(|line| line["event"] == "error");
    error.map_or(String::new(), |line| line["message"].to_string())
}

fn hair(folder: &Path, name: &str) -> std::path::PathBuf {
    let at = |name: &str| folder.join(name);
    let mut groom = strandlight();
    groom.args(["groom", "generate", "--style", "bob", "--strands", "250"]);
    groom.args(["--points-per-strand", "6", "-o"]);
    assert_done(groom.arg(at("bob.groom")));
    let mut export = strandlight();
    export
        .arg("export")
        .arg(at("bob.groom"))
        .arg("-o")
        .arg(at(name));
    assert_done(&mut export);
    std::fs::remove_file(at("bob.groom")).expect("removed");
    at(name)
}

#[test]
fn a_file_is_chosen_from_the_list_by_mouse_and_keys() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let dark = SmallScene::text("sigma_a = [6.0, 6.0, 6.0]");
    std::fs::write(scene.folder.path().join("dark.toml"), &dark).expect("written");
    let below = scene.folder.path().join("below");
    std::fs::create_dir(&below).expect("made");
    let above = dark.replace("'small.", "'../small.");
    std::fs::write(below.join("deep.toml"), above).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    // By mouse: a click chooses, the button opens.
    view.asked("open", |view| view.key("ctrl+o"));
    view.click(view.middle("File dark.toml"));
    view.after("opened", |view| view.click(view.middle("Open file button")));
    assert!(view.title().contains("dark.toml - "), "{}", view.title());
    let dark = view.without_mouse();
    dark.assert_different(&start);
    // Into a folder, and up again.
    view.asked("open", |view| view.key("ctrl+o"));
    view.click(view.middle("File below"));
    view.wait_for("the folder's files", |events| {
        let places = events.iter().rev().find(|line| line["event"] == "places");
        places.is_some_and(|places| !places["places"]["File deep.toml"].is_null())
    });
    view.click(view.middle("Parent folder button"));
    view.wait_for("the first folder", |events| {
        let places = events.iter().rev().find(|line| line["event"] == "places");
        places.is_some_and(|places| !places["places"]["File dark.toml"].is_null())
    });
    // By keys: a part of the name is enough.
    view.key("Escape");
    view.wait_until_gone("Path");
    view.asked("open", |view| view.key("ctrl+o"));
    view.tool("xdotool", &["type", "--delay", "40", "small.t"]);
    view.after("opened", |view| view.key("Return"));
    view.without_mouse().assert_same(&start);
    // A path can be typed whole; one that is not there says so.
    let errors = view.count("error");
    view.asked("open", |view| view.key("ctrl+o"));
    view.type_path(&scene.folder.path().join("nowhere.toml"));
    view.wait_for_next("error", errors);
    assert!(
        last_error(&view).contains("nowhere.toml"),
        "{}",
        last_error(&view)
    );
    // What was open is remembered, by the next window too.
    let state = desktop.state("recent.json");
    let recent: Vec<std::path::PathBuf> = serde_json::from_str(&state).expect("a list of paths");
    assert_eq!(recent[0], scene.path);
    assert!(recent[1].ends_with("dark.toml"), "{recent:?}");
}

#[test]
fn hair_of_another_program_and_a_map_are_swapped_in_and_saved_beside_the_scene() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let foreign = hair(scene.folder.path(), "bob.abc");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    view.after("edit", |view| view.drop_files(&[&foreign]));
    let bob = view.without_mouse();
    bob.assert_different(&start);
    // Nothing is written until the scene is saved.
    let groom = scene.folder.path().join("bob.groom");
    assert!(!groom.exists());
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&start);
    view.after("redo", |view| view.key("ctrl+y"));
    // Lights are fitted to a map by the program beside this one.
    let map = scene.folder.path().join("studio.exr");
    std::fs::copy(project_root().join("data/sample/studio.exr"), &map).expect("copied");
    view.after("edit", |view| view.drop_files(&[&map]));
    let fitted = view.without_mouse();
    assert!(fitted.difference(&bob) > 0.1 * DIFFERENT);
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    let saved = scene.read();
    assert_eq!(saved.groom_path(), groom);
    assert_eq!(Groom::read(&groom).expect("a groom").n_strands(), 250);
    let lights = LightSet::read(&saved.lights_path()).expect("a light set");
    assert_eq!(lights.lights.len(), 40);
    view.close();
    let view = View::open(&desktop, &scene.path, &CPU);
    view.without_mouse().assert_same(&fitted);
}

#[test]
fn files_that_are_dropped_wait_for_work_under_way_and_are_all_taken() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let [foreign, other] = ["bob.abc", "other.abc"].map(|name| hair(scene.folder.path(), name));
    let lut = scene.folder.path().join("swapped.cube");
    let swapped = grid_cube(9, |[r, g, b]| [b, 1.0 - g, r]);
    std::fs::write(&lut, swapped).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    // Reading the first one takes a while.
    view.drop_files(&[&foreign, &lut]);
    view.wait_for_next("edit", 1);
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    let saved = scene.read();
    assert_eq!(saved.groom.file.to_str(), Some("bob.groom"));
    assert_eq!(saved.render.lut, Some("swapped.cube".into()));
    // A turntable that is being written is written whole.
    view.asked("picture", |view| view.key("shift+p"));
    view.type_number("Turntable frames", "8");
    let jobs = view.count("job");
    view.click(view.middle("Path"));
    view.type_path(&scene.folder.path().join("turn_##.png"));
    view.wait_for_next("job", jobs);
    view.drop_files(&[&other]);
    view.wait_for_next("edit", 2);
    assert_eq!([view.count("picture"), view.count("job")], [1, jobs + 2]);
    let frame = scene.folder.path().join("turn_07.png");
    assert!(frame.exists(), "the last frame");
    let events = view.events();
    let at = |name: &str| events.iter().rposition(|line| line["event"] == name);
    assert!(at("picture") < at("edit"), "one after the other");
}

#[test]
fn a_lut_is_dropped_saved_and_removed() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let lut = scene.folder.path().join("swapped.cube");
    let swapped = grid_cube(9, |[r, g, b]| [b, 1.0 - g, r]);
    std::fs::write(&lut, swapped).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.after("places", |view| view.click(view.middle("Hair")));
    view.after("places", |view| view.click(view.middle("Render")));
    let start = view.without_mouse();
    view.after("edit", |view| view.drop_files(&[&lut]));
    let shown = view.without_mouse();
    shown.assert_different(&start);
    view.key("ctrl+s");
    view.wait_for_next("saved", 0);
    assert_eq!(scene.read().render.lut, Some("swapped.cube".into()));
    view.after("edit", |view| view.click(view.middle("LUT remove")));
    view.without_mouse().assert_same(&start);
    view.after("undo", |view| view.key("ctrl+z"));
    view.without_mouse().assert_same(&shown);
    view.close();
    let view = View::open(&desktop, &scene.path, &CPU);
    view.without_mouse().assert_same(&shown);
}

#[test]
fn what_cannot_be_opened_is_refused_by_what_it_is() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let at = |name: &str| scene.folder.path().join(name);
    std::fs::write(at("notes.txt"), "hair").expect("written");
    std::fs::write(at("photo.jpg"), b"\xff\xd8\xff\xe0 photo").expect("written");
    std::fs::write(at("broken.exr"), b"\x76\x2f\x31\x01 map").expect("written");
    std::fs::write(at("broken.hair"), b"HAIR\x01\0\0\0").expect("written");
    std::fs::write(at("broken.cube"), "LUT_1D_SIZE 2\n0 0 0\n0 nan 0\n").expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    for (name, needle) in [
        ("notes.txt", "some other text"),
        ("photo.jpg", "the file is cut short"),
        ("broken.exr", "broken.exr"),
        ("broken.hair", "broken.hair"),
        ("broken.cube", "broken.cube:3: row is 0 nan 0"),
    ] {
        let errors = view.count("error");
        view.drop_files(&[&at(name)]);
        view.wait_for_next("error", errors);
        let said = last_error(&view);
        assert!(said.contains(name) && said.contains(needle), "{said}");
    }
    assert_eq!(view.count("edit"), 0);
}

#[test]
fn a_window_opens_on_a_lone_groom_map_or_nothing_and_asks_where_to_save() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let folder = tempfile::tempdir().expect("a folder");
    let foreign = hair(folder.path(), "bob.hair");
    let mut view = View::open(&desktop, &foreign, &CPU);
    assert!(view.title().contains("bob.toml"), "{}", view.title());
    let start = view.without_mouse();
    assert!(start.contrast() > 5.0, "the picture shows nothing");
    let names = || {
        let entries = std::fs::read_dir(folder.path())
            .expect("a folder")
            .flatten();
        let mut names: Vec<_> = entries.map(|entry| entry.file_name()).collect();
        names.sort();
        names
    };
    // A picture takes nothing away that is in memory only.
    view.asked("picture", |view| view.key("shift+p"));
    view.type_path(&scene.folder.path().join("bob.png"));
    view.wait_for_next("picture", 0);
    assert_eq!(names(), ["bob.hair"], "nothing is written unasked");
    view.asked("save as", |view| view.key("ctrl+s"));
    view.key("Return");
    view.wait_for_next("saved", 0);
    assert_eq!(
        names(),
        ["bob.groom", "bob.hair", "bob.toml", "studio.lights"]
    );
    let saved = Scene::read(folder.path().join("bob.toml")).expect("a scene");
    assert_eq!(saved.groom.file.to_str(), Some("bob.groom"));
    view.close();
    let view = View::open(&desktop, &folder.path().join("bob.toml"), &CPU);
    view.without_mouse().assert_same(&start);
    view.close();

    // A map alone lights plain hair; a light set does too.
    let map = folder.path().join("studio.exr");
    std::fs::copy(project_root().join("data/sample/studio.exr"), &map).expect("copied");
    let of_map = View::open(&desktop, &map, &CPU);
    assert!(of_map.without_mouse().contrast() > 5.0);
    of_map.close();
    let lights = scene.folder.path().join("small.lights");
    let of_lights = View::open(&desktop, &lights, &CPU);
    assert!(of_lights.without_mouse().contrast() > 5.0);
    of_lights.close();

    // Nothing: the sample.
    let sample = View::open_in(&desktop, folder.path(), &CPU);
    assert!(sample.title().contains("sample.toml"), "{}", sample.title());
    assert!(sample.without_mouse().contrast() > 5.0);
    sample.close();
    assert_eq!(names().len(), 5, "{:?}", names());
}

#[test]
fn a_picture_is_written_in_the_size_and_format_that_were_asked_for() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let mut view = View::open(&desktop, &scene.path, &CPU);
    view.asked("picture", |view| view.key("shift+p"));
    view.type_number("Width", "320");
    view.type_number("Height", "200");
    let out = scene.folder.path().join("still.png");
    view.click(view.middle("Path"));
    view.type_path(&out);
    view.wait_for_next("picture", 0);
    let file = std::fs::read(&out).expect("a picture");
    let info = png::Decoder::new(std::io::Cursor::new(file))
        .read_info()
        .expect("a PNG");
    assert_eq!((info.info().width, info.info().height), (320, 200));
    // What is there is not replaced unasked.
    view.asked("picture", |view| view.key("shift+p"));
    view.asked("replace", |view| view.type_path(&out));
    view.click(view.middle("Cancel button"));
    view.wait_for_place("Path");
    view.key("Escape");
    view.wait_until_gone("Path");
    // OpenEXR, of the view as it is.
    let out = scene.folder.path().join("still.exr");
    view.asked("picture", |view| view.key("shift+p"));
    view.type_path(&out);
    view.wait_for_next("picture", 1);
    let start = std::fs::read(&out).expect("a picture");
    assert!(start.starts_with(b"\x76\x2f\x31\x01"));
    // The same in layers.
    view.asked("picture", |view| view.key("shift+p"));
    view.until_drawn("Layers", |view| view.click(view.middle("OpenEXR format")));
    view.until_drawn("Layers", |view| view.click(view.middle("Layers")));
    let layers = scene.folder.path().join("layers.exr");
    view.click(view.middle("Path"));
    view.type_path(&layers);
    view.wait_for_next("picture", 2);
    let layers = std::fs::read(&layers).expect("a picture");
    let has = |file: &[u8], name: &[u8]| file.windows(name.len()).any(|found| found == name);
    assert!(has(&layers, b"coverage") && !has(&start, b"coverage"));
    // A turntable.
    view.asked("picture", |view| view.key("shift+p"));
    view.type_number("Width", "60");
    view.type_number("Height", "40");
    view.type_number("Turntable frames", "3");
    view.click(view.middle("Path"));
    view.type_path(&scene.folder.path().join("turn_##.png"));
    view.wait_for_next("picture", 3);
    let frames = [0, 1, 2].map(|ix| {
        let path = scene.folder.path().join(format!("turn_{ix:02}.png"));
        std::fs::read(path).expect("a frame")
    });
    assert!(frames[0] != frames[1] && frames[1] != frames[2]);
    view.asked("picture", |view| view.key("shift+p"));
    view.asked("picture", |view| {
        view.type_path(&scene.folder.path().join("still.gif"))
    });
    assert!(
        last_error(&view).contains(".png or .exr"),
        "{}",
        last_error(&view)
    );
}

/// `small.groom` of `scene`, larger and elsewhere, under another name.
fn other_hair(scene: &SmallScene, name: &str, scale: f32, shift_cm: f32) -> std::path::PathBuf {
    let small = scene.folder.path().join("small.groom");
    let mut groom = Groom::read(&small).expect("a groom");
    for point in &mut groom.points {
        *point = point.map(|x| scale * x);
        point[0] += shift_cm;
    }
    let path = scene.folder.path().join(name);
    groom.write(&path).expect("written");
    path
}

#[test]
fn hair_that_is_put_in_is_framed_where_it_would_not_be_seen() {
    let (desktop, scene) = (Desktop::start(), SmallScene::new());
    let camera = "[camera]\nposition = [0, 8, 80]\ntarget = [0, 0, 0]\nfov_deg = 30\n";
    std::fs::write(&scene.path, SmallScene::text("") + camera).expect("written");
    let mut view = View::open(&desktop, &scene.path, &CPU);
    let start = view.without_mouse();
    assert!(start.contrast() > 5.0, "the picture shows nothing");
    for (name, scale, shift_cm) in [
        ("aside.groom", 1.0, 500.0),
        ("speck.groom", 0.01, 0.0),
        ("huge.groom", 100.0, 0.0),
    ] {
        let path = other_hair(&scene, name, scale, shift_cm);
        let before = view.count("view");
        view.after("edit", |view| view.drop_files(&[&path]));
        assert_eq!(view.count("view"), before + 1, "{name}");
        assert!(!view.has_place("Out of view"), "{name}");
        let shown = view.without_mouse();
        assert!(shown.contrast() > 5.0, "{name}: it shows nothing");
        // So is the hair of before, when it comes back; the scene's camera is what it was.
        view.after("undo", |view| view.key("ctrl+z"));
        assert!(!view.has_place("Out of view"), "{name}");
        view.after("view", |view| view.key("Home"));
        view.without_mouse().assert_same(&start);
    }
    // Hair that is seen well enough is not, and nor is that of a scene that is opened: its camera counts.
    let like = other_hair(&scene, "like.groom", 1.2, 1.0);
    let before = view.count("view");
    view.after("edit", |view| view.drop_files(&[&like]));
    assert_eq!(view.count("view"), before);
    let text = SmallScene::text("").replace("small.groom", "speck.groom") + camera;
    let speck = scene.folder.path().join("speck.toml");
    std::fs::write(&speck, text).expect("written");
    view.asked("unsaved", |view| view.drop_files(&[&speck]));
    view.after("opened", |view| view.answer("Don't save"));
    assert_eq!(view.count("view"), before);
    assert!(view.has_place("Out of view"));
    view.after("view", |view| view.key("f"));
    view.wait_until_gone("Out of view");
    view.close();
}
