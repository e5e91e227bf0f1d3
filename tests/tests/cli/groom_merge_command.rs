//! `strandlight groom merge` from the outside.

use std::fs;
use std::path::Path;
use std::process::Command;

use strandlight_formats::{BakedFile, Groom};
use strandlight_tests::{assert_refused, strandlight};

fn command(folder: &Path, line: &str) -> Command {
    let mut command = strandlight();
    command.current_dir(folder).args(line.split_whitespace());
    command
}

/// Does the line; answers what it said on stderr.
fn done(folder: &Path, line: &str) -> String {
    let output = command(folder, line).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{line}: {said}");
    said
}

fn groom(path: &Path) -> Groom {
    Groom::read(path).expect("a groom")
}

/// Three pieces of hair as TressFX has it, a file each; `c` of longer strands.
fn pieces(at: &Path) {
    for (name, points, z) in [("a", 16, 1), ("b", 16, 20), ("c", 32, -20)] {
        let line = format!("--style bob --strands 8 --points-per-strand {points} --seed {points}");
        done(at, &format!("groom generate {line} -o whole.groom"));
        let line = format!("groom transform whole.groom --translate 0,0,{z} -o {name}.tfx");
        done(at, &line);
    }
    fs::remove_file(at.join("whole.groom")).expect("there");
}

#[test]
fn files_of_one_head_become_one_groom() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    pieces(at);
    let said = done(at, "groom merge a.tfx b.tfx c.tfx -o all.groom");
    assert!(said.contains("group_id: 0 a, 1 b, 2 c"), "{said}");
    assert!(said.contains("all.groom: kept: points"), "{said}");
    assert!(said.contains("group_id; dropped: nothing"), "{said}");
    let all = groom(&at.join("all.groom"));
    let mut first = 0;
    for name in ["a", "b", "c"] {
        done(at, &format!("groom import {name}.tfx -o one.groom"));
        let one = groom(&at.join("one.groom"));
        assert_eq!(one.n_strands(), 8);
        for ix in 0..8 {
            let points = &all.points[all.strand(first + ix)];
            assert_eq!(points, &one.points[one.strand(ix)], "{name}, strand {ix}");
        }
        first += 8;
    }
    assert_eq!(all.n_strands(), first);
    let groups = &all.attribute("group_id").expect("groups").data;
    assert_eq!(groups[7..9], [0.0, 1.0]);
    assert_eq!(groups[23], 2.0);
    // The same bytes again, on any number of threads.
    done(
        at,
        "groom merge a.tfx b.tfx c.tfx -o again.groom --threads 1",
    );
    let [a, b] = ["all", "again"].map(|name| fs::read(at.join(format!("{name}.groom"))));
    assert_eq!(a.expect("written"), b.expect("written"));

    // The names of groups reach the programs that read them, and come back.
    done(at, "groom merge a.tfx b.tfx -o ab.groom");
    done(at, "groom convert ab.groom -o ab.abc");
    let said = done(at, "groom merge c.tfx ab.abc all.groom -o more.groom");
    assert!(said.contains("group_id: 0 a, 1 b, 3 c"), "{said}");
    let more = groom(&at.join("more.groom"));
    let groups = &more.attribute("group_id").expect("groups").data;
    let of_each = |strand: usize| groups[8 * strand];
    assert_eq!(
        [0, 1, 2, 3, 4, 5].map(of_each),
        [3.0, 0.0, 1.0, 0.0, 1.0, 3.0]
    );

    // Into another format: TressFX has strands of one length.
    done(at, "groom merge a.tfx b.tfx -o ab.tfx");
    done(at, "groom import ab.tfx -o back.groom");
    assert_eq!(groom(&at.join("back.groom")).n_strands(), 16);
}

#[test]
fn what_not_all_have_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    pieces(at);
    done(
        at,
        "groom generate --style wavy --strands 5 --points-per-strand 8 -o d.groom",
    );
    done(at, "export d.groom -o d.hair");
    let said = done(at, "groom merge d.hair a.tfx -o all.groom");
    assert!(
        said.contains("a has no diameter: 0.008 cm, as drawn, is taken"),
        "{said}"
    );
    assert!(
        said.contains("thickness (diameter stands for it)"),
        "{said}"
    );
    let all = groom(&at.join("all.groom"));
    let diameter = &all.attribute("diameter").expect("kept").data;
    assert_eq!(
        diameter.len() % 13,
        0,
        "one for each strand, or each of its points"
    );
    assert!(diameter[0] > diameter[diameter.len() - 1]);
    done(at, "verify all.groom");

    let refused = |line: &str, needles: &[&str]| assert_refused(&mut command(at, line), needles);
    refused("groom merge a.tfx -o x.groom", &["2 values", "FILE"]);
    refused(
        "groom merge --quiet a.tfx none.tfx -o x.groom",
        &["none.tfx"],
    );
    refused(
        "groom merge a.tfx b.tfx -o b.tfx",
        &["b.tfx", "is an input"],
    );
    refused(
        "groom merge a.tfx b.tfx -o x.doc",
        &["x.doc", "can be exported to"],
    );
    fs::write(
        at.join("bad.tfx"),
        &fs::read(at.join("a.tfx")).expect("there")[..200],
    )
    .expect("written");
    refused("groom merge --quiet a.tfx bad.tfx -o x.groom", &["bad.tfx"]);
    assert!(!at.join("x.groom").exists());
}
