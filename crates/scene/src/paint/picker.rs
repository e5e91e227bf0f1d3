//! The strand under the cursor, and the points around it.

use std::ops::Range;

use glam::Vec3;

use super::grid::PointGrid;
use crate::camera::Camera;
use crate::strands::{Origin, Strands};

/// A strand is under the cursor if it passes within this many pixels.
pub const PICK_PX: f32 = 4.0;

/// Finds strands and points of hair as it stands; must be rebuilt when it moves.
#[derive(Clone, Debug)]
pub struct Picker {
    points: Vec<[f32; 4]>,
    /// First points of segments, by the point: is there a segment from it to the next?
    has_next: Vec<bool>,
    origins: Vec<Origin>,
    grid: PointGrid,
    longest: f32,
    /// Of each point of the groom: arc length from the root, cm.
    arcs: Vec<f32>,
    /// Points of the groom of each strand that can be seen, ascending.
    strands: Vec<Range<u32>>,
}

/// A piece of a strand near the cursor.
struct Candidate {
    depth: f32,
    /// Pixels from the cursor.
    apart: f32,
    ix: u32,
    position: Vec3,
}

impl Picker {
    /// A picker of `strands` where their points are now.
    pub fn new(strands: &Strands) -> Picker {
        let (points, origins) = (&strands.points, strands.origins());
        let position = |ix: usize| Vec3::from_slice(&points[ix]);
        let mut has_next = vec![false; points.len()];
        let mut longest = 0.0f32;
        for &first in &strands.segments {
            let first = first as usize;
            has_next[first] = true;
            longest = longest.max(position(first).distance(position(first + 1)));
        }
        let mut arcs = vec![0.0; strands.n_groom_points()];
        let mut ranges = Vec::with_capacity(strands.n_strands);
        let mut first = 0;
        while first < points.len() {
            let mut arc = 0.0;
            let mut ix = first;
            let mut last_knot = origins[first].point;
            loop {
                let origin = origins[ix];
                if origin.fraction == 0.0 {
                    // Points of the groom that coincide share an arc length.
                    let at = arcs[last_knot as usize];
                    arcs[last_knot as usize..origin.point as usize].fill(at);
                    arcs[origin.point as usize] = arc;
                    last_knot = origin.point;
                }
                if !has_next[ix] {
                    break;
                }
                arc += position(ix).distance(position(ix + 1));
                ix += 1;
            }
            ranges.push(origins[first].point..last_knot + 1);
            first = ix + 1;
        }
        Picker {
            grid: PointGrid::new(points),
            points: points.clone(),
            has_next,
            origins: origins.to_vec(),
            longest,
            arcs,
            strands: ranges,
        }
    }

    /// Where the nearest strand lies that passes within [`PICK_PX`] of `cursor` (px from the upper
    /// left corner of a picture of `size`): of several the one in front.
    pub fn pick(&self, camera: &Camera, size: [u32; 2], cursor: [f32; 2]) -> Option<Vec3> {
        self.find(camera, size, cursor).map(|found| found.position)
    }

    /// The one of [`Strands::points`] at or before the place that [`Picker::pick`] finds.
    pub fn pick_point(&self, camera: &Camera, size: [u32; 2], cursor: [f32; 2]) -> Option<usize> {
        self.find(camera, size, cursor)
            .map(|found| found.ix as usize)
    }

