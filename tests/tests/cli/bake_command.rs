//! `strandlight bake`: nothing is made twice, reasons are told, shards and killed runs give the same
//! bytes, and whatever is wrong is named.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use strandlight_formats::{BakedFile, LightSet};
use strandlight_tests::samples::hair_file;
use strandlight_tests::{assert_done, assert_refused, strandlight};

const HEAD: &str = "version = 1\n";
const GROOMS: &str = "[[groom]]\nin = 'hair/*.hair'\nout = 'out/{stem}.groom'\n";

/// A folder with `bake.toml` that says `text` and `n` hair files in `hair`.
fn project(text: &str, n: u32) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    fs::create_dir(at.join("hair")).expect("made");
    for ix in 0..n {
        let path = at.join(format!("hair/h{ix}.hair"));
        fs::write(path, hair_file(20 + ix, 6)).expect("written");
    }
    manifest(at, text);
    folder
}

fn manifest(at: &Path, text: &str) {
    fs::write(at.join("bake.toml"), format!("{HEAD}{text}")).expect("written");
}

/// A Radiance map of 64 x 32 pixels, brighter towards one side.
fn radiance_map(seed: u8) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n".to_vec();
    for y in 0..32u8 {
        for x in 0..64u8 {
            bytes.extend([40 + x, 140 + seed, 130 + 2 * y, 128]);
        }
    }
    bytes
}

fn command(at: &Path, line: &str) -> Command {
    let mut command = strandlight();
    command.current_dir(at).args(line.split_whitespace());
    command
}

fn done(at: &Path, line: &str) -> String {
    assert_done(&mut command(at, line))
}

fn refused(at: &Path, line: &str, needles: &[&str]) {
    assert_refused(&mut command(at, line), needles);
}

fn output(at: &Path, line: &str) -> Output {
    command(at, line).output().expect("it starts")
}

fn json(at: &Path, line: &str) -> Value {
    serde_json::from_str(&done(at, line)).expect("one JSON document")
}

/// All files below `folder` with their bytes.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let Ok(entries) = fs::read_dir(folder) else {
        return files;
    };
    for entry in entries {
        let path = entry.expect("readable").path();
        let name = PathBuf::from(path.file_name().expect("a name"));
        match path.is_dir() {
            true => files.extend(
                tree(&path)
                    .into_iter()
                    .map(|(below, it)| (name.join(below), it)),
            ),
            false => drop(files.insert(name, fs::read(&path).expect("readable"))),
        }
    }
    files
}

#[test]
fn a_second_run_does_nothing() {
    let text = format!(
        "{GROOMS}unit = 'cm'\n[defaults.lights]\ncount = 2\n\
         [[lights]]\nmap = 'sky.hdr'\nout = 'out/sky.lights'\nreport = 'out/sky.json'\n"
    );
    let folder = project(&text, 3);
    let at = folder.path();
    fs::write(at.join("sky.hdr"), radiance_map(0)).expect("written");
    let said = done(at, "bake bake.toml");
    assert!(said.starts_with("4 made, "), "{said}");
    let made = tree(&at.join("out"));
    // Three grooms, a light set, its report, four records.
    assert_eq!(made.len(), 9, "{:?}", made.keys());
    let set = LightSet::read(&at.join("out/sky.lights")).expect("a light set");
    assert_eq!(set.lights.len(), 2);
    let report: Value = serde_json::from_slice(&made[Path::new("sky.json")]).expect("JSON");
    assert_eq!(report["count"], 2);
    assert!(report.get("seconds").is_none() && report["fibre_error"].is_number());
    // As the commands write them.
    done(at, "lights sky.hdr -o alone.lights --count 2");
    done(at, "groom import hair/h1.hair -o alone.groom --unit cm");
    for (alone, of_bake) in [("alone.lights", "sky.lights"), ("alone.groom", "h1.groom")] {
        assert_eq!(
            fs::read(at.join(alone)).expect("read"),
            made[Path::new(of_bake)]
        );
    }

    let stamps = || -> Vec<_> {
        let files = tree(&at.join("out")).into_keys();
        files
            .map(|path| fs::metadata(at.join("out").join(path)).and_then(|data| data.modified()))
            .map(|time| time.expect("a time"))
            .collect()
    };
    let before = stamps();
    let said = done(at, "bake bake.toml");
    assert!(said.starts_with("4 up to date, "), "{said}");
    assert_eq!(stamps(), before);
    // From elsewhere, with another name for the manifest.
    let elsewhere = tempfile::tempdir().expect("a folder");
    let line = format!("bake {}/./bake.toml --json", at.display());
    assert_eq!(json(elsewhere.path(), &line)["up_to_date"], 4);
    // All again, to the same bytes.
    assert!(done(at, "bake bake.toml --force --jobs 3").starts_with("4 made, "));
    assert_eq!(tree(&at.join("out")), made);
}

