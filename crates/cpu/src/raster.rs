//! Rasterising the ribbons with the standard four-sample pattern. Twin of
//! `shaders/pass/strands.wgsl` and of the hardware's rasteriser and depth test.
//!
//! The picture is halved until its parts are small and few segments touch each; a part takes these
//! from front to back, and no more once all its samples are nearer than the next one. So what is
//! drawn is about what is seen, however wide the ribbons are. Of equally deep samples the segment
//! of the lower number is seen, whatever comes first: neither the parts nor the order change a bit.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use strandlight_scene::camera::{ViewUniform, WIDE_PX};
use strandlight_scene::sampling::{
    PASS_SAMPLES, SAMPLE_POSITIONS, coverage_key, coverage_mask, pass_jitter,
};
use strandlight_scene::stats::{LIGHTING_SHARE, Observer};
use strandlight_scene::strands::Strands;

use super::along_segments::{Along, along_segment};
use super::project::Projected;
use super::proxies::Proxies;
use super::radiance::{Radiance, profile_factors};
use super::transmittance::mix;

/// Longest side of a tile in pixels; each is drawn by one thread.
const TILE: i32 = 32;

/// Longest side of a tile that is not divided however many segments touch it.
const LEAST_TILE: i32 = 8;

/// Most segments of a tile that is larger than that.
const MANY: usize = 4096;

/// Segments drawn before a tile is looked at for how far its samples still see.
const LOOK_EVERY: usize = 64;

/// Interpolation may bring a depth out of the range of the ribbon's ends by this much.
const DEPTH_ROUNDING: f32 = 1e-6;

/// 1/256 px in a pixel.
const PX: i32 = 256;

/// Jitter moves a ribbon by at most this much, 1/256 px.
const MAX_JITTER: i32 = 64;

/// One triangle: corners in 1/256 px with depth.
type Triangle = [([i32; 2], f32); 3];

/// What drawing made.
pub(super) struct Drawn {
    /// Sums of all samples of every pixel: radiance, and the number of samples covered.
    pub sums: Vec<[f32; 4]>,
    /// Pixels of triangles that were looked at, in all passes.
    pub visited: u64,
}

/// All that a tile is drawn of.
struct Hair<'a> {
    view: &'a ViewUniform,
    strands: &'a Strands,
    projected: &'a [Projected],
    radiance: &'a Radiance,
    /// Of wide strands over their width.
    even: Option<[f32; 4]>,
    proxies: &'a Proxies,
    /// The segments in the picture, from front to back.
    ribbons: &'a [Ribbon],
    samples: u32,
}

/// Draws `samples` a pixel.
pub(super) fn draw(
    view: &ViewUniform,
    strands: &Strands,
    projected: &[Projected],
    (radiance, even): (&Radiance, Option<[f32; 4]>),
    proxies: &Proxies,
    samples: u32,
    observer: Observer,
) -> Drawn {
    let ribbons = ribbons(view, strands, projected);
    let hair = Hair {
        view,
        strands,
        projected,
        radiance,
        even,
        proxies,
        ribbons: &ribbons,
        samples,
    };
    hair.draw([TILE, LEAST_TILE], observer)
}

