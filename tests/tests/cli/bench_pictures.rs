//! `strandlight bench` of whole pictures: what `frames` and `growth` write.

use std::path::Path;

use serde_json::Value;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

#[test]
fn gpu_frames_are_measured_side_by_side() {
    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(30, 5, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let text = assert_done(
        strandlight()
            .args(["bench", "frames", "--json", "--size", "48x32"])
            .args(["--repetitions", "1", "--backend", "gpu"])
            .arg(&scene),
    );
    let document: Value = serde_json::from_str(&text).unwrap();
    let document = &document["scenes"][0];
    assert_eq!(document["lights"], 2);
    let frames = document["frames"].as_array().unwrap();
    let mut groups: Vec<&str> = Vec::new();
    for frame in frames {
        let group = frame["group"].as_str().unwrap();
        let (ratio, milliseconds) = (&frame["ratio"], &frame["milliseconds"]);
        assert!(ratio.as_f64().unwrap() > 0.0 && milliseconds.as_f64().unwrap() > 0.0);
        if groups.last() != Some(&group) {
            assert_eq!(ratio, 1.0, "{frame}");
            groups.push(group);
        }
    }
    let all = [
        "edit",
        "lights",
        "shadow maps",
        "shadow maps towards the eye",
        "samples",
        "paint",
        "motion",
    ];
    assert_eq!(groups, all);
    let stages = |name: &str| -> Vec<&str> {
        let frame = frames.iter().find(|frame| frame["name"] == name).unwrap();
        let stages = frame["stages"].as_array().unwrap().iter();
        stages
            .map(|stage| stage["name"].as_str().unwrap())
            .collect()
    };
    assert!(stages("everything").contains(&"transmittance"));
    assert!(!stages("colour of the hair").contains(&"transmittance"));
    assert_eq!(stages("grade"), ["composite", "display"]);
    assert!(!stages("dyed, a stroke").contains(&"transmittance"));
    assert!(stages("wind").contains(&"transmittance"));
    // Only what the picture shows is shaded, and nothing is listed again for an edit of the hair.
    let of = |name: &str, key: &str| -> u64 {
        let frame = frames.iter().find(|frame| frame["name"] == name).unwrap();
        frame[key].as_u64().unwrap()
    };
    let color = |key| of("colour of the hair", key);
    let n_points = document["points"].as_u64().unwrap();
    assert!((1..=n_points).contains(&color("shaded_points")));
    assert!(color("list_entries") > 0 && color("products") > 0);
    assert!(stages("view").contains(&"list") && !stages("widths").contains(&"list"));
    assert_eq!(of("64 samples, colour of the hair", "list_entries"), 0);
    let sampled = of("64 samples, colour of the hair", "shaded_points");
    assert_eq!(sampled, n_points);
    // Less work, less of it: nothing is shaded for another exposure.
    let grade = |key| of("grade", key);
    assert_eq!([grade("shaded_points"), grade("products")], [0, 0]);
    assert!(grade("workgroups") < color("workgroups"));
    assert!(grade("written_bytes") < color("written_bytes"));
    assert!(color("workgroups") < of("everything", "workgroups"));
}

/// What pictures on the CPU redo after an edit, and what they count.
#[test]
fn pictures_are_measured_on_the_cpu() {
    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(30, 5, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let bench = |extra: &[&str]| {
        let mut command = strandlight();
        command.args(["bench", "frames", "--size", "48x32"]);
        command.args(["--repetitions", "1"]).args(extra).arg(&scene);
        command
    };
    let text = assert_done(bench(&["--json", "--samples", "256"]).arg(&scene));
    let document: Value = serde_json::from_str(&text).unwrap();
    assert!(document["backend"].as_str().unwrap().starts_with("cpu"));
    assert_eq!(document["repetitions"], 1);
    // Each scene that is named.
    let [measured, again] = &document["scenes"].as_array().unwrap()[..] else {
        panic!("{document}");
    };
    let path = scene.display().to_string();
    assert!(measured["scene"] == path && again["scene"] == path);
    assert_eq!(measured["size"], serde_json::json!([48, 32]));
    assert_eq!(
        (&measured["strands"], &measured["lights"]),
        (&30.into(), &2.into())
    );

    let frames = measured["frames"].as_array().unwrap();
    let names: Vec<&str> = frames.iter().map(|f| f["name"].as_str().unwrap()).collect();
    let all = [
        "first picture",
        "everything",
        "colour of the hair",
        "widths",
        "index of refraction",
        "colour of the lights",
        "tint of the lights",
        "a light off",
        "exposure",
        "lights turned",
        "view",
        "wind",
        "a stroke",
    ];
    assert_eq!(names, all);
    let row = |name: &str| frames.iter().find(|frame| frame["name"] == name).unwrap();
    let stages = |name: &str| -> Vec<&str> {
        let stages = row(name)["stages"].as_array().unwrap().iter();
        stages
            .map(|stage| stage["name"].as_str().unwrap())
            .collect()
    };
    for name in all {
        if name == "exposure" {
            assert!(!stages(name).contains(&"shade"), "{:?}", stages(name));
            continue;
        }
        let count = |key: &str| row(name)[key].as_u64().unwrap();
        assert!(
            stages(name).contains(&"shade"),
            "{name}: {:?}",
            stages(name)
        );
        assert!(count("products") > 0, "{}", row(name));
        let (points, entries) = (count("visible_points"), count("list_entries"));
        assert!(points > 0 && points <= measured["points"].as_u64().unwrap());
        // Two points of each segment, of which others are shown too.
        assert!(entries * 2 >= points, "{}", row(name));
        let rate = row(name)["frames_per_second"].as_f64().unwrap();
        let milliseconds = row(name)["milliseconds"].as_f64().unwrap();
        assert!((rate * milliseconds - 1e3).abs() < 1e-6, "{}", row(name));
        #[cfg(target_os = "linux")]
        assert!(row(name)["core_seconds"].as_f64().unwrap() >= 0.0);
        // Scenes do not see each other.
        let in_the_other = again["frames"].as_array().unwrap();
        let same = in_the_other.iter().find(|frame| frame["name"] == name);
        for key in [
            "products",
            "products_skipped",
            "visible_points",
            "list_entries",
        ] {
            assert_eq!(same.unwrap()[key], row(name)[key], "{name}: {key}");
        }
    }
    // The first picture and one without anything kept are the same work; hair and lights that are
    // edited are seen as before.
    let of_picture = |name: &str| stages(name)[1..].to_vec();
    assert_eq!(stages("first picture")[0], "load");
    assert_eq!(of_picture("first picture"), of_picture("everything"));
    for name in &all[2..6] {
        let stages = stages(name);
        let kept = ["list", "shadow maps", "transmittance", "voxelise"];
        assert!(
            !kept.iter().any(|stage| stages.contains(stage)),
            "{name}: {stages:?}"
        );
        assert_eq!(row(name)["list_entries"], row("everything")["list_entries"]);
    }
    let shows_again = |name: &str| stages(name).contains(&"list");
    assert!(shows_again("view") && shows_again("wind"));
    assert!(!shows_again("lights turned") && !shows_again("a stroke"));
    assert!(stages("lights turned").contains(&"shadow maps"));
    assert!(!stages("view").contains(&"voxelise") && stages("wind").contains(&"voxelise"));

    // The picture by samples is the same up to their noise.
    let samples = &measured["samples"];
    assert_eq!(samples["samples"], 256);
    let error = samples["relative_rmse"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.05, "{samples}");

    let table = assert_done(&mut bench(&[]));
    assert!(all.iter().all(|name| table.contains(name)), "{table}");
    assert_refused(
        strandlight().args(["bench", "frames", "none.toml"]),
        &["none.toml"],
    );
    assert_refused(
        &mut bench(&["--backend", "gpu", "--samples", "4"]),
        &["--samples", "--backend"],
    );

    let text = assert_done(&mut bench(&["--json", "--window"]));
    let document: Value = serde_json::from_str(&text).unwrap();
    let edits = document["scenes"][0]["edits"].as_array().unwrap();
    let names: Vec<&str> = edits.iter().map(|f| f["name"].as_str().unwrap()).collect();
    assert_eq!(names, all[1..]);
    for edit in edits {
        let of = |key: &str| edit[key].as_f64().unwrap();
        let [first, last] = [of("first_milliseconds"), of("settled_milliseconds")];
        assert!(first > 0.0 && first <= last, "{edit}");
        let shown = of("shown_milliseconds");
        assert!(shown > 0.0 && shown <= first, "{edit}");
        let [shown_off, first_off] = [of("shown_off"), of("first_off")];
        assert!((0.0..1.0).contains(&shown_off), "{edit}");
        assert!((0.0..1.0).contains(&first_off), "{edit}");
        assert!(of("longest_milliseconds") > 0.0, "{edit}");
        let stages = edit["first_stages"].as_array().unwrap();
        let names: Vec<&str> = stages.iter().map(|s| s["name"].as_str().unwrap()).collect();
        // Edits recompute only what depends on them.
        let is_cast_again =
            ["everything", "lights turned", "wind"].contains(&edit["name"].as_str().unwrap());
        assert_eq!(names.contains(&"shadow maps"), is_cast_again, "{edit}");
        assert!(names.contains(&"display"), "{edit}");
    }
    let pictures = folder.path().join("pictures");
    let table = assert_done(&mut bench(&[
        "--window",
        "--pictures",
        pictures.to_str().unwrap(),
    ]));
    let stem = scene.file_stem().unwrap().to_str().unwrap();
    for name in &all[1..] {
        let name = format!("{stem}.{}.png", name.replace(' ', "-"));
        let png = std::fs::read(pictures.join(&name)).expect(&name);
        assert!(png.starts_with(b"\x89PNG"), "{name}");
    }
    assert_refused(
        &mut bench(&["--pictures", pictures.to_str().unwrap()]),
        &["--window"],
    );
    assert!(all[1..].iter().all(|name| table.contains(name)), "{table}");
    assert_refused(
        &mut bench(&["--backend", "gpu", "--window"]),
        &["--window", "--backend"],
    );
}

/// The scenes of the paper's Table 2 that are in a folder already, and what the GPUs of the model
/// are said to need for them.
#[test]
fn table_2_and_estimates_stand_beside_measured_frames() {
    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(6, 3, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let paper = [
        ("animation", 8.3),
        ("straight", 5.9),
        ("natural", 5.8),
        ("bob-cut", 10.6),
        ("dark", 6.2),
        ("ponytail", 8.9),
    ];
    for (name, _) in paper {
        let copy = folder.path().join(name).with_extension("toml");
        std::fs::copy(&scene, copy).unwrap();
    }
    let bench = |extra: &[&str]| {
        let mut command = strandlight();
        command.args(["bench", "frames", "--size", "24x16", "--repetitions", "1"]);
        command.arg("--table2").arg(folder.path()).args(extra);
        command
    };
    let text = assert_done(bench(&["--json", "--model", "H100"]).arg(&scene));
    let document: Value = serde_json::from_str(&text).unwrap();
    let scenes = document["scenes"].as_array().unwrap();
    // The scene that is named, then those of the table.
    assert_eq!(scenes.len(), 7);
    assert!(scenes[0]["xu_2011"].is_null(), "{}", scenes[0]);
    let of_paper = |scene: &Value| scene["xu_2011"]["frames_per_second"].as_f64();
    for (name, a_second) in paper {
        let mut rows = scenes.iter();
        let found = rows.find(|scene| scene["xu_2011"]["name"] == name).unwrap();
        assert_eq!(of_paper(found), Some(a_second));
        // Measured, but not of that size.
        assert!(found["xu_2011"]["ours"].as_f64().unwrap() > 0.0, "{found}");
        assert!(found["xu_2011"]["ratio"].is_null(), "{found}");
    }
    for scene in scenes {
        for frame in scene["frames"].as_array().unwrap() {
            let model = &frame["model"];
            assert_eq!(
                (&model["gpu"], &model["is_estimate"]),
                (&"H100".into(), &true.into())
            );
            let milliseconds = model["milliseconds"].as_f64().unwrap();
            let passes = model["passes"].as_array().unwrap();
            let sum: f64 = passes
                .iter()
                .map(|pass| pass["milliseconds"].as_f64().unwrap())
                .sum();
            assert!(sum > 0.0 && (milliseconds - sum).abs() < 1e-9, "{frame}");
        }
        let names = |name: &str| -> Vec<&str> {
            let frames = scene["frames"].as_array().unwrap();
            let frame = frames.iter().find(|frame| frame["name"] == name).unwrap();
            let passes = frame["model"]["passes"].as_array().unwrap().iter();
            passes.map(|pass| pass["name"].as_str().unwrap()).collect()
        };
        // What the CPU redoes.
        assert_eq!(names("widths"), ["tables", "shade", "composite"]);
        assert!(names("view").contains(&"list"));
    }
    let table = assert_done(&mut bench(&["--model", "RTX-4090"]));
    for text in ["Xu 2011", "10.60", "ESTIMATE for RTX-4090"] {
        assert!(table.contains(text), "{table}");
    }
    assert_refused(&mut bench(&["--model", "abacus"]), &["abacus", "H100"]);
    let on_gpu = ["--backend", "gpu", "--model", "H100"];
    assert_refused(&mut bench(&on_gpu), &["--model", "--backend"]);
}

/// This build against itself, and against programs that say something else.
#[cfg(unix)]
#[test]
fn builds_are_compared_in_turns() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(6, 3, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let bench = |program: &Path, extra: &[&str]| {
        let mut command = strandlight();
        command.args(["bench", "frames", "--size", "24x16", "--repetitions", "1"]);
        command
            .arg("--against")
            .arg(program)
            .args(extra)
            .arg(&scene);
        command
    };
    let itself = strandlight();
    let itself = Path::new(itself.get_program());
    // Each run of the other build is written down.
    let script = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        let all = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(&path, all).unwrap();
        path
    };
    let log = folder.path().join("runs");
    let itself_logged = format!(
        "echo $@ >>{}; exec {} \"$@\"",
        log.display(),
        itself.display()
    );
    let other = script("other", &itself_logged);
    let text = assert_done(bench(&other, &["--json"]).arg(&scene));
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(
        document["runs"],
        serde_json::json!(["this", "other", "other", "this"])
    );
    assert_eq!(document["other"], other.display().to_string());
    let runs = std::fs::read_to_string(&log).unwrap();
    let runs: Vec<&str> = runs.lines().collect();
    // It is tried first: on a scene of its own, and does it read these?
    assert_eq!(runs.len(), 5);
    assert!(runs[0].contains("--json") && runs[0].contains("--size 16x16"));
    assert!(runs[1..3].iter().all(|run| run.starts_with("inspect ")));
    assert!(
        runs[3..]
            .iter()
            .all(|run| run.contains("--json") && run.contains("--size 24x16"))
    );
    let scenes = document["scenes"].as_array().unwrap();
    assert_eq!(scenes.len(), 2);
    for scene in scenes {
        let frames = scene["frames"].as_array().unwrap();
        assert_eq!(frames.len(), 13);
        for frame in frames {
            let [ours, others] = [0, 1].map(|ix| frame["milliseconds"][ix].as_f64().unwrap());
            let ratio = frame["milliseconds_ratio"].as_f64().unwrap();
            assert!(
                ours > 0.0 && (ratio - others / ours).abs() < 1e-9,
                "{frame}"
            );
        }
    }
    let table = assert_done(&mut bench(&other, &[]));
    assert!(table.contains("index of refraction"), "{table}");

    for (name, text, said) in [
        ("empty", "echo '{}'", "another shape: no `scenes`"),
        ("words", "echo done", "is not JSON"),
        ("fails", "echo no such option >&2; exit 2", "no such option"),
        (
            "old",
            &format!("[ $1 = bench ] || {{ echo too new >&2; exit 2; }}; {itself_logged}"),
            "`inspect` failed (exit status: 2): too new",
        ),
    ] {
        let program = script(name, text);
        // At once: these pictures would take minutes.
        let slow = ["--quiet", "--samples", "65536"];
        assert_refused(&mut bench(&program, &slow), &[name, said]);
    }
    assert_refused(
        &mut bench(Path::new("./none"), &["--quiet"]),
        &["none", "cannot be run"],
    );
}

/// Another build that runs when this one is ended, while it is tried or while it is measured.
#[cfg(unix)]
#[test]
fn the_other_build_is_ended_too() {
    use std::os::unix::fs::PermissionsExt;
    use std::time::{Duration, Instant};

    let folder = tempfile::tempdir().unwrap();
    let groom = curtain(6, 3, 0.1, 0.0);
    let scene = write_small_scene(folder.path(), &groom, key_and_sky(), |_| ());
    let other = folder.path().join("other");
    let id = folder.path().join("id");
    let sleeps = format!(
        "echo $$ >{0}.tmp; mv {0}.tmp {0}; exec sleep 600",
        id.display()
    );
    let itself = strandlight();
    let answers = format!(
        "case \"$*\" in inspect*|*\"--size 16x16\"*) exec {} \"$@\";; esac",
        itself.get_program().display()
    );
    let until = |is_so: &dyn Fn() -> bool| {
        let start = Instant::now();
        while !is_so() {
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    let signal = |name: &str, id: &str| {
        let mut kill = std::process::Command::new("kill");
        kill.args([name, id]).stderr(std::process::Stdio::null());
        kill.status().unwrap().success()
    };
    let [int, term] = [("-INT", 130), ("-TERM", 143)];
    for (in_trial, (name, code)) in [(":", int), (":", term), (&answers, int), (&answers, term)] {
        std::fs::write(&other, format!("#!/bin/sh\n{in_trial}\n{sleeps}\n")).unwrap();
        std::fs::set_permissions(&other, std::fs::Permissions::from_mode(0o755)).unwrap();
        let mut command = strandlight();
        command.args(["bench", "frames", "--size", "24x16", "--repetitions", "1"]);
        command.args(["--quiet", "--against"]);
        command.arg(&other).arg(&scene).env("TMPDIR", folder.path());
        let mut child = command.spawn().unwrap();
        until(&|| id.is_file());
        assert!(signal(name, &child.id().to_string()));
        let ended = child.wait().unwrap().code();
        assert_eq!(ended, Some(code), "{name}, {in_trial}");
        let other = std::fs::read_to_string(&id).unwrap();
        assert!(!signal("-0", other.trim()), "{name}: it runs on");
        let left = std::fs::read_dir(folder.path()).unwrap().flatten();
        let left = left.filter(|entry| entry.path().is_dir()).count();
        assert_eq!(left, 0, "{name}: its files are left");
        std::fs::remove_file(&id).unwrap();
    }
}

/// Frames over points, lights and pixels.
#[test]
fn growth_is_measured_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let bench = |extra: &[&str]| {
        let mut command = strandlight();
        command.current_dir(folder.path()).args(["bench", "growth"]);
        command.args(["--points", "1000,400,100", "--lights", "1,3"]);
        command.args(["--sizes", "24x16,48x32"]).args(extra);
        command
    };
    let text = assert_done(&mut bench(&["--json", "--svg", "growth.svg"]));
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["svg"], "growth.svg");
    let sweeps = document["sweeps"].as_array().unwrap();
    let names: Vec<&str> = sweeps.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["points", "lights", "pixels"]);
    let values = |sweep: &Value| -> Vec<u64> {
        let rows = sweep["rows"].as_array().unwrap().iter();
        rows.map(|row| row["value"].as_u64().unwrap()).collect()
    };
    let points = values(&sweeps[0]);
    assert!(points.len() == 3 && points.is_sorted(), "{points:?}");
    assert_eq!(values(&sweeps[1]), [1, 3]);
    assert_eq!(values(&sweeps[2]), [24 * 16, 48 * 32]);
    let mut n_frames = 0;
    for sweep in sweeps {
        for row in sweep["rows"].as_array().unwrap() {
            let frames = row["frames"].as_array().unwrap();
            let names: Vec<&str> = frames.iter().map(|f| f["name"].as_str().unwrap()).collect();
            assert_eq!(names, ["colour of the hair", "view"]);
            n_frames += frames.len();
        }
        let slopes = sweep["slopes"].as_array().unwrap();
        assert!(slopes.iter().all(|s| s["milliseconds"].is_f64()), "{sweep}");
    }
    assert_eq!(n_frames, 2 * (3 + 2 + 2));
    // More lights, more products; more points, more to see.
    let count = |sweep: usize, row: usize, key: &str| {
        let row = &sweeps[sweep]["rows"][row]["frames"][0];
        row[key].as_u64().unwrap()
    };
    assert!(count(1, 0, "products") < count(1, 1, "products"));
    assert!(count(0, 0, "visible_points") < count(0, 2, "visible_points"));
    let svg = std::fs::read_to_string(folder.path().join("growth.svg")).unwrap();
    assert!(
        svg.starts_with("<svg") && svg.contains("over pixels"),
        "{svg}"
    );

    let table = assert_done(&mut bench(&[]));
    assert!(table.contains("slope"), "{table}");
    assert_refused(
        &mut bench(&["--svg", "growth.png"]),
        &["growth.png", ".svg"],
    );
}
