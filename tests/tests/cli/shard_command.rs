//! Work split over machines: every shard by itself, in a process and a folder of its own or one that
//! several share, and the results of one run, byte by byte.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::Value;
use strandlight_formats::{Background, MotionSection, WindSection};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight};

/// Edits, strokes, time and undo steps, each of which later frames depend on.
const SCRIPT: &str = r#"[
    {"frame": "bare"},
    {"set": {"hair.eta": 1.7, "lights.muted": [0]}},
    {"frame": "edited.png"},
    {"stroke": {"brush": {"radius_cm": 1.5, "effect": {"dye": [0.1, 0.9, 2.0]}}, "path": [[8, 6], [14, 8]]}},
    {"frame": "dyed", "size": [20, 14]},
    {"time": 1.5},
    {"frame": "moved"},
    {"undo": 1},
    {"frame": "undone"},
    {"redo": 1},
    {"set": {"camera.position": [6, -2, 14]}},
    {"frame": "seen"},
    {"stroke": {"brush": {"radius_cm": 1.0, "effect": {"dye": [2.0, 0.4, 0.1]}}, "path": [[10, 8], [16, 9]]}},
    {"frame": "last"},
    {"set": {"lights.rotate_deg": 100}},
    {"frame": "turned"}
]"#;

fn scene_in(folder: &Path) {
    let groom = curtain(30, 6, 0.15, 0.0);
    write_small_scene(folder, &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.15);
        scene.render.size = [24, 16];
        scene.render.shadow_maps = 4;
        scene.render.background = Background::Color([0.1, 0.2, 0.3]);
        scene.motion = Some(MotionSection {
            wind: Some(WindSection::default()),
            ..MotionSection::default()
        });
    });
    fs::write(folder.join("s.json"), SCRIPT).expect("written");
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split_whitespace());
    command
}

fn done(folder: &Path, line: &str) -> String {
    assert_done(&mut command(folder, line))
}

/// Does the lines at the same time.
fn done_together(folder: &Path, lines: &[String]) {
    let start = |line: &String| {
        let mut command = command(folder, line);
        command.stdout(Stdio::null()).spawn().expect("it starts")
    };
    let children: Vec<Child> = lines.iter().map(start).collect();
    for (mut child, line) in children.into_iter().zip(lines) {
        assert!(child.wait().expect("it ends").success(), "{line}");
    }
}

/// The files of a folder but for times.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder");
    let files = entries.map(|entry| {
        let path = entry.expect("a file").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        (name.into_owned(), fs::read(&path).expect("readable"))
    });
    files.filter(|(name, _)| !name.ends_with(".json")).collect()
}

fn timings(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("written");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn slow_frames_of_shards_are_those_of_one_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for (frames, n_frames) in [("--script s.json", 8), ("--turntable 5", 5)] {
        let render = format!("render a.toml --backend cpu {frames}");
        done(at, &format!("{render} -o whole"));
        let whole = files(&at.join("whole"));
        assert_eq!(whole.len(), n_frames);
        let distinct: std::collections::BTreeSet<&Vec<u8>> = whole.values().collect();
        assert_eq!(distinct.len(), n_frames, "every frame differs");
        for n in [1, 3, 7] {
            let out = format!("shards-{n}");
            let lines: Vec<String> = (0..n)
                .map(|ix| {
                    format!(
                        "{render} -o {out} --shard {ix}/{n} --quiet --threads {}",
                        1 + ix % 3
                    )
                })
                .collect();
            done_together(at, &lines);
            let out = at.join(out);
            let found = files(&out);
            assert_eq!(
                found.keys().collect::<Vec<_>>(),
                whole.keys().collect::<Vec<_>>()
            );
            for (name, bytes) in &found {
                assert!(*bytes == whole[name], "{frames}, {n} shards: {name}");
            }
            // Round robin, and the times of each beside the others'.
            let mut n_made = 0;
            for ix in 0..n {
                let times = timings(&out.join(format!("timings-{ix}-of-{n}.json")));
                assert_eq!(times["shard"], format!("{ix}/{n}"));
                let made = times["frames"].as_array().expect("a list");
                assert_eq!(made.len(), (n_frames + n - 1 - ix) / n);
                n_made += made.len();
            }
            assert_eq!(n_made, n_frames);
            assert!(!out.join("timings.json").exists());
            fs::remove_dir_all(out).expect("there");
        }
        let times = timings(&at.join("whole/timings.json"));
        assert_eq!(times.get("shard"), None);
        fs::remove_dir_all(at.join("whole")).expect("there");
    }
    // Round robin in the order of the script: 1, 4 and 7 of 0 to 7.
    let text = done(
        at,
        "render a.toml --backend cpu --script s.json --shard 1/3 -o one --json",
    );
    let document: Value = serde_json::from_str(&text).expect("one document");
    let names: Vec<&str> = document["frames"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|frame| frame["file"].as_str())
        .collect();
    assert_eq!(names, ["edited.png", "undone.exr", "turned.exr"]);
    assert_eq!(files(&at.join("one")).len(), 3);
    // More shards than frames: some have nothing to do, which is no failure.
    let said = done(
        at,
        "render a.toml --backend cpu --turntable 2 --shard 4/5 -o none",
    );
    assert!(said.contains("0 frames"), "{said}");
    assert_eq!(files(&at.join("none")).len(), 0);
}

