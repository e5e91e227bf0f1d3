//! The groom as the passes read it: points with radius and frame, and the segments between them.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::error::SceneError;

pub use crate::limits::MAX_POINTS;

/// Points that subdivision may add up to; a denser groom is taken as it is.
const MAX_REFINED_POINTS: usize = 3 << 20;

/// A piece is split where it is longer than the groom's diameter over this number: about two
/// voxels of the shadow volume, so that shading along a strand follows the shadows.
const PIECES_PER_DIAMETER: f32 = 40.0;

/// A piece is split where the strand turns by more than this angle (radians) along it: 8 degrees
/// read as a smooth curve at any usual size.
const MAX_TURN: f32 = 8.0 * std::f32::consts::PI / 180.0;

/// Most pieces that one segment of the groom is split into.
const MAX_SPLIT: u32 = 16;

/// Strands that one task works on.
pub(crate) const STRANDS_AT_A_TIME: usize = 64;

/// Segments that one task measures.
const SEGMENTS_AT_A_TIME: usize = 1 << 16;

/// Where a refined point comes from: between the groom's points `point` and `point + 1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// A point of the groom. For a point of the groom itself (`fraction` 0) that very point, the
    /// first one of some that coincide; else the last one before it.
    pub point: u32,
    /// Share of the way to the next point of the groom, 0..1 along the parameter of the curve.
    pub fraction: f32,
}

/// Prepared strands. Every vector but `segments` has one entry a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// x, y, z and fibre radius, cm, world space.
    pub points: Vec<[f32; 4]>,
    /// Unit tangent u, root to tip; the fourth float is half the distance to the point before, cm,
    /// zero at a root.
    pub tangents: Vec<[f32; 4]>,
    /// Unit normal v of the fibre frame (u, v, u x v), carried along the strand without twist;
    /// the fourth float is half the distance to the point after, cm, zero at a tip.
    pub normals: Vec<[f32; 4]>,
    /// First point of each segment; the second is the next point.
    pub segments: Vec<u32>,
    /// Strands with at least one segment.
    pub n_strands: usize,
    /// Strands left out because all their points coincide.
    pub n_degenerate: usize,
    /// Centre of the bounding box.
    pub centre: Vec3,
    /// Largest distance of a point of the groom from the centre, cm.
    pub radius: f32,
    /// Corners of the bounding box.
    pub bounds: (Vec3, Vec3),
    /// Largest fibre diameter, cm.
    pub max_diameter: f32,
    /// How long all segments are together, cm.
    pub length: f64,
    /// How much they cover flattened out, cm^2.
    pub area: f64,
    /// By point; shared by all that moved from the same strands.
    origins: Arc<[Origin]>,
    /// By drawn strand: its index in the groom; shared likewise.
    ids: Arc<[u32]>,
    /// Points of the groom.
    n_groom_points: usize,
}

/// The corners of the box around `points`, its centre, and the largest distance from there.
pub(crate) fn extent(points: &[[f32; 3]]) -> ((Vec3, Vec3), Vec3, f32) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &point in points {
        low = low.min(Vec3::from(point));
        high = high.max(Vec3::from(point));
    }
    let centre = 0.5 * (low + high);
    let distances = points
        .iter()
        .map(|&point| Vec3::from(point).distance(centre));
    ((low, high), centre, distances.fold(0.0, f32::max))
}

impl Strands {
    /// The frame of a point: along the strand, and two axes across it.
    #[inline]
    pub fn frame(&self, point: usize) -> [Vec3; 3] {
        let u = Vec3::from_slice(&self.tangents[point]);
        let v = Vec3::from_slice(&self.normals[point]);
        [u, v, u.cross(v)]
    }

