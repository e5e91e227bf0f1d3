//! Strands in an order in which one follows another that is near, and where maps are looked up on them.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use strandlight_scattering::wide::LANES;
use strandlight_scene::shadow_maps::SHADOW_SIDE;
use strandlight_scene::strands::Strands;

/// Segments that are drawn into a map of [`SHADOW_SIDE`] at a time, some milliseconds; fewer into finer ones.
const SEGMENTS_AT_ONCE: u32 = 1 << 16;

/// Points that are looked up on such a map at a time.
const SEEN_AT_ONCE: u32 = 1 << 17;

/// Strands in an order in which one follows another that is near.
#[derive(Default)]
pub(in super::super) struct StripOrder {
    /// Coordinates and radius of the points, strand after strand, and a vector more.
    pub(super) points: [Vec<f32>; 4],
    pub(super) strips: Vec<Strip>,
}

/// Where strands are looked up.
pub(super) struct Strips {
    pub order: Arc<StripOrder>,
    pub seen: Vec<Seen>,
    /// Points that are asked for; those of no segment are lit.
    pub n_places: usize,
}

/// A strand.
pub(super) struct Strip {
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
    /// Way to the points before and after it, cm; 0 where there is none.
    pub before: f32,
    pub after: f32,
}

impl Strips {
    /// Strips from `first` on that are drawn at a time into a map of this side.
    pub fn some(&self, first: usize, side: u32) -> Range<usize> {
        let most = at_once(SEGMENTS_AT_ONCE, side);
        let mut n_segments = 0;
        let is_enough = |strip: &Strip| {
            n_segments += strip.n_segments;
            n_segments >= most
        };
        match self.order.strips[first..].iter().position(is_enough) {
            Some(last) => first..first + last + 1,
            None => first..self.order.strips.len(),
        }
    }

    /// Points from `first` on that are looked up at a time on a map of this side, in [`Strips::seen`].
    pub fn some_seen(&self, first: usize, side: u32) -> Range<usize> {
        first..(first + at_once(SEEN_AT_ONCE, side) as usize).min(self.seen.len())
    }

    /// Of a point that is looked up, cm.
    pub fn position(&self, seen: &Seen) -> Vec3 {
        let [x, y, z, _] = &self.order.points;
        let at = seen.at as usize;
        Vec3::new(x[at], y[at], z[at])
    }

    /// Strips in `order`, looked up at the points `visible` of `strands`, in ascending order.
    pub fn new(order: &Arc<StripOrder>, strands: &Strands, visible: &[u32]) -> Strips {
        let mut seen = Vec::with_capacity(visible.len());
        for &Strip {
            at,
            first,
            n_segments,
        } in &order.strips
        {
            let place = visible.partition_point(|&other| other < first);
            let of_strand = visible[place..].iter().zip(place as u32..);
            for (&point, place) in of_strand.take_while(|(point, _)| **point <= first + n_segments)
            {
                seen.push(Seen {
                    at: at + point - first,
                    place,
                    point,
                    before: strands.tangents[point as usize][3],
                    after: strands.normals[point as usize][3],
                });
            }
        }
        Strips {
            order: Arc::clone(order),
            seen,
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
        for (_, first, n_segments) in found {
            strips.push(Strip {
                at: points[0].len() as u32,
                first,
                n_segments,
            });
            for point in &strands.points[first as usize..=(first + n_segments) as usize] {
                for (numbers, number) in points.iter_mut().zip(point) {
                    numbers.push(*number);
                }
            }
        }
        for numbers in &mut points {
            numbers.resize(n_points + LANES, 0.0);
        }
        StripOrder { points, strips }
    }
}

/// How much is done at a time on a map of this side, where it is `most` on one of [`SHADOW_SIDE`].
fn at_once(most: u32, side: u32) -> u32 {
    most / side.div_ceil(SHADOW_SIDE).max(1)
}

/// The lowest ten bits of three numbers, interleaved.
fn morton(at: [u32; 3]) -> u32 {
    let spread = |n: u32| (0..10).fold(0, |sum, bit| sum | (n.min(1023) >> bit & 1) << (3 * bit));
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}
