//! The edits that frames are measured after, there and back from a scene as it was loaded.

use glam::{Quat, Vec3};
use strandlight_formats::SrbfLight;
use strandlight_scattering::{HairParams, Parameter};
use strandlight_scene::paint::{ActiveStroke, Brush, Paint, Picker, Stroke};
use strandlight_scene::{Backend, Camera, PreparedScene, RenderError};

/// Hair of another absorption.
pub(super) fn color(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let mut hair = *base.hair.hair();
    hair.sigma_a = hair.sigma_a.map(|x| if there { 0.9 * x + 0.01 } else { x });
    set_hair(live, &hair)
}

/// Lobes of other widths.
pub(super) fn widths(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let mut hair = *base.hair.hair();
    if there {
        hair.width = hair.width.map(other_width);
    }
    set_hair(live, &hair)
}

/// A width a little above, or below where that would leave the range.
fn other_width(width: f64) -> f64 {
    in_range(Parameter::Width, [1.05 * width, width / 1.05])
}

/// Hair of another index of refraction.
pub(super) fn eta(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let mut hair = *base.hair.hair();
    if there {
        hair.eta = other_eta(hair.eta);
    }
    set_hair(live, &hair)
}

/// An index of refraction a little above, or below where that would leave the range.
fn other_eta(eta: f64) -> f64 {
    in_range(Parameter::Eta, [eta + 0.02, eta - 0.02])
}

/// The first of two values, or the other one where the first is above the range of `parameter`.
fn in_range(parameter: Parameter, [first, other]: [f64; 2]) -> f64 {
    let [_, max] = parameter.range();
    if first <= max { first } else { other }
}

/// All lights a little darker.
pub(super) fn light_colors(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let factor = if there { 0.9 } else { 1.0 };
    let lights = base.lights.iter();
    let rgb: Vec<_> = lights.map(|light| light.rgb.map(|x| x * factor)).collect();
    live.set_light_colors(&rgb)
}

/// All lights of another colour.
pub(super) fn tint(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let tint = if there { [1.0, 0.9, 0.8] } else { [1.0; 3] };
    let tinted =
        |light: &SrbfLight| [0, 1, 2].map(|channel: usize| light.rgb[channel] * tint[channel]);
    let rgb: Vec<_> = base.lights.iter().map(tinted).collect();
    live.set_light_colors(&rgb)
}

/// Without the first light, which has most energy.
pub(super) fn light_off(
    live: &mut dyn Backend,
    base: &PreparedScene,
    there: bool,
) -> Result<(), RenderError> {
    let mut rgb: Vec<_> = base.lights.iter().map(|light| light.rgb).collect();
    if let Some(first) = rgb.first_mut().filter(|_| there) {
        *first = [0.0; 3];
    }
    live.set_light_colors(&rgb)
}

/// The lights of `base`, turned about +Y.
pub(super) fn turn_lights(
    live: &mut dyn Backend,
    base: &PreparedScene,
    radians: f32,
) -> Result<(), RenderError> {
    let turn = Quat::from_rotation_y(radians);
    let turned = |light: &SrbfLight| SrbfLight {
        direction: (turn * Vec3::from(light.direction)).normalize().to_array(),
        ..*light
    };
    live.set_lights(base.lights.iter().map(turned).collect())
}

/// The camera of `base`, turned about +Y around its target.
pub(super) fn turn_camera(live: &mut dyn Backend, base: &PreparedScene, radians: f32) {
    let (camera, turn) = (&base.camera, Quat::from_rotation_y(radians));
    live.set_camera(Camera {
        eye: camera.target + turn * (camera.eye - camera.target),
        ..*camera
    });
}

fn set_hair(live: &mut dyn Backend, hair: &HairParams) -> Result<(), RenderError> {
    let modes = live.scene().hair.modes().to_vec();
    live.set_hair(hair, &modes)
}

/// A stroke of the usual brush over `before` where the hair comes nearest to the camera.
pub(super) fn stroke(scene: &PreparedScene, before: &Paint) -> Stroke {
    let eye = scene.camera.eye;
    let positions = scene.strands.points.iter().map(|p| Vec3::from_slice(p));
    let nearest = positions.min_by(|a, b| a.distance(eye).total_cmp(&b.distance(eye)));
    let (Some(nearest), Ok(mut active_stroke)) = (nearest, ActiveStroke::new(Brush::default()))
    else {
        return Stroke::default();
    };
    let mut after = before.clone();
    active_stroke.dab(&Picker::new(&scene.strands), &mut after, nearest);
    active_stroke.finish(&after)
}

/// The middle value, the upper one of two; 0 of none.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_stay_in_the_ranges() {
        for (parameter, other) in [
            (Parameter::Eta, other_eta as fn(f64) -> f64),
            (Parameter::Width, other_width),
        ] {
            let [min, max] = parameter.range();
            for share in [0.0, 0.3, 0.98, 1.0] {
                let value = min + share * (max - min);
                let found = other(value);
                let name = parameter.name();
                assert!((min..=max).contains(&found), "{name} {value}: {found}");
                assert!((found - value).abs() > 1e-5, "{name} {value}: {found}");
            }
        }
        assert_eq!((other_eta(1.5), other_width(0.5)), (1.52, 0.525));
    }
}
