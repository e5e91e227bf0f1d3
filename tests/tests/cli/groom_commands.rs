//! `strandlight groom` from the outside: conversions by the table of formats, checks and edits.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use strandlight_formats::{
    Attribute, BakedFile, Domain, ExportOptions, GROOM_FORMATS, Groom, GroomFormat, Scene,
    groom_format,
};
use strandlight_tests::samples::hair_file;
use strandlight_tests::{assert_refused, strandlight};

/// Runs `strandlight LINE` in `folder`.
fn ran(folder: &Path, line: &str) -> Output {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split_whitespace());
    command.output().expect("it starts")
}

/// Runs `strandlight LINE`, which must do it, and answers its stdout and stderr.
fn done(folder: &Path, line: &str) -> (String, String) {
    let output = ran(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{line}: {stderr}");
    (String::from_utf8_lossy(&output.stdout).into_owned(), stderr)
}

fn json(folder: &Path, line: &str) -> Value {
    let (stdout, _) = done(folder, &format!("{line} --json"));
    serde_json::from_str(&stdout).expect("one JSON document")
}

fn refused(folder: &Path, line: &str, needles: &[&str]) {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split_whitespace());
    assert_refused(&mut command, needles);
}

/// Hair of a bob, 60 strands of 16 points, as `a.groom`.
fn bob(folder: &Path) -> Groom {
    done(
        folder,
        "groom generate --style bob --strands 60 --points-per-strand 16 -o a.groom",
    );
    Groom::read(&folder.join("a.groom")).expect("a groom")
}

fn per_strand(name: &str, components: u32, data: Vec<f32>) -> Attribute {
    Attribute {
        name: name.to_owned(),
        domain: Domain::Strand,
        components,
        data,
    }
}

/// Largest distance of a coordinate of two grooms of the same strands, cm.
fn distance(a: &Groom, b: &Groom) -> f32 {
    assert_eq!(a.n_strands(), b.n_strands());
    assert_eq!(a.points.len(), b.points.len());
    let pairs = a.points.iter().flatten().zip(b.points.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn written() -> impl Iterator<Item = &'static dyn GroomFormat> {
    GROOM_FORMATS
        .into_iter()
        .filter(|format| format.info().can.writes)
}

#[test]
fn every_format_goes_out_and_comes_in_by_the_same_commands() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let groom = bob(at);
    let mut n_back = 0;
    for format in written() {
        let info = format.info();
        let (name, end) = (info.name, info.extensions[0]);
        // By the ending, in the format's own unit and axis; by --format, in others.
        let (_, notes) = done(at, &format!("groom convert a.groom -o {name}.{end}"));
        assert!(notes.contains("kept: points"), "{name}: {notes}");
        done(
            at,
            &format!(
                "groom convert a.groom -o {name}.other --format {name} --to-unit in --to-up z"
            ),
        );
        done(at, &format!("export a.groom -o top.{end} --unit mm --up z"));
        done(
            at,
            &format!("groom export a.groom -o sub.{end} --unit mm --up z"),
        );
        let [top, sub] = ["top", "sub"].map(|name| fs::read(at.join(format!("{name}.{end}"))));
        assert_eq!(top.expect("written"), sub.expect("written"), "{name}");
        // Encodings that are read alone.
        for other in &info.extensions[1..] {
            let line = format!("groom convert a.groom -o x.{other}");
            refused(at, &line, &[&format!("x.{other}"), &format!("as .{end}")]);
        }
        if !info.can.reads {
            continue;
        }
        for (line, flags) in [
            (format!("groom import {name}.{end}"), ""),
            (format!("groom convert {name}.other"), " --unit in --up z"),
            (format!("groom convert top.{end}"), " --unit mm --up z"),
        ] {
            let (_, notes) = done(at, &format!("{line} -o b.groom{flags}"));
            let by = match (flags, notes.contains("the file says so")) {
                ("", true) => "the file says so",
                ("", false) => "by convention of the format",
                _ => "--unit",
            };
            assert!(notes.contains(&format!("({by})")), "{name}: {notes}");
            assert!(notes.contains("; dropped: "), "{name}: {notes}");
            let back = Groom::read(&at.join("b.groom")).expect("a groom");
            assert_eq!(
                back.source.original.as_ref().map(|it| &*it.format),
                Some(name)
            );
            let far = distance(&groom, &back);
            assert!(far < 2e-3, "{line}: {far} cm");
            n_back += 1;
        }
    }
    assert!(n_back >= 6, "{n_back}");
    // A stream has no ending: a .groom from convert.
    let output = ran(at, "groom convert usc.data -o -");
    assert!(output.status.success());
    assert!(Groom::from_bytes(&output.stdout).is_ok());
}

