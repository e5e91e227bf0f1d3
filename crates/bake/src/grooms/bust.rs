//! Head and shoulders, as a signed distance: what hair grows on and lies on, and the mesh of it.
//!
//! A mannequin of smoothly joined ellipsoids and round cones, symmetric in x, in the place of the
//! ellipsoid of [`HEAD_RADII`](super::HEAD_RADII): centred at the origin, face to +Z.

use std::sync::OnceLock;

use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// Where the bust is cut off, cm.
const BASE: f32 = -34.0;
/// Corners of the box that holds it, cm.
const LOW: Vec3 = Vec3::new(-27.0, BASE - 1.5, -20.0);
const HIGH: Vec3 = Vec3::new(27.0, 15.0, 16.0);
/// Grid of distances, cm.
const STEP: f32 = 0.5;

/// Distance to the surface, cm; below zero inside. Exact on the surface, about right beside it.
pub fn distance(p: Vec3) -> f32 {
    let p = Vec3::new(p.x.abs(), p.y, p.z);
    let at = Vec3::new;
    let cranium = ellipsoid(p, at(0.0, 2.0, -1.1), at(7.3, 9.3, 9.2));
    let face = ellipsoid(p, at(0.0, -2.6, 2.5), at(5.5, 8.4, 6.6));
    let mut d = join(cranium, face, 2.6);
    // Jaw and chin, cheeks.
    d = join(d, ellipsoid(p, at(0.0, -7.2, 3.4), at(4.4, 3.7, 5.0)), 2.0);
    d = join(d, ellipsoid(p, at(0.0, -9.7, 7.0), at(1.7, 1.4, 1.5)), 1.8);
    d = join(d, ellipsoid(p, at(3.4, -2.2, 6.0), at(1.7, 1.6, 1.8)), 2.6);
    // Hollows of the eyes, the nose.
    d = cut(d, ellipsoid(p, at(2.8, 0.7, 10.3), at(2.3, 1.5, 2.0)), 1.8);
    d = join(
        d,
        cone(p, [at(0.0, 1.6, 8.2), at(0.0, -2.3, 9.8)], [0.45, 0.8]),
        1.2,
    );
    d = join(d, ellipsoid(p, at(0.8, -2.6, 9.1), at(0.6, 0.5, 0.7)), 0.7);
    // Lips, with a shallow line between and a dent below.
    d = join(d, ellipsoid(p, at(0.0, -5.7, 7.4), at(2.0, 1.4, 1.5)), 1.3);
    d = cut(
        d,
        cone(p, [at(0.0, -5.7, 9.3), at(1.6, -5.6, 8.7)], [0.1, 0.08]),
        0.8,
    );
    d = cut(
        d,
        cone(p, [at(0.0, -7.6, 9.7), at(1.2, -7.5, 9.4)], [0.4, 0.3]),
        1.2,
    );
    d = join(d, ear(p), 0.4);
    let neck = cone(p, [at(0.0, -5.0, -1.8), at(0.0, -19.0, -4.0)], [4.5, 4.9]);
    d = join(d, neck, 2.4);
    let shoulder = cone(p, [at(0.0, -18.0, -4.4), at(13.5, -22.5, -4.0)], [3.6, 3.8]);
    d = join(d, shoulder, 3.0);
    d = join(
        d,
        ellipsoid(p, at(14.2, -25.0, -3.6), at(4.9, 6.2, 5.0)),
        3.0,
    );
    d = join(
        d,
        ellipsoid(p, at(0.0, -33.0, -2.8), at(14.5, 12.8, 8.6)),
        4.0,
    );
    d.max(BASE - p.y)
}

/// An ear: a dish that stands off the head.
fn ear(p: Vec3) -> f32 {
    let rim = ellipsoid(p, Vec3::new(7.4, -0.6, -1.2), Vec3::new(0.9, 3.0, 1.8));
    cut(
        rim,
        ellipsoid(p, Vec3::new(8.3, -0.4, -0.8), Vec3::new(0.7, 1.9, 1.0)),
        0.3,
    )
}

/// Quilez's bound: right on the surface and along the axes.
fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let p = p - centre;
    let (a, b) = ((p / radii).length(), (p / (radii * radii)).length());
    if b < 1e-6 {
        return -radii.min_element();
    }
    a * (a - 1.0) / b
}

/// A rod between two points whose radius changes along it, about.
fn cone(p: Vec3, [from, to]: [Vec3; 2], radii: [f32; 2]) -> f32 {
    let axis = to - from;
    let t = ((p - from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
    p.distance(from + axis * t) - (radii[0] + (radii[1] - radii[0]) * t)
}

/// Both, with a fillet of about `k` cm.
fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// The first without the second.
fn cut(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

/// Gradient of [`distance`], made a unit vector: out of the surface.
pub fn normal(p: Vec3) -> Vec3 {
    const E: f32 = 0.05;
    let along = |axis: Vec3| distance(p + E * axis) - distance(p - E * axis);
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z))
        .try_normalize()
        .unwrap_or(Vec3::Y)
}

/// Distances at the corners of a grid, to be looked up quickly.
pub struct Field {
    n: UVec3,
    values: Vec<f32>,
}

/// The bust's, made once. Not under a lock: who makes it takes up other work of rayon's meanwhile, which may ask for it too.
pub fn field() -> &'static Field {
    static FIELD: OnceLock<Field> = OnceLock::new();
    match FIELD.get() {
        Some(field) => field,
        None => {
            let made = Field::new();
            FIELD.get_or_init(|| made)
        }
    }
}

