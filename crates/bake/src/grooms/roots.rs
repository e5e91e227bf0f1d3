//! Which end of a strand is its root.

use glam::Vec3;
use strandlight_formats::{Domain, Groom};

use super::edit::EditError;

/// A tip has to be so much nearer to the middle of the roots than the root is, as a share.
const CLEARLY_NEARER: f32 = 0.85;
/// Roots are so much higher than tips where hair hangs, of the median distance of roots from their
/// middle.
const FAR_DOWN: f32 = 0.5;
/// Roots that are less far apart than this share of what tips are is a bunch of tips, as of a tie.
const BUNCHED: f32 = 0.5;
/// How often the middle is found anew after strands have been turned.
const MAX_ROUNDS: u32 = 16;

/// The strands that seem to run from tip to root: their last point is clearly nearer to the middle of
/// all roots than their first, after these have been turned as well. Most strands are taken to run as
/// they should, unless they would end on something like a scalp and hang upwards from there.
///
/// Short strands that lie on the head are near it with both ends and stay.
pub fn turned_strands(groom: &Groom) -> Vec<usize> {
    let ends: Vec<[Vec3; 2]> = (0..groom.n_strands())
        .map(|ix| {
            let range = groom.strand(ix);
            [range.start, range.end - 1].map(|ix| Vec3::from(groom.points[ix]))
        })
        .collect();
    if ends.is_empty() {
        return Vec::new();
    }
    let is_turned = settled(&ends, false);
    let n_turned = is_turned.iter().filter(|&&turned| turned).count();
    // The tie of hair that is pulled back is in the middle of the roots: a majority needs more.
    let is_majority = 2 * n_turned > ends.len();
    let in_order: Vec<[Vec3; 2]> = ends
        .iter()
        .zip(&is_turned)
        .map(|(&[first, last], &turned)| match turned && !is_majority {
            true => [last, first],
            false => [first, last],
        })
        .collect();
    let is_turned = match are_tips_first(&in_order) {
        true => settled(&ends, true),
        false if is_majority => Vec::new(),
        false => is_turned,
    };
    (0..is_turned.len()).filter(|&ix| is_turned[ix]).collect()
}

/// Which strands are turned, found in rounds that start from all or none turned.
fn settled(ends: &[[Vec3; 2]], all: bool) -> Vec<bool> {
    let mut is_turned = vec![all; ends.len()];
    for _ in 0..MAX_ROUNDS {
        let roots = ends.iter().zip(&is_turned);
        let middle = median(roots.map(|(ends, &turned)| ends[usize::from(turned)]));
        let next: Vec<bool> = ends
            .iter()
            .map(|[first, last]| last.distance(middle) < CLEARLY_NEARER * first.distance(middle))
            .collect();
        let is_same = next == is_turned;
        is_turned = next;
        if is_same {
            break;
        }
    }
    is_turned
}

/// Do strands that all run the same way start with their tips?
fn are_tips_first(ends: &[[Vec3; 2]]) -> bool {
    let spread = |end: usize| {
        let middle = median(ends.iter().map(|ends| ends[end]));
        let far = ends.iter().map(|ends| ends[end].distance(middle));
        quantile(far.collect(), 0.5)
    };
    let is_scalp = |end: usize| {
        let mut spans = [0, 1, 2].map(|axis: usize| {
            let at = |share| quantile(ends.iter().map(|ends| ends[end][axis]).collect(), share);
            at(0.98) - at(0.02)
        });
        spans.sort_by(f32::total_cmp);
        spans[1] > 0.5 * spans[2] && spans[0] > 0.2 * spans[2]
    };
    let height = |end: usize| quantile(ends.iter().map(|ends| ends[end].y).collect(), 0.5);
    let is_bunch = spread(1) < BUNCHED * spread(0);
    is_scalp(1) && !is_bunch && height(1) - height(0) > FAR_DOWN * spread(1)
}

