//! What each pixel of a tile shows, from front to back.

use strandlight_scattering::wide::{LANES, Simd, f32x8, prelude::*};
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::{ViewUniform, WIDE_PX};

use super::super::pieces::{BEYOND_TIP, round_tip};
use super::super::screen_point::ScreenPoint;
use super::super::triangles::TILE;
use super::super::triangles::Triangles;
use super::bins::{Piece, Pieces, key};
use super::block::{Block, Offset, Offsets};
use super::blocked::{Blocked, ProxyEntry, block};
use super::pixel::{Drawn, Entry, Pixel, Waiting};
use super::places::{FARTHEST, PLACES, PLACES_SIDE, linear};

/// Pixels of a tile.
const TILE_PIXELS: usize = (TILE * TILE) as usize;

// Rows are bits of a word.
const _: () = assert!(TILE < 32);

/// Segments of a tile that are sorted at a time: what lies behind the last open pixel need not be.
const SORTED: usize = 1024;

/// Segments whose ends are fetched at a time: fetching one does not wait for the other.
const FETCHED: usize = 32;

/// Means of places across a narrow ribbon, and of their squares: all of its width.
const ALL_ACROSS: [f32; 2] = [0.0, 1.0 / 3.0];

/// The list of a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tile {
    /// Its upper left pixel.
    pub origin: [u32; 2],
    /// Its width and height, px.
    pub size: [u32; 2],
    /// Where the entries of each pixel, row by row, start, and where the last ends.
    pub starts: Vec<u32>,
    /// Entries of all pixels, from front to back.
    pub entries: Vec<Entry>,
    /// Proxies that are seen.
    pub proxies: Vec<ProxyEntry>,
    /// Pairs of a pixel and a piece of a segment within reach of each other, and of these with some coverage.
    pub(super) counts: [u64; 2],
    /// Are there ribbons with a profile over their width?
    pub has_wide: bool,
}

impl Tile {
    /// Place of one of its pixels in the band of a picture of this `width` that its row of tiles is.
    pub fn place(&self, pixel: usize, width: u32) -> usize {
        let [x, y] = [pixel as u32 % self.size[0], pixel as u32 / self.size[0]];
        (self.origin[0] + x + width * y) as usize
    }
}

/// What the threads make tiles in.
#[derive(Default)]
pub(super) struct Scratch {
    /// [`super::bins::key`] of those that may be seen.
    pub ribbons: Vec<u64>,
    pixels: Vec<Pixel>,
    waiting: Waiting,
    blocked: Vec<Blocked>,
    origin: [u32; 2],
    size: [u32; 2],
    /// Of each row, a bit for each pixel that is not closed.
    open: [u32; TILE as usize],
    n_open: usize,
    counts: [u64; 2],
    has_wide: bool,
    ends: Vec<[ScreenPoint; 2]>,
}

impl Scratch {
    /// Begins a tile, with what the proxies hide of it.
    #[inline(always)]
    pub fn start(
        &mut self,
        view: &ViewUniform,
        (beside, triangles): (&Beside, &Triangles),
        origin: [u32; 2],
        size: [u32; 2],
    ) {
        self.pixels.resize_with(TILE_PIXELS, Pixel::new);
        self.pixels.iter_mut().for_each(Pixel::start);
        self.waiting.clear();
        (self.origin, self.size) = (origin, size);
        self.open = [below(size[0]); TILE as usize];
        self.n_open = (size[0] * size[1]) as usize;
        self.counts = [0; 2];
        self.has_wide = false;
        self.ribbons.clear();
        let of_tile = (origin, size);
        block(view, (beside, triangles), of_tile, &mut self.blocked);
    }

