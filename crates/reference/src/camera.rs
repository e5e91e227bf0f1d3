//! Rays from the camera.

use glam::Vec3;
use strandlight_scattering::random::{R2, SplitMix64};
use strandlight_scene::camera::ViewUniform;

use crate::integrator::CameraRay;
use crate::rays::Start;

/// Most samples of a pixel.
pub const MAX_SAMPLES: u32 = 1 << 24;

/// The ray of one sample of the pixel whose upper left corner is `at`.
pub(super) fn camera_ray(
    view: &ViewUniform,
    at: [f64; 2],
    pixel_key: u64,
    sample: u32,
) -> CameraRay {
    let [x, y] = in_pixel(pixel_key, sample);
    let [x, y] = [at[0] + x, at[1] + y];
    let across = (x - 0.5 * f64::from(view.size[0])) as f32;
    let upwards = (0.5 * f64::from(view.size[1]) - y) as f32;
    let forward = Vec3::from(view.forward);
    let direction =
        (forward * view.focal_px + Vec3::from(view.right) * across + Vec3::from(view.up) * upwards)
            .normalize();
    let mut start = Start::camera(Vec3::from(view.eye));
    start.t_min = view.near / direction.dot(forward).max(1e-6);
    CameraRay {
        start,
        direction,
        pixel_key,
        sample,
    }
}

/// Point `sample` in the unit square of a sequence that fills it evenly, turned by `key`.
fn in_pixel(key: u64, sample: u32) -> [f64; 2] {
    let mut turn = SplitMix64(key);
    R2.map(|step| (turn.uniform(0.0, 1.0) + f64::from(sample) * step).fract())
}
