//! `<strand-view>` in pages that are not the project's: the documentation's example, and small ones.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use serde_json::Value;
use strandlight_formats::Scene;
use strandlight_tests::project_root;

use crate::web_common::browser::{Browser, WITH_WEBGPU, WITHOUT_WEBGPU};
use crate::web_common::picture::{Pixels, keep, native, native_on_cpu};
use crate::web_common::server::serve;
use crate::web_common::{package, page};

/// Notes the events of all elements, which do not bubble, as [id, name, detail]. The document sees
/// them all; `load` does not come to the window.
const WATCH: &str = "
    globalThis.told = [];
    for (const name of ['load', 'change', 'progress', 'done', 'error']) {
        document.addEventListener(name, (event) => {
            if (event.target.localName !== 'strand-view') return;
            told.push([event.target.id, name, JSON.parse(JSON.stringify(event.detail))]);
        }, true);
    }";

/// A block of the how-to on web pages.
pub fn block(language: &str) -> String {
    let page = project_root().join("docs/book/src/how-to/web-page.md");
    let text = std::fs::read_to_string(page).expect("the how-to");
    let start = format!("```{language}\n");
    let (_, rest) = text.split_once(&start).expect("a block");
    let (block, _) = rest.split_once("```\n").expect("the block ends");
    block.to_owned()
}

/// A folder with `html` as its page, the scene of the tests and the package; and its address.
fn site(html: &str) -> (PathBuf, String) {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = format!("element-{}", COUNT.fetch_add(1, Ordering::Relaxed));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("strand-view")).expect("a new folder");
    let copy = |from: &Path, to: &Path, names: &[&str]| {
        for name in names {
            std::fs::copy(from.join(name), to.join(name)).expect("copied");
        }
    };
    // The scene names no tables: they come from the package.
    let scene = ["scene.toml", "a wig.groom", "five.lights", "head.mesh"];
    copy(page(), &folder, &scene);
    let program = [
        "strand-view.js",
        "strandview.js",
        "strandview_bg.wasm",
        "threads.js",
        "default.tables",
    ];
    copy(package(), &folder.join("strand-view"), &program);
    std::fs::write(folder.join("index.html"), html).expect("written");
    let address = serve(&folder);
    (folder, address)
}

/// A page of elements, without the rest.
fn plain(elements: &str) -> String {
    format!(
        "<!doctype html><style>body {{ margin: 0 }} strand-view {{ width: 300px; height: 200px }}</style>\
         {elements}<script type=module>import './strand-view/strand-view.js'</script>"
    )
}

/// Waits until the last picture of the element `id` is finished, and no other is on the way.
fn finished(browser: &mut Browser, id: &str) {
    browser.wait_for(&format!(
        "(() => {{
            const last = (...names) => told.findLastIndex(([id, name]) => id === '{id}' && names.includes(name));
            return last('done') > last('change', 'load');
        }})()"
    ));
}

/// What the page looks like where the element `id` is.
fn look(browser: &mut Browser, id: &str, name: &str) -> Pixels {
    let place = browser.evaluate(&format!(
        "(({{ x, y, width, height }}) => [x, y, width, height])(document.getElementById('{id}').getBoundingClientRect())"
    ));
    let extent = [0, 1, 2, 3].map(|ix: usize| place[ix].as_f64().expect("a place") as usize);
    let png = browser.screenshot();
    keep(name, &png);
    Pixels::from_png(&png).part(extent)
}

/// What `expression` throws, or that it throws nothing.
fn thrown(browser: &mut Browser, expression: &str) -> String {
    let said = browser.evaluate(&format!(
        "(async () => {expression})().then(() => 'nothing', (error) => error instanceof Error ? error.message : 'no Error')"
    ));
    said.as_str().unwrap_or_default().to_owned()
}

/// The last event of a kind that was told of `id`.
fn detail(browser: &mut Browser, id: &str, name: &str) -> Value {
    browser.evaluate(&format!(
        "told.findLast((event) => event[0] === '{id}' && event[1] === '{name}')?.[2]"
    ))
}

