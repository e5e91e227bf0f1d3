//! Rays against the strands: which segments a ray crosses, and where.
//!
//! [`Rays`] holds a bounding volume hierarchy over the segments of a groom; [`Start`] says where a
//! ray begins and what it cannot hit; a [`Crossing`] is one answer.
//!
//! A fibre is a ribbon that faces the ray: a ray crosses a segment where the closest approach of
//! the two lines lies inside the segment and nearer than the fibre's radius there. That is what
//! the rasteriser draws, and what `sigma_t = D rho sqrt(1 - (t.d)^2)` counts.

mod traversal;

use std::ops::ControlFlow;

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::node::CwBvhNode;
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scene::hierarchy::hierarchy;
use strandlight_scene::strands::Strands;

use traversal::{Ray, Visit, traverse};

/// Where a ray crosses a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Distance along the ray to the closest approach, cm.
    pub t: f32,
    /// Index into [`Strands::segments`].
    pub segment: u32,
    /// Place along the segment, 0..1 from its first point to its second.
    pub along: f32,
}

/// Where a ray begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// World space, cm.
    pub position: Vec3,
    /// Segments that are not hit; [`Start::NONE`] stands for no segment.
    pub skip: [u32; 2],
    /// Crossings at this distance or nearer do not count, cm.
    pub t_min: f32,
}

impl Start {
    /// No segment to skip.
    pub const NONE: u32 = u32::MAX;

    /// A ray from outside the strands.
    pub fn camera(eye: Vec3) -> Self {
        Start {
            position: eye,
            skip: [Start::NONE; 2],
            t_min: 0.0,
        }
    }

    /// A ray from point `point` of the strands; the segments that meet there are skipped.
    ///
    /// # Panics
    /// If there is no such point.
    pub fn vertex(strands: &Strands, point: u32) -> Self {
        let [x, y, z, _] = strands.points[point as usize];
        let starting_at = |first: Option<u32>| {
            first
                .and_then(|first| strands.segments.binary_search(&first).ok())
                .map_or(Start::NONE, |segment| segment as u32)
        };
        Start {
            position: Vec3::new(x, y, z),
            skip: [starting_at(point.checked_sub(1)), starting_at(Some(point))],
            t_min: 0.0,
        }
    }

    /// A ray from the axis of `segment`, `along` it (0..1). The segment and its neighbour at the
    /// nearer end are skipped: next to a joint both run through the start.
    ///
    /// # Panics
    /// If there is no such segment.
    pub fn inside(strands: &Strands, segment: u32, along: f32) -> Self {
        let first = strands.segments[segment as usize];
        let neighbour = if along < 0.5 {
            segment
                .checked_sub(1)
                .filter(|&other| strands.segments[other as usize] + 1 == first)
        } else {
            let next = segment + 1;
            strands
                .segments
                .get(next as usize)
                .is_some_and(|&other| other == first + 1)
                .then_some(next)
        };
        let [a, b] = [first, first + 1].map(|ix| Vec3::from_slice(&strands.points[ix as usize]));
        Start {
            position: a + along * (b - a),
            skip: [segment, neighbour.unwrap_or(Start::NONE)],
            t_min: 0.0,
        }
    }
}

/// A segment as the crossing test reads it.
#[derive(Clone, Copy, Debug)]
struct Axis {
    from: Vec3,
    radius: f32,
    along: Vec3,
    /// Radius at the second point less that at the first.
    widening: f32,
}

impl Axis {
    fn of(strands: &Strands, segment: u32) -> Self {
        let first = strands.segments[segment as usize] as usize;
        let [a, b] = [strands.points[first], strands.points[first + 1]];
        Axis {
            from: Vec3::from_slice(&a),
            radius: a[3],
            along: Vec3::from_slice(&b) - Vec3::from_slice(&a),
            widening: b[3] - a[3],
        }
    }

    /// The crossing's distance and place along the segment, for a unit `direction`.
    #[inline(always)]
    fn crossing(&self, origin: Vec3, direction: Vec3) -> Option<(f32, f32)> {
        // The part across the ray of the way from the axis to the ray, and of the axis itself:
        // components along the ray are large and would cancel.
        let from = self.from - origin;
        let t_from = from.dot(direction);
        let slope = self.along.dot(direction);
        let offset = from - direction * t_from;
        let across = self.along - direction * slope;
        let square = across.length_squared();
        let along = -offset.dot(across);
        // Also false for a ray along the axis, whose square is zero.
        if !(along >= 0.0 && along < square) {
            return None;
        }
        let along = along / square;
        let distance_2 = (offset + across * along).length_squared();
        let radius = self.radius + along * self.widening;
        (along < 1.0 && distance_2 < radius * radius).then_some((t_from + along * slope, along))
    }
}

