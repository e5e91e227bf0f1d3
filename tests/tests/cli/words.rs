//! Words of the command line that are mistyped, or out of range.

use strandlight_tests::{assert_refused, strandview};

use crate::outputs::{refused, samples};

#[test]
fn mistyped_words_are_recognised() {
    let folder = samples();
    let at = folder.path();
    for (line, meant) in [
        ("lights a.exr -o x --cout 3", "did you mean --count?"),
        ("ligths a.exr", "did you mean lights?"),
        ("groom imprt a.hair", "did you mean export or import?"),
        ("render a.toml -o x.png --backend cpus", "did you mean cpu?"),
        ("inspect a.groom --jsn", "did you mean --json?"),
        ("tables -o x --thread 3", "did you mean --threads?"),
    ] {
        refused(at, line, &[meant, "see --help"]);
    }
    refused(
        at,
        "render a.toml -o x.png --backend cpus",
        &["[possible values: auto, gpu, cpu]"],
    );
    assert_refused(
        strandview()
            .current_dir(at)
            .args(["a.toml", "--sapmles", "3"]),
        &["did you mean --samples?"],
    );
}

#[test]
fn numbers_below_zero_are_told_as_out_of_range() {
    let folder = samples();
    for (line, range) in [
        ("lights a.exr -o x --count -4", "from 1 to 1024"),
        ("render a.toml -o x.png --samples -4", "1..=65536"),
        ("groom thin a.groom -o x.groom --strands -1", "0..="),
        ("render a.toml -o x.png --size -4x3", "like 720x480"),
        ("render a.toml -o x.png --converge --until -5%", "like 1%"),
        ("render a.toml -o x.png --time -.5s", "number of seconds"),
        (
            "render a.toml -o x --turntable 2 --shard -1/4",
            "a shard is I/N",
        ),
        ("lights a.exr -o x --max-error -1%", "in 0%..=100%"),
        (
            "groom transform a.groom -o x --translate -1,2",
            "three numbers",
        ),
    ] {
        refused(folder.path(), line, &["invalid value '-", range]);
    }
    // An option is not taken for the value of another, nor a file after -- for an option's value.
    for (line, what) in [
        (
            "render a.toml -o x.png --size --quiet",
            "a value is required",
        ),
        ("render -o x.png -- -4.toml", "-4.toml: "),
    ] {
        refused(folder.path(), line, &[what]);
    }
}

#[test]
fn numbers_that_are_none_are_told_in_plain_words() {
    let folder = samples();
    for (line, what) in [
        ("render a.toml -o x.png --samples nan", "not a whole number"),
        (
            "render a.toml -o x.png --seed 99999999999999999999",
            "too large",
        ),
        (
            "groom thin a.groom -o x.groom --strands 1.5",
            "not a whole number",
        ),
        (
            "render a.toml -o x.png --set hair=3",
            "expected keys with values",
        ),
        (
            "render a.toml -o x.png --set proxy=[3]",
            "expected keys with values",
        ),
    ] {
        refused(folder.path(), line, &[what]);
    }
}
