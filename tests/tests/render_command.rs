//! `strandlight render` and `strandview --frame` from the outside, and what they refuse.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use exr::meta::attribute::AttributeValue;
use serde_json::Value;
use strandlight_formats::{
    CameraSection, Mode, MotionSection, Scattering, Scene, TableFile, TablesSection, WindSection,
    content_hash,
};
use strandlight_scattering::Lobe;
use strandlight_scattering::lobes::table_names;
use strandlight_scene::files::Files;
use strandlight_scene::provenance::Recorder;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, project_root, strandlight, strandview};

/// A small scene on disk.
fn scene_in(folder: &Path) {
    let groom = curtain(40, 6, 0.1, 0.0);
    write_small_scene(folder, &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.05);
    });
}

#[test]
fn every_backend_and_format_writes_the_picture() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    for backend in ["auto", "gpu", "cpu"] {
        for format in ["png", "exr"] {
            let out = format!("{backend}.{format}");
            let args = [
                "render",
                "a.toml",
                "-o",
                &out,
                "--size",
                "60x40",
                "--samples",
                "5",
            ];
            let output = strandlight()
                .current_dir(folder.path())
                .args(args)
                .args(["--backend", backend])
                .output()
                .expect("runs");
            assert!(output.status.success(), "{output:?}");
            let text = String::from_utf8_lossy(&output.stdout);
            let line = text.lines().last().unwrap_or_default();
            assert!(
                line.contains(&out) && line.contains("60x40, 5 samples"),
                "{text}"
            );
            let bytes = fs::read(folder.path().join(&out)).expect("written");
            let magic: &[u8] = if format == "png" {
                b"\x89PNG"
            } else {
                b"\x76\x2f\x31\x01"
            };
            assert!(bytes.starts_with(magic));
        }
    }
    let png = |name: &str| fs::read(folder.path().join(name)).expect("written");
    assert_eq!(
        png("auto.png"),
        png("gpu.png"),
        "auto takes the GPU, and repeats itself"
    );
    let output = strandview()
        .current_dir(folder.path())
        .args([
            "a.toml",
            "--frame",
            "v.png",
            "--size",
            "60x40",
            "--samples",
            "5",
        ])
        .output()
        .expect("runs");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("60x40, 5 samples"), "{text}");
    assert_eq!(png("v.png"), png("gpu.png"));
}

/// The texts in the header of an OpenEXR file, and the names of its channels.
fn header(path: &Path) -> (BTreeMap<String, String>, Vec<String>) {
    let data = exr::meta::MetaData::read_from_file(path, true).expect("an OpenEXR file");
    let header = &data.headers[0];
    let texts = header.own_attributes.other.iter();
    let texts = texts.filter_map(|(name, value)| match value {
        AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    });
    let channels = header.channels.list.iter();
    let channels = channels.map(|channel| channel.name.to_string());
    (texts.collect(), channels.collect())
}

/// The `tEXt` chunks of a PNG.
fn texts(path: &Path) -> BTreeMap<String, String> {
    let file = fs::File::open(path).expect("written");
    let decoder = png::Decoder::new(std::io::BufReader::new(file));
    let reader = decoder.read_info().expect("a PNG");
    let chunks = &reader.info().uncompressed_latin1_text;
    let chunks = chunks.iter();
    chunks
        .map(|chunk| (chunk.keyword.clone(), chunk.text.clone()))
        .collect()
}