#[test]
fn reasons_are_told_and_nothing_is_written() {
    let folder = project(GROOMS, 3);
    let at = folder.path();
    let dry = "bake bake.toml --dry-run";
    let said = done(at, dry);
    assert!(said.contains("out/h0.groom: is missing\n"), "{said}");
    assert!(said.ends_with("3 to make, 0 up to date\n"), "{said}");
    assert!(!at.join("out").exists());
    done(at, "bake bake.toml");
    let made = tree(&at.join("out"));
    assert_eq!(done(at, dry), "0 to make, 3 up to date\n");

    let restore = |name: &str| fs::write(at.join("out").join(name), &made[Path::new(name)]);
    let hair = fs::read(at.join("hair/h0.hair")).expect("read");
    fs::write(at.join("hair/h0.hair"), hair_file(50, 6)).expect("written");
    assert!(done(at, dry).starts_with("out/h0.groom: in hair/h0.hair changed\n1 to make"));
    fs::write(at.join("hair/h0.hair"), hair).expect("written");

    manifest(at, &format!("{GROOMS}unit = 'mm'\nup = 'y'\n"));
    let said = done(at, dry);
    assert!(
        said.starts_with("out/h0.groom: unit none -> mm; up none -> y\n"),
        "{said}"
    );
    manifest(at, GROOMS);

    // One bit, at the same length.
    let mut bytes = made[Path::new("h1.groom")].clone();
    bytes[300] ^= 1;
    fs::write(at.join("out/h1.groom"), bytes).expect("written");
    let said = done(at, dry);
    assert!(
        said.starts_with("out/h1.groom: was altered or is damaged\n1 to"),
        "{said}"
    );
    restore("h1.groom").expect("written");

    let record = ".strandlight-bake/h2.groom.json";
    let text = String::from_utf8(made[Path::new(record)].clone()).expect("UTF-8");
    for (changed, needle) in [
        (
            text.replace("strandlight 0", "strandlight 9"),
            "made by strandlight 9",
        ),
        (
            text.replace("\"key\": \"", "\"key\": \"x"),
            "damaged record: another key",
        ),
        (text[..100].to_owned(), "damaged record"),
        (
            text.replace("\"version\": 1", "\"version\": 2"),
            "record of version 2",
        ),
    ] {
        assert_ne!(changed, text);
        fs::write(at.join("out").join(record), changed).expect("written");
        let said = done(at, dry);
        assert!(
            said.starts_with("out/h2.groom: ") && said.contains(needle),
            "{said}"
        );
    }
    fs::remove_file(at.join("out").join(record)).expect("removed");
    let said = done(at, dry);
    assert!(
        said.starts_with("out/h2.groom: it is there, but not by a bake\n"),
        "{said}"
    );

    // Whatever was wrong, one run mends it.
    fs::remove_file(at.join("out/h0.groom")).expect("removed");
    assert!(done(at, "bake bake.toml").starts_with("2 made, 1 up to date"));
    assert_eq!(tree(&at.join("out")), made);

    let document = json(at, "bake bake.toml -n --force --json");
    assert_eq!(document["items"].as_array().map(Vec::len), Some(3));
}

