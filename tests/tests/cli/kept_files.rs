//! Outputs that would replace what somebody keeps.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};

use strandlight_tests::{assert_refused, strandview};

use crate::outputs::{names_in, read, refused, samples};

/// Tests may be run by root, whom the system would not refuse.
#[test]
fn write_protected_files_are_left_alone() {
    let folder = samples();
    let at = folder.path();
    fs::write(at.join("kept.groom"), "kept").expect("written");
    fs::write(at.join("kept.png"), "kept").expect("written");
    symlink("kept.groom", at.join("link.groom")).expect("a link");
    for name in ["kept.groom", "kept.png"] {
        // As `chmod u-w` leaves it.
        let mode = fs::Permissions::from_mode(0o464);
        fs::set_permissions(at.join(name), mode).expect("set");
    }
    let manifest = "version = 1\n[[groom]]\nin = 'a.hair'\nout = 'kept.groom'\n";
    fs::write(at.join("bake.toml"), manifest).expect("written");
    let before = names_in(at);
    for (line, name) in [
        ("groom import a.hair -o kept.groom", "kept.groom"),
        ("groom import a.hair -o link.groom", "link.groom"),
        ("render a.toml -o kept.png --backend cpu", "kept.png"),
        ("bake bake.toml --quiet", "kept.groom"),
    ] {
        let what = format!("{name}: cannot be written: is write-protected");
        refused(at, line, &[&what]);
    }
    assert_refused(
        strandview()
            .current_dir(at)
            .args(["a.toml", "--frame", "kept.png"]),
        &["kept.png: cannot be written: is write-protected"],
    );
    assert!(read(at, "kept.groom") == b"kept" && read(at, "kept.png") == b"kept");
    let after: Vec<String> = names_in(at)
        .into_iter()
        .filter(|name| name != ".strandlight-bake")
        .collect();
    assert_eq!(after, before);
}

/// Who names a map as the output of a fit means another file.
#[test]
fn names_of_other_files_are_refused() {
    let folder = samples();
    let at = folder.path();
    let before = names_in(at);
    let exr = read(at, "a.exr");
    for (line, what) in [
        (
            "lights a.exr -o b.exr",
            "b.exr: the name must end in .lights",
        ),
        (
            "lights a.exr -o b.HDR",
            "b.HDR: the name must end in .lights",
        ),
        (
            "lights a.exr -o b.lights --report a.toml",
            "a.toml: the name must end in .html or .json",
        ),
        (
            "lights a.exr -o b.lights --timings b.png",
            "b.png: the name must end in .html or .json",
        ),
        (
            "mesh generate -o b.obj",
            "b.obj: the name must end in .mesh",
        ),
        (
            "tables --lean -o b.tfx",
            "b.tfx: the name must end in .tables",
        ),
        (
            "groom generate --style bob -o b.png",
            "b.png: the name must end in .groom",
        ),
    ] {
        refused(at, line, &[what]);
    }
    assert!(names_in(at) == before && read(at, "a.exr") == exr);
}
