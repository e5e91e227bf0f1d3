//! Strands from guides.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;
use strandlight_formats::{Attribute, Domain, Groom};
use strandlight_scene::progress::Progress;

use super::edit::{EditError, edited, guides, strand_attribute};
use super::nearest::Nearest;
use super::noise::{Noise, Purpose};
use super::spec::{MAX_GENERATED_POINTS, MAX_POINTS_PER_STRAND, MAX_STRANDS};

/// What to make of guides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterpolateSpec {
    /// Number of strands, 1..=[`MAX_STRANDS`].
    pub strands: u32,
    /// Points of each strand, 2..=[`MAX_POINTS_PER_STRAND`]; `None`: as many as the guides have that
    /// it lies between.
    pub points_per_strand: Option<u32>,
    /// Any number; the same one gives the same strands.
    pub seed: u64,
}

/// Strands, and what they were made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Interpolated {
    /// The strands.
    pub groom: Groom,
    /// Guides that they lie between.
    pub n_guides: usize,
    /// Roots, guides and weights are those that the file gives to its strands.
    pub by_attributes: bool,
}

/// How a strand is made: offsets from the roots of three guides, mixed, from a root of its own.
#[derive(Clone, Copy)]
struct Mix {
    /// Strands of the groom.
    guides: [u32; 3],
    /// Shares of the guides in the shape; sum 1.
    shape: [f32; 3],
    /// Their shares in the place of the root; sum 1.
    place: [f32; 3],
    root: Vec3,
    /// The strand of the groom whose root it is, where there is one.
    strand: Option<u32>,
    n_points: u32,
}

/// Neighbours of a guide between which strands grow.
const N_NEIGHBOURS: usize = 6;
/// Least cosine between the directions of guides whose shapes are mixed: hair on both sides of a
/// parting is not.
const ALIKE: f32 = 0.5;

/// Strands between the guides of `groom`: strands whose attribute `guide` is set, or all strands
/// where it is not there.
///
/// Where other strands are there that have the attributes `closest_guides` (values of the guides'
/// `id`, or else their numbers among the guides) and `guide_weights`, new strands have the roots of
/// those strands, evenly picked, and mix the guides named by the weights given.
///
/// Else every guide gets as many strands as the others. Their roots are spread over triangles of the
/// guide and two of its nearest neighbours, nearer to the guide; the same barycentric weights mix the
/// shapes of those of the three guides that point the same way. Strands of a groom with two
/// guides lie between these.
///
/// Attributes per strand and point are mixed in the same way; whole numbers are those of the guide with
/// the largest share. Strands get an `id` if guides have one; what says which strand is a guide is
/// left out, as is `thickness`, for which `diameter` stands.
///
/// # Errors
/// Counts out of range; fewer than two guides; closest guides that do not exist; more strands than
/// have closest guides.
pub fn interpolate(
    groom: &Groom,
    spec: &InterpolateSpec,
    progress: &Progress,
) -> Result<Interpolated, EditError> {
    groom.validate()?;
    check(spec)?;
    let is_guide = guides(groom).unwrap_or_else(|| vec![true; groom.n_strands()]);
    let chosen = |wanted: bool| -> Vec<u32> {
        (0..groom.n_strands() as u32)
            .filter(|&ix| is_guide[ix as usize] == wanted)
            .collect()
    };
    let (guides, strands) = (chosen(true), chosen(false));
    let given = match (
        strand_attribute(groom, "closest_guides", 3),
        strand_attribute(groom, "guide_weights", 3),
    ) {
        (Some(closest), Some(weights)) if !strands.is_empty() => Some((closest, weights)),
        _ => None,
    };
    let mixes = match given {
        Some((closest, weights)) => {
            let given = Given { closest, weights };
            given.mixes(groom, spec, &guides, &strands)?
        }
        None => between(groom, spec, &guides)?,
    };
    let total: u64 = mixes.iter().map(|mix| u64::from(mix.n_points)).sum();
    if total > MAX_GENERATED_POINTS {
        let range = format!("at most {MAX_GENERATED_POINTS}");
        return Err(EditError::range("number of points", total, range));
    }
    let lengths = arc_lengths(groom);
    let mut strand_offsets = vec![0];
    for mix in &mixes {
        strand_offsets.push(strand_offsets[strand_offsets.len() - 1] + mix.n_points);
    }
    let points: Vec<Vec<[f32; 3]>> = mixes
        .par_iter()
        .map(|mix| {
            let points = mix.points(groom, &lengths);
            progress.advance(1);
            points
        })
        .collect();
    let attributes = groom.attributes.iter();
    let attributes = attributes.filter_map(|attribute| mixed(groom, attribute, &mixes, &lengths));
    let made = Groom {
        points: points.into_iter().flatten().collect(),
        strand_offsets,
        attributes: attributes.collect(),
        source: edited(&groom.source, spec.text()),
    };
    progress.finish();
    made.validate()?;
    Ok(Interpolated {
        groom: made,
        n_guides: guides.len(),
        by_attributes: given.is_some(),
    })
}

