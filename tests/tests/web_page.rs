//! The viewer in a web page: `web/build` makes it, Chromium shows it, drawing with SwiftShader.

mod render_common;
mod web_common;

use std::path::Path;

use strandlight_formats::Scene;
use strandlight_runtime::{PreparedScene, Renderer};
use web_common::browser::{Browser, WITH_WEBGPU, WITHOUT_WEBGPU};
use web_common::picture::Pixels;
use web_common::server::serve;
use web_common::{SAMPLES, SCENE, build, page};

const SIZE: [u32; 2] = [760, 400];

/// Is the text that the page has for the canvas, which is the window's title, that of a finished
/// picture of the scene as it was saved, or not saved?
fn is_done(is_saved: bool) -> String {
    let star = if is_saved { "" } else { "*" };
    let title = format!("strandview - scene.toml{star} - {SAMPLES}/{SAMPLES}");
    format!("document.querySelector('canvas')?.getAttribute('alt') === {title:?}")
}

fn keep(name: &str, png: &[u8]) {
    if let Some(folder) = std::env::var_os("STRANDLIGHT_PICTURES") {
        let path = Path::new(&folder).join(format!("{name}.png"));
        std::fs::write(path, png).expect("the folder can be written");
    }
}

/// The page as it looks, kept under `name` for people to see.
fn look(browser: &mut Browser, name: &str) -> Pixels {
    let png = browser.screenshot();
    keep(name, &png);
    Pixels::from_png(&png)
}

/// What the native renderer draws of the page's scene.
fn native(folder: &Path, size: [usize; 2]) -> Pixels {
    let mut scene = Scene::read(&folder.join("scene.toml")).expect("a scene");
    scene.render.size = size.map(|side| side as u32);
    let prepared = PreparedScene::load(&scene).expect("all files");
    let context = render_common::context();
    let renderer = Renderer::new(&context, &prepared).expect("a renderer");
    let (picture, _) = renderer
        .render(&prepared.camera, scene.render.size, SAMPLES)
        .expect("a picture");
    let texels = picture.to_srgb8(prepared.exposure, prepared.tone_map);
    Pixels {
        width: size[0],
        height: size[1],
        rgb: texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
    }
}

#[test]
fn a_page_shows_the_scene_and_follows_the_mouse() {
    let folder = page();
    let address = serve(folder);
    let mut browser = Browser::start(WITH_WEBGPU, SIZE);
    let saved = tempfile::tempdir().expect("a temporary folder");
    browser.download_to(saved.path());
    browser.go(&address);
    browser.wait_for(&is_done(true));
    let opened = look(&mut browser, "web-opened");

    // Where the picture is, by the background's colour.
    let background = native(folder, [8, 8]).rgb[0];
    let extent = opened.extent(background).expect("a picture in the page");
    let [x, y, width, height] = extent;
    assert!(width > 300 && height > 250, "the picture is {extent:?}");
    let of_page = opened.part(extent);
    assert!(of_page.share_unlike(background) > 0.1, "no hair");
    let of_native = native(folder, [width, height]);
    let difference = of_page.difference(&of_native);
    println!("page against native: {difference:.3} levels, {extent:?}");
    assert!(
        difference < 1.0,
        "{difference} levels from the native picture"
    );

    // Orbiting by the mouse shows other hair; undo brings back what was.
    let centre = [(x + width / 2) as f64, (y + height / 2) as f64];
    browser.drag(centre, [centre[0] + 120.0, centre[1] + 40.0]);
    browser.wait_for(&is_done(false));
    let turned = look(&mut browser, "web-turned").part(extent);
    let difference = turned.difference(&of_page);
    println!("turned against opened: {difference:.3} levels");
    assert!(difference > 4.0, "the view did not turn: {difference}");
    browser.control('s');
    let file = saved.path().join("scene.toml");
    browser.wait_until("a saved scene", |_| file.exists());
    browser.wait_for(&is_done(true));
    let before = Scene::read(&folder.join("scene.toml")).expect("a scene");
    let after = Scene::read(&file).expect("the page offers its scene as a file");
    assert_ne!(before.camera, after.camera);
    assert_eq!((before.groom, before.hair), (after.groom, after.hair));
    browser.control('z');
    browser.wait_for(&is_done(false));
    let undone = look(&mut browser, "web-undone").part(extent);
    let difference = undone.difference(&of_page);
    assert!(difference < 0.5, "undone: {difference} levels");

    // Another size of the page, another picture.
    browser.resize([620, 340]);
    let mut smaller = undone;
    browser.wait_until("a smaller picture", |browser| {
        smaller = Pixels::from_png(&browser.screenshot());
        let found = smaller.extent(background);
        found.is_some_and(|[.., of_width, of_height]| of_width < width && of_height < height)
    });
    browser.wait_for(&is_done(false));
    look(&mut browser, "web-smaller");
    assert_eq!(browser.console, Vec::<String>::new());
}

#[test]
fn without_webgpu_the_page_says_so_in_a_sentence() {
    let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
    browser.go(&serve(page()));
    browser.wait_for("document.body.innerText.includes('WebGPU')");
    let text = browser.evaluate("document.body.innerText");
    let text = text.as_str().unwrap_or_default().trim().to_owned();
    look(&mut browser, "web-without");
    assert!(
        text.starts_with("This page draws with WebGPU, which this browser does not offer"),
        "{text}"
    );
    assert!(
        !text.contains('\n') && text.matches(". ").count() == 0,
        "{text}"
    );
}

#[test]
fn what_cannot_be_opened_is_said_in_the_page() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in std::fs::read_dir(page()).expect("the page") {
        let path = file.expect("a file").path();
        let name = path.file_name().expect("a name").to_owned();
        if name != "five.lights" {
            std::fs::copy(&path, folder.path().join(name)).expect("copied");
        }
    }
    let address = serve(folder.path());
    let mut browser = Browser::start(WITH_WEBGPU, SIZE);
    for (bytes, needle) in [
        (
            None,
            "five.lights: cannot be fetched: the server answers 404",
        ),
        (Some("not lights"), "five.lights"),
    ] {
        if let Some(bytes) = bytes {
            std::fs::write(folder.path().join("five.lights"), bytes).expect("written");
        }
        browser.go(&address);
        browser.wait_for(&format!("document.body.innerText.includes({needle:?})"));
        let text = browser.evaluate("document.body.innerText");
        assert!(
            text.as_str()
                .is_some_and(|text| text.starts_with("strandview: ")),
            "{text}"
        );
    }
}

#[test]
fn the_folder_holds_a_page_and_is_nobody_elses() {
    let page = page();
    let mut names: Vec<String> = std::fs::read_dir(page)
        .expect("the page")
        .map(|file| {
            file.expect("a file")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    let wanted = [
        "a wig.groom",
        "default.tables",
        "five.lights",
        "index.html",
        "scene.toml",
        "strandview.js",
        "strandview_bg.wasm",
    ];
    assert_eq!(names, wanted);
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("letter.txt"), "mine").expect("written");
    let scene = page.with_file_name("scene").join(SCENE);
    let refused = build(&scene, folder.path()).expect_err("not its own");
    assert!(refused.contains("was not made by web/build"), "{refused}");
    let refused = build(Path::new("nowhere.toml"), folder.path()).expect_err("no scene");
    assert!(refused.contains("nowhere.toml: no such file"), "{refused}");
    assert_eq!(std::fs::read_dir(folder.path()).expect("there").count(), 1);
}
