//! Rasterising the ribbons with the standard four-sample pattern. Twin of
//! `shaders/pass/strands.wgsl` and of the hardware's rasteriser and depth test.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use strandlight_runtime::camera::ViewUniform;
use strandlight_runtime::sampling::{SAMPLE_POSITIONS, coverage_key, coverage_mask, pass_jitter};
use strandlight_runtime::stats::{LIGHTING_SHARE, Observer};
use strandlight_runtime::strands::Strands;

use super::project::Projected;
use super::proxies::Proxies;
use super::transmittance::mix;

/// Side of a tile in pixels; each is drawn by one thread.
const TILE: i32 = 32;

/// 1/256 px in a pixel.
const PX: i32 = 256;

/// One triangle: corners in 1/256 px with depth.
type Triangle = [([i32; 2], f32); 3];

/// Sums of all samples of every pixel: radiance, and the number of samples covered.
pub(super) fn draw(
    view: &ViewUniform,
    strands: &Strands,
    projected: &[Projected],
    radiance: &[[f32; 4]],
    proxies: &Proxies,
    passes: u32,
    observer: Observer,
) -> Vec<[f32; 4]> {
    let [width, height] = view.size.map(|n| n as i32);
    let columns = (width + TILE - 1) / TILE;
    let rows = (height + TILE - 1) / TILE;
    let bins = bin(strands, projected, [columns, rows]);
    let n_done = AtomicUsize::new(0);
    let tiles: Vec<Vec<[f32; 4]>> = bins
        .par_iter()
        .enumerate()
        .map(|(tile, segments)| {
            let origin = [tile as i32 % columns * TILE, tile as i32 / columns * TILE];
            let size = [TILE.min(width - origin[0]), TILE.min(height - origin[1])];
            let mut tile = Tile::new(origin, size);
            for pass in 0..passes {
                tile.clear();
                tile.proxies(view, proxies, pass_jitter(pass));
                tile.pass(pass, segments, strands, projected, radiance);
            }
            let done = (n_done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / bins.len() as f64;
            observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
            tile.sums
        })
        .collect();
    let mut picture = vec![[0.0; 4]; (width * height) as usize];
    for (tile, sums) in tiles.iter().enumerate() {
        let [x0, y0] = [tile as i32 % columns * TILE, tile as i32 / columns * TILE];
        let tile_width = TILE.min(width - x0) as usize;
        for (y, row) in sums.chunks_exact(tile_width).enumerate() {
            let start = ((y0 + y as i32) * width + x0) as usize;
            picture[start..start + tile_width].copy_from_slice(row);
        }
    }
    picture
}

/// Segments that may touch each tile, in order.
fn bin(strands: &Strands, projected: &[Projected], [columns, rows]: [i32; 2]) -> Vec<Vec<u32>> {
    let mut bins = vec![Vec::new(); (columns * rows) as usize];
    for (segment, &first) in strands.segments.iter().enumerate() {
        let (a, b) = (&projected[first as usize], &projected[first as usize + 1]);
        if a.coverage < 0.0 || b.coverage < 0.0 {
            continue;
        }
        let range = |axis: usize, n: i32| {
            let values = [
                a.edges[axis],
                a.edges[axis + 2],
                b.edges[axis],
                b.edges[axis + 2],
            ];
            // Jitter moves a ribbon by up to half a pixel.
            let low = values.iter().min().map_or(0, |v| v - PX) / (PX * TILE);
            let high = values.iter().max().map_or(-1, |v| v + PX);
            let high = if high < 0 { -1 } else { high / (PX * TILE) };
            low.max(0)..=high.min(n - 1)
        };
        for row in range(1, rows) {
            for column in range(0, columns) {
                bins[(row * columns + column) as usize].push(segment as u32);
            }
        }
    }
    bins
}

/// A tile's samples of the current pass, and its sums.
struct Tile {
    origin: [i32; 2],
    size: [i32; 2],
    depth: Vec<[f32; 4]>,
    color: Vec<[[f32; 4]; 4]>,
    sums: Vec<[f32; 4]>,
}

/// What shading one fragment needs of its segment.
struct Ribbon<'a> {
    segment: u32,
    /// Where the middle starts, px.
    a: [f32; 2],
    /// The direction along it over its length, so that a product gives the share of the way.
    along: [f32; 2],
    coverage: [f32; 2],
    radiance: [&'a [f32; 4]; 2],
}

impl Tile {
    fn new(origin: [i32; 2], size: [i32; 2]) -> Self {
        let n = (size[0] * size[1]) as usize;
        Tile {
            origin,
            size,
            depth: vec![[1.0; 4]; n],
            color: vec![[[0.0; 4]; 4]; n],
            sums: vec![[0.0; 4]; n],
        }
    }

    fn clear(&mut self) {
        self.depth.fill([1.0; 4]);
        self.color.fill([[0.0; 4]; 4]);
    }

    /// Draws the proxies, which come before the strands.
    fn proxies(&mut self, view: &ViewUniform, proxies: &Proxies, jitter: [i32; 2]) {
        if proxies.is_empty() {
            return;
        }
        let width = self.size[0];
        let samples = self.depth.iter_mut().zip(&mut self.color);
        for (ix, (depths, colors)) in (0..).zip(samples) {
            let pixel = [self.origin[0] + ix % width, self.origin[1] + ix / width];
            for covered in proxies.cover(view, pixel, jitter) {
                for (sample, depth) in depths.iter_mut().enumerate() {
                    if covered.mask >> sample & 1 == 1 && covered.depth < *depth {
                        (*depth, colors[sample]) = (covered.depth, covered.color);
                    }
                }
            }
        }
    }

    fn pass(
        &mut self,
        pass: u32,
        segments: &[u32],
        strands: &Strands,
        projected: &[Projected],
        radiance: &[[f32; 4]],
    ) {
        let jitter = pass_jitter(pass);
        for &segment in segments {
            let first = strands.segments[segment as usize] as usize;
            let (a, b) = (&projected[first], &projected[first + 1]);
            let middle = |p: &Projected| {
                [0, 1].map(|axis: usize| {
                    (p.edges[axis] + p.edges[axis + 2] + 2 * jitter[axis]) as f32 * (1.0 / 512.0)
                })
            };
            let (mid_a, mid_b) = (middle(a), middle(b));
            let along = [mid_b[0] - mid_a[0], mid_b[1] - mid_a[1]];
            let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-6);
            let ribbon = Ribbon {
                segment,
                a: mid_a,
                along: along.map(|x| x / squared),
                coverage: [a.coverage, b.coverage],
                radiance: [&radiance[first], &radiance[first + 1]],
            };
            let corner = |edges: [i32; 4], side: usize| {
                [edges[2 * side] + jitter[0], edges[2 * side + 1] + jitter[1]]
            };
            // Where the strand turns back on the screen its edges change sides.
            let mut edges_b = b.edges;
            let side = |e: [i32; 4]| [(e[0] - e[2]) as f32, (e[1] - e[3]) as f32];
            let (side_a, side_b) = (side(a.edges), side(b.edges));
            if side_a[0] * side_b[0] + side_a[1] * side_b[1] < 0.0 {
                edges_b = [edges_b[2], edges_b[3], edges_b[0], edges_b[1]];
            }
            let left_a = (corner(a.edges, 0), a.depth);
            let right_a = (corner(a.edges, 1), a.depth);
            let left_b = (corner(edges_b, 0), b.depth);
            let right_b = (corner(edges_b, 1), b.depth);
            self.triangle([left_a, right_a, left_b], &ribbon, pass);
            self.triangle([left_b, right_a, right_b], &ribbon, pass);
        }
        for (sum, samples) in self.sums.iter_mut().zip(&self.color) {
            for channel in 0..4 {
                sum[channel] += samples[0][channel]
                    + samples[1][channel]
                    + samples[2][channel]
                    + samples[3][channel];
            }
        }
    }

    fn triangle(&mut self, mut corners: Triangle, ribbon: &Ribbon, pass: u32) {
        let doubled_area = |c: &Triangle| {
            let [a, b, c] = c.map(|(p, _)| p.map(i64::from));
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let mut area = doubled_area(&corners);
        if area == 0 {
            return;
        }
        // Clockwise on the screen (y downwards), so that inside is where all edges are positive.
        if area < 0 {
            corners.swap(1, 2);
            area = -area;
        }
        let [p0, p1, p2] = corners.map(|(p, _)| p);
        let [z0, z1, z2] = corners.map(|(_, z)| z);
        let edges = [Edge::new(p1, p2), Edge::new(p2, p0), Edge::new(p0, p1)];
        let per_area = 1.0 / area as f32;
        let (origin, size) = (self.origin, self.size);
        let bound = |axis: usize| {
            let low = p0[axis].min(p1[axis]).min(p2[axis]).div_euclid(PX);
            let high = p0[axis].max(p1[axis]).max(p2[axis]).div_euclid(PX);
            low.max(origin[axis])..=high.min(origin[axis] + size[axis] - 1)
        };
        for y in bound(1) {
            for x in row_span(&[p0, p1, p2], y, bound(0)) {
                // Values of the edge functions at the pixel's corner; samples add a constant.
                let at = edges.map(|edge| edge.at([x * PX, y * PX]));
                let mut inside = 0_u32;
                for sample in 0..4 {
                    // One sign for all three: no branches, several samples at a time.
                    let [a, b, c] = [0, 1, 2].map(|e: usize| at[e] + edges[e].offset[sample]);
                    inside |= u32::from((a | b | c) >= 0) << sample;
                }
                if inside == 0 {
                    continue;
                }
                let z = |sample: usize| {
                    let w1 = (at[1] + edges[1].offset[sample] + edges[1].bias) as f32 * per_area;
                    let w2 = (at[2] + edges[2].offset[sample] + edges[2].bias) as f32 * per_area;
                    z0 + w1 * (z1 - z0) + w2 * (z2 - z0)
                };
                self.fragment([x, y], inside, z, ribbon, pass);
            }
        }
    }

    fn fragment(
        &mut self,
        [x, y]: [i32; 2],
        inside: u32,
        z: impl Fn(usize) -> f32,
        ribbon: &Ribbon,
        pass: u32,
    ) {
        let index = ((y - self.origin[1]) * self.size[0] + x - self.origin[0]) as usize;
        let mut visible = 0_u32;
        let mut depths = [0.0; 4];
        for (sample, depth) in depths.iter_mut().enumerate() {
            if inside >> sample & 1 == 1 {
                *depth = z(sample);
                visible |= u32::from(*depth < self.depth[index][sample]) << sample;
            }
        }
        if visible == 0 {
            return;
        }
        // How far along the segment the middle of this pixel is.
        let to = [x as f32 + 0.5 - ribbon.a[0], y as f32 + 0.5 - ribbon.a[1]];
        let along = ribbon.along;
        let t = (to[0] * along[0] + to[1] * along[1]).clamp(0.0, 1.0);
        let alpha = mix(ribbon.coverage[0], ribbon.coverage[1], t);
        let mut mask = visible;
        if alpha < 1.0 {
            let key = coverage_key(ribbon.segment, x as u32, y as u32);
            mask &= coverage_mask(alpha, pass, key);
        }
        let [a, b] = ribbon.radiance;
        let color = [
            mix(a[0], b[0], t),
            mix(a[1], b[1], t),
            mix(a[2], b[2], t),
            1.0,
        ];
        let samples = self.depth[index].iter_mut().zip(&mut self.color[index]);
        for (sample, ((to_depth, to_color), depth)) in samples.zip(depths).enumerate() {
            if mask >> sample & 1 == 1 {
                (*to_depth, *to_color) = (depth, color);
            }
        }
    }
}

/// An edge function in exact integers, with the top-left rule folded in.
#[derive(Clone, Copy)]
struct Edge {
    from: [i32; 2],
    delta: [i64; 2],
    /// Added to the value at a pixel's upper left corner by each sample, less `bias`.
    offset: [i64; 4],
    /// 1 where a sample on the edge belongs to the neighbour.
    bias: i64,
}

impl Edge {
    fn new(from: [i32; 2], to: [i32; 2]) -> Self {
        let delta = [i64::from(to[0] - from[0]), i64::from(to[1] - from[1])];
        // Clockwise with y downwards: a top edge runs to the right, a left edge upwards.
        let top_left = (delta[1] == 0 && delta[0] > 0) || delta[1] < 0;
        let bias = i64::from(!top_left);
        let offset =
            SAMPLE_POSITIONS.map(|[x, y]| delta[0] * i64::from(y) - delta[1] * i64::from(x) - bias);
        Edge {
            from,
            delta,
            offset,
            bias,
        }
    }

    fn at(&self, [x, y]: [i32; 2]) -> i64 {
        self.delta[0] * i64::from(y - self.from[1]) - self.delta[1] * i64::from(x - self.from[0])
    }
}

/// Pixels of row `y` that the triangle may touch, within `bound`.
fn row_span(
    corners: &[[i32; 2]; 3],
    y: i32,
    bound: std::ops::RangeInclusive<i32>,
) -> std::ops::RangeInclusive<i32> {
    // Cutting short rows costs more than looking at all their pixels.
    if bound.end() - bound.start() < 4 {
        return bound;
    }
    let (top, bottom) = (f64::from(y * PX), f64::from((y + 1) * PX));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for ix in 0..3 {
        let [p, q] = [corners[ix], corners[(ix + 1) % 3]].map(|p| p.map(f64::from));
        if (p[1] < top && q[1] < top) || (p[1] > bottom && q[1] > bottom) {
            continue;
        }
        // The part of this edge inside the row.
        let cut = |line: f64| p[0] + (q[0] - p[0]) * ((line - p[1]) / (q[1] - p[1]));
        for end in [p, q] {
            let x = if end[1] < top {
                cut(top)
            } else if end[1] > bottom {
                cut(bottom)
            } else {
                end[0]
            };
            low = low.min(x);
            high = high.max(x);
        }
    }
    // A unit on each side covers rounding. Infinities of an empty row saturate to an empty range.
    let low = ((low - 1.0) / f64::from(PX)).floor() as i32;
    let high = ((high + 1.0) / f64::from(PX)).floor() as i32;
    low.max(*bound.start())..=high.min(*bound.end())
}
