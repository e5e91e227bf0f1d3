//! Flags of `strandlight render` together: each pair is honoured or refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use strandlight_formats::{CameraSection, MotionSection, Scattering, Scene, WindSection};
use strandlight_reference::compare::Layer;
use strandlight_scene::files::Files;
use strandlight_scene::provenance::Recorder;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, strandlight};

use super::render_files::header;

/// A flag of `render` and its value, if it takes one.
const FLAGS: [(&str, &str); 16] = [
    ("--set", "hair.eta=1.7"),
    ("--script", "s.json"),
    ("--turntable", "2"),
    ("--aov", "lights"),
    ("--light-group", "key=0"),
    ("--size", "20x10"),
    ("--samples", "8"),
    ("--backend", "cpu"),
    ("--scattering", "single"),
    ("--shadow-maps", "5"),
    ("--transmittance", "ray"),
    ("--time", "0.75"),
    ("--stats", ""),
    ("--json", ""),
    ("--quiet", ""),
    ("--threads", "1"),
];

/// Those of [`FLAGS`] that no picture stays the same with.
const CHANGE_PICTURES: [&str; 7] = [
    "--set",
    "--size",
    "--samples",
    "--scattering",
    "--shadow-maps",
    "--transmittance",
    "--time",
];

/// A small scene in the wind, with a view of its own.
fn moving_scene_in(at: &Path) {
    write_small_scene(at, &curtain(20, 6, 0.2, 0.0), key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.1);
        scene.render.size = [24, 16];
        scene.render.samples = 4;
        scene.render.shadow_maps = 3;
        scene.camera = Some(CameraSection {
            position: [0.0, -2.0, 16.0],
            target: [0.0, -2.0, 0.0],
            up: [0.0, 1.0, 0.0],
            fov_deg: 30.0,
        });
        scene.motion = Some(MotionSection {
            wind: Some(WindSection {
                speed: 20.0,
                gust: 1.0,
                stiffness: 1.0,
                ..WindSection::default()
            }),
            ..MotionSection::default()
        });
    });
}

#[test]
fn slow_every_pair_of_flags_is_honoured_or_refused_by_name() {
    // The table is complete: a new flag needs a line in it.
    let help = assert_done(strandlight().args(["render", "--help"]));
    // Options are indented, unlike the lines of the description.
    let options = help.lines().filter(|line| line.starts_with("  "));
    let listed = options.filter_map(|line| {
        let mut words = line.split_whitespace();
        let first = words.next().filter(|word| word.starts_with('-'))?;
        let long = match first.starts_with("--") {
            true => first,
            false => words.next()?,
        };
        // Lists of values have a dash alone.
        long.starts_with("--").then(|| long.to_owned())
    });
    let of_all_commands = ["--output", "--help", "--version"];
    // Refused without frames, or without --converge; `shard_command` and `converge_command` try them.
    let of_others = ["--shard", "--converge", "--until", "--map", "--seed"];
    for flag in listed {
        let is_known = FLAGS.iter().any(|(known, _)| flag == *known);
        let is_elsewhere = of_all_commands.contains(&&*flag) || of_others.contains(&&*flag);
        assert!(is_known || is_elsewhere, "{flag}");
    }

    let bench = Bench::new();
    let alone: BTreeMap<&str, Pixels> = FLAGS
        .into_iter()
        .filter_map(|flag| Some((flag.0, bench.render(&[flag]).ok()?)))
        .collect();
    assert_eq!(alone.len(), FLAGS.len());
    let mut refused = Vec::new();
    for (ix, a) in FLAGS.into_iter().enumerate() {
        for b in FLAGS[ix + 1..].iter().copied() {
            if !bench.check([a, b], &alone) {
                refused.push([a.0, b.0]);
            }
        }
    }
    // Script, turntable and layers; groups with the first two; baselines with these four and maps;
    // statistics that are not to be printed.
    assert_eq!(refused.len(), 3 + 2 + 5 + 1, "{refused:?}");
}

#[test]
fn gpu_every_flag_takes_effect_on_the_gpu() {
    let bench = Bench::new();
    let gpu = ("--backend", "gpu");
    let plain = bench.render(&[gpu]).expect("a picture");
    let alone = BTreeMap::from([(gpu.0, plain)]);
    let mut refused = Vec::new();
    for flag in FLAGS.into_iter().filter(|flag| flag.0 != gpu.0) {
        if !bench.check([gpu, flag], &alone) {
            refused.push(flag.0);
        }
    }
    assert_eq!(refused, ["--transmittance"]);
}

