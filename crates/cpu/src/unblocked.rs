//! Shares of the lights that reach visible points straight, from shadow maps.
//!
//! The maps are those of [`super::shadow_map`]; but each is one thread's own, every point is projected once, and only what is seen is looked up. What is above nothing
//! that is looked up is not drawn. Strands side by side are drawn one after the other and texels
//! side by side lie together, so that most of the memory that is touched is in a cache.

use std::ops::Range;

use glam::{Vec3, Vec3Swizzles};
use rayon::prelude::*;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{Level, Simd, dispatch, f32x8, i32x8};
use strandlight_scene::proxy::{ProxyRecord, is_blocked};
use strandlight_scene::shadow_maps::ShadowView;
use strandlight_scene::strands::Strands;

use super::shadow_map::{
    CLEAR_RADII, HEIGHT_UNITS, N_PLACES, NAME_BITS, OWN_POINTS, map_position, name_of,
};

/// Maps at work at a time have at most this many bytes, or there is one.
const MAX_MAP_BYTES: usize = 256 << 20;

/// Maps whose answers are held at a time.
const GROUP: usize = 64;

/// Side of the blocks of a map that are known to be looked up or not, texels.
const BLOCK: i32 = 16;

/// What 1 is in a share.
const ONE: f32 = 65_535.0;

/// Unblocked shares of lights at visible points, or at all points.
#[derive(Clone, Debug, Default)]
pub(super) struct Unblocked {
    /// `[slot][point]`, unorm16.
    shares: Vec<Vec<u16>>,
    is_everywhere: bool,
    /// Texels of strands drawn into all maps.
    pub n_texels: u64,
}

/// A visible point.
#[derive(Clone, Copy, Debug)]
pub(super) struct VisiblePoint {
    /// Its place among the visible points.
    pub place: usize,
    /// Its index in [`Strands::points`].
    pub point: usize,
}

impl Unblocked {
    /// None yet of `n_slots` lights, at visible points.
    pub fn new(n_slots: u32) -> Unblocked {
        Unblocked {
            shares: vec![Vec::new(); n_slots as usize],
            ..Unblocked::default()
        }
    }

    /// The same for all points, so that they serve any view.
    pub fn everywhere(n_slots: u32) -> Unblocked {
        Unblocked {
            is_everywhere: true,
            ..Unblocked::new(n_slots)
        }
    }

    /// Do they serve any view?
    pub fn is_everywhere(&self) -> bool {
        self.is_everywhere
    }

    /// Bytes of the shares of `n_slots` lights at `n_points` points.
    pub fn bytes_of(n_slots: u32, n_points: usize) -> usize {
        n_slots as usize * n_points * size_of::<u16>()
    }

    /// Draws the maps of `views`, those of a slot one after the other, and looks them up at
    /// `visible` points, or at all.
    pub fn draw(
        &mut self,
        strands: &Strands,
        views: &[ShadowView],
        proxies: &[ProxyRecord],
        visible: &[u32],
    ) {
        let all: Vec<u32>;
        let mut visible = visible;
        if self.is_everywhere {
            all = (0..strands.points.len() as u32).collect();
            visible = &all;
        }
        let mut sums: Vec<Vec<f32>> = vec![Vec::new(); self.shares.len()];
        let order = Order::new(strands, visible);
        for group in views.chunks(GROUP) {
            let largest = group.iter().map(|view| view.side as usize).max();
            let bytes = 4 * largest.unwrap_or(1).pow(2);
            let at_a_time = (MAX_MAP_BYTES / bytes).max(1);
            let lit = |view: &ShadowView| lit_places(view, strands, proxies, visible, &order);
            for views in group.chunks(at_a_time) {
                let found: Vec<(Vec<u8>, u64)> = views.par_iter().map(lit).collect();
                for (view, (lit, n_texels)) in views.iter().zip(found) {
                    self.n_texels += n_texels;
                    let sums = &mut sums[view.shadow_index as usize];
                    sums.resize(visible.len(), 0.0);
                    let weight = view.weight / N_PLACES as f32;
                    for (sum, lit) in sums.iter_mut().zip(lit) {
                        *sum += weight * f32::from(lit);
                    }
                }
            }
        }
        for (shares, sums) in self.shares.iter_mut().zip(sums) {
            if !sums.is_empty() {
                let pack = |sum: f32| (sum.min(1.0) * ONE + 0.5) as u16;
                *shares = sums.into_iter().map(pack).collect();
            }
        }
    }