#[test]
fn programs_get_what_they_expect() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut groom = bob(at);
    // Without widths, which all of these programs would make up.
    groom.attributes.clear();
    groom.write(&at.join("bare.groom")).expect("written");
    let mut n_written = 0;
    for (to, name, unit, up) in [
        ("unreal", "alembic", 1.0, "y"),
        ("blender", "usd", 100.0, "z"),
        ("unity", "alembic", 1.0, "y"),
        ("usd", "usd", 1.0, "y"),
        ("mitsuba", "mitsuba", 1.0, "y"),
        ("pbrt", "pbrt", 1.0, "y"),
    ] {
        refused(
            at,
            &format!("groom export bare.groom -o x.hair --to {to}"),
            &[&format!("--to {to}")],
        );
        assert!(!at.join("x.hair").exists());
        let Some(info) = groom_format(name).map(GroomFormat::info) else {
            continue;
        };
        let end = info.extensions[0];
        let (_, notes) = done(at, &format!("export bare.groom -o {to}.{end} --to {to}"));
        assert!(notes.contains("no widths; 0.008 cm is written"), "{notes}");
        n_written += 1;
        if info.can.reads {
            let line = format!("groom import {to}.{end} --unit {unit} --up {up} -o b.groom");
            done(at, &line);
            let back = Groom::read(&at.join("b.groom")).expect("a groom");
            let far = distance(&groom, &back);
            assert!(far < 2e-3, "{to}: {far} cm");
            let width = back.diameter_range().median;
            assert!((width - 0.008).abs() < 1e-5, "{to}: {width}");
        }
    }
    let is_complete = groom_format("alembic").is_some() && groom_format("usd").is_some();
    assert!(!is_complete || n_written == 6, "{n_written}");
    refused(
        at,
        "groom export bare.groom -o x.abc --to maya",
        &["maya", "unreal", "pbrt"],
    );
    let lights = "export bare.groom -o x.groom";
    refused(at, lights, &["x.groom", "a .groom already"]);
}

