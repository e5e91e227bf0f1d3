//! `strandlight lights`: what it writes, what it says, and that it always says the same.

use std::fs;
use std::io::{BufRead, BufReader, Cursor};
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Instant;

use exr::prelude::*;
use serde_json::{Value, json};
use strandlight_bake::lights::evaluate;
use strandlight_formats::{BakedFile, LightSet};
use strandlight_images::Map;
use strandlight_tests::samples::{exr_map, real_file};
use strandlight_tests::{assert_done, assert_refused, project_root, strandlight};

#[test]
fn writes_lights_report_and_preview() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = project_root().join("data/sample/studio.exr");
    let run = |out: &str, extra: &[&str]| {
        let output = strandlight()
            .current_dir(folder.path())
            .args(["lights".as_ref(), map.as_os_str()])
            .args(["-o", out, "--count", "12"])
            .args(extra)
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let said = run("a.lights", &["--report", "r.json", "--preview", "p.png"]);
    assert!(said.lines().last().is_some_and(|line| {
        line.contains("a.lights") && line.contains("format 1.1") && line.contains("12 lights")
    }));
    let json = run("b.lights", &["--json"]);

    let read = |name: &str| fs::read(folder.path().join(name)).expect("it was written");
    assert_eq!(read("a.lights"), read("b.lights"), "same input, same bytes");
    assert!(read("p.png").starts_with(b"\x89PNG"));
    let set = LightSet::from_bytes(&read("a.lights")).expect("a readable light set");
    assert_eq!(set.lights.len(), 12);

    let printed: serde_json::Value = serde_json::from_str(&json).expect("one JSON document");
    let written: serde_json::Value =
        serde_json::from_slice(&read("r.json")).expect("a JSON report");
    let fitted = Map::read(&map).expect("the sample map");
    let again = evaluate(&set, &fitted);
    for report in [&printed, &written] {
        assert_eq!(report["count"], 12);
        assert_eq!(report["rel_l2"], again.rel_l2);
        assert_eq!(report["irradiance_error"], again.irradiance_error);
        assert_eq!(report["fibre_error"], again.fibre_error);
        for c in 0..3 {
            let ratio = report["energy_ratio"][c].as_f64().expect("a number");
            assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
        }
    }
    assert_eq!(set.info.report, Some(again));
    // Times are no results: a report has none.
    assert!(printed["seconds"].is_number() && printed["stage_seconds"].is_object());
    assert!(written.get("seconds").is_none() && written.get("stage_seconds").is_none());
}

/// Places in an OpenEXR file that `exr_map` made in blocks of 16 lines: the byte that names the
/// compression, and the start of the first of two blocks (line, bytes of data, data).
fn places(bytes: &[u8]) -> (usize, usize) {
    let name = b"compression\0compression\0";
    let found = bytes.windows(name.len()).position(|it| it == name);
    // Four bytes of the value's size.
    let compression = found.expect("a compression") + name.len() + 4;
    let block = (16..bytes.len()).find(|&at| {
        let offset = bytes[at - 16..at - 8].try_into().expect("eight bytes");
        u64::from_le_bytes(offset) == at as u64
    });
    (
        compression,
        block.expect("a table of offsets before the first block"),
    )
}