#[test]
fn shards_together_make_the_same_bytes() {
    let folder = project(&GROOMS.replace("out/", "deep/er/"), 8);
    let at = folder.path();
    done(at, "bake bake.toml");
    let whole = tree(&at.join("deep"));
    assert_eq!(whole.len(), 16);
    for n in [1, 3, 7] {
        fs::remove_dir_all(at.join("deep")).expect("removed");
        let mut n_made = 0;
        for shard in (0..n).rev() {
            let document = json(at, &format!("bake bake.toml --shard {shard}/{n} --json"));
            n_made += document["made"].as_u64().expect("a number");
            assert_eq!(document["up_to_date"], 0);
        }
        assert_eq!(n_made, 8, "{n}");
        assert_eq!(tree(&at.join("deep")), whole, "{n}");
    }
    let slurm = |id: &str| {
        let mut command = command(at, "bake bake.toml --dry-run --force --shard auto");
        command.envs([
            ("SLURM_ARRAY_TASK_ID", id),
            ("SLURM_ARRAY_TASK_MIN", "1"),
            ("SLURM_ARRAY_TASK_COUNT", "3"),
        ]);
        assert_done(&mut command)
    };
    assert!(slurm("1").starts_with("deep/er/h0.groom: --force\ndeep/er/h3.groom: --force\n"));
    assert!(slurm("3").starts_with("deep/er/h2.groom: --force\ndeep/er/h5.groom: --force\n"));
    let mut pod = command(at, "bake bake.toml --dry-run --force --shard auto/8");
    pod.env("JOB_COMPLETION_INDEX", "7");
    assert_eq!(
        assert_done(&mut pod),
        "deep/er/h7.groom: --force\n1 to make, 0 up to date\n"
    );
    refused(at, "bake bake.toml --shard 3/3", &["3/3", "count from 0"]);
}

#[test]
fn wrong_manifests_are_refused_with_their_place() {
    let folder = project("", 2);
    let at = folder.path();
    fs::write(at.join("sky.hdr"), radiance_map(0)).expect("written");
    fs::write(at.join("hair/h0.HAIR"), "").expect("written");
    let lights = "[[lights]]\nmap = 'sky.hdr'\nout = 'sky.lights'\n";
    for (text, needle) in [
        (
            "[[grooms]]\n",
            "bake.toml:2:3: grooms: unknown; did you mean groom?",
        ),
        (
            &format!("{lights}cuont = 3\n"),
            "bake.toml:5:9: lights[0].cuont: unknown; did you mean count?",
        ),
        (
            &format!("{lights}count = 0\n"),
            "bake.toml:5:9: lights[0].count: invalid value '0'",
        ),
        (
            "[defaults.lights]\ncount = 2000\n[[lights]]\nmap = 'sky.hdr'\nout = 'sky.lights'\n",
            "bake.toml:3:9: defaults.lights.count: invalid value '2000'",
        ),
        (
            &format!("{lights}no_report = true\nreport = 'r.json'\n"),
            "bake.toml:6:10: lights[0].report: cannot be used with no_report",
        ),
        (
            &format!("{lights}suns = 2\n"),
            "lights[0]: residual is missing",
        ),
        (
            &format!("{lights}frizzle = 2\n"),
            "lights[0].frizzle: unknown; known are map, out, report, ",
        ),
        (
            "[[groom]]\nin = 'hair/h0.hair'\nout = 5\n",
            "bake.toml:4:7: groom[0].out: is 5, must be a name in quotes",
        ),
        (
            "[[tables]]\nout = 'T.tables'\n[[tables]]\nout = 't.tables'\n",
            "t.tables is the same file as T.tables, an output of tables[0], on Windows and macOS",
        ),
        (
            "[[groom]]\nin = 'no/*.hair'\nout = 'x.groom'\n",
            "groom[0].in: no file matches no/*.hair",
        ),
        (
            "[[groom]]\nin = '[.hair'\nout = 'x.groom'\n",
            "groom[0].in: [.hair: ",
        ),
        (
            "[[groom]]\nin = 'hair/*.hair'\nout = 'x.groom'\n",
            "bake.toml:2:1: groom[0]: x.groom is the output of hair/h0.hair and of hair/h1.hair",
        ),
        (
            "[[groom]]\nin = 'a.groom'\nout = 'b.groom'\n[[groom]]\nin = 'b.groom'\nout = './a.groom'\n",
            "is both an input and the output of groom[",
        ),
        (
            "[[tables]]\nout = 'x/../bake.tables'\n[[tables]]\nout = 'bake.tables'\n",
            "is the output of",
        ),
        (
            "[[tables]]\nout = '{stem}.tables'\n",
            "there is no input to take {stem} from",
        ),
        (
            "[[tables]]\nout = 't.lights'\n",
            "t.lights must end in .tables",
        ),
        (
            "[[tables]]\nout = 't.tables'\nlean = 1\n",
            "tables[0].lean: is 1, must be true or false",
        ),
        ("x = [", "bake.toml:2:"),
    ] {
        manifest(at, text);
        refused(at, "bake bake.toml", &[needle]);
        refused(at, "bake status bake.toml", &[needle]);
    }
    fs::write(at.join("bake.toml"), "version = 2\n").expect("written");
    refused(at, "bake bake.toml", &["bake.toml", "version 2 is newer"]);
    refused(at, "bake none.toml", &["none.toml", "No such file"]);
    refused(at, "bake", &["BAKE.toml"]);
    assert!(tree(at).keys().all(|path| !path.ends_with("x.groom")));
    manifest(at, "");
    assert!(done(at, "bake bake.toml").starts_with("no items"));
}

