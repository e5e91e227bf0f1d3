//! What is shrunk, pixel by pixel and over blocks.

/// A correction, its noise and what it goes with.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub size: [usize; 2],
    /// Rows one after another.
    pub pixels: Vec<Cell>,
    /// Columns and rows of the pixels that have any scale, first and one past the last.
    pub shown: [[usize; 2]; 2],
    /// Degrees of freedom of the variances: how many differences each is known from.
    pub freedom: f32,
}

impl Field {
    /// No correction but in the pixels that are `known`, by their places. Their variances have so many degrees of
    /// freedom, the mean, 1 or more.
    pub fn new(
        size: [usize; 2],
        known: impl Iterator<Item = (usize, Cell)>,
        freedom: f32,
    ) -> Field {
        let mut pixels = vec![Cell::default(); size[0] * size[1]];
        let mut shown = size.map(|side| [side, 0]);
        for (pixel, cell) in known {
            pixels[pixel] = cell;
            for (shown, at) in shown.iter_mut().zip([pixel % size[0], pixel / size[0]]) {
                *shown = [shown[0].min(at), shown[1].max(at + 1)];
            }
        }
        Field {
            size,
            pixels,
            shown: shown.map(|[first, end]| [first.min(end), end]),
            freedom,
        }
    }
}

/// Sums over a block; a pixel is the smallest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cell {
    pub correction: [f32; 3],
    /// Of the correction.
    pub variance: [f32; 3],
    /// What the correction is likely to go with, above 0 where there may be one.
    pub scale: [f32; 3],
}

impl Cell {
    /// Whether any of its pixels may be corrected.
    pub fn is_shown(&self) -> bool {
        self.scale[0] > 0.0
    }

    pub fn add(&mut self, other: &Cell) {
        for c in 0..3 {
            self.correction[c] += other.correction[c];
            self.variance[c] += other.variance[c];
            self.scale[c] += other.scale[c];
        }
    }

    fn ratio(&self, c: usize) -> f32 {
        match self.scale[c] > 0.0 {
            true => self.correction[c] / self.scale[c],
            false => 0.0,
        }
    }
}

/// What a block differs from the larger one by, or sums of that over blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Detail {
    /// Of the ratio; not summed.
    pub difference: [f32; 3],
    /// Square of that of the block's sum, and its noise.
    pub measured: [f32; 3],
    pub noise: [f32; 3],
    /// Square of the scale; 0 where nothing is shown.
    pub weight: [f32; 3],
    /// 1, or 0 where nothing is shown.
    pub count: f32,
}

impl Detail {
    pub fn add(&mut self, other: &Detail) {
        for c in 0..3 {
            self.measured[c] += other.measured[c];
            self.noise[c] += other.noise[c];
            self.weight[c] += other.weight[c];
        }
        self.count += other.count;
    }

    pub fn new(cell: &Cell, parent: Option<&Cell>) -> Detail {
        if !cell.is_shown() {
            return Detail::default();
        }
        let mut detail = Detail {
            count: 1.0,
            ..Detail::default()
        };
        for c in 0..3 {
            let (difference, variance) = match parent {
                None => (cell.ratio(c), cell.variance[c]),
                Some(parent) => {
                    // The block is a part of the larger one.
                    let share = cell.scale[c] / parent.scale[c];
                    let rest = (parent.variance[c] - cell.variance[c]).max(0.0);
                    let noise = (1.0 - share).powi(2) * cell.variance[c] + share * share * rest;
                    (cell.ratio(c) - parent.ratio(c), noise)
                }
            };
            detail.difference[c] = difference;
            detail.measured[c] = (difference * cell.scale[c]).powi(2);
            detail.noise[c] = variance;
            detail.weight[c] = cell.scale[c] * cell.scale[c];
        }
        detail
    }
}
