//! The head that hair grows on, as far as its roots tell.

use glam::{DMat3, DVec3};
use strandlight_formats::Groom;

use super::orbit::Bounds;

/// Most roots that are looked at.
const ROOTS: usize = 4096;

/// The sphere nearest to the roots of `groom`: least squares of `|p|^2 = 2 c.p + k` (Coope 1993).
/// `None` where there are too few, or all in a plane.
pub fn sphere_of(groom: &Groom) -> Option<Bounds> {
    let n_strands = groom.strand_offsets.len().saturating_sub(1);
    let step = n_strands.div_ceil(ROOTS).max(1);
    let roots: Vec<DVec3> = (groom.strand_offsets.iter().take(n_strands).step_by(step))
        .filter_map(|&first| groom.points.get(first as usize))
        .map(|root| DVec3::from(root.map(f64::from)))
        .collect();
    let n = roots.len() as f64;
    let mean = roots.iter().sum::<DVec3>() / n;
    // About their mean k is the mean square, and what is left has three unknowns.
    let mean_square = roots
        .iter()
        .map(|root| (root - mean).length_squared())
        .sum::<f64>()
        / n;
    let (mut matrix, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for root in &roots {
        let q = root - mean;
        matrix += DMat3::from_cols(q.x * q, q.y * q, q.z * q) * (2.0 / n);
        right += q * ((q.length_squared() - mean_square) / n);
    }
    let is_flat = matrix.determinant() <= 1e-6 * mean_square.powi(3);
    // True of no roots at all, whose mean is no number.
    if is_flat || !mean_square.is_finite() {
        return None;
    }
    let offset = matrix.inverse() * right;
    Some(Bounds {
        centre: (mean + offset).as_vec3(),
        radius: (mean_square + offset.length_squared()).sqrt() as f32,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn roots_on_half_a_sphere_tell_all_of_it() {
        let centre = Vec3::new(1.0, 2.0, -3.0);
        let mut groom = Groom::default();
        groom.strand_offsets.push(0);
        for ix in 0..200 {
            let t = ix as f32;
            let out = Vec3::new((2.4 * t).cos(), 0.02 + 0.005 * t, (2.4 * t).sin());
            let root = centre + 9.0 * out.normalize();
            groom
                .points
                .extend([root.to_array(), (root + out).to_array()]);
            groom.strand_offsets.push(groom.points.len() as u32);
        }
        let found = sphere_of(&groom).expect("a sphere");
        assert!((found.radius - 9.0).abs() < 1e-3, "{}", found.radius);
        assert!(found.centre.distance(centre) < 1e-3, "{}", found.centre);
        for point in &mut groom.points {
            point[1] = 0.0;
        }
        assert!(sphere_of(&groom).is_none(), "of a plane");
        assert!(sphere_of(&Groom::default()).is_none());
    }
}