#[test]
fn bad_inputs_end_the_run_or_are_passed_over() {
    let folder = project(GROOMS, 5);
    let at = folder.path();
    let whole = fs::read(at.join("hair/h2.hair")).expect("read");
    fs::write(at.join("hair/h2.hair"), &whole[..whole.len() / 2]).expect("written");
    fs::remove_file(at.join("hair/h4.hair")).expect("removed");
    let text = format!("{GROOMS}[[groom]]\nin = 'hair/h4.hair'\nout = 'out/h4.groom'\n");
    manifest(at, &text);
    refused(
        at,
        "bake bake.toml --quiet",
        &["out/h2.groom: ", "hair/h2.hair", "2 items left"],
    );
    let missing = "groom[1].in: hair/h4.hair: No such file or directory";
    refused(at, "bake plan bake.toml --commands", &[missing]);
    let dry = output(at, "bake bake.toml --dry-run");
    assert_eq!(dry.status.code(), Some(2));
    let told = b"strandlight: out/h4.groom: hair/h4.hair: No such file or directory\n";
    assert_eq!(dry.stderr, told);
    let made = tree(&at.join("out"));
    assert!(made.contains_key(Path::new("h1.groom")) && !made.contains_key(Path::new("h3.groom")));

    let ended = output(
        at,
        "bake bake.toml --quiet --keep-going --json --events e.jsonl",
    );
    assert_eq!(ended.status.code(), Some(2));
    let stderr = String::from_utf8_lossy(&ended.stderr);
    let lines: Vec<&str> = stderr.lines().collect();
    assert_eq!(lines.len(), 3, "{stderr}");
    assert!(lines[0].contains("out/h2.groom: ") && lines[1].contains("hair/h4.hair: No such file"));
    assert!(
        lines[2].ends_with("bake.toml: 2 of 5 items failed"),
        "{stderr}"
    );
    let document: Value = serde_json::from_slice(&ended.stdout).expect("one JSON document");
    assert_eq!(
        (&document["made"], &document["up_to_date"]),
        (&1.into(), &2.into())
    );
    assert_eq!(document["failed"][0]["item"], "out/h2.groom");
    assert!(at.join("out/h3.groom").exists() && !at.join("out/h2.groom").exists());
    let events = fs::read_to_string(at.join("e.jsonl")).expect("read");
    let events: Vec<Value> = events
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let names: Vec<&str> = events
        .iter()
        .filter_map(|event| event["event"].as_str())
        .collect();
    let expected = [
        "run", "skipped", "skipped", "start", "failed", "start", "done", "start", "failed", "end",
    ];
    assert_eq!(names, expected);
    assert_eq!(events[4]["transient"], false);
    assert!(events[6]["seconds"].is_number() && events[6]["key"].is_string());

    let one = "version = 1\n[[groom]]\nin = 'no.hair'\nout = 'no.groom'\n";
    fs::write(at.join("one.toml"), one).expect("written");
    let said = output(at, "bake one.toml --quiet").stderr;
    assert!(
        said.ends_with(b"No such file or directory\n"),
        "none is left"
    );

    let status = done(at, "bake status bake.toml");
    for needle in [
        "done    out/h0.groom\n",
        "failed  out/h2.groom: ",
        "failed  out/h4.groom: hair/h4.hair: No such file",
        "3 done, 0 stale, 0 missing, 2 failed\n",
    ] {
        assert!(status.contains(needle), "{needle}: {status}");
    }
    let document = json(at, "bake status bake.toml --json");
    assert_eq!(document["items"][2]["state"], "failed");

    // Mended: the failure is forgotten.
    fs::write(at.join("hair/h2.hair"), whole).expect("written");
    assert!(done(at, "bake status bake.toml").contains("missing out/h2.groom"));
    fs::write(at.join("hair/h4.hair"), hair_file(9, 4)).expect("written");
    manifest(at, GROOMS);
    done(at, "bake bake.toml");
    assert!(
        tree(&at.join("out"))
            .keys()
            .all(|path| !path.to_string_lossy().contains("failed"))
    );
}

