//! Rasterising the ribbons with the standard four-sample pattern. Twin of
//! `shaders/pass/strands.wgsl` and of the hardware's rasteriser and depth test.
//!
//! The picture is halved until its parts are small and few segments touch each; a part takes these
//! from front to back, and no more once all its samples are nearer than the next one. So what is
//! drawn is about what is seen, however wide the ribbons are. Of equally deep samples the segment
//! of the lower order is seen, whatever comes first: neither the parts nor the order change a bit.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use strandlight_scene::camera::{ViewUniform, WIDE_PX};
use strandlight_scene::sampling::{PASS_SAMPLES, coverage_key, coverage_mask, pass_jitter};
use strandlight_scene::stats::{LIGHTING_SHARE, Observer};
use strandlight_scene::strands::Strands;

use super::along_segments::{Along, along_segment};
use super::project::Projected;
use super::proxies::Proxies;
use super::radiance::{Radiance, profile_factors};
use super::transmittance::mix;
use ribbons::{Edge, PX, Rect, row_span};

pub(super) use ribbons::{Ribbon, ribbons};

mod ribbons;

/// Longest side of a tile in pixels; each is drawn by one thread.
const TILE: i32 = 32;

/// Longest side of a tile that is not divided however many segments touch it.
const LEAST_TILE: i32 = 8;

/// Most segments of a tile that is larger than that.
const MANY: usize = 4096;

/// Segments drawn before a tile is looked at for how far its samples still see.
const LOOK_EVERY: usize = 64;

/// Interpolation may bring a depth out of the range of the ribbon's ends by this much.
const DEPTH_ROUNDING: f32 = 1e-6;

/// One triangle: corners in 1/256 px with depth.
type Triangle = [([i32; 2], f32); 3];

/// What drawing made.
pub(super) struct Drawn {
    /// Sums of all samples of every pixel: radiance, and the number of samples covered.
    pub sums: Vec<[f32; 4]>,
    /// Pixels of triangles that were looked at, in all passes.
    pub visited: u64,
}

/// All that a tile is drawn of.
struct Hair<'a> {
    view: &'a ViewUniform,
    strands: &'a Strands,
    projected: &'a [Projected],
    radiance: &'a Radiance,
    /// Of wide strands over their width.
    even: Option<[f32; 4]>,
    proxies: &'a Proxies,
    /// The segments in the picture, from front to back.
    ribbons: &'a [Ribbon],
    samples: u32,
}

/// Draws `samples` a pixel of the strands in a view, with their [`ribbons`].
pub(super) fn draw(
    (view, strands, projected, ribbons): (&ViewUniform, &Strands, &[Projected], &[Ribbon]),
    (radiance, even): (&Radiance, Option<[f32; 4]>),
    proxies: &Proxies,
    samples: u32,
    observer: Observer,
) -> Drawn {
    let hair = Hair {
        view,
        strands,
        projected,
        radiance,
        even,
        proxies,
        ribbons,
        samples,
    };
    hair.draw([TILE, LEAST_TILE], observer)
}

impl Hair<'_> {
    /// Draws tiles of the first side at most, and of the second where many segments are.
    fn draw(&self, sides: [i32; 2], observer: Observer) -> Drawn {
        let size = self.view.size.map(|n| n as i32);
        let n_pixels = self.view.size.map(|n| n as usize).iter().product();
        let picture = Mutex::new(vec![[0.0; 4]; n_pixels]);
        let (n_done, visited) = (AtomicUsize::new(0), AtomicU64::new(0));
        let take = |tile: Tile| {
            visited.fetch_add(tile.visited, Ordering::Relaxed);
            let mut picture = picture.lock().unwrap_or_else(PoisonError::into_inner);
            let Rect { origin, size: of } = tile.rect;
            for (y, row) in tile.sums.chunks_exact(of[0] as usize).enumerate() {
                let start = (origin[1] as usize + y) * size[0] as usize + origin[0] as usize;
                picture[start..start + row.len()].copy_from_slice(row);
            }
            drop(picture);
            let done = n_done.fetch_add(tile.sums.len(), Ordering::Relaxed) + tile.sums.len();
            let done = done as f64 / n_pixels as f64;
            observer(LIGHTING_SHARE + (1.0 - LIGHTING_SHARE) * done);
        };
        let origin = [0, 0];
        let all = (0..self.ribbons.len() as u32).collect();
        self.divide(Rect { origin, size }, all, sides, &take);
        Drawn {
            sums: picture.into_inner().unwrap_or_else(PoisonError::into_inner),
            visited: visited.into_inner(),
        }
    }

    /// Draws the part `rect` of the picture, which the segments `from` may touch.
    fn divide(&self, rect: Rect, from: Vec<u32>, sides: [i32; 2], take: &(impl Fn(Tile) + Sync)) {
        let side = rect.size[0].max(rect.size[1]);
        if side <= sides[0] && (from.len() <= MANY || side <= sides[1]) {
            take(self.tile(rect, &from));
            return;
        }
        let [one, other] = rect.halves();
        let (a, b) = rayon::join(
            || self.touching(&one, &from),
            || self.touching(&other, &from),
        );
        drop(from);
        rayon::join(
            || self.divide(one, a, sides, take),
            || self.divide(other, b, sides, take),
        );
    }

    /// Those of `from` that may be seen in `rect`, in order.
    fn touching(&self, rect: &Rect, from: &[u32]) -> Vec<u32> {
        let mut found = Vec::new();
        let mut behind = f32::INFINITY;
        for &ix in from {
            let ribbon = &self.ribbons[ix as usize];
            if ribbon.nearest() > behind {
                // So are all that follow.
                break;
            }
            if !ribbon.may_touch(rect) {
                continue;
            }
            found.push(ix);
            if ribbon.covers(rect) {
                behind = behind.min(ribbon.farthest() + DEPTH_ROUNDING);
            }
        }
        found
    }

    fn tile(&self, rect: Rect, ribbons: &[u32]) -> Tile {
        let mut tile = Tile::new(rect);
        for pass in 0..self.samples.div_ceil(PASS_SAMPLES) {
            tile.clear();
            tile.proxies(self.view, self.proxies, pass_jitter(pass));
            tile.pass(pass, ribbons, self);
            let left = self.samples - PASS_SAMPLES * pass;
            tile.add(left.min(PASS_SAMPLES) as usize);
        }
        tile
    }
}