#[test]
fn pictures_say_what_they_were_made_from_and_no_path() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [a, b] = ["here", "there"].map(|name| folder.path().join(name));
    for at in [&a, &b] {
        fs::create_dir(at).expect("a folder");
        scene_in(at);
    }
    // The same under other names.
    fs::rename(b.join("a.groom"), b.join("other.groom")).expect("renamed");
    let mut scene = Scene::read(&b.join("a.toml")).expect("valid");
    scene.groom.file = "other.groom".into();
    fs::write(b.join("b.toml"), scene.to_toml_string().expect("valid")).expect("written");
    let render = |at: &Path, scene: &str, out: &str, more: &[&str]| {
        let args = ["render", scene, "--output", out, "--size", "20x10"];
        let mut command = strandlight();
        command.current_dir(at).args(args).args(["--samples", "4"]);
        assert_done(command.args(["--backend", "cpu"]).args(more));
        fs::read(at.join(out)).expect("written")
    };
    for out in ["x.exr", "x.png"] {
        let (first, second) = (
            render(&a, "a.toml", out, &[]),
            render(&b, "b.toml", out, &[]),
        );
        assert!(first == second, "{out}");
        let paths = ["groom\"", "a.groom", ".toml", "here", "tmp"];
        for path in paths {
            let is_there = first.windows(path.len()).any(|w| w == path.as_bytes());
            assert!(!is_there, "{out} tells {path}");
        }
    }
    let (exr, _) = header(&a.join("x.exr"));
    assert_eq!(exr, texts(&a.join("x.png")));
    let hash_of = |name: &str| content_hash(&fs::read(a.join(name)).expect("there"));
    let version = format!("strandlight {}", env!("CARGO_PKG_VERSION"));
    for (name, value) in [
        ("version", version),
        ("groom", hash_of("a.groom")),
        ("lights", hash_of("a.lights")),
        ("samples", "4".to_owned()),
        ("backend", "cpu".to_owned()),
    ] {
        assert_eq!(exr[&format!("strandlight/{name}")], value, "{name}");
    }
    assert!(exr.contains_key("strandlight/tables"));
    // Another scene, of the same files.
    render(&a, "a.toml", "y.exr", &["--set", "hair.eta=1.6"]);
    let (edited, _) = header(&a.join("y.exr"));
    let differing = exr.iter().filter(|(name, value)| edited[*name] != **value);
    let differing: Vec<&String> = differing.map(|(name, _)| name).collect();
    assert_eq!(differing, ["strandlight/scene"]);
    // Layers and frames say it as well.
    render(&a, "a.toml", "l.exr", &["--aov", "terms"]);
    assert_eq!(header(&a.join("l.exr")).0, exr);
    fs::write(
        a.join("s.json"),
        r#"[{"frame": "f"}, {"frame": "g.png"}, {"stroke": {"path": [[0, 0, 0]]}}, {"frame": "h"}]"#,
    )
    .expect("written");
    let args = ["render", "a.toml", "-o", "o", "--script", "s.json"];
    let mut command = strandlight();
    command
        .current_dir(&a)
        .args(args)
        .args(["--backend", "cpu"]);
    assert_done(command.args(["--size", "20x10", "--samples", "4"]));
    assert_eq!(header(&a.join("o/f.exr")).0, exr);
    assert_eq!(texts(&a.join("o/g.png")), exr);
    let (painted, _) = header(&a.join("o/h.exr"));
    assert!(painted.contains_key("strandlight/paint"), "{painted:?}");
}

/// Every kind of file, from separate processes. Only `timings.json` and reports, which hold times,
/// differ.
#[test]
fn files_are_the_same_on_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    fs::copy(
        project_root().join("data/default.tables"),
        at.join("a.tables"),
    )
    .expect("copied");
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n".to_vec();
    for ix in 0..16 * 32_u32 {
        map.extend([(ix % 200) as u8, (ix / 3 % 256) as u8, 90, 129]);
    }
    fs::write(at.join("sky.hdr"), map).expect("written");
    let size = "--size 90x70 --samples 4";
    let commands = [
        format!("render a.toml -o OUT/a.exr --backend cpu {size}"),
        format!("render a.toml -o OUT/a.png --backend cpu {size}"),
        format!("render a.toml -o OUT/gpu.exr --backend gpu {size}"),
        format!("render a.toml -o OUT/l.exr --aov terms,modes,lights --backend cpu {size}"),
        format!("render a.toml -o OUT/t --turntable 2 --backend cpu {size}"),
        "reference a.toml --method path -o OUT/p.exr --spp 2 --size 90x70".to_owned(),
        "reference a.toml --method ray-shoot -o OUT/r.exr --spp 2 --size 90x70".to_owned(),
        "reference a.toml --method directional -o OUT/d.exr --spp 2 --size 90x70".to_owned(),
        "lights sky.hdr -o OUT/s.lights --count 4 --preview OUT/s.png".to_owned(),
        "export a.lights -o OUT/map.exr --width 300".to_owned(),
        "export a.tables -o OUT/table.exr".to_owned(),
        "groom generate --style wavy --strands 300 --points-per-strand 9 -o OUT/g.groom".to_owned(),
        "tables -o OUT/t.tables".to_owned(),
    ];
    for (threads, out) in [("1", "one"), ("4", "four")] {
        fs::create_dir(at.join(out)).expect("a folder");
        for line in &commands {
            let mut command = strandlight();
            command.current_dir(at).env("RAYON_NUM_THREADS", threads);
            assert_done(command.args(line.replace("OUT", out).split(' ')));
        }
    }
    let mut names = vec!["t/0000.exr".to_owned(), "t/0001.exr".to_owned()];
    for entry in fs::read_dir(at.join("one")).expect("a folder") {
        let entry = entry.expect("readable");
        if entry.path().is_file() {
            names.push(entry.file_name().into_string().expect("ASCII"));
        }
    }
    assert!(names.len() >= 14, "{names:?}");
    for name in names {
        let read = |out: &str| fs::read(at.join(out).join(&name)).expect("written");
        assert!(read("one") == read("four"), "{name}");
    }
}