/// A part of a segment, a leaf of the hierarchy: all that the crossing test reads, in one place.
#[derive(Clone, Copy, Debug)]
struct Piece {
    axis: Axis,
    segment: u32,
    /// The crossings with `along` in `from..to` are this piece's. Neighbouring pieces share the
    /// bound, so that each crossing has one owner.
    from: f32,
    to: f32,
}

/// Finds what rays cross. Answers do not depend on the number of threads.
pub struct Rays {
    /// In the order of the hierarchy's leaves.
    pieces: Vec<Piece>,
    nodes: Vec<CwBvhNode>,
    /// Instructions of this machine.
    level: Level,
}

/// Segments longer than this many mean ones are cut, which makes at most half as many pieces again
/// as there are segments. A long diagonal segment fills little of its box and meets many others';
/// finer pieces gained nothing on generated grooms and cost build time (`crates/bake/examples/rays_cost.rs`).
const PIECE_LENGTH: f32 = 2.0;

/// Most pieces of one segment: a groom whose segments all but one coincide stays small.
const MAX_PIECES: f32 = 4096.0;

impl Rays {
    /// Builds the hierarchy.
    pub fn new(strands: &Strands) -> Self {
        let n_segments = strands.segments.len() as u32;
        let axes: Vec<Axis> = (0..n_segments).map(|ix| Axis::of(strands, ix)).collect();
        let total: f32 = axes.iter().map(|axis| axis.along.length()).sum();
        let longest = (PIECE_LENGTH * total / axes.len() as f32).max(f32::MIN_POSITIVE);
        let mut pieces = Vec::new();
        let mut boxes = Vec::new();
        for (segment, axis) in axes.iter().enumerate() {
            let n = (axis.along.length() / longest)
                .ceil()
                .clamp(1.0, MAX_PIECES) as u32;
            for ix in 0..n {
                let piece = Piece {
                    axis: *axis,
                    segment: segment as u32,
                    from: ix as f32 / n as f32,
                    to: (ix + 1) as f32 / n as f32,
                };
                boxes.push(bounds(&piece));
                pieces.push(piece);
            }
        }
        let bvh = hierarchy(&boxes);
        // Leaves in the order of the hierarchy need no list between them.
        let pieces = bvh
            .primitive_indices
            .iter()
            .map(|&ix| pieces[ix as usize])
            .collect();
        Rays {
            pieces,
            nodes: bvh.nodes,
            level: Level::new(),
        }
    }

    /// The first crossing along `direction` (a unit vector).
    pub fn nearest(&self, start: &Start, direction: Vec3) -> Option<Crossing> {
        let mut nearest: Option<Crossing> = None;
        self.traverse(
            start,
            direction,
            #[inline(always)]
            |ix, farthest| match self.test(ix, start, direction) {
                Some(crossing) if crossing.t < farthest => {
                    nearest = Some(crossing);
                    ControlFlow::Continue(crossing.t)
                }
                _ => ControlFlow::Continue(farthest),
            },
        );
        nearest
    }

    /// Whether anything lies along `direction` (a unit vector).
    pub fn is_blocked(&self, start: &Start, direction: Vec3) -> bool {
        let mut is_blocked = false;
        self.traverse(
            start,
            direction,
            #[inline(always)]
            |ix, farthest| {
                is_blocked = self.test(ix, start, direction).is_some();
                match is_blocked {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(farthest),
                }
            },
        );
        is_blocked
    }

    /// Calls `found` once for every crossing along `direction` (a unit vector): nearer nodes first, not sorted.
    pub fn crossings(&self, start: &Start, direction: Vec3, mut found: impl FnMut(Crossing)) {
        self.traverse(
            start,
            direction,
            #[inline(always)]
            |ix, farthest| {
                if let Some(crossing) = self.test(ix, start, direction) {
                    found(crossing);
                }
                ControlFlow::Continue(farthest)
            },
        );
    }

    /// [`traverse`] with this machine's instructions.
    #[inline(always)]
    fn traverse(&self, start: &Start, direction: Vec3, visit: impl Visit) {
        let ray = Ray::new(start.position, direction);
        let nodes = &self.nodes;
        dispatch!(self.level, simd => traverse(simd, nodes, &ray, visit));
    }

    /// The crossing of one piece.
    #[inline(always)]
    fn test(&self, ix: usize, start: &Start, direction: Vec3) -> Option<Crossing> {
        let piece = &self.pieces[ix];
        let (t, along) = piece.axis.crossing(start.position, direction)?;
        let segment = piece.segment;
        let owns = along >= piece.from && along < piece.to;
        let counts = owns && t > start.t_min && !start.skip.contains(&segment);
        counts.then_some(Crossing { t, segment, along })
    }
}

