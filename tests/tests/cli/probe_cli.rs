//! `strandlight probe` from the outside.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use serde_json::Value;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, TableFile};
use strandlight_scattering::{HairParams, Lobe, PerLobe};
use strandlight_tests::random::SplitMix64;
use strandlight_tests::{oracle, project_root, strandlight};

const HAIR: &str = r#"{"eta":1.55,"sigma_a":[0.2,0.3,0.5],"shift":{"r":-0.1,"tt":0.05,"trt":0.15},"width":{"r":0.18,"tt":0.09,"trt":0.36},"caustic_width":0.1,"eccentricity":1.0}"#;

/// Feeds `lines` to the command and returns its answers, which must be as many.
fn ask(command: &mut Command, lines: &[String]) -> Vec<Value> {
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let text = lines.join("\n") + "\n";
    let writer = std::thread::spawn(move || stdin.write_all(text.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let answers: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(answers.len(), lines.len());
    answers
}

/// The command with tables from this crate's own quadrature, and the bundled lobes.
fn probe(method: &str) -> Command {
    static FILE: OnceLock<tempfile::NamedTempFile> = OnceLock::new();
    let file = FILE.get_or_init(|| {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut tables = oracle::tables(false);
        let bundled = TableFile::from_bytes(DEFAULT_TABLES).unwrap().tables;
        let lobes = bundled
            .into_iter()
            .filter(|table| table.name.starts_with("lobes"));
        tables.tables.extend(lobes);
        std::fs::write(file.path(), tables.to_bytes().unwrap()).unwrap();
        file
    });
    let mut command = strandlight();
    command
        .args(["probe", "--method", method, "--tables"])
        .arg(file.path());
    command
}

fn number(answer: &Value) -> f64 {
    answer["value"]
        .as_f64()
        .unwrap_or_else(|| panic!("{answer}"))
}

#[test]
fn answers_come_in_order_and_bad_lines_are_errors() {
    let lines: Vec<String> = [
        r#"{"q":"table_C","k":3,"lambda":0.5,"phi":2.0}"#,
        "not json",
        "",
        r#"{"q":"table_C","k":9,"lambda":0.5,"phi":2.0}"#,
        r#"{"q":"nothing"}"#,
        r#"{"q":"average","name":"a_f"}"#,
        r#"{"q":"table_H","mode":"TT","k":2,"eta":1.55,"theta_d":0.6,"fresnel":"schlick"}"#,
        r#"{"q":"table_H","mode":"TT","k":2,"eta":1.55,"theta_d":0.6,"fresnel":"dielectric"}"#,
    ]
    .map(str::to_owned)
    .to_vec();
    let answers = ask(&mut probe("runtime"), &lines);
    assert!((number(&answers[0]) - 0.167_204_622_871).abs() < 5e-4 * 0.9);
    for answer in &answers[1..7] {
        assert!(answer["error"].is_string(), "{answer}");
    }
    assert!((number(&answers[7]) - 0.493_502_932_095).abs() < 1e-3);
}

/// Of a stream of queries without end the command answers as many as somebody reads.
#[test]
fn it_ends_when_nobody_reads_its_answers() {
    let mut child = strandlight()
        .arg("probe")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut answers = BufReader::new(child.stdout.take().unwrap());
    let query = b"{\"q\":\"table_C\",\"k\":3,\"lambda\":0.2,\"phi\":1.0}\n";
    stdin.write_all(query).unwrap();
    let mut answer = String::new();
    answers.read_line(&mut answer).unwrap();
    assert!(answer.contains("value"), "{answer}");
    drop(answers);
    let is_taken = (0..200_000).all(|_| stdin.write_all(query).is_ok());
    drop(stdin);
    assert!(child.wait().unwrap().success());
    assert!(!is_taken, "it goes on without anybody to read it");
}

/// A line of every kind of query, and bad ones, for some fibres; few enough for the exact model.
fn mixed_lines() -> Vec<String> {
    let elliptic = HAIR
        .replace("1.55", "1.6")
        .replace(r#""eccentricity":1.0"#, r#""eccentricity":0.9"#);
    let bad = HAIR.replace("1.55", "0.5");
    let mut lines: Vec<String> = [
        "",
        "not json",
        r#"{"q":"nothing"}"#,
        r#"{"q":"table_C","k":9,"lambda":0.2,"phi":1.0}"#,
        r#"{"q":"table_C","k":3,"lambda":0.2,"phi":1.0}"#,
        r#"{"q":"table_C","k":0,"lambda":2.0,"phi":3.0}"#,
        r#"{"q":"table_H","mode":"TT","k":2,"eta":1.55,"theta_d":0.3}"#,
        r#"{"q":"table_H","mode":"TRT","k":6,"eta":1.4,"theta_d":-0.9}"#,
        r#"{"q":"table_H","mode":"TRT","k":6,"eta":1.4,"theta_d":0,"fresnel":"schlick"}"#,
    ]
    .map(str::to_owned)
    .to_vec();
    for hair in [HAIR, &elliptic, &bad] {
        for mode in ["R", "TT", "TRT"] {
            lines.push(format!(
                r#"{{"q":"azimuthal","mode":"{mode}","lambda":0.3,"dphi":0.5,"theta_d":0.1,"hair":{hair}}}"#
            ));
        }
        let rest = format!(r#""view":{{"theta":0.2,"phi":0.4}},"hair":{hair}}}"#);
        for mode in ["R", "TRT", "all"] {
            lines.push(format!(
                r#"{{"q":"single","mode":"{mode}","light":{{"theta":0.1,"phi":2.0,"lambda":0.3}},{rest}"#
            ));
        }
        for mode in ["R", "all"] {
            lines.push(format!(
                r#"{{"q":"global","mode":"{mode}","light":{{"theta":0.1,"phi":2.0}},"sigma_f":0.4,{rest}"#
            ));
        }
        lines.push(format!(
            r#"{{"q":"local","light":{{"theta":0.1,"phi":2.0}},"sigma_f":0.4,{rest}"#
        ));
        for name in ["a_f", "alpha_f", "A_b"] {
            lines.push(format!(
                r#"{{"q":"average","name":"{name}","theta_d":0.2,"hair":{hair}}}"#
            ));
        }
    }
    lines
}

/// The answer to each of `lines`, asked one at a time: the next when the last is answered.
fn ask_one_by_one(command: &mut Command, lines: &[String]) -> Vec<Value> {
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let answers = lines
        .iter()
        .map(|line| {
            writeln!(stdin, "{line}").unwrap();
            stdin.flush().unwrap();
            let mut answer = String::new();
            stdout.read_line(&mut answer).unwrap();
            serde_json::from_str(&answer).unwrap()
        })
        .collect();
    drop(stdin);
    assert!(child.wait().unwrap().success());
    answers
}

/// Whatever stands beside a line in a batch, its answer is its own.
#[test]
fn gpu_answers_belong_to_their_lines() {
    let lines = mixed_lines();
    let mut random = SplitMix64(11);
    // The exact model takes its time over these: 11 of 12 are asked something else.
    let is_slow = |ix: usize| {
        let slow = ["\"single\"", "\"global\"", "\"local\""];
        slow.iter().any(|kind| lines[ix].contains(kind))
    };
    let asked: Vec<usize> = std::iter::repeat_with(|| random.next_u64())
        .map(|bits| ((bits >> 32) as usize % lines.len(), bits % 12 == 0))
        .filter(|&(ix, is_rare)| is_rare || !is_slow(ix))
        .map(|(ix, _)| ix)
        .take(2000)
        .collect();
    let n_asked = |what: &str| asked.iter().filter(|&&ix| lines[ix].contains(what)).count();
    for kind in [
        "table_C",
        "table_H",
        "azimuthal",
        "single",
        "global",
        "local",
        "average",
    ] {
        assert!(n_asked(kind) >= 4, "{kind}");
    }
    let batch: Vec<String> = asked.iter().map(|&ix| lines[ix].clone()).collect();
    for method in ["runtime", "gpu", "reference", "paper"] {
        let command = || {
            let mut command = strandlight();
            command.args(["probe", "--method", method]);
            command
        };
        let alone = ask_one_by_one(&mut command(), &lines);
        let (good, bad): (Vec<&Value>, Vec<&Value>) = alone
            .iter()
            .partition(|answer| answer.get("value").is_some());
        assert!(good.len() > 20 && bad.len() > 12, "{method}");
        // Answers that could be taken for each other would hide a slip.
        let mut texts: Vec<String> = good.iter().map(|answer| answer.to_string()).collect();
        texts.sort_unstable();
        texts.dedup();
        assert!(texts.len() + 4 > good.len(), "{method}");
        let together = ask(&mut command(), &batch);
        for ((&ix, line), answer) in asked.iter().zip(&batch).zip(&together) {
            assert_eq!(*answer, alone[ix], "{method}: {line}");
        }
    }
}

/// Random queries of all kinds.
fn queries(n: usize) -> Vec<String> {
    let mut random = SplitMix64(20);
    let mut lines = Vec::new();
    for ix in 0..n {
        let lambda = random.log_uniform(0.05, 1.5);
        let theta = [(); 3].map(|()| random.uniform(-1.2, 1.2));
        let phi = [(); 2].map(|()| random.uniform(-3.1, 3.1));
        let mode = ["R", "TT", "TRT", "all"][ix % 4];
        lines.push(match ix % 3 {
            0 => format!(
                r#"{{"q":"table_C","k":{},"lambda":{lambda},"phi":{}}}"#, ix % 7, phi[0]
            ),
            1 if mode != "all" => format!(
                r#"{{"q":"azimuthal","mode":"{mode}","lambda":{lambda},"dphi":{},"theta_d":{},"hair":{HAIR}}}"#,
                phi[0], theta[0]
            ),
            _ => format!(
                r#"{{"q":"single","mode":"{mode}","light":{{"theta":{},"phi":{},"lambda":{lambda}}},"view":{{"theta":{},"phi":{}}},"hair":{HAIR}}}"#,
                theta[0], phi[0], theta[1], phi[1]
            ),
        });
    }
    lines
}

/// All numbers of an answer.
fn values(answer: &Value) -> Vec<f64> {
    match &answer["value"] {
        Value::Array(rgb) => rgb.iter().map(|value| value.as_f64().unwrap()).collect(),
        _ => vec![number(answer)],
    }
}

#[test]
fn gpu_and_runtime_answer_alike_and_near_the_paper() {
    let lines = queries(600);
    let runtime = ask(&mut probe("runtime"), &lines);
    let paper = ask(&mut probe("paper"), &lines);
    let default = ask(probe("paper").args(["--segments", "4"]), &lines);
    assert_eq!(paper, default);
    let coarse = ask(probe("paper").args(["--segments", "2"]), &lines);
    assert_ne!(paper, coarse);
    let gpu = ask(&mut probe("gpu"), &lines);
    let mut n_checked = 0;
    for ((line, a), b) in lines.iter().zip(&runtime).zip(&gpu) {
        let (a, b) = (values(a), values(b));
        // A number where no absorption enters, RGB elsewhere.
        let is_number = line.contains("table_C") || line.contains(r#""mode":"R""#);
        assert_eq!(a.len(), if is_number { 1 } else { 3 }, "{line}");
        let scale = a.iter().fold(1e-3, |max: f64, value| max.max(value.abs()));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-4 * scale, "{line}: {a} {b}");
            n_checked += 1;
        }
    }
    assert!(n_checked > 1000);
    // The paper's scheme errs by some percent, the renderer's by some thousandths.
    let (mut apart, mut norm) = (0.0, 0.0);
    for (line, (a, b)) in lines.iter().zip(runtime.iter().zip(&paper)) {
        if line.contains(r#""mode":"all""#) {
            for (a, b) in values(a).iter().zip(values(b)) {
                apart += (a - b).powi(2);
                norm += a * a;
            }
        }
    }
    let apart: f64 = f64::sqrt(apart / norm);
    println!("the paper's scheme is {apart:.4} away");
    assert!((0.01..0.1).contains(&apart), "{apart}");
}

#[test]
fn tables_without_lobes_answer_what_needs_none() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), oracle::tables(false).to_bytes().unwrap()).unwrap();
    let mut command = strandlight();
    command.args(["probe", "--tables"]).arg(file.path());
    let answers = ask(&mut command, &queries(2));
    assert!(answers[0]["value"].is_number(), "{}", answers[0]);
    let message = answers[1]["error"].as_str().unwrap_or_default();
    assert!(message.contains("lobes_TT_shapes"), "{message}");
}