#[test]
fn frames_become_grooms_and_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let first = bob(at);
    for frame in 0..3u8 {
        let mut groom = first.clone();
        for point in &mut groom.points {
            point[0] += f32::from(frame);
        }
        let name = format!("in.{frame}.groom");
        groom.write(&at.join(name)).expect("written");
    }
    let mut n_checked = 0;
    for format in written() {
        let info = format.info();
        let (name, end) = (info.name, info.extensions[0]);
        let line =
            format!("groom export in.0.groom in.1.groom in.2.groom -o {name}.{end} --fps 12");
        if !info.can.frames {
            refused(at, &line, &[name, "does not move"]);
            continue;
        }
        let (said, _) = done(at, &line);
        assert!(said.contains("3 frames at 12 a second"), "{said}");
        if !info.can.reads {
            continue;
        }
        let line = format!("groom import {name}.{end} --frames 0..2 -o {name}.%02d.groom");
        let (said, _) = done(at, &line);
        let motion = said.split_once("[motion]").expect("a section").1;
        let files = "version = 1\n[groom]\nfile = 'a'\n[lights]\nfile = 'b'\n";
        let scene = Scene::from_toml(&format!("{files}[motion]{motion}")).expect("a scene");
        let motion = scene.motion.expect("it moves");
        assert_eq!(motion.fps, Some(12.0));
        for (frame, file) in (0u8..).zip(&motion.frames) {
            assert_eq!(file.to_str(), Some(&*format!("{name}.{frame:02}.groom")));
            let back = Groom::read(&at.join(file)).expect("a groom");
            let input = Groom::read(&at.join(format!("in.{frame}.groom"))).expect("a groom");
            assert!(distance(&back, &input) < 2e-3, "{name}: frame {frame}");
        }
        // Scenes play grooms alone.
        let line = format!("groom convert {name}.{end} --frames 0..1 -o {name}.%d.hair");
        let (said, _) = done(at, &line);
        assert!(!said.contains("[motion]"), "{said}");
        // One frame, and from one file that moves to another.
        let (_, notes) = done(
            at,
            &format!("groom import {name}.{end} -o one.groom --frame 1"),
        );
        assert!(notes.contains("frame 1 of 3 is taken"), "{notes}");
        let one = Groom::read(&at.join("one.groom")).expect("a groom");
        assert!((one.points[0][0] - first.points[0][0] - 1.0).abs() < 2e-3);
        done(
            at,
            &format!("groom convert {name}.{end} --frames 1.. -o part.{end}"),
        );
        let (_, notes) = done(at, &format!("groom import part.{end} -o one.groom"));
        assert!(notes.contains("frame 0 of 2"), "{notes}");
        let line = format!("groom import {name}.{end} --frames 1..3 -o x.%d.groom");
        refused(at, &line, &["not 1..3", "0..2"]);
        let line = format!("groom import {name}.{end} --frames 0..1 -o x.groom");
        refused(at, &line, &["x.groom", "%04d"]);
        n_checked += 1;
    }
    let expected = usize::from(groom_format("alembic").is_some());
    assert!(n_checked >= expected, "{n_checked}");
    // Hair that does not move.
    let line = "groom export a.groom -o x.hair --fps 24";
    refused(at, line, &["x.hair", "--fps is for files that move"]);
    refused(
        at,
        "groom export a.groom -o x.abc --fps nan",
        &["--fps", "nan"],
    );
    done(at, "groom convert a.groom -o a.hair");
    let frame = "groom import a.hair -o x.groom --frame 1";
    refused(at, frame, &["a.hair", "does not move"]);
    done(at, "groom import a.hair -o y.%d.groom --frames 0..0");
    assert!(at.join("y.0.groom").exists());
    for (range, needle) in [("2..1", "A..B"), ("x", "A..B")] {
        let line = format!("groom import a.hair -o x.%d.groom --frames {range}");
        refused(at, &line, &["--frames", needle]);
    }
}

#[test]
fn check_finds_faults_and_says_which_strand() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    done(
        at,
        "groom generate --style wavy --strands 3000 --points-per-strand 8 -o good.groom",
    );
    let good = Groom::read(&at.join("good.groom")).expect("a groom");
    let found = json(at, "groom check good.groom");
    assert_eq!(found["passed"], true);
    assert_eq!(found["findings"], serde_json::json!([]));
    assert_eq!(found["notes"], serde_json::json!([]));
    assert_eq!(
        (&found["strands"], &found["points"]),
        (&3000.into(), &24_000.into())
    );

    let mut bad = good.clone();
    bad.attributes = vec![
        per_strand("guide", 1, vec![1.0; 3000]),
        per_strand("root_uv", 2, vec![0.5; 6000]),
    ];
    let range = bad.strand(7);
    let root = bad.points[range.start];
    bad.points[range].fill(root);
    bad.write(&at.join("bad.groom")).expect("written");
    let output = ran(at, "groom check bad.groom --json");
    assert_eq!(output.status.code(), Some(1));
    let found: Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
    assert_eq!(found["passed"], false);
    let findings = found["findings"].as_array().expect("a list");
    let codes: Vec<_> = findings
        .iter()
        .map(|found| (found["code"].as_str(), found["count"].as_u64()))
        .collect();
    assert_eq!(
        codes,
        [
            (Some("guides-only"), Some(3000)),
            (Some("no-width"), Some(3000)),
            (Some("degenerate"), Some(1)),
            (Some("root-uv-equal"), Some(3000)),
        ]
    );
    assert_eq!(findings[2]["first_strand"], 7);
    let output = ran(at, "groom check bad.groom");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    for needle in [
        ", PROBLEMS\n",
        "3000 curves, all guides",
        "first: strand 7",
        "interpolate",
    ] {
        assert!(said.contains(needle), "{said}");
    }
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(
        stderr,
        "strandlight: bad.groom: check failed: guides-only, no-width, degenerate, root-uv-equal\n"
    );

    // What the reader refuses is a finding too: NaN in strand 1, and a file cut short.
    let hair = hair_file(3, 4);
    let mut nan = hair.clone();
    let point = 128 + 12 * 5;
    nan[point..point + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(at.join("nan.hair"), nan).expect("written");
    fs::write(at.join("cut.hair"), &hair[..hair.len() - 5]).expect("written");
    for (name, code, strand) in [
        ("nan.hair", "bad-value", Value::from(1)),
        ("cut.hair", "damaged", Value::Null),
    ] {
        let output = ran(at, &format!("groom check {name} --json"));
        assert_eq!(output.status.code(), Some(1), "{name}");
        let found: Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
        assert_eq!(found["findings"][0]["code"], code, "{found}");
        assert_eq!(found["findings"][0]["first_strand"], strand, "{found}");
        // The file is named once, before.
        assert!(!found["findings"][0]["message"].to_string().contains(name));
    }
    // What import doubts is a note, and no fault.
    fs::write(at.join("lash.hair"), hair_file(3, 4)).expect("written");
    let imported = ran(at, "groom import lash.hair -o lash.groom --unit mm");
    let said = String::from_utf8_lossy(&imported.stderr).into_owned();
    let doubt = said.lines().find(|line| line.contains("cm large"));
    let doubt = doubt.expect("it is small");
    let found = json(at, "groom check lash.groom");
    assert_eq!(found["notes"], serde_json::json!([doubt]), "{found}");
    assert_eq!(found["findings"], serde_json::json!([]));
    let (said, _) = done(at, "groom check lash.groom");
    assert!(said.contains(&format!("ok\n  note: {doubt}")), "{said}");
    fs::write(at.join("text.txt"), "no hair").expect("written");
    refused(
        at,
        "groom check text.txt",
        &["text.txt", "not a file of hair"],
    );
    refused(at, "groom check not-there", &["not-there"]);
}

