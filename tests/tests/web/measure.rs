//! Measurements of the page where no GPU draws; run by name.

use std::path::Path;

use crate::web_common::browser::{Browser, WITHOUT_WEBGPU};
use crate::web_common::page_with_threads;
use crate::web_common::server::{serve, serve_isolated};
use crate::web_page::{NO_WORKERS, is_done, place};

/// Keeps how many milliseconds after each input the page hears of it, and the frame after it is over: when the next one begins.
const TIME_INPUT: &str = "
    globalThis.heard = [];
    globalThis.drawn = [];
    for (const kind of ['pointerdown', 'pointerrawupdate', 'pointerup', 'keydown']) {
        addEventListener(kind, event => {
            heard.push(performance.now() - event.timeStamp);
            const frame = () => drawn.push(performance.now() - event.timeStamp);
            requestAnimationFrame(() => requestAnimationFrame(frame));
        }, { capture: true });
    }";

/// Keeps how many milliseconds after the page was asked for the log has an event.
const TIME_EVENTS: &str = "
    globalThis.at = {};
    globalThis.strandview_log = [];
    strandview_log.push = line => at[JSON.parse(line).event] ??= performance.now();";

/// What serves a folder.
type Serve = fn(&Path) -> String;

/// What draws a page without a GPU: the headers of its server, and a script before it.
const WITHOUT_GPU: [(&str, Serve, &str); 3] = [
    ("threads", serve_isolated, ""),
    ("worker", serve, ""),
    ("no worker", serve, NO_WORKERS),
];

/// `cargo test --release -p strandlight-tests --test web opening -- --ignored --nocapture`, with the scene that
/// `STRANDLIGHT_SCENE` names or the small one of the tests.
#[test]
#[ignore = "a measurement: what worker and threads cost a page without WebGPU that is opened, and what they save"]
fn measure_opening() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let folder = page_with_threads(own.path());
    for _ in 0..3 {
        for (what, serve, script) in WITHOUT_GPU {
            let mut browser = Browser::start(WITHOUT_WEBGPU, [1072, 560]);
            browser.before_pages(TIME_EVENTS);
            browser.before_pages(script);
            browser.go(&serve(&folder));
            browser.wait_until("a finished picture", |browser| {
                browser.evaluate("at.ready !== undefined") == true
                    && browser.evaluate(&is_done(true)) == true
            });
            let ready = browser.evaluate("at.ready").as_f64().unwrap_or(0.0);
            let megabytes = browser.page_bytes() >> 20;
            println!("{what}: all light after {ready:.0} ms, {megabytes} MB at rest");
        }
    }
}

/// Sets a key ten times; answers the milliseconds to the first picture of each and to its last one, sorted.
const TIME_EDITS: &str = "(async () => {
    const view = document.querySelector('strand-view');
    const times = { first: [], last: [] };
    for (let ix = 0; ix < 10; ix++) {
        const start = performance.now();
        const done = new Promise((resolve) => view.addEventListener('done', resolve, { once: true }));
        const first = new Promise((resolve) => {
            const heard = ({ detail }) => {
                if (!detail.isShaded) return;
                view.removeEventListener('progress', heard);
                resolve();
            };
            view.addEventListener('progress', heard);
        });
        EDIT;
        await Promise.race([first, done]);
        times.first.push(performance.now() - start);
        await done;
        times.last.push(performance.now() - start);
    }
    return Object.values(times).map((list) => list.sort((a, b) => a - b));
})()";