/// Drawing reads no H: what `tables --lean` writes answers as the whole file does.
#[test]
fn lean_tables_answer_all_but_h() {
    let lean = project_root().join("data/lean.tables");
    let lines = queries(7);
    for method in ["runtime", "reference"] {
        let answers = |tables: &[&std::ffi::OsStr]| {
            let mut command = strandlight();
            ask(
                command.args(["probe", "--method", method]).args(tables),
                &lines,
            )
        };
        assert_eq!(
            answers(&["--tables".as_ref(), lean.as_os_str()]),
            answers(&[])
        );
    }
    let h = r#"{"q":"table_H","mode":"TT","k":2,"eta":1.5,"theta_d":0.1}"#.to_owned();
    let answers = ask(
        strandlight().args(["probe", "--tables"]).arg(&lean),
        &[h, lines[0].clone()],
    );
    let message = answers[0]["error"].as_str().unwrap_or_default();
    assert!(message.contains("lean"), "{message}");
    assert!(answers[1]["value"].is_number(), "{}", answers[1]);

    let mut paper = strandlight();
    paper.args(["probe", "--method", "paper", "--tables"]);
    let output = paper.arg(&lean).stdin(Stdio::null()).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        message.contains("lean.tables: ") && message.contains("'H_TT'"),
        "{message}"
    );
}

