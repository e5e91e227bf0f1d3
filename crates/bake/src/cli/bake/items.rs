//! The items of a manifest, and what is known of them.

use std::path::Path;

use serde_json::{Value, json};
use strandlight_bake::manifest::{self, Item, Judgement, Manifest, judge};

use super::kinds::{KINDS, resolve};
use crate::cli::Failure;

/// A manifest and its items.
pub fn read(path: &Path) -> Result<(Manifest, Vec<Item>), Failure> {
    let manifest = Manifest::read(path, &KINDS).map_err(Failure::input)?;
    let items = manifest::items(&manifest, &resolve).map_err(Failure::input)?;
    Ok((manifest, items))
}

/// What is known of each item.
pub fn judge_all(items: &[Item]) -> Vec<(&Item, Judgement)> {
    use rayon::prelude::*;
    items.par_iter().map(|item| (item, judge(item))).collect()
}

/// Items as JSON: what they are and why.
pub fn rows<'a>(judged: impl Iterator<Item = &'a (&'a Item, Judgement)>) -> Vec<Value> {
    let rows = judged.map(|(item, judgement)| {
        let reasons: Vec<String> = judgement.reasons.iter().map(ToString::to_string).collect();
        json!({
            "item": item.name(),
            "kind": item.kind.name,
            "state": judgement.state().name(),
            "reasons": reasons,
            "error": judgement.failure,
            "key": judgement.key(),
        })
    });
    rows.collect()
}
