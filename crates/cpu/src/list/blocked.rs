//! What proxies and meshes hide of the pixels of a tile.

use glam::Vec3;
use strandlight_scene::background::ray_direction;
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::proxy::entry_distance;

use super::super::triangles::{Triangle, Triangles, corner_shares};
use super::places::{FARTHEST, PLACES, linear, place};

/// No proxy is there.
const NONE: i32 = -1;

/// Share of a pixel that a proxy gives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProxyEntry {
    /// Pixel of the tile.
    pub pixel: u32,
    /// Which proxy, or from their number on, which triangle of the meshes.
    pub surface: u32,
    /// Where it is hit, cm.
    pub position: [f32; 3],
    /// Of a triangle, what the place weighs its second and third corner with.
    shares: [f32; 2],
    /// Share of the pixel's colour.
    pub weight: f32,
}

impl ProxyEntry {
    /// [`corner_shares`] of the place.
    pub fn shares(&self) -> [f32; 3] {
        let [b, c] = self.shares;
        [1.0 - b - c, b, c]
    }
}

/// What is hidden of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Blocked {
    /// Depth of the nearest proxy at each place; more than any hair's where there is none.
    pub depth: [f32; PLACES],
    /// Which it is: [`ProxyEntry::surface`].
    surface: [i32; PLACES],
}

impl Blocked {
    const NOT: Blocked = Blocked {
        depth: [f32::INFINITY; PLACES],
        surface: [NONE; PLACES],
    };
}

/// Finds which proxies are seen where in the tile at `origin`, of `size`; none leaves `blocked` empty.
#[inline(always)]
pub(super) fn block(
    view: &ViewUniform,
    (beside, triangles): (&Beside, &Triangles),
    (origin, size): ([u32; 2], [u32; 2]),
    blocked: &mut Vec<Blocked>,
) {
    blocked.clear();
    let n_records = beside.records().n;
    if n_records == 0 && triangles.near(origin).next().is_none() {
        return;
    }
    blocked.resize((size[0] * size[1]) as usize, Blocked::NOT);
    let mut is_any = false;
    if n_records > 0 {
        for (ix, pixel) in (0..).zip(&mut *blocked) {
            let middle = [origin[0] + ix % size[0], origin[1] + ix / size[0]];
            is_any |= block_by_proxies(view, beside, middle.map(|n| n as f32 + 0.5), pixel);
        }
    }
    let range = view.far - view.near;
    for (ix, bounds) in triangles.near(origin) {
        let triangle = triangles.triangle(ix);
        let surface = (n_records + ix) as i32;
        let pixels = |axis: usize| {
            let (origin, size) = (origin[axis] as f32, size[axis] as f32);
            let [low, high] = bounds[axis].map(|x| (x - origin).floor());
            low.clamp(0.0, size) as u32..(high + 1.0).clamp(0.0, size) as u32
        };
        for y in pixels(1) {
            for x in pixels(0) {
                let middle = [origin[0] + x, origin[1] + y].map(|n| f64::from(n) + 0.5);
                let Some(at) = triangle.at(middle, FARTHEST.into()) else {
                    continue;
                };
                let pixel = &mut blocked[(x + size[0] * y) as usize];
                is_any |= block_by_triangle(triangle, at, (view.near, range), surface, pixel);
            }
        }
    }
    if !is_any {
        blocked.clear();
    }
}

/// Adds the proxies that are no meshes to the pixel with this `middle`; answers whether one is seen.
fn block_by_proxies(
    view: &ViewUniform,
    beside: &Beside,
    middle: [f32; 2],
    pixel: &mut Blocked,
) -> bool {
    let eye = Vec3::from(view.eye);
    let mut is_any = false;
    for ix in 0..PLACES {
        let [dx, dy] = place(ix);
        let direction = ray_direction(view, middle[0] + dx, middle[1] + dy);
        let away = direction.dot(Vec3::from(view.forward));
        for (proxy, record) in (0..).zip(beside.records().list()) {
            let distance = entry_distance(record, eye, direction);
            let depth = (distance * away - view.near) / (view.far - view.near);
            if distance > 0.0 && depth < pixel.depth[ix] {
                (pixel.depth[ix], pixel.surface[ix]) = (depth, proxy);
                is_any = true;
            }
        }
    }
    is_any
}

