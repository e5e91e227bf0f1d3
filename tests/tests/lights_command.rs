//! `strandlight lights`: what it writes, what it says, and that it always says the same.

use std::fs;
use std::path::Path;

use exr::prelude::{Blocks, Compression};
use strandlight_bake::lights::{Map, evaluate};
use strandlight_formats::LightSet;
use strandlight_tests::samples::{exr_map, real_file};
use strandlight_tests::{project_root, strandlight};

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
        line.contains("a.lights") && line.contains("format 1.0") && line.contains("12 lights")
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
        assert!(report["seconds"].is_number());
        assert_eq!(report["rel_l2"], again.rel_l2);
        assert_eq!(report["irradiance_error"], again.irradiance_error);
        assert_eq!(report["fibre_error"], again.fibre_error);
        for c in 0..3 {
            let ratio = report["energy_ratio"][c].as_f64().expect("a number");
            assert!((ratio - 1.0).abs() < 0.005, "{ratio}");
        }
    }
    assert_eq!(set.info.report, Some(again));
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
        strandlight_tests::assert_refused(&mut run(&map), &[name]);
        assert!(!folder.path().join("out.lights").exists(), "{name}");
    }
    // The same file without damage is taken.
    let map = folder.path().join("good.exr");
    fs::write(&map, &good).expect("writable");
    strandlight_tests::assert_done(&mut run(&map));
}
