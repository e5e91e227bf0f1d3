//! What several summaries have.

use std::path::Path;

use serde::{Serialize, Serializer};
use strandlight_formats::{Container, Kind};

use super::super::Failure;

/// Pairs as a JSON object, in their order.
pub(super) fn as_map<S: Serializer>(
    pairs: &[(String, String)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pairs.iter().map(|(name, value)| (name, value)))
}

/// Format version found in the file, `major.minor`.
pub(super) fn version(path: &Path, kind: Kind) -> Result<String, Failure> {
    let (major, minor) = Container::open(path, kind)
        .map_err(Failure::input)?
        .version();
    Ok(format!("{major}.{minor}"))
}

#[derive(Serialize)]
pub(super) struct Bounds {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

pub(super) fn parameters(parameters: &[(String, String)], tool_version: &str) -> Vec<String> {
    let named = parameters
        .iter()
        .map(|(name, value)| format!("{name} = {value}"));
    named.chain([format!("made by {tool_version}")]).collect()
}
