//! One map at work: points are projected, strands drawn, and what is lit looked up.

use std::ops::Range;

use glam::Vec3;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{LANES, Level, Simd, dispatch, f32x8, i32x8};
use strandlight_scene::beside::{self, Beside, HeightMaps, Towards};
use strandlight_scene::shadow_maps::{N_PLACES, ShadowView};

use super::super::shadow_map::{CLEAR_RADII, HEIGHT_UNITS, NAME_BITS, OWN_POINTS, name_of};
use super::strips::{Seen, Strip, Strips};

/// Side of the blocks of a map that are known to be looked up or not, texels.
const BLOCK: i32 = 8;

/// A map at work.
#[derive(Default)]
pub(super) struct Work {
    /// [`StripOrder::points`](super::strips::StripOrder::points) on the map: x and y in texels from the corner, z the height in cm.
    at: [Vec<f32>; 3],
    wanted: Wanted,
    map: Map,
    /// By visible point: which of the places along the strand about it are lit.
    pub lit: Vec<u8>,
    /// Of what stands beside the hair, while points are looked up.
    heights: Option<HeightMaps>,
    /// Texels of strands that were drawn.
    pub n_texels: u64,
}

impl Work {
    pub fn project(&mut self, view: &ShadowView, strips: &Strips) {
        dispatch!(Level::new(), simd => project(simd, view, strips, &mut self.at));
    }

    pub fn prepare(&mut self, view: &ShadowView, strips: &Strips) {
        self.n_texels = 0;
        dispatch!(Level::new(), simd => self.wanted.find(simd, view, strips, &self.at));
        self.map.clear(view.side);
    }

    pub fn cast(&mut self, view: &ShadowView, strips: &Strips, range: Range<usize>) {
        let strips = (&strips.order.strips[range], &strips.order.points[3][..]);
        dispatch!(Level::new(), simd => {
            self.n_texels += cast(simd, view, strips, self);
        });
    }

    pub fn receive(
        &mut self,
        view: &ShadowView,
        strips: &Strips,
        range: Range<usize>,
        (beside, places): (&Beside, &beside::Places),
    ) {
        if range.start == 0 {
            self.lit.clear();
            self.lit.resize(strips.n_places, u8::MAX);
            self.heights = None;
        }
        let range = || range.clone();
        dispatch!(Level::new(), simd => receive(simd, view, strips, range(), self));
        if !beside.is_empty() {
            let d = Vec3::from(view.towards);
            let towards = match self.heights.take() {
                Some(heights) => beside.towards_by(d, heights),
                None => beside.towards(d),
            };
            let lit = &mut self.lit;
            dispatch!(Level::new(), simd => block(simd, strips, range(), (&towards, places), lit));
            self.heights = (range().end < strips.seen.len()).then(|| towards.maps().clone());
        }
    }
}

/// [`super::super::shadow_map::map_position`] of all points.
#[inline(always)]
fn project<S: Simd>(simd: S, view: &ShadowView, strips: &Strips, at: &mut [Vec<f32>; 3]) {
    simd.vectorize(
        #[inline(always)]
        || {
            let [x, y, z, _] = &strips.order.points;
            for at in at.iter_mut() {
                at.resize(x.len(), 0.0);
            }
            let [at_x, at_y, at_z] = at;
            let middle = 0.5 * view.side as f32;
            let scale = view.texels_per_cm;
            for first in (0..x.len() - x.len() % LANES).step_by(LANES) {
                let range = first..first + LANES;
                let x = f32x8::from_slice(simd, &x[range.clone()]) - view.centre[0];
                let y = f32x8::from_slice(simd, &y[range.clone()]) - view.centre[1];
                let z = f32x8::from_slice(simd, &z[range.clone()]) - view.centre[2];
                let along = [view.right, view.up, view.towards];
                let right = (x * along[0][0] + y * along[0][1] + z * along[0][2]) * scale + middle;
                let up = (x * along[1][0] + y * along[1][1] + z * along[1][2]) * scale + middle;
                let height = x * along[2][0] + y * along[2][1] + z * along[2][2];
                right.store_slice(&mut at_x[range.clone()]);
                up.store_slice(&mut at_y[range.clone()]);
                height.store_slice(&mut at_z[range]);
            }
        },
    );
}