#[test]
fn shards_are_named_by_hand_or_by_a_scheduler() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let turn = "render a.toml --backend cpu --turntable 3 --size 8x6 -o turn";
    let with = |line: &str, variables: &[(&str, &str)]| {
        let mut command = command(at, line);
        for name in [
            "SLURM_ARRAY_TASK_ID",
            "SLURM_ARRAY_TASK_MIN",
            "SLURM_ARRAY_TASK_COUNT",
        ] {
            command.env_remove(name);
        }
        command
            .env_remove("SLURM_ARRAY_TASK_STEP")
            .env_remove("JOB_COMPLETION_INDEX");
        command.envs(variables.iter().copied());
        command
    };
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "2"),
        ("SLURM_ARRAY_TASK_MIN", "1"),
        ("SLURM_ARRAY_TASK_COUNT", "3"),
    ];
    assert_done(&mut with(&format!("{turn} --shard auto"), &slurm));
    assert!(at.join("turn/0001.exr").exists() && at.join("turn/timings-1-of-3.json").exists());
    let kubernetes = [("JOB_COMPLETION_INDEX", "2")];
    assert_done(&mut with(&format!("{turn} --shard auto/3"), &kubernetes));
    assert!(at.join("turn/0002.exr").exists());
    assert_eq!(files(&at.join("turn")).len(), 2);
    for (line, variables, needles) in [
        (
            format!("{turn} --shard 3/3"),
            &[][..],
            ["3 of 3", "count from 0"],
        ),
        (format!("{turn} --shard 1"), &[], ["--shard", "I/N"]),
        (
            format!("{turn} --shard auto"),
            &[],
            ["SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"],
        ),
        (
            format!("{turn} --shard auto"),
            &kubernetes,
            ["JOB_COMPLETION_INDEX", "auto/N"],
        ),
        (
            "render a.toml -o a.png --shard 0/3".to_owned(),
            &[],
            ["--shard", "--turntable"],
        ),
        (
            "reference a.toml --method path -o a.exr --shard 0/3 --resume".to_owned(),
            &[],
            ["--shard", "--resume"],
        ),
    ] {
        assert_refused(&mut with(&line, variables), &needles);
    }
}

const REFERENCE: &str = "reference a.toml --size 24x16";

#[test]
fn slow_merged_samples_are_those_of_one_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    for (method, samples) in [("path", 20), ("ray-shoot", 16), ("directional", 100)] {
        let run = format!("{REFERENCE} --method {method} --samples {samples} --seed 5");
        done(at, &format!("{run} -o whole.exr"));
        let whole = fs::read(at.join("whole.exr")).expect("written");
        for n in [1, 3, 7] {
            let part = |ix: usize| format!("part-{ix}.exr");
            for ix in 0..n {
                let threads = 1 + ix % 3;
                let line = format!(
                    "{run} --shard {ix}/{n} -o {} --threads {threads} --json",
                    part(ix)
                );
                let report: Value = serde_json::from_str(&done(at, &line)).expect("one document");
                assert_eq!(report["shard"], format!("{ix}/{n}"));
                assert_eq!(report["spp_of_all"], samples);
                let spp = report["spp"].as_u64().expect("a number");
                assert!(
                    spp.abs_diff(samples / n as u64) <= 2 + samples / (8 * n as u64),
                    "{spp}"
                );
            }
            // Last ones first.
            let parts: Vec<String> = (0..n).rev().map(part).collect();
            let line = format!("reference merge {} -o merged.exr --json", parts.join(" "));
            let report: Value = serde_json::from_str(&done(at, &line)).expect("one document");
            assert_eq!(
                (&report["spp"], &report["parts"]),
                (&samples.into(), &n.into())
            );
            let merged = fs::read(at.join("merged.exr")).expect("written");
            assert!(merged == whole, "{method}, {n} parts");
        }
        // And is gone on with like it.
        let more = format!("{REFERENCE} --method {method} --samples 12 --seed 5 --resume");
        done(at, &format!("{more} -o merged.exr"));
        done(at, &format!("{more} -o whole.exr"));
        let read = |name: &str| fs::read(at.join(name)).expect("written");
        assert!(read("merged.exr") == read("whole.exr") && read("whole.exr") != whole);
    }
}

