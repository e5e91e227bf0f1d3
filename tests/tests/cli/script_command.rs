//! What the window can do, a farm can do: scripts, turntables and keys on the command line.

use std::fs;
use std::path::Path;

use serde_json::Value;
use strandlight_formats::{BakedFile, Groom, LightSet, Scene, SrbfLight};
use strandlight_tests::{assert_done, assert_refused, strandlight, strandview};

/// A small scene on disk: two curtains of hair, a light from the left and one from the right.
fn scene_in(folder: &Path) {
    let mut groom = Groom::default();
    groom.strand_offsets.push(0);
    for strand in 0..60 {
        for point in 0..6 {
            let (x, y) = (strand as f32 * 0.1 - 3.0, 2.5 - point as f32);
            groom.points.push([x, y, (0.5 * y + x).sin() * 0.3]);
        }
        groom.strand_offsets.push(groom.points.len() as u32);
    }
    groom.write(&folder.join("a.groom")).expect("written");
    let light = |direction, rgb| SrbfLight {
        direction,
        lambda: 0.4,
        rgb,
    };
    let lights = LightSet {
        lights: vec![
            light([-0.6, 0.0, 0.8], [8.0, 2.0, 1.0]),
            light([0.6, 0.0, 0.8], [1.0, 2.0, 8.0]),
            light([0.0, 1.0, 0.0], [0.5, 0.5, 0.5]),
        ],
        ..LightSet::default()
    };
    lights.write(&folder.join("a.lights")).expect("written");
    let mut scene = Scene::new("a.groom", "a.lights");
    scene.hair.diameter_cm = Some(0.08);
    scene.render.size = [48, 32];
    scene.render.samples = 8;
    scene.render.shadow_maps = 4;
    scene.render.background = strandlight_formats::Background::None;
    let text = scene.to_toml_string().expect("valid");
    fs::write(folder.join("a.toml"), text).expect("written");
}

const SCRIPT: &str = r#"[
    {"frame": "first"},
    {"set": {"hair.eta": 1.7, "lights.muted": [0]}},
    {"frame": "second", "size": [30, 20], "samples": 4},
    {"set": {"camera.position": [10, 0, 20], "hair.melanin.eumelanin": 3}},
    {"frame": "third"},
    {"undo": 2},
    {"frame": "back"},
    {"redo": 1},
    {"frame": "again", "size": [30, 20], "samples": 4}
]"#;

/// Mean of red, green and blue of an 8-bit picture, 0..=1, and its size.
fn mean(path: &Path) -> ([f64; 3], [u32; 2]) {
    let file = fs::File::open(path).expect("written");
    let mut reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("a PNG");
    let step = info.color_type.samples();
    let n = (info.width * info.height) as f64;
    let channel = |c: usize| {
        let values = bytes.chunks(step).map(|pixel| f64::from(pixel[c]));
        values.sum::<f64>() / (255.0 * n)
    };
    (
        [channel(0), channel(1), channel(2)],
        [info.width, info.height],
    )
}

#[test]
fn gpu_a_script_edits_undoes_and_draws() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    fs::write(at.join("s.json"), SCRIPT).expect("written");
    let said = assert_done(
        strandview()
            .current_dir(at)
            .args(["a.toml", "--script", "s.json", "--out", "frames"])
            .args(["--backend", "gpu"]),
    );
    assert_eq!(said.lines().count(), 6, "{said}");
    let frame = |name: &str| mean(&at.join("frames").join(name));
    let (first, size) = frame("first.png");
    assert_eq!(size, [48, 32]);
    let (second, size) = frame("second.png");
    assert_eq!(size, [30, 20]);
    // Without the red light from the left.
    assert!(second[0] < 0.8 * first[0], "{first:?} {second:?}");
    assert!(second[0] / second[2] < 0.7 * first[0] / first[2]);
    let (third, _) = frame("third.png");
    assert!(
        third[1] < 0.9 * second[1],
        "darker hair: {second:?} {third:?}"
    );
    // Undone, and done again.
    let (back, _) = frame("back.png");
    let (again, _) = frame("again.png");
    for c in 0..3 {
        assert!((back[c] - first[c]).abs() < 0.01, "{first:?} {back:?}");
        assert!((again[c] - second[c]).abs() < 0.01, "{second:?} {again:?}");
    }
    let text = fs::read_to_string(at.join("frames/timings.json")).expect("written");
    let timings: Value = serde_json::from_str(&text).expect("JSON");
    let frames = timings["frames"].as_array().expect("a list");
    assert_eq!(frames.len(), 5);
    assert_eq!(frames[1]["file"], "second.png");
    assert_eq!(frames[1]["samples"], 4);
    let changed = |ix: usize| frames[ix]["changed"].to_string();
    assert_eq!(changed(1), r#"["hair","light_colors"]"#);
    assert!(changed(2).contains("camera") && changed(2).contains("hair"));
    assert!(
        frames
            .iter()
            .all(|frame| frame["milliseconds"].as_f64() > Some(0.0))
    );
    assert!(timings["peak_bytes"].as_u64() > Some(1 << 20), "{text}");
    // An edit of the hair and of colours touches no geometry and finds no shadows.
    let stages = frames[1]["report"]["stages"].to_string();
    assert!(
        !stages.contains("voxelise") && !stages.contains("transmittance"),
        "{stages}"
    );
    assert_eq!(frames[1]["report"]["geometry_uploads"], 0);
}

