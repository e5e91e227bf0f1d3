//! What each pixel of a tile shows, from front to back.

use glam::Vec3;
use strandlight_scattering::wide::Simd;
use strandlight_scene::background::ray_direction;
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::{ViewUniform, WIDE_PX};
use strandlight_scene::proxy::entry_distance;

use super::super::screen_point::ScreenPoint;
use super::super::triangles::Triangles;
use super::bins::{Piece, Ribbon, TILE};

/// Pixels of a tile.
const TILE_PIXELS: usize = (TILE * TILE) as usize;

/// Places along a side of a pixel at which coverage is kept.
const PLACES_SIDE: usize = 4;

/// Places of a pixel.
const PLACES: usize = PLACES_SIDE * PLACES_SIDE;

/// A pixel is closed once less than this share of what lies behind shows.
const CLOSED: f32 = 1.0 / 256.0;

/// Weights below this are added to the entry before.
const LEAST_WEIGHT: f32 = 1.0 / 65_536.0;

/// How far a round tip reaches beyond the last point, as a share of its length: it covers as much as a square one.
const BEYOND_TIP: f32 = 1.0 - std::f32::consts::FRAC_PI_4;

/// No proxy is there.
const NONE: u32 = u32::MAX;

/// Share of a pixel that a segment gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Entry {
    /// The segment's first point; the second is the next one.
    pub first: u32,
    /// Share of the way to the second point, unorm16.
    t: u16,
    /// Mean of the places across the ribbon that the pixel shows, snorm8: -1 at the left edge, 1 at the right one.
    across: i8,
    /// Mean of their squares, unorm8.
    across_2: u8,
    /// Share of the pixel's colour.
    pub weight: f32,
}

/// Means of places across a narrow ribbon, and of their squares: all of its width.
const ALL_ACROSS: [f32; 2] = [0.0, 1.0 / 3.0];

impl Entry {
    /// Share of the way to the second point, 0..=1.
    pub fn t(&self) -> f32 {
        f32::from(self.t) * (1.0 / 65_535.0)
    }

    /// Means of the places across the ribbon, -1..=1, and of their squares.
    pub fn across(&self) -> [f32; 2] {
        [
            f32::from(self.across) * (1.0 / 127.0),
            f32::from(self.across_2) * (1.0 / 255.0),
        ]
    }
}

/// Share of a pixel that a proxy gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProxyEntry {
    /// Pixel of the tile.
    pub pixel: u32,
    /// Which proxy, or from their number on, which triangle of the meshes.
    pub surface: u32,
    /// Where it is hit, cm.
    pub position: [f32; 3],
    /// Share of the pixel's colour.
    pub weight: f32,
}

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

/// A ribbon in a pixel, until nothing can come before it any more.
#[derive(Clone, Copy)]
struct Pending {
    depth: f32,
    first: u32,
    t: f32,
    /// Means over the width, see [`Entry`].
    across: [f32; 2],
    alpha: f32,
    /// Share of each place's surroundings that the ribbon covers.
    covers: [f32; PLACES],
}

/// A pixel while its list is made.
#[derive(Clone)]
struct Pixel {
    /// Share of each place that nothing covers yet.
    open: [f32; PLACES],
    /// Sorted by depth, then by point; those before `done` are in the list.
    pending: Vec<Pending>,
    done: usize,
    entries: Vec<Entry>,
    is_closed: bool,
}

/// What a proxy hides of a pixel.
#[derive(Clone, Copy)]
struct Blocked {
    /// Depth of the nearest proxy at each place; more than any hair's where there is none.
    depth: [f32; PLACES],
    /// Which it is: [`ProxyEntry::surface`].
    surface: [u32; PLACES],
}

/// What the threads make tiles in.
#[derive(Default)]
pub(super) struct Scratch {
    /// [`super::bins::key`] of those that may be seen.
    pub ribbons: Vec<u64>,
    pixels: Vec<Pixel>,
    blocked: Vec<Blocked>,
    origin: [u32; 2],
    size: [u32; 2],
    n_open: usize,
    counts: [u64; 2],
    has_wide: bool,
}

/// Where a place lies from the middle of its pixel, px.
fn place(ix: usize) -> [f32; 2] {
    let along = |n: usize| (n as f32 + 0.5) / PLACES_SIDE as f32 - 0.5;
    [along(ix % PLACES_SIDE), along(ix / PLACES_SIDE)]
}