impl Hair<'_> {
    /// Draws tiles of the first side at most, and of the second where many segments are.
    fn draw(&self, sides: [i32; 2], observer: Observer) -> Drawn {
        let size = self.view.size.map(|n| n as i32);
        let n_pixels = self.view.size.map(|n| n as usize).iter().product();
        let picture = Mutex::new(vec![[0.0; 4]; n_pixels]);
        let (n_done, visited) = (AtomicUsize::new(0), AtomicU64::new(0));
        let take = |tile: Tile| {
            visited.fetch_add(tile.visited, Ordering::Relaxed);
            let mut picture = picture.lock().unwrap_or_else(PoisonError::into_inner);
            let Rect { origin, size: of } = tile.rect;
            for (y, row) in tile.sums.chunks_exact(of[0] as usize).enumerate() {
                let start = (origin[1] as usize + y) * size[0] as usize + origin[0] as usize;
                picture[start..start + row.len()].copy_from_slice(row);
            }
            drop(picture);
            let done = n_done.fetch_add(tile.sums.len(), Ordering::Relaxed) + tile.sums.len();
            let done = done as f64 / n_pixels as f64;
            observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
        };
        let origin = [0, 0];
        let all = (0..self.ribbons.len() as u32).collect();
        self.divide(Rect { origin, size }, all, sides, &take);
        Drawn {
            sums: picture.into_inner().unwrap_or_else(PoisonError::into_inner),
            visited: visited.into_inner(),
        }
    }

    /// Draws the part `rect` of the picture, which the segments `from` may touch.
    fn divide(&self, rect: Rect, from: Vec<u32>, sides: [i32; 2], take: &(impl Fn(Tile) + Sync)) {
        let side = rect.size[0].max(rect.size[1]);
        if side <= sides[0] && (from.len() <= MANY || side <= sides[1]) {
            take(self.tile(rect, &from));
            return;
        }
        let [one, other] = rect.halves();
        let (a, b) = rayon::join(
            || self.touching(&one, &from),
            || self.touching(&other, &from),
        );
        drop(from);
        rayon::join(
            || self.divide(one, a, sides, take),
            || self.divide(other, b, sides, take),
        );
    }

    /// Those of `from` that may be seen in `rect`, in order.
    fn touching(&self, rect: &Rect, from: &[u32]) -> Vec<u32> {
        let mut found = Vec::new();
        let mut behind = f32::INFINITY;
        for &ix in from {
            let ribbon = &self.ribbons[ix as usize];
            if ribbon.nearest > behind {
                // So are all that follow.
                break;
            }
            if !ribbon.may_touch(rect) {
                continue;
            }
            found.push(ix);
            if ribbon.covers(rect) {
                behind = behind.min(ribbon.farthest + DEPTH_ROUNDING);
            }
        }
        found
    }

    fn tile(&self, rect: Rect, ribbons: &[u32]) -> Tile {
        let mut tile = Tile::new(rect);
        for pass in 0..self.samples.div_ceil(PASS_SAMPLES) {
            tile.clear();
            tile.proxies(self.view, self.proxies, pass_jitter(pass));
            tile.pass(pass, ribbons, self);
            let left = self.samples - PASS_SAMPLES * pass;
            tile.add(left.min(PASS_SAMPLES) as usize);
        }
        tile
    }
}

/// Part of the picture, px.
#[derive(Clone, Copy, Debug)]
struct Rect {
    origin: [i32; 2],
    size: [i32; 2],
}

impl Rect {
    /// Both halves along the longer side, which is two at least.
    fn halves(&self) -> [Rect; 2] {
        let axis = usize::from(self.size[1] > self.size[0]);
        let (mut one, mut other) = (*self, *self);
        one.size[axis] = (self.size[axis] + 1) / 2;
        other.size[axis] -= one.size[axis];
        other.origin[axis] += one.size[axis];
        [one, other]
    }

    /// Lowest and highest coordinates along an axis, 1/256 px, with a margin.
    fn range(&self, axis: usize, margin: i32) -> [i64; 2] {
        let low = i64::from(self.origin[axis]) * i64::from(PX);
        let high = low + i64::from(self.size[axis]) * i64::from(PX);
        [low - i64::from(margin), high + i64::from(margin)]
    }
}

/// A segment on the screen, without jitter.
pub(super) struct Ribbon {
    /// Its place among the segments.
    pub segment: u32,
    is_opaque: bool,
    /// Depths of the ends.
    nearest: f32,
    farthest: f32,
    /// Around the ribbon, in order: left and right at the first point, right and left at the
    /// second.
    corners: [[i32; 2]; 4],
}