/// `strandlight render` makes the same frames, as OpenEXR or PNG, with and without a GPU.
#[test]
fn gpu_a_farm_makes_the_frames_of_the_window() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let script = SCRIPT
        .replace("\"third\"", "\"third.png\"")
        .replace("\"second\"", "\"second.png\"");
    fs::write(at.join("s.json"), script).expect("written");
    fs::write(at.join("plain.json"), SCRIPT).expect("written");
    assert_done(strandview().current_dir(at).args([
        "a.toml",
        "--script",
        "plain.json",
        "--out",
        "window",
        "--backend",
        "gpu",
    ]));
    for backend in ["gpu", "cpu"] {
        let args = ["render", "a.toml", "--script", "s.json", "-o", backend];
        assert_done(
            strandlight()
                .current_dir(at)
                .args(args)
                .args(["--backend", backend]),
        );
        let mut names: Vec<String> = fs::read_dir(at.join(backend))
            .expect("made")
            .map(|entry| {
                entry
                    .expect("readable")
                    .file_name()
                    .into_string()
                    .expect("ASCII")
            })
            .collect();
        names.sort();
        assert_eq!(
            names,
            [
                "again.exr",
                "back.exr",
                "first.exr",
                "second.png",
                "third.png",
                "timings.json"
            ]
        );
        for name in ["second.png", "third.png"] {
            let (found, _) = mean(&at.join(backend).join(name));
            let (expected, _) = mean(&at.join("window").join(name));
            for c in 0..3 {
                assert!(
                    (found[c] - expected[c]).abs() < 0.01,
                    "{backend} {name}: {found:?} {expected:?}"
                );
            }
        }
        let text = fs::read_to_string(at.join(backend).join("timings.json")).expect("written");
        let timings: Value = serde_json::from_str(&text).expect("JSON");
        assert!(
            timings["backend"]
                .as_str()
                .expect("text")
                .starts_with(backend),
            "{text}"
        );
    }
}

#[test]
fn gpu_turntables_and_keys() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    assert_done(
        strandview()
            .current_dir(at)
            .args([
                "a.toml",
                "--turntable",
                "3",
                "--out",
                "t",
                "--size",
                "30x20",
            ])
            .args([
                "--samples",
                "4",
                "--set",
                "render.background=[0.2, 0.2, 0.2]",
            ]),
    );
    let frame = |name: &str| mean(&at.join(name));
    let (front, size) = frame("t/0000.png");
    assert_eq!(size, [30, 20]);
    assert!(front.iter().all(|&x| x > 0.2), "{front:?}");
    assert!(frame("t/0001.png").0 != front && at.join("t/0002.png").exists());
    assert!(!at.join("t/0003.png").exists());
    // The first frame is the scene's own view.
    let still = [
        "a.toml",
        "--frame",
        "f.png",
        "--size",
        "30x20",
        "--samples",
        "4",
    ];
    assert_done(
        strandview()
            .current_dir(at)
            .args(still)
            .args(["--set", "render.background=[0.2, 0.2, 0.2]"]),
    );
    let (alone, _) = frame("f.png");
    for c in 0..3 {
        assert!((alone[c] - front[c]).abs() < 0.005, "{alone:?} {front:?}");
    }
    let args = [
        "render",
        "a.toml",
        "--turntable",
        "2",
        "-o",
        "e",
        "--backend",
        "cpu",
    ];
    assert_done(strandlight().current_dir(at).args(args).args([
        "--size",
        "24x16",
        "--samples",
        "4",
    ]));
    assert!(at.join("e/0001.exr").exists() && at.join("e/timings.json").exists());
}

