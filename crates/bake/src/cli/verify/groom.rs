//! Checks of grooms.

use strandlight_formats::{Groom, counted};

use super::lights::malformed_hash;
use super::line::Line;

/// What the format promises beyond what every reader checks.
pub fn checks(groom: &Groom) -> Vec<Line> {
    let n_points = groom.points.len();
    vec![
        Line::held("invariants of the format", n_points, None),
        Line::held("neighbouring points apart", n_points, coincident(groom)),
        Line::held("hash of the source", 1, malformed_hash(&groom.source.hash)),
    ]
}

/// Neighbours at one place: between them the strand has no direction.
fn coincident(groom: &Groom) -> Option<String> {
    let (mut n, mut first) = (0usize, None);
    for strand in 0..groom.n_strands() {
        let points = &groom.points[groom.strand(strand)];
        for (ix, pair) in points.windows(2).enumerate() {
            if pair[0] == pair[1] {
                n += 1;
                first.get_or_insert((strand, ix));
            }
        }
    }
    first.map(|(strand, ix)| {
        let next = ix + 1;
        let pairs = counted(n, "pair", "pairs");
        format!(
            "points {ix} and {next} of strand {strand} are at one place, {pairs} in all; \
             strands are drawn without the second"
        )
    })
}
