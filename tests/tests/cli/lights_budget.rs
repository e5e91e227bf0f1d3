//! `strandlight lights`: error budgets, reports for people, suns and residual, light rigs.

use std::fs;
use std::path::Path;
use std::process::Output;

use serde_json::Value;
use strandlight_bake::maps::Sky;
use strandlight_formats::{BakedFile, LightSet};
use strandlight_images::Map;
use strandlight_scattering::spherical_gaussian::solid_angle;
use strandlight_tests::{assert_refused, strandlight};

/// A folder with two maps: `sun.exr`, a sky with a sun, and `soft.exr`, without one.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, sky) in [("sun.exr", Sky::Sun), ("soft.exr", Sky::Soft)] {
        let map = sky.exr_file(128).expect("a map");
        fs::write(folder.path().join(name), map).expect("writable");
    }
    folder
}

fn run(at: &Path, line: &str) -> Output {
    let words = line.split_whitespace();
    let mut command = strandlight();
    command.current_dir(at).args(words);
    command.output().expect("it runs")
}

fn done(at: &Path, line: &str) -> Output {
    let output = run(at, line);
    assert!(output.status.success(), "{line}: {output:?}");
    output
}

fn read(at: &Path, name: &str) -> Vec<u8> {
    fs::read(at.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn json(bytes: &[u8]) -> Value {
    serde_json::from_slice(bytes).expect("one JSON document")
}

#[test]
fn slow_a_budget_gets_the_smallest_set() {
    let folder = folder();
    let at = folder.path();
    let line = "lights sun.exr -o a.lights --max-error 5% --report a.json --json";
    let printed = json(&done(at, line).stdout);
    let count = printed["requested_count"].as_u64().expect("a count");
    assert!(count > 1, "{printed}");
    let budget = &printed["budget"];
    assert_eq!(
        (&budget["met"], &budget["metric"]),
        (&true.into(), &"fibre".into())
    );
    assert_eq!(budget["error"], printed["fibre_error"]);
    assert!(printed["fibre_error"].as_f64().expect("a number") <= 0.05);
    let curve = printed["curve"].as_array().expect("a curve");
    let error_at = |count: u64| {
        let point = curve.iter().find(|point| point["count"] == count);
        point
            .and_then(|point| point["fibre_error"].as_f64())
            .expect("it was fitted")
    };
    assert!(
        error_at(count) <= 0.05 && error_at(count - 1) > 0.05,
        "{curve:?}"
    );
    // The same as by its count, but for what the report says of the budget.
    done(at, &format!("lights sun.exr -o b.lights --count {count}"));
    assert_eq!(read(at, "a.lights"), read(at, "b.lights"));
    done(at, "verify a.lights --map sun.exr --max-error 5%");
    // On another number of threads too.
    let line = "--threads 1 lights sun.exr -o c.lights --max-error 5% --report c.json";
    done(at, line);
    assert_eq!(read(at, "a.json"), read(at, "c.json"));
    assert_eq!(read(at, "a.lights"), read(at, "c.lights"));
    // The other metric limits the other error.
    let line = "lights sun.exr -o d.lights --max-error 5% --metric irradiance --json";
    let other = json(&done(at, line).stdout);
    assert_eq!(other["budget"]["metric"], "irradiance");
    assert_eq!(other["budget"]["error"], other["irradiance_error"]);
    assert!(other["irradiance_error"].as_f64() <= Some(0.05));
}

#[test]
fn a_budget_that_is_not_met_says_what_was_reached_and_writes_no_lights() {
    let folder = folder();
    let at = folder.path();
    let line = "lights sun.exr -o a.lights --max-error 0.07% --max-count 2 --preview p.png \
                --report r.json --report r.html --timings t.json";
    let output = run(at, line);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let stderr = String::from_utf8_lossy(&output.stderr);
    let report = json(&read(at, "r.json"));
    let reached = report["budget"]["error"].as_f64().expect("a number");
    assert_eq!(report["budget"]["met"], false);
    for needle in [
        "sun.exr",
        "up to 2 lights",
        "at most 0.07 %",
        &format!("{:.3} %", 100.0 * reached),
    ] {
        assert!(stderr.contains(needle), "{needle}: {stderr}");
    }
    let page = String::from_utf8(read(at, "r.html")).expect("UTF-8");
    assert!(page.contains("No light set was written"));
    assert!(at.join("t.json").exists());
    for name in ["a.lights", "p.png"] {
        assert!(!at.join(name).exists(), "{name}");
    }
    // What --json prints is the report, not an error.
    let output = run(
        at,
        "lights sun.exr -o a.lights --max-error 0.07% --max-count 1 --json",
    );
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json(&output.stdout)["budget"]["met"], false);
}

#[test]
fn flags_that_do_not_go_together_are_refused() {
    let folder = folder();
    let at = folder.path();
    for (line, needle) in [
        ("--max-error 1% --count 3", "--count"),
        ("--max-error 1% --no-report", "--no-report"),
        ("--max-error 200%", "200%"),
        ("--max-error x", "--max-error"),
        ("--metric fibre", "--max-error"),
        ("--max-count 3", "--max-error"),
        ("--max-error 1% --max-count 0", "1 to 1024"),
        ("--max-error 1% --metric pixels", "irradiance"),
        ("--suns 1", "--residual"),
        ("--residual r.exr", "--suns"),
        ("--suns 0 --residual r.exr", "1 to 16"),
        ("--suns 1 --residual r.exr --count 3", "--count"),
        ("--suns 1 --residual r.png", ".exr"),
        ("--suns 1 --residual sun.exr", "is an input"),
        ("--hair nobody", "zinke"),
        ("--hair nobody.toml", "nobody.toml"),
        ("--report r.json --report r.json", "two outputs"),
        ("--report r.json --timings r.json", "two outputs"),
    ] {
        let mut command = strandlight();
        command
            .current_dir(at)
            .args(["lights", "sun.exr", "-o", "a.lights"]);
        assert_refused(command.args(line.split_whitespace()), &[needle]);
        assert!(!at.join("a.lights").exists(), "{line}");
    }
}

/// Elements of a page, if it is well-formed; every attribute that could fetch something is asserted
/// to fetch nothing.
fn elements(page: &str) -> Vec<String> {
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..Default::default()
    };
    let document = roxmltree::Document::parse_with_options(page, options)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut names = Vec::new();
    for element in document.descendants().filter(|node| node.is_element()) {
        for attribute in element.attributes() {
            let (name, value) = (attribute.name(), attribute.value());
            if ["href", "src", "srcset", "action", "data"].contains(&name) {
                let is_within =
                    value.starts_with("data:image/png;base64,") || value.starts_with('#');
                assert!(is_within, "{name}={value}");
            }
            assert!(!name.starts_with("on"), "{name}");
        }
        names.push(element.tag_name().name().to_owned());
    }
    names
}

