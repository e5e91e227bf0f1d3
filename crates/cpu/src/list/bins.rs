//! Segments on the screen, sorted into tiles.

use super::super::pieces::{LEAST_LENGTH, bend, between, n_pieces};
use super::super::screen_point::ScreenPoint;
use super::super::triangles::TILE;

/// A segment on the screen.
#[derive(Clone, Copy)]
pub(super) struct Ribbon {
    /// Its ends, px.
    pub a: [f32; 2],
    pub b: [f32; 2],
    /// Unit vector from end to end.
    pub along: [f32; 2],
    /// Unit vectors across which the ribbon begins and ends: those of the strand at its points, so
    /// that the next one begins where this one ends.
    pub begins: [f32; 2],
    pub ends: [f32; 2],
    /// Half of the width at the ends, px.
    pub half: [f32; 2],
    pub depth: [f32; 2],
    pub coverage: [f32; 2],
    /// Does the strand end with it?
    pub is_tip: bool,
    /// How far the strand between the ends leaves the line, px; see [`bend`].
    bend: f32,
}

/// A part of a segment on the screen: all of it where it is straight there.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    pub ribbon: Ribbon,
    /// Share of the segment's way where it begins, and how much of it the piece is.
    pub t: [f32; 2],
}

/// The pieces that a segment between two neighbouring points is drawn in, one after the other.
pub(super) struct Pieces<'a> {
    ends: [&'a ScreenPoint; 2],
    /// All of it as one ribbon.
    whole: Option<Ribbon>,
    /// Where the next piece begins.
    begin: ScreenPoint,
    /// The next piece, and how many there are.
    ix: u32,
    n: u32,
}

impl<'a> Pieces<'a> {
    /// None where the segment is behind the eye or seen end on.
    #[inline(always)]
    pub fn new(a: &'a ScreenPoint, b: &'a ScreenPoint) -> Pieces<'a> {
        let whole = Ribbon::new(a, b);
        let n = whole.as_ref().map_or(0, |ribbon| n_pieces(ribbon.bend));
        Pieces {
            ends: [a, b],
            whole,
            begin: *a,
            ix: 0,
            n,
        }
    }
}

impl Iterator for Pieces<'_> {
    type Item = Piece;

    #[inline(always)]
    fn next(&mut self) -> Option<Piece> {
        while self.ix < self.n {
            let ix = self.ix;
            self.ix += 1;
            if self.n == 1 {
                return self.whole.map(|ribbon| Piece {
                    ribbon,
                    t: [0.0, 1.0],
                });
            }
            let [a, b] = self.ends;
            let share = 1.0 / self.n as f32;
            let t = [ix as f32 * share, share];
            let end = between(a, b, if self.ix == self.n { 1.0 } else { t[0] + share });
            let ribbon = Ribbon::new(&self.begin, &end);
            self.begin = end;
            if let Some(ribbon) = ribbon {
                return Some(Piece { ribbon, t });
            }
        }
        None
    }
}

impl Ribbon {
    /// That of two neighbouring points; [`None`] where it is behind the eye or seen end on.
    #[inline(always)]
    pub fn new(a: &ScreenPoint, b: &ScreenPoint) -> Option<Ribbon> {
        if a.coverage < 0.0 || b.coverage < 0.0 {
            return None;
        }
        let d = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
        let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
        if !(length > LEAST_LENGTH && length < 1e9) {
            return None;
        }
        let along = [d[0] / length, d[1] / length];
        let towards = |at: [f32; 2]| {
            let sign = 1.0_f32.copysign(at[0] * along[0] + at[1] * along[1]);
            [sign * at[0], sign * at[1]]
        };
        Some(Ribbon {
            a: a.at,
            b: b.at,
            along,
            begins: towards(a.along),
            ends: towards(b.along),
            half: [a.half_width, b.half_width],
            depth: [a.depth, b.depth],
            coverage: [a.coverage, b.coverage],
            is_tip: b.is_tip,
            bend: bend(a, b, along, length),
        })
    }

    /// Lowest and highest coordinate along an axis, px.
    #[inline(always)]
    pub fn range(&self, axis: usize) -> [f32; 2] {
        let reach = self.half[0].max(self.half[1]) + 0.5 + self.bend;
        [
            self.a[axis].min(self.b[axis]) - reach,
            self.a[axis].max(self.b[axis]) + reach,
        ]
    }

    /// How far the ribbon's middle passes a place, px, either sign.
    #[inline(always)]
    pub fn off(&self, at: [f32; 2]) -> f32 {
        self.along[0] * (at[1] - self.a[1]) - self.along[1] * (at[0] - self.a[0])
    }
}

/// Sorts by depth, then by point: no two are equal.
pub(super) fn key(depth: f32, first: u32) -> u64 {
    u64::from(depth.max(0.0).to_bits()) << 32 | u64::from(first)
}

/// The segments of a chunk by tile.
pub(super) struct Bins {
    /// Where each tile's segments start, and where the last ends.
    starts: Vec<u32>,
    /// [`key`] of each.
    keys: Vec<u64>,
}

impl Bins {
    pub fn new(segments: &[u32], points: &[ScreenPoint], tiles: [u32; 2]) -> Bins {
        let n_tiles = (tiles[0] * tiles[1]) as usize;
        let mut pairs: Vec<(u32, u64)> = Vec::with_capacity(2 * segments.len());
        let mut starts = vec![0_u32; n_tiles + 1];
        for &first in segments {
            let (a, b) = (&points[first as usize], &points[first as usize + 1]);
            let Some(ribbon) = Ribbon::new(a, b) else {
                continue;
            };
            let nearest = key(a.depth.min(b.depth), first);
            let span = |axis: usize| {
                let [low, high] = ribbon.range(axis).map(|x| x / TILE as f32);
                // Casts saturate, NaN to an empty range.
                let end = (high.floor() + 1.0).clamp(0.0, tiles[axis] as f32) as u32;
                (low.floor().max(0.0) as u32).min(end)..end
            };
            let reach = ribbon.half[0].max(ribbon.half[1]) + 0.5 + ribbon.bend;
            let [x, y] = ribbon.along;
            let reach = reach + 0.5 * TILE as f32 * (x.abs() + y.abs());
            for row in span(1) {
                for column in span(0) {
                    let middle = [column, row].map(|n| (n as f32 + 0.5) * TILE as f32);
                    if ribbon.off(middle).abs() <= reach {
                        let tile = column + tiles[0] * row;
                        starts[tile as usize + 1] += 1;
                        pairs.push((tile, nearest));
                    }
                }
            }
        }
        for ix in 0..n_tiles {
            starts[ix + 1] += starts[ix];
        }
        let mut next = starts.clone();
        let mut keys = vec![0; pairs.len()];
        for (tile, key) in pairs {
            let place = &mut next[tile as usize];
            keys[*place as usize] = key;
            *place += 1;
        }
        Bins { starts, keys }
    }

    pub fn of_tile(&self, tile: usize) -> impl Iterator<Item = u64> {
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        self.keys[range].iter().copied()
    }
}
