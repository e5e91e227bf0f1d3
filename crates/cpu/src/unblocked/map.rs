//! One map at work: points are projected, strands drawn, and what is lit looked up.

use std::ops::Range;

use glam::Vec3;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{LANES, Level, Simd, dispatch, f32x8, i32x8, mask32x8};
use strandlight_scene::beside::{self, Beside, HeightMaps, Towards};
use strandlight_scene::progress::Deadline;
use strandlight_scene::shadow_maps::{N_PLACES, SHADOW_SIDE, ShadowView};

use super::super::shadow_map::{CLEAR_RADII, HEIGHT_UNITS, NAME_BITS, OWN_POINTS};
use super::strips::{Run, Seen, StripOrder, Strips, some_runs, some_seen};

/// Blocks along a side of a map, each known to be looked up or not.
const BLOCKS: usize = 32;

/// Parts of maps that a thread does at most in a step: without it small scenes would have all of their maps in one step, and tests of
/// what comes between steps none to look at.
const PARTS_AT_ONCE: usize = 6;

/// How much lower and higher than its points a box may reach, of the height of the map: more than is lost in rounding.
const SLACK: f32 = 1e-5;

/// A map at work, or what the next one is made in.
#[derive(Default)]
pub(super) struct Work {
    /// Which view it is of, while it is at work, and how far.
    pub view: Option<u32>,
    part: Part,
    /// [`StripOrder::points`](super::strips::StripOrder::points) on the map: x and y in texels from the corner, z the height in cm.
    at: [Vec<f32>; 3],
    /// Runs that are drawn, in this order.
    drawn: Vec<u32>,
    map: Map,
    /// By visible point: which of the places along the strand about it are lit.
    lit: Vec<u8>,
    /// Of what stands beside the hair, while points are looked up.
    heights: Option<HeightMaps>,
    /// Texels of strands that were drawn.
    n_texels: u64,
}

/// A part of the work on a map.
#[derive(Clone, Copy, Debug, Default)]
enum Part {
    /// Projects the points of the strands, plans which runs are drawn, and clears the map.
    #[default]
    Prepare,
    /// Draws runs; the next one of [`Work::drawn`].
    Cast(usize),
    /// Looks up the visible points; the next one of [`Strips::seen`].
    Receive(usize),
}

/// What a map answers.
pub(super) struct Found {
    pub view: u32,
    /// By visible point: which of the places along the strand about it are lit.
    pub lit: Vec<u8>,
    /// Texels of strands that were drawn.
    pub n_texels: u64,
}

impl Work {
    /// Does some more parts of its map, and of those that it can `take`, one at least and no more after a deadline; answers what those
    /// say that are done.
    pub fn step(
        &mut self,
        views: &[ShadowView],
        strips: &Strips,
        stands: (&Beside, &beside::Places),
        (take, deadline): (impl Fn() -> Option<u32>, Deadline),
    ) -> Vec<Found> {
        let mut found = Vec::new();
        for _ in 0..PARTS_AT_ONCE {
            self.view = self.view.or_else(&take);
            let Some(ix) = self.view else {
                return found;
            };
            let view = &views[ix as usize];
            match self.part {
                Part::Prepare => {
                    self.prepare(view, strips);
                    self.part = Part::Cast(0);
                }
                Part::Cast(first) => {
                    let range = within(first, some_runs(view.side), self.drawn.len());
                    self.part = match range.end == self.drawn.len() {
                        true => Part::Receive(0),
                        false => Part::Cast(range.end),
                    };
                    self.cast(view, strips, range);
                }
                Part::Receive(first) => {
                    let range = within(first, some_seen(view.side), strips.seen.len());
                    self.part = Part::Receive(range.end);
                    let is_done = range.end == strips.seen.len();
                    self.receive(view, strips, range, stands);
                    if is_done {
                        found.push(Found {
                            view: ix,
                            lit: std::mem::take(&mut self.lit),
                            n_texels: self.n_texels,
                        });
                        (self.view, self.part) = (None, Part::Prepare);
                    }
                }
            }
            if !deadline.is_to_come() {
                break;
            }
        }
        found
    }

    fn prepare(&mut self, view: &ShadowView, strips: &Strips) {
        self.n_texels = 0;
        let (at, drawn) = (&mut self.at, &mut self.drawn);
        dispatch!(Level::new(), simd => {
            project(simd, view, strips, at);
            plan(simd, view, strips, drawn);
        });
        self.map.clear(view.side);
    }

    fn cast(&mut self, view: &ShadowView, strips: &Strips, range: Range<usize>) {
        let runs = &self.drawn[range];
        let order = &strips.order;
        let (at, map) = (&self.at, &mut self.map);
        dispatch!(Level::new(), simd => {
            self.n_texels += cast(simd, view, order, runs, at, map);
        });
    }