#[test]
fn a_name_promises_no_other_format() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    done(at, "groom generate --style bob --strands 5 -o a.groom");
    for line in [
        "groom convert a.groom -o b.groom --format usd",
        "groom convert a.groom -o b.abc --format usd",
        "export a.groom -o b.groom --format hair",
    ] {
        refused(at, line, &["is written as"]);
    }
    done(at, "groom convert a.groom -o b.other --format usd");
    for line in [
        "groom generate --style bob --strands 5 -o b.usda",
        "groom import b.other -o b.abc",
        "groom import b.other --frames 0..0 -o b.%04d.usda",
    ] {
        refused(at, line, &["a .groom is written"]);
    }
    done(at, "groom import b.other --prim / -o b.groom");
    done(at, "groom convert a.groom -o a.hair");
    refused(
        at,
        "groom import a.hair --prim / -o b.groom",
        &["a.hair", "--prim", "no named objects"],
    );
}

#[test]
fn stats_are_measured() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut groom = Groom {
        points: vec![
            [0.0; 3],
            [3.0, 0.0, 0.0],
            [3.0, 4.0, 0.0],
            [1.0; 3],
            [1.0, 1.0, 3.0],
        ],
        strand_offsets: vec![0, 3, 5],
        ..Groom::default()
    };
    groom.attributes = vec![per_strand("group_id", 1, vec![4.0, 9.0])];
    groom.write(&at.join("a.groom")).expect("written");
    let stats = json(at, "groom stats a.groom");
    assert_eq!(
        (&stats["strands"], &stats["points"]),
        (&2.into(), &5.into())
    );
    assert_eq!(
        stats["length_cm"],
        serde_json::json!({"min": 2.0, "median": 7.0, "max": 7.0})
    );
    let turning = stats["turning_deg"]["max"].as_f64().expect("a number");
    assert!((turning - 90.0).abs() < 1e-4, "{turning}");
    assert_eq!(
        stats["groups"][1],
        serde_json::json!({"id": 9, "strands": 1})
    );
    assert_eq!(stats["attributes"][0]["max"], serde_json::json!([9.0]));
    assert_eq!(stats["bounds"]["max"], serde_json::json!([3.0, 4.0, 3.0]));
    let (text, _) = done(at, "groom stats a.groom");
    for needle in [
        "2 strands, 5 points",
        "length: 2 to 7 cm",
        "group 4: 1 strand\n",
    ] {
        assert!(text.contains(needle), "{text}");
    }
}