#[test]
fn pages_are_well_formed_and_hold_all_that_they_show() {
    let folder = folder();
    let at = folder.path();
    let name = "a<b>&'c'.exr";
    fs::copy(at.join("sun.exr"), at.join(name)).expect("copied");
    let mut command = strandlight();
    command
        .current_dir(at)
        .args(["lights", name, "-o", "a.lights", "--count", "5", "--curve"]);
    command.args([
        "--hair",
        "zinke-fig8-blond",
        "--report",
        "a.HTML",
        "--report",
        "a.json",
    ]);
    strandlight_tests::assert_done(&mut command);
    let page = String::from_utf8(read(at, "a.HTML")).expect("UTF-8");
    assert!(page.len() < 1 << 20, "{}", page.len());
    for unwanted in ["http", "<script", "@import", "url(", "<link", "<iframe"] {
        assert!(!page.contains(unwanted), "{unwanted}");
    }
    let names = elements(&page);
    let count = |name: &str| names.iter().filter(|found| *found == name).count();
    assert_eq!(count("image"), 3, "map, lights, difference");
    assert_eq!(count("polyline"), 2, "fibre and irradiance");
    for heading in [
        "Pictures",
        "Error against",
        "Energy",
        "Lights",
        "Map",
        "Repeat",
    ] {
        assert!(page.contains(&format!("<h2>{heading}")), "{heading}");
    }
    assert!(page.contains("a&lt;b&gt;&amp;'c'.exr"));
    assert!(page.contains("zinke-fig8-blond"));
    for axis in ["+X", "-X", "+Y", "-Y", "+Z", "-Z"] {
        assert!(page.contains(&format!(">{axis}</text>")), "{axis}");
    }
    // Figures of the page and of the report are the same.
    let report = json(&read(at, "a.json"));
    let error = 100.0 * report["fibre_error"].as_f64().expect("a number");
    assert!(page.contains(&format!("{error:.2} %")) || page.contains(&format!("{error:.1} %")));
    let rows = report["curve"].as_array().expect("a curve").len();
    assert!(rows >= 5 && count("circle") >= 2 * rows + 5, "{rows}");
    // The command of the page makes the same page.
    let (_, rest) = page.split_once("<pre>").expect("a command");
    let line = rest.split("</pre>").next().expect("its end");
    let line = line
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&amp;", "&");
    let line = line.replacen("strandlight", "\"$PROGRAM\"", 1);
    let program = strandlight().get_program().to_owned();
    let mut shell = std::process::Command::new("sh");
    shell
        .current_dir(at)
        .args(["-c", &line])
        .env("PROGRAM", program);
    strandlight_tests::assert_done(&mut shell);
    assert_eq!(String::from_utf8(read(at, "a.HTML")).expect("UTF-8"), page);
    assert_eq!(json(&read(at, "a.json")), report);
}

