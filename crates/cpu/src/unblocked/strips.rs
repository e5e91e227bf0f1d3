//! Strands in an order in which one follows another that is near, and where maps are looked up on them.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use strandlight_scattering::wide::LANES;
use strandlight_scene::shadow_maps::SHADOW_SIDE;
use strandlight_scene::strands::Strands;

/// Runs that are drawn into a map of [`SHADOW_SIDE`] at a time, a millisecond; fewer into finer ones.
const RUNS_AT_ONCE: u32 = 1 << 13;

/// Points that are looked up on such a map at a time.
const SEEN_AT_ONCE: u32 = 1 << 16;

/// Strands in an order in which one follows another that is near.
#[derive(Default)]
pub(in super::super) struct StripOrder {
    /// Coordinates and radius of the points, strand after strand, and a vector more.
    pub(super) points: [Vec<f32>; 4],
    strips: Vec<Strip>,
    /// The segments of the strips, eight at a time.
    pub(super) runs: Vec<Run>,
    /// Boxes around the points of the runs, cm: their middles, half their extents, and the radius of their widest point; and a
    /// vector more.
    pub(super) boxes: [Vec<f32>; 7],
}

/// Where strands are looked up.
pub(super) struct Strips {
    pub order: Arc<StripOrder>,
    pub seen: Vec<Seen>,
    /// By run: is one of its points looked up?
    pub has_seen: Vec<bool>,
    /// Points that are asked for; those of no segment are lit.
    pub n_places: usize,
}

/// A strand.
struct Strip {
    /// Its first point in [`StripOrder`], and in [`Strands::points`].
    at: u32,
    first: u32,
    n_segments: u32,
    /// The first of its runs.
    first_run: u32,
}

/// At most eight segments of a strand, one after the other.
pub(super) struct Run {
    /// Its first point in [`StripOrder`], and in [`Strands::points`].
    pub at: u32,
    pub first: u32,
    pub n_segments: u32,
}

/// A point that is looked up.
pub(super) struct Seen {
    /// Among [`StripOrder::points`], and among the visible points.
    pub at: u32,
    pub place: u32,
    /// Index in [`Strands::points`].
    pub point: u32,
    /// Half the way to the points before and after it, cm; 0 where there is none.
    pub before: f32,
    pub after: f32,
}

impl Strips {
    /// Of a point that is looked up, cm.
    pub fn position(&self, seen: &Seen) -> Vec3 {
        let [x, y, z, _] = &self.order.points;
        let at = seen.at as usize;
        Vec3::new(x[at], y[at], z[at])
    }

    /// Strips in `order`, looked up at the points `visible` of `strands`, in ascending order.
    pub fn new(order: &Arc<StripOrder>, strands: &Strands, visible: &[u32]) -> Strips {
        let mut seen = Vec::with_capacity(visible.len());
        let mut has_seen = vec![false; order.runs.len()];
        for strip in &order.strips {
            let Strip {
                at,
                first,
                n_segments,
                first_run,
            } = *strip;
            let place = visible.partition_point(|&other| other < first);
            let of_strand = visible[place..].iter().zip(place as u32..);
            for (&point, place) in of_strand.take_while(|(point, _)| **point <= first + n_segments)
            {
                let ix = point - first;
                seen.push(Seen {
                    at: at + ix,
                    place,
                    point,
                    before: strands.tangents[point as usize][3],
                    after: strands.normals[point as usize][3],
                });
                // It is looked up half way to its neighbours, which may lie in two runs.
                for segment in [ix.saturating_sub(1), ix.min(n_segments - 1)] {
                    has_seen[(first_run + segment / LANES as u32) as usize] = true;
                }
            }
        }
        Strips {
            order: Arc::clone(order),
            seen,
            has_seen,
            n_places: visible.len(),
        }
    }
}

impl StripOrder {
    pub fn new(strands: &Strands) -> StripOrder {
        let segments = &strands.segments;
        let mut found: Vec<(u32, u32, u32)> = Vec::with_capacity(strands.n_strands);
        let (low, high) = strands.bounds;
        let scale = 1023.0 / (high - low).max_element().max(1e-6);
        let mut start = 0;
        for end in 1..=segments.len() {
            if end < segments.len() && segments[end] == segments[end - 1] + 1 {
                continue;
            }
            let middle = segments[(start + end) / 2] as usize;
            let at = (Vec3::from_slice(&strands.points[middle]) - low) * scale;
            let key = morton(at.as_uvec3().to_array());
            found.push((key, segments[start], (end - start) as u32));
            start = end;
        }
        found.sort_unstable();
        let n_points = segments.len() + found.len();
        let mut points = [(); 4].map(|()| Vec::with_capacity(n_points + LANES));
        let mut strips = Vec::with_capacity(found.len());
        let mut runs = Vec::with_capacity(segments.len() / LANES + found.len());
        let mut boxes = [(); 7].map(|()| Vec::with_capacity(runs.capacity() + LANES));
        for (_, first, n_segments) in found {
            strips.push(Strip {
                at: points[0].len() as u32,
                first,
                n_segments,
                first_run: runs.len() as u32,
            });
            for segment in (0..n_segments).step_by(LANES) {
                let run = Run {
                    at: points[0].len() as u32 + segment,
                    first: first + segment,
                    n_segments: (n_segments - segment).min(LANES as u32),
                };
                let box_of_run = box_around(&strands.points[run.points()]);
                for (numbers, number) in boxes.iter_mut().zip(box_of_run) {
                    numbers.push(number);
                }
                runs.push(run);
            }
            for point in &strands.points[first as usize..=(first + n_segments) as usize] {
                for (numbers, number) in points.iter_mut().zip(point) {
                    numbers.push(*number);
                }
            }
        }
        for numbers in &mut points {
            numbers.resize(n_points + LANES, 0.0);
        }
        for numbers in &mut boxes {
            numbers.resize(runs.len() + LANES, 0.0);
        }
        StripOrder {
            points,
            strips,
            runs,
            boxes,
        }
    }
}

impl Run {
    /// Its points in [`Strands::points`].
    fn points(&self) -> Range<usize> {
        let first = self.first as usize;
        first..first + self.n_segments as usize + 1
    }
}

/// As in [`StripOrder::boxes`].
fn box_around(points: &[[f32; 4]]) -> [f32; 7] {
    let (mut low, mut high, mut radius) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0_f32);
    for point in points {
        let at = Vec3::from_slice(point);
        (low, high, radius) = (low.min(at), high.max(at), radius.max(point[3]));
    }
    let [x, y, z] = (0.5 * (low + high)).to_array();
    let [width, height, depth] = (0.5 * (high - low)).to_array();
    [x, y, z, width, height, depth, radius]
}

/// How many runs are drawn at a time into a map of this side.
pub(super) fn some_runs(side: u32) -> usize {
    at_once(RUNS_AT_ONCE, side)
}

/// How many points are looked up at a time on a map of this side.
pub(super) fn some_seen(side: u32) -> usize {
    at_once(SEEN_AT_ONCE, side)
}

/// How much is done at a time on a map of this side, where it is `most` on one of [`SHADOW_SIDE`].
fn at_once(most: u32, side: u32) -> usize {
    (most / side.div_ceil(SHADOW_SIDE).max(1)) as usize
}

/// The lowest ten bits of three numbers, interleaved.
fn morton(at: [u32; 3]) -> u32 {
    let spread = |n: u32| (0..10).fold(0, |sum, bit| sum | (n.min(1023) >> bit & 1) << (3 * bit));
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}