    fn receive(
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

/// As many from `first` on as there are of `n`, at most `most`.
fn within(first: usize, most: usize, n: usize) -> Range<usize> {
    first..(first + most).min(n)
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
    /// Pages of 32 by 32 texels along a side.
    pages: i32,
    /// Where the first begins.
    start: usize,
    texels: Vec<u32>,
}

/// Bytes of a page of memory.
const PAGE: usize = 4096;

impl Map {
    fn clear(&mut self, side: u32) {
        self.pages = side.div_ceil(32) as i32;
        let n = self.n_texels() as usize + LANES;
        let spare = PAGE / size_of::<u32>();
        if self.texels.len() == n + spare {
            self.texels.fill(0);
        } else {
            // Pages of its first map that nothing is drawn on are never touched.
            self.texels = vec![0; n + spare];
        }
        self.start = self.texels.as_ptr().align_offset(PAGE).min(spare);
    }

    /// After them come eight that are not on the map.
    fn n_texels(&self) -> i32 {
        1024 * self.pages * self.pages
    }

    /// Of eight texels that are not on the map.
    #[inline(always)]
    fn beside<S: Simd>(&self, simd: S) -> i32x8<S> {
        i32x8::simd_from(simd, [0, 1, 2, 3, 4, 5, 6, 7]) + self.n_texels()
    }

    /// Of eight texels of the map. Four by four are a line of the cache, and 32 by 32 a page of memory.
    #[inline(always)]
    fn indices<S: Simd>(&self, x: i32x8<S>, y: i32x8<S>) -> i32x8<S> {
        let page = ((x >> 5) + (y >> 5) * self.pages) << 10;
        page | (y & 28) << 5 | (x & 28) << 2 | (y & 3) << 2 | (x & 3)
    }

    /// Raises eight texels that are below `values`. Without a branch for those that are not to be: a
    /// wrong guess of the processor costs more than a texel.
    #[inline(always)]
    fn raise<S: Simd>(&mut self, indices: i32x8<S>, values: i32x8<S>) {
        let (indices, values) = (<[i32; LANES]>::from(indices), <[i32; LANES]>::from(values));
        let texels = &mut self.texels[self.start..];
        for (index, value) in indices.into_iter().zip(values) {
            let texel = &mut texels[index as usize];
            *texel = (*texel).max(value as u32);
        }
    }
}

/// What boxes around eight runs cover of a map.
struct Boxes {
    /// Blocks: left, top, right, bottom.
    blocks: [[i32; LANES]; 4],
    /// Lowest and highest, cm.
    low: [f32; LANES],
    high: [f32; LANES],
}

impl Boxes {
    /// Of the eight runs from `first` on.
    #[inline(always)]
    fn new<S: Simd>(simd: S, view: &ShadowView, order: &StripOrder, first: usize) -> Boxes {
        let of = |ix: usize| f32x8::from_slice(simd, &order.boxes[ix][first..first + LANES]);
        let (x, y, z) = (
            of(0) - view.centre[0],
            of(1) - view.centre[1],
            of(2) - view.centre[2],
        );
        let boxes = ([x, y, z], [of(3), of(4), of(5)]);
        // Ribbons are wider along rows and columns than across, by sqrt(2) at most.
        let reach = of(6) * (1.5 * view.texels_per_cm) + 1.0;
        let (left, right) = blocks_along(view, boxes, view.right, reach);
        let (top, bottom) = blocks_along(view, boxes, view.up, reach);
        let (middle, half) = along(boxes, view.towards);
        let half = half + SLACK * view.reach;
        Boxes {
            blocks: [left, top, right, bottom],
            low: (middle - half).into(),
            high: (middle + half).into(),
        }
    }

    /// The blocks that a run may touch.
    fn touched(&self, lane: usize) -> impl Iterator<Item = usize> {
        let [left, top, right, bottom] = self.blocks.map(|blocks| blocks[lane] as usize);
        (top..=bottom).flat_map(move |y| (left..=right).map(move |x| x + BLOCKS * y))
    }

    /// Where they are drawn in an order in which runs that touch the same texels follow each other: their middles' blocks, along
    /// rows that change direction.
    fn place(&self, lane: usize) -> u32 {
        let [left, top, right, bottom] = self.blocks.map(|blocks| blocks[lane] as u32);
        let (x, y) = ((left + right) / 2, (top + bottom) / 2);
        let along = if y % 2 == 0 { x } else { BLOCKS as u32 - 1 - x };
        along + BLOCKS as u32 * y
    }
}

/// Middles and half extents along an axis of eight boxes, given by the same.
#[inline(always)]
fn along<S: Simd>(
    ([x, y, z], [width, height, depth]): ([f32x8<S>; 3], [f32x8<S>; 3]),
    [a, b, c]: [f32; 3],
) -> (f32x8<S>, f32x8<S>) {
    let middle = x * a + y * b + z * c;
    (middle, width * a.abs() + height * b.abs() + depth * c.abs())
}

/// First and last block of eight boxes that reach so many texels farther.
#[inline(always)]
fn blocks_along<S: Simd>(
    view: &ShadowView,
    boxes: ([f32x8<S>; 3], [f32x8<S>; 3]),
    axis: [f32; 3],
    reach: f32x8<S>,
) -> ([i32; LANES], [i32; LANES]) {
    let (middle, half) = along(boxes, axis);
    let middle = middle * view.texels_per_cm + 0.5 * view.side as f32;
    let half = half * view.texels_per_cm + reach;
    (
        blocks_at(view, middle - half),
        blocks_at(view, middle + half),
    )
}

/// Blocks of eight rows or columns, within the map.
#[inline(always)]
fn blocks_at<S: Simd>(view: &ShadowView, texel: f32x8<S>) -> [i32; LANES] {
    let block = texel * (BLOCKS as f32 / view.side as f32);
    let block = block.max(0.0).min((BLOCKS - 1) as f32);
    block.to_int::<i32x8<S>>().into()
}

/// Plans which runs are drawn: those above something that is looked up.
#[inline(always)]
fn plan<S: Simd>(simd: S, view: &ShadowView, strips: &Strips, drawn: &mut Vec<u32>) {
    // Lowest height that is looked up, by block; infinite where none is. What lies below changes nothing.
    let mut lowest = [f32::INFINITY; BLOCKS * BLOCKS];
    let order = &*strips.order;
    let n_runs = order.runs.len();
    // Fine maps do not fit into a cache.
    let is_sorted = view.side > SHADOW_SIDE;
    let mut places = Vec::new();
    drawn.clear();
    simd.vectorize(
        #[inline(always)]
        || {
            for first in (0..n_runs).step_by(LANES) {
                let has_seen = &strips.has_seen[first..(first + LANES).min(n_runs)];
                if has_seen.contains(&true) {
                    let boxes = Boxes::new(simd, view, order, first);
                    for (lane, _) in has_seen.iter().enumerate().filter(|(_, is)| **is) {
                        for block in boxes.touched(lane) {
                            lowest[block] = lowest[block].min(boxes.low[lane]);
                        }
                    }
                }
            }
            for first in (0..n_runs).step_by(LANES) {
                let boxes = Boxes::new(simd, view, order, first);
                for lane in 0..LANES.min(n_runs - first) {
                    let is_above = |block: usize| boxes.high[lane] > lowest[block];
                    if boxes.touched(lane).any(is_above) {
                        let run = (first + lane) as u32;
                        match is_sorted {
                            true => places.push((boxes.place(lane), run)),
                            false => drawn.push(run),
                        }
                    }
                }
            }
        },
    );
    places.sort_unstable();
    drawn.extend(places.iter().map(|(_, run)| run));
}

/// Draws runs; what each texel holds does not depend on their order. Answers how many texels they cover.
#[inline(always)]
fn cast<S: Simd>(
    simd: S,
    view: &ShadowView,
    order: &StripOrder,
    runs: &[u32],
    at: &[Vec<f32>; 3],
    map: &mut Map,
) -> u64 {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut n_texels = 0;
            for &run in runs {
                let run = &order.runs[run as usize];
                let segments = Segments::new(simd, view, (run, at, &order.points[3]));
                n_texels += segments.draw(simd, view, map);
            }
            n_texels
        },
    )
}

