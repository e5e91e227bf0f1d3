//! The groom as the passes read it: points with radius and frame, and the segments between them.

use std::sync::Arc;

use glam::Vec3;

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
    /// By point; shared by all that moved from the same strands.
    origins: Arc<[Origin]>,
    /// By drawn strand: its index in the groom; shared likewise.
    ids: Arc<[u32]>,
    /// Points of the groom.
    n_groom_points: usize,
}

impl Strands {
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
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &point in points {
            low = low.min(Vec3::from(point));
            high = high.max(Vec3::from(point));
        }
        let centre = 0.5 * (low + high);
        let radius = points
            .iter()
            .map(|&point| Vec3::from(point).distance(centre))
            .fold(0.0, f32::max);
        let mut strands = Strands {
            centre,
            radius,
            bounds: (low, high),
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
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (point, &[x, y, z, _]) in points.iter().enumerate() {
            if [x, y, z].iter().any(is_far) {
                return Err(SceneError::Point { point });
            }
            low = low.min(Vec3::new(x, y, z));
            high = high.max(Vec3::new(x, y, z));
        }
        let centre = 0.5 * (low + high);
        let distance = |p: &[f32; 4]| Vec3::from_slice(p).distance(centre);
        let mut moved = Strands {
            segments: self.segments.clone(),
            n_strands: self.n_strands,
            n_degenerate: self.n_degenerate,
            centre,
            radius: points.iter().map(distance).fold(0.0, f32::max),
            bounds: (low, high),
            origins: Arc::clone(&self.origins),
            ids: Arc::clone(&self.ids),
            n_groom_points: self.n_groom_points,
            ..Strands::default()
        };
        let mut positions = Vec::new();
        for (strand, segments) in self.strand_segments().enumerate() {
            positions.clear();
            for &[x, y, z, radius] in &points[segments[0] as usize..][..=segments.len()] {
                if !(radius.is_finite() && radius > 0.0) {
                    let value = 2.0 * radius;
                    return Err(SceneError::Diameter { strand, value });
                }
                positions.push((Vec3::new(x, y, z), radius));
            }
            moved.push_points(&positions);
        }
        Ok(moved)
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
        for (strand, [first, n]) in self.ranges().enumerate() {
            let of_strand = &radii[first as usize..][..n as usize];
            let is_wrong = |radius: &&f32| !(radius.is_finite() && **radius > 0.0);
            if let Some(radius) = of_strand.iter().find(is_wrong) {
                let value = 2.0 * radius;
                return Err(SceneError::Diameter { strand, value });
            }
        }
        let mut strands = self.clone();
        for (point, &radius) in strands.points.iter_mut().zip(radii) {
            point[3] = radius;
        }
        strands.max_diameter = 2.0 * radii.iter().copied().fold(0.0, f32::max);
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

        self.push_points(&positions);
        let end = self.points.len();
        self.segments.extend((first..end - 1).map(|ix| ix as u32));
        self.n_strands += 1;
    }

    /// Appends points (position, radius) of one strand, and their frames.
    fn push_points(&mut self, positions: &[(Vec3, f32)]) {
        let mut normal = Vec3::ZERO;
        let mut last_tangent = Vec3::ZERO;
        for (ix, &(position, radius)) in positions.iter().enumerate() {
            let direction =
                |a: usize, b: usize| (positions[b].0 - positions[a].0).normalize_or_zero();
            let after = if ix + 1 < positions.len() {
                direction(ix, ix + 1)
            } else {
                Vec3::ZERO
            };
            let before = if ix > 0 {
                direction(ix - 1, ix)
            } else {
                Vec3::ZERO
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
            let half_to = |other: Option<&(Vec3, f32)>| {
                other.map_or(0.0, |(there, _)| 0.5 * there.distance(position))
            };
            let before = half_to(ix.checked_sub(1).map(|ix| &positions[ix]));
            let after = half_to(positions.get(ix + 1));
            self.points
                .push([position.x, position.y, position.z, radius]);
            self.tangents
                .push([tangent.x, tangent.y, tangent.z, before]);
            self.normals.push([normal.x, normal.y, normal.z, after]);
            self.max_diameter = self.max_diameter.max(2.0 * radius);
        }
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
