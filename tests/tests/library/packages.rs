//! What users of the library crates take with them.

use std::process::Command;

use strandlight_tests::project_root;

/// The packages that a library user of `package` builds, by `cargo tree`.
fn dependencies(package: &str, options: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .current_dir(project_root())
        .args(["tree", "--locked", "--offline", "--prefix", "none"])
        .args(["--edges", "normal", "--package", package])
        .args(options)
        .output()
        .expect("cargo runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

fn has(tree: &str, package: &str) -> bool {
    tree.lines()
        .any(|line| line.split(' ').next() == Some(package))
}

#[test]
fn the_baking_library_alone_takes_nothing_of_its_command_line() {
    let of_program = ["clap", "clap_complete", "clap_mangen", "indicatif"];
    let library = dependencies("strandlight-bake", &["--no-default-features"]);
    assert!(has(&library, "strandlight-formats"), "{library}");
    for package in of_program
        .into_iter()
        .chain(["strandlight-lab", "serde_json"])
    {
        assert!(!has(&library, package), "{package} in {library}");
    }
    let program = dependencies("strandlight-bake", &[]);
    for package in of_program {
        assert!(has(&program, package), "{package} is not in {program}");
    }
}

#[test]
fn preparing_a_scene_takes_no_gpu() {
    for package in ["strandlight-scene", "strandlight-cpu"] {
        let tree = dependencies(package, &[]);
        assert!(!has(&tree, "wgpu"), "{package}: {tree}");
    }
}

#[test]
fn the_viewer_takes_paths_to_ground_truth_but_no_openexr() {
    let tree = dependencies("strandlight-runtime", &[]);
    assert!(has(&tree, "strandlight-reference"), "{tree}");
    for package in ["exr", "strandlight-images", "clap"] {
        assert!(!has(&tree, package), "{package} in {tree}");
    }
}