/// The segments that touch the picture, from front to back.
pub(super) fn ribbons(
    view: &ViewUniform,
    strands: &Strands,
    projected: &[Projected],
) -> Vec<Ribbon> {
    let picture = Rect {
        origin: [0, 0],
        size: view.size.map(|n| n as i32),
    };
    let ribbon = |(segment, &first): (usize, &u32)| {
        let (a, b) = (&projected[first as usize], &projected[first as usize + 1]);
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
        let ribbon = Ribbon {
            segment: segment as u32,
            is_opaque: a.coverage >= 1.0 && b.coverage >= 1.0,
            nearest: a.depth.min(b.depth),
            farthest: a.depth.max(b.depth),
            corners: [
                [a.edges[0], a.edges[1]],
                [a.edges[2], a.edges[3]],
                [edges_b[2], edges_b[3]],
                [edges_b[0], edges_b[1]],
            ],
        };
        ribbon.may_touch(&picture).then_some(ribbon)
    };
    let segments = strands.segments.par_iter().enumerate();
    let mut ribbons: Vec<Ribbon> = segments.filter_map(ribbon).collect();
    ribbons.par_sort_unstable_by(|a, b| {
        let by_depth = a.nearest.total_cmp(&b.nearest);
        by_depth.then(a.segment.cmp(&b.segment))
    });
    ribbons
}

impl Ribbon {
    /// Lowest and highest coordinates along an axis.
    fn range(&self, axis: usize) -> [i64; 2] {
        let along = self.corners.map(|corner| i64::from(corner[axis]));
        let low = along.iter().copied().min().unwrap_or(0);
        [low, along.iter().copied().max().unwrap_or(0)]
    }