    /// Prepares the strands `offsets[i]..offsets[i + 1]` of `points` (cm). `diameter(strand,
    /// point)` is the fibre diameter in cm.
    ///
    /// With `refine`, long or strongly curved segments are split along a centripetal Catmull-Rom
    /// curve through the points; by how much depends on the groom alone, not on the view.
    /// Repeated points are merged.
    ///
    /// # Errors
    /// No points, offsets that do not fit them, a point or diameter that is not finite, or more
    /// than [`MAX_POINTS`].
    pub fn new(
        points: &[[f32; 3]],
        offsets: &[u32],
        diameter: impl Fn(usize, usize) -> f32,
        refine: bool,
    ) -> Result<Self, SceneError> {
        check(points, offsets)?;
        let (bounds, centre, radius) = extent(points);
        let mut strands = Strands {
            centre,
            radius,
            bounds,
            n_groom_points: points.len(),
            ..Strands::default()
        };
        let (mut origins, mut ids) = (Vec::new(), Vec::new());
        let mut target = 2.0 * radius / PIECES_PER_DIAMETER;
        // Coarser pieces until the points fit; the last try splits nothing.
        for attempt in 0..=8 {
            let pieces = (refine && radius > 0.0 && attempt < 8).then_some(target);
            let limit = pieces.map_or(MAX_POINTS, |_| MAX_REFINED_POINTS);
            let sources = (&mut origins, &mut ids);
            if strands.fill((points, offsets), &diameter, pieces, limit, sources)? {
                break;
            }
            if pieces.is_none() {
                return Err(SceneError::TooManyPoints {
                    points: strands.points.len(),
                });
            }
            target *= 1.5;
        }
        if strands.segments.is_empty() {
            return Err(SceneError::EmptyGroom);
        }
        strands.origins = origins.into();
        strands.ids = ids.into();
        strands.measure();
        Ok(strands)
    }

    /// Where each of [`Strands::points`] comes from in the groom, eight bytes a point.
    pub(crate) fn origins(&self) -> &[Origin] {
        &self.origins
    }

    /// The index in the groom of each drawn strand, in the order of [`Strands::ranges`]; strands
    /// without extent are missing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Points of the groom, those of degenerate strands included.
    pub fn n_groom_points(&self) -> usize {
        self.n_groom_points
    }

    /// Carries `values`, one for each point of the groom, to [`Strands::points`]: `mix(a, b,
    /// fraction)` between two points of the groom, the value itself at a point of the groom.
    ///
    /// # Errors
    /// Another number of values than the groom has points.
    pub fn spread<T: Copy>(
        &self,
        values: &[T],
        mix: impl Fn(T, T, f32) -> T,
    ) -> Result<Vec<T>, SceneError> {
        if values.len() != self.n_groom_points {
            return Err(SceneError::Offsets);
        }
        let spread = self.origins.iter().map(|origin| {
            let ix = origin.point as usize;
            if origin.fraction == 0.0 {
                values[ix]
            } else {
                mix(values[ix], values[ix + 1], origin.fraction)
            }
        });
        Ok(spread.collect())
    }

    /// [`Strands::points`] of another pose of the same groom, `groom_points` in cm: the same
    /// pieces, whatever their length is now, and the same radii. Of the pose that these strands
    /// were made of it answers their points, bit for bit; [`Strands::moved`] takes the answer.
    ///
    /// # Errors
    /// Another number of points than the groom has, or one that is not finite or too far.
    pub fn resampled(&self, groom_points: &[[f32; 3]]) -> Result<Vec<[f32; 4]>, SceneError> {
        if groom_points.len() != self.n_groom_points {
            return Err(SceneError::Offsets);
        }
        if let Some(point) = groom_points.iter().position(|p| p.iter().any(is_far)) {
            return Err(SceneError::Point { point });
        }
        let mut resampled = Vec::with_capacity(self.points.len());
        let mut knots = Vec::new();
        for segments in self.strand_segments() {
            let first = segments[0] as usize;
            let points = &self.points[first..=first + segments.len()];
            let origins = &self.origins[first..=first + segments.len()];
            let is_knot = |origin: &&Origin| origin.fraction == 0.0;
            knots.clear();
            knots.extend(origins.iter().filter(is_knot).map(|origin| {
                let position = Vec3::from(groom_points[origin.point as usize]);
                (position, 0.0)
            }));
            let mut knot = 0;
            let mut curve = Curve::default();
            for (ix, (point, origin)) in points.iter().zip(origins).enumerate() {
                let position = if origin.fraction == 0.0 {
                    knot += usize::from(ix > 0);
                    if knot + 1 < knots.len() {
                        curve = Curve::between(&knots, knot);
                    }
                    knots[knot].0
                } else {
                    curve.at(origin.fraction)
                };
                resampled.push([position.x, position.y, position.z, point[3]]);
            }
        }
        Ok(resampled)
    }

