//! The page that shows the house names every room, and no file sends its reader to a page that is
//! not there.

use std::fs;
use std::path::{Path, PathBuf};

use strandlight_tests::project_root;

#[test]
fn every_crate_and_folder_is_named_in_the_architecture_page() {
    let root = project_root();
    let page = fs::read_to_string(root.join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    let mut checked = 0;
    for parent in ["crates", "shaders"] {
        for entry in fs::read_dir(root.join(parent)).expect("the folder is there") {
            let path = entry.expect("it can be read").path();
            if path.is_dir() {
                let name = path
                    .file_name()
                    .and_then(|name| name.to_str())
                    .unwrap_or_default();
                let room = format!("`{parent}/{name}`");
                assert!(page.contains(&room), "{room} is missing");
                checked += 1;
            }
        }
    }
    assert!(checked >= 6, "only {checked} folders found");
}

/// Text files below `folder`, but for what is built.
fn text_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default();
        if path.is_dir() {
            if !["target", ".git", "node_modules"].contains(&name) {
                text_files(&path, found);
            }
        } else if let Some("rs" | "wgsl" | "md" | "toml" | "js" | "html") =
            path.extension().and_then(|extension| extension.to_str())
        {
            found.push(path);
        }
    }
}

/// The Markdown files that `text` names; those of other sites are left out.
fn cited(text: &str) -> Vec<&str> {
    text.split(|c: char| !(c.is_ascii_alphanumeric() || "./:_-".contains(c)))
        .map(|word| word.trim_end_matches(['.', ':']))
        .filter(|word| word.ends_with(".md") && word.len() > 3 && !word.contains("://"))
        .collect()
}

#[test]
fn every_page_that_a_file_cites_is_there() {
    let root = project_root();
    let mut files = Vec::new();
    text_files(root, &mut files);
    assert!(files.len() >= 300, "only {} files found", files.len());
    let mut checked = 0;
    for file in files {
        let text = fs::read_to_string(&file).expect("text");
        for page in cited(&text) {
            let beside = file.parent().unwrap_or(root).join(page);
            assert!(
                beside.is_file() || root.join(page).is_file(),
                "{} cites {page}, which is not there",
                file.display()
            );
            checked += 1;
        }
    }
    assert!(checked >= 3, "only {checked} citations found");
}

#[test]
fn citations_are_found() {
    let page = ["algorithms", "md"].join(".");
    let text =
        format!("// N_TT(pi) of {page} section 9; [b](docs/{page}). https://a.b/{page} x.mdx\n");
    assert_eq!(cited(&text), [page.clone(), format!("docs/{page}")]);
}
