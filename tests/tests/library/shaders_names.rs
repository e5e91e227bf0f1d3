//! The closed form in WGSL and in Rust: files of the same stem with the same functions in the
//! same order.

use std::fs;
use std::path::Path;

use strandlight_tests::project_root;

/// Functions that exist in WGSL alone; `shaders/README.md` says what stands for them in Rust.
const WGSL_ONLY: [&str; 13] = [
    "direction_in_frame",
    "h_column",
    "is_elliptic",
    "is_energy",
    "light_in_frame",
    "lobes_trt_at",
    "lobes_tt_at",
    "mix_floats",
    "lobe_numbers",
    "mix_fractions",
    "sample_row",
    "scaled_lobes",
    "unpack_shares",
];

/// Names of the functions that `text` defines at its outermost level, in order.
fn functions(text: &str) -> Vec<String> {
    let name = |line: &str| {
        let line = ["pub ", "pub(crate) ", "pub(super) "]
            .iter()
            .find_map(|prefix| line.strip_prefix(prefix))
            .unwrap_or(line);
        let line = line.strip_prefix("const ").unwrap_or(line);
        let name = line.strip_prefix("fn ")?.split(['(', '<']).next()?;
        Some(name.to_owned())
    };
    text.lines().filter_map(name).collect()
}

/// The first function of `shader` that `rust` lacks or has elsewhere in the order.
fn stray<'a>(shader: &'a [String], rust: &[String]) -> Option<&'a String> {
    let mut rest = rust.iter();
    shader
        .iter()
        .find(|name| !rest.any(|candidate| candidate == *name))
}

fn check(shaders: &Path, rust: &Path, prefix: &str) -> usize {
    let mut checked = 0;
    for entry in fs::read_dir(shaders).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let stem = path
            .file_stem()
            .and_then(|stem| stem.to_str())
            .unwrap_or("");
        let twin = rust.join(format!("{stem}.rs"));
        if path.is_dir() || !twin.exists() {
            continue;
        }
        let read = |path| functions(&fs::read_to_string(path).expect("readable"));
        let wgsl: Vec<String> = read(&path)
            .into_iter()
            .filter(|name| !WGSL_ONLY.contains(&name.as_str()))
            .map(|name| match name.strip_prefix(prefix) {
                Some(name) => name.to_owned(),
                None => panic!("{}: {name} lacks the prefix {prefix}", path.display()),
            })
            .collect();
        let stray = stray(&wgsl, &read(&twin));
        assert_eq!(stray, None, "{} against its twin", path.display());
        checked += wgsl.len();
    }
    checked
}

#[test]
fn functions_have_twins_of_the_same_name_and_order() {
    let root = project_root();
    let (shaders, rust) = (
        root.join("shaders/lib"),
        root.join("crates/scattering/src/closed_form"),
    );
    assert!(check(&shaders, &rust, "") >= 10);
    assert!(check(&shaders.join("paper"), &rust.join("paper"), "paper_") >= 10);
}

/// Names of all functions and methods in the files of a folder.
fn methods(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let text = fs::read_to_string(entry.expect("it can be read").path()).expect("readable");
        let code = text.split("#[cfg(test)]").next().unwrap_or(&text);
        let names_of = |line: &str| functions(line.trim_start());
        names.extend(code.lines().flat_map(names_of));
    }
    names
}

/// Methods in Rust, so in any order.
#[test]
fn tables_of_multiple_scattering_have_twins_of_the_same_name() {
    let root = project_root();
    let rust = methods(&root.join("crates/scattering/src/multiple_tables"));
    let elsewhere = [
        // `at` of `LagFunctions` and of `EllipticFunctions`.
        "multiple_lag_functions",
        "multiple_elliptic_functions",
        // Parts of `balance`, which walks along the rows, and of the texture.
        "balance_weights",
        "stored",
    ];
    let read = |name| fs::read_to_string(root.join(name)).expect("readable");
    let text =
        read("shaders/lib/multiple_tables.wgsl") + &read("shaders/pass/multiple_tables.wgsl");
    let entry_points = ["fill_rows", "fill_direct", "balance_rows", "balance_direct"];
    let mut checked = 0;
    for name in functions(&text) {
        let twin = name.strip_prefix("multiple_").unwrap_or(&name);
        if !elsewhere.contains(&name.as_str()) && !entry_points.contains(&twin) {
            assert!(rust.iter().any(|one| one == twin), "{name} has no twin");
            checked += 1;
        }
    }
    assert!(checked >= 10, "{checked}");
}

#[test]
fn missing_and_misplaced_functions_are_seen() {
    let names = |text: &str| functions(text);
    let rust = names("pub fn a(x: f32) {}\nfn b<T>() {}\n    fn inner() {}\npub const fn c() {}\n");
    assert_eq!(rust, ["a", "b", "c"]);
    assert_eq!(stray(&names("fn a()\nfn c()"), &rust), None);
    assert_eq!(stray(&names("fn a()\nfn d()"), &rust), Some(&"d".into()));
    assert_eq!(stray(&names("fn b()\nfn a()"), &rust), Some(&"a".into()));
}
