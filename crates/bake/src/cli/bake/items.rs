//! The items of a manifest, and what is known of them.

use std::collections::HashSet;
use std::path::Path;

use serde_json::{Value, json};
use strandlight_bake::manifest::{self, Item, Judgement, Manifest, judge};

use strandlight_formats::TakenFiles;

use super::kinds::{KINDS, resolve};
use crate::cli::{Failure, Outcome, check_not_taken, check_outputs, is_stream};

/// A manifest and its items.
pub fn read(path: &Path) -> Result<(Manifest, Vec<Item>), Failure> {
    let manifest = Manifest::read(path, &KINDS).map_err(Failure::input)?;
    let items = manifest::items(&manifest, &resolve).map_err(Failure::input)?;
    Ok((manifest, items))
}

/// Refuses, before any work is done, outputs beside those of the items that cannot be written, that are one of `inputs`,
/// or that the manifest reads or makes.
pub fn check_beside(inputs: &[&Path], items: &[Item], outputs: &[&Path]) -> Outcome {
    check_outputs(inputs, outputs)?;
    let is_file = |path: &&&Path| !is_stream(path);
    if outputs.iter().find(is_file).is_none() {
        return Ok(());
    }
    let mut taken = TakenFiles::default();
    let read: HashSet<_> = items.iter().filter_map(Item::input_path).collect();
    taken.add_names(read, "an input of the manifest");
    let made = items.iter().flat_map(|item| {
        let outputs = item.outputs.iter();
        outputs.map(|output| item.resolve(&output.path))
    });
    taken.add_names(made, "an output of the manifest");
    check_not_taken(&taken, outputs)
}

/// Refuses inputs that are not there, which patterns match by themselves.
pub fn check_inputs(manifest: &Manifest, items: &[Item]) -> Outcome {
    let missing = items.iter().find_map(|item| {
        let error = item.input_path()?.metadata().err()?;
        Some((item, item.input.as_ref()?, error))
    });
    let Some((item, input, error)) = missing else {
        return Ok(());
    };
    let (entry, at) = &item.entry;
    let key = item.kind.input.unwrap_or_default();
    let what = format!("{entry}.{key}: {}: {error}", input.display());
    Err(Failure::input(manifest.error(*at, what)))
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
