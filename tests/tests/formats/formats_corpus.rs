//! The fuzzers' corpus, replayed through the fuzzers' checks.

use crate::checks;

use std::fs;

use strandlight_tests::project_root;

/// Replays one folder. Files called `good...` must be accepted, all others refused; what a
/// fuzzer adds under a hash for a name must only not break a promise.
fn replay(target: &str, check: impl Fn(&[u8]) -> bool) {
    let folder = project_root().join("fuzz/corpus").join(target);
    let mut n_good = 0;
    let mut n_bad = 0;
    for entry in fs::read_dir(&folder).expect("the corpus is part of the project") {
        let path = entry.expect("readable").path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or_default()
            .to_owned();
        let good = check(&fs::read(&path).expect("readable"));
        if name.starts_with("good") {
            assert!(good, "{}", path.display());
            n_good += 1;
        } else if !name.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            assert!(!good, "{}", path.display());
            n_bad += 1;
        }
    }
    assert!(
        n_good >= 1 && n_bad >= 3,
        "{target}: only {n_good} good, {n_bad} bad files"
    );
}

#[test]
fn groom() {
    replay("groom", checks::groom);
}

#[test]
fn lights() {
    replay("lights", checks::lights);
}

#[test]
fn mesh() {
    replay("mesh", checks::mesh);
}

#[test]
fn panorama() {
    replay("panorama", checks::panorama);
}

#[test]
fn tables() {
    replay("tables", checks::tables);
}

#[test]
fn scene() {
    replay("scene", checks::scene);
}

#[test]
fn hair() {
    replay("hair", checks::hair);
}

#[test]
fn usc() {
    replay("usc", checks::usc);
}

#[test]
fn alembic() {
    replay("alembic", checks::alembic);
}

#[test]
fn tfx() {
    replay("tfx", checks::tfx);
}

#[test]
fn mitsuba() {
    replay("mitsuba", checks::mitsuba);
}

#[test]
fn pbrt() {
    replay("pbrt", checks::pbrt);
}

#[test]
fn ply() {
    replay("ply", checks::ply);
}

#[test]
fn npy() {
    replay("npy", checks::npy);
}

#[test]
fn ct2hair() {
    replay("ct2hair", checks::ct2hair);
}

#[test]
fn cube() {
    replay("cube", checks::cube);
}

#[test]
fn usd() {
    replay("usd", checks::usd);
}

/// A poor man's fuzzer over the same checks: every file of the corpus with bytes changed, cut
/// and doubled at pseudorandom places.
#[test]
fn changed_corpus() {
    let mut state = 1u64;
    let mut random = move |below: usize| {
        // A linear congruential generator (Knuth's MMIX constants); its high bits are good enough.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    type Check = fn(&[u8]) -> bool;
    let targets: [(&str, &str, Check); 26] = [
        ("groom", "good_v1", checks::groom),
        ("groom", "good_v1_1", checks::groom),
        ("lights", "good_v1", checks::lights),
        ("lights", "good_v1_1", checks::lights),
        ("mesh", "good_v1", checks::mesh),
        ("panorama", "good_v1", checks::panorama),
        ("tables", "good_v1", checks::tables),
        ("scene", "good_v1", checks::scene),
        ("hair", "good_v1", checks::hair),
        ("usc", "good_v1", checks::usc),
        ("alembic", "good_v1", checks::alembic),
        ("alembic", "good_moving", checks::alembic),
        ("tfx", "good_v2", checks::tfx),
        ("tfx", "good_v3", checks::tfx),
        ("tfx", "good_v4", checks::tfx),
        ("mitsuba", "good_lines", checks::mitsuba),
        ("pbrt", "good_scene", checks::pbrt),
        ("ply", "good_ascii", checks::ply),
        ("ply", "good_binary", checks::ply),
        ("npy", "good_single", checks::npy),
        ("ct2hair", "good", checks::ct2hair),
        ("cube", "good_grid", checks::cube),
        ("cube", "good_both", checks::cube),
        ("usd", "good_text", checks::usd),
        ("usd", "good_binary", checks::usd),
        ("usd", "good_package", checks::usd),
    ];
    let mut n_checked = 0;
    for (target, name, check) in targets {
        let file = project_root().join("fuzz/corpus").join(target).join(name);
        let bytes = fs::read(file).expect("readable");
        for _ in 0..3000 {
            let mut changed = bytes.clone();
            for _ in 0..1 + random(4) {
                let at = random(changed.len());
                match random(4) {
                    0 => changed[at] = random(256) as u8,
                    1 => changed[at] ^= 1 << random(8),
                    2 => changed.truncate(at.max(1)),
                    _ => {
                        let piece = changed[at..(at + random(16)).min(changed.len())].to_vec();
                        changed.splice(at..at, piece);
                    }
                }
            }
            check(&changed);
            n_checked += 1;
        }
    }
    assert_eq!(n_checked, 78_000);
}