/// A shadow map: by texel, the height of the highest strand above its name.
#[derive(Default)]
struct Map {
    /// Blocks of four by four texels along a side.
    blocks: i32,
    texels: Vec<u32>,
}

impl Map {
    fn clear(&mut self, side: u32) {
        let blocks = side.div_ceil(4);
        self.blocks = blocks as i32;
        let n = self.n_texels() as usize + LANES;
        if self.texels.len() == n {
            self.texels.fill(0);
        } else {
            // Pages of a fine map that nothing is drawn on are never touched.
            self.texels = vec![0; n];
        }
    }

    /// After them come eight that are not on the map.
    fn n_texels(&self) -> i32 {
        16 * self.blocks * self.blocks
    }

    /// Of eight texels of the map. A block is a line of the cache.
    #[inline(always)]
    fn indices<S: Simd>(&self, x: i32x8<S>, y: i32x8<S>) -> i32x8<S> {
        (((x >> 2) + (y >> 2) * self.blocks) << 4) | ((y & 3) << 2) | (x & 3)
    }

    /// Raises eight texels that are below `values`. Without a branch for those that are not to be: a
    /// wrong guess of the processor costs more than a texel.
    #[inline(always)]
    fn raise<S: Simd>(&mut self, indices: i32x8<S>, values: i32x8<S>) {
        let (indices, values) = (<[i32; LANES]>::from(indices), <[i32; LANES]>::from(values));
        for (index, value) in indices.into_iter().zip(values) {
            let texel = &mut self.texels[index as usize];
            *texel = (*texel).max(value as u32);
        }
    }
}

/// Which heights of a map are looked up.
#[derive(Default)]
struct Wanted {
    /// Blocks along a side.
    side: i32,
    /// Lowest height that is looked up, by block; infinite where none is. What lies below changes
    /// nothing.
    lowest: Vec<f32>,
}

impl Wanted {
    #[inline(always)]
    fn find<S: Simd>(&mut self, simd: S, view: &ShadowView, strips: &Strips, at: &[Vec<f32>; 3]) {
        self.side = (view.side as i32 + BLOCK - 1) / BLOCK;
        self.lowest.clear();
        self.lowest
            .resize((self.side * self.side) as usize, f32::INFINITY);
        simd.vectorize(
            #[inline(always)]
            || {
                for seen in &strips.seen {
                    let about = Neighbours::new(seen, at);
                    // The outermost places are nearer than half way to the next points.
                    let a = about.middle + 0.5 * (about.from_before - about.middle);
                    let b = about.middle + 0.5 * (about.to_after - about.middle);
                    let low = a.min(b).min(about.middle);
                    let high = a.max(b).max(about.middle);
                    for y in self.block(low.y)..=self.block(high.y) {
                        for x in self.block(low.x)..=self.block(high.x) {
                            let lowest = &mut self.lowest[(x + self.side * y) as usize];
                            *lowest = lowest.min(low.z);
                        }
                    }
                }
            },
        );
    }

    /// The block of a row or column, within the map.
    #[inline(always)]
    fn block(&self, texel: f32) -> i32 {
        ((texel * (1.0 / BLOCK as f32)) as i32)
            .max(0)
            .min(self.side - 1)
    }

    /// Does something up to `height` in these blocks change what is looked up?
    #[inline(always)]
    fn is_above(&self, [left, top, right, bottom]: [i32; 4], height: f32) -> bool {
        for y in top..=bottom {
            for x in left..=right {
                if height > self.lowest[(x + self.side * y) as usize] {
                    return true;
                }
            }
        }
        false
    }
}

/// Segments on the map, from their first to their last column; columns are rows where they are steep.
struct Segments {
    /// Where each begins, along and across the columns, texels.
    along: [f32; LANES],
    across: [f32; LANES],
    /// How much it rises with each column across and in height.
    rise: [f32; LANES],
    climb: [f32; LANES],
    /// Height where it begins, and the highest, cm.
    height: [f32; LANES],
    highest: [f32; LANES],
    half_width: [f32; LANES],
    first: [i32; LANES],
    last: [i32; LANES],
    /// A bit each.
    is_steep: u32,
    /// Blocks that it may touch: left, top, right, bottom.
    blocks: [[i32; LANES]; 4],
}

