//! A constant that a shader and Rust share under one name has one value.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use strandlight_tests::project_root;

/// Values of `const NAME: TYPE = NUMBER;` lines by name; `suffix` is dropped from numbers.
fn constants(text: &str, suffix: &str) -> Vec<(String, f32)> {
    text.lines()
        .filter_map(|line| {
            let line = line.trim();
            let (before, after) = line.split_once("const ")?;
            if !before.is_empty() && !before.starts_with("pub") {
                return None;
            }
            let (name, rest) = after.split_once(": ")?;
            let (_, value) = rest.split_once(" = ")?;
            let number = value
                .strip_suffix(';')?
                .trim_end_matches(suffix)
                .replace('_', "");
            Some((name.to_owned(), number.parse().ok()?))
        })
        .collect()
}

fn files(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() {
            files(&path, extension, found);
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn constants_agree() {
    let root = project_root();
    let mut rust = BTreeMap::<String, Vec<f32>>::new();
    let mut sources = Vec::new();
    for folder in [
        "crates/scattering/src/closed_form",
        "crates/runtime/src",
        "crates/bake/src/cpu",
    ] {
        files(&root.join(folder), "rs", &mut sources);
    }
    sources.push(root.join("crates/scattering/src/hair.rs"));
    for path in sources {
        let text = fs::read_to_string(path).expect("readable");
        for (name, value) in constants(&text, "") {
            rust.entry(name).or_default().push(value);
        }
    }
    // Rust has these in its standard library.
    rust.insert("PI".to_owned(), vec![std::f32::consts::PI]);
    rust.insert("HALF_PI".to_owned(), vec![std::f32::consts::FRAC_PI_2]);

    let mut shaders = Vec::new();
    files(&root.join("shaders"), "wgsl", &mut shaders);
    let mut checked = 0;
    for path in shaders {
        let shown = path.strip_prefix(root).unwrap_or(&path).display();
        let text = fs::read_to_string(&path).expect("readable");
        for (name, value) in constants(&text, "u") {
            // In Rust the paper's scheme has a module of its own.
            let name = name.strip_prefix("PAPER_").unwrap_or(&name);
            let Some(twins) = rust.get(name) else {
                assert!(
                    !path.starts_with(root.join("shaders/lib")),
                    "{shown}: {name} has no twin"
                );
                continue;
            };
            assert!(
                twins.contains(&value),
                "{shown}: {name} is {value}, in Rust {twins:?}"
            );
            checked += 1;
        }
    }
    assert!(checked >= 20, "only {checked} constants found");
}

#[test]
fn a_different_constant_is_seen() {
    let found = constants(
        "const A: f32 = 1.5;\n    const B: u32 = 2u;\nlet c = 3;\n",
        "u",
    );
    assert_eq!(found, [("A".to_owned(), 1.5), ("B".to_owned(), 2.0)]);
    assert_eq!(
        constants("pub(crate) const C: f32 = 3.544_907_7;", "")[0].1,
        3.544_907_7
    );
}