/// Segments on the map, from their first to their last column; columns are rows where they are steep.
struct Segments<S: Simd> {
    /// Where each begins, along and across the columns, texels.
    along: f32x8<S>,
    across: f32x8<S>,
    /// How much it rises with each column across and in height.
    rise: f32x8<S>,
    climb: f32x8<S>,
    /// Height where it begins, cm.
    height: f32x8<S>,
    half_width: f32x8<S>,
    first: i32x8<S>,
    last: i32x8<S>,
    is_steep: mask32x8<S>,
    name: i32x8<S>,
}

impl<S: Simd> Segments<S> {
    /// Those of a run, of points `at` with a `radius`; lanes beyond it have no columns.
    #[inline(always)]
    fn new(
        simd: S,
        view: &ShadowView,
        (run, at, radius): (&Run, &[Vec<f32>; 3], &[f32]),
    ) -> Segments<S> {
        let from = run.at as usize;
        let of = |numbers: &[f32]| {
            let pair = &numbers[from..from + LANES + 1];
            let (a, b) = (&pair[..LANES], &pair[1..]);
            (f32x8::from_slice(simd, a), f32x8::from_slice(simd, b))
        };
        let ((ax, bx), (ay, by)) = (of(&at[0]), of(&at[1]));
        let ((az, bz), (ar, br)) = (of(&at[2]), of(radius));
        let is_steep = (by - ay).abs().simd_gt((bx - ax).abs());
        let (along_a, along_b) = (is_steep.select(ay, ax), is_steep.select(by, bx));
        let (across_a, across_b) = (is_steep.select(ax, ay), is_steep.select(bx, by));
        let is_back = along_a.simd_gt(along_b);
        let (along, end) = (along_a.min(along_b), along_a.max(along_b));
        let across = is_back.select(across_b, across_a);
        let height = is_back.select(bz, az);
        let run_length = end - along;
        let lanes = i32x8::simd_from(simd, [0, 1, 2, 3, 4, 5, 6, 7]);
        let is_there = run_length.simd_ge(1e-6) & lanes.simd_lt(run.n_segments as i32);
        let inverse = f32x8::splat(simd, 1.0) / run_length.max(1e-6);
        let rise = (is_back.select(across_a, across_b) - across) * inverse;
        let climb = (is_back.select(az, bz) - height) * inverse;
        let radius = (ar + br) * (0.5 * view.texels_per_cm);
        let side = view.side as i32;
        let first = rows_from(along, side);
        let last = is_there.select(rows_from(end, side), first);
        Segments {
            along,
            across,
            rise,
            climb,
            height,
            // Nor rows: what lies beyond the run may be wide.
            half_width: is_there
                .select(radius * (rise * rise + 1.0).sqrt(), f32x8::splat(simd, 0.0)),
            first,
            last,
            is_steep,
            name: (lanes + run.first as i32) & ((1 << NAME_BITS) - 1),
        }
    }

