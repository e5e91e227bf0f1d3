//! The visibility list: which segments a pixel shows, where along them, and with what weight.
//!
//! Drawing samples finds that list again and again, a sample at a time. Here every pixel takes its
//! ribbons once, from front to back, with the share of the pixel that each covers, until hardly
//! anything of what is behind can be seen. Coverage is kept at a grid of places within the pixel,
//! so that ribbons side by side add up and ribbons behind each other hide one another; between the
//! places it is filtered, so edges are smooth. The picture then is the list times the radiance of
//! the points: no noise, and nothing to draw after an edit of the hair or the lights.
//!
//! The picture is that of [`super::raster`] with very many samples, up to the filter.

mod bins;
mod block;
mod blocked;
mod pixel;
mod places;
mod tile;

use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use strandlight_scattering::wide::{Level, dispatch};
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::strands::Strands;

use super::screen_point::{LISTED_WIDTH_PX, ScreenPoint, screen_point};
use super::triangles::{TILE, Triangles};

use bins::Bins;
pub(super) use pixel::Entry;
use tile::Scratch;
pub(super) use tile::Tile;

/// Segments that a part of the binning goes through at once.
const CHUNK: usize = 1 << 15;

/// What each pixel of a picture shows.
#[derive(Clone, Debug, Default)]
pub(super) struct VisibilityList {
    /// Tiles row by row; those that show nothing have no starts.
    pub tiles: Vec<Tile>,
    /// Pairs of a pixel and a piece of a segment within reach of each other, and of these with some coverage.
    pub counts: [u64; 2],
    /// Are there ribbons with a profile over their width?
    pub has_wide: bool,
}

/// A list that is being made, some segments and then some tiles at a time.
pub(super) struct Listing {
    points: Vec<ScreenPoint>,
    /// Of the segments, a [`CHUNK`] each, as far as they are sorted into tiles.
    bins: Vec<Bins>,
    /// Columns and rows of tiles.
    n_tiles: [u32; 2],
    tiles: Vec<Tile>,
    /// Of the meshes, once they were asked for.
    triangles: Option<Triangles>,
    /// What threads make tiles in, kept from step to step.
    scratches: Mutex<Vec<Scratch>>,
}

/// A [`Scratch`] while a thread works in it; it goes back when the thread is done.
struct Lent<'a> {
    scratch: Scratch,
    to_others: &'a Mutex<Vec<Scratch>>,
}

impl<'a> Lent<'a> {
    fn one_of(scratches: &'a Mutex<Vec<Scratch>>) -> Lent<'a> {
        let scratch = locked(scratches).pop().unwrap_or_default();
        Lent {
            scratch,
            to_others: scratches,
        }
    }
}

impl Drop for Lent<'_> {
    fn drop(&mut self) {
        locked(self.to_others).push(std::mem::take(&mut self.scratch));
    }
}

/// Nobody works with the lock held, and [`Scratch::start`] forgets what was in a scratch: one from a thread that panicked serves as well.
fn locked(scratches: &Mutex<Vec<Scratch>>) -> MutexGuard<'_, Vec<Scratch>> {
    scratches.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Listing {
    /// Projects `strands` as `view` sees them.
    pub fn new(view: &ViewUniform, strands: &Strands) -> Listing {
        let points: Vec<ScreenPoint> = strands
            .points
            .par_iter()
            .zip(strands.tangents.par_iter().zip(&strands.normals))
            .map(|(point, (tangent, normal))| ScreenPoint {
                is_tip: normal[3] == 0.0,
                ..screen_point(view, point, tangent, LISTED_WIDTH_PX)
            })
            .collect();
        Listing {
            points,
            bins: Vec::new(),
            n_tiles: view.size.map(|n| n.div_ceil(TILE)),
            tiles: Vec::new(),
            triangles: None,
            scratches: Mutex::default(),
        }
    }

    /// Sorts the next segments into tiles, or makes the next tiles, `strands` before and behind what is
    /// `beside` them; answers whether all are done.
    pub fn step(&mut self, view: &ViewUniform, strands: &Strands, beside: &Beside) -> bool {
        let n_threads = rayon::current_num_threads();
        let chunks = strands.segments.par_chunks(CHUNK);
        if self.bins.len() < chunks.len() {
            let chunks = chunks.skip(self.bins.len()).take(n_threads);
            let (points, n_tiles) = (&self.points, self.n_tiles);
            self.bins
                .par_extend(chunks.map(|segments| Bins::new(segments, points, n_tiles)));
            return false;
        }
        let [width, height] = view.size;
        let triangles = &*self
            .triangles
            .get_or_insert_with(|| Triangles::new(view, beside));
        let level = Level::new();
        let [n_across, n_down] = self.n_tiles;
        let n_tiles = (n_across * n_down) as usize;
        let end = (self.tiles.len() + TILES_AT_ONCE * n_threads).min(n_tiles);
        let scratches = &self.scratches;
        let tiles: Vec<Tile> = (self.tiles.len()..end)
            .into_par_iter()
            .map_init(
                || Lent::one_of(scratches),
                |lent, ix| {
                    let scratch = &mut lent.scratch;
                    let x = TILE * (ix as u32 % n_across);
                    let y = TILE * (ix as u32 / n_across);
                    let size = [TILE.min(width - x), TILE.min(height - y)];
                    let ribbons = self.bins.iter().flat_map(|bins| bins.of_tile(ix));
                    dispatch!(level, simd => {
                        scratch.start(view, (beside, triangles), [x, y], size);
                        scratch.ribbons.extend(ribbons);
                        scratch.fill(simd, &self.points);
                    });
                    scratch.tile((view, beside), [x, y], size)
                },
            )
            .collect();
        self.tiles.extend(tiles);
        end == n_tiles
    }

    /// The list.
    pub fn finish(&mut self) -> VisibilityList {
        let tiles = std::mem::take(&mut self.tiles);
        let sum = |ix: usize| tiles.iter().map(|tile| tile.counts[ix]).sum();
        VisibilityList {
            counts: [sum(0), sum(1)],
            has_wide: tiles.iter().any(|tile| tile.has_wide),
            tiles,
        }
    }
}

impl VisibilityList {
    /// The list of `strands` before and behind what is `beside` them as `view` sees it.
    pub fn new(view: &ViewUniform, strands: &Strands, beside: &Beside) -> VisibilityList {
        let mut listing = Listing::new(view, strands);
        while !listing.step(view, strands, beside) {}
        listing.finish()
    }

    /// Number of entries.
    pub fn n_entries(&self) -> usize {
        self.tiles.iter().map(|tile| tile.entries.len()).sum()
    }

    /// Bytes of the list.
    pub fn bytes(&self) -> u64 {
        let of_tile = |tile: &Tile| {
            size_of_val(&tile.entries[..])
                + size_of_val(&tile.starts[..])
                + size_of_val(&tile.proxies[..])
        };
        self.tiles.iter().map(|tile| of_tile(tile) as u64).sum()
    }
}

/// Tiles that are made at a time, for each thread.
const TILES_AT_ONCE: usize = 24;

#[cfg(test)]
mod tests;