#[test]
fn bad_maps_are_refused() {
    let good = exr_map(Compression::ZIP16, Blocks::ScanLines);
    let (compression, block) = places(&good);
    let changed = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.clone();
        change(&mut bytes);
        bytes
    };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut maps = Vec::new();
    for (name, bytes) in [
        ("magic.exr", changed(&|bytes| bytes[0] = 0)),
        (
            "compression.exr",
            changed(&|bytes| bytes[compression] = 200),
        ),
        // What was packed by ZIP is no PIZ.
        ("other.exr", changed(&|bytes| bytes[compression] = 4)),
        (
            "packed.exr",
            changed(&|bytes| bytes[block + 8..block + 24].fill(0xff)),
        ),
        (
            "negative.exr",
            changed(&|bytes| bytes[block + 4..block + 8].fill(0xff)),
        ),
        ("huge.exr", changed(&|bytes| bytes[block + 7] = 0x7f)),
        ("line.exr", changed(&|bytes| bytes[block + 1] = 0x10)),
        ("cut.exr", changed(&|bytes| bytes.truncate(block + 100))),
        ("header.exr", changed(&|bytes| bytes.truncate(compression))),
        ("empty.exr", Vec::new()),
    ] {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("writable");
        maps.push(path);
    }
    let real = ["comp_invalid_unknown.exr", "comp_short_decode_piz.exr"];
    maps.extend(
        real.iter()
            .filter_map(|name| real_file(&format!("env/bad/{name}"))),
    );
    assert!(maps.len() >= 10);
    let run = |map: &Path| {
        let mut command = strandlight();
        command.current_dir(folder.path()).arg("lights").arg(map);
        command.args(["-o", "out.lights", "--count", "1"]);
        command
    };
    for map in maps {
        let name = map
            .file_name()
            .and_then(|name| name.to_str())
            .expect("a name");
        assert_refused(&mut run(&map), &[name]);
        assert!(!folder.path().join("out.lights").exists(), "{name}");
    }
    // The same file without damage is taken.
    let map = folder.path().join("good.exr");
    fs::write(&map, &good).expect("writable");
    strandlight_tests::assert_done(&mut run(&map));
}

/// A part: its name, its data window as x, y, width, height, and channels with their radiance,
/// which grows a little from the top to the bottom.
type Part<'a> = (&'a str, [i32; 4], &'a [(&'a str, f32)]);

/// Writes a map of 64 x 32 pixels; the pixel at (x, y) = (20, 10) of the channels is `odd`.
fn write_map(path: &Path, parts: &[Part], odd: Option<f32>) {
    let layers: Vec<Layer<AnyChannels<FlatSamples>>> = parts
        .iter()
        .map(|(name, [x, y, width, height], channels)| {
            let size = Vec2(*width as usize, *height as usize);
            let list = channels
                .iter()
                .map(|(name, radiance)| {
                    let mut samples: Vec<f32> = (0..size.area())
                        .map(|ix| radiance * (1.0 + 0.01 * (ix / size.0) as f32))
                        .collect();
                    if let Some(odd) = odd {
                        samples[10 * size.0 + 20] = odd;
                    }
                    AnyChannel::new(*name, FlatSamples::F32(samples))
                })
                .collect();
            let attributes = LayerAttributes::named(*name).with_position(Vec2(*x, *y));
            let encoding = Encoding::FAST_LOSSLESS;
            Layer::new(size, attributes, encoding, AnyChannels::sort(list))
        })
        .collect();
    let attributes = ImageAttributes::with_size(Vec2(64, 32));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layers(attributes, layers)
        .write()
        .to_buffered(&mut bytes)
        .expect("the exr crate writes it");
    fs::write(path, bytes.into_inner()).expect("a writable folder");
}

const WHOLE: [i32; 4] = [0, 0, 64, 32];
const RGB: [(&str, f32); 3] = [("B", 0.6), ("G", 0.4), ("R", 0.2)];

/// Runs `strandlight lights map.exr -o OUT --count 4 ARGS` in `folder`.
fn lights(folder: &Path, out: &str, args: &[&str]) -> Output {
    let output = strandlight()
        .current_dir(folder)
        .args(["lights", "map.exr", "-o", out, "--count", "4"])
        .args(args)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{output:?}");
    output
}

fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).expect("one JSON document")
}

fn set_in(folder: &Path, name: &str) -> LightSet {
    LightSet::read(&folder.join(name)).expect("a light set")
}

fn verifies(folder: &Path, name: &str) {
    let output = strandlight()
        .current_dir(folder)
        // A few lights cannot follow the edge of a map that is black in one half.
        .args(["verify", name, "--map", "map.exr", "--max-error", "50%"])
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{name}: {output:?}");
}

