//! The environment map behind the hair. Twin of `shaders/lib/panorama.wgsl`.

use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

use glam::Vec3;
use strandlight_formats::{LightsSection, Panorama};

/// Brightest radiance that is shown: that of lights too.
pub(crate) const MAX_RADIANCE: f32 = 1e30;

/// A panorama as a scene has it: turned, and times a factor. Clones share the texels.
#[derive(Clone, Debug)]
pub struct TurnedPanorama {
    /// The map.
    pub map: Arc<Panorama>,
    /// What is added to the place around the map, 0..1 of a whole turn.
    turn: f32,
    /// What texels are multiplied by.
    factor: [f32; 3],
}

impl PartialEq for TurnedPanorama {
    /// The very same map, turned and multiplied alike.
    fn eq(&self, other: &Self) -> bool {
        let is_map = Arc::ptr_eq(&self.map, &other.map);
        is_map && (self.turn, self.factor) == (other.turn, other.factor)
    }
}

impl TurnedPanorama {
    /// `map` with the rotation, intensity and tint of `section`, as the lights of its set have them.
    pub fn new(map: Arc<Panorama>, section: &LightsSection) -> Self {
        let whole = section.intensity * 2f64.powi(map.exponent());
        let factor = section
            .tint
            .map(|x| (x * whole).min(MAX_RADIANCE.into()) as f32);
        TurnedPanorama {
            map,
            turn: (section.rotate_deg / 360.0).rem_euclid(1.0) as f32,
            factor,
        }
    }

    /// The turn and the factor, as shaders read them.
    #[doc(hidden)]
    pub fn uniform(&self) -> ([f32; 3], f32) {
        (self.factor, self.turn)
    }

    /// Linear radiance from direction `omega`, a unit vector: bilinear between texels, around the seam too.
    pub fn radiance(&self, omega: Vec3) -> [f32; 3] {
        let size = [self.map.width() as f32, self.map.height() as f32];
        let at = panorama_place(omega, self.turn, size);
        let base = at.map(f32::floor);
        let f = [at[0] - base[0], at[1] - base[1]];
        let (x, y) = (base[0] as i64, base[1] as i64);
        let texel = |x, y| Vec3::from(self.map.texel(x, y));
        let row_0 = texel(x, y).lerp(texel(x + 1, y), f[0]);
        let row_1 = texel(x, y + 1).lerp(texel(x + 1, y + 1), f[0]);
        let value = row_0.lerp(row_1, f[1]) * Vec3::from(self.factor);
        value.min(Vec3::splat(MAX_RADIANCE)).to_array()
    }
}

/// Column and row in texels, whole numbers at their centres, of a direction in a map of `size` that is turned by `turn`
/// of a whole turn.
fn panorama_place(omega: Vec3, turn: f32, size: [f32; 2]) -> [f32; 2] {
    let across = (omega.x * omega.x + omega.z * omega.z).sqrt();
    let lat = omega.y.atan2(across);
    let lon = match across > 0.0 {
        true => omega.x.atan2(omega.z),
        false => 0.0,
    };
    let around = 0.5 - lon / TAU + turn;
    let around = around - around.floor();
    [
        around * size[0] - 0.5,
        (0.5 - lat * FRAC_1_PI) * size[1] - 0.5,
    ]
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    fn turned(map: &Arc<Panorama>, rotate_deg: f64) -> TurnedPanorama {
        let mut section = LightsSection::new("a.lights");
        section.rotate_deg = rotate_deg;
        TurnedPanorama::new(map.clone(), &section)
    }

    /// A map of 32 x 16 whose texels are their column and row.
    fn numbered() -> Arc<Panorama> {
        let pixel = |ix: u32| [(ix % 32) as f32, (ix / 32) as f32, 1.0];
        let pixels: Vec<[f32; 3]> = (0..512).map(pixel).collect();
        Arc::new(Panorama::from_pixels(32, &pixels).expect("valid"))
    }

    /// Direction of the place (i, j) in a map of 32 x 16, as the convention of maps has it.
    fn direction(i: f64, j: f64) -> Vec3 {
        use std::f64::consts::PI;
        let lat = PI * (0.5 - (j + 0.5) / 16.0);
        let lon = PI - 2.0 * PI * (i + 0.5) / 32.0;
        let [x, y, z] = [lat.cos() * lon.sin(), lat.sin(), lat.cos() * lon.cos()];
        Vec3::new(x as f32, y as f32, z as f32)
    }

    #[test]
    fn texels_lie_where_the_convention_of_maps_has_them() {
        let plain = turned(&numbered(), 0.0);
        let mut n_checked = 0;
        for j in 0..16 {
            for i in 0..32 {
                let found = plain.radiance(direction(f64::from(i), f64::from(j)));
                let wanted = [i as f32, j as f32, 1.0];
                for (found, wanted) in found.into_iter().zip(wanted) {
                    assert!((found - wanted).abs() < 1e-3, "{i}, {j}: {found}");
                    n_checked += 1;
                }
            }
        }
        assert_eq!(n_checked, 1536);
        // Between two, and across the seam, where column 31 meets column 0.
        assert!((plain.radiance(direction(7.25, 3.0))[0] - 7.25).abs() < 1e-3);
        assert!((plain.radiance(direction(31.5, 3.0))[0] - 15.5).abs() < 1e-3);
        // The poles are the middle of the first and the last row.
        for (y, row) in [(1.0, 0.0), (-1.0, 15.0)] {
            assert!((plain.radiance(Vec3::new(0.0, y, 0.0))[1] - row).abs() < 1e-3);
        }
    }

    #[test]
    fn it_turns_as_the_lights_do() {
        let map = numbered();
        let plain = turned(&map, 0.0);
        for degrees in [90.0, -37.5, 725.0] {
            let turned = turned(&map, degrees);
            let turn = Quat::from_rotation_y(degrees.to_radians() as f32);
            for (i, j) in [(3.3, 2.0), (20.0, 9.7), (11.1, 14.2)] {
                let omega = direction(i, j);
                let (found, wanted) = (turned.radiance(turn * omega), plain.radiance(omega));
                for (found, wanted) in found.into_iter().zip(wanted) {
                    assert!((found - wanted).abs() < 2e-3, "{degrees}: {found} {wanted}");
                }
            }
        }
    }

    #[test]
    fn intensity_and_tint_are_factors() {
        let map = numbered();
        let mut section = LightsSection::new("a.lights");
        (section.intensity, section.tint) = (3.0, [1.0, 0.5, 0.0]);
        // Of single lights: of no effect.
        section.muted = vec![0];
        section.adjust_mut(1).intensity = 9.0;
        let bright = TurnedPanorama::new(map.clone(), &section);
        let omega = direction(5.0, 6.0);
        let [r, g, b] = bright.radiance(omega);
        assert!((r - 15.0).abs() < 2e-3 && (g - 9.0).abs() < 2e-3 && b == 0.0);
        let sun = vec![[f32::MAX; 3]; 8];
        let sun = Arc::new(Panorama::from_pixels(4, &sun).expect("valid"));
        (section.intensity, section.tint) = (1e6, [1e3; 3]);
        let found = TurnedPanorama::new(sun, &section).radiance(omega);
        assert_eq!(found, [MAX_RADIANCE; 3]);
    }
}
