//! Rays against meshes.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};

use super::MeshProxy;
use crate::hierarchy::hierarchy;

/// A mesh, and a bounding volume hierarchy over its triangles.
///
/// Rays that leave places inside start on the surface, as the renderer has it; and what leaves
/// through a triangle is not held up by it.
#[doc(hidden)]
pub struct MeshRays {
    proxy: MeshProxy,
    /// In the order of the hierarchy's leaves.
    triangles: Vec<Triangle>,
    bvh: CwBvh,
}

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
pub enum MetMesh {
    /// At once, from a place on the surface, cm, whose normal this is.
    Here { position: Vec3, normal: Vec3 },
    /// At a distance in cm from a place that is not inside, on a triangle.
    At {
        from: Vec3,
        distance: f32,
        triangle: usize,
    },
}

struct Triangle {
    from: Vec3,
    /// From the first corner to the others.
    edges: [Vec3; 2],
    /// Number in the mesh.
    ix: u32,
}

impl Triangle {
    /// Distance along a ray, and whether it comes from outside (Moeller and Trumbore 1997).
    fn meet(&self, origin: Vec3, direction: Vec3) -> Option<(f32, bool)> {
        let [u, v] = self.edges;
        let across = direction.cross(v);
        let determinant = u.dot(across);
        if determinant == 0.0 {
            return None;
        }
        let from = origin - self.from;
        let share_u = from.dot(across) / determinant;
        let other = from.cross(u);
        let share_v = direction.dot(other) / determinant;
        // A little beyond the edges, so that none is left open.
        let is_on = share_u >= -1e-6 && share_v >= -1e-6 && share_u + share_v <= 1.0 + 1e-6;
        let t = v.dot(other) / determinant;
        (is_on && t > 0.0).then_some((t, determinant > 0.0))
    }
}

impl MeshRays {
    /// Of a mesh as it stands in a scene.
    pub fn new(proxy: &MeshProxy) -> MeshRays {
        let corners = |ix: usize| proxy.corners(ix);
        let n = proxy.shape.mesh.triangles.len();
        let boxes: Vec<Aabb> = (0..n)
            .map(|ix| {
                let [a, b, c] = corners(ix);
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                // Rounding of the box test.
                let reach = 4e-6 * low.abs().max(high.abs()) + 1e-6;
                Aabb::new(Vec3A::from(low - reach), Vec3A::from(high + reach))
            })
            .collect();
        let mut bvh = hierarchy(&boxes);
        let triangles = bvh.primitive_indices.iter().map(|&ix| {
            let [a, b, c] = corners(ix as usize);
            Triangle {
                from: a,
                edges: [b - a, c - a],
                ix,
            }
        });
        let triangles = triangles.collect();
        bvh.primitive_indices = Vec::new();
        MeshRays {
            proxy: proxy.clone(),
            triangles,
            bvh,
        }
    }

    /// The mesh.
    pub fn proxy(&self) -> &MeshProxy {
        &self.proxy
    }

    /// Distance along a unit vector from outside, and the triangle.
    pub fn seen(&self, origin: Vec3, direction: Vec3) -> Option<(f32, usize)> {
        self.nearest(origin, direction, |_| true)
    }

    /// What a ray from a fibre or a surface meets.
    pub fn met(&self, origin: Vec3, direction: Vec3) -> Option<MetMesh> {
        let placed = self.proxy.place(origin);
        let position = placed.position + self.proxy.offset;
        if placed.normal.dot(direction) < 0.0 {
            // None from inside, where it is met at once.
            let normal = placed.normal;
            return Some(MetMesh::Here { position, normal });
        }
        let met = self.nearest(position, direction, |is_from_outside| is_from_outside);
        met.map(|(distance, triangle)| MetMesh::At {
            from: position,
            distance,
            triangle,
        })
    }

    /// Whether it stands before a light in `direction`.
    pub fn is_blocked(&self, origin: Vec3, direction: Vec3) -> bool {
        let placed = self.proxy.place(origin);
        if placed.normal.dot(direction) < 0.0 {
            return true;
        }
        let from = placed.position + self.proxy.offset;
        let missed = self.bvh.ray_traverse_miss(ray(from, direction), |_, ix| {
            let met = self.triangles[ix].meet(from, direction);
            match met {
                Some((t, true)) => t,
                _ => f32::INFINITY,
            }
        });
        !missed
    }

    fn nearest(
        &self,
        origin: Vec3,
        direction: Vec3,
        counts: impl Fn(bool) -> bool,
    ) -> Option<(f32, usize)> {
        let mut hit = RayHit::none();
        let mut nearest = None;
        self.bvh
            .ray_traverse(ray(origin, direction), &mut hit, |ray, ix| {
                match self.triangles[ix].meet(origin, direction) {
                    Some((t, is_from_outside)) if counts(is_from_outside) && t < ray.tmax => {
                        nearest = Some((t, self.triangles[ix].ix as usize));
                        t
                    }
                    _ => f32::INFINITY,
                }
            });
        nearest
    }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    // The sum has no -0, whose inverse has not the sign that the hierarchy sorts boxes by.
    let direction = Vec3A::from(direction) + Vec3A::ZERO;
    Ray::new(origin.into(), direction, 0.0, f32::INFINITY)
}
