//! Meshes on the screen: which triangle is nearest along the ray through a point of the picture.
//!
//! A ray meets a triangle where it is on one side of the three planes through the eye and an edge.
//! These are linear functions of the place in the picture, so nothing is divided by depths, and
//! triangles that reach behind the eye need no clipping. Neighbours have the same plane for the edge
//! that they share, so that no ray passes between them.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use strandlight_scene::beside::Beside;
use strandlight_scene::camera::ViewUniform;
use strandlight_scene::mesh::barycentric;

/// Side of a tile, px: those of visibility lists too, which ask for the triangles of a whole tile at once.
pub(super) const TILE: u32 = 16;

/// Depth up to which places on the screen are not to be trusted, cm.
const NEXT_TO_EYE: f32 = 0.01;

/// How far beyond its outline a triangle is looked for, px: samples lie up to half a pixel aside.
const REACH: f32 = 1.0;

/// A triangle of a mesh as the eye sees it.
#[derive(Clone)]
pub(super) struct Triangle {
    /// For each corner, the side of the plane through the eye and the other two: a constant, and
    /// the growth along x and y.
    pub sides: [[f64; 3]; 3],
    /// Times the inverse of the sum of the sides, the depth along the line of sight, cm.
    pub depth: f64,
}

impl Triangle {
    /// The sides at a place of the picture, unless no place less than `reach` from it along either axis is inside.
    #[inline(always)]
    pub fn at(&self, [x, y]: [f64; 2], reach: f64) -> Option<[f64; 3]> {
        let mut at = [0.0; 3];
        let (mut is_left, mut is_right) = (true, true);
        for (at, [side, along_x, along_y]) in at.iter_mut().zip(self.sides) {
            *at = side + x * along_x + y * along_y;
            let change = reach * (along_x.abs() + along_y.abs());
            is_left &= *at >= -change;
            is_right &= *at <= change;
        }
        (is_left || is_right).then_some(at)
    }
}

/// The triangles of all meshes, sorted into tiles of the picture.
#[derive(Clone)]
pub(super) struct Triangles {
    triangles: Vec<Triangle>,
    tiles: [u32; 2],
    /// Where each tile's triangles start, and where the last ends.
    starts: Vec<u32>,
    /// Triangles and where they may be: first and last pixel along x and y.
    bins: Vec<u32>,
    bounds: Vec<[[f32; 2]; 2]>,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hit {
    /// Along the line of sight, cm.
    pub depth: f32,
    /// Number of the triangle among those of all meshes.
    pub triangle: u32,
}

impl Triangles {
    /// Those of `beside` as `view` sees them.
    pub fn new(view: &ViewUniform, beside: &Beside) -> Triangles {
        let [width, height] = view.size.map(f64::from);
        let [right, up, forward] =
            [view.right, view.up, view.forward].map(|axis| Vec3::from(axis).as_dvec3());
        let focal = f64::from(view.focal_px);
        // The ray through the corner of the picture; its part along the line of sight is `focal`.
        let corner = forward * focal - right * (0.5 * width) + up * (0.5 * height);
        let eye = Vec3::from(view.eye).as_dvec3();
        let tiles = view.size.map(|n| n.div_ceil(TILE));
        let side_of = |normal: DVec3| [normal.dot(corner), normal.dot(right), -normal.dot(up)];
        let seen = |corners: [Vec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner.as_dvec3() - eye);
            let triangle = Triangle {
                sides: [
                    side_of(b.cross(c)),
                    side_of(c.cross(a)),
                    side_of(a.cross(b)),
                ],
                depth: a.dot(b.cross(c)) * focal,
            };
            let bounds = bounds_of(view, corners);
            let span = |axis: usize| {
                let [low, high] = bounds[axis].map(|x| (x / TILE as f32).floor());
                let end = (high + 1.0).clamp(0.0, tiles[axis] as f32) as u32;
                (low.max(0.0) as u32).min(end)..end
            };
            (triangle, (bounds, [span(0), span(1)]))
        };
        let (mut triangles, mut bounds, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        for mesh in beside.meshes() {
            let numbers = (0..mesh.shape.mesh.triangles.len()).into_par_iter();
            let of_mesh = numbers.map(|ix| seen(mesh.corners(ix)));
            let (its_triangles, (its_bounds, its_spans)): (Vec<_>, (Vec<_>, Vec<_>)) =
                of_mesh.unzip();
            triangles.extend(its_triangles);
            bounds.extend(its_bounds);
            spans.extend(its_spans);
        }
        let mut all = Triangles {
            triangles,
            tiles,
            starts: vec![0; (tiles[0] * tiles[1]) as usize + 1],
            bins: Vec::new(),
            bounds,
        };
        let each_tile = |[columns, rows]: &[std::ops::Range<u32>; 2]| {
            let columns = columns.clone();
            rows.clone()
                .flat_map(move |row| columns.clone().map(move |column| column + tiles[0] * row))
        };
        for tile in spans.iter().flat_map(each_tile) {
            all.starts[tile as usize + 1] += 1;
        }
        for tile in 1..all.starts.len() {
            all.starts[tile] += all.starts[tile - 1];
        }
        let mut next = all.starts.clone();
        all.bins = vec![0; next.last().copied().unwrap_or(0) as usize];
        for (ix, span) in (0..).zip(&spans) {
            for tile in each_tile(span) {
                let place = &mut next[tile as usize];
                all.bins[*place as usize] = ix;
                *place += 1;
            }
        }
        all
    }