fn check(spec: &InterpolateSpec) -> Result<(), EditError> {
    if !(1..=MAX_STRANDS).contains(&spec.strands) {
        let range = format!("1..={MAX_STRANDS}");
        return Err(EditError::range("strands", spec.strands, range));
    }
    match spec.points_per_strand {
        Some(n) if !(2..=MAX_POINTS_PER_STRAND).contains(&n) => {
            let range = format!("2..={MAX_POINTS_PER_STRAND}");
            Err(EditError::range("points per strand", n, range))
        }
        _ => Ok(()),
    }
}

impl InterpolateSpec {
    /// As the command line has it.
    fn text(&self) -> String {
        let mut text = format!(
            "interpolate --strands {} --seed {}",
            self.strands, self.seed
        );
        if let Some(n) = self.points_per_strand {
            text += &format!(" --points {n}");
        }
        text
    }

    fn n_points(&self, groom: &Groom, guides: [u32; 3], shape: [f32; 3]) -> u32 {
        let of = |(guide, share): (u32, f32)| match share > 0.0 {
            true => groom.strand(guide as usize).len() as u32,
            false => 2,
        };
        let most = guides.into_iter().zip(shape).map(of).max();
        self.points_per_strand.or(most).unwrap_or(2)
    }
}

fn root(groom: &Groom, strand: u32) -> Vec3 {
    Vec3::from(groom.points[groom.strand(strand as usize).start])
}

/// What a file says of the guides of its strands.
#[derive(Clone, Copy)]
struct Given<'a> {
    closest: &'a Attribute,
    weights: &'a Attribute,
}

impl Given<'_> {
    fn mixes(
        self,
        groom: &Groom,
        spec: &InterpolateSpec,
        guides: &[u32],
        strands: &[u32],
    ) -> Result<Vec<Mix>, EditError> {
        let (n, wanted) = (strands.len() as u64, u64::from(spec.strands));
        if wanted > n {
            let range = format!("1..={n}, the strands with closest guides");
            return Err(EditError::range("strands", spec.strands, range));
        }
        let by_name: HashMap<i64, u32> = match strand_attribute(groom, "id", 1) {
            Some(ids) => guides
                .iter()
                .map(|&guide| (ids.data[guide as usize] as i64, guide))
                .collect(),
            None => (0..).zip(guides.iter().copied()).collect(),
        };
        (0..wanted)
            .map(|ix| {
                let strand = strands[(ix * n / wanted) as usize];
                let at = 3 * strand as usize;
                let mut mix = Mix {
                    guides: [0; 3],
                    shape: [0.0; 3],
                    place: [0.0; 3],
                    root: root(groom, strand),
                    strand: Some(strand),
                    n_points: 2,
                };
                for slot in 0..3 {
                    let weight = self.weights.data[at + slot].max(0.0);
                    let name = self.closest.data[at + slot];
                    if weight > 0.0 {
                        let guide = by_name.get(&(name as i64)).copied().ok_or_else(|| {
                            let what =
                                format!("strand {strand} names guide {name}, which is not there");
                            EditError::Missing(what)
                        })?;
                        (mix.guides[slot], mix.shape[slot]) = (guide, weight);
                    }
                }
                let sum: f32 = mix.shape.iter().sum();
                if sum <= 0.0 {
                    let what = format!("strand {strand} has guide weights of 0 alone");
                    return Err(EditError::Missing(what));
                }
                mix.shape = mix.shape.map(|weight| weight / sum);
                mix.place = mix.shape;
                mix.n_points = spec.n_points(groom, mix.guides, mix.shape);
                Ok(mix)
            })
            .collect()
    }
}