#[test]
fn edits_do_what_they_say_and_the_same_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let groom = bob(at);
    let coverage = |file: &str| {
        let stats = json(at, &format!("groom stats {file}"));
        stats["coverage_cm2"].as_f64().expect("a number")
    };
    let twice = |line: &str, output: &str| {
        done(at, &format!("{line} -o {output}"));
        let once = fs::read(at.join(output)).expect("written");
        done(at, &format!("{line} -o {output}"));
        assert!(
            fs::read(at.join(output)).expect("written") == once,
            "{line}"
        );
        Groom::read(&at.join(output)).expect("a groom")
    };
    let thin = twice("groom thin a.groom --strands 20 --seed 3", "thin.groom");
    assert_eq!(thin.n_strands(), 20);
    let ratio = coverage("thin.groom") / coverage("a.groom");
    assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");

    let even = twice("groom resample a.groom --points 5", "even.groom");
    assert_eq!(even.points.len(), 300);
    let few = twice("groom resample a.groom --max-error 0.2", "few.groom");
    assert!(few.points.len() < groom.points.len());

    let line = "groom interpolate thin.groom --strands 200 --points 8 --seed 1";
    let hair = twice(line, "hair.groom");
    assert_eq!((hair.n_strands(), hair.points.len()), (200, 1600));

    let moved = twice(
        "groom transform a.groom --scale 2 --rotate X 90 --rotate z -90 --translate -1,2,0.5 --flip-root",
        "moved.groom",
    );
    // (x, y, z) scaled; about x: (x, -z, y); about z by -90: (-z, -x, y).
    let [x, y, z] = groom.points[15].map(|x| 2.0 * x);
    let expected = [-z - 1.0, -x + 2.0, y + 0.5];
    let far = (0..3).map(|axis: usize| (moved.points[0][axis] - expected[axis]).abs());
    assert!(far.fold(0.0, f32::max) < 1e-4, "{:?}", moved.points[0]);
    assert_eq!(
        moved.diameter_range().median,
        2.0 * groom.diameter_range().median
    );
    let info = json(at, "inspect moved.groom");
    let edit = info["parameters"]["edit"].as_str().unwrap_or_default();
    assert!(
        edit.starts_with("transform --scale 2 --rotate x 90"),
        "{info}"
    );

    // Strands name guides by number, most of which are gone.
    let mut guided = groom.clone();
    let guide = (0..60u8).map(|ix| f32::from(u8::from(ix < 6)));
    guided.attributes.extend([
        per_strand("guide", 1, guide.collect()),
        per_strand("closest_guides", 3, [5.0, 0.0, 1.0].repeat(60)),
        per_strand("guide_weights", 3, [0.5, 0.25, 0.25].repeat(60)),
    ]);
    guided.write(&at.join("guided.groom")).expect("written");
    let lost = "dropped: closest_guides, guide_weights (of guides that are left out)";
    let (_, notes) = done(at, "groom thin guided.groom --strands 20 -o few.groom");
    assert!(notes.contains(lost), "{notes}");
    let (_, notes) = done(at, "groom thin guided.groom --strands 60 -o all.groom");
    assert!(!notes.contains("dropped"), "{notes}");

    // Straight into another format, and from one.
    done(at, "groom thin a.groom --strands 30 -o thin.hair");
    done(at, "groom thin thin.hair --strands 10 -o thin.data");
    for (line, needles) in [
        (
            "groom thin a.groom --strands 61 -o x.groom",
            &["a.groom", "1..=60"][..],
        ),
        ("groom thin a.groom --strands 0 -o x.groom", &["strands"]),
        (
            "groom thin a.groom --strands 3 -o a.groom",
            &["a.groom", "is an input"],
        ),
        (
            "groom thin a.groom --strands 3 -o x.png",
            &["x.png", ".hair"],
        ),
        ("groom resample a.groom -o x.groom", &["--points"]),
        (
            "groom resample a.groom --points 1 -o x.groom",
            &["points", "2..="],
        ),
        (
            "groom resample a.groom --points 4 --max-error 1 -o x.groom",
            &["--max-error"],
        ),
        (
            "groom interpolate a.groom --strands 0 -o x.groom",
            &["strands"],
        ),
        ("groom transform a.groom -o x.groom", &["nothing to do"]),
        (
            "groom transform a.groom --rotate W 90 -o x.groom",
            &["--rotate W 90"],
        ),
        (
            "groom transform a.groom --translate 1,2 -o x.groom",
            &["three numbers"],
        ),
        ("groom transform a.groom --scale nan -o x.groom", &["scale"]),
    ] {
        refused(at, line, needles);
        assert!(!at.join("x.groom").exists(), "{line}");
    }
}

