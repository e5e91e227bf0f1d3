//! Polylines: resampling at equal distances, and curls laid onto a path.

use std::f32::consts::TAU;

use glam::Vec3;

/// Points at equal arc lengths along `path` into `out`, the ends included.
pub fn resample(path: &[Vec3], out: &mut [Vec3]) {
    let total: f32 = path.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let last = out.len() - 1;
    let mut segment = 0;
    let mut before = 0.0;
    for (ix, point) in out.iter_mut().enumerate() {
        let target = total * ix as f32 / last as f32;
        loop {
            let (a, b) = (path[segment], path[segment + 1]);
            let length = a.distance(b);
            if target <= before + length || segment + 2 == path.len() {
                let t = if length > 0.0 {
                    ((target - before) / length).min(1.0)
                } else {
                    0.0
                };
                *point = a.lerp(b, t);
                break;
            }
            before += length;
            segment += 1;
        }
    }
}

/// Unit vectors along the points, by central differences.
fn tangent(points: &[Vec3], ix: usize) -> Vec3 {
    let a = points[ix.saturating_sub(1)];
    let b = points[(ix + 1).min(points.len() - 1)];
    (b - a).try_normalize().unwrap_or(Vec3::NEG_Y)
}

/// A curl: a helix, flattened to a wave by `flatness` < 1.
#[derive(Clone, Copy, Debug)]
pub struct Curl {
    /// Radius at full strength, cm.
    pub radius: f32,
    /// Length of one turn along the path, cm.
    pub wavelength: f32,
    /// Second radius over the first; 1 is a round helix, 0 a plane wave.
    pub flatness: f32,
    /// Of the first turn, 0..1.
    pub phase: f32,
    /// Part of the length before which the curl fades in.
    pub from: f32,
}

/// Lays `curl` and a free displacement onto `points`, which are `spacing` cm apart.
///
/// The curl's first radius lies along `plane`, as far as that is across the path.
/// `displacement(t)` for t in 0..=1 gives offsets along the two normals, cm. The normals are
/// carried along the path without twist, so that a helix winds evenly.
pub fn displace(
    points: &mut [Vec3],
    spacing: f32,
    plane: Vec3,
    curl: Curl,
    displacement: impl Fn(f32) -> [f32; 2],
) {
    // Finer turns than eight points each would alias into zigzags.
    let wavelength = curl.wavelength.max(8.0 * spacing);
    let last = (points.len() - 1).max(1) as f32;
    let straight = points.to_vec();
    let mut normal = plane;
    for ix in 0..points.len() {
        let along = tangent(&straight, ix);
        normal = normal
            .reject_from_normalized(along)
            .try_normalize()
            .unwrap_or_else(|| along.any_orthonormal_vector());
        let across = along.cross(normal);
        let t = ix as f32 / last;
        let strength = super::scalp::smooth(0.0, curl.from, t);
        let angle = TAU * (ix as f32 * spacing / wavelength + curl.phase);
        let [a, b] = displacement(t);
        let first = curl.radius * strength * angle.cos() + a;
        let second = curl.radius * curl.flatness * strength * angle.sin() + b;
        points[ix] = straight[ix] + normal * first + across * second;
    }
}