    /// First point and number of points of each strand.
    pub fn ranges(&self) -> impl Iterator<Item = [u32; 2]> {
        let range = |segments: &[u32]| [segments[0], segments.len() as u32 + 1];
        self.strand_segments().map(range)
    }

    /// The same strands, said to lie between two corners: what is laid out around them does not
    /// change while they move there.
    pub(crate) fn in_space(mut self, low: Vec3, high: Vec3) -> Strands {
        self.bounds = (low, high);
        self.centre = 0.5 * (low + high);
        self.radius = 0.5 * low.distance(high);
        self
    }

    /// The segments of each strand.
    fn strand_segments(&self) -> impl Iterator<Item = &[u32]> {
        // A strand goes on as long as each segment starts where the last one ended.
        self.segments.chunk_by(|a, b| a + 1 == *b)
    }

    /// The same strands with their points elsewhere: x, y, z and radius in cm, in the order of
    /// [`Strands::points`]. Frames and bounds are recomputed, nothing is refined.
    ///
    /// # Errors
    /// Another number of points, or one that is not finite, too far or of no radius.
    pub fn moved(&self, points: &[[f32; 4]]) -> Result<Self, SceneError> {
        if points.len() != self.points.len() {
            return Err(SceneError::Offsets);
        }
        let is_far_point = |p: &[f32; 4]| p[..3].iter().any(is_far);
        if let Some(point) = points.par_iter().position_first(is_far_point) {
            return Err(SceneError::Point { point });
        }
        self.check_radii(|point| points[point][3])?;
        let corners = |p: &[f32; 4]| [Vec3::from_slice(p); 2];
        let [low, high] = points.par_iter().map(corners).reduce(
            || [Vec3::INFINITY, Vec3::NEG_INFINITY],
            |[a, b], [c, d]| [a.min(c), b.max(d)],
        );
        let centre = 0.5 * (low + high);
        let distance = |p: &[f32; 4]| Vec3::from_slice(p).distance(centre);
        let mut moved = Strands {
            points: points.to_vec(),
            tangents: vec![[0.0; 4]; points.len()],
            normals: vec![[0.0; 4]; points.len()],
            segments: self.segments.clone(),
            n_strands: self.n_strands,
            n_degenerate: self.n_degenerate,
            centre,
            radius: points.par_iter().map(distance).reduce(|| 0.0, f32::max),
            bounds: (low, high),
            max_diameter: widest(points),
            origins: Arc::clone(&self.origins),
            ids: Arc::clone(&self.ids),
            n_groom_points: self.n_groom_points,
            ..Strands::default()
        };
        let lengths: Vec<usize> = self.ranges().map(|[_, n]| n as usize).collect();
        let mut rest = (points, &mut moved.tangents[..], &mut moved.normals[..]);
        let of_strands = lengths.chunks(STRANDS_AT_A_TIME).map(|lengths| {
            let n = lengths.iter().sum();
            let (points, tangents, normals) = std::mem::take(&mut rest);
            let (points, tangents, normals) = (
                points.split_at(n),
                tangents.split_at_mut(n),
                normals.split_at_mut(n),
            );
            rest = (points.1, tangents.1, normals.1);
            (lengths, (points.0, tangents.0, normals.0))
        });
        let of_strands: Vec<_> = of_strands.collect();
        of_strands
            .into_par_iter()
            .for_each(|(lengths, (points, tangents, normals))| {
                let mut first = 0;
                for &n in lengths {
                    let range = first..first + n;
                    find_frames(
                        &points[range.clone()],
                        &mut tangents[range.clone()],
                        &mut normals[range],
                    );
                    first += n;
                }
            });
        moved.measure();
        Ok(moved)
    }

