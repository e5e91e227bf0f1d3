//! Meshes beside the hair: what they hide of the lights.
//!
//! - [`MeshShape`]: a mesh, and how far every place is from its surface. Made once a file.
//! - `HeightMap`: its highest surface towards one direction, so that asking whether a place is in
//!   its shadow takes the same time whatever the number of triangles.
//! - `MeshRays`: a hierarchy over its triangles, for rays.
//! - `Placed`: where a place counts as lying. As with the other proxies, places inside count as
//!   if they lay on the surface.

mod closed;
mod distances;
mod heights;
mod rays;

use std::fmt;
use std::sync::Arc;

use glam::Vec3;
use strandlight_formats::{Mesh, content_hash};

use distances::Distances;
#[doc(hidden)]
pub use heights::{HeightMap, Placed};
#[doc(hidden)]
pub use rays::{MeshRays, MetMesh};

/// How near to the surface a place counts as lying on it, cells of [`Distances`].
const ON_SURFACE: f32 = 0.1;

/// A mesh as it stands in its file, cm.
pub struct MeshShape {
    /// Vertices and triangles.
    pub mesh: Mesh,
    distances: Distances,
    /// See [`closed::is_closed`].
    is_closed: bool,
}

impl fmt::Debug for MeshShape {
    /// By what it holds, in few words.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Mesh {
            positions,
            normals,
            triangles,
            ..
        } = &self.mesh;
        let hashes = [
            content_hash(bytemuck::cast_slice(positions)),
            content_hash(bytemuck::cast_slice(normals)),
            content_hash(bytemuck::cast_slice(triangles)),
        ];
        f.debug_tuple("MeshShape").field(&hashes).finish()
    }
}

impl PartialEq for MeshShape {
    fn eq(&self, other: &MeshShape) -> bool {
        std::ptr::eq(self, other) || self.mesh == other.mesh
    }
}

/// A mesh in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshProxy {
    /// The mesh.
    pub shape: Arc<MeshShape>,
    /// How far it is moved, cm.
    pub offset: Vec3,
    /// Share of light that it sends back, linear RGB, 0..=1.
    pub albedo: [f32; 3],
}

impl MeshShape {
    /// Of a mesh that is valid: [`Mesh::validate`].
    pub fn new(mesh: Mesh) -> MeshShape {
        MeshShape {
            distances: Distances::new(&mesh),
            is_closed: closed::is_closed(&mesh),
            mesh,
        }
    }

    /// Bytes that it takes in memory, or nearly.
    pub(crate) fn bytes(&self) -> usize {
        let Mesh {
            positions,
            normals,
            uvs,
            triangles,
            ..
        } = &self.mesh;
        let of_mesh = size_of_val(&positions[..]) + size_of_val(&normals[..]);
        of_mesh + size_of_val(&uvs[..]) + size_of_val(&triangles[..]) + self.distances.bytes()
    }

    /// Where a place of the file's space lies.
    fn place(&self, position: Vec3) -> Placed {
        let far = Placed {
            position,
            normal: Vec3::ZERO,
        };
        let Some((distance, normal)) = self.distances.at(position) else {
            return far;
        };
        if distance > ON_SURFACE * self.distances.cell() {
            return far;
        }
        // Distances are interpolated: another step takes away most of the error of a long way.
        let mut placed = Placed { position, normal };
        let mut left = distance.min(0.0);
        for _ in 0..2 {
            placed.position -= left * placed.normal;
            match self.distances.at(placed.position) {
                Some((distance, normal)) if left < 0.0 => {
                    (left, placed.normal) = (distance, normal)
                }
                _ => break,
            }
        }
        placed
    }
}

impl MeshProxy {
    /// Where a place of the world lies.
    #[doc(hidden)]
    pub fn place(&self, position: Vec3) -> Placed {
        self.shape.place(position - self.offset)
    }

    /// What it hides of a light in `direction`, a unit vector.
    #[doc(hidden)]
    pub fn height_map(&self, direction: Vec3) -> HeightMap {
        HeightMap::new(&self.shape.mesh, self.shape.is_closed, direction)
    }