/// Linear RGB of a picture.
type Pixels = Vec<[f32; 3]>;

/// A moving scene and a script in a folder.
struct Bench {
    folder: tempfile::TempDir,
    scene: Scene,
}

impl Bench {
    fn new() -> Bench {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let at = folder.path();
        moving_scene_in(at);
        fs::write(at.join("s.json"), r#"[{"frame": "first"}]"#).expect("written");
        let scene = Scene::read(at.join("a.toml")).expect("valid");
        Bench { folder, scene }
    }

    /// The output of `render` with `flags`, and those that they need.
    fn run(&self, flags: &[(&str, &str)]) -> Output {
        let has = |flag: &str| flags.iter().any(|(known, _)| *known == flag);
        let mut command = strandlight();
        command.current_dir(self.folder.path());
        command.args(["render", "a.toml", "-o", output_of(flags)]);
        for (flag, value) in flags {
            command.arg(flag);
            if !value.is_empty() {
                command.arg(value);
            }
        }
        if !has("--backend") {
            command.args(["--backend", "cpu"]);
        }
        if !has("--json") {
            command.arg("--json");
        }
        // Groups are of lights alone, and only the flags of other pictures are in their way.
        let is_other = ["--script", "--turntable", "--transmittance", "--aov"];
        if has("--light-group") && !is_other.into_iter().any(has) {
            command.args(["--aov", "lights"]);
        }
        command.output().expect("runs")
    }

    /// The picture of `flags`, or why there is none.
    fn render(&self, flags: &[(&str, &str)]) -> Result<Pixels, String> {
        let output = self.run(flags);
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        let pixels = self.pixels(flags);
        self.remove(flags);
        Ok(pixels)
    }

    fn pixels(&self, flags: &[(&str, &str)]) -> Pixels {
        let path = self.folder.path().join(picture_of(flags));
        Layer::read(&path, None).expect("readable").rgb
    }

    fn remove(&self, flags: &[(&str, &str)]) {
        let path = self.folder.path().join(output_of(flags));
        match path.is_dir() {
            true => fs::remove_dir_all(path).expect("there"),
            false => fs::remove_file(path).expect("there"),
        }
    }

    /// Whether `pair` is honoured: then both flags have done what they say, and those that change
    /// the picture changed that of the other flag `alone`. If not, they are refused by name.
    fn check(&self, pair: [(&str, &str); 2], alone: &BTreeMap<&str, Pixels>) -> bool {
        let at = self.folder.path();
        let has = |flag: &str| pair.iter().any(|(known, _)| *known == flag);
        let is_many = has("--script") || has("--turntable");
        let output = self.run(&pair);
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        let what = format!("{pair:?}: {stderr}");
        if output.status.code() == Some(2) {
            assert!(stderr.lines().count() == 1, "{what}");
            let names_both = pair.iter().all(|(flag, _)| stderr.contains(flag));
            assert!(names_both, "{what}");
            assert!(!at.join(output_of(&pair)).exists(), "{what}");
            return false;
        }
        assert!(output.status.success(), "{what}");
        let report: Value = serde_json::from_slice(&output.stdout).expect("one document");
        // What the picture must be of.
        let mut scene = self.scene.clone();
        let seconds = if has("--time") { 0.75 } else { 0.0 };
        if has("--set") {
            scene.hair.eta = 1.7;
        }
        if has("--size") {
            scene.render.size = [20, 10];
        }
        if has("--samples") {
            scene.render.samples = 8;
        }
        if has("--scattering") {
            scene.render.scattering = Scattering::Single;
        }
        if has("--shadow-maps") {
            scene.render.shadow_maps = 5;
        }
        let expected = Recorder::new(&Files::Disk).record(&scene, seconds);
        let (texts, channels) = header(&at.join(picture_of(&pair)));
        for (name, value) in expected.expect("readable").entries() {
            assert_eq!(texts.get(name), Some(value), "{name}: {what}");
        }
        let is_on_gpu = pair.contains(&("--backend", "gpu"));
        // Nothing is sampled unless that is asked for.
        let samples = match has("--samples") || has("--transmittance") {
            true => scene.render.samples,
            false => 0,
        };
        let drawn = samples.to_string();
        assert_eq!(texts["strandlight/samples"], drawn, "{what}");
        let backend = if is_on_gpu { "gpu: " } else { "cpu" };
        assert!(
            texts["strandlight/backend"].starts_with(backend),
            "{texts:?}"
        );
        let of_frame = match is_many {
            true => &report["frames"][0],
            false => &report,
        };
        assert_eq!(of_frame["time"], seconds, "{what}");
        let size = serde_json::json!(scene.render.size);
        assert_eq!(of_frame["size"], size, "{what}");
        let has_layer = |name: &str| channels.iter().any(|channel| channel == name);
        assert_eq!(has_layer("light.key.R"), has("--light-group"), "{what}");
        let is_layered = has("--aov") || has("--light-group");
        assert_eq!(has_layer("total.R"), is_layered, "{what}");
        let is_single = has("--aov") && !has("--light-group");
        assert_eq!(has_layer("light.000.R"), is_single, "{what}");
        let method = texts.get("strandlight/transmittance").map(String::as_str);
        assert_eq!(method, has("--transmittance").then_some("ray"), "{what}");
        assert_eq!(stderr.contains("voxelise"), has("--stats"), "{what}");
        // Drivers of GPUs may print as they like.
        let has_notes = ["rendered on", " samples", "visibility list"];
        let has_notes = has_notes.iter().any(|text| stderr.contains(text));
        assert_eq!(has_notes, !has("--quiet"), "{what}");
        let second = at.join("frames/0001.exr");
        assert_eq!(second.exists(), has("--turntable"), "{what}");
        let pixels = self.pixels(&pair);
        for (flag, other) in [(pair[0], pair[1]), (pair[1], pair[0])] {
            if let Some(without) = alone
                .get(other.0)
                .filter(|_| CHANGE_PICTURES.contains(&flag.0))
            {
                assert!(pixels != *without, "{} changes nothing: {what}", flag.0);
            }
        }
        self.remove(&pair);
        true
    }
}

/// What `render` writes for `flags`.
fn output_of(flags: &[(&str, &str)]) -> &'static str {
    let is_many = |(flag, _): &(&str, &str)| ["--script", "--turntable"].contains(flag);
    if flags.iter().any(is_many) {
        "frames"
    } else {
        "a.exr"
    }
}