    /// Takes the ribbons from front to back.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, points: &[ScreenPoint]) {
        let mut ribbons = std::mem::take(&mut self.ribbons);
        let mut ends = std::mem::take(&mut self.ends);
        let mut offsets = Offsets::new();
        let mut left = &mut ribbons[..];
        while self.n_open > 0 && !left.is_empty() {
            let n = SORTED.min(left.len());
            if n < left.len() {
                left.select_nth_unstable(n);
            }
            let (nearest, farther) = left.split_at_mut(n);
            nearest.sort_unstable();
            left = farther;
            for keys in nearest.chunks(FETCHED) {
                if self.n_open == 0 {
                    break;
                }
                let firsts = keys.iter().map(|key| *key as u32 as usize);
                ends.clear();
                ends.extend(firsts.map(|first| [points[first], points[first + 1]]));
                for (key, [a, b]) in keys.iter().zip(&ends) {
                    for piece in Pieces::new(a, b) {
                        self.draw(simd, &piece, *key, &mut offsets);
                    }
                }
            }
        }
        (self.ribbons, self.ends) = (ribbons, ends);
        for y in 0..self.size[1] as usize {
            let mut open = self.open[y];
            while open != 0 {
                let x = open.trailing_zeros() as usize;
                open &= open - 1;
                self.settle(simd, [x, y], f32::INFINITY);
            }
        }
    }

    /// Adds a part of a segment to the pixels it touches. Its [`key`] is that of the segment; no segment after it is nearer.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, piece: &Piece, key: u64, offsets: &mut Offsets) {
        let cover = Cover::new(piece);
        self.has_wide |= cover.is_wide;
        let bound = |axis: usize| {
            let [low, high] = piece.ribbon.range(axis);
            let (origin, size) = (self.origin[axis] as f32, self.size[axis] as f32);
            let low = (low - origin).floor().clamp(0.0, size);
            let high = ((high - origin).floor() + 1.0).clamp(0.0, size);
            (low as u32, high as u32)
        };
        let ((left, right), (top, bottom)) = (bound(0), bound(1));
        for x in (left..right).step_by(LANES) {
            let n_columns = (right - x).min(LANES as u32);
            let n_rows = Block::new([x, top], n_columns).n_rows();
            for y in (top..bottom).step_by(n_rows as usize) {
                let block = Block::new([x, y], n_columns);
                let n_rows = n_rows.min(bottom - y);
                let mut open = 0;
                for row in 0..n_rows {
                    let bits = self.open[(y + row) as usize] >> x & below(n_columns);
                    open |= block.row(row, bits);
                }
                if open == 0 {
                    continue;
                }
                let middle = [self.origin[0] + x, self.origin[1] + y].map(|n| n as f32 + 0.5);
                let of_ribbon = (&piece.ribbon, &cover.reach);
                let mut hits = open & offsets.find(simd, (block, middle, n_rows), of_ribbon);
                self.counts[0] += u64::from(hits.count_ones());
                while hits != 0 {
                    let bit = hits.trailing_zeros();
                    hits &= hits - 1;
                    if let Some((depth, drawn)) = cover.of_pixel(simd, offsets.of(bit)) {
                        self.counts[1] += 1;
                        self.insert(simd, block.pixel(bit), key, depth, drawn);
                    }
                }
            }
        }
    }

    /// Adds a ribbon of the segment with this [`key`], so deep in the pixel, to those that wait; and puts those into the pixel's list
    /// that no segment after it can come before.
    #[inline(always)]
    fn insert<S: Simd>(
        &mut self,
        simd: S,
        pixel: [u32; 2],
        of_segment: u64,
        depth: f32,
        drawn: Drawn,
    ) {
        let [x, y] = pixel.map(|n| n as usize);
        let ix = x + self.size[0] as usize * y;
        let nearest = f32::from_bits((of_segment >> 32) as u32);
        self.pixels[ix].insert(&mut self.waiting, key(depth, of_segment as u32), drawn);
        self.settle(simd, [x, y], nearest);
    }

    /// Puts those ribbons of a pixel into its list that are no farther than `nearest`.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S, [x, y]: [usize; 2], nearest: f32) {
        let ix = x + self.size[0] as usize * y;
        let (pixel, blocked) = (&mut self.pixels[ix], self.blocked.get(ix));
        if pixel.settle(simd, &mut self.waiting, blocked, nearest) {
            self.open[y] &= !(1 << x);
            self.n_open -= 1;
        }
    }

    /// The list of the tile.
    pub fn tile(
        &mut self,
        (view, beside): (&ViewUniform, &Beside),
        origin: [u32; 2],
        size: [u32; 2],
    ) -> Tile {
        let n_pixels = (size[0] * size[1]) as usize;
        let n_entries = self.pixels.iter().map(|pixel| pixel.entries.len()).sum();
        let mut tile = Tile {
            origin,
            size,
            counts: self.counts,
            has_wide: self.has_wide,
            ..Tile::default()
        };
        if n_entries == 0 && self.blocked.is_empty() {
            return tile;
        }
        tile.starts.reserve_exact(n_pixels + 1);
        tile.entries.reserve_exact(n_entries);
        for (ix, pixel) in self.pixels[..n_pixels].iter().enumerate() {
            tile.starts.push(tile.entries.len() as u32);
            let blocked = self.blocked.get(ix);
            let mut scale = 1.0;
            if pixel.is_closed && blocked.is_none() {
                // Hair is behind all that was left out.
                let left: f32 = pixel.open.iter().sum::<f32>() / PLACES as f32;
                scale = 1.0 / (1.0 - left);
            }
            tile.entries.extend_from_slice(&pixel.entries);
            if scale != 1.0 {
                let first = tile.entries.len() - pixel.entries.len();
                for entry in &mut tile.entries[first..] {
                    entry.weight *= scale;
                }
            }
            if let Some(blocked) = blocked {
                let at = [ix as u32 % size[0], ix as u32 / size[0]];
                let at = [0, 1].map(|axis: usize| (origin[axis] + at[axis]) as f32 + 0.5);
                let of_pixel = (at, ix as u32);
                blocked.entries((view, beside), of_pixel, &pixel.open, &mut tile.proxies);
            }
        }
        tile.starts.push(tile.entries.len() as u32);
        tile
    }
}

