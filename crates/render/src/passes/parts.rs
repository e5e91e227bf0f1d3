//! Parts of a picture that are drawn one after the other: tiles, where it is too large for a
//! device's buffers, and in these bands, where wide strands would make a submission too long. A
//! pixel is the same in whatever parts it is drawn, but for the rounding of depths on the device.

use glam::Vec3;

use strandlight_scene::budget::{MAX_TARGET_PIXELS, MAX_TARGET_SIDE};
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::strands::Strands;

/// Longest side of a tile of a picture that is not drawn as a whole, pixels: samples, sums and
/// picture take 350 MB.
#[cfg(not(target_arch = "wasm32"))]
const TILE_SIDE: u32 = 2048;

/// Most pixels of strands that one submission draws, by estimate; a row of [`BLOCK`] pixels at
/// least. A few seconds on a software device, which waits at most a minute.
const MAX_DRAWN: u64 = 256 << 20;

/// Most pairs of a pixel and a segment that are listed together on a software device: 96 MiB, and about a second.
pub(crate) const SOFTWARE_HITS: u32 = 8 << 20;

/// The same on a GPU: 192 MiB, and as much where the entries of several bands are kept.
const MAX_HITS: u32 = 16 << 20;

/// Mean of a row up to which the hits of a pixel are listed on a software device. Mesa's driver ends a shader's loops after some
/// 65,000 rounds, and the list of a pixel that has many hits needs more.
pub(crate) const SOFTWARE_HITS_PER_PIXEL: u32 = 1000;

/// Pixels in the height of a row that the estimate is made for.
const BLOCK: u32 = 8;

/// How large the parts may be; for tests, which make them small.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PartLimits {
    /// Longest side of a tile; of none if the whole picture fits the device.
    pub tile_side: Option<u32>,
    /// Most pixels of strands in a submission.
    pub drawn: u64,
    /// Most pairs of a pixel and a segment that are listed together, or a row of pixels.
    pub hits: u32,
}

impl Default for PartLimits {
    fn default() -> Self {
        PartLimits {
            tile_side: None,
            drawn: MAX_DRAWN,
            hits: MAX_HITS,
        }
    }
}

/// A rectangle of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tile {
    pub origin: [u32; 2],
    pub extent: [u32; 2],
}

impl Tile {
    /// `view`, of which only this is drawn.
    pub fn of(&self, view: &ViewUniform) -> ViewUniform {
        ViewUniform {
            origin: self.origin,
            extent: self.extent,
            ..*view
        }
    }

    /// Copies the pixels of this tile to where they belong in a picture that is `width` wide.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn place(&self, pixels: &[[f32; 4]], width: u32, picture: &mut [[f32; 4]]) {
        let [columns, _] = self.extent.map(|n| n as usize);
        for (y, row) in pixels.chunks_exact(columns).enumerate() {
            let start = (self.origin[1] as usize + y) * width as usize + self.origin[0] as usize;
            picture[start..start + columns].copy_from_slice(row);
        }
    }
}

/// Can a device of `limits` draw pictures of `size` as a whole?
pub(crate) fn fits([width, height]: [u32; 2], limits: &wgpu::Limits) -> bool {
    let side = limits.max_texture_dimension_2d.min(MAX_TARGET_SIDE);
    let bytes = limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size);
    let pixels = u64::from(width) * u64::from(height);
    width.max(height) <= side && pixels <= u64::from(MAX_TARGET_PIXELS) && 16 * pixels <= bytes
}

/// The largest size of the same shape as `size`, about, that a device of `limits` draws as a whole.
pub(crate) fn fitting(size: [u32; 2], limits: &wgpu::Limits) -> [u32; 2] {
    let mut fitted = size;
    let mut scale = 1.0;
    while !fits(fitted, limits) && fitted != [1, 1] {
        scale *= 0.97;
        fitted = size.map(|n| ((f64::from(n) * scale) as u32).max(1));
    }
    fitted
}

/// The tiles of a picture of `size`, row by row; one if it fits.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn tiles(size: [u32; 2], limits: &wgpu::Limits, parts: &PartLimits) -> Vec<Tile> {
    let side = match parts.tile_side {
        Some(side) => [side; 2],
        None if fits(size, limits) => size,
        None => {
            let mut side = TILE_SIDE.min(limits.max_texture_dimension_2d);
            while !fits([side; 2], limits) && side > 1 {
                side /= 2;
            }
            [side; 2]
        }
    };
    let starts = |axis: usize| (0..size[axis]).step_by(side[axis].max(1) as usize);
    starts(1)
        .flat_map(|y| starts(0).map(move |x| [x, y]))
        .map(|origin| Tile {
            origin,
            extent: [0, 1].map(|axis: usize| side[axis].min(size[axis] - origin[axis])),
        })
        .collect()
}

/// The pixels of strands in a pass are not more, about.
fn pixels(strands: &Strands, view: &ViewUniform) -> f64 {
    let scale = f64::from(view.focal_px / view.near);
    scale * (strands.length + scale * strands.area)
}

/// Rows, counted from the top of the tile that `view` shows, where the bands of a pass end: each
/// with at most so many pixels of strands as `parts` says, by estimate, or one row of blocks.
pub(crate) fn bands(view: &ViewUniform, strands: &Strands, parts: &PartLimits) -> Vec<u32> {
    let height = view.extent[1];
    if pixels(strands, view) <= parts.drawn as f64 {
        return vec![height];
    }
    let mut bands = Vec::new();
    let mut sum = 0.0;
    for (block, drawn) in (0..).zip(drawn_by_block(view, strands)) {
        if block > 0 && sum + drawn > parts.drawn as f64 {
            bands.push(block * BLOCK);
            sum = 0.0;
        }
        sum += drawn;
    }
    bands.push(height);
    bands
}

