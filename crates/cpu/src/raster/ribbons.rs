//! Ribbons on the screen, as the rasteriser takes them: segments, and in close-ups pieces of bent ones and of tips.

use rayon::prelude::*;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::sampling::SAMPLE_POSITIONS;
use strandlight_scene::strands::Strands;

use super::super::pieces::Pieces;
use super::super::project::Projected;
use super::super::screen_point::{SAMPLED_WIDTH_PX, ScreenPoint, edges_at, screen_point};

/// 1/256 px in a pixel.
pub(super) const PX: i32 = 256;

/// Jitter moves a ribbon by at most this much, 1/256 px.
const MAX_JITTER: i32 = 64;

/// Order of the first piece: all whole segments come before.
const FIRST_PIECE: u32 = 1 << 31;

/// Part of the picture, px.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub origin: [i32; 2],
    pub size: [i32; 2],
}

impl Rect {
    /// Both halves along the longer side, which is two at least.
    pub fn halves(&self) -> [Rect; 2] {
        let axis = usize::from(self.size[1] > self.size[0]);
        let (mut one, mut other) = (*self, *self);
        one.size[axis] = (self.size[axis] + 1) / 2;
        other.size[axis] -= one.size[axis];
        other.origin[axis] += one.size[axis];
        [one, other]
    }

    /// Lowest and highest coordinates along an axis, 1/256 px, with a margin.
    pub fn range(&self, axis: usize, margin: i32) -> [i64; 2] {
        let low = i64::from(self.origin[axis]) * i64::from(PX);
        let high = low + i64::from(self.size[axis]) * i64::from(PX);
        [low - i64::from(margin), high + i64::from(margin)]
    }
}

/// A segment on the screen or a piece of one, without jitter.
pub(crate) struct Ribbon {
    /// Its place among the segments.
    pub segment: u32,
    /// Of equally deep ones the lower is seen: segments in their order, then pieces in theirs.
    pub(super) order: u32,
    is_opaque: bool,
    /// Depths of its ends.
    pub(super) depth: [f32; 2],
    /// The share of the segment's way where it begins, and how much of that way it is.
    pub(super) part: [f32; 2],
    /// Around the ribbon, in order: left and right at the first point, right and left at the
    /// second.
    pub(super) corners: [[i32; 2]; 4],
}

/// The segments that touch the picture, from front to back; in a close-up, bent ones and tips in pieces.
pub(crate) fn ribbons(
    view: &ViewUniform,
    strands: &Strands,
    projected: &[Projected],
    is_close_up: bool,
) -> Vec<Ribbon> {
    let picture = Rect {
        origin: [0, 0],
        size: view.size.map(|n| n as i32),
    };
    let picture = &picture;
    let of_segment = |(segment, &first): (usize, &u32)| {
        let (segment, first) = (segment as u32, first as usize);
        let (a, b) = (&projected[first], &projected[first + 1]);
        let curve = match is_close_up && near(picture, a, b) {
            true => Curve::new(view, strands, first),
            false => None,
        };
        let n = curve.as_ref().map_or(1, |curve| curve.pieces.n());
        let ribbon = move |ix| match &curve {
            Some(curve) => Some(curve.piece(segment, ix)),
            None => Ribbon::of_segment(segment, a, b),
        };
        (0..n)
            .filter_map(ribbon)
            .filter(|ribbon| ribbon.may_touch(picture))
    };
    let segments = strands.segments.par_iter().enumerate();
    let mut ribbons: Vec<Ribbon> = segments.flat_map_iter(of_segment).collect();
    let pieces = ribbons
        .iter_mut()
        .filter(|ribbon| ribbon.order == FIRST_PIECE);
    for (order, piece) in (FIRST_PIECE..).zip(pieces) {
        piece.order = order;
    }
    ribbons.par_sort_unstable_by(|a, b| {
        let by_depth = a.nearest().total_cmp(&b.nearest());
        by_depth.then(a.order.cmp(&b.order))
    });
    ribbons
}

/// May pieces of the segment between two points touch the picture? They stay within the segment's length of its ends.
fn near(picture: &Rect, a: &Projected, b: &Projected) -> bool {
    let ranges = [0, 1].map(|axis: usize| {
        let at = [a, b].map(|p| [p.edges[axis], p.edges[axis + 2]].map(i64::from));
        let at = at.as_flattened();
        at[1..]
            .iter()
            .fold([at[0]; 2], |[low, high], x| [low.min(*x), high.max(*x)])
    });
    let margin = ranges
        .map(|[low, high]| high - low)
        .into_iter()
        .max()
        .unwrap_or(0);
    let mut axes = ranges.iter().enumerate();
    axes.all(|(axis, [low, high])| {
        let [left, right] = picture.range(axis, PX);
        low - margin <= right && high + margin >= left
    })
}

/// A segment in pieces.
struct Curve {
    ends: [ScreenPoint; 2],
    pieces: Pieces,
}