/// The first picture in there.
fn picture_of(flags: &[(&str, &str)]) -> &'static str {
    let has = |flag: &str| flags.iter().any(|(known, _)| *known == flag);
    match (has("--script"), has("--turntable")) {
        (true, _) => "frames/first.exr",
        (_, true) => "frames/0000.exr",
        _ => "a.exr",
    }
}

#[test]
fn gpu_layers_and_frames_are_of_the_hair_at_the_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    moving_scene_in(at);
    fs::write(
        at.join("s.json"),
        r#"[{"frame": "a"}, {"time": 0}, {"frame": "b"}]"#,
    )
    .expect("written");
    let pixels = |file: &str| {
        let layer = Layer::read(&at.join(file), None);
        layer.expect("readable").rgb
    };
    for backend in ["cpu", "gpu"] {
        let render = |args: &str| {
            let mut command = strandlight();
            command.current_dir(at).args(["render", "a.toml"]);
            let output = command
                .args(["--backend", backend])
                .args(args.split(' '))
                .output()
                .expect("runs");
            assert!(output.status.success(), "{output:?}");
            String::from_utf8_lossy(&output.stderr).into_owned()
        };
        render("-o rest.exr");
        render("-o moved.exr --time 0.75");
        render("-o layers.exr --time 0.75 --aov terms");
        let said = render("-o frames --time 0.75 --script s.json --stats");
        // One for each frame.
        assert_eq!(said.matches("shadow maps  ").count(), 2, "{said}");
        render("-o turn --time 0.75 --turntable 1");
        let apart = |a: &str, b: &str| {
            let (a, b) = (pixels(a), pixels(b));
            let pairs = a.iter().flatten().zip(b.iter().flatten());
            let sum: f32 = pairs.clone().map(|(a, b)| (a - b).abs()).sum();
            sum / pairs.map(|(_, b)| b.abs()).sum::<f32>()
        };
        let moved = apart("rest.exr", "moved.exr");
        // 0.025: the breeze blows at rest, too; what differs are its gusts.
        assert!(moved > 0.01, "{backend}: the wind moves hair: {moved}");
        for (file, expected) in [
            ("layers.exr", "moved.exr"),
            ("frames/a.exr", "moved.exr"),
            ("frames/b.exr", "rest.exr"),
            ("turn/0000.exr", "moved.exr"),
        ] {
            let error = apart(file, expected);
            assert!(error < 0.02 * moved, "{backend}: {file}: {error}, {moved}");
        }
    }
}