#[test]
fn parts_and_layers_are_named_chosen_and_recorded() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let beauty = [
        RGB.as_slice(),
        &[("sky.B", 3.0), ("sky.G", 2.0), ("sky.R", 1.0)],
    ]
    .concat();
    let parts: [Part; 2] = [("beauty", WHOLE, &beauty), ("lamps", WHOLE, &[("Y", 7.0)])];
    write_map(&at.join("map.exr"), &parts, None);

    let said = lights(at, "default.lights", &[]);
    let stderr = String::from_utf8_lossy(&said.stderr);
    for needle in [
        "map.exr",
        "part 0 \"beauty\", plain channels",
        "layer \"sky\"",
        "part 1 \"lamps\"",
        "--part",
    ] {
        assert!(stderr.contains(needle), "{needle}: {stderr}");
    }
    let mut chosen = 0;
    for (name, args, part, layer, blue) in [
        ("default.lights", [].as_slice(), 0, "", 0.6),
        ("sky.lights", &["--layer", "sky"], 0, "sky", 3.0),
        ("plain.lights", &["--part=beauty", "--layer="], 0, "", 0.6),
        ("lamps.lights", &["--part", "1"], 1, "", 7.0),
    ] {
        let output = lights(at, name, &[args, &["--json"]].concat());
        let image = &document(&output)["map"]["image"];
        assert_eq!(
            (&image["part"], &image["layer"]),
            (&json!(part), &json!(layer))
        );
        let set = set_in(at, name);
        let recorded = |key: &str| {
            let found = set.info.parameters.iter().find(|(name, _)| name == key);
            found.map(|(_, value)| value.clone())
        };
        assert_eq!(recorded("map_part"), Some(part.to_string()), "{name}");
        assert_eq!(recorded("map_layer").as_deref(), Some(layer), "{name}");
        // The mean radiance of blue.
        let energy: f64 = set
            .lights
            .iter()
            .map(|light| {
                let sharpness = 2.0 / f64::from(light.lambda).powi(2);
                let solid_angle = (1.0 - (-2.0 * sharpness).exp()) / (2.0 * sharpness);
                f64::from(light.rgb[2]) * solid_angle
            })
            .sum();
        let mean = energy / (1.155 * blue);
        assert!((mean - 1.0).abs() < 0.01, "{name}: {mean}");
        verifies(at, name);
        chosen += 1;
    }
    assert_eq!(chosen, 4);
    for (flag, value) in [("--layer", "stars"), ("--part", "stars"), ("--part", "2")] {
        let mut command = strandlight();
        command
            .current_dir(at)
            .args(["lights", "map.exr", "-o", "out.lights", flag, value]);
        assert_refused(&mut command, &["map.exr", value, "beauty", "lamps"]);
    }
    assert!(!at.join("out.lights").exists());
}

#[test]
fn a_cropped_map_is_said_and_recorded() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    // The upper half, and two rows above the sphere.
    write_map(
        &at.join("map.exr"),
        &[("main", [0, -2, 64, 18], &RGB)],
        None,
    );
    let output = lights(at, "crop.lights", &["--json"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    for needle in [
        "map.exr",
        "1024 pixels outside it are black",
        "128 pixels outside",
    ] {
        assert!(stderr.contains(needle), "{needle}: {stderr}");
    }
    let windows = &document(&output)["map"]["windows"];
    assert_eq!(windows["black_pixels"], 1024);
    assert_eq!(windows["dropped_pixels"], 128);
    assert_eq!(
        windows["data"],
        json!({ "position": [0, -2], "size": [64, 18] })
    );
    assert_eq!(
        windows["display"],
        json!({ "position": [0, 0], "size": [64, 32] })
    );
    let set = set_in(at, "crop.lights");
    assert_eq!(set.info.map_size, [64, 32]);
    let window = (
        "map_data_window".to_owned(),
        "64 x 18 at (0, -2)".to_owned(),
    );
    assert!(
        set.info.parameters.contains(&window),
        "{:?}",
        set.info.parameters
    );
    // Light comes from above.
    assert!(set.lights[0].direction[1] > 0.3, "{:?}", set.lights);
    verifies(at, "crop.lights");
}

#[test]
fn infinite_pixels_are_replaced_by_what_the_map_has() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write_map(
        &at.join("map.exr"),
        &[("main", WHOLE, &RGB)],
        Some(f32::INFINITY),
    );
    let output = lights(at, "a.lights", &["--json"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("1 infinite (taken as"), "{stderr}");
    let clamped = &document(&output)["map"]["clamped_pixels"];
    assert_eq!(clamped["infinite"], 1);
    let largest = clamped["infinite_as"][2].as_f64().expect("a number");
    assert!((largest - 0.6 * 1.31).abs() < 1e-6, "{largest}");
    let set = set_in(at, "a.lights");
    let brightest = set.lights.iter().flat_map(|light| light.rgb);
    assert!(brightest.fold(0.0, f32::max) < 1.0, "{:?}", set.lights);
    verifies(at, "a.lights");
}

#[test]
fn without_a_report_nothing_is_measured() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write_map(&at.join("map.exr"), &[("main", WHOLE, &RGB)], None);
    lights(at, "measured.lights", &[]);
    let output = lights(at, "plain.lights", &["--no-report", "--json"]);
    let document = document(&output);
    for key in ["rel_l2", "energy_ratio", "irradiance_error", "fibre_error"] {
        assert_eq!(document[key], Value::Null, "{key}");
    }
    assert!(document["stage_seconds"].get("report").is_none());
    assert_eq!(document["count"], 4);
    let (measured, plain) = (set_in(at, "measured.lights"), set_in(at, "plain.lights"));
    assert!(measured.info.report.is_some());
    assert_eq!(plain.info.report, None);
    assert_eq!(plain.lights, measured.lights);
    verifies(at, "plain.lights");
    let mut both = strandlight();
    both.current_dir(at)
        .args(["lights", "map.exr", "-o", "both.lights"])
        .args(["--no-report", "--report", "r.json"]);
    assert_refused(&mut both, &["--no-report", "--report"]);
}