    /// Triangles that are seen in the tile of [`TILE`] pixels with `pixel` as one of them, and where
    /// they may be: first and last place along x and y, px.
    pub fn near(&self, pixel: [u32; 2]) -> impl Iterator<Item = (u32, [[f32; 2]; 2])> + Clone {
        let [column, row] =
            [0, 1].map(|axis: usize| (pixel[axis] / TILE).min(self.tiles[axis] - 1));
        let tile = (column + self.tiles[0] * row) as usize;
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        let found = self.bins[range].iter();
        found.map(|&ix| (ix, self.bounds[ix as usize]))
    }

    /// One of those that are [`Triangles::near`].
    #[inline]
    pub fn triangle(&self, ix: u32) -> &Triangle {
        &self.triangles[ix as usize]
    }

    /// Depth at which the ray through a point of the picture meets a triangle, cm.
    #[inline]
    pub fn depth(&self, triangle: u32, [x, y]: [f32; 2]) -> Option<f32> {
        let Triangle { sides, depth } = &self.triangles[triangle as usize];
        let (x, y) = (f64::from(x), f64::from(y));
        let [a, b, c] = sides.map(|[at, along_x, along_y]| at + x * along_x + y * along_y);
        let is_inside = (a >= 0.0 && b >= 0.0 && c >= 0.0) || (a <= 0.0 && b <= 0.0 && c <= 0.0);
        if !is_inside {
            return None;
        }
        let found = depth / (a + b + c);
        // Neither behind the eye nor along the plane.
        (found > 0.0 && found.is_finite()).then_some(found as f32)
    }

    /// The nearest triangle along the ray through a point of the picture that is in or next to `pixel`.
    pub fn nearest(&self, pixel: [u32; 2], at: [f32; 2]) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (triangle, bounds) in self.near(pixel) {
            let is_near =
                (0..2).all(|axis| bounds[axis][0] <= at[axis] && at[axis] <= bounds[axis][1]);
            if !is_near {
                continue;
            }
            let depth = self.depth(triangle, at);
            let is_nearer = |depth: &f32| nearest.is_none_or(|nearest| *depth < nearest.depth);
            if let Some(depth) = depth.filter(is_nearer) {
                nearest = Some(Hit { depth, triangle });
            }
        }
        nearest
    }
}

/// Where a triangle may be in the picture, px; anywhere where a corner is next to the eye or behind it.
fn bounds_of(view: &ViewUniform, corners: [Vec3; 3]) -> [[f32; 2]; 2] {
    let eye = Vec3::from(view.eye);
    let depths = corners.map(|corner| (corner - eye).dot(Vec3::from(view.forward)));
    if depths.iter().all(|depth| *depth <= 0.0) {
        return [[f32::INFINITY, f32::NEG_INFINITY]; 2];
    }
    if depths.iter().any(|depth| *depth <= NEXT_TO_EYE) {
        return [[f32::NEG_INFINITY, f32::INFINITY]; 2];
    }
    let along = |axis: [f32; 3], sign: f32, middle: f32| {
        let places = [0, 1, 2].map(|ix: usize| {
            let across = (corners[ix] - eye).dot(Vec3::from(axis));
            middle + sign * view.focal_px * across / depths[ix]
        });
        let low = places.into_iter().fold(f32::INFINITY, f32::min);
        let high = places.into_iter().fold(f32::NEG_INFINITY, f32::max);
        [low - REACH, high + REACH]
    };
    let middle = view.size.map(|n| 0.5 * n as f32);
    [
        along(view.right, 1.0, middle[0]),
        along(view.up, -1.0, middle[1]),
    ]
}
/// Mesh and triangle of it that are number `triangle` of all.
pub(super) fn of_mesh(beside: &Beside, mut triangle: u32) -> (usize, usize) {
    for (ix, mesh) in beside.meshes().iter().enumerate() {
        let n = mesh.shape.mesh.triangles.len() as u32;
        if triangle < n {
            return (ix, triangle as usize);
        }
        triangle -= n;
    }
    (0, 0)
}

/// What a place on the triangle that is number `triangle` of all weighs its corners with.
pub(super) fn corner_shares(beside: &Beside, triangle: u32, position: Vec3) -> [f32; 3] {
    let (mesh, triangle) = of_mesh(beside, triangle);
    barycentric(beside.meshes()[mesh].corners(triangle), position)
}