    /// Has no light a map?
    pub fn is_empty(&self) -> bool {
        self.shares.is_empty()
    }

    /// The share of a slot at a visible point, 0..=1.
    pub fn share(&self, slot: u32, at: VisiblePoint) -> f32 {
        let ix = if self.is_everywhere {
            at.point
        } else {
            at.place
        };
        f32::from(self.shares[slot as usize][ix]) * (1.0 / ONE)
    }

    /// Bytes of the shares.
    pub fn bytes(&self) -> u64 {
        let bytes = |shares: &Vec<u16>| size_of_val(&shares[..]) as u64;
        self.shares.iter().map(bytes).sum()
    }
}

/// How many of the places about each visible point a map says are lit, and the map's texels drawn.
fn lit_places(
    view: &ShadowView,
    strands: &Strands,
    proxies: &[ProxyRecord],
    visible: &[u32],
    order: &Order,
) -> (Vec<u8>, u64) {
    let mut map = Map::new(view.side);
    let mut lit = vec![0; visible.len()];
    let mut n_texels = 0;
    dispatch!(Level::new(), simd => {
        let wanted = Wanted::new(simd, view, strands, visible);
        n_texels = cast(simd, view, strands, &wanted, order, &mut map);
        receive(simd, view, strands, visible, order, &map, &mut lit);
    });
    if !proxies.is_empty() {
        for (lit, &point) in lit.iter_mut().zip(visible) {
            let position = Vec3::from_slice(&strands.points[point as usize]);
            if is_blocked(proxies, position, Vec3::from(view.towards)) {
                *lit = 0;
            }
        }
    }
    (lit, n_texels)
}

/// Strands in an order in which one follows another that is near.
struct Order {
    /// Ranges of [`Strands::segments`], a strand each.
    segments: Vec<Range<u32>>,
    /// The visible points of each.
    visible: Vec<Range<u32>>,
}

impl Order {
    fn new(strands: &Strands, visible: &[u32]) -> Order {
        let segments = &strands.segments;
        let mut found: Vec<(u32, Range<u32>)> = Vec::with_capacity(strands.n_strands);
        let (low, high) = strands.bounds;
        let scale = 1023.0 / (high - low).max_element().max(1e-6);
        let mut start = 0;
        for end in 1..=segments.len() {
            if end < segments.len() && segments[end] == segments[end - 1] + 1 {
                continue;
            }
            let middle = segments[(start + end) / 2] as usize;
            let at = (Vec3::from_slice(&strands.points[middle]) - low) * scale;
            found.push((morton(at.as_uvec3().to_array()), start as u32..end as u32));
            start = end;
        }
        found.sort_by_key(|(key, range)| (*key, range.start));
        let segments_of: Vec<Range<u32>> = found.into_iter().map(|(_, range)| range).collect();
        let visible_of = |range: &Range<u32>| {
            let [first, last] = [range.start, range.end - 1].map(|ix| segments[ix as usize]);
            let place = |point: u32| visible.partition_point(|&other| other < point) as u32;
            place(first)..place(last + 2)
        };
        Order {
            visible: segments_of.iter().map(visible_of).collect(),
            segments: segments_of,
        }
    }
}

/// The lowest ten bits of three numbers, interleaved.
fn morton(at: [u32; 3]) -> u32 {
    let spread = |n: u32| (0..10).fold(0, |sum, bit| sum | (n.min(1023) >> bit & 1) << (3 * bit));
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}

/// A shadow map: by texel, the height of the highest strand above its name.
struct Map {
    /// Blocks of four by four texels along a side.
    blocks: i32,
    texels: Vec<u32>,
}

impl Map {
    fn new(side: u32) -> Map {
        let blocks = side.div_ceil(4);
        Map {
            blocks: blocks as i32,
            texels: vec![0; (16 * blocks * blocks) as usize],
        }
    }

