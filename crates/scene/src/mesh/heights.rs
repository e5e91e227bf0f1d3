//! Height maps: the surface of a mesh that a light sees first.

use glam::Vec3;
use strandlight_formats::Mesh;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{LANES, Level, Simd, dispatch, f32x8, i32x8};

/// Most texels along a side: some 2 mm of a bust. More make shadows of the mesh on hair far from it
/// sharper, and every map takes longer.
const SIDE: usize = 256;

/// How far below a surface a place is in its shadow, texels: less, and the inner side of a bend
/// would shadow itself.
const CLEAR: f32 = 0.5;

/// Where a place lies to a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
pub struct Placed {
    /// In the file's space, on the surface if the place is inside, cm.
    pub position: Vec3,
    /// Normal of the surface there; zero where the place is off it.
    pub normal: Vec3,
}

/// Heights of a mesh along a direction, on a grid across it.
#[derive(Clone, Debug)]
pub struct HeightMap {
    right: Vec3,
    up: Vec3,
    towards: Vec3,
    /// Middle of the first texel, along `right` and `up`, cm.
    corner: [f32; 2],
    texels_per_cm: f32,
    dims: [usize; 2],
    /// Texels from row to row: a vector more than there are, which are raised at a time.
    stride: usize,
    /// `[row][column]`, cm; far below where there is no surface.
    heights: Vec<f32>,
}

impl HeightMap {
    /// Of `mesh` towards a unit vector; whether it [is closed](super::closed::is_closed).
    pub fn new(mesh: &Mesh, is_closed: bool, towards: Vec3) -> HeightMap {
        let (right, up) = towards.any_orthonormal_pair();
        let points: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|&position| {
                let position = Vec3::from(position);
                Vec3::new(position.dot(right), position.dot(up), position.dot(towards))
            })
            .collect();
        let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let extent = high - low;
        let texel = (extent.x.max(extent.y) / (SIDE - 1) as f32).max(1e-4);
        let dims = [extent.x, extent.y].map(|x| ((x / texel).ceil() as usize + 1).min(SIDE));
        let mut map = HeightMap {
            right,
            up,
            towards,
            corner: [low.x, low.y],
            texels_per_cm: 1.0 / texel,
            dims,
            stride: dims[0] + LANES,
            heights: vec![f32::NEG_INFINITY; (dims[0] + LANES) * dims[1]],
        };
        // What is highest is a front face.
        let front = is_closed.then(|| right.cross(up).dot(towards).signum());
        dispatch!(Level::new(), simd => map.draw_all(simd, &points, (&mesh.triangles, front)));
        map
    }

    /// All triangles, or those alone whose area on the map has the sign of `front`.
    #[inline(always)]
    fn draw_all<S: Simd>(
        &mut self,
        simd: S,
        points: &[Vec3],
        (triangles, front): (&[[u32; 3]], Option<f32>),
    ) {
        simd.vectorize(
            #[inline(always)]
            || {
                for triangle in triangles {
                    let [a, b, c] = *triangle;
                    let corners = [points[a as usize], points[b as usize], points[c as usize]];
                    self.draw(simd, corners, front);
                }
            },
        );
    }

    /// Raises the texels whose middles a triangle covers.
    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, corners: [Vec3; 3], front: Option<f32>) {
        let [a, b, c] = corners.map(|point| {
            let x = (point.x - self.corner[0]) * self.texels_per_cm;
            let y = (point.y - self.corner[1]) * self.texels_per_cm;
            Vec3::new(x, y, point.z)
        });
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        let seen = front.map_or_else(|| area.abs(), |front| area * front);
        if seen < 1e-9 {
            // Along its plane, or from behind.
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (rows, columns) = (
            texels(low.y, high.y, self.dims[1]),
            texels(low.x, high.x, self.dims[0]),
        );
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        // Shares of b and of c, as linear functions of the place.
        let per_area = 1.0 / area;
        let share_b = [(c.y - a.y) * per_area, (a.x - c.x) * per_area];
        let share_c = [(a.y - b.y) * per_area, (b.x - a.x) * per_area];
        let (to_b, to_c) = (b.z - a.z, c.z - a.z);
        let end = columns.end as f32 - 0.5;
        let lanes = f32x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        for row in rows {
            let y = row as f32 - a.y;
            for first in columns.clone().step_by(LANES) {
                let heights = &mut self.heights[self.stride * row + first..][..LANES];
                let before = f32x8::from_slice(simd, heights);
                let column = lanes + first as f32;
                let x = column - a.x;
                let on_b = x * share_b[0] + y * share_b[1];
                let on_c = x * share_c[0] + y * share_c[1];
                let on_a = 1.0 - (on_b + on_c);
                // No column after the last.
                let inside = on_a.min(on_b).min(on_c).min(end - column);
                let found = (on_b * to_b + on_c * to_c + a.z).min(high.z);
                // A little beyond the edges, so that none is left open.
                let is_on = inside.simd_ge(-1e-4);
                is_on.select(found.max(before), before).store_slice(heights);
            }
        }
    }

    /// Is the surface above a place, seen from the light? By the lowest of the four texels around
    /// it: on a plane, and wherever the surface bends away from the light, that is no higher than
    /// the surface at the place, however steep it is.
    fn is_above(&self, position: Vec3) -> bool {
        let at = |axis: Vec3, corner: f32| (position.dot(axis) - corner) * self.texels_per_cm;
        let (x, y) = (at(self.right, self.corner[0]), at(self.up, self.corner[1]));
        // Also false for NaN.
        let is_on =
            x >= 0.0 && y >= 0.0 && x < (self.dims[0] - 1) as f32 && y < (self.dims[1] - 1) as f32;
        if !is_on {
            return false;
        }
        let first = x as usize + self.stride * y as usize;
        let second = first + self.stride;
        let pairs = [
            &self.heights[first..first + 2],
            &self.heights[second..second + 2],
        ];
        let lowest = pairs[0][0]
            .min(pairs[0][1])
            .min(pairs[1][0].min(pairs[1][1]));
        lowest > position.dot(self.towards) + CLEAR / self.texels_per_cm
    }
}