impl Curve {
    /// That from point `first` on; [`None`] if it is drawn as a whole.
    fn new(view: &ViewUniform, strands: &Strands, first: usize) -> Option<Curve> {
        let ends = [first, first + 1].map(|p| {
            screen_point(
                view,
                &strands.points[p],
                &strands.tangents[p],
                SAMPLED_WIDTH_PX,
            )
        });
        let is_tip = strands.normals[first + 1][3] == 0.0;
        let pieces = Pieces::new(&ends[0], &ends[1], is_tip)?;
        Some(Curve { ends, pieces })
    }

    fn piece(&self, segment: u32, ix: u32) -> Ribbon {
        let [a, b] = &self.ends;
        let [(begin, from), (end, to)] = [ix, ix + 1].map(|ix| self.pieces.cut(a, b, ix));
        let [[xl_a, yl_a, xr_a, yr_a], [xl_b, yl_b, xr_b, yr_b]] =
            [begin, end].map(|at| edges_at(&at));
        Ribbon {
            segment,
            order: FIRST_PIECE,
            is_opaque: a.coverage >= 1.0 && b.coverage >= 1.0,
            depth: [begin.depth, end.depth],
            part: [from, to - from],
            corners: [[xl_a, yl_a], [xr_a, yr_a], [xr_b, yr_b], [xl_b, yl_b]],
        }
    }
}

impl Ribbon {
    /// That of a whole segment between two points; [`None`] where it is behind the eye.
    fn of_segment(segment: u32, a: &Projected, b: &Projected) -> Option<Ribbon> {
        if a.coverage < 0.0 || b.coverage < 0.0 {
            return None;
        }
        // Where the strand turns back on the screen its edges change sides.
        let mut edges_b = b.edges;
        let side = |e: [i32; 4]| [(e[0] - e[2]) as f32, (e[1] - e[3]) as f32];
        let (side_a, side_b) = (side(a.edges), side(b.edges));
        if side_a[0] * side_b[0] + side_a[1] * side_b[1] < 0.0 {
            edges_b = [edges_b[2], edges_b[3], edges_b[0], edges_b[1]];
        }
        Some(Ribbon {
            segment,
            order: segment,
            is_opaque: a.coverage >= 1.0 && b.coverage >= 1.0,
            depth: [a.depth, b.depth],
            part: [0.0, 1.0],
            corners: [
                [a.edges[0], a.edges[1]],
                [a.edges[2], a.edges[3]],
                [edges_b[2], edges_b[3]],
                [edges_b[0], edges_b[1]],
            ],
        })
    }

    /// Depth of its nearer end.
    pub(super) fn nearest(&self) -> f32 {
        self.depth[0].min(self.depth[1])
    }

    /// Depth of its farther end.
    pub(super) fn farthest(&self) -> f32 {
        self.depth[0].max(self.depth[1])
    }

    /// Lowest and highest coordinates along an axis.
    fn range(&self, axis: usize) -> [i64; 2] {
        let along = self.corners.map(|corner| i64::from(corner[axis]));
        let low = along.iter().copied().min().unwrap_or(0);
        [low, along.iter().copied().max().unwrap_or(0)]
    }

    /// Can some pass draw it in `rect`? False only if none can.
    pub(super) fn may_touch(&self, rect: &Rect) -> bool {
        let mut is_long = true;
        for axis in 0..2 {
            let ([low, high], [left, right]) = (self.range(axis), rect.range(axis, PX));
            if low > right || high < left {
                return false;
            }
            is_long &= high - low > right - left;
        }
        if !is_long {
            return true;
        }
        // A long slanting ribbon may still pass by: apart along a direction across it.
        let [la, ra, rb, lb] = self.corners.map(|corner| corner.map(f64::from));
        let along = [0, 1].map(|axis: usize| lb[axis] + rb[axis] - la[axis] - ra[axis]);
        let across = [0, 1].map(|axis: usize| la[axis] - ra[axis]);
        let ranges = [0, 1].map(|axis: usize| rect.range(axis, PX).map(|x| x as f64));
        [along, across].iter().all(|[x, y]| {
            let off = |corner: [f64; 2]| corner[1] * x - corner[0] * y;
            let offs = [la, ra, rb, lb].map(off);
            let low = offs.iter().copied().fold(f64::INFINITY, f64::min);
            let high = offs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let [[left, right], [top, bottom]] = ranges;
            let middle = off([0.5 * (left + right), 0.5 * (top + bottom)]);
            let reach = 0.5 * ((bottom - top) * x.abs() + (right - left) * y.abs());
            // A unit covers rounding.
            low <= middle + reach + 1.0 && high >= middle - reach - 1.0
        })
    }

