//! Where outputs go and inputs come from: files, links, pipes, devices and standard streams; what
//! an interrupt leaves behind, and what is said on stdout and stderr on the way.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;
use strandlight_data::DEFAULT_TABLES;
use strandlight_formats::{BakedFile, LightSet, TableFile};
use strandlight_tests::scenes::{curtain, key_and_sky, write_small_scene};
use strandlight_tests::{assert_done, assert_refused, strandlight, strandview};

/// A folder with `a.groom`, `a.lights`, `a.toml`, `a.tables`, `a.hair` and the map `a.exr`.
pub fn samples() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    write_small_scene(at, &curtain(6, 4, 0.5, 0.0), key_and_sky(), |scene| {
        scene.hair.diameter_cm = Some(0.2);
        scene.render.shadow_maps = 0;
    });
    let tables = TableFile::from_bytes(DEFAULT_TABLES).expect("the bundled tables");
    tables.write(&at.join("a.tables")).expect("written");
    done(at, "export a.groom -o a.hair");
    done(at, "export a.lights -o a.exr --width 64");
    folder
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split_whitespace());
    command
}

fn done(folder: &Path, line: &str) -> String {
    assert_done(&mut command(folder, line))
}

pub fn refused(folder: &Path, line: &str, needles: &[&str]) {
    assert_refused(&mut command(folder, line), needles);
}

/// Runs a line of bash in which `$S` is strandlight.
fn bash(folder: &Path, line: &str) -> Output {
    let mut shell = Command::new("bash");
    shell.current_dir(folder).args(["-c", line]);
    shell.env("S", strandlight().get_program());
    shell.output().expect("bash starts")
}

