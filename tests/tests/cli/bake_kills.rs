//! Runs of `strandlight bake` that are ended at any moment: the next one resumes to the same bytes, and
//! nothing half written is ever there. Make and Ninja by its depfile.
#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

use strandlight_formats::{BakedFile, Groom, LightSet};
use strandlight_tests::random::SplitMix64;
use strandlight_tests::samples::hair_file;
use strandlight_tests::{assert_done, strandlight};
use xxhash_rust::xxh3::xxh3_64;

const MANIFEST: &str = "version = 1\n[[groom]]\nin = 'hair/*.hair'\nout = 'out/{stem}.groom'\n\
                        [[lights]]\nmap = 'sky.hdr'\nout = 'out/sky.lights'\npreview = 'out/sky.png'\ncount = 2\n";

fn project(n: u32) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    fs::create_dir(at.join("hair")).expect("made");
    for ix in 0..n {
        fs::write(at.join(format!("hair/h{ix}.hair")), hair_file(300, 12)).expect("written");
    }
    let mut map = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 32 +X 64\n".to_vec();
    map.extend((0..64 * 32u32).flat_map(|ix| [90, 100, (ix / 16) as u8, 128]));
    fs::write(at.join("sky.hdr"), map).expect("written");
    fs::write(at.join("bake.toml"), MANIFEST).expect("written");
    folder
}

fn bake(at: &Path) -> Command {
    let mut command = strandlight();
    command
        .current_dir(at)
        .args(["bake", "bake.toml", "--quiet"]);
    command
}

/// Names and bytes of the files in `folder` and below.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        let Ok(entries) = fs::read_dir(&at) else {
            continue;
        };
        for path in entries.map(|entry| entry.expect("readable").path()) {
            match path.is_dir() {
                true => folders.push(path),
                false => drop(found.insert(path.clone(), fs::read(&path).unwrap_or_default())),
            }
        }
    }
    found
}

fn is_temporary(path: &Path) -> bool {
    path.extension().is_some_and(|end| end == "tmp")
}

/// Starts a run and sends it a signal after `delay`; how it ended.
fn end_after(at: &Path, delay: Duration, signal: &str) -> std::process::ExitStatus {
    let mut child: Child = bake(at).stdout(Stdio::null()).spawn().expect("it starts");
    std::thread::sleep(delay);
    let pid = child.id().to_string();
    let sent = Command::new("kill")
        .args([signal, &pid])
        .stderr(Stdio::null())
        .status();
    assert!(sent.is_ok());
    child.wait().expect("it ends")
}

/// Moments of each signal.
const MOMENTS: usize = 6;

#[test]
fn slow_runs_that_are_killed_resume_to_the_same_bytes() {
    let folder = project(12);
    let at = folder.path();
    let out = at.join("out");
    // The command may have to be built first, which is no part of the run.
    let mut first = bake(at);
    let start = Instant::now();
    assert_done(&mut first);
    let whole_run = start.elapsed();
    let whole = files(&out);
    // 12 grooms, a light set, its picture, 13 records.
    assert_eq!(whole.len(), 27, "{:?}", whole.keys());
    let mut random = SplitMix64(5);
    let (mut n_killed, mut n_partial) = (0, 0);
    for signal in ["-TERM", "-KILL"] {
        for _ in 0..MOMENTS {
            fs::remove_dir_all(&out).expect("removed");
            let delay = whole_run.mul_f64(random.uniform(0.0, 1.0));
            let status = end_after(at, delay, signal);
            match (signal, status.code(), status.signal()) {
                // Before the handler is there, the signal ends it as any program.
                ("-TERM", Some(143), _) | (_, None, Some(15 | 9)) => n_killed += 1,
                (_, Some(0), _) => {}
                _ => panic!("{signal}: {status}"),
            }
            let left = files(&out);
            for (path, bytes) in &left {
                let is_whole = whole.get(path) == Some(bytes);
                let may_stay = signal == "-KILL" && is_temporary(path);
                assert!(
                    is_whole || may_stay,
                    "{signal} after {delay:?}: {}",
                    path.display()
                );
            }
            n_partial += usize::from(!left.is_empty() && left.len() < whole.len());
            assert_done(&mut bake(at));
            assert!(
                files(&out) == whole,
                "{signal} after {delay:?}: {:?}",
                files(&out).keys()
            );
        }
    }
    assert!(
        n_killed >= MOMENTS,
        "{n_killed} of {} runs were killed",
        2 * MOMENTS
    );
    assert!(n_partial > 0, "no run was killed on its way");
    Groom::read(&out.join("h0.groom")).expect("whole");
    LightSet::read(&out.join("sky.lights")).expect("whole");
}

