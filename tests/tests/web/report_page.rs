//! The report of a light fit, as a browser shows it: from disk, without a server.

use serde_json::json;
use strandlight_tests::{assert_done, project_root, strandlight};

use crate::web_common::browser::{Browser, WITHOUT_WEBGPU};

#[test]
fn a_report_opens_from_disk_and_says_nothing_to_the_console() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = project_root().join("data/sample/studio.exr");
    let mut command = strandlight();
    command.current_dir(folder.path()).arg("lights").arg(map);
    command.args([
        "-o", "a.lights", "--count", "4", "--curve", "--report", "a.html",
    ]);
    assert_done(&mut command);
    let address = format!("file://{}", folder.path().join("a.html").display());
    let mut browser = Browser::start(WITHOUT_WEBGPU, [1100, 900]);
    for [width, height] in [[1100, 900], [420, 900]] {
        browser.resize([width, height]);
        browser.go(&address);
        browser.wait_for("document.readyState === 'complete' && !!document.querySelector('svg')");
        let checks = [
            (
                "nothing beside the page",
                "document.documentElement.scrollWidth <= innerWidth",
            ),
            (
                "no XML error",
                "document.querySelector('parsererror') === null",
            ),
            (
                "every picture is there",
                "Promise.all([...document.querySelectorAll('image')].map(image => { \
                 const copy = new Image(); copy.src = image.href.baseVal; return copy.decode() \
                 .then(() => copy.naturalWidth >= 256) })) \
                 .then(found => found.length === 3 && found.every(Boolean))",
            ),
            (
                "nothing was fetched",
                "performance.getEntriesByType('resource').every(entry => entry.name.startsWith('data:'))",
            ),
            (
                "no number is missing",
                "!/NaN|undefined|Infinity|null/.test(document.body.innerText)",
            ),
        ];
        for (what, check) in checks {
            assert_eq!(
                browser.evaluate(check),
                json!(true),
                "{what}, {width} pixels wide"
            );
        }
    }
    assert!(browser.console.is_empty(), "{:?}", browser.console);
}
