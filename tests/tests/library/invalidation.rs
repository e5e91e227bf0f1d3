//! The table of edits and stages in ARCHITECTURE.md is made from the rules.

use strandlight_render::invalidation::{STAGES, stale_stages};
use strandlight_runtime::session::EDITS;
use strandlight_tests::generated::check_part;
use strandlight_tests::project_root;

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

#[test]
fn the_table_of_edits_is_that_of_the_rules() {
    check_part(&project_root().join("ARCHITECTURE.md"), "edits", &table());
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