    /// Can some pass draw it in `rect`? False only if none can.
    fn may_touch(&self, rect: &Rect) -> bool {
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
    fn covers(&self, rect: &Rect) -> bool {
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

/// A tile's samples of the current pass, and its sums.
struct Tile {
    rect: Rect,
    depth: Vec<[f32; 4]>,
    /// The segment that is seen; 0 as well where there is none.
    owner: Vec<[u32; 4]>,
    color: Vec<[[f32; 4]; 4]>,
    sums: Vec<[f32; 4]>,
    /// Pixels of triangles that were looked at.
    visited: u64,
}

/// What shading one fragment needs of its segment.
struct Spine<'a> {
    segment: u32,
    /// Where the middle starts, px.
    a: [f32; 2],
    /// The direction along it over its length, so that a product gives the share of the way.
    along: [f32; 2],
    coverage: [f32; 2],
    radiance: [&'a [f32; 4]; 2],
    /// Of narrow lights about either end.
    narrow: Option<[&'a Along; 2]>,
    /// Where the segment is wide: half its width at the ends, px, and [`Hair::even`].
    wide: Option<([f32; 2], [f32; 4])>,
}

impl Tile {
    fn new(rect: Rect) -> Self {
        let n = (rect.size[0] * rect.size[1]) as usize;
        Tile {
            rect,
            depth: vec![[1.0; 4]; n],
            owner: vec![[0; 4]; n],
            color: vec![[[0.0; 4]; 4]; n],
            sums: vec![[0.0; 4]; n],
            visited: 0,
        }
    }

    fn clear(&mut self) {
        self.depth.fill([1.0; 4]);
        self.owner.fill([0; 4]);
        self.color.fill([[0.0; 4]; 4]);
    }

    /// Adds the first `n` samples of every pixel to the sums.
    fn add(&mut self, n: usize) {
        for (sum, samples) in self.sums.iter_mut().zip(&self.color) {
            for channel in 0..4 {
                let [first, others @ ..] = samples.map(|sample| sample[channel]);
                sum[channel] += others[..n - 1].iter().fold(first, |a, b| a + b);
            }
        }
    }

    /// Depth of the farthest sample.
    fn farthest(&self) -> f32 {
        let depths = self.depth.as_flattened().iter();
        depths.fold(0.0, |a: f32, &b| if a < b { b } else { a })
    }

    /// Draws the proxies, which come before the strands.
    fn proxies(&mut self, view: &ViewUniform, proxies: &Proxies, jitter: [i32; 2]) {
        if proxies.is_empty() {
            return;
        }
        let Rect { origin, size } = self.rect;
        let width = size[0];
        let samples = self.depth.iter_mut().zip(&mut self.color);
        for (ix, (depths, colors)) in (0..).zip(samples) {
            let pixel = [origin[0] + ix % width, origin[1] + ix / width];
            for covered in proxies.cover(view, pixel, jitter) {
                for (sample, depth) in depths.iter_mut().enumerate() {
                    if covered.mask >> sample & 1 == 1 && covered.depth < *depth {
                        (*depth, colors[sample]) = (covered.depth, covered.color);
                    }
                }
            }
        }
    }

    fn pass(&mut self, pass: u32, ribbons: &[u32], hair: &Hair) {
        let jitter = pass_jitter(pass);
        for (ix, &ribbon) in ribbons.iter().enumerate() {
            let ribbon = &hair.ribbons[ribbon as usize];
            let is_time = ix > 0 && ix % LOOK_EVERY == 0;
            if is_time && ribbon.nearest > self.farthest() + DEPTH_ROUNDING {
                // So are all that follow.
                break;
            }
            let first = hair.strands.segments[ribbon.segment as usize] as usize;
            let (a, b) = (&hair.projected[first], &hair.projected[first + 1]);
            let middle = |p: &Projected| {
                [0, 1].map(|axis: usize| {
                    (p.edges[axis] + p.edges[axis + 2] + 2 * jitter[axis]) as f32 * (1.0 / 512.0)
                })
            };
            let (mid_a, mid_b) = (middle(a), middle(b));
            let along = [mid_b[0] - mid_a[0], mid_b[1] - mid_a[1]];
            let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-6);
            let half = |p: &Projected| {
                let [x, y] = [0, 1].map(|axis: usize| (p.edges[axis] - p.edges[axis + 2]) as f32);
                (x * x + y * y).sqrt() * (0.5 / PX as f32)
            };
            let half = [half(a), half(b)];
            let is_wide = half[0].max(half[1]) > 0.5 * WIDE_PX;
            let spine = Spine {
                wide: hair.even.filter(|_| is_wide).map(|even| (half, even)),
                segment: ribbon.segment,
                a: mid_a,
                along: along.map(|x| x / squared),
                coverage: [a.coverage, b.coverage],
                radiance: [&hair.radiance.at[first], &hair.radiance.at[first + 1]],
                narrow: hair.radiance.along_from(first),
            };
            let corners = ribbon.corners.map(|[x, y]| [x + jitter[0], y + jitter[1]]);
            let left_a = (corners[0], a.depth);
            let right_a = (corners[1], a.depth);
            let right_b = (corners[2], b.depth);
            let left_b = (corners[3], b.depth);
            self.triangle([left_a, right_a, left_b], &spine, pass);
            self.triangle([left_b, right_a, right_b], &spine, pass);
        }
    }

    fn triangle(&mut self, mut corners: Triangle, spine: &Spine, pass: u32) {
        let doubled_area = |c: &Triangle| {
            let [a, b, c] = c.map(|(p, _)| p.map(i64::from));
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let mut area = doubled_area(&corners);
        if area == 0 {
            return;
        }
        // Clockwise on the screen (y downwards), so that inside is where all edges are positive.
        if area < 0 {
            corners.swap(1, 2);
            area = -area;
        }
        let [p0, p1, p2] = corners.map(|(p, _)| p);
        let [z0, z1, z2] = corners.map(|(_, z)| z);
        let edges = [Edge::new(p1, p2), Edge::new(p2, p0), Edge::new(p0, p1)];
        let per_area = 1.0 / area as f32;
        let Rect { origin, size } = self.rect;
        let bound = |axis: usize| {
            let low = p0[axis].min(p1[axis]).min(p2[axis]).div_euclid(PX);
            let high = p0[axis].max(p1[axis]).max(p2[axis]).div_euclid(PX);
            low.max(origin[axis])..=high.min(origin[axis] + size[axis] - 1)
        };
        for y in bound(1) {
            let row = row_span(&[p0, p1, p2], y, bound(0));
            self.visited += (1 + i64::from(*row.end()) - i64::from(*row.start())).max(0) as u64;
            for x in row {
                // Values of the edge functions at the pixel's corner; samples add a constant.
                let at = edges.map(|edge| edge.at([x * PX, y * PX]));
                let mut inside = 0_u32;
                for sample in 0..4 {
                    // One sign for all three: no branches, several samples at a time.
                    let [a, b, c] = [0, 1, 2].map(|e: usize| at[e] + edges[e].offset[sample]);
                    inside |= u32::from((a | b | c) >= 0) << sample;
                }
                if inside == 0 {
                    continue;
                }
                let z = |sample: usize| {
                    let w1 = (at[1] + edges[1].offset[sample] + edges[1].bias) as f32 * per_area;
                    let w2 = (at[2] + edges[2].offset[sample] + edges[2].bias) as f32 * per_area;
                    z0 + w1 * (z1 - z0) + w2 * (z2 - z0)
                };
                self.fragment([x, y], inside, z, spine, pass);
            }
        }
    }

    fn fragment(
        &mut self,
        [x, y]: [i32; 2],
        inside: u32,
        z: impl Fn(usize) -> f32,
        spine: &Spine,
        pass: u32,
    ) {
        let Rect { origin, size } = self.rect;
        let index = ((y - origin[1]) * size[0] + x - origin[0]) as usize;
        let mut visible = 0_u32;
        let mut depths = [0.0; 4];
        for (sample, depth) in depths.iter_mut().enumerate() {
            if inside >> sample & 1 == 1 {
                *depth = z(sample);
                let before = self.depth[index][sample];
                let is_nearer = *depth < before
                    || *depth == before && spine.segment < self.owner[index][sample];
                visible |= u32::from(is_nearer) << sample;
            }
        }
        if visible == 0 {
            return;
        }
        // How far along the segment the middle of this pixel is.
        let to = [x as f32 + 0.5 - spine.a[0], y as f32 + 0.5 - spine.a[1]];
        let along = spine.along;
        let t = (to[0] * along[0] + to[1] * along[1]).clamp(0.0, 1.0);
        let alpha = mix(spine.coverage[0], spine.coverage[1], t);
        let mut mask = visible;
        if alpha < 1.0 {
            let key = coverage_key(spine.segment, x as u32, y as u32);
            mask &= coverage_mask(alpha, pass, key);
        }
        let [a, b] = spine.radiance;
        let mut color = [
            mix(a[0], b[0], t),
            mix(a[1], b[1], t),
            mix(a[2], b[2], t),
            1.0,
        ];
        if let Some([first, second]) = spine.narrow {
            let light = along_segment(first, second, t);
            for (value, light) in color.iter_mut().zip(light) {
                *value += light;
            }
        }
        if let Some((half, even)) = &spine.wide {
            let [x, y] = along;
            let off = (x * to[1] - y * to[0]) / (x * x + y * y).sqrt();
            let at = (off / mix(half[0], half[1], t)).clamp(-1.0, 1.0);
            let [red, green, blue, _] = color;
            let factors =
                profile_factors([red, green, blue], mix(a[3], b[3], t), even, [at, at * at]);
            for (value, factor) in color.iter_mut().zip(factors) {
                *value *= factor;
            }
        }
        for (sample, depth) in depths.into_iter().enumerate() {
            if mask >> sample & 1 == 1 {
                self.depth[index][sample] = depth;
                self.owner[index][sample] = spine.segment;
                self.color[index][sample] = color;
            }
        }
    }
}

/// An edge function in exact integers, with the top-left rule folded in.
#[derive(Clone, Copy)]
struct Edge {
    from: [i32; 2],
    delta: [i64; 2],
    /// Added to the value at a pixel's upper left corner by each sample, less `bias`.
    offset: [i64; 4],
    /// 1 where a sample on the edge belongs to the neighbour.
    bias: i64,
}

impl Edge {
    fn new(from: [i32; 2], to: [i32; 2]) -> Self {
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

    fn at(&self, [x, y]: [i32; 2]) -> i64 {
        self.delta[0] * i64::from(y - self.from[1]) - self.delta[1] * i64::from(x - self.from[0])
    }
}

/// Pixels of row `y` that the triangle may touch, within `bound`.
fn row_span(
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

#[cfg(test)]
mod tests;