    /// Draws them, a column of each at a time; answers how many texels they cover.
    ///
    /// Thin strands cover a row of a column or none. Which is so changes from column to column, so that the processor would guess
    /// wrong every other time: as many rows are drawn of each column as any can cover, most of them beside the map.
    #[inline(always)]
    fn draw(&self, simd: S, view: &ShadowView, map: &mut Map) -> u64 {
        let columns = <[i32; LANES]>::from(self.last - self.first);
        let n_columns = columns.into_iter().fold(0, i32::max);
        let side = view.side as i32;
        // More than what is lost in rounding.
        let widths = <[f32; LANES]>::from(self.half_width * 2.0 + 0.01);
        let widest = widths.into_iter().fold(0.0, f32::max);
        let n_rows = (widest as i32).min(side - 1) + 1;
        let mut n_texels = 0;
        for step in 0..n_columns {
            let column = self.first + step;
            // As `shadow_map::cast_shadows`.
            let along = column.to_float::<f32x8<S>>() + 0.5 - self.along;
            let y = along * self.rise + self.across;
            let mut row = rows_from(y - self.half_width, side);
            let top = rows_from(y + self.half_width, side);
            let top = column.simd_lt(self.last).select(top, row);
            let height = (along * self.climb + self.height) * 0.5 / view.reach;
            let height = (height + 0.5).max(0.0).min(1.0) * HEIGHT_UNITS;
            let values = height.to_int::<i32x8<S>>() << NAME_BITS | self.name;
            n_texels += self.raise(simd, (column, row, top), values, map);
            for _ in 1..n_rows {
                row += 1;
                n_texels += self.raise(simd, (column, row, top), values, map);
            }
        }
        n_texels
    }

    /// Raises the texels of a column and row of each that are before its `top`; answers how many there are.
    #[inline(always)]
    fn raise(
        &self,
        simd: S,
        (column, row, top): (i32x8<S>, i32x8<S>, i32x8<S>),
        values: i32x8<S>,
        map: &mut Map,
    ) -> u64 {
        let is_covered = row.simd_lt(top);
        let (x, y) = (
            self.is_steep.select(row, column),
            self.is_steep.select(column, row),
        );
        let indices = is_covered.select(map.indices(x, y), map.beside(simd));
        map.raise(indices, values);
        u64::from(is_covered.to_bitmask().count_ones())
    }
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
    let texels = &map.texels[map.start..];
    for (highest, index) in highest.iter_mut().zip(index) {
        *highest = texels[index as usize] as i32;
    }
    let highest = i32x8::simd_from(simd, highest);
    // Heights have 20 bits, so shifting the sign in leaves them after the mask.
    let above = (highest >> NAME_BITS) & ((1 << (32 - NAME_BITS)) - 1);
    let apart = (highest - seen.point as i32 + OWN_POINTS as i32) & ((1 << NAME_BITS) - 1);
    let is_lit = above.simd_le(height) | apart.simd_le(2 * OWN_POINTS as i32);
    is_lit.to_bitmask() as u8
}
