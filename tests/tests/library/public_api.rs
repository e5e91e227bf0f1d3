//! The public items of every library crate, as its sources declare them, are those of `docs/public-api/`:
//! what a change adds to them or takes away is seen in its diff.
//!
//! `STRANDLIGHT_UPDATE_DOCS=1 cargo test -p strandlight-tests --test library public_api::` rewrites the lists.

use std::fs;
use std::path::{Path, PathBuf};

use strandlight_tests::project_root;

/// The library crates: the name of each list and the folder of the sources.
const CRATES: [(&str, &str); 12] = [
    ("bake", "crates/bake/src"),
    ("cpu", "crates/cpu/src"),
    ("data", "data"),
    ("formats", "crates/formats/src"),
    ("images", "crates/images/src"),
    ("lab", "crates/lab/src"),
    ("reference", "crates/reference/src"),
    ("render", "crates/render/src"),
    ("runtime", "crates/runtime/src"),
    ("scattering", "crates/scattering/src"),
    ("scene", "crates/scene/src"),
    ("shaders", "shaders"),
];

/// Sources of programs and of tests.
fn is_left_out(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    matches!(name, Some("cli" | "bin" | "main.rs" | "tests.rs" | "tests"))
        || name.is_some_and(|name| name.ends_with("_tests.rs"))
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if is_left_out(&path) {
            continue;
        } else if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ext| ext == "rs") {
            found.push(path);
        }
    }
}

/// The declarations that start with `pub`, in order, each on one line and without its body or value.
fn declarations(source: &str) -> Vec<String> {
    let source = source.split("#[cfg(test)]\nmod tests {").next();
    let mut lines = source.unwrap_or_default().lines();
    let mut found = Vec::new();
    while let Some(line) = lines.next() {
        let mut item = line.trim().to_owned();
        let Some(rest) = item.strip_prefix("pub ") else {
            continue;
        };
        let is_use = rest.starts_with("use ");
        let is_fn = ["fn ", "const fn ", "async fn "].iter();
        let is_fn = is_fn.clone().any(|word| rest.starts_with(word));
        let is_whole = |item: &str| match (is_use, is_fn) {
            (true, _) => item.ends_with(';'),
            (_, true) => item.contains(" {") || item.ends_with(';'),
            _ => true,
        };
        while !is_whole(&item) {
            let Some(line) = lines.next() else { break };
            item.push(' ');
            item.push_str(line.trim());
        }
        if !is_use {
            for body in [" {", " = "] {
                item.truncate(item.find(body).unwrap_or(item.len()));
            }
        }
        found.push(item.trim_end_matches([';', ',', '{', ' ']).to_owned());
    }
    found
}

fn list(folder: &Path) -> String {
    let mut files = Vec::new();
    sources(folder, &mut files);
    files.sort();
    let mut text = String::new();
    for file in files {
        let source = fs::read_to_string(&file).expect("UTF-8");
        let name = file.strip_prefix(folder).expect("inside").display();
        for item in declarations(&source) {
            text.push_str(&format!("{name}: {item}\n"));
        }
    }
    text
}

#[test]
fn public_items_are_those_of_the_baseline() {
    let root = project_root();
    let folder = root.join("docs/public-api");
    for (name, sources) in CRATES {
        let now = list(&root.join(sources));
        assert!(!now.is_empty(), "{name}: no public item");
        let path = folder.join(format!("{name}.txt"));
        if std::env::var_os("STRANDLIGHT_UPDATE_DOCS").is_some() {
            fs::create_dir_all(&folder).expect("writable");
            fs::write(&path, now).expect("writable");
            continue;
        }
        let before = fs::read_to_string(&path).unwrap_or_default();
        let has = |text: &str, item: &str| text.lines().any(|line| line == item);
        let new: Vec<&str> = now.lines().filter(|item| !has(&before, item)).collect();
        let gone: Vec<&str> = before.lines().filter(|item| !has(&now, item)).collect();
        assert!(
            now == before,
            "{name}: new {new:#?}, gone {gone:#?}; if that is meant: STRANDLIGHT_UPDATE_DOCS=1 \
             cargo test -p strandlight-tests --test library public_api::"
        );
    }
}

#[test]
fn every_library_crate_has_a_list() {
    let root = project_root();
    for entry in fs::read_dir(root.join("crates")).expect("the folder is there") {
        let name = entry.expect("readable").file_name();
        let is_listed = CRATES.iter().any(|(listed, _)| name == *listed);
        assert!(is_listed, "{name:?}");
    }
}

#[test]
fn declarations_are_found_whole() {
    let source = "pub use a::{\n    B, C,\n};\npub(crate) fn hidden() {}\npub const N: u32 = 3;\n\
                  pub fn f(\n    x: u32,\n) -> u32 {\n    x\n}\npub struct S {\n    pub x: f32,\n}\n\
                  #[cfg(test)]\nmod tests {\n    pub fn g() {}\n}\n";
    let expected = [
        "pub use a::{ B, C, }",
        "pub const N: u32",
        "pub fn f( x: u32, ) -> u32",
        "pub struct S",
        "pub x: f32",
    ];
    assert_eq!(declarations(source), expected);
}
