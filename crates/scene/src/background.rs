//! What is seen between the strands. Twin of `shaders/pass/composite.wgsl`.

use glam::Vec3;
use strandlight_formats::{Background, SrbfLight};

use crate::PreparedScene;
use crate::camera::ViewUniform;

/// What lies behind the hair at a point of the screen; `None` for nothing. Without its panorama, it is the lights.
pub fn background_at(
    scene: &PreparedScene,
    view: &ViewUniform,
    [x, y]: [f32; 2],
) -> Option<[f32; 3]> {
    match scene.background {
        Background::None => None,
        Background::Color(color) => Some(color),
        Background::Lights => Some(radiance(&scene.lights, ray_direction(view, x, y))),
        Background::Panorama => {
            let omega = ray_direction(view, x, y);
            Some(match &scene.panorama {
                Some(panorama) => panorama.radiance(omega),
                None => radiance(&scene.lights, omega),
            })
        }
    }
}

/// Unit vector from the eye through a point of the screen.
pub fn ray_direction(view: &ViewUniform, x: f32, y: f32) -> Vec3 {
    let across = x - 0.5 * view.size[0] as f32;
    let upwards = 0.5 * view.size[1] as f32 - y;
    (Vec3::from(view.forward) * view.focal_px
        + Vec3::from(view.right) * across
        + Vec3::from(view.up) * upwards)
        .normalize()
}

/// L(omega) of all lights (Xu 2011 Eq 1), linear RGB, in the form without cancellation; `omega` is a unit vector.
pub fn radiance(lights: &[SrbfLight], omega: Vec3) -> [f32; 3] {
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