#[cfg(unix)]
#[test]
fn outputs_that_cannot_be_written_are_named_before_the_work() {
    let folder = project(GROOMS, 1);
    let at = folder.path();
    // Folders without permission stop no one who runs as root; /proc takes no files from anyone.
    for (out, needle) in [
        ("/proc/h0.groom", "takes no new file"),
        ("/proc/x/h0.groom", "cannot be written"),
        ("bake.toml/h0.groom", "cannot be written"),
        ("hair/h0.hair/x.groom", "cannot be written"),
        ("there.groom", "is a directory"),
    ] {
        fs::create_dir_all(at.join("there.groom")).expect("made");
        manifest(at, &GROOMS.replace("out/{stem}.groom", out));
        refused(at, "bake bake.toml --quiet", &[out, needle]);
    }
    manifest(at, GROOMS);
    refused(
        at,
        "bake bake.toml --cache bake.toml",
        &["bake.toml: cannot be the cache"],
    );
    refused(
        at,
        "bake bake.toml --depfile bake.toml",
        &["bake.toml", "is an input"],
    );
    refused(
        at,
        "bake bake.toml --events a --timings a",
        &["two outputs"],
    );
    let both = output(at, "bake bake.toml --events - --json");
    assert_eq!(both.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&both.stdout).contains("where --json prints"));
}

#[test]
fn files_of_the_manifest_are_not_written_over() {
    let folder = project(GROOMS, 1);
    let at = folder.path();
    done(at, "bake bake.toml");
    let before = tree(at);
    for option in ["--timings", "--depfile", "--events"] {
        refused(
            at,
            &format!("bake bake.toml {option} hair/h0.hair"),
            &["h0.hair", "is an input"],
        );
        refused(
            at,
            &format!("bake bake.toml {option} out/h0.groom"),
            &["h0.groom", "output of the manifest"],
        );
    }
    refused(
        at,
        "bake plan bake.toml --commands -o hair/h0.hair",
        &["h0.hair", "is an input"],
    );
    refused(at, "bake report bake.toml -o out/h0.groom", &["h0.groom"]);
    assert_eq!(tree(at), before);
}