impl HeightMap {
    /// [`HeightMap::is_above`] of eight places: x, y and z; and their components along the light.
    #[inline(always)]
    fn are_above<S: Simd>(&self, simd: S, position: [f32x8<S>; 3]) -> u32 {
        let at_x = (along(position, self.right) - self.corner[0]) * self.texels_per_cm;
        let at_y = (along(position, self.up) - self.corner[1]) * self.texels_per_cm;
        let (last_x, last_y) = ((self.dims[0] - 1) as f32, (self.dims[1] - 1) as f32);
        let is_on =
            at_x.simd_ge(0.0) & at_y.simd_ge(0.0) & at_x.simd_lt(last_x) & at_y.simd_lt(last_y);
        if !is_on.any_true() {
            return 0;
        }
        let zero = f32x8::splat(simd, 0.0);
        let column: [i32; LANES] = is_on.select(at_x, zero).to_int::<i32x8<S>>().into();
        let row: [i32; LANES] = is_on.select(at_y, zero).to_int::<i32x8<S>>().into();
        let mut lowest = [f32::NEG_INFINITY; LANES];
        for (lane, lowest) in lowest.iter_mut().enumerate() {
            let first = column[lane] as usize + self.stride * row[lane] as usize;
            let second = first + self.stride;
            if let (Some([a, b]), Some([c, d])) = (
                self.heights.get(first..first + 2),
                self.heights.get(second..second + 2),
            ) {
                *lowest = a.min(*b).min(c.min(*d));
            }
        }
        let lowest = f32x8::simd_from(simd, lowest);
        let height = along(position, self.towards) + CLEAR / self.texels_per_cm;
        (is_on & lowest.simd_gt(height)).to_bitmask() as u32
    }

    /// Which of eight places the mesh hides from the light, a bit each: [`Placed::is_hidden`], or of those that `are_own`, points of
    /// its surface, [`Placed::is_hidden_above`].
    #[inline(always)]
    pub fn hidden<S: Simd>(&self, simd: S, placed: [&Placed; LANES], are_own: u32) -> u32 {
        let (mut position, mut normal) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, placed) in placed.into_iter().enumerate() {
            for axis in 0..3 {
                position[axis][lane] = placed.position[axis];
                normal[axis][lane] = placed.normal[axis];
            }
        }
        let [x, y, z] = normal;
        let normal = [
            f32x8::simd_from(simd, x),
            f32x8::simd_from(simd, y),
            f32x8::simd_from(simd, z),
        ];
        let [x, y, z] = position;
        let position = [
            f32x8::simd_from(simd, x),
            f32x8::simd_from(simd, y),
            f32x8::simd_from(simd, z),
        ];
        let facing = along(normal, self.towards);
        let faces_away = facing.simd_lt(0.0).to_bitmask() as u32;
        let above = self.are_above(simd, position);
        if are_own == 0 {
            return faces_away | above;
        }
        let own = above & facing.simd_gt(0.0).to_bitmask() as u32;
        are_own & own | !are_own & (faces_away | above)
    }
}

/// Components of eight vectors along an axis.
#[inline(always)]
fn along<S: Simd>([x, y, z]: [f32x8<S>; 3], axis: Vec3) -> f32x8<S> {
    x * axis.x + y * axis.y + z * axis.z
}

/// Those of `n` whose middles lie within a range.
#[inline(always)]
fn texels(low: f32, high: f32, n: usize) -> std::ops::Range<usize> {
    // Casts saturate, and cut off what `floor` would.
    let floor = low.max(0.0) as usize;
    let first = floor + usize::from((floor as f32) < low);
    let end = match high >= 0.0 {
        true => (high as usize).saturating_add(1).min(n),
        false => 0,
    };
    first..end.max(first)
}

impl Placed {
    /// Does the mesh stand before a light in `towards`, of which `map` is?
    #[inline]
    pub fn is_hidden(&self, map: &HeightMap, towards: Vec3) -> bool {
        self.normal.dot(towards) < 0.0 || map.is_above(self.position)
    }

    /// The same of a point of the surface itself, the half of the lights below its horizon left
    /// to its normal.
    #[doc(hidden)]
    #[inline]
    pub fn is_hidden_above(&self, map: &HeightMap, towards: Vec3) -> bool {
        self.normal.dot(towards) > 0.0 && map.is_above(self.position)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ellipsoid, unit};
    use super::*;

    #[test]
    fn the_highest_faces_of_a_closed_mesh_are_front_faces() {
        let mesh = ellipsoid(Vec3::new(1.0, 2.0, 1.5), 24);
        for towards in (0..400).step_by(23).map(unit) {
            let [all, front] =
                [false, true].map(|is_closed| HeightMap::new(&mesh, is_closed, towards));
            let n_on = |map: &HeightMap| {
                map.heights
                    .iter()
                    .filter(|height| height.is_finite())
                    .count()
            };
            // But for texels that the outline just touches.
            let off = (all.heights.iter().zip(&front.heights)).filter(|(a, b)| a != b);
            let n_off = off.count();
            assert!(
                n_on(&all) > 5_000 && n_off < 40,
                "{n_off} of {}",
                n_on(&all)
            );
        }
    }
}
