//! The table of edits and stages in ARCHITECTURE.md is made from the rules.

use std::fs;

use strandlight_render::invalidation::{STAGES, stale_stages};
use strandlight_runtime::session::EDITS;
use strandlight_tests::project_root;

const START: &str = "<!-- edits -->\n";
const END: &str = "<!-- end of edits -->";

fn table() -> String {
    let names = STAGES.map(|stage| stage.name);
    let mut text = format!("| edit | {} |\n", names.join(" | "));
    text += &format!("|---|{}\n", "---|".repeat(names.len()));
    for rule in EDITS {
        let stale: Vec<_> = stale_stages(rule.inputs).collect();
        let mark = |name| if stale.contains(&name) { "x" } else { "" };
        let edit = rule.name.replace('_', " ");
        text += &format!("| {edit} | {} |\n", names.map(mark).join(" | "));
    }
    text
}

/// `STRANDLIGHT_UPDATE_DOCS=1` writes it.
#[test]
fn the_table_of_edits_is_that_of_the_rules() {
    let path = project_root().join("ARCHITECTURE.md");
    let page = fs::read_to_string(&path).expect("UTF-8");
    let (before, rest) = page.split_once(START).expect("the table's start");
    let (_, after) = rest.split_once(END).expect("the table's end");
    let expected = format!("{before}{START}{}{END}{after}", table());
    if std::env::var_os("STRANDLIGHT_UPDATE_DOCS").is_some() {
        fs::write(&path, expected).expect("writable");
    } else {
        assert!(
            page == expected,
            "run with STRANDLIGHT_UPDATE_DOCS=1:\n{}",
            table()
        );
    }
}

#[test]
fn every_edit_has_one_rule() {
    let mut covered = strandlight_runtime::session::Edits::empty();
    for rule in EDITS {
        assert!(!covered.intersects(rule.edit), "{}", rule.name);
        covered |= rule.edit;
    }
    assert!(covered.is_all());
}