/// Draws the segments that are above something that is looked up; what each texel holds does not
/// depend on their order.
#[inline(always)]
fn cast<S: Simd>(
    simd: S,
    view: &ShadowView,
    (strips, radii): (&[Strip], &[f32]),
    work: &mut Work,
) -> u64 {
    simd.vectorize(
        #[inline(always)]
        || {
            let Work {
                at, wanted, map, ..
            } = work;
            let mut n_texels = 0;
            let mut batch = Batch::default();
            for strip in strips {
                for segment in (0..strip.n_segments).step_by(LANES) {
                    let from = (strip.at + segment) as usize;
                    let segments = segments(simd, view, wanted.side, from, at, radii);
                    let n = (strip.n_segments - segment).min(LANES as u32) as usize;
                    for lane in 0..n {
                        let [left, top, right, bottom] = &segments.blocks;
                        let blocks = [left[lane], top[lane], right[lane], bottom[lane]];
                        if wanted.is_above(blocks, segments.highest[lane]) {
                            let name = name_of(strip.first + segment + lane as u32);
                            batch.push(&segments, lane, name);
                            if batch.n == LANES {
                                n_texels += batch.draw(simd, view, map);
                            }
                        }
                    }
                }
            }
            n_texels + batch.draw(simd, view, map)
        },
    )
}

/// Segments that are drawn at once, a lane each: those of hair are about as long.
#[derive(Default)]
struct Batch {
    n: usize,
    /// As in [`Segments`].
    along: [f32; LANES],
    across: [f32; LANES],
    rise: [f32; LANES],
    climb: [f32; LANES],
    height: [f32; LANES],
    half_width: [f32; LANES],
    first: [i32; LANES],
    last: [i32; LANES],
    /// -1 or 0.
    is_steep: [i32; LANES],
    name: [i32; LANES],
}

impl Batch {
    #[inline(always)]
    fn push(&mut self, segments: &Segments, lane: usize, name: u32) {
        let to = self.n;
        self.along[to] = segments.along[lane];
        self.across[to] = segments.across[lane];
        self.rise[to] = segments.rise[lane];
        self.climb[to] = segments.climb[lane];
        self.height[to] = segments.height[lane];
        self.half_width[to] = segments.half_width[lane];
        self.first[to] = segments.first[lane];
        self.last[to] = segments.last[lane];
        self.is_steep[to] = -((segments.is_steep >> lane & 1) as i32);
        self.name[to] = name as i32;
        self.n += 1;
    }

    /// Draws them, a column of each at a time, and empties the batch; answers how many texels they cover.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, view: &ShadowView, map: &mut Map) -> u64 {
        for lane in self.n..LANES {
            self.last[lane] = self.first[lane];
        }
        self.n = 0;
        let columns = self.first.iter().zip(&self.last);
        let n_columns = columns.map(|(first, last)| last - first).max().unwrap_or(0);
        let floats = |numbers: [f32; LANES]| f32x8::simd_from(simd, numbers);
        let (start, across) = (floats(self.along), floats(self.across));
        let (rise, climb) = (floats(self.rise), floats(self.climb));
        let (height, half_width) = (floats(self.height), floats(self.half_width));
        let last = i32x8::simd_from(simd, self.last);
        let is_steep = i32x8::simd_from(simd, self.is_steep).simd_lt(0);
        let name = i32x8::simd_from(simd, self.name);
        let unused = i32x8::simd_from(simd, [0, 1, 2, 3, 4, 5, 6, 7]) + map.n_texels();
        let side = view.side as i32;
        let mut n_texels = 0;
        let first = i32x8::simd_from(simd, self.first);
        for step in 0..n_columns {
            let column = first + step;
            // As `shadow_map::cast_shadows`.
            let along = column.to_float::<f32x8<S>>() + 0.5 - start;
            let y = along * rise + across;
            let mut row = rows_from(y - half_width, side);
            let top = rows_from(y + half_width, side);
            let is_column = column.simd_lt(last);
            let mut covered = row.simd_lt(top) & is_column;
            if covered.any_true() {
                let height = (along * climb + height) * 0.5 / view.reach;
                let height = (height + 0.5).max(0.0).min(1.0) * HEIGHT_UNITS;
                let values = height.to_int::<i32x8<S>>() << NAME_BITS | name;
                // Thin strands cover a row of a column or none.
                while covered.any_true() {
                    let (x, y) = (is_steep.select(row, column), is_steep.select(column, row));
                    map.raise(covered.select(map.indices(x, y), unused), values);
                    n_texels += u64::from(covered.to_bitmask().count_ones());
                    row += 1;
                    covered = row.simd_lt(top) & is_column;
                }
            }
        }
        n_texels
    }
}