impl Scratch {
    pub fn start(
        &mut self,
        view: &ViewUniform,
        (beside, triangles): (&Beside, &Triangles),
        origin: [u32; 2],
        size: [u32; 2],
    ) {
        let fresh = || Pixel {
            open: [1.0; PLACES],
            pending: Vec::new(),
            done: 0,
            entries: Vec::new(),
            is_closed: false,
        };
        self.pixels.resize_with(TILE_PIXELS, fresh);
        for pixel in &mut self.pixels {
            pixel.open = [1.0; PLACES];
            pixel.pending.clear();
            pixel.done = 0;
            pixel.entries.clear();
            pixel.is_closed = false;
        }
        (self.origin, self.size) = (origin, size);
        self.n_open = (size[0] * size[1]) as usize;
        self.counts = [0; 2];
        self.has_wide = false;
        self.ribbons.clear();
        self.blocked.clear();
        if !beside.is_empty() {
            self.block(view, beside, triangles);
        }
    }

    /// Finds which proxies are seen where; none leaves no entries.
    fn block(&mut self, view: &ViewUniform, beside: &Beside, triangles: &Triangles) {
        let eye = Vec3::from(view.eye);
        let mut is_any = false;
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let mut pixel = Blocked {
                    depth: [f32::INFINITY; PLACES],
                    surface: [NONE; PLACES],
                };
                let middle = [self.origin[0] + x, self.origin[1] + y].map(|n| n as f32 + 0.5);
                let n_places = if beside.records().n > 0 { PLACES } else { 0 };
                for ix in 0..n_places {
                    let [dx, dy] = place(ix);
                    let direction = ray_direction(view, middle[0] + dx, middle[1] + dy);
                    let away = direction.dot(Vec3::from(view.forward));
                    for (proxy, record) in beside.records().list().iter().enumerate() {
                        let distance = entry_distance(record, eye, direction);
                        let depth = (distance * away - view.near) / (view.far - view.near);
                        if distance > 0.0 && depth < pixel.depth[ix] {
                            pixel.depth[ix] = depth;
                            pixel.surface[ix] = proxy as u32;
                            is_any = true;
                        }
                    }
                }
                self.blocked.push(pixel);
            }
        }
        for (triangle, bounds) in triangles.near(self.origin) {
            is_any |= self.block_by_triangle(view, beside, triangles, triangle, bounds);
        }
        if !is_any {
            self.blocked.clear();
        }
    }

    /// Adds a triangle; answers whether it is seen.
    fn block_by_triangle(
        &mut self,
        view: &ViewUniform,
        beside: &Beside,
        triangles: &Triangles,
        triangle: u32,
        bounds: [[f32; 2]; 2],
    ) -> bool {
        let surface = beside.records().n + triangle;
        let pixels = |axis: usize| {
            let (origin, size) = (self.origin[axis] as f32, self.size[axis] as f32);
            let [low, high] = bounds[axis].map(|x| (x - origin).floor());
            low.clamp(0.0, size) as u32..(high + 1.0).clamp(0.0, size) as u32
        };
        let (columns, rows) = (pixels(0), pixels(1));
        let mut is_any = false;
        for y in rows {
            for x in columns.clone() {
                let middle = [self.origin[0] + x, self.origin[1] + y].map(|n| n as f32 + 0.5);
                let pixel = &mut self.blocked[(x + self.size[0] * y) as usize];
                for ix in 0..PLACES {
                    let [dx, dy] = place(ix);
                    let Some(depth) = triangles.depth(triangle, [middle[0] + dx, middle[1] + dy])
                    else {
                        continue;
                    };
                    let depth = (depth - view.near) / (view.far - view.near);
                    if depth < pixel.depth[ix] {
                        pixel.depth[ix] = depth;
                        pixel.surface[ix] = surface;
                        is_any = true;
                    }
                }
            }
        }
        is_any
    }

    /// Takes the ribbons from front to back.
    #[inline(always)]
    pub fn fill<S: Simd>(&mut self, simd: S, points: &[ScreenPoint]) {
        simd.vectorize(
            #[inline(always)]
            || {
                self.ribbons.sort_unstable();
                let ribbons = std::mem::take(&mut self.ribbons);
                for &key in &ribbons {
                    if self.n_open == 0 {
                        break;
                    }
                    let nearest = f32::from_bits((key >> 32) as u32);
                    let first = key as u32;
                    let (a, b) = (&points[first as usize], &points[first as usize + 1]);
                    for piece in Piece::of(a, b) {
                        self.draw(&piece, first, nearest);
                    }
                }
                self.ribbons = ribbons;
                let n_pixels = (self.size[0] * self.size[1]) as usize;
                for ix in 0..n_pixels {
                    self.settle(ix, f32::INFINITY);
                }
            },
        );
    }

    /// Adds a part of a segment to the pixels it touches. No segment after it is nearer than `nearest`.
    #[inline(always)]
    fn draw(&mut self, piece: &Piece, first: u32, nearest: f32) {
        let ribbon = &piece.ribbon;
        let Ribbon { along, half, .. } = *ribbon;
        let is_wide = half[0].max(half[1]) > 0.5 * WIDE_PX;
        self.has_wide |= is_wide;
        let reach = half[0].max(half[1]) + 0.5 * (along[0].abs() + along[1].abs());
        let bound = |axis: usize| {
            let [low, high] = ribbon.range(axis);
            let (origin, size) = (self.origin[axis] as f32, self.size[axis] as f32);
            let low = (low - origin).floor().clamp(0.0, size);
            let high = ((high - origin).floor() + 1.0).clamp(0.0, size);
            (low as i32, high as i32)
        };
        let ((left, right), (top, bottom)) = (bound(0), bound(1));
        // How each of the three linear functions changes from the middle of a pixel to a place.
        let mut off_at = [0.0; PLACES];
        let mut from_begin = [0.0; PLACES];
        let mut to_end = [0.0; PLACES];
        for ix in 0..PLACES {
            let [x, y] = place(ix);
            off_at[ix] = along[0] * y - along[1] * x;
            from_begin[ix] = ribbon.begins[0] * x + ribbon.begins[1] * y;
            to_end[ix] = ribbon.ends[0] * x + ribbon.ends[1] * y;
        }
        for y in top..bottom {
            let py = (self.origin[1] as i32 + y) as f32 + 0.5;
            let (mut x_0, mut x_1) = (left, right);
            if along[1].abs() > 0.01 {
                // Where the middle of the ribbon crosses this row.
                let middle = ribbon.a[0] + (py - ribbon.a[1]) * (along[0] / along[1]);
                let wide = reach / along[1].abs();
                let from = middle - wide - 0.5 - self.origin[0] as f32;
                x_0 = x_0.max(from.ceil() as i32);
                x_1 = x_1.min((from + 2.0 * wide + 1.0).ceil() as i32);
            }
            for x in x_0..x_1 {
                let ix = (x + self.size[0] as i32 * y) as usize;
                self.counts[0] += 1;
                if self.pixels[ix].is_closed {
                    continue;
                }
                let px = (self.origin[0] as i32 + x) as f32 + 0.5;
                let off = ribbon.off([px, py]);
                if off.abs() > reach {
                    continue;
                }
                let begin =
                    ribbon.begins[0] * (px - ribbon.a[0]) + ribbon.begins[1] * (py - ribbon.a[1]);
                let end = ribbon.ends[0] * (px - ribbon.b[0]) + ribbon.ends[1] * (py - ribbon.b[1]);
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
                        *half *= round((end_at - end - to_end) / reach);
                    }
                }
                let mut covers = [0.0; PLACES];
                let mut sum = 0.0;
                for place in 0..PLACES {
                    let distance = (off + off_at[place]).abs();
                    let inside =
                        ((half_at[place] - distance) * PLACES_SIDE as f32 + 0.5).clamp(0.0, 1.0);
                    // Half open, so that a strand covers no place twice.
                    let is_on = (begin + from_begin[place] >= 0.0) & (end + to_end[place] < end_at);
                    covers[place] = if is_on { inside } else { 0.0 };
                }
                for cover in covers {
                    sum += cover;
                }
                if sum <= 0.0 {
                    continue;
                }
                self.counts[1] += 1;
                let mut across = ALL_ACROSS;
                if is_wide {
                    let whole = half[0] + (half[1] - half[0]) * t;
                    across = means_across(&covers, off, &off_at, whole).map(|mean| mean / sum);
                }
                let pending = Pending {
                    depth: ribbon.depth[0] + (ribbon.depth[1] - ribbon.depth[0]) * t,
                    first,
                    t: piece.t[0] + piece.t[1] * t,
                    across,
                    alpha: ribbon.coverage[0] + (ribbon.coverage[1] - ribbon.coverage[0]) * t,
                    covers,
                };
                self.pixels[ix].insert(pending);
                self.settle(ix, nearest);
            }
        }
    }

    /// Puts those pending ribbons of a pixel into its list that are no farther than `nearest`.
    #[inline(always)]
    fn settle(&mut self, ix: usize, nearest: f32) {
        let pixel = &mut self.pixels[ix];
        let blocked = self.blocked.get(ix);
        while pixel.done < pixel.pending.len() && !pixel.is_closed {
            let Pending {
                depth,
                first,
                t,
                across,
                alpha,
                covers,
            } = pixel.pending[pixel.done];
            if depth > nearest {
                return;
            }
            pixel.done += 1;
            let (mut weight, mut left) = (0.0, 0.0);
            for (place, (open, covers)) in pixel.open.iter_mut().zip(covers).enumerate() {
                if blocked.is_some_and(|blocked| depth > blocked.depth[place]) {
                    continue;
                }
                let share = *open * (covers * alpha);
                weight += share;
                *open -= share;
                left += *open;
            }
            let weight = weight * (1.0 / PLACES as f32);
            pixel.add(first, t, across, weight);
            if left < CLOSED * PLACES as f32 {
                pixel.is_closed = true;
                self.n_open -= 1;
            }
        }
        if pixel.is_closed || pixel.done == pixel.pending.len() {
            pixel.pending.clear();
            pixel.done = 0;
        }
    }

    /// The list of the tile.
    pub fn tile(&mut self, view: &ViewUniform, origin: [u32; 2], size: [u32; 2]) -> Tile {
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
            let scaled = pixel.entries.iter().map(|entry| Entry {
                weight: scale * entry.weight,
                ..*entry
            });
            tile.entries.extend(scaled);
            if let Some(blocked) = blocked {
                let at = [ix as u32 % size[0], ix as u32 / size[0]];
                let at = [0, 1].map(|axis: usize| (origin[axis] + at[axis]) as f32 + 0.5);
                blocked.entries(view, at, ix as u32, &pixel.open, &mut tile.proxies);
            }
        }
        tile.starts.push(tile.entries.len() as u32);
        tile
    }
}