/// The example of the documentation: what it draws, and that its parts do what they are said to.
fn example(flags: &[&str], native: impl Fn(&Path, [usize; 2]) -> Pixels, most: f64, name: &str) {
    let (folder, address) = site(&block("html"));
    let mut browser = Browser::start(flags, [780, 460]);
    browser.before_pages(WATCH);
    browser.go(&address);
    for id in ["front", "back"] {
        browser.wait_for(&format!(
            "globalThis.told?.some((event) => event[0] === '{id}' && event[1] === 'load')"
        ));
    }
    browser.wait_for("told.some((event) => event[0] === 'back' && event[1] === 'change')");
    for id in ["front", "back"] {
        finished(&mut browser, id);
    }
    let opened = look(&mut browser, "front", &format!("element-{name}"));
    assert_eq!([opened.width, opened.height], [360, 240]);
    let difference = opened.difference(&native(&folder, [360, 240]));
    println!("{name}: element against native: {difference:.3} levels");
    assert!(difference < most, "{difference} levels");
    let back = look(&mut browser, "back", &format!("element-{name}-back"));
    assert!(back.difference(&opened) > 4.0, "seen from the same side");

    // The slider changes both scenes.
    let eta = Scene::read(folder.join("scene.toml"))
        .expect("a scene")
        .hair
        .eta;
    assert_eq!(browser.evaluate("front.get('hair.eta')"), eta);
    assert_eq!(browser.evaluate("front.isModified"), false);
    browser.evaluate("eta.value = 1.9, eta.dispatchEvent(new Event('input')), 0");
    for id in ["front", "back"] {
        finished(&mut browser, id);
        assert_eq!(browser.evaluate(&format!("{id}.get('hair.eta')")), 1.9);
        let change = detail(&mut browser, id, "change");
        assert_eq!(change["kind"], "edit");
        assert_eq!(change["keys"][0], "hair.eta");
    }
    assert_eq!(browser.evaluate("front.isModified"), true);
    let edited = look(&mut browser, "front", &format!("element-{name}-eta"));
    let difference = edited.difference(&opened);
    println!("{name}: edited against opened: {difference:.3} levels");
    assert!(difference > 0.3, "the slider did nothing: {difference}");

    // The mouse turns the first, and the second follows.
    browser.drag([180.0, 120.0], [240.0, 140.0]);
    browser.mouse_away();
    for id in ["front", "back"] {
        finished(&mut browser, id);
        assert_eq!(detail(&mut browser, id, "change")["kind"], "view");
    }
    let camera = |browser: &mut Browser, id: &str, ix: usize| {
        let x = browser.evaluate(&format!("{id}.camera.position[{ix}]"));
        x.as_f64().expect("a number")
    };
    let target = Scene::read(folder.join("scene.toml")).expect("a scene");
    let target = target.camera.expect("a camera").target;
    for (ix, sign) in [(0, -1.0), (1, 1.0), (2, -1.0)] {
        let front = camera(&mut browser, "front", ix) - target[ix];
        let back = camera(&mut browser, "back", ix) - target[ix];
        assert!((back - sign * front).abs() < 1e-3, "{ix}: {front}, {back}");
    }

    // A snapshot waits for the picture of what was set just before.
    let bytes = browser.evaluate(
        "(front.set({ 'hair.eta': 1.4, 'lights.rotate_deg': 20 }), front.snapshot())
            .then(async (blob) => [blob.type, ...new Uint8Array(await blob.arrayBuffer())])",
    );
    let bytes = bytes.as_array().expect("a snapshot");
    assert_eq!(bytes[0], "image/png");
    let png: Vec<u8> = bytes[1..]
        .iter()
        .map(|x| x.as_u64().expect("a byte") as u8)
        .collect();
    finished(&mut browser, "front");
    let shown = look(&mut browser, "front", &format!("element-{name}-set"));
    let difference = Pixels::from_png(&png).difference(&shown);
    assert!(difference < 0.05, "snapshot: {difference} levels");
    assert!(shown.difference(&edited) > 0.5, "nothing was set");

    // One that is disposed of leaves the other alone.
    browser.evaluate("front.dispose(), 0");
    assert_eq!(
        browser.evaluate("document.querySelectorAll('canvas').length"),
        1
    );
    assert!(thrown(&mut browser, "front.get('hair.eta')").contains("no scene is shown"));
    browser.evaluate("back.set('hair.eta', 1.5), 0");
    finished(&mut browser, "back");
    browser.evaluate("front.load('scene.toml')");
    finished(&mut browser, "front");
    assert_eq!(browser.evaluate("front.get('hair.eta')"), eta);
    assert_eq!(browser.console, Vec::<String>::new());
    assert_eq!(detail(&mut browser, "front", "error"), Value::Null);
}

