//! Which pixels of a tile a ribbon may cover: up to 64 are tested at once, eight a vector.

use strandlight_scattering::wide::{LANES, Simd, f32x8, prelude::*};

use super::bins::Ribbon;

/// Vectors of a block.
const VECTORS: usize = 8;

/// Pixels of a block, a bit each of a word.
const PIXELS: usize = VECTORS * LANES;

/// Column of each lane in vectors of 1, 2, 4 and 8 columns.
const COLUMNS: [[f32; LANES]; 4] = [columns(0), columns(1), columns(2), columns(3)];

/// Row of each lane in them.
const ROWS: [[f32; LANES]; 4] = [rows(0), rows(1), rows(2), rows(3)];

const fn columns(shift: u32) -> [f32; LANES] {
    let mut columns = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        columns[lane] = (lane & ((1 << shift) - 1)) as f32;
        lane += 1;
    }
    columns
}

const fn rows(shift: u32) -> [f32; LANES] {
    let mut rows = [0.0; LANES];
    let mut lane = 0;
    while lane < LANES {
        rows[lane] = (lane >> shift) as f32;
        lane += 1;
    }
    rows
}

/// Where a place lies relative to a ribbon, px.
#[derive(Clone, Copy)]
pub(super) struct Offset {
    /// Distance from the ribbon's middle line, signed.
    pub across: f32,
    /// Distance past its begin, negative before it.
    pub begin: f32,
    /// Distance past its end, negative before it.
    pub end: f32,
}

/// A block of pixels, row by row, as narrow as the ribbon allows: short ribbons take one or two vectors.
#[derive(Clone, Copy)]
pub(super) struct Block {
    /// Its first pixel in the tile.
    pub first: [u32; 2],
    /// It has `1 << shift` columns, 1 to 8.
    shift: u32,
}

impl Block {
    /// The block at `first` with room for so many columns, at most eight.
    #[inline(always)]
    pub fn new(first: [u32; 2], n_columns: u32) -> Block {
        Block {
            first,
            shift: n_columns.next_power_of_two().trailing_zeros(),
        }
    }

    /// How many rows it has.
    #[inline(always)]
    pub fn n_rows(self) -> u32 {
        PIXELS as u32 >> self.shift
    }

    /// The bits of its pixels for `bits` of the pixels of one of its rows.
    #[inline(always)]
    pub fn row(self, row: u32, bits: u32) -> u64 {
        u64::from(bits) << (row << self.shift)
    }

    /// Pixel of the tile that bit `bit` stands for.
    #[inline(always)]
    pub fn pixel(self, bit: u32) -> [u32; 2] {
        let [x, y] = self.first;
        [x + (bit & ((1 << self.shift) - 1)), y + (bit >> self.shift)]
    }
}

/// Offsets of the middles of a block's pixels from a ribbon.
pub(super) struct Offsets {
    across: [f32; PIXELS],
    begin: [f32; PIXELS],
    end: [f32; PIXELS],
}

impl Offsets {
    pub fn new() -> Offsets {
        Offsets {
            across: [0.0; PIXELS],
            begin: [0.0; PIXELS],
            end: [0.0; PIXELS],
        }
    }