/// Runs a line of bash, which must be done, and answers its stdout.
fn bash_done(folder: &Path, line: &str) -> Vec<u8> {
    let output = bash(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {stderr}");
    output.stdout
}

/// Runs a line of bash, which must refuse in one line on stderr that has every one of `needles`.
fn bash_refused(folder: &Path, line: &str, needles: &[&str]) {
    let output = bash(folder, line);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{line}: {stderr}");
    for needle in needles {
        assert!(stderr.contains(needle), "{line}: no {needle}: {stderr}");
    }
}

pub fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let name = |entry: std::io::Result<fs::DirEntry>| entry.expect("readable").file_name();
    let mut names: Vec<String> = entries
        .map(|entry| name(entry).to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn standard_output_takes_the_file_and_nothing_else() {
    let folder = samples();
    let at = folder.path();
    done(at, "groom import a.hair -o b.groom");
    let expected = read(at, "b.groom");
    for name in ["-", "/dev/stdout", "/proc/self/fd/1"] {
        let output = command(at, &format!("groom import a.hair -o {name}"))
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{name}: {output:?}");
        assert!(output.stdout == expected, "{name}: through a pipe");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(stderr.contains("groom 1.1, 6 strands"), "{name}: {stderr}");

        fs::write(at.join("f"), "").expect("written");
        let file = at.join("f").metadata().expect("there").ino();
        bash_done(at, &format!("$S groom import a.hair -o {name} > f"));
        assert!(read(at, "f") == expected, "{name}: into a file");
        assert_eq!(at.join("f").metadata().expect("there").ino(), file);
        bash_done(
            at,
            &format!("(echo before; $S groom import a.hair -o {name}; echo after) > f"),
        );
        let around = [b"before\n", &expected[..], b"after\n"].concat();
        assert!(read(at, "f") == around, "{name}: between others");
    }
    // Formats that a name would tell have a default.
    done(at, "export a.lights -o b.json");
    assert!(bash_done(at, "$S export a.lights -o -") == read(at, "b.json"));
    assert!(bash_done(at, "$S export - -o - < a.groom") == read(at, "a.hair"));
    bash_done(at, "$S export a.lights -o >(cat > c.json); wait $!");
    assert!(read(at, "c.json") == read(at, "b.json"));

    refused(
        at,
        "lights a.exr -o b.lights --report - --preview -",
        &["-", "two outputs"],
    );
    refused(
        at,
        "lights a.exr -o b.lights --report - --preview /dev/stdout",
        &["/dev/stdout", "two outputs"],
    );
    for line in [
        "scenes -o -",
        "demo --output -",
        "bench plots -o -",
        "bench single -o -",
        "render a.toml --turntable 2 -o -",
    ] {
        refused(at, line, &["-: is standard output", "name a folder"]);
    }
    refused(
        at,
        "export a.tables -o -",
        &["-: tables can be exported to"],
    );
    refused(
        at,
        "reference a.toml --method path --resume -o -",
        &["--resume goes on with a file"],
    );
    let folders = ["demo", "-"].map(|name| at.join(name).exists());
    assert_eq!(folders, [false; 2]);
}

#[test]
fn json_and_an_output_do_not_share_standard_output() {
    let folder = samples();
    let at = folder.path();
    for line in ["lights a.exr -o - --json", "tables --json -o /dev/stdout"] {
        let output = command(at, line).output().expect("it starts");
        assert_eq!(output.status.code(), Some(2));
        let document: Value = serde_json::from_slice(&output.stdout).expect("one document");
        let message = document["error"]["message"].as_str().expect("a message");
        assert!(message.contains("where --json prints"), "{message}");
    }
}

#[test]
fn devices_stay_and_a_full_disk_is_an_error() {
    let folder = samples();
    let at = folder.path();
    done(at, "groom import a.hair -o /dev/null");
    done(at, "lights a.exr --count 1 -o /dev/null --report /dev/null");
    let null = fs::metadata("/dev/null").expect("there").file_type();
    assert!(null.is_char_device());
    refused(
        at,
        "groom generate --style bob --strands 3 -o /dev/full",
        &["/dev/full: cannot be written", "space"],
    );
    for line in [
        "$S groom generate --style bob --strands 3 -o - > /dev/full",
        "$S inspect a.groom > /dev/full",
        "$S inspect a.groom --json > /dev/full",
        "$S --help > /dev/full",
        "$S groom import --help > /dev/full",
        "$S help lights > /dev/full",
        "$S --version > /dev/full",
        "$(dirname $S)/strandview --help > /dev/full",
        "$(dirname $S)/strandview --version > /dev/full",
    ] {
        bash_refused(at, line, &["space"]);
    }
    // The file reached no one if the reader is gone; results in words are another matter.
    let gone = "set -o pipefail; $S groom generate --style bob --strands 3000 -o - --quiet | true";
    bash_refused(at, gone, &["-: cannot be written"]);
    for line in ["inspect a.tables --json", "--help", "--version"] {
        bash_done(at, &format!("set -o pipefail; $S {line} | true"));
    }
    fs::create_dir(at.join("d")).expect("a folder");
    refused(
        at,
        "groom import a.hair -o d",
        &["d: cannot be written: is a directory"],
    );
    refused(at, "groom import a.hair -o d/", &["is a directory"]);
    refused(at, "groom import a.hair -o e/", &["e/", "names a folder"]);
}

#[test]
fn links_are_followed_and_permissions_kept() {
    let folder = samples();
    let at = folder.path();
    done(at, "groom import a.hair -o b.groom");
    let expected = read(at, "b.groom");
    for (link, target) in [
        ("dangling", "made.groom"),
        ("chain", "chain2"),
        ("chain2", "end.groom"),
        ("here", "there"),
        ("there", "here"),
        ("input", "a.hair"),
    ] {
        symlink(target, at.join(link)).expect("a link");
    }
    fs::write(at.join("end.groom"), "old").expect("written");
    let mode = fs::Permissions::from_mode(0o604);
    fs::set_permissions(at.join("end.groom"), mode).expect("set");
    for (link, end) in [("dangling", "made.groom"), ("chain", "end.groom")] {
        done(at, &format!("groom import a.hair -o {link}"));
        assert!(
            at.join(link)
                .symlink_metadata()
                .expect("there")
                .is_symlink()
        );
        assert!(read(at, end) == expected, "{link}");
    }
    let mode = at.join("end.groom").metadata().expect("there").mode();
    assert_eq!(mode & 0o777, 0o604);
    let before = names_in(at);
    refused(at, "groom import a.hair -o here", &["here", "circle"]);
    refused(
        at,
        "groom import a.hair -o input",
        &["input", "is an input"],
    );
    refused(
        at,
        "groom import input -o a.hair",
        &["a.hair", "is an input"],
    );
    bash_refused(at, "$S groom import - -o a.hair < a.hair", &["is an input"]);
    symlink("x", at.join("to_x")).expect("a link");
    for report in ["x", "./x", "to_x", "../$(basename $PWD)/x"] {
        let line = format!("$S lights a.exr -o x --report {report}");
        bash_refused(at, &line, &["is named for two outputs"]);
    }
    fs::remove_file(at.join("to_x")).expect("there");
    assert_eq!(names_in(at), before);
}

#[test]
fn pipes_are_read_and_written() {
    let folder = samples();
    let at = folder.path();
    done(at, "groom import a.hair -o b.groom");
    done(at, "lights a.exr --count 2 -o b.lights");
    bash_done(at, "$S lights - --count 2 -o c.lights < a.exr");
    bash_done(at, "cat a.exr | $S lights - --count 2 -o - > d.lights");
    bash_done(at, "$S lights <(cat a.exr) --count 2 -o e.lights");
    // A name that promises nothing is taken.
    done(at, "lights a.exr --count 2 -o f.bin");
    for name in ["c.lights", "d.lights", "e.lights", "f.bin"] {
        assert!(read(at, name) == read(at, "b.lights"), "{name}");
    }
    bash_done(
        at,
        "mkfifo in out; cat a.hair > in & cat out > c.groom & $S groom import in -o out; wait",
    );
    assert!(read(at, "c.groom") == read(at, "b.groom"));
    for name in ["in", "out"] {
        assert!(
            at.join(name)
                .metadata()
                .expect("there")
                .file_type()
                .is_fifo()
        );
    }
    for name in ["a.groom", "a.lights", "a.tables", "a.hair", "a.toml"] {
        let expected = done(at, &format!("inspect {name} --json"));
        for line in [
            format!("$S inspect - --json < {name}"),
            format!("cat {name} | $S inspect - --json"),
            format!("$S inspect <(cat {name}) --json"),
        ] {
            assert!(bash_done(at, &line) == expected.as_bytes(), "{line}");
        }
    }
    let tables = bash_done(
        at,
        "echo '{\"q\":\"table_C\",\"k\":3,\"lambda\":0.2,\"phi\":1.0}' | $S probe --tables <(cat a.tables)",
    );
    assert!(tables.starts_with(b"{\"value\""));

    // The files of a scene from a pipe lie in the current folder.
    let flags = "--backend cpu --size 12x8 --samples 4";
    done(at, &format!("render a.toml {flags} -o b.png"));
    let expected = read(at, "b.png");
    for line in [
        format!("cat a.toml | $S render - {flags} -o -"),
        format!("$S render <(cat a.toml) {flags} -o /dev/stdout"),
        format!(
            "sed s/a.groom/in/ a.toml > p.toml; cat a.groom > in & $S render p.toml {flags} -o -"
        ),
    ] {
        assert!(bash_done(at, &line) == expected, "{line}");
    }
    let compared = bash_done(at, "$S compare - b.png --json < b.png");
    let compared: Value = serde_json::from_slice(&compared).expect("one document");
    assert_eq!(compared["hair"]["relative_rmse"], 0.0);
}

#[test]
fn files_of_a_scene_are_no_outputs() {
    let folder = samples();
    let at = folder.path();
    let groom = read(at, "a.groom");
    symlink("a.groom", at.join("link.png")).expect("linked");
    fs::create_dir(at.join("frames")).expect("made");
    symlink("../a.lights", at.join("frames/0000.exr")).expect("linked");
    for line in [
        "render a.toml -o link.png --size 8x8",
        "render a.toml --turntable 1 -o frames --size 8x8",
        "reference a.toml --method path -o link.exr --size 8x8",
    ] {
        let _ = fs::remove_file(at.join("link.exr"));
        symlink("a.groom", at.join("link.exr")).expect("linked");
        refused(at, line, &["is a file of the scene"]);
    }
    refused(
        at,
        "lights a.exr -o b.lights --hair a.toml --timings a.toml",
        &["a.toml", "is an input"],
    );
    let mut view = strandview();
    view.current_dir(at)
        .args(["a.toml", "--backend", "cpu", "--frame", "link.png"]);
    assert_refused(&mut view, &["is a file of the scene"]);
    // The log of a window, which is not opened.
    let scene = read(at, "a.toml");
    for (log, what) in [
        ("a.toml", "a.toml: is an input"),
        ("link.png", "link.png: is a file of the scene"),
    ] {
        let mut view = strandview();
        view.current_dir(at).args(["a.toml", "--log", log]);
        assert_refused(&mut view, &[what]);
    }
    assert!(read(at, "a.groom") == groom && read(at, "a.toml") == scene);
}

#[test]
fn inputs_that_never_end_are_refused() {
    let folder = samples();
    let at = folder.path();
    for line in [
        "inspect /dev/zero",
        "lights /dev/zero -o x",
        "groom import /dev/zero -o x",
        "export /dev/zero -o x.json",
        "render /dev/zero -o x.png",
        "compare /dev/zero /dev/zero",
    ] {
        refused(at, line, &["/dev/zero"]);
        let piped = line.replace("/dev/zero", "-");
        bash_refused(at, &format!("$S {piped} < /dev/zero"), &["-: "]);
        bash_refused(at, &format!("cat /dev/zero | $S {piped}"), &["-: "]);
    }
    bash_refused(
        at,
        "yes '# endless' | $S render - -o x.png",
        &["file length is over 1048576 bytes, must be at most 1048576"],
    );
    bash_refused(at, "$S inspect - < .", &["-: is a directory"]);
    bash_refused(
        at,
        "$S inspect - < /dev/null",
        &["-: not a table file", "mesh", "panorama"],
    );
    bash_refused(
        at,
        "$S lights - -o x < /dev/null",
        &["-: the file is empty"],
    );
    assert!(!at.join("x").exists());
}

/// The folder is tried before anything else is done: every line has another fault, found later.
#[test]
fn a_folder_that_takes_no_files_is_noticed_first() {
    let folder = samples();
    let at = folder.path();
    for line in [
        "lights missing.exr -o /proc/x.lights",
        "lights missing.exr -o x.lights --report /proc/x.json",
        "tables -o /proc/x.tables",
        "groom import missing.hair -o /proc/x.groom",
        "groom generate --style bob --points-per-strand 5000 -o /proc/x.groom",
        "render missing.toml -o /proc/x.png",
        "render a.toml --turntable 2 --backend cpu -o /proc",
        "reference missing.toml --method path -o /proc/x.exr",
        "export a.lights -o /proc/x.json",
        "export a.tables -o /proc/x.npy",
        "compare missing.exr missing.exr --heatmap /proc/x.png",
        "scenes -o /proc",
        "bench single -o /proc",
        "bench plots -o /proc",
        "demo --output /proc",
    ] {
        refused(at, line, &["the folder /proc takes no new file"]);
    }
    assert_refused(
        strandview()
            .current_dir(at)
            .args(["missing.toml", "--frame", "/proc/x.png"]),
        &["the folder /proc takes no new file"],
    );
    let turn = ["a.toml", "--turntable", "2", "--out", "/proc"];
    assert_refused(
        strandview().current_dir(at).args(turn),
        &["the folder /proc takes no new file"],
    );
}

#[test]
fn an_interrupt_leaves_no_temporary_file() {
    let folder = samples();
    let at = folder.path();
    let signal = |child: &std::process::Child, name: &str| {
        let id = child.id().to_string();
        let status = Command::new("kill").args([name, &id]).status();
        assert!(status.expect("kill starts").success());
    };
    // Waiting for a reader that never comes.
    assert!(bash(at, "mkfifo pipe").status.success());
    for (name, code) in [("-INT", 130), ("-TERM", 143)] {
        let mut child = command(at, "groom import a.hair -o pipe")
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        std::thread::sleep(Duration::from_millis(500));
        signal(&child, name);
        assert_eq!(child.wait().expect("it ends").code(), Some(code));
    }
    // A terminal is closed. What was started to outlive it, as by `nohup`, does.
    #[cfg(target_os = "linux")]
    for (way, goes_on) in [("--default-signal", false), ("--ignore-signal", true)] {
        let mut env = Command::new("env");
        env.current_dir(at).arg(format!("{way}=HUP"));
        env.arg(strandlight().get_program());
        env.args("groom import a.hair -o pipe".split(' '));
        let mut child = env.stderr(Stdio::piped()).spawn().expect("it starts");
        std::thread::sleep(Duration::from_millis(500));
        signal(&child, "-HUP");
        let mut code = 129;
        if goes_on {
            std::thread::sleep(Duration::from_millis(500));
            assert!(child.try_wait().expect("a child").is_none());
            signal(&child, "-TERM");
            code = 143;
        }
        assert_eq!(child.wait().expect("it ends").code(), Some(code), "{way}");
    }
    // While a file of 58 MB is written. Whoever is too late tries again.
    let out = at.join("out");
    fs::create_dir(&out).expect("a folder");
    let line = "groom generate --style straight --strands 100000 --points-per-strand 48 -o x.groom";
    let caught = (0..8).any(|_| {
        let mut child = command(&out, line)
            .args(["--quiet"])
            .stdout(Stdio::null())
            .spawn()
            .expect("it starts");
        let is_half = |entry: &fs::DirEntry| {
            let is_temporary = entry.path().extension().is_some_and(|kind| kind == "tmp");
            is_temporary && entry.metadata().is_ok_and(|data| data.len() > 0)
        };
        let mut seen = false;
        while !seen && child.try_wait().expect("a child").is_none() {
            let mut entries = fs::read_dir(&out).expect("a folder").flatten();
            seen = entries.any(|entry| is_half(&entry));
        }
        if seen {
            // By itself it may just have ended.
            let id = child.id().to_string();
            let _ = Command::new("kill").args(["-INT", &id]).status();
        }
        let code = child.wait().expect("it ends").code();
        let names = names_in(&out);
        match code {
            Some(130) => assert!(names.is_empty() || names == ["x.groom"], "{names:?}"),
            _ => assert_eq!(names, ["x.groom"]),
        }
        code == Some(130)
    });
    assert!(caught, "never interrupted in time");
}

/// The names below `Commands:` in the help of `strandlight WORDS`.
fn subcommands(words: &[String]) -> Vec<String> {
    let help = assert_done(strandlight().args(words).arg("--help"));
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    list.take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

/// All commands without subcommands, each with its help.
fn commands() -> BTreeMap<String, String> {
    let mut open = vec![Vec::new()];
    let mut found = BTreeMap::new();
    while let Some(words) = open.pop() {
        let below = subcommands(&words);
        // Some with subcommands do something by themselves, too.
        let is_command =
            matches!(&words[..], [name] if ["bake", "lights", "reference"].contains(&&**name));
        if below.is_empty() || is_command {
            let help = assert_done(strandlight().args(&words).arg("--help"));
            found.insert(words.join(" "), help);
        }
        for name in below {
            open.push([&words[..], &[name]].concat());
        }
    }
    found
}

/// The one document on stdout of a command that failed.
fn failure(folder: &Path, line: &str, code: i32) -> Value {
    let output = command(folder, line).output().expect("it starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{line}: {stderr}");
    assert_eq!(stderr.lines().count(), 1, "{line}: {stderr}");
    let document: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{line}: {error}: {:?}", output.stdout));
    let error = &document["error"];
    if !error.is_null() {
        assert_eq!(error["exit_code"], code, "{line}");
        assert_eq!(error["kind"], ["check", "input"][(code == 2) as usize]);
        let message = error["message"].as_str().expect("a message");
        assert_eq!(stderr, format!("strandlight: {message}\n"));
    }
    document
}

#[test]
fn every_command_with_json_answers_failures_in_json() {
    let folder = samples();
    let at = folder.path();
    let commands = commands();
    assert!(commands.len() >= 18, "{commands:?}");
    // One line for each command, of what is found to be wrong when it runs.
    let lines = [
        ("bake", "missing.toml"),
        ("bake status", "missing.toml"),
        ("bench converge", "missing.toml"),
        ("bench edit", "--tables missing.tables"),
        ("bench frames", "missing.toml"),
        ("bench growth", "--svg a.groom"),
        ("bench multiple", "--n 1 --repetitions 0 --seed x"),
        ("bench peers", "missing.toml"),
        ("bench plots", "-o a.groom"),
        ("bench single", "-o a.groom"),
        ("bench transmittance", "missing.toml"),
        ("compare", "missing.exr missing.exr"),
        ("groom check", "missing.groom"),
        ("groom stats", "missing.groom"),
        ("inspect", "missing.groom"),
        ("lights", "missing.exr -o x.lights"),
        ("reference", "missing.toml --method path -o x.exr"),
        ("reference merge", "missing.exr -o x.exr"),
        ("render", "missing.toml -o x.png"),
        ("scenes", "-o a.groom"),
        ("stress", "--tables missing.tables"),
        ("tables", "-o missing/x.tables"),
        ("verify", "missing.groom"),
    ];
    let lines: BTreeMap<&str, &str> = lines.into_iter().collect();
    let with_json = commands.iter().filter(|(_, help)| help.contains("--json"));
    let with_json: Vec<&str> = with_json.map(|(name, _)| &**name).collect();
    let known: Vec<&str> = lines.keys().copied().collect();
    assert_eq!(with_json, known, "a command without a line here");
    for (name, rest) in lines {
        let document = failure(at, &format!("{name} --json {rest}"), 2);
        // `verify` has a document of its own.
        assert!(
            name == "verify" || document["error"].is_object(),
            "{name}: {document}"
        );
        let usage = failure(at, &format!("{name} --json --no-such-option"), 2);
        assert!(
            usage["error"]["message"]
                .as_str()
                .is_some_and(|text| text.contains("--no-such"))
        );
    }
    // No command at all, and words after `--`, which are no options.
    failure(at, "no-such-command --json", 2);
    refused(
        at,
        "inspect --no-such-option -- --json",
        &["--no-such-option"],
    );
}

#[test]
fn a_command_with_a_document_of_its_own_prints_no_other() {
    let folder = samples();
    let at = folder.path();
    for (name, exposure) in [("a", 0), ("b", 1)] {
        let line = "render a.toml --backend cpu --size 12x8 --samples 4";
        done(
            at,
            &format!("{line} --set render.exposure={exposure} -o {name}.png"),
        );
    }
    let document = failure(at, "compare a.png b.png --tolerance 0 --json", 1);
    assert_eq!(document["passed"], false);
    assert!(document["error"].is_null());
}
#[test]
fn quiet_leaves_results_and_errors() {
    let folder = samples();
    let at = folder.path();
    let run = |line: &str| command(at, line).output().expect("it starts");
    // The sample is so small that a note asks for its unit.
    let loud = run("groom import a.hair -o x.groom");
    assert!(!loud.stderr.is_empty());
    for line in [
        "--quiet groom import a.hair -o x.groom",
        "groom import --quiet a.hair -o x.groom",
    ] {
        let quiet = run(line);
        assert!(
            quiet.status.success() && quiet.stderr.is_empty(),
            "{quiet:?}"
        );
        assert_eq!(quiet.stdout, loud.stdout);
    }
    let render = "render a.toml --backend cpu --size 12x8 --samples 4 -o x.png";
    assert!(!run(render).stderr.is_empty());
    assert!(run(&format!("{render} --quiet")).stderr.is_empty());
    let piped = run("groom import a.hair -o - --quiet");
    assert!(piped.stderr.is_empty() && piped.stdout == read(at, "x.groom"));
    refused(at, "inspect missing.groom --quiet", &["missing.groom"]);
}

#[test]
fn any_number_of_threads_makes_the_same_files() {
    let folder = samples();
    let at = folder.path();
    done(at, "lights a.exr --count 6 -o one.lights --threads 1");
    done(at, "--threads 3 lights a.exr --count 6 -o three.lights");
    let one = read(at, "one.lights");
    assert!(one == read(at, "three.lights"));
    assert_eq!(
        LightSet::from_bytes(&one)
            .expect("valid")
            .info
            .requested_count,
        6
    );
    let style = "groom generate --style curly --strands 200";
    done(at, &format!("{style} -o one.groom --threads 1"));
    done(at, &format!("{style} -o two.groom --threads 2"));
    assert!(read(at, "one.groom") == read(at, "two.groom"));
    for number in ["0", "1025", "-1", "two"] {
        refused(at, &format!("tables -o x --threads={number}"), &[number]);
    }
}
