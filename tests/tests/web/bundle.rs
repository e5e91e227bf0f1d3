//! The npm package: what is in it, and the documentation's program with it, checked and bundled.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use strandlight_tests::project_root;

use crate::element::block;
use crate::web_common::browser::{Browser, WITHOUT_WEBGPU};
use crate::web_common::server::serve;
use crate::web_common::{package, page, run};

/// Runs npm in `folder`; what it prints.
fn npm(folder: &Path, arguments: &[&str]) -> String {
    let output = Command::new("npm")
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("npm is installed (tests/run does it)");
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (said, complained) = (words(&output.stdout), words(&output.stderr));
    assert!(
        output.status.success(),
        "npm {arguments:?}: {said}{complained}"
    );
    said
}

#[test]
fn the_package_is_whole_and_its_folder_is_nobody_elses() {
    let text = std::fs::read_to_string(package().join("package.json")).expect("it is there");
    let manifest: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(manifest["name"], "strand-view");
    assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(manifest["license"], "MIT OR Apache-2.0");
    let packed = npm(package(), &["pack", "--dry-run", "--json"]);
    let packed: Value = serde_json::from_str(&packed).expect("JSON");
    let files = packed[0]["files"].as_array().expect("files");
    let mut packed: Vec<&str> = files
        .iter()
        .filter_map(|file| file["path"].as_str())
        .collect();
    packed.sort();
    // A release adds the licences of what is inside.
    let wanted = [
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "README.md",
        "default.tables",
        "package.json",
        "strand-view.d.ts",
        "strand-view.js",
        "strandview.js",
        "strandview_bg.wasm",
        "threads.js",
    ];
    assert_eq!(packed, wanted);
    let exported = manifest["exports"].as_object().expect("exports");
    for file in exported.values().flat_map(|file| match file {
        Value::Object(by_condition) => by_condition.values().collect(),
        file => vec![file],
    }) {
        let file = file
            .as_str()
            .and_then(|file| file.strip_prefix("./"))
            .expect("a path");
        assert!(wanted.contains(&file), "{file}");
    }

    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("letter.txt"), "mine").expect("written");
    let refused = run("web/package", &[folder.path()]).expect_err("not its own");
    assert!(refused.contains("was not made by web/package"), "{refused}");
}

#[test]
fn a_bundler_takes_the_package() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let app = folder.path();
    let names = [
        "package.json",
        "package-lock.json",
        "tsconfig.json",
        "index.html",
    ];
    for name in names {
        let from = project_root().join("tests/bundler").join(name);
        std::fs::copy(from, app.join(name)).expect("copied");
    }
    std::fs::write(app.join("main.ts"), block("ts")).expect("written");
    std::fs::create_dir(app.join("public")).expect("a new folder");
    for name in ["scene.toml", "a wig.groom", "five.lights", "head.mesh"] {
        std::fs::copy(page().join(name), app.join("public").join(name)).expect("copied");
    }
    let target = app.display().to_string();
    let packed = npm(
        package(),
        &["pack", "--json", "--pack-destination", &target],
    );
    let packed: Value = serde_json::from_str(&packed).expect("JSON");
    let file = packed[0]["filename"].as_str().expect("a name");
    let quiet = ["--no-audit", "--no-fund"];
    npm(app, &[&["ci"][..], &quiet].concat());
    let file = format!("./{file}");
    npm(
        app,
        &[&["install", "--no-save", &file][..], &quiet].concat(),
    );
    npm(app, &["run", "check"]);
    npm(app, &["run", "build"]);
    assert!(app.join("dist/assets").is_dir());
    assert!(!app.join("dist/strandview_bg.wasm").exists());

    let mut browser = Browser::start(WITHOUT_WEBGPU, [760, 500]);
    browser.go(&serve(&app.join("dist")));
    browser.wait_for("document.title === 'cpu'");
    let shown = "document.querySelector('strand-view').snapshot().then((blob) => [blob.type, blob.size > 5000])";
    assert_eq!(browser.evaluate(shown), json!(["image/png", true]));
    let eta = "document.querySelector('strand-view').get('hair.eta')";
    assert_eq!(browser.evaluate(eta), 1.6);
    assert_eq!(browser.console, Vec::<String>::new());
}
