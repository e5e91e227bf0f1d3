//! A picture in blocks of all sizes: their sums, and what a block differs from the larger one around it by.

use std::ops::Range;

use rayon::prelude::*;

use super::estimate::Estimate;
use super::field::{Cell, Detail, Field};

/// Levels of blocks below the whole picture: sides of 1, 2, 4, ... 64 pixels.
const N_LEVELS: usize = 7;

/// Side of the largest of them.
pub(super) const TOP: usize = 1 << (N_LEVELS - 1);

/// Blocks to each side over which noise and signal are told apart.
const REACH: usize = 7;

/// One place of the grid over what a picture shows: whole blocks of [`TOP`] pixels a side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    /// Column and row of the picture where its first block starts; it may lie outside.
    from: [isize; 2],
    /// Pixels across and down.
    size: [usize; 2],
}

impl Grid {
    /// The grid with a corner of a block so many pixels left of and above that of the picture, as far as it
    /// has columns and rows that are `shown`.
    pub fn new(shown: [[usize; 2]; 2], shift: [usize; 2]) -> Grid {
        let [x, y] = [0, 1].map(|axis| {
            let [first, end] = shown[axis].map(|at| at + shift[axis]);
            let first = first / TOP * TOP;
            let size = end.next_multiple_of(TOP) - first;
            (first as isize - shift[axis] as isize, size)
        });
        Grid {
            from: [x.0, y.0],
            size: [x.1, y.1],
        }
    }

    /// Place among its pixels, rows one after another, of a pixel of the picture in it.
    pub fn at(&self, [x, y]: [usize; 2]) -> usize {
        self.along(1, y) * self.size[0] + self.along(0, x)
    }

    /// Column (axis 0) or row (1) of the grid where the picture has `at`.
    fn along(&self, axis: usize, at: usize) -> usize {
        (at as isize - self.from[axis]) as usize
    }

    /// The columns (axis 0) or rows (1) of those given that lie within.
    pub fn within(&self, axis: usize, of: Range<usize>) -> Range<usize> {
        let [first, end] = [0, self.size[axis] as isize].map(|at| (at + self.from[axis]).max(0));
        of.start.max(first as usize)..of.end.min(end as usize)
    }

    /// Which blocks of `side` pixels along an axis have how many of these columns or rows, at most `side`.
    pub fn parts(&self, axis: usize, of: &Range<usize>, side: usize) -> [(usize, usize); 2] {
        let [from, to] = [of.start, of.end].map(|at| self.along(axis, at));
        let first = from / side;
        let of_first = to.min((first + 1) * side) - from;
        [(first, of_first), (first + 1, to - from - of_first)]
    }
}

/// Blocks of a size in one place of the grid, rows one after another.
#[derive(Clone, Debug, Default)]
pub(super) struct Level {
    /// Blocks across and down.
    pub size: [usize; 2],
    pub cells: Vec<Cell>,
    pub details: Vec<Detail>,
    pub estimates: Vec<Estimate>,
}

/// Sums over blocks of all sizes, from pixels to the whole picture, into `levels`, whose room is used again.
pub(super) fn sum_up(field: &Field, grid: &Grid, levels: &mut Vec<Level>) {
    levels.resize_with(N_LEVELS + 1, Level::default);
    for ix in 0..levels.len() {
        let (below, own) = levels.split_at_mut(ix);
        let own = &mut own[0];
        own.size = match ix {
            N_LEVELS => [1, 1],
            _ => grid.size.map(|side| side >> ix),
        };
        own.cells.resize(own.size[0] * own.size[1], Cell::default());
        let rows = own.cells.par_chunks_mut(own.size[0]).enumerate();
        match below.last() {
            None => rows.for_each(|(y, cells)| copy_row(field, grid, y, cells)),
            Some(below) if ix < N_LEVELS => rows.for_each(|(y, cells)| {
                let [upper, lower] = [2 * y, 2 * y + 1].map(|y| &below.cells[y * below.size[0]..]);
                for (x, cell) in cells.iter_mut().enumerate() {
                    *cell = upper[2 * x];
                    for part in [upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]] {
                        cell.add(&part);
                    }
                }
            }),
            Some(below) => {
                own.cells[0] = Cell::default();
                below.cells.iter().for_each(|cell| own.cells[0].add(cell));
            }
        }
    }
}

