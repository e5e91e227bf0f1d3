//! What `strandlight render --json` prints.

use std::path::Path;

use serde_json::{Value, json};
use strandlight_scene::provenance::Provenance;
use strandlight_scene::{Picture, Stats};

/// What a picture was made from, for `--json`.
pub fn inputs(provenance: &Provenance) -> Value {
    let entries = provenance.entries().iter();
    let entries = entries.map(|(name, value)| (name.clone(), json!(value)));
    Value::Object(entries.collect())
}

/// A picture that was rendered.
pub fn report(path: &Path, picture: &Picture, stats: &Stats) -> serde_json::Value {
    let stages: Vec<_> = stats
        .stages
        .iter()
        .map(|stage| {
            json!({
                "name": stage.name,
                "milliseconds": stage.milliseconds,
                "bytes": stage.bytes,
            })
        })
        .collect();
    let terms: Vec<_> = stats
        .terms
        .iter()
        .map(|term| {
            json!({
                "name": term.name,
                "products": term.products,
                "skipped": term.skipped,
            })
        })
        .collect();
    let [products, products_skipped] = stats.products();
    json!({
        "file": path.display().to_string(),
        "size": [picture.width, picture.height],
        "samples": stats.samples,
        "backend": stats.backend,
        "strands": stats.strands,
        "points": stats.points,
        "segments": stats.segments,
        "lights": stats.lights,
        "sweeps": stats.sweeps,
        "shadow_maps": stats.shadow_maps,
        "voxels": stats.voxels,
        "scattering": stats.scattering,
        "terms": terms,
        "products": products,
        "products_skipped": products_skipped,
        "skipped": stats.skipped,
        "points_skipped": stats.points_skipped,
        "visible_points": stats.visible_points,
        "list_entries": stats.list_entries,
        "stages": stages,
    })
}