#[test]
fn hair_is_judged_by_its_own_fibres() {
    let folder = folder();
    let at = folder.path();
    let scene =
        "version = 1\n[groom]\nfile = 'a.groom'\n[lights]\nfile = 'a.lights'\n[hair]\nwidth_deg = ";
    let error_of = |name: &str, hair: &str| {
        fs::write(at.join(name), format!("{scene}{hair}\n")).expect("writable");
        let line = format!("lights sun.exr -o a.lights --count 4 --hair {name} --json");
        let document = json(&done(at, &line).stdout);
        assert_eq!(document["hair"]["name"], name);
        let plain = document["fibre_error"].as_f64().expect("a number");
        (
            document["hair"]["fibre_error"].as_f64().expect("a number"),
            plain,
        )
    };
    let (smooth, plain) = error_of("smooth.toml", "{ r = 3.0, tt = 1.5, trt = 6.0 }");
    let (rough, same) = error_of("rough.toml", "{ r = 14.0, tt = 7.0, trt = 28.0 }");
    assert_eq!(plain, same, "the default hair's error stays");
    assert!(smooth > rough, "{smooth} {rough}");
    // Modes that are not drawn scatter nothing.
    let widths = "{ r = 3.0, tt = 1.5, trt = 6.0 }";
    let of = |name, more: &str| error_of(name, &format!("{widths}\n{more}")).0;
    let shiny = of("r.toml", "modes = ['R']");
    let dark = of("zero.toml", "intensity_tt = 0.0\nintensity_trt = 0.0");
    assert_eq!(shiny, dark);
    assert!((shiny / smooth - 1.0).abs() > 0.1, "{shiny} {smooth}");
}

