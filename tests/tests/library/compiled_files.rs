//! Every file of a crate is compiled: a module that none declares is silently left out, and so are its tests.

use std::fs;
use std::path::{Path, PathBuf};

use strandlight_tests::project_root;

/// Files below `folder` whose names end in `.rs`.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}

/// Does one of the files that may, declare the module of `file`? Beside it, or above it; a path that is said is
/// of the same folder.
fn is_declared(file: &Path, all: &[(PathBuf, String)]) -> bool {
    let name = file.file_name().expect("a name").to_string_lossy();
    let folder = file.parent().expect("a folder");
    let (module, home) = match name.strip_suffix(".rs") {
        Some("lib" | "main" | "build") => return true,
        Some("mod") => (
            folder.file_name().expect("a name").to_string_lossy(),
            folder.parent(),
        ),
        Some(stem) => (stem.into(), Some(folder)),
        None => return false,
    };
    let home = home.expect("a folder");
    let declares = format!("mod {module};");
    let by_path = format!("#[path = \"{name}\"]");
    all.iter().any(|(path, text)| {
        let of_home = [
            home.join("mod.rs"),
            home.join("lib.rs"),
            home.join("main.rs"),
            home.with_extension("rs"),
        ];
        let says = |wanted: &str| text.lines().any(|line| line.trim_start().ends_with(wanted));
        of_home.contains(path) && says(&declares) || path.parent() == Some(folder) && says(&by_path)
    })
}

#[test]
fn every_file_is_compiled() {
    let mut n_files = 0;
    for entry in fs::read_dir(project_root().join("crates")).expect("the crates are there") {
        let folder = entry.expect("it can be read").path().join("src");
        let texts = files(&folder).into_iter().map(|path| {
            let text = fs::read_to_string(&path).expect("it can be read");
            (path, text)
        });
        let all: Vec<(PathBuf, String)> = texts.collect();
        let programs = folder.join("bin");
        let left_out: Vec<&Path> = (all.iter().map(|(path, _)| path.as_path()))
            .filter(|path| path.parent() != Some(&programs) && !is_declared(path, &all))
            .collect();
        assert!(left_out.is_empty(), "no module declares {left_out:#?}");
        n_files += all.len();
    }
    assert!(n_files > 300, "only {n_files} files found");
}

#[test]
fn files_that_no_module_declares_are_found() {
    let file = |path: &str, text: &str| (PathBuf::from(path), text.to_owned());
    let all = [
        file("src/lib.rs", "mod a;\npub mod b;\n// mod c;\n"),
        file(
            "src/a.rs",
            "mod deep;\n    #[path = \"other_tests.rs\"]\n    mod tests;",
        ),
        file("src/b/mod.rs", ""),
        file("src/a/deep.rs", ""),
        file("src/other_tests.rs", ""),
        file("src/lost.rs", ""),
        file("src/b/tests.rs", ""),
    ];
    let lost: Vec<&str> = all
        .iter()
        .filter(|(path, _)| !is_declared(path, &all))
        .filter_map(|(path, _)| path.to_str())
        .collect();
    assert_eq!(lost, ["src/lost.rs", "src/b/tests.rs"]);
}