/// What is 100 % done is done: the files are there. (Work of less than a second says nothing.)
#[test]
fn progress_ends_when_the_files_are_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write_map(&at.join("map.exr"), &[("main", WHOLE, &RGB)], Some(40.0));
    let start = Instant::now();
    let mut child = strandlight()
        .current_dir(at)
        .args(["lights", "map.exr", "-o", "a.lights", "--count", "96"])
        .args(["--report", "r.json", "--preview", "p.png"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs");
    let stderr = BufReader::new(child.stderr.take().expect("piped"));
    let mut ended = false;
    for line in stderr.lines().map_while(std::io::Result::ok) {
        if line.contains("100%") {
            ended = true;
            for name in ["a.lights", "r.json", "p.png"] {
                assert!(at.join(name).exists(), "{name} is not there at 100 %");
            }
        }
    }
    assert!(child.wait().expect("it ends").success());
    // Half of it for starting the program, at the most.
    assert!(ended || start.elapsed().as_secs_f64() < 2.0, "no last line");
}

/// A set goes out and comes back; the map of an export says that it is one.
#[test]
fn exported_lights_come_back() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let done = |line: &str| {
        let output = strandlight()
            .current_dir(at)
            .args(line.split_whitespace())
            .output()
            .expect("it runs");
        assert!(output.status.success(), "{line}: {output:?}");
    };
    let map = project_root().join("data/sample/studio.exr");
    fs::copy(map, at.join("studio.exr")).expect("copied");
    done("lights studio.exr --count 6 --no-report -o a.lights");
    for name in ["a.json", "a.npy", "a.h", "a.exr --width 64"] {
        done(&format!("export a.lights -o {name}"));
    }
    let lights = |name: &str| LightSet::read(&at.join(name)).expect("a light set").lights;
    done("lights import a.json -o json.lights");
    assert_eq!(lights("json.lights"), lights("a.lights"));
    // A sharpness in single precision gives lambda but for its last digit.
    done("lights import a.npy -o npy.lights");
    for (found, wanted) in lights("npy.lights").iter().zip(lights("a.lights")) {
        assert!((found.lambda / wanted.lambda - 1.0).abs() < 1e-6);
        assert_eq!(found.rgb, wanted.rgb);
        for axis in 0..3 {
            assert!((found.direction[axis] - wanted.direction[axis]).abs() < 1e-7);
        }
    }
    let header = fs::read_to_string(at.join("a.h")).expect("text");
    assert!(
        header.contains("#define STRANDLIGHT_N_LIGHTS 6"),
        "{header}"
    );
    let exr = fs::read(at.join("a.exr")).expect("a file");
    let meta = MetaData::read_from_buffered(Cursor::new(exr), false).expect("OpenEXR");
    assert!(meta.headers[0].own_attributes.environment_map.is_some());
    // Made by hand: any length of a direction, either width.
    fs::write(
        at.join("own.json"),
        r#"{"lights": [{"direction": [0, 3, 0], "sharpness": 8, "rgb": [1, 2, 3]}]}"#,
    )
    .expect("written");
    done("lights import own.json -o own.lights");
    let own = lights("own.lights")[0];
    assert_eq!((own.direction, own.lambda), ([0.0, 1.0, 0.0], 0.5));
    // Both widths, each rounded.
    fs::write(
        at.join("own.json"),
        r#"{"lights": [{"direction": [0, 1, 0], "lambda": 0.30001, "sharpness": 22.222, "rgb": [1, 2, 3]}],
            "parameters": ["of another program"]}"#,
    )
    .expect("written");
    done("lights import own.json -o own.lights");
    assert_eq!(lights("own.lights")[0].lambda, 0.30001);
}