/// The exact model by the command and by this crate's own quadrature.
#[test]
fn the_reference_is_exact() {
    let lines: Vec<String> = (0..7)
        .map(|k| format!(r#"{{"q":"table_C","k":{k},"lambda":0.5,"phi":2.0}}"#))
        .chain((0..4).map(|k| {
            format!(
                r#"{{"q":"table_H","mode":"TRT","k":{},"eta":1.55,"theta_d":1.2}}"#,
                2 * k
            )
        }))
        .collect();
    let answers = ask(&mut probe("reference"), &lines);
    let c = oracle::c_k(8.0, 2.0);
    let h = oracle::h_k(1.55, 1.2f64.cos(), 2, false);
    for (answer, exact) in answers.iter().zip(c[..7].iter().chain(&h)) {
        assert!((number(answer) - exact).abs() < 1e-9, "{answer} {exact}");
    }

    let hair = HairParams {
        eta: 1.55,
        sigma_a: [0.2, 0.3, 0.5],
        shift: PerLobe {
            r: -0.1,
            tt: 0.05,
            trt: 0.15,
        },
        width: PerLobe {
            r: 0.18,
            tt: 0.09,
            trt: 0.36,
        },
        caustic_width: 0.1,
        ..HairParams::default()
    };
    let mut random = SplitMix64(21);
    let mut n_checked = 0;
    for lobe in Lobe::ALL {
        for _ in 0..5 {
            let lambda = random.log_uniform(0.15, 1.0);
            let [theta_j, theta_o] = [(); 2].map(|()| random.uniform(-1.0, 1.0));
            let phi = random.uniform(-3.0, 3.0);
            let line = format!(
                r#"{{"q":"single","mode":"{}","light":{{"theta":{theta_j},"phi":0.4,"lambda":{lambda}}},"view":{{"theta":{theta_o},"phi":{phi}}},"hair":{HAIR}}}"#,
                lobe.name()
            );
            let answer = values(&ask(&mut probe("reference"), &[line])[0]);
            let exact = oracle::single(lobe, (theta_j, 0.4, lambda), (theta_o, phi), &hair);
            for (a, b) in answer.iter().zip(exact) {
                assert!((a - b).abs() < 1e-4 * b + 1e-6, "{lobe:?} {a} {b}");
                n_checked += 1;
            }
        }
    }
    assert_eq!(n_checked, 5 + 15 + 15);
}

#[test]
fn bundled_tables_are_the_default() {
    let lines = queries(300);
    let bundled = ask(strandlight().arg("probe"), &lines);
    let own = ask(&mut probe("runtime"), &lines);
    for ((line, a), b) in lines.iter().zip(&bundled).zip(&own) {
        for (a, b) in values(a).iter().zip(values(b)) {
            assert!((a - b).abs() < 1e-4 * b.abs().max(1e-2), "{line}: {a} {b}");
        }
    }
}

/// Averages by each method: published values, and the equation that many events solve.
#[test]
fn gpu_averages_are_those_of_the_model() {
    // Trapezoid sums for sigma_a 0.1 and 0.3, without the blur of TRT; a_f and a_b to 2e-4.
    let hair = r#"{"eta":1.55,"sigma_a":[0.1,0.3,0.3],"shift":{"r":-0.07,"tt":0.035,"trt":0.105},
        "width":{"r":0.15,"tt":0.075,"trt":0.30},"caustic_width":0.01}"#
        .replace('\n', " ");
    let names = [
        "a_f", "a_b", "alpha_f", "alpha_b", "beta_f", "beta_b", "A_b", "Delta_b", "sigma_b",
    ];
    let lines: Vec<String> = [0.0, 0.8]
        .iter()
        .flat_map(|theta| names.map(|name| (theta, name)))
        .map(|(theta, name)| {
            format!(r#"{{"q":"average","name":"{name}","theta_d":{theta},"hair":{hair}}}"#)
        })
        .collect();
    let by = |method: &str| -> Vec<Vec<f64>> {
        let answers = ask(strandlight().args(["probe", "--method", method]), &lines);
        answers.iter().map(values).collect()
    };
    let (reference, runtime, paper) = (by("reference"), by("runtime"), by("paper"));
    for (row, a_f, a_b) in [
        (0, [0.65405, 0.46100], [0.16901, 0.12159]),
        (9, [0.59902, 0.41056], [0.20860, 0.14797]),
    ] {
        for c in 0..2 {
            assert!((reference[row][c] - a_f[c]).abs() < 2e-4);
            assert!((reference[row + 1][c] - a_b[c]).abs() < 2e-4);
        }
        let exact = |q: usize, c: usize| reference[row + q][c];
        for c in 0..3 {
            // R = A_b + a_b reflects as a deep stack does: a_b R^2 - (1 + a_b^2 - a_f^2) R + a_b.
            let [a_f, a_b, many] = [0, 1, 6].map(|q| exact(q, c));
            let r = many + a_b;
            let rest = a_b * r * r - (1.0 + a_b * a_b - a_f * a_f) * r + a_b;
            assert!(rest.abs() < 1e-12, "{rest:e}");
        }
        let mut n_apart = 0;
        for q in 0..9 {
            for c in 0..3 {
                let exact = exact(q, c);
                let error = (runtime[row + q][c] - exact).abs();
                assert!(error < 1e-3 * exact.abs() + 1e-4, "{} {error}", names[q]);
                let apart = (paper[row + q][c] - exact).abs();
                n_apart += usize::from(apart > 2e-3 * exact.abs());
                assert!(apart < 0.3 * exact.abs() + 0.02, "{} {apart}", names[q]);
            }
        }
        assert!(n_apart > 5, "{n_apart}");
    }
    // The shaders sample five of them.
    let found = ask(strandlight().args(["probe", "--method", "gpu"]), &lines);
    let mut n_sampled = 0;
    for (row, answer) in found.iter().enumerate() {
        let name = names[row % names.len()];
        if answer["error"].is_string() {
            let message = answer["error"].as_str().unwrap_or_default();
            assert!(message.contains(name), "{answer}");
            continue;
        }
        for (gpu, cpu) in values(answer).iter().zip(&runtime[row]) {
            assert!(
                (gpu - cpu).abs() < 1e-5 + 1e-4 * cpu.abs(),
                "{name} {gpu} {cpu}"
            );
        }
        n_sampled += 1;
    }
    assert_eq!(n_sampled, 2 * 5);
}

/// Global and local multiple scattering: all methods near the exact one, and each mode its part.
#[test]
fn gpu_multiple_scattering_by_every_method() {
    let hair = r#"{"eta":1.55,"sigma_a":[0.1,0.3,0.6],"shift":{"r":-0.1,"tt":0.05,"trt":0.15},
        "width":{"r":0.18,"tt":0.09,"trt":0.36},"caustic_width":0.1}"#
        .replace('\n', " ");
    let mut lines = Vec::new();
    for (theta, phi, sigma_f) in [(0.1, 2.8, 0.3), (-0.4, 0.5, 0.8), (0.3, 1.4, 0.1)] {
        let rest = format!(
            r#""light":{{"theta":{theta},"phi":{phi},"lambda":0.2}},"view":{{"theta":0.2,"phi":0}},
            "sigma_f":{sigma_f},"hair":{hair}"#
        )
        .replace('\n', " ");
        for mode in ["R", "TT", "TRT", "all"] {
            lines.push(format!(r#"{{"q":"global","mode":"{mode}",{rest}}}"#));
        }
        lines.push(format!(r#"{{"q":"local","mode":"all",{rest}}}"#));
    }
    let by = |method: &str| -> Vec<Vec<f64>> {
        let answers = ask(strandlight().args(["probe", "--method", method]), &lines);
        answers.iter().map(values).collect()
    };
    let reference = by("reference");
    for chunk in reference.chunks(5) {
        assert_eq!(chunk[0].len(), 1);
        for c in 0..3 {
            let sum = chunk[0][0] + chunk[1][c] + chunk[2][c];
            assert!((sum / chunk[3][c] - 1.0).abs() < 1e-12);
        }
    }
    for (method, limit) in [("runtime", 0.01), ("gpu", 0.01), ("paper", 0.35)] {
        let found = by(method);
        let mut worst = 0.0f64;
        // The sums; a single mode of the paper's may be far off.
        for row in (0..lines.len()).filter(|row| row % 5 >= 3) {
            for (found, exact) in found[row].iter().zip(&reference[row]) {
                worst = worst.max((found / exact - 1.0).abs());
            }
        }
        println!("{method}: {worst:.4}");
        assert!(worst < limit, "{method} {worst}");
        assert!(
            method != "paper" || worst > 0.01,
            "the paper's is not the exact one"
        );
    }
}

/// Every key of `value` by its path; those below a key of `open` are names that users give.
fn key_paths(path: &str, value: &Value, open: &[&str], paths: &mut BTreeSet<String>) {
    match value {
        Value::Array(items) => items
            .iter()
            .for_each(|item| key_paths(path, item, open, paths)),
        Value::Object(object) => {
            for (key, value) in object {
                let path = format!("{path}/{key}");
                if !open.contains(&key.as_str()) {
                    key_paths(&path, value, open, paths);
                }
                paths.insert(path);
            }
        }
        _ => {}
    }
}

/// The JSON reference names every key that the commands print, in the section of the document.
#[test]
fn gpu_every_key_that_is_printed_is_documented() {
    let page =
        std::fs::read_to_string(project_root().join("docs/book/src/reference/json.md")).unwrap();
    let section = |name: &str| -> String {
        let (_, rest) = page
            .split_once(&format!("## `{name}`"))
            .unwrap_or_else(|| panic!("the JSON reference has no section {name}"));
        rest.split("\n## ").next().unwrap_or_default().to_owned()
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let map = project_root().join("data/sample/studio.exr");
    let run = |line: &str| -> String {
        let mut command = strandlight();
        command.current_dir(at);
        for word in line.split_whitespace() {
            match word {
                "MAP" => command.arg(&map),
                word => command.arg(word),
            };
        }
        let output = command.output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(
            !text.is_empty(),
            "{line}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        text
    };
    let document = |line: &str| -> Value { serde_json::from_str(&run(line)).unwrap() };
    let read = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    run("groom generate --style straight --strands 20 --points-per-strand 4 -o a.groom");
    let lights =
        document("lights MAP --count 3 -o a.lights --report r.json --timings t.json --json");
    // Results and times, apart and together.
    let mut both: Value = serde_json::from_str(&read("r.json")).unwrap();
    let times: Value = serde_json::from_str(&read("t.json")).unwrap();
    for (key, value) in times.as_object().unwrap() {
        both[key] = value.clone();
    }
    assert_eq!(lights, both);
    let budget = document(
        "lights MAP --max-error 90% --max-count 2 --hair zinke-fig8-blond -o b.lights --json",
    );
    let scene = "version = 1\n[groom]\nfile = \"a.groom\"\n[lights]\nfile = \"a.lights\"\n\
                 [render]\nsize = [24, 16]\nsamples = 4\nshadow_maps = 4\n";
    std::fs::write(at.join("a.toml"), scene).unwrap();
    std::fs::write(at.join("no.groom"), "text").unwrap();
    std::fs::write(
        at.join("s.json"),
        r#"[{"frame": "a"}, {"set": {"hair.eta": 1.6}}, {"frame": "b"}]"#,
    )
    .unwrap();
    let tables = document("tables -o a.tables --json");
    let cpu = document("render a.toml --backend cpu --json -o cpu.exr");
    let gpu = document("render a.toml --backend gpu --json -o gpu.exr");
    let documents = [
        ("lights --report", lights),
        ("lights --report", budget),
        (
            "verify --json",
            document("verify a.tables a.lights a.groom no.groom --map MAP --json"),
        ),
        ("stress --json", document("stress --n 1 --no-gpu --json")),
        ("inspect --json", document("inspect a.tables --json")),
        ("inspect --json", document("inspect a.lights --json")),
        ("inspect --json", document("inspect a.groom --json")),
        ("render --json", cpu),
        ("render --json", gpu),
        ("compare --json", document("compare cpu.exr gpu.exr --json")),
        (
            "timings.json",
            document("render a.toml --backend cpu --script s.json --json -o c"),
        ),
        (
            "timings.json",
            document("render a.toml --backend gpu --script s.json --json -o g"),
        ),
        ("tables --json", tables),
    ];
    let open = [
        "parameters",
        "stage_seconds",
        "lobe_errors",
        "inputs",
        "found",
        "expected",
    ];
    let mut missing = Vec::new();
    let mut n_keys = 0;
    for (name, document) in &documents {
        let section = section(name);
        let mut paths = BTreeSet::new();
        key_paths("", document, &open, &mut paths);
        assert!(paths.len() > 5, "{name}: {document}");
        for path in paths {
            let key = path.rsplit('/').next().unwrap_or_default();
            n_keys += 1;
            if !section.contains(&format!("`{key}`")) {
                missing.push(format!("{name}: {path}"));
            }
        }
    }
    assert!(n_keys > 150, "{n_keys}");
    assert!(missing.is_empty(), "the JSON reference lacks {missing:#?}");

    // The protocol: every kind of query and each of its keys, and the two answers.
    let section = section("probe");
    let mut paths = BTreeSet::new();
    for line in mixed_lines() {
        if let Ok(query) = serde_json::from_str(&line) {
            key_paths("", &query, &[], &mut paths);
            let kind = query["q"].as_str().unwrap();
            assert!(
                kind == "nothing" || section.contains(&format!("`{kind}`")),
                "{kind}"
            );
        }
    }
    for path in paths.iter().map(String::as_str).chain(["value", "error"]) {
        let key = path.rsplit('/').next().unwrap_or_default();
        assert!(section.contains(&format!("`{key}`")), "probe: {path}");
    }
}
