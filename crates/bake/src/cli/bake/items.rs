//! The items of a manifest, and what is known of them.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use strandlight_bake::manifest::{self, Item, Judgement, Manifest, judge};

use strandlight_formats::output_target;

use super::kinds::{KINDS, resolve};
use crate::cli::{Failure, Outcome, check_outputs};

/// A manifest and its items.
pub fn read(path: &Path) -> Result<(Manifest, Vec<Item>), Failure> {
    let manifest = Manifest::read(path, &KINDS).map_err(Failure::input)?;
    let items = manifest::items(&manifest, &resolve).map_err(Failure::input)?;
    Ok((manifest, items))
}

/// Refuses, before any work is done, outputs beside those of the items of a manifest that cannot be written or that
/// are a file of the manifest.
pub fn check_beside(manifest: &Path, items: &[Item], outputs: &[&Path]) -> Outcome {
    let inputs: Vec<PathBuf> = items.iter().filter_map(Item::input_path).collect();
    let inputs = inputs.iter().map(PathBuf::as_path);
    let inputs: Vec<&Path> = inputs.chain(std::iter::once(manifest)).collect();
    check_outputs(&inputs, outputs)?;
    if outputs.is_empty() {
        return Ok(());
    }
    let made = items.iter().flat_map(|item| {
        let outputs = item.outputs.iter();
        outputs.filter_map(|output| output_target(&item.resolve(&output.path)).ok())
    });
    let made: HashSet<_> = made.collect();
    for path in outputs {
        if output_target(path).is_ok_and(|target| made.contains(&target)) {
            return Err(Failure::file(
                path,
                "is an output of the manifest; name another file",
            ));
        }
    }
    Ok(())
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