#[test]
fn parts_that_make_no_picture_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let run = |args: &str, name: &str| {
        let line = format!("reference a.toml --method directional --lights 16 {args} -o {name}");
        done(at, &line);
    };
    for ix in 0..3 {
        run(
            &format!("--size 12x8 --samples 6 --shard {ix}/3"),
            &format!("{ix}.exr"),
        );
    }
    run("--size 12x8 --samples 6", "whole.exr");
    run("--size 12x8 --samples 6 --seed 1 --shard 1/3", "seed.exr");
    run("--size 12x9 --samples 6 --shard 1/3", "size.exr");
    run("--size 12x8 --samples 7 --shard 1/3", "samples.exr");
    run("--size 12x8 --samples 6 --shard 1/4", "count.exr");
    run("--size 12x8 --samples 6 --time 2 --shard 1/3", "time.exr");
    let bytes = fs::read(at.join("1.exr")).expect("written");
    fs::write(at.join("short.exr"), &bytes[..bytes.len() - 40]).expect("written");
    let mut seeded = bytes.clone();
    let place = seeded
        .windows(21)
        .position(|w| w == b"strandlight/inputs\0st");
    let place = place.expect("an attribute") + "strandlight/inputs\0string\0".len() + 4;
    seeded[place] ^= 1;
    fs::write(at.join("flipped.exr"), seeded).expect("written");
    for (parts, needles) in [
        ("0.exr 1.exr", &["missing of 3 parts: 2/3"][..]),
        ("2.exr", &["missing of 3 parts: 0/3, 1/3"]),
        (
            "0.exr 1.exr 2.exr 1.exr",
            &["1.exr: is part 1/3 once more, after 1.exr"],
        ),
        (
            "0.exr 1.exr whole.exr",
            &["whole.exr: not a part", "a whole one"],
        ),
        (
            "0.exr seed.exr 2.exr",
            &[
                "seed.exr: cannot be merged with 0.exr",
                "its seed is 1, not 0",
            ],
        ),
        ("0.exr size.exr 2.exr", &["its size is 12x9, not 12x8"]),
        (
            "0.exr samples.exr 2.exr",
            &["its number of samples in all is 7, not 6"],
        ),
        (
            "0.exr count.exr 2.exr",
            &["its number of parts is 4, not 3"],
        ),
        ("0.exr time.exr 2.exr", &["its time is 2, not 0"]),
        (
            "0.exr flipped.exr 2.exr",
            &["flipped.exr", "scene or options differ"],
        ),
        (
            "0.exr short.exr 2.exr",
            &["short.exr: not a readable OpenEXR file"],
        ),
        (
            "0.exr a.groom 2.exr",
            &["a.groom: not a readable OpenEXR file"],
        ),
        ("0.exr nothing.exr", &["nothing.exr: cannot be read"]),
        ("0.exr .", &[".: is not a file"]),
    ] {
        let line = format!("reference merge {parts} -o merged.exr");
        assert_refused(&mut command(at, &line), needles);
    }
    assert_refused(
        &mut command(at, "reference merge 0.exr -o 0.exr"),
        &["0.exr", "is an input"],
    );
    assert_refused(&mut command(at, "reference merge -o a.exr"), &["PART"]);
    assert!(!at.join("merged.exr").exists());
    // A part is no picture to go on with.
    let line = "reference a.toml --method directional --lights 16 --size 12x8 --samples 1 --resume -o 1.exr";
    assert_refused(
        &mut command(at, line),
        &["1.exr", "a part of a picture, 1/3", "reference merge"],
    );
    assert!(fs::read(at.join("1.exr")).expect("there") == bytes);
    done(at, "reference merge 2.exr 0.exr 1.exr -o merged.exr");
    assert!(fs::read(at.join("merged.exr")).ok() == fs::read(at.join("whole.exr")).ok());
}

/// A run that fails takes its empty folder away, but not one that another shard may be about to write into.
#[test]
fn a_failed_shard_leaves_the_folder_to_the_others() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    scene_in(at);
    // After the folder is made, no GPU is found.
    let drivers = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].map(|key| (key, "/nowhere"));
    for (extra, stays) in [("", false), ("--shard 0/1", true)] {
        let line = format!("render a.toml --backend gpu --script s.json -o new/run {extra}");
        assert_refused(command(at, &line).envs(drivers), &["no GPU adapter"]);
        assert_eq!(at.join("new/run").is_dir(), stays, "{extra}");
    }
}
