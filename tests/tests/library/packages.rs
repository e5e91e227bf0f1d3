//! What users of the library crates take with them.

use std::collections::BTreeSet;
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

/// Packages with their features, by `cargo tree` with `options`.
fn features(options: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .current_dir(project_root())
        .args(["tree", "--locked", "--offline", "--prefix", "none"])
        .args(["--format", "{p} {f}"])
        .args(options)
        .output()
        .expect("cargo runs");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let lines = text.lines().map(|line| line.trim_end_matches(" (*)"));
    lines.map(str::to_owned).collect()
}

/// Or else all that they are made of is built twice: for the tests, and for the programs that tests call.
#[test]
fn tests_turn_on_no_features_of_what_the_programs_are_made_of() {
    let programs = ["-p", "strandlight-bake", "-p", "strandlight-runtime"];
    let programs = features(&[&programs[..], &["--edges", "normal"]].concat());
    let with_tests = features(&["--workspace"]);
    assert!(programs.len() > 100 && with_tests.len() > programs.len());
    let twice: Vec<_> = programs.difference(&with_tests).collect();
    assert!(twice.is_empty(), "{twice:#?}");
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