    /// A vertex in the world, cm.
    #[doc(hidden)]
    pub fn vertex(&self, ix: u32) -> Vec3 {
        Vec3::from(self.shape.mesh.positions[ix as usize]) + self.offset
    }

    /// The corners of triangle `ix` in the world, cm.
    #[doc(hidden)]
    pub fn corners(&self, ix: usize) -> [Vec3; 3] {
        self.shape.mesh.triangles[ix].map(|corner| self.vertex(corner))
    }
}

/// What a point of the plane of a triangle weighs its corners with; they add up to 1.
#[doc(hidden)]
pub fn barycentric([a, b, c]: [Vec3; 3], position: Vec3) -> [f32; 3] {
    let (u, v, w) = (b - a, c - a, position - a);
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (wu, wv) = (w.dot(u), w.dot(v));
    let area = uu * vv - uv * uv;
    if area <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let share_b = ((vv * wu - uv * wv) / area).clamp(0.0, 1.0);
    let share_c = ((uu * wv - uv * wu) / area).clamp(0.0, 1.0 - share_b);
    [1.0 - share_b - share_c, share_b, share_c]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An ellipsoid about the origin with `n` rows and twice as many columns.
    pub fn ellipsoid(radii: Vec3, n: u32) -> Mesh {
        let mut positions = Vec::new();
        for row in 0..=n {
            for column in 0..2 * n {
                let polar = std::f32::consts::PI * row as f32 / n as f32;
                let azimuth = std::f32::consts::PI * column as f32 / n as f32;
                // Both poles are points.
                let radius = polar.sin().max(0.0);
                let unit = Vec3::new(radius * azimuth.sin(), polar.cos(), radius * azimuth.cos());
                positions.push((radii * unit).to_array());
            }
        }
        let mut triangles = Vec::new();
        for row in 0..n {
            for column in 0..2 * n {
                let at = |row: u32, column: u32| 2 * n * row + column % (2 * n);
                let [a, b] = [at(row, column), at(row, column + 1)];
                let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        Mesh::new(positions, triangles).expect("valid")
    }

    /// One of 400 directions, spread evenly.
    pub fn unit(ix: u32) -> Vec3 {
        let z = 1.0 - 2.0 * (ix as f32 + 0.5) / 400.0;
        let (sin, cos) = (2.399_963 * ix as f32).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }

    #[test]
    fn distances_are_those_of_the_surface() {
        let shape = MeshShape::new(ellipsoid(Vec3::splat(10.0), 48));
        let cell = shape.distances.cell();
        for ix in 0..400 {
            for r in [2.0, 6.0, 9.0, 9.8, 10.0, 10.05, 10.3] {
                let place = shape.distances.at(r * unit(ix));
                let (distance, normal) = place.expect("in the grid");
                assert!(
                    (distance - (r - 10.0)).abs() < 0.15 * cell,
                    "{r}: {distance}"
                );
                assert!(normal.dot(unit(ix)) > 0.98, "{r}: {normal}");
                let placed = shape.place(r * unit(ix));
                let wanted = r.max(10.0);
                assert!(
                    (placed.position.length() - wanted).abs() < 0.1 * cell,
                    "{r}: {placed:?}"
                );
                assert_eq!(placed.normal == Vec3::ZERO, r > 10.01, "{r}: {placed:?}");
            }
        }
        assert_eq!(shape.distances.at(Vec3::splat(100.0)), None);
    }

    #[test]
    fn corners_weigh_as_they_lie() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 1.0)];
        let weights = [0.2, 0.5, 0.3];
        let at = (0..3).map(|ix| corners[ix] * weights[ix]).sum();
        for (found, wanted) in barycentric(corners, at).into_iter().zip(weights) {
            assert!((found - wanted).abs() < 1e-6);
        }
        assert_eq!(barycentric([Vec3::ONE; 3], Vec3::ONE), [1.0, 0.0, 0.0]);
    }
}