/// Pixels of strands in each row of blocks of the tile that `view` shows, at most, about.
fn drawn_by_block(view: &ViewUniform, strands: &Strands) -> Vec<f64> {
    let n_blocks = view.extent[1].div_ceil(BLOCK) as usize;
    // What each row has more than the one before.
    let mut changes = vec![0.0; n_blocks + 1];
    let screen = |point: &[f32; 4]| {
        let [x, y, depth] =
            strandlight_scene::camera::screen_position(view, Vec3::from_slice(point));
        let width = (2.0 * point[3] * view.focal_px / depth.max(view.near)).max(1.0);
        ([x, y].map(f64::from), f64::from(width), depth >= view.near)
    };
    for &first in &strands.segments {
        let [(a, width_a, is_before), (b, width_b, is_b_before)] =
            [0, 1].map(|next| screen(&strands.points[first as usize + next]));
        if !(is_before && is_b_before) {
            continue;
        }
        let width = width_a.max(width_b);
        let mut sides = [0.0; 2];
        let mut rows = [0.0; 2];
        for axis in 0..2 {
            let origin = f64::from(view.origin[axis]);
            let low = a[axis].min(b[axis]) - 0.5 * width - 1.0 - origin;
            let high = a[axis].max(b[axis]) + 0.5 * width + 1.0 - origin;
            rows = [low.max(0.0), high.min(f64::from(view.extent[axis]))];
            sides[axis] = rows[1] - rows[0];
        }
        if sides.iter().any(|&side| side <= 0.0) {
            continue;
        }
        let length = f64::hypot(b[0] - a[0], b[1] - a[1]);
        let area = ((length + 1.0) * (width + 1.0)).min(sides[0] * sides[1]);
        let [start, end] = rows.map(|row| (row / f64::from(BLOCK)) as usize);
        let end = end.min(n_blocks - 1);
        let in_each = area / (end - start + 1) as f64;
        changes[start] += in_each;
        changes[end + 1] -= in_each;
    }
    changes.pop();
    let mut sum = 0.0;
    for change in &mut changes {
        sum += *change;
        *change = sum;
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use strandlight_scene::camera::{Camera, view_uniform};

    #[test]
    fn tiles_cover_every_pixel_once() {
        let limits = wgpu::Limits::default();
        for (size, tile_side, n) in [
            ([720, 480], None, 1),
            ([4096, 2160], None, 4),
            ([16_384, 8192], None, 32),
            ([1, 16_384], None, 8),
            ([70, 33], Some(32), 6),
        ] {
            let parts = PartLimits {
                tile_side,
                ..PartLimits::default()
            };
            let tiles = tiles(size, &limits, &parts);
            assert_eq!(tiles.len(), n, "{size:?}");
            let area = |tile: &Tile| u64::from(tile.extent[0]) * u64::from(tile.extent[1]);
            let total: u64 = tiles.iter().map(area).sum();
            assert_eq!(total, u64::from(size[0]) * u64::from(size[1]));
            for (ix, tile) in tiles.iter().enumerate() {
                assert!(fits(tile.extent, &limits));
                let apart = |other: &Tile| {
                    (0..2_usize).any(|axis| {
                        tile.origin[axis] + tile.extent[axis] <= other.origin[axis]
                            || other.origin[axis] + other.extent[axis] <= tile.origin[axis]
                    })
                };
                assert!(tiles[..ix].iter().all(apart));
            }
        }
    }

    #[test]
    fn a_size_is_brought_to_what_fits() {
        let limits = wgpu::Limits::default();
        assert_eq!(fitting([720, 480], &limits), [720, 480]);
        let [width, height] = fitting([16_384, 8192], &limits);
        assert!(fits([width, height], &limits) && width > 3500);
        assert!((f64::from(width) / f64::from(height) - 2.0).abs() < 0.01);
    }

    #[test]
    fn bands_hold_no_more_than_they_may() {
        // A ladder of bars across the view, twice as wide as it.
        let bars: Vec<[f32; 3]> = (0..40)
            .flat_map(|ix| {
                [
                    [-9.0, 0.2 * ix as f32 - 4.0, 0.0],
                    [9.0, 0.2 * ix as f32 - 4.0, 0.0],
                ]
            })
            .collect();
        let offsets: Vec<u32> = (0..=40).map(|ix| 2 * ix).collect();
        let strands = Strands::new(&bars, &offsets, |_, _| 2.0, true).expect("valid");
        let camera = Camera::framing(Vec3::ZERO, 4.0, 0.5);
        let view = view_uniform(&camera, &strands, [200, 100], 1.0);
        let whole = bands(&view, &strands, &PartLimits::default());
        assert_eq!(whole, [100]);
        let drawn: f64 = drawn_by_block(&view, &strands).iter().sum();
        // Each bar is a quarter of the height of the view.
        assert!((5.0..30.0).contains(&(drawn / (200.0 * 100.0))), "{drawn}");
        let parts = PartLimits {
            drawn: (drawn / 4.0) as u64,
            ..PartLimits::default()
        };
        let ends = bands(&view, &strands, &parts);
        assert!((4..=9).contains(&ends.len()), "{ends:?}");
        assert!(ends.is_sorted() && ends.last() == Some(&100));
    }
}