    /// A block is a line of the cache.
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> usize {
        (((x >> 2) + self.blocks * (y >> 2)) << 4 | (y & 3) << 2 | x & 3) as usize
    }
}

/// Which heights of a map are looked up.
struct Wanted {
    /// Blocks along a side.
    side: i32,
    /// Lowest height that is looked up, by block; infinite where none is. What lies below changes
    /// nothing.
    lowest: Vec<f32>,
}

impl Wanted {
    #[inline(always)]
    fn new<S: Simd>(simd: S, view: &ShadowView, strands: &Strands, visible: &[u32]) -> Wanted {
        let side = (view.side as i32 + BLOCK - 1) / BLOCK;
        let mut lowest = vec![f32::INFINITY; (side * side) as usize];
        simd.vectorize(
            #[inline(always)]
            || {
                for &point in visible {
                    let places = Places::new(view, strands, point as usize);
                    // The outermost places are nearer than half way to the next points.
                    let [a, b] = [places.from_before, places.to_after]
                        .map(|end| places.middle + 0.5 * (end - places.middle));
                    let low = a.min(b).min(places.middle);
                    let high = a.max(b).max(places.middle);
                    for_blocks([low.x, low.y], [high.x, high.y], side, |block| {
                        lowest[block] = lowest[block].min(low.z);
                    });
                }
            },
        );
        Wanted { side, lowest }
    }

    /// Does something up to `height` within these corners change what is looked up?
    #[inline(always)]
    fn is_above(&self, low: [f32; 2], high: [f32; 2], height: f32) -> bool {
        let mut is_above = false;
        for_blocks(low, high, self.side, |block| {
            is_above |= height > self.lowest[block]
        });
        is_above
    }
}

/// Calls `at` with the number of each block that these corners, texels, touch.
#[inline(always)]
fn for_blocks(low: [f32; 2], high: [f32; 2], side: i32, mut at: impl FnMut(usize)) {
    let block = |x: f32| ((x * (1.0 / BLOCK as f32)) as i32).clamp(0, side - 1);
    let ([x_0, y_0], [x_1, y_1]) = (low.map(block), high.map(block));
    for y in y_0..=y_1 {
        for x in x_0..=x_1 {
            at((x + side * y) as usize);
        }
    }
}

/// Draws the segments that are above something that is looked up; what each texel holds does not
/// depend on their order.
#[inline(always)]
fn cast<S: Simd>(
    simd: S,
    view: &ShadowView,
    strands: &Strands,
    wanted: &Wanted,
    order: &Order,
    map: &mut Map,
) -> u64 {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut n_texels = 0;
            let mut last = (u32::MAX, Vec3::ZERO);
            let ranges = order.segments.iter();
            for &first in
                ranges.flat_map(|range| &strands.segments[range.start as usize..range.end as usize])
            {
                let [from, to] = [first, first + 1].map(|ix| &strands.points[ix as usize]);
                let start = if last.0 == first {
                    last.1
                } else {
                    map_position(view, from)
                };
                let end = map_position(view, to);
                last = (first + 1, end);
                let radius = 0.5 * (from[3] + to[3]) * view.texels_per_cm;
                // Ribbons are wider along rows and columns than across, by sqrt(2) at most.
                let reach = 1.5 * radius + 1.0;
                let (low, high) = (start.min(end), start.max(end));
                let low = [low.x - reach, low.y - reach];
                // A place is dark only if something is above it by part of a radius.
                if !wanted.is_above(low, [high.x + reach, high.y + reach], high.z) {
                    continue;
                }
                n_texels += cast_segment(simd, view, [start, end], radius, name_of(first), map);
            }
            n_texels
        },
    )
}

/// First rows whose centres are not before `y`, texels.
#[inline(always)]
fn rows_from<S: Simd>(y: f32x8<S>, side: i32) -> [i32; 8] {
    let rows = (y - 0.5).ceil().max(0.0).min(side as f32);
    rows.to_int::<i32x8<S>>().into()
}