/// A flag of `render` and its value, if it takes one.
const FLAGS: [(&str, &str); 14] = [
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
fn every_pair_of_flags_is_honoured_or_refused_by_name() {
    // The table is complete: a new flag needs a line in it.
    let help = assert_done(strandlight().args(["render", "--help"]));
    let told = help.lines().filter_map(|line| {
        let mut words = line.split_whitespace();
        let first = words.next().filter(|word| word.starts_with('-'))?;
        let long = match first.starts_with("--") {
            true => first,
            false => words.next()?,
        };
        // Lists of values have a dash alone.
        long.starts_with("--").then(|| long.to_owned())
    });
    let of_all_commands = ["--output", "--help", "--version", "--quiet", "--threads"];
    for flag in told {
        let is_known = FLAGS.iter().any(|(known, _)| flag == *known);
        assert!(is_known || of_all_commands.contains(&&*flag), "{flag}");
    }

    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    moving_scene_in(at);
    fs::write(at.join("s.json"), r#"[{"frame": "first"}]"#).expect("written");
    let plain = Scene::read(&at.join("a.toml")).expect("valid");
    let mut recorder = Recorder::new(&Files::Disk);
    let mut n_refused = 0;
    for (ix, a) in FLAGS.into_iter().enumerate() {
        for b in FLAGS[ix + 1..].iter().copied() {
            let pair = [a, b];
            let has = |flag: &str| pair.iter().any(|(known, _)| *known == flag);
            let is_many = has("--script") || has("--turntable");
            let out = if is_many { "frames" } else { "a.exr" };
            let mut command = strandlight();
            command
                .current_dir(at)
                .args(["render", "a.toml", "-o", out]);
            for (flag, value) in pair {
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
            let in_the_way = is_many || has("--transmittance") || has("--aov");
            if has("--light-group") && !in_the_way {
                command.args(["--aov", "lights"]);
            }
            let output = command.output().expect("runs");
            let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
            let what = format!("{a:?} {b:?}: {stderr}");
            if output.status.code() == Some(2) {
                assert!(stderr.lines().count() == 1, "{what}");
                assert!(stderr.contains(a.0) && stderr.contains(b.0), "{what}");
                assert!(!at.join(out).exists(), "{what}");
                n_refused += 1;
                continue;
            }
            assert!(output.status.success(), "{what}");
            let report: Value = serde_json::from_slice(&output.stdout).expect("one document");
            // What the picture must be of.
            let mut scene = plain.clone();
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
            let expected = recorder.record(&scene, seconds).expect("readable");
            let file = match (has("--script"), has("--turntable")) {
                (true, _) => "frames/first.exr",
                (_, true) => "frames/0000.exr",
                _ => "a.exr",
            };
            let (texts, channels) = header(&at.join(file));
            for (name, value) in expected.entries() {
                assert_eq!(texts.get(name), Some(value), "{name}: {what}");
            }
            let samples = scene.render.samples.to_string();
            assert_eq!(texts["strandlight/samples"], samples, "{what}");
            assert_eq!(texts["strandlight/backend"], "cpu", "{what}");
            let of_frame = if is_many {
                &report["frames"][0]
            } else {
                &report
            };
            assert_eq!(of_frame["time"], seconds, "{what}");
            assert_eq!(
                of_frame["size"],
                serde_json::json!(scene.render.size),
                "{what}"
            );
            let has_layer = |name: &str| channels.iter().any(|channel| channel == name);
            assert_eq!(has_layer("light.key.R"), has("--light-group"), "{what}");
            let is_layered = has("--aov") || has("--light-group");
            assert_eq!(has_layer("total.R"), is_layered, "{what}");
            let is_single = has("--aov") && !has("--light-group");
            assert_eq!(has_layer("light.000.R"), is_single, "{what}");
            let method = texts.get("strandlight/transmittance").map(String::as_str);
            assert_eq!(method, has("--transmittance").then_some("ray"), "{what}");
            assert_eq!(stderr.contains("voxelise"), has("--stats"), "{what}");
            if has("--turntable") {
                assert!(at.join("frames/0001.exr").exists(), "{what}");
            }
            match is_many {
                true => fs::remove_dir_all(at.join(out)).expect("there"),
                false => fs::remove_file(at.join(out)).expect("there"),
            }
        }
    }
    // Script, turntable and layers; groups with the first two; baselines with these four and maps.
    assert_eq!(n_refused, 3 + 2 + 5);
}

#[test]
fn layers_and_frames_are_of_the_hair_at_the_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    moving_scene_in(at);
    fs::write(
        at.join("s.json"),
        r#"[{"frame": "a"}, {"time": 0}, {"frame": "b"}]"#,
    )
    .expect("written");
    let pixels = |file: &str| {
        let layer = strandlight_reference::compare::Layer::read(&at.join(file), None);
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

#[test]
fn a_frame_without_a_window_tells_what_it_took() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let output = strandview()
        .current_dir(folder.path())
        .args(["a.toml", "--frame", "v.png", "--size", "20x10"])
        .args(["--samples", "4"])
        .output()
        .expect("runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let milliseconds = |name: &str| -> f64 {
        let lines = said.lines().map(str::trim);
        let mut rests = lines.filter_map(|line| line.strip_prefix(name));
        let number = rests.find_map(|rest| rest.split_whitespace().next()?.parse().ok());
        number.unwrap_or_else(|| panic!("no {name}: {said}"))
    };
    let stages = ["shadow maps", "transmittance", "shade", "draw"].map(milliseconds);
    assert!(
        milliseconds("total") >= stages.iter().sum::<f64>() - 0.5,
        "{said}"
    );
    assert!(stages[2] > 0.0 && !said.contains("-0.0"), "{said}");
}

#[test]
fn stills_are_larger_than_what_a_device_draws_at_once() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let size = ["--size", "4096x2160", "--samples", "1"];
    let seen = |name: &str| {
        let bytes = fs::read(folder.path().join(name)).expect("written");
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info();
        let mut reader = reader.expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("of a size")];
        let frame = reader.next_frame(&mut pixels).expect("whole");
        assert_eq!([frame.width, frame.height], [4096, 2160]);
        pixels
    };
    for backend in ["gpu", "cpu"] {
        let args = ["render", "a.toml", "-o", &format!("{backend}.png")];
        assert_done(
            strandlight()
                .current_dir(folder.path())
                .args(args)
                .args(size)
                .args(["--backend", backend]),
        );
    }
    assert_done(
        strandview()
            .current_dir(folder.path())
            .args(["a.toml", "--frame", "v.png"])
            .args(size),
    );
    let [gpu, cpu, view] = ["gpu.png", "cpu.png", "v.png"].map(seen);
    let n_off = |a: &[u8], b: &[u8]| {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 2).count()
    };
    assert!(cpu.iter().any(|&level| level > 100));
    // A sample here and there where strands are equally deep.
    assert!(
        n_off(&gpu, &cpu) < cpu.len() / 10_000,
        "{}",
        n_off(&gpu, &cpu)
    );
    assert!(
        n_off(&view, &gpu) < cpu.len() / 10_000,
        "{}",
        n_off(&view, &gpu)
    );
}