/// The segments from eight points in a row to the next each.
#[inline(always)]
fn segments<S: Simd>(
    simd: S,
    view: &ShadowView,
    blocks: i32,
    from: usize,
    at: &[Vec<f32>; 3],
    radius: &[f32],
) -> Segments {
    let of = |numbers: &[f32]| {
        let pair = &numbers[from..from + LANES + 1];
        let a: &[f32; LANES] = pair[..LANES].as_array().expect("as long as it says");
        let b: &[f32; LANES] = pair[1..].as_array().expect("as long as it says");
        (*a, *b)
    };
    let ((ax, bx), (ay, by), (az, bz), (ar, br)) = (of(&at[0]), of(&at[1]), of(&at[2]), of(radius));
    let (ax, bx) = (f32x8::simd_from(simd, ax), f32x8::simd_from(simd, bx));
    let (ay, by) = (f32x8::simd_from(simd, ay), f32x8::simd_from(simd, by));
    let (az, bz) = (f32x8::simd_from(simd, az), f32x8::simd_from(simd, bz));
    let (ar, br) = (f32x8::simd_from(simd, ar), f32x8::simd_from(simd, br));
    let is_steep = (by - ay).abs().simd_gt((bx - ax).abs());
    let (along_a, along_b) = (is_steep.select(ay, ax), is_steep.select(by, bx));
    let (across_a, across_b) = (is_steep.select(ax, ay), is_steep.select(bx, by));
    let is_back = along_a.simd_gt(along_b);
    let (along, end) = (along_a.min(along_b), along_a.max(along_b));
    let across = is_back.select(across_b, across_a);
    let height = is_back.select(bz, az);
    let run = end - along;
    let is_there = run.simd_ge(1e-6);
    let inverse = f32x8::splat(simd, 1.0) / run.max(1e-6);
    let rise = (is_back.select(across_a, across_b) - across) * inverse;
    let climb = (is_back.select(az, bz) - height) * inverse;
    let radius = (ar + br) * (0.5 * view.texels_per_cm);
    let side = view.side as i32;
    let first = rows_from(along, side);
    let last = rows_from(end, side);
    let last = is_there.select(last, first);
    // Ribbons are wider along rows and columns than across, by sqrt(2) at most.
    let reach = radius * 1.5 + 1.0;
    Segments {
        along: along.into(),
        across: across.into(),
        rise: rise.into(),
        climb: climb.into(),
        height: height.into(),
        // A place is dark only if something is above it by part of a radius.
        highest: az.max(bz).into(),
        half_width: (radius * (rise * rise + 1.0).sqrt()).into(),
        first: first.into(),
        last: last.into(),
        is_steep: is_steep.to_bitmask() as u32,
        blocks: [
            blocks_of(ax.min(bx) - reach, blocks),
            blocks_of(ay.min(by) - reach, blocks),
            blocks_of(ax.max(bx) + reach, blocks),
            blocks_of(ay.max(by) + reach, blocks),
        ],
    }
}

/// The blocks of eight rows or columns; there are so many along a side.
#[inline(always)]
fn blocks_of<S: Simd>(texel: f32x8<S>, blocks: i32) -> [i32; LANES] {
    let block = (texel * (1.0 / BLOCK as f32)).max(0.0);
    block.min((blocks - 1) as f32).to_int::<i32x8<S>>().into()
}

