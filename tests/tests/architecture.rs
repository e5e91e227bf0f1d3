//! The page that shows the house names every room.

use std::fs;

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