#[test]
fn json_is_one_document() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let output = strandlight()
        .current_dir(folder.path())
        .args([
            "render",
            "a.toml",
            "-o",
            "a.png",
            "--size",
            "20x10",
            "--samples",
            "1",
        ])
        .args(["--backend", "cpu", "--json"])
        .output()
        .expect("runs");
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["size"], serde_json::json!([20, 10]));
    assert_eq!(report["samples"], 1);
    assert_eq!(report["lights"], 2);
    assert!(
        report["stages"]
            .as_array()
            .is_some_and(|stages| stages.len() == 6)
    );
}

#[test]
fn stats_tell_what_ran_and_what_was_skipped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let run = |more: &[&str]| {
        let args = ["render", "a.toml", "-o", "a.exr", "--size", "20x10"];
        let output = strandlight()
            .current_dir(folder.path())
            .args(args)
            .args(["--samples", "4", "--backend", "cpu"])
            .args(more)
            .output()
            .expect("runs");
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let picture = fs::read(folder.path().join("a.exr")).expect("written");
        (text, picture)
    };
    let (short, total) = run(&[]);
    assert!(short.contains("total scattering") && !short.contains("voxelise"));
    let (long, _) = run(&["--stats"]);
    for word in ["direct local", "global", "voxelise", "MB", "ms", "skipped"] {
        assert!(long.contains(word), "{word}: {long}");
    }
    let (single, alone) = run(&["--stats", "--scattering", "single"]);
    assert!(single.contains("averages of multiple scattering") && !single.contains("global"));
    assert!(alone != total);
    // The baselines shade on the CPU as well.
    let (_, ray) = run(&["--transmittance", "ray"]);
    assert!(ray != total);
}