/// Median of each coordinate.
pub(super) fn median(points: impl Iterator<Item = Vec3>) -> Vec3 {
    let mut axes: [Vec<f32>; 3] = Default::default();
    for point in points {
        for (axis, x) in axes.iter_mut().zip(point.to_array()) {
            axis.push(x);
        }
    }
    Vec3::from(axes.map(|axis| quantile(axis, 0.5)))
}

/// The value below which a share of the values, 0..1, lies; of none 0.
pub(super) fn quantile(mut values: Vec<f32>, share: f32) -> f32 {
    let ix = (values.len() as f32 * share) as usize;
    match ix < values.len() {
        true => *values.select_nth_unstable_by(ix, f32::total_cmp).1,
        false => 0.0,
    }
}

/// Reverses the points of `strands`, and their attributes.
///
/// # Errors
/// An index that is none of a strand.
pub fn turn_strands(groom: &mut Groom, strands: &[usize]) -> Result<(), EditError> {
    for &strand in strands {
        if strand >= groom.n_strands() {
            let range = format!("below {}", groom.n_strands());
            return Err(EditError::range("strand", strand, range));
        }
        let range = groom.strand(strand);
        groom.points[range.clone()].reverse();
        for attribute in &mut groom.attributes {
            if attribute.domain == Domain::Point {
                let n = attribute.components as usize;
                let data = &mut attribute.data[range.start * n..range.end * n];
                // Backwards as floats, then each value forwards again.
                data.reverse();
                data.chunks_exact_mut(n).for_each(<[f32]>::reverse);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head};
    use super::super::{GrowSpec, Style, generate};
    use super::*;
    use strandlight_scene::progress::Progress;

    #[test]
    fn turned_strands_are_found_and_turned_back() {
        let mut groom = head(500);
        let n = groom.points.len();
        let along = (0..2 * n).map(|ix| ix as f32).collect();
        groom
            .attributes
            .push(attribute("along", Domain::Point, 2, along));
        assert!(turned_strands(&groom).is_empty());
        for wanted in [
            (0..500).filter(|ix| ix % 3 == 0).collect::<Vec<_>>(),
            vec![17],
            (0..500).collect(),
        ] {
            let mut turned = groom.clone();
            turn_strands(&mut turned, &wanted).unwrap();
            let found = turned_strands(&turned);
            assert_eq!(found, wanted);
            turn_strands(&mut turned, &found).unwrap();
            assert_eq!(turned, groom);
        }
        assert!(turn_strands(&mut groom, &[500]).is_err());
    }

    /// Hair pulled back to a tie, which is in the middle of the roots.
    #[test]
    fn a_tie_is_no_scalp() {
        let mut groom = head(300);
        for ix in 0..300 {
            let range = groom.strand(ix);
            let root = Vec3::from(groom.points[range.start]);
            for (step, point) in groom.points[range].iter_mut().enumerate() {
                *point = root
                    .lerp(Vec3::new(0.0, 8.0, -11.0), step as f32 / 11.5)
                    .to_array();
            }
        }
        let found = turned_strands(&groom);
        assert!(found.len() < 150, "{}", found.len());
    }

    /// However many are turned, of every style.
    #[test]
    fn styles_are_put_in_order() {
        for style in Style::ALL {
            for strands in [60, 1000] {
                let spec = GrowSpec {
                    style,
                    strands,
                    points_per_strand: 12,
                    seed: 1,
                };
                let mut groom = generate(&spec, &Progress::silent()).unwrap();
                assert!(turned_strands(&groom).is_empty(), "{}", style.name());
                for every in [20, 4, 3, 1] {
                    let wanted: Vec<usize> = (0..strands as usize).step_by(every).collect();
                    turn_strands(&mut groom, &wanted).unwrap();
                    let found = turned_strands(&groom);
                    turn_strands(&mut groom, &wanted).unwrap();
                    let right = found.iter().filter(|ix| *ix % every == 0).count();
                    let wrong = found.len() - right;
                    let name = style.name();
                    let n = wanted.len();
                    assert!(
                        20 * right >= 19 * n && wrong == 0,
                        "{name}, each {every}: {right} of {n}, {wrong} wrong"
                    );
                }
            }
        }
    }
}