/// Leaves the light set out of the manifest.
fn only_grooms(at: &Path) {
    let manifest = MANIFEST.split("[[lights]]").next().expect("the grooms");
    fs::write(at.join("bake.toml"), manifest).expect("written");
}

#[test]
fn files_left_by_killed_runs_go_and_others_stay() {
    let folder = project(2);
    let at = folder.path();
    only_grooms(at);
    assert_done(&mut bake(at));
    let whole = files(&at.join("out"));
    let leave = |folder: &str, of: &str| {
        let hash = xxh3_64(of.as_bytes()) as u32;
        let path = at
            .join(folder)
            .join(format!(".strandlight-{hash:08x}-1-0.tmp"));
        fs::write(&path, "half").expect("written");
        path
    };
    leave("out", "h0.groom");
    leave("out/.strandlight-bake", "h1.groom.json");
    let of_another = leave("out", "other.groom");
    // Its writer is alive.
    let locked = leave("out", "h1.groom");
    let writer = fs::File::options()
        .write(true)
        .open(&locked)
        .expect("there");
    writer.try_lock().expect("no one else has it");
    assert_done(&mut bake(at));
    for path in [&of_another, &locked] {
        assert!(path.exists(), "{}", path.display());
    }
    fs::remove_file(of_another).expect("removed");
    drop(writer);
    assert_done(&mut bake(at));
    assert_eq!(files(&at.join("out")), whole);
}

/// Runs `line` by bash; its stdout.
fn shell(at: &Path, line: &str) -> String {
    let output = Command::new("bash")
        .current_dir(at)
        .args(["-c", line])
        .env("S", strandlight().get_program())
        .output()
        .expect("bash starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

const MAKEFILE: &str = "all: bake.stamp\nbake.stamp:\n\t$(S) bake bake.toml --quiet --depfile bake.d \
                        --depfile-target bake.stamp && touch $@ && echo ran\n-include bake.d\n";

/// Sets the time of a file to `seconds` from now.
fn set_time(path: &Path, seconds: u64) {
    let file = fs::File::options()
        .append(true)
        .open(path)
        .expect("it is there");
    let time = SystemTime::now() + Duration::from_secs(seconds);
    file.set_modified(time).expect("the time is set");
}

#[test]
fn make_runs_it_when_an_input_changes_or_goes() {
    let folder = project(1);
    let at = folder.path();
    only_grooms(at);
    let odd = "hair/odd $name #1: a.hair";
    fs::write(at.join(odd), hair_file(10, 4)).expect("written");
    fs::write(at.join("Makefile"), MAKEFILE).expect("written");
    let ran = || shell(at, "make --no-print-directory -s all").contains("ran");
    assert!(ran() && !ran());
    for (ix, name) in [odd, "bake.toml", "hair/h0.hair"].into_iter().enumerate() {
        let later = 10 * (ix as u64 + 1);
        set_time(&at.join(name), later);
        assert!(ran(), "{name}");
        set_time(&at.join("bake.stamp"), later + 5);
        assert!(!ran(), "{name}");
    }
    // Its folder changes, too; what remains is newer than that.
    fs::remove_file(at.join(odd)).expect("removed");
    for name in ["bake.toml", "hair/h0.hair", "bake.stamp"] {
        let file = fs::File::options()
            .append(true)
            .open(at.join(name))
            .expect("it is there");
        file.set_modified(SystemTime::UNIX_EPOCH)
            .expect("the time is set");
    }
    assert!(ran());
    let rules = fs::read_to_string(at.join("bake.d")).expect("read");
    assert!(
        !rules.contains("odd") && rules.contains("hair:\n"),
        "{rules}"
    );
}

#[test]
fn make_runs_it_when_an_input_comes() {
    let folder = project(1);
    let at = folder.path();
    fs::write(at.join("Makefile"), MAKEFILE).expect("written");
    let ran = || shell(at, "make --no-print-directory -s all").contains("ran");
    for out in ["out", "hair/out"] {
        let manifest =
            format!("version = 1\n[[groom]]\nin = 'hair/*.hair'\nout = '{out}/{{stem}}.groom'\n");
        fs::write(at.join("bake.toml"), manifest).expect("written");
        shell(at, "rm -f bake.stamp");
        assert!(ran() && !ran(), "{out}");
        // Times of files are coarser than clocks.
        std::thread::sleep(Duration::from_millis(50));
        let name = out.replace('/', "_");
        fs::write(at.join(format!("hair/{name}.hair")), hair_file(10, 4)).expect("written");
        assert!(ran(), "{out}");
        assert!(at.join(format!("{out}/{name}.groom")).exists());
        assert!(!ran(), "{out}");
    }
}
