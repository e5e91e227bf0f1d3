//! Checks of panoramas.

use strandlight_formats::Panorama;

use super::lights::malformed_hash;
use super::line::Line;

/// What the format promises beyond what every reader checks.
pub fn checks(panorama: &Panorama) -> Vec<Line> {
    let (n_texels, source) = (panorama.texels().len(), &panorama.source);
    let [width, height] = source.map_size;
    let is_larger = width < panorama.width() && !source.map_hash.is_empty();
    let is_larger = is_larger.then(|| format!("the map is {width} x {height}"));
    vec![
        Line::held("invariants of the format", n_texels, None),
        Line::held("no larger than its map", 1, is_larger),
        Line::held("hash of the map", 1, malformed_hash(&source.map_hash)),
    ]
}