#[inline(always)]
fn cast_segment<S: Simd>(
    simd: S,
    view: &ShadowView,
    [mut a, mut b]: [Vec3; 2],
    radius: f32,
    name: u32,
    map: &mut Map,
) -> u64 {
    let steep = (b.y - a.y).abs() > (b.x - a.x).abs();
    if steep {
        (a, b) = (a.yxz(), b.yxz());
    }
    if a.x > b.x {
        std::mem::swap(&mut a, &mut b);
    }
    let run = b.x - a.x;
    if run < 1e-6 {
        return 0;
    }
    let rise = (b.yz() - a.yz()) / run;
    let half_width = radius * (1.0 + rise.x * rise.x).sqrt();
    let side = view.side as i32;
    let start = ((a.x - 0.5).ceil() as i32).max(0);
    let last = ((b.x - 0.5).ceil() as i32).min(side);
    let lanes = f32x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let mut n_texels = 0;
    let mut column = start;
    while column < last {
        // As `shadow_map::cast_shadows`, for eight columns.
        let along = lanes + column as f32 + 0.5 - a.x;
        let y = along * rise.x + a.y;
        let bottom = rows_from(y - half_width, side);
        let top = rows_from(y + half_width, side);
        let height = (along * rise.y + a.z) * 0.5 / view.reach + 0.5;
        let height = height.max(0.0).min(1.0) * HEIGHT_UNITS;
        let height: [i32; 8] = height.to_int::<i32x8<S>>().into();
        let n = (last - column).min(8) as usize;
        for lane in 0..n {
            let value = (height[lane] as u32) << NAME_BITS | name;
            let at = column + lane as i32;
            for row in bottom[lane]..top[lane] {
                let index = if steep {
                    map.index(row, at)
                } else {
                    map.index(at, row)
                };
                let texel = &mut map.texels[index];
                *texel = (*texel).max(value);
                n_texels += 1;
            }
        }
        column += 8;
    }
    n_texels
}

/// Counts the lit ones of [`N_PLACES`] places along the strand about each visible point.
#[inline(always)]
fn receive<S: Simd>(
    simd: S,
    view: &ShadowView,
    strands: &Strands,
    visible: &[u32],
    order: &Order,
    map: &Map,
    lit: &mut [u8],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for place in order.visible.iter().flat_map(Clone::clone) {
                let (lit, point) = (&mut lit[place as usize], visible[place as usize]);
                *lit = receive_point(simd, view, strands, point as usize, map);
            }
        },
    );
}

/// A point and its neighbours on a map.
struct Places {
    before: f32,
    after: f32,
    middle: Vec3,
    from_before: Vec3,
    to_after: Vec3,
}

impl Places {
    #[inline(always)]
    fn new(view: &ShadowView, strands: &Strands, point_ix: usize) -> Places {
        let (before, after) = (strands.tangents[point_ix][3], strands.normals[point_ix][3]);
        let middle = map_position(view, &strands.points[point_ix]);
        let mut from_before = middle;
        if before > 0.0 {
            from_before = map_position(view, &strands.points[point_ix - 1]);
        }
        let mut to_after = middle;
        if after > 0.0 {
            to_after = map_position(view, &strands.points[point_ix + 1]);
        }
        Places {
            before,
            after,
            middle,
            from_before,
            to_after,
        }
    }
}

