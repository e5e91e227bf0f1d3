//! The viewer in a web page: `web/build` makes it, Chromium shows it, drawing with SwiftShader.

use std::path::Path;

use strandlight_formats::{BakedFile, Groom, Scene};

use crate::web_common::browser::{Browser, WITH_WEBGPU, WITHOUT_WEBGPU};
use crate::web_common::picture::{Pixels, keep, native, native_on_cpu};
use crate::web_common::server::{serve, serve_isolated};
use crate::web_common::{SCENE, build, page, page_with_threads};

const SIZE: [u32; 2] = [760, 400];

/// Is the text that the page has for the canvas, which is the window's title, that of a finished
/// picture of the scene as it was saved, or not saved?
pub fn is_done(is_saved: bool) -> String {
    let star = if is_saved { "" } else { "*" };
    let title = format!("strandview - scene.toml{star} - done");
    format!("document.querySelector('canvas')?.getAttribute('alt') === {title:?}")
}

/// The page as it looks, kept under `name` for people to see.
fn look(browser: &mut Browser, name: &str) -> Pixels {
    let png = browser.screenshot();
    keep(name, &png);
    Pixels::from_png(&png)
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

    // Orbiting by the mouse shows other hair; undo of the saved view brings back what was.
    let centre = [(x + width / 2) as f64, (y + height / 2) as f64];
    browser.drag(centre, [centre[0] + 120.0, centre[1] + 40.0]);
    browser.key('v');
    browser.wait_for(&is_done(false));
    let turned = look(&mut browser, "web-turned").part(extent);
    let difference = turned.difference(&of_page);
    println!("turned against opened: {difference:.3} levels");
    assert!(difference > 4.0, "the view did not turn: {difference}");
    browser.control('s');
    let file = saved.path().join("scene.toml");
    browser.wait_until("a saved scene", |_| file.exists());
    browser.wait_for(&is_done(true));
    let before = Scene::read(folder.join("scene.toml")).expect("a scene");
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

/// Keeps what the viewer tells, and the devices that it opens.
const WATCH: &str = "
    globalThis.strandview_log = [];
    globalThis.devices = [];
    const request = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...options) {
        const device = await request.apply(this, options);
        devices.push(device);
        return device;
    };
    globalThis.n_workers = 0;
    globalThis.Worker = class extends Worker {
        constructor(...options) {
            super(...options);
            n_workers += 1;
        }
    };";

/// Left, top, right and bottom of a control in the page.
pub fn place(browser: &mut Browser, name: &str) -> [f64; 4] {
    let places = "JSON.parse(strandview_log.findLast(line => line.includes('\"places\"'))).places";
    let place = browser.evaluate(&format!("{places}[{name:?}]"));
    let corner = |ix: usize| place[ix].as_f64();
    match [corner(0), corner(1), corner(2), corner(3)] {
        [Some(left), Some(top), Some(right), Some(bottom)] => [left, top, right, bottom],
        _ => panic!("no control {name:?}"),
    }
}

/// Does something that the viewer tells of as `event`, and waits for the finished picture.
fn after(browser: &mut Browser, event: &str, is_saved: bool, act: impl FnOnce(&mut Browser)) {
    let count = |browser: &mut Browser| {
        let line = format!("'\"event\":\"{event}\"'");
        let lines = format!("strandview_log.filter(line => line.includes({line})).length");
        browser.evaluate(&lines).as_u64().unwrap_or(0)
    };
    let before = count(browser);
    act(browser);
    browser.wait_until(event, |browser| count(browser) > before);
    browser.wait_for(&is_done(is_saved));
}