/// Strands between neighbouring guides.
fn between(groom: &Groom, spec: &InterpolateSpec, guides: &[u32]) -> Result<Vec<Mix>, EditError> {
    let n = guides.len() as u64;
    if n < 2 {
        return Err(EditError::Missing(format!(
            "interpolation needs 2 guides or more, and has {n}"
        )));
    }
    let roots: Vec<Vec3> = guides.iter().map(|&guide| root(groom, guide)).collect();
    let ways: Vec<Vec3> = guides
        .iter()
        .zip(&roots)
        .map(|(&guide, &root)| {
            let tip = Vec3::from(groom.points[groom.strand(guide as usize).end - 1]);
            (tip - root).normalize_or_zero()
        })
        .collect();
    let tree = Nearest::new(&roots);
    let neighbours: Vec<Vec<u32>> = (0..n as u32)
        .into_par_iter()
        .map(|ix| {
            let near = tree.find(roots[ix as usize], N_NEIGHBOURS + 1);
            let others = near.into_iter().map(|(_, other)| other);
            others
                .filter(|&other| other != ix)
                .take(N_NEIGHBOURS)
                .collect()
        })
        .collect();
    let noise = Noise::new(spec.seed);
    let mixes = (0..spec.strands).map(|ix| {
        // Guides take turns, in an order that does not leave out a region if strands are few.
        let first = (u64::from(ix) * n / u64::from(spec.strands)) as usize;
        let others = &neighbours[first];
        let pick = |dimension: u32, of: usize| {
            let number = noise.unit(ix, Purpose::Interpolate, dimension);
            ((number * of as f32) as usize).min(of - 1)
        };
        let a = pick(0, others.len());
        let b = match others.len() {
            1 => 0,
            n => (a + 1 + pick(1, n - 1)) % n,
        };
        let corners = [first, others[a] as usize, others[b] as usize];
        // Uniform in the triangle, folded so that the first corner is the nearest.
        let side = noise.unit(ix, Purpose::Interpolate, 2).sqrt();
        let along = noise.unit(ix, Purpose::Interpolate, 3);
        let mut place = [1.0 - side, side * (1.0 - along), side * along];
        place.sort_by(|a, b| b.total_cmp(a));
        let mut shape = place;
        for slot in 1..3 {
            if ways[corners[slot]].dot(ways[first]) < ALIKE {
                shape[slot] = 0.0;
            }
        }
        let sum: f32 = shape.iter().sum();
        let shape = shape.map(|weight| weight / sum);
        let guides = corners.map(|corner| guides[corner]);
        Mix {
            guides,
            shape,
            place,
            root: (0..3).map(|slot| place[slot] * roots[corners[slot]]).sum(),
            strand: None,
            n_points: spec.n_points(groom, guides, shape),
        }
    });
    Ok(mixes.collect())
}

/// Length from the root to each point, cm.
fn arc_lengths(groom: &Groom) -> Vec<f32> {
    let mut lengths = Vec::with_capacity(groom.points.len());
    for strand in 0..groom.n_strands() {
        let mut length = 0.0;
        let mut last = root(groom, strand as u32);
        for &point in &groom.points[groom.strand(strand)] {
            length += last.distance(Vec3::from(point));
            last = Vec3::from(point);
            lengths.push(length);
        }
    }
    lengths
}

/// A place on a guide: between a point and the next.
#[derive(Clone, Copy)]
struct Place {
    point: usize,
    t: f32,
}

