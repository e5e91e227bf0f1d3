//! What the files of `strandlight render` say they were made from, and that they are the same bytes
//! whoever makes them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use exr::meta::attribute::AttributeValue;
use strandlight_formats::{Scene, content_hash};
use strandlight_tests::{assert_done, project_root, strandlight};

use super::render_command::scene_in;

/// The texts in the header of an OpenEXR file, and the names of its channels.
pub fn header(path: &Path) -> (BTreeMap<String, String>, Vec<String>) {
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
    let mut scene = Scene::read(b.join("a.toml")).expect("valid");
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
fn gpu_files_are_the_same_on_any_number_of_threads() {
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
        "reference a.toml --method path -o OUT/p.exr --samples 2 --size 90x70".to_owned(),
        "reference a.toml --method ray-shoot -o OUT/r.exr --samples 2 --size 90x70".to_owned(),
        "reference a.toml --method directional -o OUT/d.exr --samples 2 --size 90x70".to_owned(),
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