/// Row `y` of the grid, with nothing outside of the picture.
fn copy_row(field: &Field, grid: &Grid, y: usize, cells: &mut [Cell]) {
    let row = grid.from[1] + y as isize;
    let [first, end] = field.shown[0];
    let [from, to] = [first, end].map(|x| grid.along(0, x));
    let is_shown = (field.shown[1][0] as isize..field.shown[1][1] as isize).contains(&row);
    if !is_shown {
        cells.fill(Cell::default());
        return;
    }
    let row = &field.pixels[row as usize * field.size[0]..][first..end];
    cells[..from].fill(Cell::default());
    cells[from..to].copy_from_slice(row);
    cells[to..].fill(Cell::default());
}

impl Level {
    /// Place of the block that the block `at` of the level below is a part of.
    pub fn parent(&self, [x, y]: [usize; 2]) -> usize {
        match self.size {
            [1, 1] => 0,
            [across, _] => y / 2 * across + x / 2,
        }
    }

    /// Finds what each block differs from that of the level `above` by, and in `rows` sums of that over the
    /// blocks to each side.
    pub fn compare(&mut self, above: Option<&Level>, rows: &mut Vec<Detail>) {
        let width = self.size[0];
        let n = self.cells.len();
        self.details.resize(n, Detail::default());
        self.estimates.resize(n, Estimate::default());
        rows.resize(n, Detail::default());
        (self.details.par_chunks_mut(width))
            .zip(self.cells.par_chunks(width))
            .zip(rows.par_chunks_mut(width))
            .enumerate()
            .for_each(|(y, ((details, cells), sums))| {
                for (x, (detail, cell)) in details.iter_mut().zip(cells).enumerate() {
                    let parent = above.map(|above| &above.cells[above.parent([x, y])]);
                    *detail = Detail::new(cell, parent);
                }
                for (x, sum) in sums.iter_mut().enumerate() {
                    *sum = Detail::default();
                    for detail in &details[x.saturating_sub(REACH)..(x + REACH + 1).min(width)] {
                        sum.add(detail);
                    }
                }
            });
    }

    /// Estimates all blocks, of `side` pixels, from those of the level `above`. `rows` are what
    /// [`Level::compare`] made of this level, and `freedom` that of the variances.
    pub fn estimate(&mut self, above: Option<&Level>, rows: &[Detail], side: usize, freedom: f32) {
        let size = self.size;
        let (cells, details) = (&self.cells, &self.details);
        self.estimates
            .par_chunks_mut(size[0])
            .enumerate()
            .for_each_init(Vec::new, |around, (y, estimates)| {
                around_row(rows, size, y, around);
                let own = y * size[0]..(y + 1) * size[0];
                let of_row = cells[own.clone()].iter().zip(&details[own]);
                for (((x, estimate), (cell, own)), around) in
                    (0..).zip(estimates).zip(of_row).zip(&*around)
                {
                    let parent = above.map(|above| above.around([x, y]));
                    let parent = parent.unwrap_or_default();
                    let of = (own, around);
                    *estimate = Estimate::new(cell, of, (side, freedom), &parent);
                }
            });
    }

    /// The block of this level that the block `at` of the level below is a part of, and its estimate.
    fn around(&self, at: [usize; 2]) -> (Cell, Estimate) {
        let from = self.parent(at);
        (self.cells[from], self.estimates[from])
    }
}

/// Sums over the blocks around each of row `y` of a level of `size`, from its sums along `rows`.
fn around_row(rows: &[Detail], [width, height]: [usize; 2], y: usize, sums: &mut Vec<Detail>) {
    sums.clear();
    sums.resize(width, Detail::default());
    for from in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
        for (sum, row) in sums.iter_mut().zip(&rows[from * width..]) {
            sum.add(row);
        }
    }
}