/// Width of a round tip at a share of its length from its end, 0..=1 of the whole.
fn round(from_end: f32) -> f32 {
    let from_middle = 1.0 - from_end.clamp(0.0, 1.0);
    (1.0 - from_middle * from_middle).sqrt()
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

impl Pixel {
    #[inline(always)]
    fn insert(&mut self, new: Pending) {
        let mut ix = self.pending.len();
        let is_after =
            |a: &Pending| a.depth > new.depth || a.depth == new.depth && a.first > new.first;
        while ix > self.done && is_after(&self.pending[ix - 1]) {
            ix -= 1;
        }
        self.pending.insert(ix, new);
    }

    #[inline(always)]
    fn add(&mut self, first: u32, t: f32, across: [f32; 2], weight: f32) {
        if weight <= 0.0 {
            return;
        }
        if weight < LEAST_WEIGHT
            && let Some(before) = self.entries.last_mut()
        {
            before.weight += weight;
            return;
        }
        self.entries.push(Entry {
            first,
            t: (t * 65_535.0 + 0.5) as i32 as u16,
            across: (across[0] * 127.0).round() as i8,
            across_2: (across[1] * 255.0 + 0.5) as u8,
            weight,
        });
    }
}

impl Blocked {
    /// Adds the proxies that the `open` places of a pixel show.
    fn entries(
        &self,
        view: &ViewUniform,
        at: [f32; 2],
        pixel: u32,
        open: &[f32; PLACES],
        entries: &mut Vec<ProxyEntry>,
    ) {
        let eye = Vec3::from(view.eye);
        let mut seen = self.surface;
        seen.sort_unstable();
        let mut last = NONE;
        for surface in seen {
            if surface == last || surface == NONE {
                continue;
            }
            last = surface;
            let (mut weight, mut position) = (0.0, Vec3::ZERO);
            for (ix, &open) in open.iter().enumerate() {
                if self.surface[ix] == surface && open > 0.0 {
                    let [dx, dy] = place(ix);
                    let direction = ray_direction(view, at[0] + dx, at[1] + dy);
                    let away = direction.dot(Vec3::from(view.forward));
                    let depth = view.near + self.depth[ix] * (view.far - view.near);
                    weight += open;
                    position += open * (eye + direction * (depth / away));
                }
            }
            if weight > 0.0 {
                entries.push(ProxyEntry {
                    pixel,
                    surface,
                    position: (position / weight).to_array(),
                    weight: weight / PLACES as f32,
                });
            }
        }
    }
}