/// `cargo test --release -p strandlight-tests --test web edits -- --ignored --nocapture`, with the scene that `STRANDLIGHT_SCENE`
/// names or the small one of the tests.
#[test]
#[ignore = "a measurement: how long pictures of a page without WebGPU take after an edit"]
fn measure_edits() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let folder = page_with_threads(own.path());
    for _ in 0..2 {
        for (what, serve, script) in WITHOUT_GPU {
            let mut browser = Browser::start(WITHOUT_WEBGPU, [1072, 560]);
            browser.before_pages(script);
            browser.go(&serve(&folder));
            browser.wait_for(&is_done(true));
            for (edit, call) in [
                ("hair", "view.set('hair.eta', 1.5 + 0.01 * ix)"),
                ("lights turned", "view.set('lights.rotate_deg', 7 + 3 * ix)"),
                (
                    "view",
                    "view.camera = { position: view.camera.position.map((x, axis) => x + (axis === 0 ? 2 : 0)) }",
                ),
            ] {
                let times = browser.evaluate(&TIME_EDITS.replace("EDIT", call));
                let of = |list: usize, ix: usize| times[list][ix].as_f64().unwrap_or(0.0);
                println!(
                    "{what}, {edit}: first picture {:.0} ms (longest {:.0}), last {:.0} ({:.0})",
                    of(0, 5),
                    of(0, 9),
                    of(1, 5),
                    of(1, 9)
                );
            }
        }
    }
}

/// `cargo test --release -p strandlight-tests --test web input -- --ignored --nocapture`, with the scene that `STRANDLIGHT_SCENE`
/// names or the small one of the tests.
#[test]
#[ignore = "a measurement: how long input waits in a page without WebGPU"]
fn measure_input() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let folder = page_with_threads(own.path());
    for (what, serve, script) in WITHOUT_GPU {
        println!("{what}");
        measure_input_of(&serve(&folder), script);
    }
}

fn measure_input_of(address: &str, script: &str) {
    let mut browser = Browser::start(WITHOUT_WEBGPU, [1072, 560]);
    browser.before_pages(&format!(
        "globalThis.strandview_log = [];{TIME_INPUT}{script}"
    ));
    browser.go(address);
    browser.wait_for(&is_done(true));
    let mut times = |what: &str, act: &mut dyn FnMut(&mut Browser)| {
        browser.evaluate("heard.length = drawn.length = 0");
        act(&mut browser);
        for list in ["heard", "drawn"] {
            let sorted = format!("{list}.sort((a, b) => a - b)");
            let at = |share: f64| format!("{sorted}[Math.floor({share} * ({list}.length - 1))]");
            let [median, most, longest] =
                [0.5, 0.95, 1.0].map(|share| browser.evaluate(&at(share)).as_f64().unwrap_or(0.0));
            let n = browser.evaluate(&format!("{list}.length"));
            println!(
                "{what}, {list}: {n}; median {median:.1} ms, 95 % {most:.1}, longest {longest:.1}"
            );
        }
        browser.mouse_away();
        browser.wait_until("a finished picture", |browser| {
            browser.evaluate(&is_done(true)) == true || browser.evaluate(&is_done(false)) == true
        });
    };
    for round in ["first", "again"] {
        times(&format!("orbit, {round}"), &mut |browser| {
            let [left, top, right, bottom] = place(browser, "View");
            let centre = [(left + right) / 2.0, (top + bottom) / 2.0];
            for x in [60.0, -60.0, 90.0] {
                browser.drag(centre, [centre[0] + x, centre[1] + 20.0]);
            }
        });
        times(&format!("slider, {round}"), &mut |browser| {
            let [left, top, right, bottom] = place(browser, "IOR slider");
            let [y, width] = [(top + bottom) / 2.0, right - left];
            for x in [0.9, 0.2, 0.6] {
                browser.drag([left + 0.5 * width, y], [left + x * width, y]);
            }
        });
        times(&format!("while a view is drawn, {round}"), &mut |browser| {
            let [left, top, right, bottom] = place(browser, "View");
            let centre = [(left + right) / 2.0, (top + bottom) / 2.0];
            browser.drag(centre, [centre[0] + 150.0, centre[1]]);
            for _ in 0..40 {
                // No command has this key.
                browser.key('j');
                std::thread::sleep(std::time::Duration::from_millis(23));
            }
        });
    }
}
