//! Wrong input gets one clear line naming the problem, exit code 2, and nothing is written.

use std::fs;
use std::path::Path;

use strandlight_tests::{assert_refused, project_root, strandlight, strandview};

/// Runs `strandlight ARGS -o OUT` in an empty folder and asserts that it refuses and leaves the
/// folder as it was.
fn refuses(folder: &Path, args: &[&str], out: &str, needles: &[&str]) {
    let before = names_in(folder);
    let mut command = strandlight();
    command.current_dir(folder).args(args).args(["-o", out]);
    assert_refused(&mut command, needles);
    assert_eq!(
        names_in(folder),
        before,
        "{command:?} left something behind"
    );
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("the folder is there")
        .map(|entry| {
            entry
                .expect("readable")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    names
}

fn write(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    fs::write(folder.join(name), bytes).expect("the folder can be written");
}

/// A Radiance map of one colour, uncompressed.
fn radiance(width: usize, height: usize, rgbe: [u8; 4]) -> Vec<u8> {
    let mut bytes =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    bytes.extend(std::iter::repeat_n(rgbe, width * height).flatten());
    bytes
}

/// A float32 OpenEXR map of 32 x 16 NaNs: no compression, one scan line a block.
fn nan_map() -> Vec<u8> {
    let (width, height) = (32_u32, 16_u32);
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        for text in [name, kind] {
            bytes.extend(text.bytes().chain([0]));
        }
        bytes.extend((value.len() as u32).to_le_bytes());
        bytes.extend(value);
    };
    let words = |words: &[u32]| {
        words
            .iter()
            .flat_map(|word| word.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let mut channels = Vec::new();
    for name in ["B", "G", "R"] {
        channels.extend(name.bytes().chain([0]));
        channels.extend(words(&[2, 0, 1, 1]));
    }
    channels.push(0);
    let window = words(&[0, 0, width - 1, height - 1]);
    attribute("channels", "chlist", &channels);
    attribute("compression", "compression", &[0]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1_f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &words(&[0, 0]));
    attribute("screenWindowWidth", "float", &1_f32.to_le_bytes());
    bytes.push(0);
    let block = 8 + 12 * u64::from(width);
    let first = bytes.len() as u64 + 8 * u64::from(height);
    for row in 0..u64::from(height) {
        bytes.extend((first + row * block).to_le_bytes());
    }
    for row in 0..height {
        bytes.extend(words(&[row, 12 * width]));
        bytes.extend(f32::NAN.to_le_bytes().repeat(3 * width as usize));
    }
    bytes
}

#[test]
fn outputs_that_would_hurt_something() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let good = fs::read(project_root().join("data/sample/studio.exr")).expect("the sample map");
    write(at, "good.exr", &good);
    refuses(
        at,
        &["lights", "good.exr"],
        "good.exr",
        &["good.exr", "input"],
    );
    let both = ["lights", "good.exr", "--report", "x"];
    refuses(at, &both, "x", &["x", "two outputs"]);
    let picture = ["lights", "good.exr", "--preview", "x.jpg"];
    refuses(at, &picture, "x.lights", &["x.jpg", ".png"]);
    fs::create_dir(at.join("folder")).expect("a folder");
    refuses(at, &["tables"], "folder", &["folder", "directory"]);
    refuses(
        at,
        &["tables"],
        "no/such/x",
        &["no/such/x", "no such folder"],
    );
    assert_eq!(fs::read(at.join("good.exr")).expect("still there"), good);
}

#[test]
fn lights() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let good = fs::read(project_root().join("data/sample/studio.exr")).expect("the sample map");
    write(at, "good.exr", &good);
    write(at, "cut.exr", &good[..good.len() / 2]);
    write(at, "stub.exr", &good[..20]);
    write(at, "text.exr", "not a map");
    write(at, "empty.hdr", "");
    write(at, "one.hdr", radiance(1, 1, [128, 128, 128, 129]));
    write(at, "black.hdr", radiance(16, 8, [0, 0, 0, 0]));
    write(at, "square.hdr", radiance(8, 8, [128, 128, 128, 129]));
    write(
        at,
        "huge.hdr",
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 2000000\n",
    );
    write(at, "nan.exr", nan_map());
    fs::create_dir(at.join("folder.exr")).expect("a folder");
    for (map, needles) in [
        ("missing.exr", ["missing.exr"].as_slice()),
        ("folder.exr", &["folder.exr"]),
        ("cut.exr", &["cut.exr"]),
        ("stub.exr", &["stub.exr"]),
        ("text.exr", &["text.exr"]),
        ("empty.hdr", &["empty.hdr"]),
        ("one.hdr", &["one.hdr", "1"]),
        ("black.hdr", &["black.hdr"]),
        ("square.hdr", &["square.hdr", "8"]),
        ("huge.hdr", &["huge.hdr"]),
        ("nan.exr", &["nan.exr", "512 are NaN"]),
    ] {
        refuses(at, &["lights", map], "out.lights", needles);
    }
    for count in ["0", "100000", "-3", "many"] {
        let count_flag = format!("--count={count}");
        refuses(
            at,
            &["lights", "good.exr", &count_flag],
            "out.lights",
            &[count],
        );
    }
    refuses(
        at,
        &["lights", "good.exr"],
        "no/such/folder/out.lights",
        &["no/such/folder"],
    );
}

#[test]
fn grooms() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let mut header = vec![0_u8; 128];
    header[..4].copy_from_slice(b"HAIR");
    header[4..8].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
    header[8..12].copy_from_slice(&4_000_000_000_u32.to_le_bytes());
    header[12..16].copy_from_slice(&3_u32.to_le_bytes());
    write(at, "lies.hair", &header);
    write(at, "short.hair", &header[..100]);
    write(at, "text.hair", "hello");
    fs::create_dir(at.join("folder.hair")).expect("a folder");
    for file in [
        "lies.hair",
        "short.hair",
        "text.hair",
        "folder.hair",
        "missing.hair",
    ] {
        refuses(at, &["groom", "import", file], "out.groom", &[file]);
    }
    for (flag, value) in [
        ("--strands", "0"),
        ("--strands", "4000000000"),
        ("--seed", "x"),
    ] {
        let mut args = vec![
            "groom",
            "generate",
            "--style",
            "wavy",
            "--points-per-strand",
            "8",
        ];
        if flag != "--strands" {
            args.extend(["--strands", "10"]);
        }
        args.extend([flag, value]);
        refuses(at, &args, "out.groom", &[value]);
    }
}

