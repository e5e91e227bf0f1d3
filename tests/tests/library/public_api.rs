//! `docs/public-api/` lists the public items of every library crate as `cargo public-api` prints
//! them; `docs/public-api/update` writes the lists. That needs a nightly compiler, which tests do
//! not: they find lists that are plainly out of date.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use strandlight_tests::project_root;

/// The library crates with the folders of their sources.
fn crates() -> Vec<(String, PathBuf)> {
    let root = project_root();
    let entries = fs::read_dir(root.join("crates")).expect("the folder is there");
    let folders = entries.map(|entry| entry.expect("readable").path());
    // The Python module is no library of Rust.
    let folders = folders.filter(|folder| !folder.ends_with("python"));
    let mut all: Vec<_> = folders
        .map(|folder| {
            let name = folder.file_name().expect("a name").to_string_lossy();
            (name.into_owned(), folder.join("src"))
        })
        .collect();
    all.extend(["data", "shaders"].map(|name| (name.to_owned(), root.join(name))));
    all
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.split(move |c| !is_part(c))
        .filter(|word| !word.is_empty())
}

fn add_words(folder: &Path, found: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            add_words(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = fs::read_to_string(&path).expect("UTF-8");
            found.extend(words(&source).map(str::to_owned));
        }
    }
}

/// The item of a line of a list, without its path and its type: `Picture` of
/// `pub struct strandlight_scene::picture::Picture`. Lines of impls have none.
fn item(line: &str) -> Option<&str> {
    let line = line.strip_prefix("#[non_exhaustive] ").unwrap_or(line);
    let declared = line.strip_prefix("pub ")?;
    let path = declared
        .split(' ')
        .find(|word| word.starts_with("strandlight_"))?;
    let path = path.split(['(', '<']).next()?.trim_end_matches(':');
    words(path).last()
}

/// Names that a crate's root makes public: its modules and what it re-exports. Those of some
/// features or targets only, and hidden ones, are left out.
fn root_names(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut is_left_out = false;
    let mut statements = source.lines().filter(|line| !line.starts_with("//"));
    while let Some(line) = statements.next() {
        if line.starts_with("#[cfg(") || line.starts_with("#[doc(hidden)]") {
            is_left_out = true;
            continue;
        }
        let (is_module, is_use) = (line.starts_with("pub mod "), line.starts_with("pub use "));
        if !is_module && !is_use {
            is_left_out &= line.starts_with("#[");
            continue;
        }
        let mut whole = line.to_owned();
        while is_use && !whole.ends_with(';') {
            whole += statements.next().expect("the end of the statement");
        }
        if !std::mem::take(&mut is_left_out) {
            // Of `use a::{B, C as D}` the names at the ends of paths.
            let names = whole.rsplit("::{").next().unwrap_or_default().split(',');
            found.extend(
                names
                    .filter_map(|name| words(name).last())
                    .map(str::to_owned),
            );
        }
    }
    found
}

#[test]
fn the_lists_of_public_items_are_of_this_code() {
    for (name, sources) in crates() {
        let path = project_root().join(format!("docs/public-api/{name}.txt"));
        let list = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let listed: BTreeSet<&str> = list.lines().filter_map(item).collect();
        let mut known = BTreeSet::from([format!("strandlight_{name}")]);
        add_words(&sources, &mut known);
        // What macros make, such as the methods of flags, stands in no source.
        let kinds = ["struct", "enum", "trait", "mod"].map(|kind| format!("pub {kind} "));
        let types = (list.lines()).filter(|line| kinds.iter().any(|kind| line.contains(kind)));
        let mut gone: Vec<_> = types.filter_map(item).collect();
        gone.retain(|item| !known.contains(*item));
        let root = fs::read_to_string(sources.join("lib.rs")).expect("UTF-8");
        let mut new = root_names(&root);
        assert!(!new.is_empty() || !listed.is_empty(), "{name}");
        new.retain(|item| !listed.contains(&**item));
        assert!(
            gone.is_empty() && new.is_empty(),
            "{name}: gone {gone:?}, new {new:?}: run docs/public-api/update"
        );
    }
}

#[test]
fn items_and_names_are_found() {
    let line = "pub fn strandlight_scene::tone::ToneMap::apply(self, [f32; 3]) -> [f32; 3]";
    assert_eq!(item(line), Some("apply"));
    let line = "pub strandlight_scene::assets::Diameters::max: f32";
    assert_eq!(item(line), Some("max"));
    assert_eq!(item("impl strandlight_scene::Picture"), None);
    let source = "pub mod a;\n#[cfg(feature = \"ui\")]\npub mod b;\nmod c;\npub use c::{\n    D, E as F,\n};\n\
                  pub use g;\n#[doc(hidden)]\npub use h::I;\npub use j::K;\n";
    assert_eq!(root_names(source), ["a", "D", "F", "g", "K"]);
}