/// A box around every point of a ray that can cross the piece: the way from axis to ray is
/// perpendicular to the axis, so along each world axis it is shorter than the radius.
fn bounds(piece: &Piece) -> Aabb {
    let axis = &piece.axis;
    let [a, b] = [piece.from, piece.to].map(|at| axis.from + axis.along * at);
    let radius = axis.radius.max(axis.radius + axis.widening);
    let unit = axis.along.normalize_or_zero();
    let across = (Vec3::ONE - unit * unit).max(Vec3::ZERO);
    let reach = Vec3::new(across.x.sqrt(), across.y.sqrt(), across.z.sqrt()) * radius;
    // Rounding of the ray's point and of the box test.
    let reach = reach + 1e-2 * radius + 4e-6 * a.abs().max(b.abs());
    Aabb::new(Vec3A::from(a.min(b) - reach), Vec3A::from(a.max(b) + reach))
}

/// The instruction sets of this machine that answers are tested with: the best, and what all have.
#[cfg(test)]
pub(crate) fn levels() -> Vec<Level> {
    let best = Level::new();
    let mut levels = vec![best];
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    levels.extend(
        best.as_sse2()
            .map(strandlight_scattering::wide::Simd::level),
    );
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_bake::grooms::{GrowSpec, Style, generate};
    use strandlight_scattering::random::SplitMix64;
    use strandlight_scene::progress::Progress;

    fn curls() -> Strands {
        let spec = GrowSpec {
            style: Style::Curly,
            strands: 60,
            points_per_strand: 40,
            seed: 3,
        };
        let mut groom = generate(&spec, &Progress::silent()).unwrap();
        // And some long straight segments, which are cut.
        let mut random = SplitMix64(4);
        for _ in 0..20 {
            let mut end = || [0; 3].map(|_| random.uniform(-15.0, 15.0) as f32);
            groom.points.extend([end(), end()]);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        // Thick fibres that taper, so that rays meet many of them.
        let diameter = |_, point| 0.3 - 0.006 * (point % 40) as f32;
        Strands::new(&groom.points, &groom.strand_offsets, diameter, false).unwrap()
    }

    fn direction(random: &mut SplitMix64) -> Vec3 {
        let z = random.uniform(-1.0, 1.0);
        let (sin, cos) = random.uniform(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32)
    }

    /// All crossings by looking at every segment, by distance.
    fn by_brute_force(strands: &Strands, start: &Start, direction: Vec3) -> Vec<Crossing> {
        let mut found: Vec<Crossing> = (0..strands.segments.len() as u32)
            .filter(|segment| !start.skip.contains(segment))
            .filter_map(|segment| {
                let axis = Axis::of(strands, segment);
                let (t, along) = axis.crossing(start.position, direction)?;
                (t > start.t_min).then_some(Crossing { t, segment, along })
            })
            .collect();
        found.sort_by(|a, b| a.t.total_cmp(&b.t));
        found
    }

    #[test]
    fn rays_along_axes_find_all_whatever_the_sign_of_zero() {
        let strands = curls();
        let rays = Rays::new(&strands);
        let mut random = SplitMix64(6);
        let mut n = 0;
        for ix in 0..600 {
            let mut direction = [[0.0, -0.0][ix / 6 % 2]; 3];
            direction[ix % 3] = [1.0, -1.0][ix / 3 % 2];
            let direction = Vec3::from(direction);
            let [x, y, z] = [0; 3].map(|_| random.uniform(-6.0, 6.0) as f32);
            let start = Start::camera(strands.centre + Vec3::new(x, y, z) - 40.0 * direction);
            let mut found = 0;
            rays.crossings(&start, direction, |_| found += 1);
            assert_eq!(found, by_brute_force(&strands, &start, direction).len());
            n += found;
        }
        assert!(n > 100, "{n}");
    }

    #[test]
    fn every_query_finds_what_brute_force_finds() {
        let strands = curls();
        let mut rays = Rays::new(&strands);
        assert!(rays.pieces.len() > strands.segments.len(), "some are cut");
        let mut random = SplitMix64(5);
        let (mut n_crossings, mut n_blocked) = (0, 0);
        for ix in 0..10_000 {
            let direction = direction(&mut random);
            let start = match ix % 3 {
                0 => Start::camera(strands.centre - 3.0 * strands.radius * direction),
                1 => Start::vertex(
                    &strands,
                    random.next_u64() as u32 % strands.points.len() as u32,
                ),
                _ => {
                    let segment = random.next_u64() as u32 % strands.segments.len() as u32;
                    Start::inside(&strands, segment, random.uniform(0.0, 1.0) as f32)
                }
            };
            let expected = by_brute_force(&strands, &start, direction);
            for level in levels() {
                rays.level = level;
                let mut found = Vec::new();
                rays.crossings(&start, direction, |crossing| found.push(crossing));
                found.sort_by(|a, b| a.t.total_cmp(&b.t));
                assert_eq!(found, expected, "ray {ix}");
                let nearest = rays.nearest(&start, direction).map(|crossing| crossing.t);
                assert_eq!(nearest, expected.first().map(|crossing| crossing.t));
                assert_eq!(rays.is_blocked(&start, direction), !expected.is_empty());
            }
            n_crossings += expected.len();
            n_blocked += usize::from(!expected.is_empty());
        }
        assert!((2000..9000).contains(&n_blocked), "{n_blocked}");
        assert!(n_crossings > n_blocked + 1000, "{n_crossings}");
    }

    #[test]
    fn a_ribbon_is_as_wide_as_the_fibre_and_ends_where_it_ends() {
        let points = [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 4.0, 0.0]];
        let strands = Strands::new(&points, &[0, 3], |_, point| 0.2 + 0.2 * point as f32, false);
        let strands = strands.unwrap();
        let rays = Rays::new(&strands);
        let at = |x: f32, y: f32| rays.nearest(&Start::camera(Vec3::new(x, y, 5.0)), Vec3::NEG_Z);
        // Radius 0.1 at the root, 0.2 in the middle, 0.3 at the tip.
        let hit = at(0.149, 1.0).unwrap();
        assert_eq!((hit.segment, hit.along, hit.t), (0, 0.5, 5.0));
        assert!(at(0.151, 1.0).is_none() && at(-0.151, 1.0).is_none());
        assert!(at(0.249, 3.0).is_some() && at(0.251, 3.0).is_none());
        assert!(at(0.0, -0.01).is_none() && at(0.0, 4.01).is_none());
        // The joint belongs to the second segment, and to no other.
        let mut found = Vec::new();
        let start = Start::camera(Vec3::new(0.0, 2.0, 5.0));
        rays.crossings(&start, Vec3::NEG_Z, |crossing| found.push(crossing.segment));
        assert_eq!(found, [1]);
        // Behind the start there is nothing; along the axis neither.
        assert!(!rays.is_blocked(&start, Vec3::Z));
        assert!(!rays.is_blocked(&Start::camera(Vec3::new(0.0, 9.0, 0.0)), Vec3::NEG_Y));
    }

    #[test]
    fn oblique_rays_meet_a_fibre_with_its_projected_length() {
        // Share of parallel rays that cross: diameter times length times sin(angle).
        let points = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let strands = Strands::new(&points, &[0, 2], |_, _| 0.1, false).unwrap();
        let rays = Rays::new(&strands);
        for angle in [0.2f32, 0.8, 1.5] {
            let direction = Vec3::new(angle.cos(), 0.0, -angle.sin());
            let (across, up) = (Vec3::Y, direction.cross(Vec3::Y));
            let n = 400;
            let mut hits = 0;
            for i in 0..n * n {
                let at = |k: u32| (k as f32 + 0.5) / n as f32 - 0.5;
                let offset = 0.12 * at(i % n) * across + 2.4 * at(i / n) * up;
                hits +=
                    u32::from(rays.is_blocked(&Start::camera(offset - 9.0 * direction), direction));
            }
            let area = hits as f32 * 0.12 * 2.4 / (n * n) as f32;
            let expected = 0.1 * 2.0 * angle.sin();
            assert!(
                (area / expected - 1.0).abs() < 0.03,
                "{angle}: {area} {expected}"
            );
        }
    }

    #[test]
    fn starts_skip_the_segments_they_lie_on() {
        let points = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
        ];
        let strands = Strands::new(&points, &[0, 3, 5], |_, _| 0.01, false).unwrap();
        let none = Start::NONE;
        let skip = |point| Start::vertex(&strands, point).skip;
        assert_eq!(
            [0, 1, 2, 3, 4].map(skip),
            [[none, 0], [0, 1], [1, none], [none, 2], [2, none]]
        );
        let skip = |segment, along| Start::inside(&strands, segment, along).skip;
        assert_eq!(skip(0, 0.2), [0, none]);
        assert_eq!(skip(0, 0.7), [0, 1]);
        assert_eq!(skip(1, 0.2), [1, 0]);
        assert_eq!(skip(1, 0.7), [1, none]);
        assert_eq!(skip(2, 0.1), [2, none]);
        assert_eq!(
            Start::inside(&strands, 1, 0.25).position,
            Vec3::new(1.25, 0.0, 0.0)
        );
    }
}
