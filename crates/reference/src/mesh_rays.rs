//! Rays against meshes.

use glam::Vec3;
use strandlight_scene::mesh::{self, MeshProxy, MetMesh, barycentric};

use crate::surface::Surface;

/// A mesh, and a bounding volume hierarchy over its triangles.
///
/// Rays that leave places inside start on the surface, as the renderer has it; and what leaves
/// through a triangle is not held up by it. Normals are those of the vertices, interpolated.
pub struct MeshRays {
    rays: mesh::MeshRays,
}

impl MeshRays {
    /// Of a mesh as it stands in a scene.
    pub fn new(proxy: &MeshProxy) -> MeshRays {
        MeshRays {
            rays: mesh::MeshRays::new(proxy),
        }
    }

    /// Distance along a unit vector from outside, and the triangle.
    pub(crate) fn seen(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Surface)> {
        let (t, triangle) = self.rays.seen(origin, direction)?;
        Some((t, self.surface(triangle, origin + t * direction)))
    }

    /// The same from a fibre or a surface.
    pub(crate) fn met(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Surface)> {
        Some(match self.rays.met(origin, direction)? {
            MetMesh::Here { position, normal } => {
                let albedo = self.rays.proxy().albedo.map(f64::from);
                let surface = Surface {
                    position,
                    normal,
                    albedo,
                };
                (0.0, surface)
            }
            MetMesh::At {
                distance,
                triangle,
                from,
            } => (
                distance,
                self.surface(triangle, from + distance * direction),
            ),
        })
    }

    /// Whether it stands before a light in `direction`.
    pub(crate) fn is_blocked(&self, origin: Vec3, direction: Vec3) -> bool {
        self.rays.is_blocked(origin, direction)
    }

    fn surface(&self, triangle: usize, position: Vec3) -> Surface {
        let proxy = self.rays.proxy();
        let mesh = &proxy.shape.mesh;
        let shares = barycentric(proxy.corners(triangle), position);
        let normals =
            mesh.triangles[triangle].map(|corner| Vec3::from(mesh.normals[corner as usize]));
        let normal: Vec3 = (0..3).map(|corner| shares[corner] * normals[corner]).sum();
        Surface {
            position,
            normal: normal.normalize_or(Vec3::Y),
            albedo: proxy.albedo.map(f64::from),
        }
    }
}
