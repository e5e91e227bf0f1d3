//! The fibre's frame at a crossing.

use glam::{DVec3, Vec3};
use strandlight_scene::strands::Strands;

use crate::rays::Crossing;

/// Unit vectors u (root to tip), v, w of the fibre.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Along the fibre.
    pub u: DVec3,
    /// Normal.
    pub v: DVec3,
    /// `u x v`.
    pub w: DVec3,
}

impl Frame {
    /// Interpolated between the ends of the segment, as shading is.
    pub fn at(strands: &Strands, crossing: &Crossing) -> Self {
        let u = tangent(strands, crossing).as_dvec3().normalize_or(DVec3::Y);
        let first = strands.segments[crossing.segment as usize] as usize;
        let [a, b] = [first, first + 1].map(|ix| Vec3::from_slice(&strands.normals[ix]));
        let v = a.lerp(b, crossing.along).as_dvec3();
        let v = (v - u * u.dot(v))
            .try_normalize()
            .unwrap_or_else(|| u.any_orthonormal_vector());
        Frame {
            u,
            v,
            w: u.cross(v),
        }
    }

    /// A world direction in the frame.
    pub(crate) fn to_fibre(self, omega: Vec3) -> [f64; 3] {
        let omega = omega.as_dvec3();
        [omega.dot(self.u), omega.dot(self.v), omega.dot(self.w)]
    }

    /// A direction of the frame in the world, a unit vector again.
    pub(crate) fn to_world(self, [u, v, w]: [f64; 3]) -> Vec3 {
        (self.u * u + self.v * v + self.w * w).as_vec3().normalize()
    }
}

/// Direction of the fibre at a crossing, root to tip; not of unit length.
pub fn tangent(strands: &Strands, crossing: &Crossing) -> Vec3 {
    let first = strands.segments[crossing.segment as usize] as usize;
    let [a, b] = [first, first + 1].map(|ix| Vec3::from_slice(&strands.tangents[ix]));
    let between = a.lerp(b, crossing.along);
    // Opposite tangents cancel in a hairpin.
    if between.length_squared() > 1e-6 {
        return between;
    }
    let [a, b] = [first, first + 1].map(|ix| Vec3::from_slice(&strands.points[ix]));
    b - a
}