    /// Refuses the first strand with a radius that is not positive.
    fn check_radii(&self, radius: impl Fn(usize) -> f32 + Sync) -> Result<(), SceneError> {
        let is_wrong = |point: usize| !(radius(point).is_finite() && radius(point) > 0.0);
        let wrong = (0..self.points.len())
            .into_par_iter()
            .find_first(|&point| is_wrong(point));
        let Some(point) = wrong else {
            return Ok(());
        };
        let mut ranges = self.ranges();
        let strand = ranges.position(|[first, n]| point < (first + n) as usize);
        Err(SceneError::Diameter {
            strand: strand.unwrap_or(0),
            value: 2.0 * radius(point),
        })
    }

    /// Notes length and area of all segments, whatever the number of threads in the same order.
    fn measure(&mut self) {
        let of_segments = |segments: &[u32]| {
            let (mut length, mut area) = (0.0, 0.0);
            for &first in segments {
                let [a, b] = [0, 1].map(|next| &self.points[first as usize + next]);
                let of_segment = f64::from(Vec3::from_slice(a).distance(Vec3::from_slice(b)));
                length += of_segment;
                area += of_segment * f64::from(a[3] + b[3]);
            }
            (length, area)
        };
        let parts = self
            .segments
            .par_chunks(SEGMENTS_AT_A_TIME)
            .map(of_segments);
        let parts: Vec<(f64, f64)> = parts.collect();
        let add = |(a, b), (c, d)| (a + c, b + d);
        (self.length, self.area) = parts.into_iter().fold((0.0, 0.0), add);
    }

    /// The same strands with other fibre radii in cm, in the order of [`Strands::points`]; bounds
    /// stay, unlike after [`Strands::moved`].
    ///
    /// # Errors
    /// Another number of radii than points, or one that is not positive.
    pub fn with_radii(&self, radii: &[f32]) -> Result<Self, SceneError> {
        if radii.len() != self.points.len() {
            return Err(SceneError::Offsets);
        }
        self.check_radii(|point| radii[point])?;
        let mut strands = self.clone();
        for (point, &radius) in strands.points.iter_mut().zip(radii) {
            point[3] = radius;
        }
        strands.max_diameter = widest(&strands.points);
        strands.measure();
        Ok(strands)
    }