#[test]
fn scenes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let files = "[groom]\nfile = \"a.groom\"\n[lights]\nfile = \"a.lights\"\n";
    write(
        at,
        "unknown.toml",
        format!("version = 1\ncolour = 3\n{files}"),
    );
    write(
        at,
        "nested.toml",
        format!("version = 1\n{files}[hair]\netta = 1.5\n"),
    );
    write(at, "missing.toml", format!("version = 1\n{files}"));
    write(at, "version.toml", format!("version = 99\n{files}"));
    write(
        at,
        "range.toml",
        format!("version = 1\n{files}[hair]\neta = -1.0\n"),
    );
    write(
        at,
        "nan.toml",
        format!("version = 1\n{files}[hair]\nsigma_a = [nan, 0.1, 0.1]\n"),
    );
    let nameless = files.replace("a.lights", "");
    write(at, "nameless.toml", format!("version = 1\n{nameless}"));
    write(at, "broken.toml", "version = = 1");
    write(at, "binary.toml", [0xff, 0xfe, 0x00, 0x01]);
    for (scene, needle) in [
        ("unknown.toml", "unknown.toml:2:1: colour"),
        ("nested.toml", "nested.toml:7:1: hair.etta"),
        ("nested.toml", "did you mean eta?"),
        ("missing.toml", "missing.toml: groom.file: a.groom: "),
        ("version.toml", "99"),
        ("range.toml", "range.toml:7: hair.eta is -1"),
        ("nan.toml", "nan.toml:7: hair.sigma_a"),
        ("broken.toml", "broken.toml:1:"),
        ("binary.toml", "binary.toml"),
        ("nowhere.toml", "nowhere.toml"),
        ("nameless.toml", "nameless.toml:5: lights.file"),
    ] {
        refuses(at, &["render", scene], "out.png", &[needle]);
        let mut command = strandview();
        command.current_dir(at).args([scene, "--frame", "out.png"]);
        assert_refused(&mut command, &[needle]);
        assert!(!at.join("out.png").exists());
    }
    refuses(at, &["render", "missing.toml"], "out.gif", &["out.gif"]);
    for size in ["0x0", "100000x100000", "axb", "720"] {
        refuses(
            at,
            &["render", "missing.toml", "--size", size],
            "out.png",
            &[size],
        );
    }
}

#[test]
fn other_commands() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write(at, "text.tables", "hello");
    for command in ["inspect", "verify"] {
        for file in ["missing.tables", "text.tables"] {
            let mut command_line = strandlight();
            command_line.current_dir(at).args([command, file]);
            assert_refused(&mut command_line, &[file]);
        }
    }
    refuses(at, &["export", "text.tables"], "out.npy", &["text.tables"]);
}

#[test]
fn names_of_other_kinds_of_ours_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write(at, "a.toml", "a scene");
    for (args, out, kind) in [
        (&["lights", "a.exr"][..], "a.toml", ".lights"),
        (&["lights", "import", "a.json"], "a.toml", ".lights"),
        (&["lights", "a.exr"], "a.groom", ".lights"),
        (&["tables"], "a.toml", ".tables"),
        (&["mesh", "generate"], "a.toml", ".mesh"),
        (&["groom", "import", "a.hair"], "a.toml", ".groom"),
    ] {
        refuses(at, args, out, &[out, "the name must end in", kind]);
    }
    assert_eq!(fs::read(at.join("a.toml")).expect("there"), b"a scene");
}