#[test]
fn a_page_edits_paints_keeps_and_carries_on() {
    let folder = page();
    let address = serve(folder);
    let mut browser = Browser::start(WITH_WEBGPU, [760, 480]);
    let saved = tempfile::tempdir().expect("a temporary folder");
    browser.download_to(saved.path());
    browser.before_pages(WATCH);
    browser.go(&address);
    browser.wait_for(&is_done(true));
    let [left, top, right, bottom] = place(&mut browser, "View");
    let extent = [left, top, right - left, bottom - top].map(|x| x as usize);
    let picture = |browser: &mut Browser, name| look(browser, name).part(extent);
    let opened = picture(&mut browser, "web-before");

    // A slider.
    let [x0, y0, x1, y1] = place(&mut browser, "IOR slider");
    let middle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0];
    let end = [x1 - 2.0, middle[1]];
    after(&mut browser, "edit", false, |browser| {
        browser.drag(middle, end);
    });
    let edited = picture(&mut browser, "web-slid");
    let difference = edited.difference(&opened);
    println!("slid against opened: {difference:.3} levels");
    assert!(difference > 0.5, "the slider did nothing: {difference}");
    // The page is not left with changes unless its reader wants that.
    assert!(browser.reload(false), "changes would have been lost");
    after(&mut browser, "undo", true, |browser| browser.control('z'));
    let undone = picture(&mut browser, "web-slid-back").difference(&opened);
    println!("undone: {undone:.3} levels");
    assert!(undone < 0.05, "undone: {undone} levels");

    // A stroke, saved with the groom.
    browser.key('b');
    let y = top + 0.4 * (bottom - top);
    let across = [
        [left + 0.3 * (right - left), y],
        [left + 0.7 * (right - left), y],
    ];
    after(&mut browser, "stroke", false, |browser| {
        browser.drag(across[0], across[1]);
    });
    browser.mouse_away();
    let painted = picture(&mut browser, "web-painted");
    let difference = painted.difference(&opened);
    println!("painted against opened: {difference:.3} levels");
    // A band across strands that are few and thin.
    assert!(difference > 0.1, "nothing was painted: {difference}");
    after(&mut browser, "saved", true, |browser| browser.control('s'));
    let file = saved.path().join("scene-painted.groom");
    let scene = saved.path().join("scene.toml");
    browser.wait_until("a saved groom", |_| file.exists() && scene.exists());
    browser.wait_until("whole", |_| Groom::read(&file).is_ok());
    let groom = Groom::read(&file).expect("a groom");
    assert!(groom.attribute("dye").is_some());
    let scene = Scene::read(&scene).expect("a scene");
    assert_eq!(scene.groom.file, Path::new("scene-painted.groom"));

    // The picture as a file.
    after(&mut browser, "picture", true, |browser| browser.key('p'));
    let file = saved.path().join("scene-001.png");
    browser.wait_until("a picture", |_| file.exists());
    let kept = Pixels::from_png(&std::fs::read(&file).expect("readable"));
    let difference = kept.difference(&painted);
    println!("saved picture: {difference:.3} levels");
    assert!(
        difference < 0.05,
        "the saved picture is off by {difference}"
    );

    // A device that is gone is opened again, with the paint.
    after(&mut browser, "lost", true, |browser| {
        browser.evaluate("devices.at(-1).destroy(), 0");
        browser.mouse_away();
    });
    browser.wait_for("devices.length > 1");
    browser.wait_for(&is_done(true));
    let again = picture(&mut browser, "web-lost").difference(&painted);
    println!("after a lost device: {again:.3} levels");
    assert!(again < 0.05, "{again} levels");
    assert_eq!(browser.evaluate("n_workers"), 0);
    // Saved as it is, it is left without a question.
    assert!(!browser.reload(false));
    browser.wait_for("globalThis.devices?.length === 1");
}

#[test]
fn fingers_and_pens_paint_as_hard_as_they_press() {
    let mut browser = Browser::start(WITH_WEBGPU, [760, 480]);
    browser.before_pages(WATCH);
    browser.go(&serve(page()));
    browser.wait_for(&is_done(true));
    let [left, top, right, bottom] = place(&mut browser, "View");
    let y = top + 0.4 * (bottom - top);
    let [from, to] = [0.3, 0.7].map(|share| [left + share * (right - left), y]);
    browser.key('b');
    // Most dye of all points, where the brush does all that it does.
    let painted = |browser: &mut Browser, act: &dyn Fn(&mut Browser)| -> f32 {
        let folder = tempfile::tempdir().expect("a temporary folder");
        browser.download_to(folder.path());
        after(browser, "stroke", false, act);
        after(browser, "saved", true, |browser| browser.control('s'));
        let file = folder.path().join("scene-painted.groom");
        browser.wait_until("a saved groom", |_| Groom::read(&file).is_ok());
        let groom = Groom::read(&file).expect("a groom");
        let dye = groom.attribute("dye").expect("dyed");
        let weights = dye.data.iter().skip(3).step_by(4);
        let most = weights.fold(0.0f32, |most, &weight| most.max(weight));
        after(browser, "undo", false, |browser| browser.control('z'));
        most
    };
    for (what, force, expected) in [
        ("finger", 0.4, 0.4),
        ("finger", 0.8, 0.8),
        // That of fingers which are not measured, by the standard of pointer events.
        ("finger", 0.5, 1.0),
        ("pen", 0.3, 0.3),
        ("pen", 0.7, 0.7),
        ("mouse", 1.0, 1.0),
    ] {
        let most = painted(&mut browser, &|browser| match what {
            "finger" => browser.press(from, to, force),
            "pen" => browser.draw(from, to, force),
            _ => browser.drag(from, to),
        });
        println!("{what} with force {force}: weight {most}");
        assert!((most - expected).abs() < 0.02, "{what} {force}: {most}");
    }
    assert_eq!(browser.console, Vec::<String>::new());
}