#[cfg(target_os = "linux")]
#[test]
fn full_disks_are_worth_another_try() {
    let folder = project(GROOMS, 2);
    let at = folder.path();
    for option in ["--events", "--timings", "--depfile"] {
        let ended = output(at, &format!("bake bake.toml --quiet {option} /dev/full"));
        let stderr = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(75), "{option}: {stderr}");
        assert!(
            stderr.contains("/dev/full: cannot be written: No space left"),
            "{stderr}"
        );
    }
    for line in [
        "bake bake.toml",
        "bake bake.toml --json",
        "bake bake.toml --dry-run",
        "bake status bake.toml --json",
        "bake report bake.toml -o report.html",
        "bake plan bake.toml --commands",
    ] {
        let full = fs::File::create("/dev/full").expect("it opens");
        let mut command = command(at, line);
        let ended = command.stdout(full).output().expect("it starts");
        let stderr = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(75), "{line}: {stderr}");
        assert!(stderr.contains("cannot be written: No space"), "{stderr}");
    }
    // The work itself was done.
    assert!(done(at, "bake bake.toml").starts_with("2 up to date"));
    let ended = output(
        at,
        "bake bake.toml --json --events /dev/full --quiet --force",
    );
    let document: Value = serde_json::from_slice(&ended.stdout).expect("JSON");
    assert_eq!(document["made"], 2);
}

#[test]
fn a_cache_serves_other_folders() {
    let (one, two) = (project(GROOMS, 3), project(GROOMS, 3));
    let cache = tempfile::tempdir().expect("a folder");
    let line = format!(
        "bake bake.toml --json --cache {}/new/cache",
        cache.path().display()
    );
    assert_eq!(json(one.path(), &line)["made"], 3);
    let kept = tree(cache.path());
    assert_eq!(kept.len(), 6);
    assert_eq!(json(two.path(), &line)["cached"], 3);
    let whole = tree(&one.path().join("out"));
    assert_eq!(tree(&two.path().join("out")), whole);
    assert_eq!(tree(cache.path()), kept);

    // What is damaged is made again, and mended.
    let entry = kept
        .keys()
        .find(|path| path.extension().is_some_and(|end| end == "out"));
    let entry = cache.path().join(entry.expect("an output"));
    let mut bytes = fs::read(&entry).expect("read");
    bytes[200] ^= 1;
    fs::write(&entry, bytes).expect("written");
    fs::remove_dir_all(two.path().join("out")).expect("removed");
    let document = json(two.path(), &line);
    assert_eq!(
        (&document["made"], &document["cached"]),
        (&1.into(), &2.into())
    );
    assert_eq!(tree(&two.path().join("out")), whole);
    assert_eq!(tree(cache.path()), kept);
}