#[inline(always)]
fn receive_point<S: Simd>(
    simd: S,
    view: &ShadowView,
    strands: &Strands,
    point_ix: usize,
    map: &Map,
) -> u8 {
    let point = &strands.points[point_ix];
    let Places {
        before,
        after,
        middle,
        from_before,
        to_after,
    } = Places::new(view, strands, point_ix);
    // As `shadow_map::receive_shadows`, for all places.
    let places = f32x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    let place = (places + view.offset) * ((before + after) / N_PLACES as f32) - before;
    let is_before = place.simd_lt(0.0);
    // The way to either neighbour, times its share for a unit of `place`.
    let back = (from_before - middle) * (-0.5 / before.max(1e-20));
    let on = (to_after - middle) * (0.5 / after.max(1e-20));
    let mut at = [place; 3];
    for (axis, at) in at.iter_mut().enumerate() {
        let back = f32x8::splat(simd, back[axis]);
        let on = f32x8::splat(simd, on[axis]);
        *at = is_before.select(back, on) * place + middle[axis];
    }
    let [x, y, z] = at;
    let z = z + CLEAR_RADII * point[3];
    let last = view.side as f32 - 1.0;
    let x = x.max(0.0).min(last).to_int::<i32x8<S>>();
    let y = y.max(0.0).min(last).to_int::<i32x8<S>>();
    let index = (((x >> 2) + (y >> 2) * map.blocks) << 4) | ((y & 3) << 2) | (x & 3);
    let index: [i32; 8] = index.into();
    let height =
        ((z * (0.5 / view.reach) + 0.5).max(0.0).min(1.0) * HEIGHT_UNITS).to_int::<i32x8<S>>();
    let mut highest = [0; 8];
    for (highest, index) in highest.iter_mut().zip(index) {
        *highest = map.texels[index as usize] as i32;
    }
    let highest = i32x8::simd_from(simd, highest);
    // Heights have 20 bits, so shifting the sign in leaves them after the mask.
    let above = (highest >> NAME_BITS) & ((1 << (32 - NAME_BITS)) - 1);
    let apart = (highest - point_ix as i32 + OWN_POINTS as i32) & ((1 << NAME_BITS) - 1);
    let is_lit = above.simd_le(height) | apart.simd_le(2 * OWN_POINTS as i32);
    is_lit.to_bitmask().count_ones() as u8
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use strandlight_formats::SrbfLight;
    use strandlight_scene::shadow_maps::{ShadowPlan, unblocked_share};

    use super::super::shadow_map::draw_maps;
    use super::*;

    /// Strands criss-cross, thick and thin.
    fn strands(n: usize) -> Strands {
        let mut points = Vec::new();
        for ix in 0..n {
            let turn = 2.4 * ix as f32;
            let along = Vec3::new(turn.cos(), turn.sin(), 0.3 * (ix % 3) as f32);
            let middle = Vec3::new((1.7 * turn).sin(), (0.9 * turn).cos(), (1.3 * turn).sin());
            points.extend([-1.0, -0.2, 0.7].map(|t| (middle + along * t).to_array()));
        }
        let offsets: Vec<u32> = (0..=n).map(|ix| 3 * ix as u32).collect();
        Strands::new(
            &points,
            &offsets,
            |strand, _| [0.002, 0.02, 0.2][strand % 3],
            true,
        )
        .expect("valid")
    }

    #[test]
    fn shares_are_those_of_the_maps_at_every_point() {
        let strands = strands(400);
        let lights: Vec<SrbfLight> = (0..6)
            .map(|ix| SrbfLight {
                direction: Vec3::new(ix as f32 - 2.0, 1.0, 0.3).normalize().to_array(),
                lambda: [0.02, 0.3, 0.9][ix % 3],
                rgb: [1.0; 3],
            })
            .collect();
        let plan = ShadowPlan::new(&lights, &strands, 30);
        let mut words = vec![0; plan.n_words(strands.points.len())];
        let n_texels = draw_maps(&strands, &plan.views, &[], &mut words);
        let visible: Vec<u32> = (0..strands.points.len() as u32).step_by(3).collect();
        let mut unblocked = Unblocked::new(plan.n_slots);
        unblocked.draw(&strands, &plan.views, &[], &visible);
        let mut everywhere = Unblocked::everywhere(plan.n_slots);
        everywhere.draw(&strands, &plan.views, &[], &[]);
        assert!(unblocked.n_texels < n_texels);
        let mut darkest = 1.0_f32;
        for slot in 1..plan.n_slots {
            for (place, &point) in visible.iter().enumerate() {
                let at = VisiblePoint {
                    place,
                    point: point as usize,
                };
                let share = unblocked.share(slot, at);
                assert_eq!(everywhere.share(slot, at), share);
                let exact = unblocked_share(&words, strands.points.len(), slot, point as usize);
                // Both are rounded, the other to eight bits.
                assert!(
                    (share - exact).abs() < 0.6 / 255.0,
                    "{slot} {point}: {share} {exact}"
                );
                darkest = darkest.min(share);
            }
        }
        assert!(darkest < 0.1);
    }
}