#[test]
fn bad_usage_is_refused_in_one_line_with_nothing_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    fs::write(folder.path().join("key.toml"), "version = 1\ncolour = 3\n").expect("written");
    let scene = fs::read_to_string(folder.path().join("a.toml")).expect("read");
    fs::write(
        folder.path().join("lost.toml"),
        scene.replace("a.groom", "lost.groom"),
    )
    .expect("written");
    let cases: [(&[&str], &[&str]); 12] = [
        (
            &["a.toml", "-o", "a.png", "--scattering", "double"],
            &["double"],
        ),
        (
            &[
                "a.toml",
                "-o",
                "a.png",
                "--transmittance",
                "ray",
                "--backend",
                "gpu",
            ],
            &["ray", "--backend cpu"],
        ),
        (&["a.toml", "-o", "a.png", "--size", "0x0"], &["0x0"]),
        (
            &["a.toml", "-o", "a.png", "--size", "100000x100000"],
            &["100000x100000"],
        ),
        (
            &["a.toml", "-o", "a.png", "--size", "16384x16384"],
            &["16384x16384"],
        ),
        (&["a.toml", "-o", "a.png", "--size", "twelve"], &["twelve"]),
        (&["a.toml", "-o", "a.png", "--samples", "0"], &["0"]),
        (&["a.toml", "-o", "a.jpg"], &["a.jpg", ".png or .exr"]),
        (&["a.toml", "-o", "nowhere/a.png"], &["nowhere/a.png"]),
        (&["none.toml", "-o", "a.png"], &["none.toml"]),
        (&["key.toml", "-o", "a.png"], &["key.toml", "colour"]),
        (
            &["lost.toml", "-o", "a.png"],
            &["lost.toml: groom.file: lost.groom: "],
        ),
    ];
    let names = || fs::read_dir(folder.path()).expect("read").count();
    let before = names();
    for (args, needles) in cases {
        let mut command = strandlight();
        command.current_dir(folder.path()).arg("render").args(args);
        assert_refused(&mut command, needles);
        assert_eq!(names(), before, "{args:?} left something behind");
    }
    let mut command = strandview();
    command.current_dir(folder.path()).arg("a.toml");
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    assert_refused(&mut command, &["no display", "--frame"]);
}

#[test]
fn a_mode_is_drawn_from_its_own_table_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let bundled = project_root().join("data/default.tables");
    for (mode, names) in [
        (Mode::R, &["C"][..]),
        (Mode::Tt, &table_names(Lobe::Tt)),
        (Mode::Trt, &table_names(Lobe::Trt)),
    ] {
        let mut tables = TableFile::read(&bundled).expect("part of the project");
        tables.tables.retain(|found| names.contains(&&*found.name));
        tables.write(&at.join("one.tables")).expect("written");
        let mut scene = Scene::read(&at.join("a.toml")).expect("valid");
        scene.hair.modes = vec![mode];
        let mut write = |name: &str, file: Option<&str>| {
            scene.tables = file.map(|file| TablesSection { file: file.into() });
            let text = scene.to_toml_string().expect("valid");
            fs::write(at.join(name), text).expect("written");
        };
        write("whole.toml", None);
        write("one.toml", Some("one.tables"));
        for backend in ["gpu", "cpu"] {
            let picture = |name: &str| {
                let (scene, out) = (format!("{name}.toml"), format!("{name}.exr"));
                let args = [
                    "render",
                    &scene,
                    "-o",
                    &out,
                    "--size",
                    "60x40",
                    "--samples",
                    "8",
                ];
                assert_done(
                    strandlight()
                        .current_dir(at)
                        .args(args)
                        .args(["--backend", backend]),
                );
                // The files differ by the hashes of their inputs.
                let layer = strandlight_reference::compare::Layer::read(&at.join(out), None);
                layer.expect("readable").rgb
            };
            assert!(
                picture("whole") == picture("one"),
                "{names:?} on the {backend}"
            );
        }
    }
}
