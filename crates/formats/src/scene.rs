//! Scene descriptions.

/// A scene: which groom under which lights, seen from where.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {}