/// A tile's samples of the current pass, and its sums.
struct Tile {
    rect: Rect,
    depth: Vec<[f32; 4]>,
    /// Order of the ribbon that is seen; 0 as well where there is none.
    owner: Vec<[u32; 4]>,
    color: Vec<[[f32; 4]; 4]>,
    sums: Vec<[f32; 4]>,
    /// Pixels of triangles that were looked at.
    visited: u64,
}

/// What shading one fragment needs of its segment.
struct Spine<'a> {
    segment: u32,
    /// See [`Ribbon`].
    order: u32,
    part: [f32; 2],
    /// Where the middle starts, px.
    a: [f32; 2],
    /// The direction along it over its length, so that a product gives the share of the way.
    along: [f32; 2],
    coverage: [f32; 2],
    radiance: [&'a [f32; 4]; 2],
    /// Of narrow lights about either end.
    narrow: Option<[&'a Along; 2]>,
    /// Where the segment is wide: half its width at the ends, px, and [`Hair::even`].
    wide: Option<([f32; 2], [f32; 4])>,
}

impl Tile {
    fn new(rect: Rect) -> Self {
        let n = (rect.size[0] * rect.size[1]) as usize;
        Tile {
            rect,
            depth: vec![[1.0; 4]; n],
            owner: vec![[0; 4]; n],
            color: vec![[[0.0; 4]; 4]; n],
            sums: vec![[0.0; 4]; n],
            visited: 0,
        }
    }

    fn clear(&mut self) {
        self.depth.fill([1.0; 4]);
        self.owner.fill([0; 4]);
        self.color.fill([[0.0; 4]; 4]);
    }

    /// Adds the first `n` samples of every pixel to the sums.
    fn add(&mut self, n: usize) {
        for (sum, samples) in self.sums.iter_mut().zip(&self.color) {
            for channel in 0..4 {
                let [first, others @ ..] = samples.map(|sample| sample[channel]);
                sum[channel] += others[..n - 1].iter().fold(first, |a, b| a + b);
            }
        }
    }

    /// Depth of the farthest sample.
    fn farthest(&self) -> f32 {
        let depths = self.depth.as_flattened().iter();
        depths.fold(0.0, |a: f32, &b| if a < b { b } else { a })
    }

    /// Draws the proxies, which come before the strands.
    fn proxies(&mut self, view: &ViewUniform, proxies: &Proxies, jitter: [i32; 2]) {
        if proxies.is_empty() {
            return;
        }
        let Rect { origin, size } = self.rect;
        let width = size[0];
        let samples = self.depth.iter_mut().zip(&mut self.color);
        for (ix, (depths, colors)) in (0..).zip(samples) {
            let pixel = [origin[0] + ix % width, origin[1] + ix / width];
            for covered in proxies.cover(view, pixel, jitter) {
                for (sample, depth) in depths.iter_mut().enumerate() {
                    if covered.mask >> sample & 1 == 1 && covered.depth < *depth {
                        (*depth, colors[sample]) = (covered.depth, covered.color);
                    }
                }
            }
        }
    }

    fn pass(&mut self, pass: u32, ribbons: &[u32], hair: &Hair) {
        let jitter = pass_jitter(pass);
        for (ix, &ribbon) in ribbons.iter().enumerate() {
            let ribbon = &hair.ribbons[ribbon as usize];
            let is_time = ix > 0 && ix % LOOK_EVERY == 0;
            if is_time && ribbon.nearest() > self.farthest() + DEPTH_ROUNDING {
                // So are all that follow.
                break;
            }
            let first = hair.strands.segments[ribbon.segment as usize] as usize;
            let (a, b) = (&hair.projected[first], &hair.projected[first + 1]);
            let corners = ribbon.corners.map(|[x, y]| [x + jitter[0], y + jitter[1]]);
            let [left_a, right_a, right_b, left_b] = corners;
            let middle = |left: [i32; 2], right: [i32; 2]| {
                [0, 1].map(|axis: usize| (left[axis] + right[axis]) as f32 * (1.0 / 512.0))
            };
            let (mid_a, mid_b) = (middle(left_a, right_a), middle(left_b, right_b));
            let along = [mid_b[0] - mid_a[0], mid_b[1] - mid_a[1]];
            let squared = (along[0] * along[0] + along[1] * along[1]).max(1e-6);
            let half = |p: &Projected| {
                let [x, y] = [0, 1].map(|axis: usize| (p.edges[axis] - p.edges[axis + 2]) as f32);
                (x * x + y * y).sqrt() * (0.5 / PX as f32)
            };
            let half = [half(a), half(b)];
            let is_wide = half[0].max(half[1]) > 0.5 * WIDE_PX;
            let spine = Spine {
                wide: hair.even.filter(|_| is_wide).map(|even| (half, even)),
                segment: ribbon.segment,
                order: ribbon.order,
                part: ribbon.part,
                a: mid_a,
                along: along.map(|x| x / squared),
                coverage: [a.coverage, b.coverage],
                radiance: [&hair.radiance.at[first], &hair.radiance.at[first + 1]],
                narrow: hair.radiance.along_from(first),
            };
            let [near, far] = ribbon.depth;
            let [left_a, right_a] = [left_a, right_a].map(|at| (at, near));
            let [right_b, left_b] = [right_b, left_b].map(|at| (at, far));
            self.triangle([left_a, right_a, left_b], &spine, pass);
            self.triangle([left_b, right_a, right_b], &spine, pass);
        }
    }

    fn triangle(&mut self, mut corners: Triangle, spine: &Spine, pass: u32) {
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
        let Rect { origin, size } = self.rect;
        let bound = |axis: usize| {
            let low = p0[axis].min(p1[axis]).min(p2[axis]).div_euclid(PX);
            let high = p0[axis].max(p1[axis]).max(p2[axis]).div_euclid(PX);
            low.max(origin[axis])..=high.min(origin[axis] + size[axis] - 1)
        };
        for y in bound(1) {
            let row = row_span(&[p0, p1, p2], y, bound(0));
            self.visited += (1 + i64::from(*row.end()) - i64::from(*row.start())).max(0) as u64;
            for x in row {
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
                self.fragment([x, y], inside, z, spine, pass);
            }
        }
    }

    fn fragment(
        &mut self,
        [x, y]: [i32; 2],
        inside: u32,
        z: impl Fn(usize) -> f32,
        spine: &Spine,
        pass: u32,
    ) {
        let Rect { origin, size } = self.rect;
        let index = ((y - origin[1]) * size[0] + x - origin[0]) as usize;
        let mut visible = 0_u32;
        let mut depths = [0.0; 4];
        for (sample, depth) in depths.iter_mut().enumerate() {
            if inside >> sample & 1 == 1 {
                *depth = z(sample);
                let before = self.depth[index][sample];
                let is_nearer =
                    *depth < before || *depth == before && spine.order < self.owner[index][sample];
                visible |= u32::from(is_nearer) << sample;
            }
        }
        if visible == 0 {
            return;
        }
        // How far along the segment the middle of this pixel is.
        let to = [x as f32 + 0.5 - spine.a[0], y as f32 + 0.5 - spine.a[1]];
        let along = spine.along;
        let t = (to[0] * along[0] + to[1] * along[1]).clamp(0.0, 1.0);
        let t = spine.part[0] + spine.part[1] * t;
        let alpha = mix(spine.coverage[0], spine.coverage[1], t);
        let mut mask = visible;
        if alpha < 1.0 {
            let key = coverage_key(spine.segment, x as u32, y as u32);
            mask &= coverage_mask(alpha, pass, key);
        }
        let [a, b] = spine.radiance;
        let mut color = [
            mix(a[0], b[0], t),
            mix(a[1], b[1], t),
            mix(a[2], b[2], t),
            1.0,
        ];
        if let Some([first, second]) = spine.narrow {
            let light = along_segment(first, second, t);
            for (value, light) in color.iter_mut().zip(light) {
                *value += light;
            }
        }
        if let Some((half, even)) = &spine.wide {
            let [x, y] = along;
            let off = (x * to[1] - y * to[0]) / (x * x + y * y).sqrt();
            let at = (off / mix(half[0], half[1], t)).clamp(-1.0, 1.0);
            let [red, green, blue, _] = color;
            let factors =
                profile_factors([red, green, blue], mix(a[3], b[3], t), even, [at, at * at]);
            for (value, factor) in color.iter_mut().zip(factors) {
                *value *= factor;
            }
        }
        for (sample, depth) in depths.into_iter().enumerate() {
            if mask >> sample & 1 == 1 {
                self.depth[index][sample] = depth;
                self.owner[index][sample] = spine.order;
                self.color[index][sample] = color;
            }
        }
    }
}

#[cfg(test)]
mod tests;