/// Takes workers away.
pub const NO_WORKERS: &str =
    "globalThis.Worker = class { constructor() { throw Error('not here'); } };";

/// Keeps the workers that the page starts.
const WATCH_WORKERS: &str = "
    globalThis.strandview_log = [];
    globalThis.workers = [];
    globalThis.Worker = class extends Worker {
        answers = 0;
        constructor(...options) {
            super(...options);
            workers.push(this);
            this.addEventListener('message', () => (this.answers += 1));
        }
    };";

#[test]
fn without_webgpu_the_cpu_draws_the_page() {
    let folder = page();
    let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
    browser.before_pages(WATCH_WORKERS);
    let address = serve(folder);
    browser.go(&address);
    browser.wait_for(&is_done(true));
    assert_eq!(browser.evaluate("workers.length"), 1);
    let n_answers = |browser: &mut Browser| browser.evaluate("workers[0].answers").as_u64();
    let n_opened = n_answers(&mut browser);
    assert!(n_opened > Some(1), "{n_opened:?}");
    let log = browser.evaluate("strandview_log.find(line => line.includes('\"renderer\"'))");
    let line: serde_json::Value =
        serde_json::from_str(log.as_str().unwrap_or_default()).expect("the renderer is logged");
    assert_eq!(line["name"], "cpu");
    let reason = line["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("WebGPU"), "{reason}");

    let [left, top, right, bottom] = place(&mut browser, "View");
    let extent = [left, top, right - left, bottom - top].map(|x| x as usize);
    let opened = look(&mut browser, "web-cpu-opened").part(extent);
    let of_native = native_on_cpu(folder, [extent[2], extent[3]]);
    let difference = opened.difference(&of_native);
    println!("page against native, both on the CPU: {difference:.3} levels");
    assert!(difference < 0.1, "{difference} levels");

    // A slider and back.
    let slider = place(&mut browser, "IOR slider");
    let middle = [(slider[0] + slider[2]) / 2.0, (slider[1] + slider[3]) / 2.0];
    browser.drag(middle, [slider[2] - 2.0, middle[1]]);
    browser.wait_for(&is_done(false));
    browser.mouse_away();
    let edited = look(&mut browser, "web-cpu-slid").part(extent);
    let difference = edited.difference(&opened);
    println!("slid against opened: {difference:.3} levels");
    assert!(difference > 0.5, "the slider did nothing: {difference}");
    browser.control('z');
    browser.wait_for(&is_done(true));
    let mut undone = look(&mut browser, "web-cpu-undone").part(extent);
    assert!(undone.difference(&opened) < 0.05);

    // Another view.
    let centre = [(left + right) / 2.0, (top + bottom) / 2.0];
    browser.drag(centre, [centre[0] + 90.0, centre[1] + 30.0]);
    browser.mouse_away();
    browser.wait_until("another view", |browser| {
        undone = look(browser, "web-cpu-turned").part(extent);
        undone.difference(&opened) > 4.0
    });
    assert!(n_answers(&mut browser) > n_opened);
    assert_eq!(browser.console, Vec::<String>::new());

    // Where there are no workers the page draws the same.
    browser.before_pages(NO_WORKERS);
    browser.go(&address);
    browser.wait_for(&is_done(true));
    let alone = look(&mut browser, "web-cpu-alone").part(extent);
    assert_eq!(alone.difference(&opened), 0.0);
    let warned = ["strandview: the page draws without a worker: not here".to_owned()];
    assert_eq!(browser.console, warned);
}

/// How many threads draw, as the element tells.
const THREADS: &str = "document.querySelector('strand-view').threads";

/// Of the same scene the picture of a page with threads is that of one without, bit for bit, also after an edit; where the server
/// does not let it share memory it draws on one thread and says nothing.
#[test]
#[ignore = "builds a standard library for shared memory: tests/run --tier threads"]
fn a_page_that_may_share_memory_draws_with_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let page = page_with_threads(folder.path());
    let mut pictures = Vec::new();
    for (address, is_shared) in [(serve_isolated(&page), true), (serve(&page), false)] {
        let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
        browser.before_pages("globalThis.strandview_log = [];");
        browser.go(&address);
        browser.wait_for(&is_done(true));
        assert_eq!(browser.evaluate("crossOriginIsolated"), is_shared);
        let n_threads = browser.evaluate(THREADS).as_u64();
        let n_wanted = "((n) => n === 1 ? 1 : Math.min(Math.max(n - 1, 2), 16))(navigator.hardwareConcurrency)";
        let n_wanted = browser.evaluate(n_wanted).as_u64();
        assert_eq!(n_threads, if is_shared { n_wanted } else { Some(1) });
        let [left, top, right, bottom] = place(&mut browser, "View");
        let extent = [left, top, right - left, bottom - top].map(|x| x as usize);
        let opened = look(&mut browser, "web-threads-opened").part(extent);
        let slider = place(&mut browser, "IOR slider");
        let middle = [(slider[0] + slider[2]) / 2.0, (slider[1] + slider[3]) / 2.0];
        browser.drag(middle, [slider[2] - 2.0, middle[1]]);
        browser.wait_for(&is_done(false));
        browser.mouse_away();
        let edited = look(&mut browser, "web-threads-slid").part(extent);
        assert!(edited.difference(&opened) > 0.5, "the slider did nothing");
        assert_eq!(browser.console, Vec::<String>::new());
        pictures.push([opened, edited]);
    }
    let [shared, alone] = &pictures[..] else {
        unreachable!("two pages");
    };
    for (shared, alone) in shared.iter().zip(alone) {
        assert_eq!(shared.difference(alone), 0.0);
    }
    threads_that_fail_leave_the_picture(&page, &alone[0]);
}

