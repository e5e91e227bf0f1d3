//! The promised toolchain is stated once, and every package keeps to it.

use std::fs;

use strandlight_tests::project_root;

/// The oldest toolchain that builds the workspace. `.ci/run` checks with it when it runs on a newer
/// one.
const PROMISED: &str = "1.95";

/// The value of `key = "..."` in a manifest.
fn value<'a>(manifest: &'a str, key: &str) -> Option<&'a str> {
    let mut lines = manifest.lines();
    lines.find_map(|line| {
        let rest = line.strip_prefix(key)?.trim_start().strip_prefix('=')?;
        rest.trim().strip_prefix('"')?.strip_suffix('"')
    })
}

#[test]
fn every_package_promises_the_same_toolchain() {
    let root = project_root();
    let read = |path: &str| fs::read_to_string(root.join(path)).expect(path);
    assert_eq!(value(&read("Cargo.toml"), "rust-version"), Some(PROMISED));
    let mut manifests: Vec<String> = ["shaders", "data", "tests"].map(str::to_owned).to_vec();
    for entry in fs::read_dir(root.join("crates")).expect("a folder") {
        let name = entry.expect("readable").file_name();
        manifests.push(format!("crates/{}", name.to_str().expect("ASCII")));
    }
    assert!(manifests.len() >= 7, "{manifests:?}");
    for folder in manifests {
        let manifest = read(&format!("{folder}/Cargo.toml"));
        let is_kept = manifest.contains("\nrust-version.workspace = true\n");
        assert!(is_kept, "{folder}/Cargo.toml: rust-version");
    }
}

#[test]
fn a_value_is_found_by_its_key_alone() {
    let manifest = "name = \"a\"\nrust-version = \"1.2\"\n";
    assert_eq!(value(manifest, "rust-version"), Some("1.2"));
    assert_eq!(value(manifest, "rust"), None);
}
