//! An index of what a manifest made, the worst first, and what changed since another one.

use std::cmp::Ordering;
use std::collections::{BTreeMap, HashSet};

use serde_json::{Map, Value, json};
use strandlight_formats::tool_version;

use super::item::Item;
use super::judge::{Judgement, State};

/// The figure that items are sorted by: larger is worse.
pub const WORST_BY: &str = "fibre_error";

/// Version of the index.
pub const INDEX_VERSION: u64 = 1;

/// The index of `judged` as JSON, compared with the earlier one `before`, if there is one. Equal
/// files give equal bytes: there are no times in it.
pub fn index(judged: &[(&Item, Judgement)], before: Option<&Value>) -> Value {
    let earlier = before.map(by_name).unwrap_or_default();
    let mut rows: Vec<Value> = judged
        .iter()
        .map(|(item, judgement)| row(item, judgement, before.map(|_| &earlier)))
        .collect();
    rows.sort_by(worse_first);
    let names: HashSet<String> = judged.iter().map(|(item, _)| item.name()).collect();
    let removed: Vec<&String> = earlier
        .keys()
        .filter(|name| !names.contains(*name))
        .collect();
    let count = |state: State| {
        let states = judged.iter().map(|(_, judgement)| judgement.state());
        states.filter(|&other| other == state).count()
    };
    let states = [State::Done, State::Stale, State::Missing, State::Failed];
    let counts: Map<String, Value> = states
        .iter()
        .map(|&state| (state.name().to_owned(), json!(count(state))))
        .collect();
    let mut document = json!({
        "kind": "strandlight bake report",
        "version": INDEX_VERSION,
        "tool_version": tool_version(),
        "counts": counts,
        "items": rows,
    });
    if before.is_some() {
        document["removed"] = json!(removed);
    }
    document
}

fn by_name(document: &Value) -> BTreeMap<String, &Value> {
    let rows = document["items"].as_array().into_iter().flatten();
    let named = rows.filter_map(|row| Some((row["item"].as_str()?.to_owned(), row)));
    named.collect()
}

fn row(item: &Item, judgement: &Judgement, earlier: Option<&BTreeMap<String, &Value>>) -> Value {
    let record = judgement.record.as_ref();
    let figures = record
        .map(|record| record.figures.clone())
        .unwrap_or_default();
    let key = record.map(|record| record.key.clone());
    let mut row = json!({
        "item": item.name(),
        "kind": item.kind.name,
        "input": item.input.as_ref().map(|path| path.display().to_string()),
        "state": judgement.state().name(),
        "why": judgement.failure.clone().unwrap_or_else(|| judgement.why()),
        "key": key,
        "figures": figures,
    });
    if let Some(earlier) = earlier {
        row["change"] = change(earlier.get(&item.name()).copied(), &row);
    }
    row
}

/// `new`, `same` or `changed`, and of what changed the figure before.
fn change(before: Option<&Value>, now: &Value) -> Value {
    match before {
        None => json!({ "is": "new" }),
        Some(before) if before["key"] == now["key"] && before["state"] == now["state"] => {
            json!({ "is": "same" })
        }
        Some(before) => json!({
            "is": "changed",
            "state_before": before["state"],
            (format!("{WORST_BY}_before")): before["figures"][WORST_BY],
        }),
    }
}

/// What could not be made, then the largest errors, then what has none, by name.
fn worse_first(a: &Value, b: &Value) -> Ordering {
    let rank = |row: &Value| u8::from(row["state"] != State::Failed.name());
    let error = |row: &Value| row["figures"][WORST_BY].as_f64().unwrap_or(-1.0);
    let name = |row: &Value| row["item"].as_str().unwrap_or_default().to_owned();
    rank(a)
        .cmp(&rank(b))
        .then(error(b).total_cmp(&error(a)))
        .then_with(|| name(a).cmp(&name(b)))
}