impl Field {
    fn new() -> Field {
        let n = ((HIGH - LOW) / STEP).ceil().as_uvec3() + 1;
        let layer = (n.x * n.y) as usize;
        let mut values = vec![0.0; layer * n.z as usize];
        values
            .par_chunks_mut(layer)
            .zip(0..n.z)
            .for_each(|(layer, z)| {
                for (ix, value) in (0..).zip(layer) {
                    *value = distance(Field::corner(UVec3::new(ix % n.x, ix / n.x, z)));
                }
            });
        Field { n, values }
    }

    fn corner(at: UVec3) -> Vec3 {
        LOW + STEP * at.as_vec3()
    }

    fn value(&self, at: UVec3) -> f32 {
        self.values[((at.z * self.n.y + at.y) * self.n.x + at.x) as usize]
    }

    /// Distance and gradient at `p`, trilinear; far outside of the box `None`.
    pub fn look_up(&self, p: Vec3) -> Option<(f32, Vec3)> {
        let at = (p - LOW) / STEP;
        let cell = at.floor();
        if cell.min_element() < 0.0 || (cell + 1.0).cmpge(self.n.as_vec3()).any() {
            return None;
        }
        let (base, f) = (cell.as_uvec3(), at - cell);
        let corner = |x, y, z| self.value(base + UVec3::new(x, y, z));
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let along_x = |y, z| {
            let (a, b) = (corner(0, y, z), corner(1, y, z));
            (mix(a, b, f.x), b - a)
        };
        let [(a, ax), (b, bx), (c, cx), (d, dx)] =
            [along_x(0, 0), along_x(1, 0), along_x(0, 1), along_x(1, 1)];
        let (near, far) = (mix(a, b, f.y), mix(c, d, f.y));
        let gradient = Vec3::new(
            mix(mix(ax, bx, f.y), mix(cx, dx, f.y), f.z),
            mix(b - a, d - c, f.z),
            far - near,
        );
        Some((
            mix(near, far, f.z),
            gradient.try_normalize().unwrap_or(Vec3::Y),
        ))
    }

    /// `point`, moved out where it is less than `gap` cm off the surface.
    pub fn push_out(&self, point: Vec3, gap: f32) -> Vec3 {
        let mut point = point;
        for _ in 0..3 {
            match self.look_up(point) {
                Some((d, out)) if d < gap => point += (gap - d) * out,
                _ => break,
            }
        }
        point
    }

    /// The surface as vertices and triangles, counterclockwise from outside: surface nets (Gibson
    /// 1998), the vertices then moved onto the surface.
    pub fn mesh(&self) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let cells = self.n - 1;
        let ix_of = |at: UVec3| ((at.z * cells.y + at.y) * cells.x + at.x) as usize;
        let mut vertices = Vec::new();
        let mut vertex_of = vec![u32::MAX; (cells.x * cells.y * cells.z) as usize];
        for z in 0..cells.z {
            for y in 0..cells.y {
                for x in 0..cells.x {
                    let at = UVec3::new(x, y, z);
                    if let Some(vertex) = self.vertex(at) {
                        vertex_of[ix_of(at)] = vertices.len() as u32;
                        vertices.push(vertex.to_array());
                    }
                }
            }
        }
        let mut triangles = Vec::new();
        let axes = [UVec3::X, UVec3::Y, UVec3::Z];
        for z in 1..cells.z {
            for y in 1..cells.y {
                for x in 1..cells.x {
                    let at = UVec3::new(x, y, z);
                    for axis in 0..3 {
                        let inside = self.value(at) < 0.0;
                        if inside == (self.value(at + axes[axis]) < 0.0) {
                            continue;
                        }
                        let (u, v) = (axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
                        let ring = [at - u - v, at - v, at, at - u];
                        let mut ring = ring.map(|cell| vertex_of[ix_of(cell)]);
                        if !inside {
                            ring.reverse();
                        }
                        let [a, b, c, d] = ring;
                        triangles.extend([[a, b, c], [a, c, d]]);
                    }
                }
            }
        }
        (vertices, triangles)
    }

    /// The vertex of a cell that the surface passes through.
    fn vertex(&self, cell: UVec3) -> Option<Vec3> {
        let corner = |ix: u32| UVec3::new(ix & 1, (ix >> 1) & 1, ix >> 2);
        let values: [f32; 8] = std::array::from_fn(|ix| self.value(cell + corner(ix as u32)));
        let (mut sum, mut n) = (Vec3::ZERO, 0.0);
        for a in 0..8u32 {
            for bit in [1, 2, 4] {
                let b = a | bit;
                let (from, to) = (values[a as usize], values[b as usize]);
                if b != a && (from < 0.0) != (to < 0.0) {
                    let t = from / (from - to);
                    sum += corner(a).as_vec3().lerp(corner(b).as_vec3(), t);
                    n += 1.0;
                }
            }
        }
        if n == 0.0 {
            return None;
        }
        let at = Field::corner(cell) + STEP * sum / n;
        Some(at - distance(at).clamp(-STEP, STEP) * normal(at))
    }
}