    /// Calls `at` with each pixel of a picture of `size` whose centre the ribbon covers without
    /// jitter, some of them twice where it is twisted.
    pub fn for_each_centre(&self, size: [i32; 2], mut at: impl FnMut([i32; 2])) {
        let [left_a, right_a, right_b, left_b] = self.corners;
        for mut corners in [[left_a, right_a, left_b], [left_b, right_a, right_b]] {
            let [a, b, c] = corners.map(|p| p.map(i64::from));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if area == 0 {
                continue;
            }
            // Clockwise, as in `Tile::triangle`.
            if area < 0 {
                corners.swap(1, 2);
            }
            let [p0, p1, p2] = corners;
            let edges = [Edge::new(p1, p2), Edge::new(p2, p0), Edge::new(p0, p1)];
            let bound = |axis: usize| {
                let low = p0[axis].min(p1[axis]).min(p2[axis]).div_euclid(PX);
                let high = p0[axis].max(p1[axis]).max(p2[axis]).div_euclid(PX);
                low.max(0)..=high.min(size[axis] - 1)
            };
            for y in bound(1) {
                for x in row_span(&corners, y, bound(0)) {
                    let centre = [x * PX + PX / 2, y * PX + PX / 2];
                    if edges.iter().all(|edge| edge.at(centre) >= edge.bias) {
                        at([x, y]);
                    }
                }
            }
        }
    }

    /// Do all passes draw it over all of `rect`?
    pub(super) fn covers(&self, rect: &Rect) -> bool {
        if !self.is_opaque {
            return false;
        }
        let ranges = [0, 1].map(|axis: usize| rect.range(axis, MAX_JITTER));
        for (axis, [left, right]) in ranges.iter().enumerate() {
            let [low, high] = self.range(axis);
            if low > *left || high < *right {
                return false;
            }
        }
        // On the inner side of all four edges.
        let [[left, right], [top, bottom]] = ranges;
        let places = [[left, top], [right, top], [left, bottom], [right, bottom]];
        let mut sides = (0..4).flat_map(|ix| {
            let [p, q] = [self.corners[ix], self.corners[(ix + 1) % 4]].map(|c| c.map(i64::from));
            let side =
                move |[x, y]: [i64; 2]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
            places.map(side)
        });
        let first = sides.next().map_or(0, i64::signum);
        first != 0 && sides.all(|side| side.signum() == first)
    }
}

/// An edge function in exact integers, with the top-left rule folded in.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    from: [i32; 2],
    delta: [i64; 2],
    /// Added to the value at a pixel's upper left corner by each sample, less `bias`.
    pub offset: [i64; 4],
    /// 1 where a sample on the edge belongs to the neighbour.
    pub bias: i64,
}

impl Edge {
    pub fn new(from: [i32; 2], to: [i32; 2]) -> Self {
        let delta = [i64::from(to[0] - from[0]), i64::from(to[1] - from[1])];
        // Clockwise with y downwards: a top edge runs to the right, a left edge upwards.
        let top_left = (delta[1] == 0 && delta[0] > 0) || delta[1] < 0;
        let bias = i64::from(!top_left);
        let offset =
            SAMPLE_POSITIONS.map(|[x, y]| delta[0] * i64::from(y) - delta[1] * i64::from(x) - bias);
        Edge {
            from,
            delta,
            offset,
            bias,
        }
    }

    pub fn at(&self, [x, y]: [i32; 2]) -> i64 {
        self.delta[0] * i64::from(y - self.from[1]) - self.delta[1] * i64::from(x - self.from[0])
    }
}

/// Pixels of row `y` that the triangle may touch, within `bound`.
pub(super) fn row_span(
    corners: &[[i32; 2]; 3],
    y: i32,
    bound: std::ops::RangeInclusive<i32>,
) -> std::ops::RangeInclusive<i32> {
    // Cutting short rows costs more than looking at all their pixels.
    if bound.end() - bound.start() < 4 {
        return bound;
    }
    let (top, bottom) = (f64::from(y * PX), f64::from((y + 1) * PX));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for ix in 0..3 {
        let [p, q] = [corners[ix], corners[(ix + 1) % 3]].map(|p| p.map(f64::from));
        if (p[1] < top && q[1] < top) || (p[1] > bottom && q[1] > bottom) {
            continue;
        }
        // The part of this edge inside the row.
        let cut = |line: f64| p[0] + (q[0] - p[0]) * ((line - p[1]) / (q[1] - p[1]));
        for end in [p, q] {
            let x = if end[1] < top {
                cut(top)
            } else if end[1] > bottom {
                cut(bottom)
            } else {
                end[0]
            };
            low = low.min(x);
            high = high.max(x);
        }
    }
    // A unit on each side covers rounding. Infinities of an empty row saturate to an empty range.
    let low = ((low - 1.0) / f64::from(PX)).floor() as i32;
    let high = ((high + 1.0) / f64::from(PX)).floor() as i32;
    low.max(*bound.start())..=high.min(*bound.end())
}