/// Adds a triangle to a pixel in the middle of which it has these sides; answers whether it is seen there.
#[inline(always)]
fn block_by_triangle(
    triangle: &Triangle,
    at: [f64; 3],
    (near, range): (f32, f32),
    surface: i32,
    pixel: &mut Blocked,
) -> bool {
    // What is narrowed keeps its sign, and neighbours have the same side to either side of their edge.
    let mut sides = [[0.0; PLACES]; 3];
    for (side, (at, [_, along_x, along_y])) in sides.iter_mut().zip(at.iter().zip(triangle.sides)) {
        let from_middle = linear([along_x as f32, along_y as f32]);
        for (side, from_middle) in side.iter_mut().zip(from_middle) {
            *side = *at as f32 + from_middle;
        }
    }
    let [a, b, c] = &sides;
    let depth = triangle.depth as f32;
    let mut is_any = false;
    for ix in 0..PLACES {
        let (a, b, c) = (a[ix], b[ix], c[ix]);
        let is_left = (a >= 0.0) & (b >= 0.0) & (c >= 0.0);
        let is_right = (a <= 0.0) & (b <= 0.0) & (c <= 0.0);
        let found = depth / (a + b + c);
        // Neither behind the eye nor along the plane.
        let is_ahead = (found > 0.0) & (found < f32::INFINITY);
        let found = (found - near) / range;
        let is_nearer = (is_left | is_right) & is_ahead & (found < pixel.depth[ix]);
        pixel.depth[ix] = if is_nearer { found } else { pixel.depth[ix] };
        pixel.surface[ix] = if is_nearer {
            surface
        } else {
            pixel.surface[ix]
        };
        is_any |= is_nearer;
    }
    is_any
}

impl Blocked {
    /// Adds the proxies that the `open` places of a pixel with this middle show.
    pub fn entries(
        &self,
        (view, beside): (&ViewUniform, &Beside),
        (at, pixel): ([f32; 2], u32),
        open: &[f32; PLACES],
        entries: &mut Vec<ProxyEntry>,
    ) {
        let eye = Vec3::from(view.eye);
        let mut last = NONE;
        loop {
            // The next one; most pixels show one or two.
            let others = self.surface.into_iter().filter(|surface| *surface > last);
            let Some(surface) = others.min() else {
                return;
            };
            last = surface;
            // Their weight, and times it where they lie from the middle, and how deep.
            let (mut weight, mut from_middle, mut depth) = (0.0, [0.0; 2], 0.0);
            for (ix, &open) in open.iter().enumerate() {
                let open = if self.surface[ix] == surface {
                    open
                } else {
                    0.0
                };
                let [dx, dy] = place(ix);
                weight += open;
                from_middle[0] += open * dx;
                from_middle[1] += open * dy;
                depth += if open > 0.0 {
                    open * self.depth[ix]
                } else {
                    0.0
                };
            }
            if weight > 0.0 {
                let [dx, dy] = from_middle.map(|sum| sum / weight);
                let direction = ray_direction(view, at[0] + dx, at[1] + dy);
                let away = direction.dot(Vec3::from(view.forward));
                let depth = view.near + depth / weight * (view.far - view.near);
                let position = eye + direction * (depth / away);
                let surface = surface as u32;
                let triangle = surface.checked_sub(beside.records().n);
                let [_, b, c] = triangle.map_or([0.0; 3], |triangle| {
                    corner_shares(beside, triangle, position)
                });
                entries.push(ProxyEntry {
                    pixel,
                    surface,
                    position: position.to_array(),
                    shares: [b, c],
                    weight: weight / PLACES as f32,
                });
            }
        }
    }
}