impl Mix {
    /// Where on `guide` point `ix` of the strand is: at the same point if it has as many, else at the
    /// same share of the length.
    fn place_on(&self, groom: &Groom, lengths: &[f32], guide: u32, ix: u32) -> Place {
        let range = groom.strand(guide as usize);
        let at_point = |point| Place { point, t: 0.0 };
        if range.len() as u32 == self.n_points {
            return at_point(range.start + ix as usize);
        }
        let last = range.end - 1;
        if ix + 1 == self.n_points {
            return at_point(last);
        }
        let along = &lengths[range.clone()];
        let wanted = lengths[last] * ix as f32 / (self.n_points - 1) as f32;
        let segment = along
            .partition_point(|&length| length <= wanted)
            .clamp(1, along.len() - 1)
            - 1;
        let step = along[segment + 1] - along[segment];
        let t = match step > 0.0 {
            true => ((wanted - along[segment]) / step).clamp(0.0, 1.0),
            false => 0.0,
        };
        Place {
            point: range.start + segment,
            t,
        }
    }

    fn parts(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let parts = self.guides.into_iter().zip(self.shape);
        parts.filter(|(_, share)| *share > 0.0)
    }

    fn points(&self, groom: &Groom, lengths: &[f32]) -> Vec<[f32; 3]> {
        (0..self.n_points)
            .map(|ix| {
                let mut at = self.root;
                for (guide, share) in self.parts() {
                    let place = self.place_on(groom, lengths, guide, ix);
                    let from = Vec3::from(groom.points[place.point]);
                    let on = match place.t > 0.0 {
                        true => from.lerp(Vec3::from(groom.points[place.point + 1]), place.t),
                        false => from,
                    };
                    at += share * (on - root(groom, guide));
                }
                at.to_array()
            })
            .collect()
    }

    /// The guide with the largest share.
    fn nearest(&self) -> u32 {
        let first = (self.guides[0], self.shape[0]);
        let larger = |best: (u32, f32), part: (u32, f32)| match part.1 > best.1 {
            true => part,
            false => best,
        };
        self.parts().fold(first, larger).0
    }
}

/// Values mixed by their shares, whose sum is 1 but for rounding: within the values, so that those at
/// the end of a range, such as weights of dye of 1, do not leave it.
fn blended(parts: impl Iterator<Item = (f32, f32)>) -> f32 {
    let (mut sum, mut least, mut most) = (0.0, f32::MAX, f32::MIN);
    for (value, share) in parts {
        sum += share * value;
        (least, most) = (value.min(least), value.max(most));
    }
    sum.clamp(least, most)
}

