//! The map that light sets are measured against.

use std::borrow::Cow;
use std::path::Path;

use strandlight_images::{Map, MapError, MapSelection};

/// The map, with its path and the limit of `--max-error`.
pub struct Reference<'a> {
    pub path: &'a Path,
    /// The image that is read unless a set names another.
    pub map: Map,
    pub residual: Residual,
    pub max_error: f64,
}

/// What is left of the map without its compact sources.
pub enum Residual {
    NotNamed,
    Unreadable,
    Read(Box<Map>),
}

impl Reference<'_> {
    /// The image of the file that a set with these parameters was fitted to.
    pub fn image(&self, parameters: &[(String, String)]) -> Result<Cow<'_, Map>, MapError> {
        let selection = MapSelection::recorded(parameters);
        if selection == MapSelection::default() {
            return Ok(Cow::Borrowed(&self.map));
        }
        Map::read_selected(self.path, &selection).map(Cow::Owned)
    }
}