#[test]
fn roots_guides_and_colours_are_as_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut groom = bob(at);
    let n = groom.n_strands();
    // Every fifth strand is a guide, every fourth runs from the tip to the root.
    let guide = (0..n).map(|ix| f32::from(u8::from(ix % 5 == 0)));
    groom
        .attributes
        .push(per_strand("guide", 1, guide.collect()));
    let color = [0.6, 0.4, 0.2];
    groom
        .attributes
        .push(per_strand("color", 3, color.repeat(n)));
    let upright = groom.clone();
    for ix in (0..n).step_by(4) {
        let range = groom.strand(ix);
        groom.points[range].reverse();
    }
    groom.write(&at.join("mixed.groom")).expect("written");

    let line = "groom convert mixed.groom -o b.groom";
    let (_, notes) = done(at, line);
    assert!(
        notes.contains("dropped: 12 guides (--guides keep)"),
        "{notes}"
    );
    let strands = Groom::read(&at.join("b.groom")).expect("a groom");
    assert_eq!(strands.n_strands(), 48);
    done(at, &format!("{line} --guides only"));
    let guides = Groom::read(&at.join("b.groom")).expect("a groom");
    assert_eq!(guides.n_strands(), 12);
    let (_, notes) = done(at, "groom convert b.groom -o c.data");
    assert!(notes.contains("12 curves, all guides"), "{notes}");

    let (_, notes) = done(
        at,
        &format!("{line} --guides keep --root auto --color-from groom_color"),
    );
    for needle in [
        "12 of 60 curves are guides",
        "--root auto: 15 of 60 strands ran from tip to root",
    ] {
        assert!(notes.contains(needle), "{notes}");
    }
    let back = Groom::read(&at.join("b.groom")).expect("a groom");
    assert_eq!(back.points, upright.points);
    let dye = back.attribute("dye").expect("dyed");
    assert_eq!((dye.domain, dye.components), (Domain::Strand, 4));
    // Light of the strongest channel is absorbed least.
    assert!(dye.data[0] < dye.data[1] && dye.data[1] < dye.data[2]);
    assert_eq!(dye.data[3], 1.0);
    refused(
        at,
        "groom convert a.groom -o x.groom --color-from color",
        &["no colour called color"],
    );
    refused(
        at,
        "groom convert a.groom -o x.groom --guides only",
        &["no guides"],
    );
    refused(
        at,
        "groom convert a.groom -o x.hair --unit m",
        &["a.groom", "in centimetres"],
    );
}

/// One line says which unit and axis were taken, and from where.
#[test]
fn import_says_where_unit_and_axis_are_from() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    // A head of 1,000 strands in metres, z up, 1.6 m above the floor.
    done(
        at,
        "groom generate --style straight --strands 1000 --points-per-strand 8 -o a.groom",
    );
    done(at, "groom transform a.groom --translate 0,160,0 -o b.groom");
    let groom = Groom::read(&at.join("b.groom")).expect("a groom");
    let hair = groom_format("hair").expect("it is in the table");
    let mut options = ExportOptions::default().with_unit(100.0);
    options.up = Some(strandlight_formats::UpAxis::Z);
    let bytes = groom.export(hair, &options).expect("exported").bytes;
    fs::write(at.join("m.hair"), bytes).expect("written");
    for (flags, unit, up) in [
        ("", "unit cm (by convention", "z up (by convention"),
        (" --unit m --up y", "unit m (--unit)", "y up (--up)"),
        (
            " --unit auto --up auto",
            "unit m (guessed: its roots span",
            "z up (guessed: its roots are 1.6",
        ),
    ] {
        let (_, notes) = done(at, &format!("groom import m.hair -o c.groom{flags}"));
        let line = notes.lines().find(|line| line.contains("unit "));
        let line = line.unwrap_or_default();
        assert!(line.starts_with("m.hair: "), "{notes}");
        assert!(line.contains(unit) && line.contains(up), "{notes}");
    }
    let (_, notes) = done(at, "--quiet groom import m.hair -o c.groom");
    assert_eq!(notes, "");
}