/// The attribute of the new strands, if they have it.
fn mixed(
    groom: &Groom,
    attribute: &Attribute,
    mixes: &[Mix],
    lengths: &[f32],
) -> Option<Attribute> {
    let name = &*attribute.name;
    if ["guide", "closest_guides", "guide_weights", "thickness"].contains(&name) {
        return None;
    }
    let n = attribute.components as usize;
    let value = |element: usize, c: usize| attribute.data[element * n + c];
    let is_whole = attribute.data.iter().all(|value| value.fract() == 0.0);
    let data = match attribute.domain {
        Domain::Groom => attribute.data.clone(),
        Domain::Strand if name == "id" && n == 1 => (0..mixes.len()).map(|ix| ix as f32).collect(),
        Domain::Strand => {
            let of_strand =
                |c: usize| move |(guide, share): (u32, f32)| (value(guide as usize, c), share);
            let values = mixes.iter().flat_map(|mix| {
                (0..n).map(move |c| match mix.strand {
                    Some(strand) => value(strand as usize, c),
                    None if is_whole => value(mix.nearest() as usize, c),
                    // Roots and their UV lie at one place.
                    None if name == "root_uv" => {
                        let guides = mix.guides.into_iter();
                        blended(guides.zip(mix.place).map(of_strand(c)))
                    }
                    None => blended(mix.parts().map(of_strand(c))),
                })
            });
            values.collect()
        }
        Domain::Point => mixes
            .iter()
            .flat_map(|mix| {
                (0..mix.n_points).flat_map(move |ix| {
                    (0..n).map(move |c| {
                        let at = |guide: u32| {
                            let Place { point, t } = mix.place_on(groom, lengths, guide, ix);
                            match (is_whole, t > 0.0) {
                                (true, _) => value(point + usize::from(t > 0.5), c),
                                (_, true) => blended(
                                    [(value(point, c), 1.0 - t), (value(point + 1, c), t)]
                                        .into_iter(),
                                ),
                                (_, false) => value(point, c),
                            }
                        };
                        match is_whole {
                            true => at(mix.nearest()),
                            false => blended(mix.parts().map(|(guide, share)| (at(guide), share))),
                        }
                    })
                })
            })
            .collect(),
    };
    Some(Attribute {
        data,
        ..attribute.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::super::edit_samples::{attribute, head, per_strand};
    use super::*;

    fn spec(strands: u32) -> InterpolateSpec {
        InterpolateSpec {
            strands,
            points_per_strand: None,
            seed: 4,
        }
    }

    fn made(groom: &Groom, spec: &InterpolateSpec) -> Interpolated {
        interpolate(groom, spec, &Progress::silent()).unwrap()
    }

    #[test]
    fn strands_lie_between_guides_the_same_for_a_seed() {
        let guides = head(200);
        let hair = made(&guides, &spec(1500));
        assert_eq!((hair.n_guides, hair.by_attributes), (200, false));
        let groom = &hair.groom;
        assert_eq!((groom.n_strands(), groom.points.len()), (1500, 1500 * 12));
        assert_eq!(hair, made(&guides, &spec(1500)));
        let other = InterpolateSpec {
            seed: 5,
            ..spec(1500)
        };
        assert_ne!(groom.points, made(&guides, &other).groom.points);
        // Within the guides' box, and near one of them.
        let ((min, max), (low, high)) = (guides.bounds(), groom.bounds());
        let reach = 1.0;
        assert!(
            (0..3).all(|axis| low[axis] >= min[axis] - reach && high[axis] <= max[axis] + reach)
        );
        let roots: Vec<Vec3> = (0..200).map(|ix| root(&guides, ix)).collect();
        let tree = Nearest::new(&roots);
        for ix in 0..1500 {
            let (far, _) = tree.find(root(groom, ix), 1)[0];
            assert!(far < 4.0, "strand {ix} is {} cm off", far.sqrt());
        }
    }

    #[test]
    fn a_parting_stays_open() {
        // Two combs, one to the left and one to the right.
        let mut groom = Groom {
            strand_offsets: vec![0],
            ..Groom::default()
        };
        for ix in 0..20 {
            let (side, z) = ([-1.0, 1.0][ix % 2], (ix / 2) as f32 * 0.5);
            groom.points.push([0.2 * side, 0.0, z]);
            groom.points.push([9.0 * side, -4.0, z]);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        let hair = made(&groom, &spec(400)).groom;
        for ix in 0..400 {
            let points = &hair.points[hair.strand(ix)];
            let way = points[1][0] - points[0][0];
            assert!((way.abs() - 8.8).abs() < 1e-4, "{points:?}");
        }
    }

    #[test]
    fn attributes_are_mixed_and_whole_numbers_are_not() {
        let mut guides = head(60);
        let n = guides.points.len();
        let roots: Vec<f32> = (0..60)
            .flat_map(|ix| {
                let at = root(&guides, ix);
                [at.x, at.z]
            })
            .collect();
        guides.attributes = vec![
            attribute("root_uv", Domain::Strand, 2, roots),
            per_strand("group_id", &guides, |ix| (ix % 3) as f32),
            per_strand("id", &guides, |ix| 1000.0 + ix as f32),
            per_strand("guide", &guides, |_| 1.0),
            attribute("diameter", Domain::Point, 1, vec![0.0075; n]),
            attribute("tint", Domain::Groom, 1, vec![0.5]),
        ];
        let hair = made(&guides, &spec(300)).groom;
        let names: Vec<&str> = hair.attributes.iter().map(|a| &*a.name).collect();
        assert_eq!(names, ["root_uv", "group_id", "id", "diameter", "tint"]);
        for ix in 0..300 {
            let at = root(&hair, ix as u32);
            let uv = &hair.attributes[0].data[2 * ix..2 * ix + 2];
            assert!((at.x - uv[0]).abs() < 1e-4 && (at.z - uv[1]).abs() < 1e-4);
            assert!([0.0, 1.0, 2.0].contains(&hair.attributes[1].data[ix]));
            assert_eq!(hair.attributes[2].data[ix], ix as f32);
        }
        for &width in &hair.attributes[3].data {
            assert!((width - 0.0075).abs() < 1e-6);
        }
    }

    #[test]
    fn mixes_stay_in_the_range_of_their_values() {
        let mut guides = head(60);
        let dyes = |n: usize| {
            let dye = |ix: usize| [0.1 * (ix % 5) as f32, 50.0, 0.3, 1.0];
            (0..n).flat_map(dye).collect::<Vec<f32>>()
        };
        let (n_strands, n_points) = (guides.n_strands(), guides.points.len());
        for (domain, n) in [(Domain::Strand, n_strands), (Domain::Point, n_points)] {
            guides.attributes = vec![attribute("dye", domain, 4, dyes(n))];
            for points_per_strand in [None, Some(7)] {
                let spec = InterpolateSpec {
                    points_per_strand,
                    ..spec(2000)
                };
                let hair = made(&guides, &spec).groom;
                for dye in hair.attributes[0].data.chunks_exact(4) {
                    assert_eq!(dye[1..], [50.0, 0.3, 1.0]);
                }
            }
        }
    }

    #[test]
    fn closest_guides_and_weights_are_used() {
        // Two guides named 7 and 9, along x and along y, and three strands.
        let mut groom = Groom {
            points: Vec::new(),
            strand_offsets: vec![0],
            ..Groom::default()
        };
        let lines: [[[f32; 3]; 2]; 5] = [
            [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]],
            [[1.0, 0.0, 0.0], [1.0, 4.0, 0.0]],
            [[0.5, 0.0, 0.0], [0.5, 0.0, 1.0]],
            [[0.5, 0.0, 1.0], [0.5, 0.0, 1.5]],
            [[0.5, 0.0, 2.0], [0.5, 0.0, 2.5]],
        ];
        for line in lines {
            groom.points.extend(line);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        let closest = [[7, 9, -1], [7, 9, -1], [7, 9, -1], [9, 7, 7], [9, 0, 0]];
        let weights = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.25, 0.75, 0.0],
            [2.0, 1.0, 1.0],
            [1.0, 0.0, 0.0],
        ];
        let closest = closest.concat().into_iter().map(|ix| ix as f32).collect();
        groom.attributes = vec![
            per_strand("guide", &groom, |ix| f32::from(u8::from(ix < 2))),
            per_strand("id", &groom, |ix| [7.0, 9.0, 1.0, 2.0, 3.0][ix]),
            attribute("closest_guides", Domain::Strand, 3, closest),
            attribute("guide_weights", Domain::Strand, 3, weights.concat()),
        ];
        let hair = made(&groom, &spec(3));
        assert!(hair.by_attributes && hair.n_guides == 2);
        let tip = |ix: usize| hair.groom.points[hair.groom.strand(ix).end - 1];
        assert_eq!(hair.groom.points[0], [0.5, 0.0, 0.0]);
        assert_eq!(tip(0), [1.5, 3.0, 0.0]);
        assert_eq!(tip(1), [2.5, 2.0, 1.0]);
        assert_eq!(tip(2), [0.5, 4.0, 2.0]);

        let refused = |groom: &Groom, n: u32, needle: &str| {
            let error = interpolate(groom, &spec(n), &Progress::silent());
            let error = error.unwrap_err().to_string();
            assert!(error.contains(needle), "{error}");
        };
        refused(&groom, 4, "1..=3");
        groom.attributes[2].data[6] = 8.0;
        refused(&groom, 3, "strand 2 names guide 8");
        groom.attributes[3].data[9..12].fill(0.0);
        groom.attributes[2].data[6] = 9.0;
        refused(&groom, 3, "strand 3 has guide weights of 0");
    }

    #[test]
    fn numbers_of_points_are_those_asked_for() {
        let guides = head(10);
        let five = InterpolateSpec {
            points_per_strand: Some(5),
            ..spec(30)
        };
        assert_eq!(made(&guides, &five).groom.points.len(), 150);
        for (strands, points) in [(0, None), (1, Some(1)), (MAX_STRANDS + 1, None)] {
            let spec = InterpolateSpec {
                points_per_strand: points,
                ..spec(strands)
            };
            assert!(interpolate(&guides, &spec, &Progress::silent()).is_err());
        }
        let one = super::super::edit::subset(&guides, &[3]);
        let error = interpolate(&one, &spec(5), &Progress::silent()).unwrap_err();
        assert!(error.to_string().contains("2 guides or more"), "{error}");
    }
}