    /// Finds them for the first `n_rows` rows of the block whose first pixel has its middle there; answers which of these pixels are
    /// within `reach` of the ribbon: no farther across, not before its begin by more, not past its end by more.
    #[inline(always)]
    pub fn find<S: Simd>(
        &mut self,
        simd: S,
        (block, middle, n_rows): (Block, [f32; 2], u32),
        (ribbon, reach): (&Ribbon, &Offset),
    ) -> u64 {
        let splat = |x: f32| f32x8::splat(simd, x);
        let shift = block.shift as usize;
        let x = f32x8::from_slice(simd, &COLUMNS[shift]) + splat(middle[0]);
        let row = f32x8::from_slice(simd, &ROWS[shift]);
        let rows_of_vector = (LANES >> shift) as f32;
        let [from_a, from_b] = [x - splat(ribbon.a[0]), x - splat(ribbon.b[0])];
        let across_x = from_a * splat(ribbon.along[1]);
        let begin_x = from_a * splat(ribbon.begins[0]);
        let end_x = from_b * splat(ribbon.ends[0]);
        let n_vectors = ((n_rows << block.shift) as usize).div_ceil(LANES);
        let mut within = 0;
        for ix in 0..n_vectors {
            let y = row + splat(middle[1] + ix as f32 * rows_of_vector);
            let [from_a, from_b] = [y - splat(ribbon.a[1]), y - splat(ribbon.b[1])];
            let across = from_a * splat(ribbon.along[0]) - across_x;
            let begin = begin_x + from_a * splat(ribbon.begins[1]);
            let end = end_x + from_b * splat(ribbon.ends[1]);
            let is_within = across.abs().simd_le(splat(reach.across))
                & begin.simd_ge(splat(reach.begin))
                & end.simd_le(splat(reach.end));
            let first = ix * LANES;
            within |= is_within.to_bitmask() << first;
            across.store_slice(&mut self.across[first..first + LANES]);
            begin.store_slice(&mut self.begin[first..first + LANES]);
            end.store_slice(&mut self.end[first..first + LANES]);
        }
        within
    }

    /// That of the pixel of bit `bit`.
    #[inline(always)]
    pub fn of(&self, bit: u32) -> Offset {
        let ix = bit as usize;
        Offset {
            across: self.across[ix],
            begin: self.begin[ix],
            end: self.end[ix],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::screen_point::ScreenPoint;
    use super::*;
    use strandlight_scattering::wide::{Level, dispatch};

    #[test]
    fn blocks_of_any_width_find_the_pixels_within_reach() {
        let point = |at: [f32; 2]| ScreenPoint {
            at,
            along: [0.6, 0.8],
            half_width: 0.5,
            depth: 0.5,
            coverage: 1.0,
            is_tip: false,
        };
        let (a, b) = (point([1.5, 0.7]), point([4.2, 6.1]));
        let ribbon = Ribbon::new(&a, &b).expect("a ribbon");
        let reach = Offset {
            across: 1.1,
            begin: -0.4,
            end: 0.3,
        };
        let level = Level::new();
        let mut n_within = 0;
        for n_columns in 1..=8 {
            let block = Block::new([3, 2], n_columns);
            let n_rows = block.n_rows().min(13);
            assert_eq!(block.pixel(0), [3, 2]);
            let mut offsets = Offsets::new();
            let within = dispatch!(level, simd => {
                offsets.find(simd, (block, [0.5, 0.5], n_rows), (&ribbon, &reach))
            });
            for row in 0..n_rows {
                for column in 0..n_columns {
                    let bit = block.row(row, 1 << column).trailing_zeros();
                    assert_eq!(block.pixel(bit), [3 + column, 2 + row]);
                    let at = [column as f32 + 0.5, row as f32 + 0.5];
                    let past = |of: [f32; 2], from: [f32; 2]| {
                        of[0] * (at[0] - from[0]) + of[1] * (at[1] - from[1])
                    };
                    let expected = [
                        ribbon.off(at),
                        past(ribbon.begins, ribbon.a),
                        past(ribbon.ends, ribbon.b),
                    ];
                    let found = offsets.of(bit);
                    let found = [found.across, found.begin, found.end];
                    for (found, expected) in found.iter().zip(expected) {
                        assert!((found - expected).abs() < 1e-5, "{found}, {expected}");
                    }
                    let is_within = expected[0].abs() <= reach.across
                        && expected[1] >= reach.begin
                        && expected[2] <= reach.end;
                    assert_eq!(within >> bit & 1 == 1, is_within, "{row}, {column}");
                    n_within += u32::from(is_within);
                }
            }
        }
        assert!(n_within > 60, "{n_within}");
    }
}
