//! Means of the samples and the background behind them. Twin of `shaders/pass/composite.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_formats::{Background, SrbfLight};
use strandlight_runtime::PreparedScene;
use strandlight_runtime::camera::ViewUniform;

/// Turns sums of `samples` samples into the picture.
pub(super) fn composite(
    scene: &PreparedScene,
    view: &ViewUniform,
    samples: u32,
    picture: &mut [[f32; 4]],
) {
    let width = view.size[0] as usize;
    picture
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let [r, g, b, a] = pixel.map(|sum| sum / samples as f32);
                let mut rgb = [r, g, b].map(|x| x / view.radiance_scale);
                let mut alpha = a;
                let at = [x as f32 + 0.5, y as f32 + 0.5];
                if let Some(behind) = background_at(scene, view, at) {
                    for (channel, behind) in rgb.iter_mut().zip(behind) {
                        *channel += (1.0 - alpha) * behind;
                    }
                    alpha = 1.0;
                }
                *pixel = [rgb[0], rgb[1], rgb[2], alpha];
            }
        });
}

/// What lies behind the hair at a point of the screen; `None` for nothing.
pub fn background_at(
    scene: &PreparedScene,
    view: &ViewUniform,
    [x, y]: [f32; 2],
) -> Option<[f32; 3]> {
    match scene.background {
        Background::None => None,
        Background::Color(color) => Some(color),
        Background::Lights => Some(radiance(&scene.lights, ray_direction(view, x, y))),
    }
}

/// Unit vector from the eye through a point of the screen.
pub(super) fn ray_direction(view: &ViewUniform, x: f32, y: f32) -> Vec3 {
    let across = x - 0.5 * view.size[0] as f32;
    let upwards = 0.5 * view.size[1] as f32 - y;
    (Vec3::from(view.forward) * view.focal_px
        + Vec3::from(view.right) * across
        + Vec3::from(view.up) * upwards)
        .normalize()
}

/// L(omega) of all lights (Xu 2011 Eq 1), in the form without cancellation.
fn radiance(lights: &[SrbfLight], omega: Vec3) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for light in lights {
        let d = omega - Vec3::from(light.direction);
        let value = (-d.dot(d) / (light.lambda * light.lambda)).exp();
        for (sum, amplitude) in sum.iter_mut().zip(light.rgb) {
            *sum += amplitude * value;
        }
    }
    sum
}