#[test]
fn a_report_lists_the_worst_first_and_what_changed() {
    let text = "[[lights]]\nmap = 'maps/*.hdr'\nout = 'out/{stem}.lights'\n\
                [defaults.lights]\ncount = 2\n";
    let folder = project(text, 0);
    let at = folder.path();
    fs::create_dir(at.join("maps")).expect("made");
    for ix in 0..2 {
        fs::write(at.join(format!("maps/m{ix}.hdr")), radiance_map(40 * ix)).expect("written");
    }
    done(at, "bake bake.toml");
    done(at, "bake report bake.toml -o one.json -o one.html");
    let read = |name: &str| fs::read_to_string(at.join(name)).expect("read");
    let one: Value = serde_json::from_str(&read("one.json")).expect("JSON");
    let errors: Vec<f64> = one["items"]
        .as_array()
        .expect("items")
        .iter()
        .map(|row| row["figures"]["fibre_error"].as_f64().expect("a figure"))
        .collect();
    assert!(errors.len() == 2 && errors[0] > errors[1], "{errors:?}");
    assert!(one.get("removed").is_none());

    fs::write(at.join("maps/m2.hdr"), radiance_map(90)).expect("written");
    fs::write(at.join("maps/m0.hdr"), radiance_map(20)).expect("written");
    fs::remove_file(at.join("maps/m1.hdr")).expect("removed");
    done(at, "bake bake.toml");
    let line = "bake report bake.toml -o two.json -o two.html --since one.json";
    done(at, line);
    let (json, page) = (read("two.json"), read("two.html"));
    let two: Value = serde_json::from_str(&json).expect("JSON");
    let change = |name: &str| {
        let rows = two["items"].as_array().expect("items");
        let row = rows.iter().find(|row| row["item"] == name).expect("listed");
        row["change"]["is"].clone()
    };
    assert_eq!(change("out/m0.lights"), "changed");
    assert_eq!(change("out/m2.lights"), "new");
    assert_eq!(two["removed"], serde_json::json!(["out/m1.lights"]));
    assert!(
        page.contains("1 new, 1 changed, 1 removed: out/m1.lights"),
        "{page}"
    );
    assert!(!page.contains("http"), "it needs nothing else");
    done(at, line);
    assert_eq!((read("two.json"), read("two.html")), (json, page));
    refused(
        at,
        "bake report bake.toml -o r.txt",
        &["r.txt", ".html or .json"],
    );
    refused(
        at,
        "bake report bake.toml -o r.json --since bake.toml",
        &["not a bake report"],
    );
    fs::write(at.join("newer.json"), r#"{"version": 9, "items": []}"#).expect("written");
    refused(
        at,
        "bake report bake.toml -o r.json --since newer.json",
        &["newer.json", "its version is 9"],
    );
}

#[test]
fn render_managers_read_how_far_it_is() {
    let folder = project(GROOMS, 4);
    let at = folder.path();
    done(at, "bake bake.toml --shard 0/4");
    let text = done(at, "bake bake.toml --progress openjd --jobs 2");
    let lines: Vec<&str> = text.lines().collect();
    let percents = [25, 50, 75, 100].map(|percent| format!("openjd_progress: {percent}.0"));
    assert_eq!(lines[..4], percents, "{text}");
    assert!(lines[4].starts_with("3 made, 1 up to date"), "{text}");
    let line = "bake bake.toml --progress openjd --events -";
    refused(at, line, &["both write to standard output"]);
    let line = "bake bake.toml --progress openjd --dry-run";
    refused(at, line, &["cannot be used with"]);
}

#[test]
fn plans_have_a_task_for_each_shard() {
    let folder = project(GROOMS, 3);
    let at = folder.path();
    let commands = done(at, "bake plan bake.toml --commands --shards 3");
    assert_eq!(commands.lines().count(), 3);
    for line in commands.lines() {
        let words = line.strip_prefix("strandlight ").expect("the program");
        assert!(done(at, words).starts_with("1 made"), "{line}");
    }
    assert_eq!(
        done(at, "bake plan bake.toml --commands").lines().count(),
        1
    );
    let script = done(at, "bake plan bake.toml --slurm --shards 7 --cache c");
    assert!(
        script.contains("#SBATCH --array=0-6\n") && script.contains("--cache=c"),
        "{script}"
    );
    for farm in ["--openjd", "--k8s"] {
        assert!(done(at, &format!("bake plan bake.toml {farm}")).contains("bake.toml"));
    }
    refused(at, "bake plan bake.toml", &["--slurm"]);
    refused(at, "bake plan - --commands", &["tasks", "standard input"]);
    refused(
        at,
        "bake plan bake.toml --slurm --k8s",
        &["cannot be used with"],
    );
    refused(at, "bake plan bake.toml --slurm --shards 0", &["--shards"]);
    // What would do nothing, and what Kubernetes would not take.
    for (options, needle) in [
        ("--slurm --image i", "--image"),
        ("--openjd --claim c", "--claim"),
        ("--commands --folder f", "--folder"),
        ("--k8s --claim Hair_1", "'Hair_1'"),
        ("--k8s --folder f", "--folder f"),
        ("--k8s --image=", "--image"),
    ] {
        refused(at, &format!("bake plan bake.toml {options}"), &[needle]);
    }
    let job = done(at, "bake plan bake.toml --k8s --claim a.b-1 --folder /f");
    assert!(job.contains("claimName: \"a.b-1\"") && job.contains("mountPath: \"/f\""));
}