    fn find(&self, camera: &Camera, size: [u32; 2], cursor: [f32; 2]) -> Option<Candidate> {
        let [width, height] = size.map(|side| side.max(1) as f32);
        let focal = camera.focal_px(height);
        let (right, up, forward) = camera.axes();
        let (x, y) = (cursor[0] - 0.5 * width, 0.5 * height - cursor[1]);
        let axis = (forward + (x * right + y * up) / focal).normalize();
        // At distance 1 along the axis a pixel is at most this wide.
        let slope = (PICK_PX + 1.0) / focal * (1.0 + (x * x + y * y) / (focal * focal));
        let near = 1e-4 * (camera.eye - camera.target).length().max(1e-3);
        let project = |position: Vec3| {
            let from = position - camera.eye;
            let depth = from.dot(forward);
            let scale = focal / depth;
            let on_screen = [scale * from.dot(right) - x, scale * from.dot(up) - y];
            (depth > near).then_some((on_screen, depth))
        };
        let mut found: Vec<Candidate> = Vec::new();
        let cone = [camera.eye, axis];
        self.grid.in_cone(cone, slope, self.longest, |ix| {
            if !self.has_next[ix as usize] {
                return;
            }
            let a = Vec3::from_slice(&self.points[ix as usize]);
            let b = Vec3::from_slice(&self.points[ix as usize + 1]);
            let (Some(([ax, ay], a_depth)), Some(([bx, by], b_depth))) = (project(a), project(b))
            else {
                return;
            };
            let (dx, dy) = (bx - ax, by - ay);
            let square = dx * dx + dy * dy;
            let t = match square > 1e-12 {
                true => (-(ax * dx + ay * dy) / square).clamp(0.0, 1.0),
                false => 0.0,
            };
            let apart = (ax + t * dx).hypot(ay + t * dy);
            // Straight on the screen is not even in space: t there by the depths.
            let t = t * a_depth / (b_depth + t * (a_depth - b_depth));
            // False for NaN.
            if apart <= PICK_PX {
                found.push(Candidate {
                    depth: a_depth + t * (b_depth - a_depth),
                    apart,
                    ix,
                    position: a.lerp(b, t),
                });
            }
        });
        let front = found.iter().map(|it| it.depth).reduce(f32::min)?;
        // Of the strand in front that place which the cursor is nearest to.
        let behind = front * (1.0 + 2.0 * PICK_PX / focal);
        found
            .into_iter()
            .filter(|it| it.depth <= behind)
            .min_by(|a, b| a.apart.total_cmp(&b.apart).then(a.ix.cmp(&b.ix)))
    }

    /// Points of the groom whose hair lies within `radius` cm of `centre`, each once and in
    /// order, with their nearness: 1 at the centre and 0 at the edge, as `nearness` has it of a
    /// distance. Hair between two points counts for both by its place between them.
    pub(super) fn around(
        &self,
        centre: Vec3,
        radius: f32,
        nearness: impl Fn(f32) -> f32,
    ) -> Vec<(u32, f32)> {
        let mut found = Vec::new();
        self.grid.near(centre, radius, |ix| {
            let distance = Vec3::from_slice(&self.points[ix as usize]).distance(centre);
            let near = nearness(distance);
            // NaN is not near.
            if distance > radius || near.is_nan() || near <= 0.0 {
                return;
            }
            let Origin { point, fraction } = self.origins[ix as usize];
            if fraction < 1.0 {
                found.push((point, (1.0 - fraction) * near));
            }
            if fraction > 0.0 {
                found.push((point + 1, fraction * near));
            }
        });
        // Of one point the nearest first.
        found.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
        found.dedup_by_key(|entry| entry.0);
        found
    }

    /// Points of the groom of each strand that can be seen, ascending.
    pub(super) fn strands(&self) -> &[Range<u32>] {
        &self.strands
    }

    /// Points of the groom on the strand of `point`; [`None`] if it cannot be seen.
    pub(super) fn strand_of(&self, point: u32) -> Option<Range<u32>> {
        let after = self.strands.partition_point(|range| range.start <= point);
        let range = self.strands.get(after.checked_sub(1)?)?;
        range.contains(&point).then(|| range.clone())
    }

    /// Arc length from the root to a point of the groom, cm.
    pub(super) fn arc(&self, point: u32) -> f32 {
        self.arcs.get(point as usize).copied().unwrap_or(0.0)
    }

    /// The groom's point at `share` (0 root..=1 tip) of the length of the strand that `point` is on, and the share of
    /// the way from there to the next; [`None`] if that strand cannot be seen.
    #[doc(hidden)]
    pub fn at_share(&self, point: u32, share: f32) -> Option<(u32, f32)> {
        let strand = self.strand_of(point)?;
        let arcs = self.arcs.get(strand.start as usize..strand.end as usize)?;
        let arc = arcs.last()? * share.clamp(0.0, 1.0);
        let ix = arcs.partition_point(|&at| at <= arc).saturating_sub(1);
        let (from, to) = (arcs[ix], arcs.get(ix + 1));
        let fraction = match to {
            Some(&to) if to > from => ((arc - from) / (to - from)).clamp(0.0, 1.0),
            _ => 0.0,
        };
        Some((strand.start + ix as u32, fraction))
    }

    /// Pixels that a ball of `radius` cm at `position` is wide to either side.
    pub fn radius_px(camera: &Camera, size: [u32; 2], position: Vec3, radius: f32) -> f32 {
        let focal = camera.focal_px(size[1].max(1) as f32);
        let depth = (position - camera.eye).dot(camera.axes().2);
        focal * radius / depth.max(1e-3)
    }
}
