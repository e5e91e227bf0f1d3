//! Figures about a groom.

use glam::Vec3;
use strandlight_formats::{Domain, Groom};

use super::thin::coverage;

/// Least, middle and largest of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Least value.
    pub min: f64,
    /// Middle of the values sorted; of an even number of them the upper one of the two.
    pub median: f64,
    /// Largest value.
    pub max: f64,
}

impl Spread {
    fn of(mut values: Vec<f64>) -> Spread {
        values.sort_unstable_by(f64::total_cmp);
        let at = |ix: usize| values.get(ix).copied().unwrap_or_default();
        Spread {
            min: at(0),
            median: at(values.len() / 2),
            max: at(values.len().saturating_sub(1)),
        }
    }
}

/// Least and largest values of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct AttributeRange {
    /// Its name.
    pub name: String,
    /// What it has one value for.
    pub domain: Domain,
    /// Least and largest value of each component.
    pub ranges: Vec<[f32; 2]>,
}

/// Figures about a groom.
#[derive(Clone, Debug, PartialEq)]
pub struct GroomStats {
    /// Number of strands.
    pub strands: usize,
    /// Number of points.
    pub points: usize,
    /// Lengths of strands, cm.
    pub length_cm: Spread,
    /// Points of strands.
    pub points_per_strand: Spread,
    /// Widths as drawn, cm.
    pub width_cm: Spread,
    /// Sum of all angles between segments that follow each other, of each strand, degrees.
    pub turning_deg: Spread,
    /// That sum over the length of the strand, degrees per cm, of strands that have a length.
    pub curvature_deg_per_cm: Spread,
    /// Smallest coordinates, cm.
    pub min: [f32; 3],
    /// Largest coordinates, cm.
    pub max: [f32; 3],
    /// [`coverage`], cm^2.
    pub coverage_cm2: f64,
    /// Strands of each `group_id`, in the order of these; empty where there are none.
    pub groups: Vec<(i64, usize)>,
    /// All attributes.
    pub attributes: Vec<AttributeRange>,
}

/// Measures a groom.
pub fn stats(groom: &Groom) -> GroomStats {
    let n = groom.n_strands();
    let strand = |ix: usize| &groom.points[groom.strand(ix)];
    let lengths: Vec<f64> = (0..n).map(|ix| length(strand(ix))).collect();
    let turnings: Vec<f64> = (0..n).map(|ix| turning(strand(ix)).to_degrees()).collect();
    let curvature = turnings.iter().zip(&lengths);
    let curvature = curvature.filter(|(_, length)| **length > 0.0);
    let drawn = groom.diameter_range();
    let (min, max) = groom.bounds();
    GroomStats {
        strands: n,
        points: groom.points.len(),
        points_per_strand: Spread::of((0..n).map(|ix| strand(ix).len() as f64).collect()),
        width_cm: Spread {
            min: drawn.min.into(),
            median: drawn.median.into(),
            max: drawn.max.into(),
        },
        curvature_deg_per_cm: Spread::of(
            curvature
                .map(|(turning, length)| turning / length)
                .collect(),
        ),
        length_cm: Spread::of(lengths),
        turning_deg: Spread::of(turnings),
        min,
        max,
        coverage_cm2: coverage(groom),
        groups: groups(groom),
        attributes: groom
            .attributes
            .iter()
            .map(|attribute| {
                let mut ranges =
                    vec![[f32::INFINITY, f32::NEG_INFINITY]; attribute.components as usize];
                for values in attribute.data.chunks_exact(ranges.len()) {
                    for (range, &value) in ranges.iter_mut().zip(values) {
                        *range = [range[0].min(value), range[1].max(value)];
                    }
                }
                AttributeRange {
                    name: attribute.name.clone(),
                    domain: attribute.domain,
                    ranges,
                }
            })
            .collect(),
    }
}

fn length(points: &[[f32; 3]]) -> f64 {
    let pairs = points.windows(2);
    let lengths = pairs.map(|pair| Vec3::from(pair[0]).distance(Vec3::from(pair[1])));
    lengths.map(f64::from).sum()
}

/// Sum of the angles between segments, radians; segments without a direction are passed over.
fn turning(points: &[[f32; 3]]) -> f64 {
    let mut sum = 0.0;
    let mut before: Option<Vec3> = None;
    for pair in points.windows(2) {
        let Some(along) = (Vec3::from(pair[1]) - Vec3::from(pair[0])).try_normalize() else {
            continue;
        };
        if let Some(before) = before {
            // Exact for small angles too, unlike the arc cosine.
            let angle = before.cross(along).length().atan2(before.dot(along));
            sum += f64::from(angle);
        }
        before = Some(along);
    }
    sum
}

fn groups(groom: &Groom) -> Vec<(i64, usize)> {
    let Some(ids) = groom.attribute("group_id").filter(|a| a.components == 1) else {
        return Vec::new();
    };
    let mut counts = std::collections::BTreeMap::new();
    for ix in 0..groom.n_strands() {
        let id = match ids.domain {
            Domain::Groom => ids.data[0],
            Domain::Strand => ids.data[ix],
            Domain::Point => ids.data[groom.strand(ix).start],
        };
        *counts.entry(id as i64).or_default() += 1;
    }
    counts.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, per_strand};
    use super::*;

    #[test]
    fn figures_are_those_by_hand() {
        let mut groom = Groom {
            points: vec![
                // 3 long, one right angle; 1 long, straight; a point.
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [1.0, 2.0, 0.0],
                [5.0, 0.0, 0.0],
                [5.0, 0.0, 1.0],
                [2.0; 3],
                [2.0; 3],
            ],
            strand_offsets: vec![0, 3, 5, 7],
            ..Groom::default()
        };
        groom.attributes = vec![
            attribute("diameter", Domain::Groom, 1, vec![0.02]),
            per_strand("group_id", &groom, |ix| if ix == 1 { 4.0 } else { -1.0 }),
            attribute(
                "uv",
                Domain::Strand,
                2,
                vec![0.0, 1.0, 0.5, -1.0, 0.25, 0.0],
            ),
        ];
        let found = stats(&groom);
        assert_eq!((found.strands, found.points), (3, 7));
        let spread = |min, median, max| Spread { min, median, max };
        assert_eq!(found.length_cm, spread(0.0, 1.0, 3.0));
        assert_eq!(found.points_per_strand, spread(2.0, 2.0, 3.0));
        assert!((found.turning_deg.max - 90.0).abs() < 1e-4);
        assert!((found.curvature_deg_per_cm.max - 30.0).abs() < 1e-4);
        assert_eq!(found.curvature_deg_per_cm.min, 0.0);
        assert!((found.coverage_cm2 - 0.08).abs() < 1e-8);
        assert_eq!((found.min, found.max), ([0.0; 3], [5.0, 2.0, 2.0]));
        assert_eq!(found.groups, [(-1, 2), (4, 1)]);
        assert_eq!(found.attributes[2].ranges, [[0.0, 0.5], [-1.0, 1.0]]);
    }
}
