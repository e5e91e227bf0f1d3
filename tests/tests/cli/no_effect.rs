//! Options that have no effect beside others say so.

use std::process::{Command, Stdio};

use strandlight_tests::{assert_refused, project_root, strandlight};

/// What a command that succeeds says on stderr, run without input.
fn notes(command: &mut Command) -> String {
    let output = command.stdin(Stdio::null()).output().expect("it runs");
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stderr).expect("UTF-8")
}

#[test]
fn options_without_effect_are_told() {
    let picture = project_root().join("docs/book/src/images/false-colour.png");
    let compare = |extra: &[&str]| {
        let mut command = strandlight();
        command.arg("compare").args([&picture, &picture]);
        notes(command.args(extra))
    };
    assert!(compare(&["--exposure", "5"]).contains("--exposure has no effect on PNGs"));
    assert!(compare(&["--tone-map", "agx"]).contains("--tone-map has no effect on PNGs"));
    assert_eq!(compare(&["--quiet", "--exposure", "5"]), "");
    assert!(!compare(&["--exposure", "0"]).contains("no effect"));

    let probe = |method: &str| {
        let options = ["probe", "--segments", "9", "--method", method];
        notes(strandlight().args(options))
    };
    assert!(probe("runtime").contains("--segments has no effect with --method runtime"));
    assert_eq!(probe("paper"), "");
    assert_eq!(notes(strandlight().arg("probe")), "");

    let single = |adapter: &str| {
        let errors = ["bench", "single", "--n", "1", "--repetitions", "0"];
        notes(strandlight().args(errors).args(["--adapter", adapter]))
    };
    assert!(single("yes").contains("--adapter yes has no effect with --repetitions 0"));
    assert!(!single("auto").contains("no effect"));
}

#[test]
fn verify_measures_light_sets_alone_against_a_map() {
    let sample = project_root().join("data/sample");
    let tables = project_root().join("data/lean.tables");
    let verify = |extra: &[&str]| {
        let mut command = strandlight();
        command.current_dir(&sample).arg("verify").args(extra);
        command
    };
    let mut without = verify(&["studio.lights", "--max-error", "1%"]);
    assert_refused(&mut without, &["--map"]);
    let mut of_tables = verify(&["--map", "studio.exr"]);
    let said = notes(of_tables.arg(&tables));
    assert!(said.contains("--map has no effect"), "{said}");
}
