//! What seems wrong with a groom, said wherever one is read.

use strandlight_formats::{DiameterRange, DiameterSource, Groom, Scene};
use strandlight_scene::files::Files;

use crate::cli::note;

/// What seems wrong with unit, axes and thickness of `groom`, drawn as `drawn` says, in lines.
pub fn doubts(groom: &Groom, drawn: DiameterRange) -> Vec<String> {
    let mut lines = groom.doubts(drawn);
    let faults = groom.thickness_faults();
    let faults = faults.filter(|_| drawn.source != DiameterSource::Scene);
    lines.extend(faults.map(|faults| faults.to_string()));
    lines
}

/// Extents of most grooms, cm.
const USUAL_CM: std::ops::RangeInclusive<f32> = 10.0..=200.0;

/// That imported hair is of a size that few grooms have, where nothing is worse.
pub fn odd_size(groom: &Groom) -> Option<String> {
    let size = groom.size();
    let is_odd = groom.source.is_imported() && !USUAL_CM.contains(&size);
    let is_worst = is_odd && doubts(groom, groom.diameter_range()).is_empty();
    is_worst.then(|| format!("the groom is {size:.1} cm large; is --unit right?"))
}

/// Says on stderr what seems wrong with unit, axes and thickness of the hair that `scene` draws. A
/// groom that cannot be read is for the renderer to refuse.
pub fn note_doubts(scene: &Scene) {
    let path = scene.groom_path();
    if let Ok(groom) = Files::Disk.groom(&path) {
        for line in doubts(&groom, scene.hair.diameter_range(&groom)) {
            note!("{}: {line}", path.display());
        }
    }
}
