//! `strandlight bench`: what it writes, and that errors do not depend on threads.

use std::path::Path;

use serde_json::Value;
use strandlight_bake::tables::bake_c_and_h;
use strandlight_lab::bench::{Method, MethodTables, Prepared, Scene, Set};
use strandlight_render::probe::GpuBench;
use strandlight_scattering::fresnel::Fresnel;
use strandlight_scattering::{HairParams, Lobe};
use strandlight_scene::progress::Progress;
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// Errors alone, on this many threads.
fn errors(folder: &Path, threads: &str, extra: &[&str]) -> (Value, String) {
    let text = assert_done(
        strandlight()
            .args(["bench", "single", "--n", "40", "--repetitions", "0"])
            .args(["--json", "-o"])
            .arg(folder)
            .args(extra)
            .env("RAYON_NUM_THREADS", threads),
    );
    let document = serde_json::from_str(&text).unwrap();
    let csv = std::fs::read_to_string(folder.join("single.csv")).unwrap();
    (document, csv)
}

#[test]
fn errors_are_the_same_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let (document, csv) = errors(folder.path(), "1", &[]);
    let (again, csv_again) = errors(folder.path(), "3", &[]);
    assert_eq!(document, again);
    assert_eq!(csv, csv_again);
    // Another seed, another set: other numbers.
    let (other, _) = errors(folder.path(), "2", &["--seed", "1"]);
    assert_ne!(document["methods"], other["methods"]);
    let (other, _) = errors(folder.path(), "2", &["--set", "wide"]);
    assert_eq!(other["set"], "wide");
    assert_ne!(document["methods"], other["methods"]);
}

#[test]
fn gpu_a_run_is_written_as_table_document_and_plot() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new/run");
    let text = assert_done(
        strandlight()
            .args(["bench", "single", "--n", "20", "--repetitions", "1"])
            .args(["--adapter", "yes", "-o"])
            .arg(&output),
    );
    assert!(text.contains("paper m=4"), "{text}");

    let csv = std::fs::read_to_string(output.join("single.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), Method::all().len() + 1);
    let column = |name: &str| {
        let found = rows[0].iter().position(|cell| *cell == name);
        found.unwrap_or_else(|| panic!("no column {name} in {:?}", rows[0]))
    };
    let document: Value =
        serde_json::from_slice(&std::fs::read(output.join("single.json")).unwrap()).unwrap();
    let methods = document["methods"].as_array().unwrap();
    assert_eq!(methods.len(), rows.len() - 1);
    let mut n_on_adapter = 0;
    for (row, method) in rows[1..].iter().zip(methods) {
        assert_eq!(row.len(), rows[0].len());
        assert_eq!(row[column("setting")], method["setting"]);
        let rmse: f64 = row[column("rel_rmse_all")].parse().unwrap();
        let exact = method["errors"]["all"]["rel_rmse"].as_f64().unwrap();
        assert!((rmse / exact - 1.0).abs() < 1e-3 && (1e-9..2.0).contains(&rmse));
        let ns: f64 = row[column("cpu_ns")].parse().unwrap();
        assert!(ns > 0.0 && method["cpu"]["ratio"].as_f64().unwrap() > 0.0);
        n_on_adapter += usize::from(!row[column("adapter_ns")].is_empty());
    }
    assert!(n_on_adapter >= 6, "{n_on_adapter}");
    let base = methods
        .iter()
        .find(|method| method["setting"] == "m=4" && method["family"] == "paper")
        .unwrap();
    let runtime = methods
        .iter()
        .find(|method| method["family"] == "runtime" && method["setting"] == "3+2+3")
        .unwrap();
    let rmse = |method: &Value| method["errors"]["all"]["rel_rmse"].as_f64().unwrap();
    assert!(rmse(runtime) < 0.1 * rmse(base), "{runtime} {base}");
    assert!(runtime["inner_mean"].as_f64().unwrap() <= 8.0 && runtime["fetches"] == 13);
    // Every cost is paired with a pass of the base, that of the base too.
    for side in ["cpu", "adapter"] {
        assert!(base[side]["ratio"].as_f64().unwrap() > 0.0);
    }

    let svg = std::fs::read_to_string(output.join("single.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
    assert!(svg.matches("<circle").count() > rows.len());

    // The worst configuration is a question to `probe`, which finds the same.
    let worst = &base["errors"]["TT"]["worst"];
    let question = folder.path().join("question");
    std::fs::write(&question, format!("{}\n", worst["query"])).unwrap();
    let answer = strandlight()
        .args(["probe", "--method", "reference"])
        .stdin(std::fs::File::open(question).unwrap())
        .output()
        .unwrap();
    let answer: Value = serde_json::from_slice(&answer.stdout).unwrap();
    let exact = worst["exact"].as_f64().unwrap();
    let closest = answer["value"]
        .as_array()
        .unwrap()
        .iter()
        .map(|value| (value.as_f64().unwrap() - exact).abs())
        .fold(f64::INFINITY, f64::min);
    assert!(closest < 1e-6 * exact.abs().max(1e-3), "{answer} {worst}");
}

/// The folder is made before minutes of measuring, and is still there after them.
#[test]
fn a_new_folder_receives_what_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("new/run");
    assert_done(
        strandlight()
            .args(["bench", "single", "--n", "1", "--repetitions", "0"])
            .args(["--adapter", "no", "-o"])
            .arg(&output),
    );
    for name in ["single.csv", "single.json", "single.svg"] {
        assert!(output.join(name).is_file(), "{name}");
    }
}

#[test]
fn bad_usage_is_refused_before_work() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "x").unwrap();
    assert_refused(
        strandlight().args(["bench", "single", "-o"]).arg(&file),
        &["is not a folder"],
    );
    std::fs::create_dir(folder.path().join("single.svg")).unwrap();
    assert_refused(
        strandlight()
            .args(["bench", "single", "-o"])
            .arg(folder.path()),
        &["single.svg", "directory"],
    );
    assert_refused(
        strandlight().args(["bench", "single", "--n", "0"]),
        &["--n"],
    );
    assert_refused(strandlight().args(["bench", "nothing"]), &["nothing"]);
}

