//! What each pixel of a tile shows, from front to back.

use strandlight_scattering::wide::Simd;
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::{ViewUniform, WIDE_PX};

use super::super::pieces::{BEYOND_TIP, round_tip};
use super::super::screen_point::ScreenPoint;
use super::super::triangles::TILE;
use super::super::triangles::Triangles;
use super::bins::{Piece, Ribbon, key};
use super::blocked::{Blocked, ProxyEntry, block};
use super::pixel::{Drawn, Entry, Pixel, Waiting};
use super::places::{FARTHEST, PLACES, PLACES_SIDE, linear, sum};

/// Pixels of a tile.
const TILE_PIXELS: usize = (TILE * TILE) as usize;

// Rows are bits of a word.
const _: () = assert!(TILE < 32);

/// Segments whose ends are fetched at a time: fetching one does not wait for the other.
const FETCHED: usize = 16;

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
    /// Pairs of a pixel and a segment that were looked at, and of these with some coverage.
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
        self.ribbons.sort_unstable();
        let ribbons = std::mem::take(&mut self.ribbons);
        let mut ends = std::mem::take(&mut self.ends);
        for keys in ribbons.chunks(FETCHED) {
            if self.n_open == 0 {
                break;
            }
            let firsts = keys.iter().map(|key| *key as u32 as usize);
            ends.clear();
            ends.extend(firsts.map(|first| [points[first], points[first + 1]]));
            for (key, [a, b]) in keys.iter().zip(&ends) {
                let nearest = f32::from_bits((key >> 32) as u32);
                let Some(ribbon) = Ribbon::new(a, b) else {
                    continue;
                };
                let n_pieces = ribbon.n_pieces();
                let whole = Piece {
                    ribbon,
                    t: [0.0, 1.0],
                };
                for ix in 0..n_pieces {
                    let piece = match n_pieces {
                        1 => Some(whole),
                        _ => Ribbon::piece(a, b, ix, n_pieces),
                    };
                    if let Some(piece) = piece {
                        self.draw(simd, &piece, *key as u32, nearest);
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

    /// Adds a part of a segment to the pixels it touches. No segment after it is nearer than `nearest`.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, piece: &Piece, first: u32, nearest: f32) {
        let ribbon = &piece.ribbon;
        let Ribbon { along, half, .. } = *ribbon;
        let half_most = half[0].max(half[1]);
        let is_wide = half_most > 0.5 * WIDE_PX;
        self.has_wide |= is_wide;
        let bound = |axis: usize| {
            let [low, high] = ribbon.range(axis);
            let (origin, size) = (self.origin[axis] as f32, self.size[axis] as f32);
            let low = (low - origin).floor().clamp(0.0, size);
            let high = ((high - origin).floor() + 1.0).clamp(0.0, size);
            (low as i32, high as i32)
        };
        let ((left, right), (top, bottom)) = (bound(0), bound(1));
        // How each of the three linear functions changes from the middle of a pixel to a place.
        let off_at = linear([-along[1], along[0]]);
        let from_begin = linear(ribbon.begins);
        let to_end = linear(ribbon.ends);
        // How far from its middle a pixel can be covered: in the outermost place, over its filter.
        let size = |at: [f32; 2]| FARTHEST * (at[0].abs() + at[1].abs());
        let reach = half_most + size(along) + 0.5 / PLACES_SIDE as f32;
        let (before, beyond) = (-size(ribbon.begins), size(ribbon.ends));
        let beyond = match is_wide && ribbon.is_tip {
            true => beyond + BEYOND_TIP * half_most,
            false => beyond,
        };
        let is_steep = along[1].abs() > 0.01;
        let (slope, wide) = (along[0] / along[1], reach / along[1].abs());
        for y in top..bottom {
            let mut open = self.open[y as usize];
            if open == 0 {
                continue;
            }
            let py = (self.origin[1] as i32 + y) as f32 + 0.5;
            let (mut x_0, mut x_1) = (left, right);
            if is_steep {
                // Where the middle of the ribbon crosses this row.
                let middle = ribbon.a[0] + (py - ribbon.a[1]) * slope;
                let from = middle - wide - 0.5 - self.origin[0] as f32;
                x_0 = x_0.max(from.ceil() as i32);
                x_1 = x_1.min((from + 2.0 * wide + 1.0).ceil() as i32);
            }
            if x_0 >= x_1 {
                continue;
            }
            open &= below(x_1 as u32) & !below(x_0 as u32);
            while open != 0 {
                let x = open.trailing_zeros();
                open &= open - 1;
                self.counts[0] += 1;
                let px = (self.origin[0] + x) as f32 + 0.5;
                let off = ribbon.off([px, py]);
                let begin =
                    ribbon.begins[0] * (px - ribbon.a[0]) + ribbon.begins[1] * (py - ribbon.a[1]);
                let end = ribbon.ends[0] * (px - ribbon.b[0]) + ribbon.ends[1] * (py - ribbon.b[1]);
                if off.abs() > reach || begin < before || end > beyond {
                    continue;
                }
                let length = begin - end;
                let t = if length > 1e-6 {
                    (begin / length).clamp(0.0, 1.0)
                } else {
                    0.5
                };
                let half_width = half[0] + (half[1] - half[0]) * t;
                let mut half_at = [half_width; PLACES];
                let mut end_at = 0.0;
                if is_wide && ribbon.is_tip {
                    // Seen end on it is flat.
                    let reach = half_width.min(length);
                    end_at = BEYOND_TIP * reach;
                    for (half, to_end) in half_at.iter_mut().zip(to_end) {
                        *half *= round_tip((end_at - end - to_end) / reach);
                    }
                }
                let mut covers = [0.0; PLACES];
                for place in 0..PLACES {
                    let distance = (off + off_at[place]).abs();
                    let inside =
                        ((half_at[place] - distance) * PLACES_SIDE as f32 + 0.5).clamp(0.0, 1.0);
                    // Half open, so that a strand covers no place twice.
                    let is_on = (begin + from_begin[place] >= 0.0) & (end + to_end[place] < end_at);
                    covers[place] = if is_on { inside } else { 0.0 };
                }
                let sum = sum(simd, &covers);
                if sum <= 0.0 {
                    continue;
                }
                self.counts[1] += 1;
                let mut across = ALL_ACROSS;
                if is_wide {
                    across = means_across(&covers, off, &off_at, half_width).map(|mean| mean / sum);
                }
                let depth = ribbon.depth[0] + (ribbon.depth[1] - ribbon.depth[0]) * t;
                let drawn = Drawn {
                    t: piece.t[0] + piece.t[1] * t,
                    across,
                    alpha: ribbon.coverage[0] + (ribbon.coverage[1] - ribbon.coverage[0]) * t,
                    covers,
                };
                let at = [x as usize, y as usize];
                let ix = at[0] + self.size[0] as usize * at[1];
                self.pixels[ix].insert(&mut self.waiting, key(depth, first), drawn);
                self.settle(simd, at, nearest);
            }
        }
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

/// Bits of the first `n` pixels of a row.
fn below(n: u32) -> u32 {
    (1 << n) - 1
}

/// Sums over the places, as far as they are covered, of where they lie across a ribbon, and of the squares. Its half
/// width and how far its middle is `off` the middle of the pixel are px.
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
