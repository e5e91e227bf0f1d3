//! The order of the lights of a set: by falling energy.

use strandlight_formats::SrbfLight;
use strandlight_scattering::spherical_gaussian::solid_angle;

/// By how much a light may pass the one before it: single precision.
const ORDER_TOLERANCE: f64 = 1e-5;

/// Energy of a light over the sphere, all channels.
pub fn light_energy(light: &SrbfLight) -> f64 {
    let rgb: f64 = light.rgb.iter().map(|&x| f64::from(x)).sum();
    rgb * solid_angle(f64::from(light.lambda))
}

/// The first light with more energy than the one before it, rounding aside.
pub fn misplaced_light(lights: &[SrbfLight]) -> Option<usize> {
    let rises = |pair: &[SrbfLight]| {
        light_energy(&pair[1]) > light_energy(&pair[0]) * (1.0 + ORDER_TOLERANCE)
    };
    lights.windows(2).position(rises).map(|ix| ix + 1)
}

/// Puts lights in the order of a set, where they are not; answers whether that moved any. Equals
/// stay as they were.
pub fn sort_lights(lights: &mut [SrbfLight]) -> bool {
    let is_misplaced = misplaced_light(lights).is_some();
    if is_misplaced {
        lights.sort_by(|a, b| light_energy(b).total_cmp(&light_energy(a)));
    }
    is_misplaced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_are_sorted_by_energy_and_equals_stay() {
        let light = |x: f32, lambda: f32, amplitude: f32| SrbfLight {
            direction: [x, 0.0, 0.0],
            lambda,
            rgb: [amplitude; 3],
        };
        // A bright narrow light has less energy than a dim wide one.
        let narrow = light(1.0, 0.01, 9.0);
        let mut lights = [
            narrow,
            light(2.0, 0.5, 1.0),
            light(3.0, 0.5, 1.0),
            light(4.0, 1.0, 1.0),
        ];
        assert_eq!(misplaced_light(&lights), Some(1));
        assert!(sort_lights(&mut lights));
        assert_eq!(lights.map(|it| it.direction[0]), [4.0, 2.0, 3.0, 1.0]);
        assert!(!sort_lights(&mut lights));
        // What was sorted in double precision stays as it is.
        lights[1].rgb = [0.999_999; 3];
        assert!(!sort_lights(&mut lights));
        assert_eq!(lights[1].direction[0], 2.0);
    }
}