#[test]
fn bad_scripts_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let script = |name: &str, text: &str| fs::write(at.join(name), text).expect("written");
    script("kind.json", r#"[{"frame": "a"}, {"colour": 1}]"#);
    script("key.json", r#"[{"set": {"hair.eta": 9}}]"#);
    script("undo.json", r#"[{"undo": 1}]"#);
    // What is found out on the way.
    let stroke = r#"{"stroke": {"brush": {"radius_cm": 1, "effect": "erase"}, "path": [[4, 4]]}}"#;
    script("late.json", &format!(r#"[{stroke}, {{"undo": 3}}]"#));
    fs::create_dir(at.join("d")).expect("a folder");
    script("d/timings.json", r#"[{"frame": "a"}]"#);
    script("d/a.png", r#"[{"frame": "a"}]"#);
    let flood = r#"[{"flood": {"mask": {"from": 0.9, "to": 0.1}}}]"#;
    script("flood.json", flood);
    script("path.json", r#"[{"frame": "a"}, {"stroke": {"path": []}}]"#);
    script("exr.json", r#"[{"frame": "a.exr"}]"#);
    script("jpg.json", r#"[{"frame": "a.jpg"}, {"frame": "../b"}]"#);
    for (args, needles) in [
        (
            &["a.toml", "--script", "kind.json", "--out", "o"][..],
            &["kind.json", "step 1: colour: unknown key"][..],
        ),
        (
            &["a.toml", "--script", "key.json", "--out", "o"],
            &["key.json: step 0", "hair.eta"],
        ),
        (
            &["a.toml", "--script", "undo.json", "--out", "o"],
            &["step 0", "no step to undo"],
        ),
        (
            &[
                "a.toml",
                "--script",
                "undo.json",
                "--out",
                "o",
                "--set",
                "hair.eta=1.4",
            ],
            &["step 0", "no step to undo"],
        ),
        (
            &[
                "a.toml",
                "--script",
                "late.json",
                "--out",
                "o",
                "--backend",
                "cpu",
            ],
            &["late.json: step 1", "no step to undo"],
        ),
        (
            &["a.toml", "--script", "flood.json", "--out", "o"],
            &["flood.json: step 0: brush: mask.from = 0.9 must be in 0..=0.1"],
        ),
        (
            &["a.toml", "--script", "path.json", "--out", "o"],
            &["path.json: step 1: stroke.path is [], must have a point"],
        ),
        (
            &["a.toml", "--script", "d/timings.json", "--out", "d"],
            &["d/timings.json", "is an input"],
        ),
        (
            &["a.toml", "--script", "d/a.png", "--out", "d"],
            &["d/a.png", "is an input"],
        ),
        (
            &["a.toml", "--script", "exr.json", "--out", "o"],
            &["a.exr", "strandlight render"],
        ),
        (
            &["a.toml", "--script", "jpg.json", "--out", "o"],
            &["step 1", "../b"],
        ),
        (
            &["a.toml", "--script", "none.json", "--out", "o"],
            &["none.json"],
        ),
        (&["a.toml", "--script", "key.json"], &["--output DIR"]),
        (
            &["a.toml", "--turntable", "0", "--out", "o"],
            &["--turntable 0"],
        ),
        (
            &["a.toml", "--turntable", "2", "--out", "a.groom"],
            &["a.groom"],
        ),
        (
            &["a.toml", "--frame", "a.png", "--set", "hair.colour=1"],
            &["hair.colour"],
        ),
        (
            &["a.toml", "--frame", "a.png", "--set", "hair.etta=1"],
            &["hair.etta", "did you mean eta?"],
        ),
        (
            &["a.toml", "--frame", "a.png", "--log", "l.json"],
            &["--log", "--frame"],
        ),
        (
            &["a.toml", "--frame", "a.png", "--set", "lights.solo=[3]"],
            &["lights.solo", "3"],
        ),
    ] {
        assert_refused(strandview().current_dir(at).args(args), needles);
    }
    assert!(!at.join("a.png").exists());
    // The last of them was refused by a viewer that was there.
    assert!(!at.join("o").exists());
    for (args, needles) in [
        (
            &["--script", "kind.json", "-o", "o"][..],
            &["kind.json", "step 1"][..],
        ),
        (
            &["--turntable", "2", "--script", "key.json", "-o", "o"],
            &["--script"],
        ),
        (
            &["--turntable", "2", "-o", "o", "--transmittance", "ray"],
            &["--transmittance"],
        ),
        (
            &["--script", "undo.json", "-o", "o", "--set", "hair.eta=1.4"],
            &["undo.json: step 0", "no step to undo"],
        ),
        (
            &["--script", "late.json", "-o", "o", "--backend", "cpu"],
            &["late.json: step 1", "no step to undo"],
        ),
        (&["-o", "a.png", "--set", "hair.eta=9"], &["hair.eta"]),
    ] {
        let mut command = strandlight();
        assert_refused(
            command
                .current_dir(at)
                .args(["render", "a.toml"])
                .args(args),
            needles,
        );
    }
    assert!(!at.join("o").exists());
}