/// Has workers begin with `script`.
fn in_workers(script: &str) -> String {
    format!(
        "globalThis.Blob = class extends Blob {{
            constructor(parts, options) {{
                super(options?.type === 'text/javascript' ? [{script:?}, ...parts] : parts, options);
            }}
        }};"
    )
}

/// Threads that cannot start leave the worker, and one that ends leaves the page, to draw the picture.
fn threads_that_fail_leave_the_picture(page: &Path, opened: &Pixels) {
    let no_memory =
        "WebAssembly.Memory = class { constructor() { throw new RangeError('no room'); } };";
    let no_threads =
        "globalThis.Worker = class { constructor() { throw new Error('none here'); } };";
    let refused = "globalThis.Blob = class extends Blob { constructor(parts, options) { \
        super(['onmessage = () => postMessage(\"no room\");'], options); } };";
    let ends = "globalThis.Blob = class extends Blob { constructor(parts, options) { \
        super([parts[0].replace('instance.run_thread();', 'throw new Error(\"cut\");')], options); } };";
    for (script, warning) in [
        (no_memory, None),
        (no_threads, None),
        (refused, None),
        (
            ends,
            Some("strandview: the page draws without a worker: a thread ended: Error: cut"),
        ),
    ] {
        let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
        browser.before_pages("globalThis.strandview_log = [];");
        browser.before_pages(&in_workers(script));
        browser.go(&serve_isolated(page));
        browser.wait_for(&is_done(true));
        assert_eq!(browser.evaluate(THREADS), 1, "{script}");
        let [left, top, right, bottom] = place(&mut browser, "View");
        let extent = [left, top, right - left, bottom - top].map(|x| x as usize);
        let picture = look(&mut browser, "web-threads-failed").part(extent);
        assert_eq!(picture.difference(opened), 0.0, "{script}");
        let warned = |line: &String| Some(line.as_str()) == warning;
        assert_eq!(
            browser.console.iter().any(warned),
            warning.is_some(),
            "{script}: {:?}",
            browser.console
        );
    }
}

/// Without the program of its threads a page that may share memory draws on one.
#[test]
fn a_page_without_a_program_for_threads_draws_on_one() {
    let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
    browser.go(&serve_isolated(page()));
    browser.wait_for(&is_done(true));
    assert_eq!(browser.evaluate("crossOriginIsolated"), true);
    assert_eq!(browser.evaluate(THREADS), 1);
    assert_eq!(browser.console, Vec::<String>::new());
}

#[test]
fn a_page_that_may_start_no_worker_draws_by_itself() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for file in std::fs::read_dir(page()).expect("the page") {
        let path = file.expect("a file").path();
        let name = path.file_name().expect("a name").to_owned();
        std::fs::copy(&path, folder.path().join(name)).expect("copied");
    }
    let index = folder.path().join("index.html");
    let html = std::fs::read_to_string(&index).expect("the page");
    let policy =
        "<meta http-equiv=\"Content-Security-Policy\" content=\"worker-src 'self'\">\n<title>";
    std::fs::write(&index, html.replacen("<title>", policy, 1)).expect("written");
    let mut browser = Browser::start(WITHOUT_WEBGPU, SIZE);
    browser.go(&serve(folder.path()));
    browser.wait_for(&is_done(true));
    let warning = "strandview: the page draws without a worker: it cannot be loaded";
    let warned = |line: &String| line == warning;
    assert!(browser.console.iter().any(warned), "{:?}", browser.console);
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
        (None, "cannot fetch five.lights: HTTP status 404"),
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
        "head.mesh",
        "index.html",
        "scene.toml",
        "strand-view.js",
        "strandview.js",
        "strandview_bg.wasm",
        "threads.js",
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
