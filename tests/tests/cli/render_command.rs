//! `strandlight render` and `strandview --frame` from the outside, and what they refuse.

use std::fs;
use std::path::Path;

use strandlight_formats::BakedFile;
use strandlight_formats::{Lobe, Scene, TableFile, TablesSection};
use strandlight_scattering::lobes::table_names;
use strandlight_tests::render_common::context;
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, project_root, strandlight, strandview};

/// A small scene on disk.
pub fn scene_in(folder: &Path) {
    let groom = curtain(40, 6, 0.1, 0.0);
    write_small_scene(folder, &groom, key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.05);
    });
}

#[test]
fn gpu_every_backend_and_format_writes_the_picture() {
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
    // A software adapter draws no faster than the CPU.
    let expected = match context().is_software() {
        true => "cpu.png",
        false => "gpu.png",
    };
    let is_same = png("auto.png") == png(expected);
    assert!(is_same, "auto takes {expected}, and repeats itself");
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
            "--backend",
            "gpu",
        ])
        .output()
        .expect("runs");
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("60x40, 5 samples"), "{text}");
    assert_eq!(png("v.png"), png("gpu.png"));
}

/// Without a driver too: `auto` needs none.
#[test]
fn frames_of_the_viewer_on_the_cpu_are_those_of_render() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let pixels = |name: &str| {
        let bytes = fs::read(at.join(name)).expect("written");
        let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info();
        let mut reader = reader.expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("of a size")];
        reader.next_frame(&mut pixels).expect("whole");
        pixels
    };
    let size = ["--size", "60x40"];
    let render = ["render", "a.toml", "-o", "c.png", "--backend", "cpu"];
    assert_done(strandlight().current_dir(at).args(render).args(size));
    let drawn = pixels("c.png");
    for (name, backend) in [("v.png", "cpu"), ("w.png", "auto")] {
        let mut view = strandview();
        view.current_dir(at).args(["a.toml", "--frame", name]);
        view.args(size).args(["--backend", backend]);
        view.envs(["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].map(|key| (key, "/nowhere")));
        let said = assert_done(&mut view);
        assert!(said.contains("60x40, visibility list"), "{said}");
        // What it took is told to who asks.
        for (more, told) in [(&[][..], false), (&["--stats"], true)] {
            let output = view.args(more).output().expect("runs");
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(said.contains("voxelise"), told, "{said}");
        }
        assert!(pixels(name) == drawn, "{backend}");
    }
    let mut view = strandview();
    view.current_dir(at).args(["a.toml", "--frame", "x.png"]);
    assert_refused(view.args(["--backend", "cpus"]), &["auto, gpu or cpu"]);
}

#[test]
fn gpu_a_frame_without_a_window_tells_what_it_took() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    scene_in(folder.path());
    let output = strandview()
        .current_dir(folder.path())
        .args(["a.toml", "--frame", "v.png", "--size", "20x10"])
        .args(["--samples", "4", "--backend", "gpu", "--stats"])
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
fn gpu_stills_are_larger_than_what_a_device_draws_at_once() {
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
            .args(["a.toml", "--frame", "v.png", "--backend", "gpu"])
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
fn gpu_a_mode_is_drawn_from_its_own_table_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    scene_in(at);
    let bundled = project_root().join("data/default.tables");
    for (mode, names) in [
        (Lobe::R, &["C"][..]),
        (Lobe::Tt, &table_names(Lobe::Tt)),
        (Lobe::Trt, &table_names(Lobe::Trt)),
    ] {
        let mut tables = TableFile::read(&bundled).expect("part of the project");
        tables.tables.retain(|found| names.contains(&&*found.name));
        tables.write(&at.join("one.tables")).expect("written");
        let mut scene = Scene::read(at.join("a.toml")).expect("valid");
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
