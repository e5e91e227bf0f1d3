//! `strandlight stress` from the outside, in a small run.

use std::io::Write;
use std::process::{Command, Stdio};

use serde_json::Value;
use strandlight_tests::{assert_refused, project_root, strandlight};

/// Runs the command with `--json`; the document and the exit code.
fn stress(args: &[&str], threads: &str) -> (Value, Option<i32>) {
    let output = strandlight()
        .args(["stress", "--json"])
        .args(args)
        .env("RAYON_NUM_THREADS", threads)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), 1, "one document on one line");
    (serde_json::from_str(&text).unwrap(), output.status.code())
}

/// The one answer of `strandlight probe` to `query`.
fn probe(method: &str, query: &Value) -> Value {
    let mut child = Command::new(strandlight().get_program())
        .args(["probe", "--method", method])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    writeln!(child.stdin.take().unwrap(), "{query}").unwrap();
    let output = child.wait_with_output().unwrap();
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    answer["value"].clone()
}

/// The first component of a number or RGB.
fn first(value: &Value) -> f64 {
    value.get(0).unwrap_or(value).as_f64().unwrap()
}

#[test]
fn gpu_the_report_is_stable_and_its_worst_cases_can_be_asked_again() {
    let (report, code) = stress(&["--n", "200", "--seed", "3"], "1");
    let (again, _) = stress(&["--n", "200", "--seed", "3"], "3");
    assert_eq!(report, again, "the number of threads matters");
    let (other, _) = stress(&["--n", "200", "--seed", "4", "--no-gpu"], "2");
    assert_ne!(report, other, "the seed does not matter");

    let checks = report["checks"].as_array().unwrap();
    assert!(checks.len() > 50);
    let failed = checks
        .iter()
        .filter(|check| check["status"] == "FAILED")
        .count();
    assert_eq!(report["passed"], failed == 0);
    assert_eq!(code, Some(i32::from(failed > 0)));
    for check in checks {
        assert_ne!(check["status"], "not run", "{check}");
        assert!(check["values"].as_u64().unwrap() > 0, "{check}");
        let held = check["bound"].as_f64();
        let worst = &check["worst"]["error"];
        let within = held.is_none_or(|bound| worst.as_f64().is_some_and(|w| w <= bound));
        assert_eq!(check["status"] == "FAILED", !within, "{check}");
    }
    for check in other["checks"].as_array().unwrap() {
        let on_gpu = check["backend"].as_str().unwrap().contains("gpu");
        assert_eq!(check["status"] == "not run", on_gpu, "{check}");
    }

    assert_eq!(report["scheme"], "runtime");
    assert_eq!(report["passed"], true);
    let mut n_asked = 0;
    for check in checks {
        let (name, worst) = (check["check"].as_str().unwrap(), &check["worst"]);
        if name.starts_with("wide light") || name.starts_with("accuracy") {
            let found = probe("runtime", &worst["inputs"]);
            let expected = probe("reference", &worst["inputs"]);
            // The probe wraps azimuths in f64, which may move them by an ulp.
            let (a, b) = (first(&found), first(&worst["found"]));
            assert!((a - b).abs() <= 1e-4 * b.abs(), "{check}");
            let (a, b) = (first(&expected), first(&worst["expected"]));
            assert!((a - b).abs() <= 1e-4 * b.abs(), "{check}");
            n_asked += 1;
        }
    }
    assert_eq!(n_asked, 12);
}

/// What says that it is a query is one.
#[test]
fn worst_cases_that_are_queries_are_answered() {
    let (report, _) = stress(&["--n", "20", "--no-gpu"], "2");
    let checks = report["checks"].as_array().unwrap().iter();
    let inputs = checks.map(|check| &check["worst"]["inputs"]);
    let queries: Vec<&Value> = inputs.filter(|inputs| inputs["q"].is_string()).collect();
    assert!(queries.len() > 15, "{report}");
    for query in queries {
        let answer = probe("runtime", query);
        assert!(answer.is_number() || answer.is_array(), "{query}");
    }
}

/// Every check compares something, however small the run.
#[test]
fn slow_small_runs_pass() {
    let [lean, whole] = ["lean", "default"].map(|name| {
        let path = project_root().join(format!("data/{name}.tables"));
        path.to_str().expect("UTF-8").to_owned()
    });
    for (n, seed, tables) in [("1", "0", &lean), ("2", "1", &whole), ("10", "0", &whole)] {
        let args = ["--n", n, "--seed", seed, "--no-gpu", "--tables", &**tables];
        let (report, code) = stress(&args, "2");
        let checks = report["checks"].as_array().unwrap();
        for check in checks {
            let (is_run, n_values) = (check["status"] != "not run", check["values"].as_u64());
            assert!(!is_run || n_values.unwrap() > 0, "--n {n}: {check}");
            assert_ne!(check["status"], "FAILED", "--n {n}: {check}");
        }
        assert_eq!(code, Some(0), "--n {n}");
    }
}

/// The paper's scheme loses energy: the checks can fail.
#[test]
fn the_paper_fails() {
    let (report, code) = stress(&["--n", "200", "--method", "paper", "--no-gpu"], "2");
    assert_eq!(code, Some(1));
    assert_eq!(report["scheme"], "paper");
    assert_eq!(report["passed"], false);
    let status = |name: &str| {
        let checks = report["checks"].as_array().unwrap();
        let check = checks.iter().find(|check| check["check"] == name);
        check.unwrap()["status"].clone()
    };
    for name in [
        "energy azimuthal R",
        "energy azimuthal TT",
        "energy azimuthal TRT",
    ] {
        assert_eq!(status(name), "FAILED");
    }
    assert_eq!(status("symmetry azimuthal"), "ok");
    assert_eq!(status("invalid parameters, API"), "ok");
}

#[test]
fn bad_arguments_are_refused() {
    for (args, needle) in [
        (["--n", "0"], "0"),
        (["--n", "1e9"], "1e9"),
        (["--seed", "-1"], "-1"),
        (["--tables", "nowhere.tables"], "nowhere.tables"),
    ] {
        assert_refused(strandlight().arg("stress").args(args), &[needle]);
    }
    let lean = project_root().join("data/lean.tables");
    let mut paper = strandlight();
    paper.args(["stress", "--method", "paper", "--no-gpu", "--tables"]);
    assert_refused(paper.arg(lean), &["lean.tables: ", "'H_TT'"]);
}