#[test]
fn two_elements_do_what_the_documentation_says() {
    example(WITH_WEBGPU, native, 1.0, "gpu");
}

#[test]
fn two_elements_do_so_without_webgpu() {
    example(WITHOUT_WEBGPU, native_on_cpu, 0.1, "cpu");
}

#[test]
fn what_an_element_cannot_do_is_thrown_and_told() {
    let elements = "<strand-view id=wrong src=nowhere.toml></strand-view>\
         <strand-view id=view src=scene.toml></strand-view>\
         <strand-view id=gpu src=scene.toml renderer=gpu></strand-view>\
         <div id=host></div>";
    let (folder, address) = site(&plain(elements));
    std::fs::write(folder.join("bad.toml"), "version = 1\n[groom]\nfile = 3\n").expect("written");
    let mut browser = Browser::start(WITHOUT_WEBGPU, [400, 700]);
    browser.before_pages(WATCH);
    browser.go(&address);
    browser
        .wait_for("globalThis.told?.some((event) => event[0] === 'wrong' && event[1] === 'error')");
    let missing = "cannot fetch nowhere.toml: HTTP status 404";
    assert_eq!(detail(&mut browser, "wrong", "error")["message"], missing);
    let text = browser.evaluate("wrong.innerText");
    assert_eq!(text, format!("strandview: {missing}"));
    browser.wait_for("told.some((event) => event[0] === 'gpu' && event[1] === 'error')");
    let refused = detail(&mut browser, "gpu", "error")["message"].to_string();
    assert!(
        refused.contains("the renderer \\\"cpu\\\" draws without a GPU"),
        "{refused}"
    );

    finished(&mut browser, "view");
    let loaded = detail(&mut browser, "view", "load");
    assert_eq!(loaded["renderer"], "cpu");
    let reason = loaded["reason"].as_str().unwrap_or_default();
    assert!(reason.contains("WebGPU"), "{reason}");
    let progress = detail(&mut browser, "view", "progress");
    assert_eq!(
        (&progress["isDone"], &progress["isShaded"]),
        (&true.into(), &true.into())
    );
    let before = browser.evaluate("[view.get('hair'), view.camera]");
    for (expression, needle) in [
        (
            "view.set('hair.etta', 1.5)",
            "hair.etta: unknown field `etta`",
        ),
        ("view.set('hair.etta', 1.5)", "did you mean eta?"),
        ("view.set('hair.eta', 9)", "hair.eta is 9, must be in"),
        ("view.set('hair.eta', 'thick')", "hair.eta: invalid type"),
        ("view.set('hair.eta', NaN)", "hair.eta: NaN is no number"),
        (
            "view.set({ 'hair.eta': 1.4, 'hair.taper': 7 })",
            "hair.taper is 7",
        ),
        ("view.set('groom.file', 'other.groom')", "other.groom"),
        (
            "view.camera = { fov: 500 }",
            "camera.fov_deg is 500, must be in",
        ),
        (
            "view.camera = { eye: [0, 0, 1] }",
            "camera: unknown field `eye`",
        ),
        (
            "view.camera = { position: [1, 2] }",
            "camera: invalid length 2",
        ),
        (
            "document.createElement('strand-view').load('scene.toml')",
            "must be in the document",
        ),
        (
            "document.createElement('strand-view').snapshot()",
            "no scene is shown",
        ),
    ] {
        let said = thrown(&mut browser, expression);
        assert!(said.contains(needle), "{expression}: {said}");
    }
    assert_eq!(browser.evaluate("[view.get('hair'), view.camera]"), before);
    assert_eq!(browser.evaluate("view.isModified"), false);

    // What a scene leaves open has no value; null opens it again.
    assert_eq!(
        browser.evaluate("view.get('hair.taper') === undefined"),
        true
    );
    browser.evaluate("view.set('hair.diameter_cm', null), 0");
    assert_eq!(
        browser.evaluate("view.get('hair.diameter_cm') === undefined"),
        true
    );
    assert_eq!(browser.evaluate("view.get('camera.position.1')"), 6.0);

    for (expression, needle) in [
        ("view.load('nowhere.toml')", missing),
        ("view.load('bad.toml')", "bad.toml"),
        (
            "(view.renderer = 'metal', view.load('scene.toml'))",
            "renderer is \"metal\", not one of auto, gpu, cpu",
        ),
        (
            "host.attachShadow({ mode: 'open' }).appendChild(document.createElement('strand-view')).load('scene.toml')",
            "not in a shadow tree",
        ),
        (
            "Promise.all([wrong.load('scene.toml'), wrong.load('scene.toml')])",
            "another scene is loaded",
        ),
    ] {
        let said = thrown(&mut browser, expression);
        assert!(said.contains(needle), "{expression}: {said}");
    }
    finished(&mut browser, "wrong");
}