#[test]
fn plots_show_the_lobes() {
    let folder = tempfile::tempdir().unwrap();
    let text = assert_done(
        strandlight()
            .args(["bench", "plots", "--json", "-o"])
            .arg(folder.path()),
    );
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["files"].as_array().unwrap().len(), 8);
    for stem in ["azimuthal", "azimuthal_error", "attenuation", "outer"] {
        let svg = std::fs::read_to_string(folder.path().join(format!("{stem}.svg"))).unwrap();
        assert!(svg.matches("<polyline").count() > 8, "{stem}");
        assert!(!svg.contains("NaN"), "{stem}");
    }
    // The lobes have their energies: 1 degree is fine enough for the trapezoid rule.
    let csv = std::fs::read_to_string(folder.path().join("azimuthal.csv")).unwrap();
    let energy = |panel: &str, series: &str| {
        let start = format!("{panel},{series},");
        let values: Vec<f64> = csv
            .lines()
            .filter_map(|line| line.strip_prefix(&start))
            .map(|rest| rest.split(',').next_back().unwrap().parse().unwrap())
            .collect();
        assert_eq!(values.len(), 361, "{panel} {series}");
        values[1..].iter().sum::<f64>().to_radians()
    };
    let hair = HairParams {
        sigma_a: [0.2; 3],
        ..HairParams::default()
    };
    for (panel, lobe, theta_d) in [
        ("N_TT; theta_d = 30 deg", Lobe::Tt, 30.0f64),
        ("N_TRT; theta_d = 0 deg", Lobe::Trt, 0.0),
    ] {
        let theta_d = theta_d.to_radians();
        let exact =
            strandlight_scattering::exact::energy(lobe, theta_d, &hair, Fresnel::Dielectric)[0];
        assert!(
            (energy(panel, "exact") / exact - 1.0).abs() < 1e-4,
            "{panel}"
        );
        assert!(
            (energy(panel, "runtime") / exact - 1.0).abs() < 2e-3,
            "{panel}"
        );
        let published = energy(panel, "paper") / exact;
        assert!((0.85..1.1).contains(&published), "{panel} {published}");
    }
}

/// What is timed on the adapter is what is timed on the CPU.
#[test]
fn gpu_both_sides_compute_the_same() {
    let tables = MethodTables::new(&bake_c_and_h(Fresnel::Schlick, &Progress::silent())).unwrap();
    let scene = Scene::new(Set::Wide, 5, [2, 7, 130]);
    let gpu = GpuBench::new().expect("this test needs a Vulkan driver");
    let mut n_checked = 0;
    for method in Method::all() {
        let Some(scheme) = method.scheme() else {
            continue;
        };
        let prepared = Prepared::new(method, &tables);
        let fibres = scene
            .hair
            .iter()
            .map(|hair| prepared.on_fibre(hair).unwrap());
        let fibres: Vec<_> = fibres.collect();
        let optics: Vec<_> = fibres.iter().map(|fibre| fibre.optics().clone()).collect();
        let workload = gpu
            .workload(prepared.tables(), &optics, &scene.lights, &scene.views)
            .unwrap();
        assert_eq!(workload.n_evaluations(), 2 * 7 * 130);
        assert!(gpu.run(scheme, &workload).unwrap() > 0.0);
        let found = gpu.answers(&workload).unwrap();
        assert_eq!(found.len(), scene.views.len());
        let exact: Vec<[f32; 3]> = scene
            .views
            .iter()
            .map(|view| fibres[1].lit(&scene.lights, view))
            .collect();
        let largest = exact.iter().flatten().fold(0.0f32, |max, x| max.max(*x));
        for (found, exact) in found.iter().zip(&exact) {
            for channel in 0..3 {
                let apart = (found[channel] - exact[channel]).abs();
                assert!(apart < 1e-4 * largest, "{method:?} {found:?} {exact:?}");
                n_checked += 1;
            }
        }
    }
    assert!(n_checked >= 7 * 130 * 3);
}