#[test]
fn imported_lights_are_by_falling_energy() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let light = |amplitude: u8| {
        format!(r#"{{"direction": [0, 1, 0], "lambda": 0.3, "rgb": [{amplitude}, 0, 0]}}"#)
    };
    let import = |amplitudes: [u8; 3]| {
        let lights = amplitudes.map(light).join(", ");
        fs::write(at.join("a.json"), format!(r#"{{"lights": [{lights}]}}"#)).expect("written");
        let args = ["lights", "import", "a.json", "-o", "a.lights"];
        let output = strandlight().current_dir(at).args(args).output();
        let output = output.expect("it runs");
        assert!(output.status.success(), "{output:?}");
        assert_done(strandlight().current_dir(at).args(["verify", "a.lights"]));
        let lights = LightSet::read(&at.join("a.lights")).expect("a light set");
        let notes = String::from_utf8(output.stderr).expect("UTF-8");
        (lights.lights.into_iter().map(|it| it.rgb[0]), notes)
    };
    let (amplitudes, notes) = import([2, 3, 1]);
    assert!(amplitudes.eq([3.0, 2.0, 1.0]));
    let sorted = "a.json: the lights are sorted by falling energy";
    assert!(notes.contains(sorted), "{notes}");
    let (amplitudes, notes) = import([3, 2, 2]);
    assert!(amplitudes.eq([3.0, 2.0, 2.0]));
    assert!(!notes.contains("sorted"), "{notes}");
}

#[test]
fn lights_that_are_none_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let light = |fields: &str| format!(r#"{{"lights": [{{{fields}, "rgb": [1, 1, 1]}}]}}"#);
    for (text, needle) in [
        (
            light(r#""direction": [0, 1, 0]"#),
            "neither lambda nor sharpness",
        ),
        (
            light(r#""direction": [0, 0, 0], "lambda": 1"#),
            "light 0: its direction",
        ),
        (
            light(r#""direction": [0, 1, 0], "sharpness": -1"#),
            "sharpness is -1",
        ),
        (light(r#""direction": [0, 1, 0], "lambda": 100"#), "lambda"),
        (light(r#""direction": [0, 1], "lambda": 1"#), "line 1"),
        (
            light(r#""direction": [0, 1, 0], "lambda": 0.5, "sharpness": 9"#),
            "light 0: its lambda 0.5 and its sharpness 9 disagree",
        ),
        (
            light(r#""direction": [0, 1, 0], "lambda": 1e39"#),
            "light 0: its lambda is 1e39",
        ),
        // Lights are named by the order of the file: that of energy is another.
        (
            r#"{"lights": [{"direction": [0, 1, 0], "lambda": 1, "rgb": [1, 1, 1]},
                {"direction": [0, 1, 0], "lambda": 11, "rgb": [2, 2, 2]}]}"#
                .to_owned(),
            "lights[1].lambda is 11",
        ),
        (r#"{"lights": []}"#.to_owned(), "number of lights is 0"),
        ("hello".to_owned(), "neither a NumPy array nor JSON"),
        ("\u{93}NUMPY".to_owned(), "neither a NumPy array nor JSON"),
    ] {
        fs::write(at.join("in"), &text).expect("written");
        let args = ["lights", "import", "in", "-o", "out.lights"];
        assert_refused(strandlight().current_dir(at).args(args), &[needle]);
        assert!(!at.join("out.lights").exists(), "{text}");
    }
}