/// Names of the controls that an element shows.
fn has_control(browser: &mut Browser, name: &str) -> bool {
    let line = "strandview_log.findLast((line) => line.includes('\"places\"'))";
    let found = browser.evaluate(&format!("{name:?} in JSON.parse({line}).places"));
    found.as_bool().expect("places")
}

#[test]
fn the_panel_is_shown_where_it_is_wanted_and_keys_and_fingers_are_the_pages_else() {
    let elements = "<strand-view id=view src=scene.toml style='width: 690px; height: 400px'></strand-view>\
         <button id=next>Next</button>\
         <div style='height: 3000px'></div>";
    let (_, address) = site(&plain(elements));
    let mut browser = Browser::start(WITHOUT_WEBGPU, [700, 460]);
    browser.before_pages(&format!("globalThis.strandview_log = []; {WATCH}"));
    browser.go(&address);
    browser.wait_for("globalThis.told?.some((event) => event[1] === 'done')");
    assert!(has_control(&mut browser, "View"));
    assert!(!has_control(&mut browser, "IOR slider"), "there is a panel");
    let line = "strandview_log.findLast((line) => line.includes('\"places\"'))";
    let place = browser.evaluate(&format!("JSON.parse({line}).places.View"));
    assert_eq!(place, serde_json::json!([0, 0, 690, 400]));
    assert_eq!(
        browser.evaluate("document.activeElement === document.body"),
        true
    );

    // The wheel is the page's until the picture has been clicked.
    let distance =
        "Math.hypot(...view.camera.position.map((x, axis) => x - view.camera.target[axis]))";
    let far = browser.evaluate(distance).as_f64().expect("a distance");
    browser.wheel([150.0, 100.0], 60.0);
    browser.wait_for("scrollY > 0");
    assert_eq!(browser.evaluate(distance), far);
    browser.evaluate("scrollTo(0, 0), 0");
    browser.drag([150.0, 100.0], [151.0, 100.0]);
    assert_eq!(
        browser.evaluate("document.activeElement.localName"),
        "canvas"
    );
    browser.wheel([150.0, 100.0], -60.0);
    browser.wait_for(&format!("{distance} < {far} - 0.5"));
    assert_eq!(browser.evaluate("scrollY"), 0);

    // Keys of the panel do nothing without it, and Tab goes on in the page.
    browser.key('b');
    browser.control('s');
    browser.tab();
    browser.wait_for("document.activeElement === next");
    assert_eq!(browser.evaluate("view.isModified"), false);

    // One finger orbits, two zoom.
    browser.evaluate("globalThis.place = view.camera.position.join(), 0");
    browser.touch(&[([100.0, 100.0], [200.0, 110.0])]);
    browser.wait_for("view.camera.position.join() !== place");
    finished(&mut browser, "view");
    let far = browser.evaluate(distance).as_f64().expect("a distance");
    browser.touch(&[
        ([130.0, 100.0], [60.0, 100.0]),
        ([170.0, 100.0], [240.0, 100.0]),
    ]);
    browser.wait_for(&format!("{distance} < 0.8 * {far}"));

    browser.evaluate("view.panel = true, 0");
    browser.wait_until("a panel", |browser| has_control(browser, "IOR slider"));
    browser.evaluate("view.removeAttribute('panel'), 0");
    browser.wait_until("no panel", |browser| !has_control(browser, "IOR slider"));
    assert_eq!(browser.console, Vec::<String>::new());
}