#[test]
fn suns_and_residual_are_the_map() {
    let folder = folder();
    let at = folder.path();
    let line =
        "lights sun.exr -o sun.lights --suns 3 --residual rest.exr --report r.json --report r.html";
    done(at, line);
    let set = LightSet::read(&at.join("sun.lights")).expect("a light set");
    let (map, rest) = (
        Map::read(&at.join("sun.exr")).expect("a map"),
        Map::read(&at.join("rest.exr")).expect("a map"),
    );
    assert_eq!(set.lights.len(), 1);
    assert!(set.lights[0].lambda < 0.06);
    assert_eq!((rest.width(), rest.height()), (map.width(), map.height()));
    for c in 0..3 {
        let lights: f64 = set
            .lights
            .iter()
            .map(|light| f64::from(light.rgb[c]) * solid_angle(f64::from(light.lambda)))
            .sum();
        let ratio = (lights + rest.energy()[c]) / map.energy()[c];
        assert!((ratio - 1.0).abs() < 1e-5, "{c}: {ratio}");
    }
    let brightest = |map: &Map| map.pixels().iter().flatten().fold(0.0f32, |m, x| m.max(*x));
    assert!(
        brightest(&rest) < 0.05 * brightest(&map),
        "{}",
        brightest(&rest)
    );
    assert!(rest.faults().is_clean());
    let report = json(&read(at, "r.json"));
    assert!(report["fibre_error"].as_f64() < Some(0.01), "{report}");
    assert!(report["residual"]["energy_share"][1].as_f64() < Some(1.0));
    assert!(elements(&String::from_utf8_lossy(&read(at, "r.html"))).len() > 50);

    // Judged with the residual, not without.
    done(at, "verify sun.lights --map sun.exr --residual rest.exr");
    let output = run(at, "verify sun.lights --map sun.exr");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("--residual"),
        "{output:?}"
    );
    let output = run(at, "verify sun.lights --map sun.exr --residual soft.exr");
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let stderr = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let output = run(at, "verify sun.lights --map sun.exr --residual none.exr");
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(!stderr(&output).contains("name the rest"), "{output:?}");

    // A set that went out and came back is judged as before. An array has no place for what it is.
    done(at, "export sun.lights -o sun.json");
    done(at, "lights import sun.json -o again.lights");
    let line = "verify again.lights --map sun.exr --residual rest.exr";
    assert!(!stderr(&done(at, line)).contains("no effect"));
    let output = done(at, "export again.lights -o rig.usda");
    assert!(stderr(&output).contains("--residual adds the rest"));
    done(at, "export sun.lights -o sun.npy");
    done(at, "lights import sun.npy -o plain.lights");
    let line = "verify plain.lights --map sun.exr --residual rest.exr";
    assert!(stderr(&run(at, line)).contains("plain.lights: --residual has no effect"));

    // No sun: nothing to write.
    let output = run(
        at,
        "lights soft.exr -o no.lights --suns 1 --residual no.exr",
    );
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("no compact source"));
    assert!(!at.join("no.lights").exists() && !at.join("no.exr").exists());
}

#[test]
fn a_rig_is_written_for_what_reads_it() {
    let folder = folder();
    let at = folder.path();
    done(
        at,
        "lights sun.exr -o sun.lights --suns 1 --residual rest.exr",
    );
    fs::create_dir(at.join("rigs")).expect("a folder");
    let alone = done(at, "export sun.lights -o rig.usda");
    assert!(
        String::from_utf8_lossy(&alone.stderr).contains("--residual"),
        "{alone:?}"
    );
    done(at, "export sun.lights -o rig.usda --residual rest.exr");
    let rig = String::from_utf8(read(at, "rig.usda")).expect("UTF-8");
    assert!(
        rig.contains("asset inputs:texture:file = @./rest.exr@"),
        "{rig}"
    );
    done(
        at,
        "export sun.lights -o rigs/rig.usda --residual rest.exr --for blender",
    );
    let blender = String::from_utf8(read(at, "rigs/rig.usda")).expect("UTF-8");
    assert!(
        blender.contains("For Blender alone") && !blender.contains("@./"),
        "{blender}"
    );
    for (line, needle) in [
        ("sun.lights -o a.json --residual rest.exr", "--residual"),
        ("sun.lights -o a.npy --for blender", "--for"),
        ("sun.lights -o a.usda --residual sun.lights", "sun.lights"),
        ("sun.lights -o a.usda --residual none.exr", "none.exr"),
        ("sun.lights -o a.usda --for maya", "blender"),
        ("sun.lights -o a.usdz", ".usda"),
    ] {
        let mut command = strandlight();
        let words = line.split_whitespace();
        assert_refused(command.current_dir(at).arg("export").args(words), &[needle]);
    }
}
