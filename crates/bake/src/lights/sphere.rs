//! Small geometry on the unit sphere, and numbers that look random but never change.

use std::f64::consts::PI;

/// A vector or direction in world space.
pub(super) type Vec3 = [f64; 3];

pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a * x + b * y + c * z`.
pub(super) fn combine(a: Vec3, x: f64, b: Vec3, y: f64, c: Vec3, z: f64) -> Vec3 {
    [0, 1, 2].map(|k| a[k] * x + b[k] * y + c[k] * z)
}

/// `v` at length 1; +Y if `v` has no direction.
pub(super) fn normalize(v: Vec3) -> Vec3 {
    let length = dot(v, v).sqrt();
    if length > 0.0 && length.is_finite() {
        v.map(|x| x / length)
    } else {
        [0.0, 1.0, 0.0]
    }
}

/// Two unit vectors that make a right-handed frame `(a, b, w)` with the unit vector `w`
/// (Duff et al. 2017).
pub(super) fn tangents(w: Vec3) -> [Vec3; 2] {
    let sign = 1.0f64.copysign(w[2]);
    let a = -1.0 / (sign + w[2]);
    let b = w[0] * w[1] * a;
    [
        [1.0 + sign * w[0] * w[0] * a, sign * b, -sign * w[0]],
        [b, sign + w[1] * w[1] * a, -w[1]],
    ]
}

/// Point `ix` of `count` on the Fibonacci lattice: nearly equal areas, turned about +Y by
/// `turn` radians.
pub(super) fn fibonacci(ix: usize, count: usize, turn: f64) -> Vec3 {
    let golden = PI * (3.0 - 5.0f64.sqrt());
    let y = 1.0 - (2 * ix + 1) as f64 / count as f64;
    let radius = (1.0 - y * y).max(0.0).sqrt();
    let (sin, cos) = (golden * ix as f64 + turn).sin_cos();
    [radius * sin, y, radius * cos]
}

/// Splitmix64 (Steele, Lea, Flood 2014): the same numbers on every machine.
pub(super) struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Random(seed)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A direction uniform on the sphere.
    pub fn direction(&mut self) -> Vec3 {
        let z = 2.0 * self.uniform() - 1.0;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (2.0 * PI * self.uniform()).sin_cos();
        [radius * cos, radius * sin, z]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cross(a: Vec3, b: Vec3) -> Vec3 {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }

    #[test]
    fn tangents_are_a_right_handed_frame() {
        let mut random = Random::new(1);
        let mut directions: Vec<Vec3> = (0..100).map(|_| random.direction()).collect();
        directions.extend([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]);
        for w in directions {
            let [a, b] = tangents(w);
            let c = cross(a, b);
            for k in 0..3 {
                assert!((c[k] - w[k]).abs() < 1e-12);
            }
            assert!(dot(a, b).abs() < 1e-12 && (dot(a, a) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_lattice_is_balanced() {
        let count = 1000;
        let mut sum = [0.0; 3];
        for ix in 0..count {
            let p = fibonacci(ix, count, 0.3);
            assert!((dot(p, p) - 1.0).abs() < 1e-12);
            sum = [0, 1, 2].map(|k| sum[k] + p[k] / count as f64);
        }
        assert!(sum.iter().all(|x| x.abs() < 2e-3), "{sum:?}");
    }
}