/// First rows whose centres are not before `y`, texels.
#[inline(always)]
fn rows_from<S: Simd>(y: f32x8<S>, side: i32) -> i32x8<S> {
    let rows = (y - 0.5).ceil().max(0.0).min(side as f32);
    rows.to_int()
}

/// Finds the lit ones of [`N_PLACES`] places along the strand about each visible point.
#[inline(always)]
fn receive<S: Simd>(
    simd: S,
    view: &ShadowView,
    strips: &Strips,
    range: Range<usize>,
    work: &mut Work,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for seen in &strips.seen[range] {
                let radius = strips.order.points[3][seen.at as usize];
                work.lit[seen.place as usize] =
                    receive_point(simd, view, seen, radius, &work.at, &work.map);
            }
        },
    );
}

/// Darkens the points that something stands before.
#[inline(always)]
fn block<S: Simd>(
    simd: S,
    strips: &Strips,
    range: Range<usize>,
    (towards, places): (&Towards, &beside::Places),
    lit: &mut [u8],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut at = [(0, 0); LANES];
            let mut n = 0;
            for ix in range.clone() {
                let seen = &strips.seen[ix];
                // Dearer than what hair says, so only where that leaves something.
                if lit[seen.place as usize] != 0 {
                    at[n] = (ix, seen.place);
                    n += 1;
                }
                if n == LANES || ix + 1 == range.end {
                    let mut indices = [0; LANES];
                    for lane in 0..n {
                        indices[lane] = at[lane].0;
                    }
                    let position = |lane: usize| strips.position(&strips.seen[indices[lane]]);
                    let blocked = towards.are_blocked(simd, places, indices, position);
                    for (lane, (_, place)) in at[..n].iter().enumerate() {
                        if blocked >> lane & 1 == 1 {
                            lit[*place as usize] = 0;
                        }
                    }
                    n = 0;
                }
            }
        },
    );
}

/// A point and its neighbours on a map.
struct Neighbours {
    middle: Vec3,
    from_before: Vec3,
    to_after: Vec3,
}

impl Neighbours {
    #[inline(always)]
    fn new(seen: &Seen, [x, y, z]: &[Vec<f32>; 3]) -> Neighbours {
        let of = |at: usize| Vec3::new(x[at], y[at], z[at]);
        let at = seen.at as usize;
        Neighbours {
            middle: of(at),
            from_before: of(at - usize::from(seen.before > 0.0)),
            to_after: of(at + usize::from(seen.after > 0.0)),
        }
    }
}

#[inline(always)]
fn receive_point<S: Simd>(
    simd: S,
    view: &ShadowView,
    seen: &Seen,
    radius: f32,
    at: &[Vec<f32>; 3],
    map: &Map,
) -> u8 {
    let Seen { before, after, .. } = *seen;
    let Neighbours {
        middle,
        from_before,
        to_after,
    } = Neighbours::new(seen, at);
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
    let z = z + CLEAR_RADII * radius;
    let last = view.side as f32 - 1.0;
    let x = x.max(0.0).min(last).to_int::<i32x8<S>>();
    let y = y.max(0.0).min(last).to_int::<i32x8<S>>();
    let index: [i32; 8] = map.indices(x, y).into();
    let height =
        ((z * (0.5 / view.reach) + 0.5).max(0.0).min(1.0) * HEIGHT_UNITS).to_int::<i32x8<S>>();
    let mut highest = [0; 8];
    for (highest, index) in highest.iter_mut().zip(index) {
        *highest = map.texels[index as usize] as i32;
    }
    let highest = i32x8::simd_from(simd, highest);
    // Heights have 20 bits, so shifting the sign in leaves them after the mask.
    let above = (highest >> NAME_BITS) & ((1 << (32 - NAME_BITS)) - 1);
    let apart = (highest - seen.point as i32 + OWN_POINTS as i32) & ((1 << NAME_BITS) - 1);
    let is_lit = above.simd_le(height) | apart.simd_le(2 * OWN_POINTS as i32);
    is_lit.to_bitmask() as u8
}