    /// Fills the arrays, splitting segments longer than `target` if there is one; `false` as soon
    /// as there are more than `limit` points.
    fn fill(
        &mut self,
        (points, offsets): (&[[f32; 3]], &[u32]),
        diameter: &impl Fn(usize, usize) -> f32,
        target: Option<f32>,
        limit: usize,
        (origins, ids): (&mut Vec<Origin>, &mut Vec<u32>),
    ) -> Result<bool, SceneError> {
        origins.clear();
        ids.clear();
        for array in [&mut self.points, &mut self.tangents, &mut self.normals] {
            array.clear();
        }
        self.segments.clear();
        (self.n_strands, self.n_degenerate) = (0, 0);
        // Points closer than this have no direction between them in f32.
        let merge_distance = (1e-6 * self.radius).max(1e-7);
        let mut knots: Vec<(Vec3, f32)> = Vec::new();
        // By knot: the first and the last point of the groom that lie there.
        let mut places: Vec<[u32; 2]> = Vec::new();
        for (strand, range) in offsets.windows(2).enumerate() {
            knots.clear();
            places.clear();
            let first = range[0] as usize;
            for (ix, &position) in points[first..range[1] as usize].iter().enumerate() {
                let (point, position) = (first + ix, Vec3::from(position));
                let value = diameter(strand, point);
                if !(value.is_finite() && value > 0.0) {
                    return Err(SceneError::Diameter { strand, value });
                }
                let repeated = knots
                    .last()
                    .is_some_and(|(last, _)| last.distance(position) <= merge_distance);
                match places.last_mut() {
                    Some([_, last]) if repeated => *last = point as u32,
                    _ => {
                        knots.push((position, 0.5 * value));
                        places.push([point as u32; 2]);
                    }
                }
            }
            if knots.len() < 2 {
                self.n_degenerate += 1;
                continue;
            }
            self.push_strand(&knots, &places, target, origins);
            ids.push(strand as u32);
            if self.points.len() > limit {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Appends one strand through `knots` (position, radius), at least two and no two neighbours
    /// alike; `places` are the groom's points there.
    fn push_strand(
        &mut self,
        knots: &[(Vec3, f32)],
        places: &[[u32; 2]],
        target: Option<f32>,
        origins: &mut Vec<Origin>,
    ) {
        let first = self.points.len();
        let mut positions: Vec<(Vec3, f32)> = Vec::with_capacity(knots.len());
        let mut push = |position, point, fraction| {
            positions.push(position);
            origins.push(Origin { point, fraction });
        };
        for ix in 0..knots.len() - 1 {
            let (r1, r2) = (knots[ix].1, knots[ix + 1].1);
            push(knots[ix], places[ix][0], 0.0);
            let Some(target) = target else { continue };
            let curve = Curve::between(knots, ix);
            let [p0, p1, p2, p3] = curve.0;
            let turn = (p1 - p0)
                .angle_between(p2 - p1)
                .max((p2 - p1).angle_between(p3 - p2));
            let by_length = (p1.distance(p2) / target).ceil();
            let by_turn = (turn / MAX_TURN).ceil();
            // Not below half of the target length: the arc's height there is far below a pixel
            // of a picture that shows the groom whole.
            let by_turn = by_turn.min((2.0 * p1.distance(p2) / target).floor());
            let n = by_length.max(by_turn).clamp(1.0, MAX_SPLIT as f32) as u32;
            for piece in 1..n {
                let t = piece as f32 / n as f32;
                push((curve.at(t), r1 + t * (r2 - r1)), places[ix][1], t);
            }
        }
        let last = knots.len() - 1;
        push(knots[last], places[last][0], 0.0);

        for &(position, radius) in &positions {
            let [x, y, z] = position.to_array();
            self.points.push([x, y, z, radius]);
            self.max_diameter = self.max_diameter.max(2.0 * radius);
        }
        let end = self.points.len();
        self.tangents.resize(end, [0.0; 4]);
        self.normals.resize(end, [0.0; 4]);
        find_frames(
            &self.points[first..],
            &mut self.tangents[first..],
            &mut self.normals[first..],
        );
        self.segments.extend((first..end - 1).map(|ix| ix as u32));
        self.n_strands += 1;
    }
}

/// Largest diameter of `points`.
fn widest(points: &[[f32; 4]]) -> f32 {
    let radii = points.par_iter().map(|point| point[3]);
    2.0 * radii.reduce(|| 0.0, f32::max)
}

/// Frames at the points of one strand.
fn find_frames(points: &[[f32; 4]], tangents: &mut [[f32; 4]], normals: &mut [[f32; 4]]) {
    let at = |ix: usize| Vec3::from_slice(&points[ix]);
    let mut normal = Vec3::ZERO;
    let mut last_tangent = Vec3::ZERO;
    // Direction to the point after, and half the distance.
    let (mut before, mut half_before) = (Vec3::ZERO, 0.0);
    for ix in 0..points.len() {
        let (after, half_after) = match ix + 1 < points.len() {
            true => (
                (at(ix + 1) - at(ix)).normalize_or_zero(),
                0.5 * at(ix + 1).distance(at(ix)),
            ),
            false => (Vec3::ZERO, 0.0),
        };
        let tangent = (before + after)
            .try_normalize()
            .or_else(|| after.try_normalize())
            .or_else(|| before.try_normalize())
            .unwrap_or(Vec3::Y);
        normal = if ix == 0 {
            first_normal(tangent)
        } else {
            transport(normal, last_tangent, tangent)
        };
        last_tangent = tangent;
        tangents[ix] = tangent.extend(half_before).to_array();
        normals[ix] = normal.extend(half_after).to_array();
        (before, half_before) = (after, half_after);
    }
}

fn check(points: &[[f32; 3]], offsets: &[u32]) -> Result<(), SceneError> {
    let ends = offsets.first() == Some(&0)
        && offsets.last().map(|&last| last as usize) == Some(points.len());
    if points.is_empty() || offsets.len() < 2 {
        return Err(SceneError::EmptyGroom);
    }
    if !ends || offsets.windows(2).any(|pair| pair[0] > pair[1]) {
        return Err(SceneError::Offsets);
    }
    if points.len() > MAX_POINTS {
        return Err(SceneError::TooManyPoints {
            points: points.len(),
        });
    }
    match points.iter().position(|point| point.iter().any(is_far)) {
        Some(point) => Err(SceneError::Point { point }),
        None => Ok(()),
    }
}

/// Beyond a hundred kilometres the squares of lengths leave the range of f32.
fn is_far(x: &f32) -> bool {
    !(-1e7..=1e7).contains(x)
}

/// Centripetal Catmull-Rom (Barry and Goldman's pyramid) between the second and the third of four
/// points. Unlike the uniform one it has no loops where point distances vary.
#[derive(Clone, Copy, Default)]
struct Curve([Vec3; 4]);

impl Curve {
    /// From knot `ix` to the one after it.
    fn between(knots: &[(Vec3, f32)], ix: usize) -> Curve {
        let (p1, p2) = (knots[ix].0, knots[ix + 1].0);
        // Before the first and after the last segment the strand goes on as it does at the
        // segment's other end: mirrored in the plane between its points.
        let mirror = |p: Vec3| {
            let along = (p2 - p1).normalize_or_zero();
            p - 2.0 * along * (p - 0.5 * (p1 + p2)).dot(along)
        };
        let before = (ix > 0).then(|| knots[ix - 1].0);
        let after = (ix + 2 < knots.len()).then(|| knots[ix + 2].0);
        let p0 = before.or(after.map(mirror)).unwrap_or(2.0 * p1 - p2);
        let p3 = after.or(before.map(mirror)).unwrap_or(2.0 * p2 - p1);
        Curve([p0, p1, p2, p3])
    }

    /// The point at `t` in 0..=1. Where neighbours coincide, which they may in another pose, the
    /// curve is a straight line.
    fn at(&self, t: f32) -> Vec3 {
        let [p0, p1, p2, p3] = self.0;
        let knot = |a: Vec3, b: Vec3| a.distance(b).sqrt().max(1e-6);
        let t1 = knot(p0, p1);
        let t2 = t1 + knot(p1, p2);
        let t3 = t2 + knot(p2, p3);
        if t2 <= t1 || t3 <= t2 {
            return p1 + t * (p2 - p1);
        }
        let t = t1 + t * (t2 - t1);
        let a1 = p0 * ((t1 - t) / t1) + p1 * (t / t1);
        let a2 = p1 * ((t2 - t) / (t2 - t1)) + p2 * ((t - t1) / (t2 - t1));
        let a3 = p2 * ((t3 - t) / (t3 - t2)) + p3 * ((t - t2) / (t3 - t2));
        let b1 = a1 * ((t2 - t) / t2) + a2 * (t / t2);
        let b2 = a2 * ((t3 - t) / (t3 - t1)) + a3 * ((t - t1) / (t3 - t1));
        b1 * ((t2 - t) / (t2 - t1)) + b2 * ((t - t1) / (t2 - t1))
    }
}

/// A unit vector across `tangent`: the world axis least along it, made perpendicular.
fn first_normal(tangent: Vec3) -> Vec3 {
    let a = tangent.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        Vec3::X
    } else if a.z <= a.y {
        Vec3::Z
    } else {
        Vec3::Y
    };
    (axis - tangent * axis.dot(tangent)).normalize_or(Vec3::X)
}

/// Carries `normal` from `from` to `to` by the smallest rotation between them.
fn transport(normal: Vec3, from: Vec3, to: Vec3) -> Vec3 {
    let cos_plus_one = 1.0 + from.dot(to);
    let turned = if cos_plus_one > 1e-4 {
        normal - (from + to) * (normal.dot(to) / cos_plus_one)
    } else {
        normal
    };
    (turned - to * turned.dot(to))
        .try_normalize()
        .unwrap_or_else(|| first_normal(to))
}

#[cfg(test)]
mod tests;