#[test]
fn an_element_is_moved_and_one_that_is_gone_leaves_no_memory() {
    let elements = "<div id=one><strand-view id=view src=scene.toml renderer=cpu></strand-view></div><div id=two></div>";
    let (_, address) = site(&plain(elements));
    let mut browser = Browser::start(WITHOUT_WEBGPU, [400, 460]);
    let memories = "
        globalThis.memories = [];
        const instantiate = WebAssembly.instantiate;
        WebAssembly.instantiate = async (...given) => {
            const made = await instantiate(...given);
            const { exports } = made.instance ?? made;
            memories.push(new WeakRef(exports.memory));
            return made;
        };";
    browser.before_pages(&format!("{WATCH} {memories}"));
    browser.go(&address);
    browser.wait_for("globalThis.told?.some((event) => event[1] === 'done')");
    assert_eq!(browser.evaluate("memories.length"), 1);
    browser.evaluate("globalThis.canvas = document.querySelector('canvas'), two.append(view), 0");
    browser.evaluate("view.set('hair.eta', 1.4), 0");
    finished(&mut browser, "view");
    assert_eq!(
        browser.evaluate("document.querySelector('canvas') === canvas"),
        true
    );
    assert_eq!(browser.evaluate("memories.length"), 1);
    // Elements out of the page are no globals any more.
    browser.evaluate("canvas = null, globalThis.kept = view, 0");

    for turn in 2..5 {
        browser.evaluate("told.length = 0, kept.remove(), 0");
        browser.wait_for("kept.querySelector('canvas') === null");
        browser.evaluate("one.append(kept), 0");
        browser.wait_for("told.some((event) => event[1] === 'done')");
        assert_eq!(browser.evaluate("memories.length"), turn);
    }
    browser.evaluate("kept.remove(), 0");
    browser.wait_for("kept.querySelector('canvas') === null");
    browser.call("HeapProfiler.enable", serde_json::json!({}));
    browser.wait_until("memory that was given back", |browser| {
        browser.call("HeapProfiler.collectGarbage", serde_json::json!({}));
        browser.evaluate("memories.filter((memory) => memory.deref()).length") == 0
    });
    assert_eq!(browser.console, Vec::<String>::new());
}

#[test]
fn a_gpu_draws_by_list_and_has_no_samples_to_count() {
    let (_, address) = site(&plain("<strand-view id=view src=scene.toml></strand-view>"));
    let mut browser = Browser::start(WITH_WEBGPU, [400, 300]);
    browser.before_pages(WATCH);
    browser.go(&address);
    browser.wait_for("globalThis.told?.some((event) => event[1] === 'done')");
    assert_eq!(detail(&mut browser, "view", "load")["renderer"], "gpu");
    assert_eq!(detail(&mut browser, "view", "done")["samples"], 0);
    let progress = detail(&mut browser, "view", "progress");
    assert_eq!(progress["samples"], 0);
    assert_eq!(progress["totalSamples"], 0);
    assert_eq!(progress["isDone"], true);
}