/// A part of a segment, and what it takes to find what it covers of a pixel.
struct Cover<'a> {
    piece: &'a Piece,
    /// How far from the ribbon the middle of a pixel with some coverage can be: its outermost place lies that far, over its filter.
    reach: Offset,
    /// How the offsets of a place differ from those of the middle of its pixel.
    across_at: [f32; PLACES],
    begin_at: [f32; PLACES],
    end_at: [f32; PLACES],
    /// Has it a profile over its width?
    is_wide: bool,
}

impl<'a> Cover<'a> {
    #[inline(always)]
    fn new(piece: &'a Piece) -> Cover<'a> {
        let ribbon = &piece.ribbon;
        let half_most = ribbon.half[0].max(ribbon.half[1]);
        let is_wide = half_most > 0.5 * WIDE_PX;
        let size = |at: [f32; 2]| FARTHEST * (at[0].abs() + at[1].abs());
        let end = size(ribbon.ends);
        Cover {
            piece,
            reach: Offset {
                across: half_most + size(ribbon.along) + 0.5 / PLACES_SIDE as f32,
                begin: -size(ribbon.begins),
                end: match is_wide && ribbon.is_tip {
                    true => end + BEYOND_TIP * half_most,
                    false => end,
                },
            },
            across_at: linear([-ribbon.along[1], ribbon.along[0]]),
            begin_at: linear(ribbon.begins),
            end_at: linear(ribbon.ends),
            is_wide,
        }
    }

    /// What it covers of the pixel at this offset, if anything, and how deep it is there.
    #[inline(always)]
    fn of_pixel<S: Simd>(&self, simd: S, offset: Offset) -> Option<(f32, Drawn)> {
        let Piece { ribbon, t: part } = self.piece;
        let length = offset.begin - offset.end;
        let t = if length > 1e-6 {
            (offset.begin / length).clamp(0.0, 1.0)
        } else {
            0.5
        };
        let mix = |of: [f32; 2]| of[0] + (of[1] - of[0]) * t;
        let half_width = mix(ribbon.half);
        let mut half_at = [half_width; PLACES];
        let mut tip = 0.0;
        if self.is_wide && ribbon.is_tip {
            // Seen end on it is flat.
            let reach = half_width.min(length);
            tip = BEYOND_TIP * reach;
            for (half, end_at) in half_at.iter_mut().zip(self.end_at) {
                *half *= round_tip((tip - offset.end - end_at) / reach);
            }
        }
        let mut covers = [0.0; PLACES];
        let mut sums = f32x8::splat(simd, 0.0);
        for first in [0, LANES] {
            let of = |at: &[f32; PLACES]| f32x8::from_slice(simd, &at[first..first + LANES]);
            let distance = (of(&self.across_at) + offset.across).abs();
            let inside = (of(&half_at) - distance) * PLACES_SIDE as f32 + 0.5;
            // Half open, so that a strand covers no place twice.
            let is_on = (of(&self.begin_at) + offset.begin).simd_ge(0.0)
                & (of(&self.end_at) + offset.end).simd_lt(tip);
            let inside = is_on.select(inside.max(0.0).min(1.0), f32x8::splat(simd, 0.0));
            inside.store_slice(&mut covers[first..first + LANES]);
            sums += inside;
        }
        let sum = sums.reduce_sum();
        if sum <= 0.0 {
            return None;
        }
        let mut across = ALL_ACROSS;
        if self.is_wide {
            let means = means_across(&covers, offset.across, &self.across_at, half_width);
            across = means.map(|mean| mean / sum);
        }
        let drawn = Drawn {
            t: part[0] + part[1] * t,
            across,
            alpha: mix(ribbon.coverage),
            covers,
        };
        Some((mix(ribbon.depth), drawn))
    }
}

/// Bits of the first `n` pixels of a row.
fn below(n: u32) -> u32 {
    (1 << n) - 1
}

/// Sums over the places, as far as they are covered, of where they lie across a ribbon, and of the squares. Its half
/// width, and how far the middle of the pixel is `off` the ribbon's, are px.
fn means_across(
    covers: &[f32; PLACES],
    off: f32,
    off_at: &[f32; PLACES],
    half_width: f32,
) -> [f32; 2] {
    let mut sums = [0.0; 2];
    for (cover, off_at) in covers.iter().zip(off_at) {
        let at = ((off + off_at) / half_width).clamp(-1.0, 1.0);
        sums[0] += cover * at;
        sums[1] += cover * at * at;
    }
    sums
}
