//! `[lights]` of a scene: the environment, and what is changed of it light by light.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use strandlight_scattering::spherical_gaussian::solid_angle;

use crate::light_set::SrbfLight;

/// Most lights that a scene adds to its set.
pub const MAX_ADDED_LIGHTS: usize = 64;

/// `[lights]`; ranges are those of [`params::LIGHTS`](crate::params::LIGHTS).
///
/// Lights are named by their place in the light set's file, from 0; those of `added` follow in
/// their order. A light of the set sends out the set's amplitude times `intensity` and `tint`, and times
/// those of its own entry of `adjust`. Whatever is muted, or not solo where others are, sends out nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightsSection {
    /// A `.lights` file.
    pub file: PathBuf,
    /// A `.panorama` file: the map that the lights were fitted to, for the background
    /// [`Background::Panorama`](crate::Background::Panorama).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panorama: Option<PathBuf>,
    /// The HDR map that the lights were fitted to, OpenEXR or Radiance: what ground truth is lit by in place of the set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<PathBuf>,
    /// Factor on all lights.
    #[serde(default = "one")]
    pub intensity: f64,
    /// Turns the environment about +Y, counter-clockwise seen from above.
    #[serde(default)]
    pub rotate_deg: f64,
    /// Factor on each channel of all lights, linear RGB.
    #[serde(default = "white")]
    pub tint: [f64; 3],
    /// Lights that are switched off, none twice.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub muted: Vec<u32>,
    /// If there are any, lights not among them are switched off; none twice. A light that is
    /// muted as well stays off.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub solo: Vec<u32>,
    /// Changes of single lights, at most one for each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub adjust: Vec<LightAdjust>,
    /// Lights beside those of the set, at most [`MAX_ADDED_LIGHTS`]: key, fill and rim lights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub added: Vec<AddedLight>,
}

/// `[[lights.added]]`: a Gaussian light beside those of the set. It is fixed in world space: neither
/// `rotate_deg`, `intensity` nor `tint` of `[lights]` change it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AddedLight {
    /// Where it comes from, about +Y: 0 is +Z, 90 is +X.
    pub azimuth_deg: f64,
    /// Above the horizon.
    pub elevation_deg: f64,
    /// Standard deviation of the Gaussian.
    pub width_deg: f64,
    /// Its radiance integrated over the sphere, whatever its width.
    pub intensity: f64,
    /// Factor on each channel, linear RGB.
    pub color: [f64; 3],
}

impl Default for AddedLight {
    /// White, from the front, left and above.
    fn default() -> Self {
        AddedLight {
            azimuth_deg: -45.0,
            elevation_deg: 35.0,
            width_deg: 8.0,
            intensity: 1.0,
            color: white(),
        }
    }
}

impl AddedLight {
    /// The light that it is. Its amplitude is `intensity` times `color` over the
    /// [`solid_angle`] of its width.
    pub fn light(&self) -> SrbfLight {
        let (azimuth, elevation) = (
            self.azimuth_deg.to_radians(),
            self.elevation_deg.to_radians(),
        );
        let across = elevation.cos();
        let direction = [
            azimuth.sin() * across,
            elevation.sin(),
            azimuth.cos() * across,
        ];
        let lambda = std::f64::consts::SQRT_2 * self.width_deg.to_radians();
        let amplitude = self.intensity / solid_angle(lambda);
        SrbfLight {
            direction: direction.map(|x| x as f32),
            lambda: lambda as f32,
            rgb: self.color.map(|x| (amplitude * x) as f32),
        }
    }

    /// Lets it come from a direction, a vector of any length but zero, to a hundredth of a degree.
    pub fn point_to(&mut self, [x, y, z]: [f64; 3]) {
        let rounded = |degrees: f64| (100.0 * degrees).round() / 100.0;
        self.azimuth_deg = rounded(x.atan2(z).to_degrees());
        self.elevation_deg = rounded(y.atan2(x.hypot(z)).to_degrees());
    }
}

/// `[[lights.adjust]]`: factors on one light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightAdjust {
    /// Which light of the set.
    pub light: u32,
    /// Factor.
    #[serde(default = "one")]
    pub intensity: f64,
    /// Factor on each channel, linear RGB.
    #[serde(default = "white")]
    pub tint: [f64; 3],
}

impl LightAdjust {
    /// Light `light` as it is in the set.
    pub fn new(light: u32) -> Self {
        LightAdjust {
            light,
            intensity: one(),
            tint: white(),
        }
    }
}

impl LightsSection {
    /// The light set in `file` as it is.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        LightsSection {
            file: file.into(),
            panorama: None,
            map: None,
            intensity: 1.0,
            rotate_deg: 0.0,
            tint: white(),
            muted: Vec::new(),
            solo: Vec::new(),
            adjust: Vec::new(),
            added: Vec::new(),
        }
    }

    /// Does light `ix` shine: neither muted nor left out of those that are solo?
    pub fn is_on(&self, ix: u32) -> bool {
        !self.muted.contains(&ix) && (self.solo.is_empty() || self.solo.contains(&ix))
    }

    /// What the amplitude of light `ix` of the set is multiplied by; zero where it is off.
    pub fn factor(&self, ix: u32) -> [f64; 3] {
        if !self.is_on(ix) {
            return [0.0; 3];
        }
        let own = self.adjust.iter().find(|own| own.light == ix);
        let LightAdjust {
            intensity, tint, ..
        } = own.copied().unwrap_or(LightAdjust::new(ix));
        let intensity = intensity * self.intensity;
        std::array::from_fn(|channel| intensity * tint[channel] * self.tint[channel])
    }

    /// The entry of light `ix` in `adjust`, made if there is none.
    pub fn adjust_mut(&mut self, ix: u32) -> &mut LightAdjust {
        let found = self.adjust.iter().position(|own| own.light == ix);
        let at = found.unwrap_or_else(|| {
            self.adjust.push(LightAdjust::new(ix));
            self.adjust.len() - 1
        });
        &mut self.adjust[at]
    }

    /// A light that is named and that is not there in a set of `n_set` lights, with the key that names it.
    pub fn missing_light(&self, n_set: usize) -> Option<(&'static str, u32)> {
        let missing = |key, lights: &[u32], n: usize| {
            let largest = lights.iter().copied().max();
            largest.filter(|&ix| ix as usize >= n).map(|ix| (key, ix))
        };
        let n_all = n_set + self.added.len();
        let adjusted: Vec<u32> = self.adjust.iter().map(|own| own.light).collect();
        missing("lights.adjust", &adjusted, n_set)
            .or_else(|| missing("lights.muted", &self.muted, n_all))
            .or_else(|| missing("lights.solo", &self.solo, n_all))
    }

    /// Takes the added light `at` away, in a set of `n_set` lights: those after it move up.
    pub fn remove_added(&mut self, at: usize, n_set: usize) {
        if at >= self.added.len() {
            return;
        }
        self.added.remove(at);
        let removed = (n_set + at) as u32;
        for lights in [&mut self.muted, &mut self.solo] {
            lights.retain(|&ix| ix != removed);
            for ix in lights.iter_mut().filter(|ix| **ix > removed) {
                *ix -= 1;
            }
        }
    }

    /// Takes `file` in place of a set of `n_before` lights: what was said of its single lights is forgotten, and so are
    /// panorama and map; what was said of added lights, whose numbers follow those of the `n_after` of the new set, stays.
    pub fn change_set(&mut self, file: PathBuf, n_before: usize, n_after: usize) {
        self.file = file;
        (self.panorama, self.map) = (None, None);
        self.adjust.clear();
        for lights in [&mut self.muted, &mut self.solo] {
            lights.retain(|&ix| ix as usize >= n_before);
            for ix in lights {
                *ix = (*ix as usize - n_before + n_after) as u32;
            }
        }
    }
}

const fn one() -> f64 {
    1.0
}

const fn white() -> [f64; 3] {
    [1.0; 3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Background, Scene};

    #[test]
    fn factors_are_those_of_all_keys() {
        let lights = Scene::from_lines(
            "intensity = 2.0\ntint = [1.0, 0.5, 0.0]\nmuted = [3]\nsolo = [1, 3, 4]\n\
             [[lights.adjust]]\nlight = 4\nintensity = 3.0\n\
             [[lights.adjust]]\nlight = 0\ntint = [0.0, 1.0, 2.0]\n",
        )
        .expect("valid")
        .lights;
        assert_eq!(lights.factor(0), [0.0; 3]);
        assert_eq!(lights.factor(1), [2.0, 1.0, 0.0]);
        assert_eq!(lights.factor(3), [0.0; 3]);
        assert_eq!(lights.factor(4), [6.0, 3.0, 0.0]);
        assert_eq!(lights.missing_light(5), None);
        assert_eq!(lights.missing_light(4), Some(("lights.adjust", 4)));
        assert_eq!(lights.missing_light(1), Some(("lights.adjust", 4)));
        let plain = LightsSection::new("b");
        assert_eq!(plain.factor(7), [1.0; 3]);
        assert_eq!(plain.missing_light(1), None);
        let mut changed = plain;
        changed.adjust_mut(7).tint = [0.5; 3];
        changed.adjust_mut(7).intensity = 4.0;
        assert_eq!(changed.factor(7), [2.0; 3]);
        assert_eq!(changed.adjust.len(), 1);
    }

    #[test]
    fn added_lights_are_as_strong_at_any_width() {
        let mut added = AddedLight {
            azimuth_deg: 90.0,
            elevation_deg: 30.0,
            intensity: 2.0,
            color: [1.0, 0.5, 0.0],
            ..AddedLight::default()
        };
        for width_deg in [0.1, 8.0, 90.0] {
            added.width_deg = width_deg;
            let light = added.light();
            light.validate().expect("a light");
            let angle = solid_angle(f64::from(light.lambda));
            let power = light.rgb.map(|x| f64::from(x) * angle);
            for (found, expected) in power.into_iter().zip([2.0, 1.0, 0.0]) {
                assert!((found - expected).abs() < 1e-5, "{width_deg}: {found}");
            }
        }
        // +X, half as high as it is long.
        let [x, y, z] = added.light().direction;
        assert!((x - 0.75_f32.sqrt()).abs() < 1e-6 && (y - 0.5).abs() < 1e-6 && z.abs() < 1e-6);
        let mut again = AddedLight::default();
        again.point_to([x, y, z].map(f64::from));
        assert_eq!((again.azimuth_deg, again.elevation_deg), (90.0, 30.0));
    }

    #[test]
    fn numbers_of_added_lights_follow_those_of_the_set() {
        let text = "muted = [1, 5, 7]\nsolo = [6, 7]\n[[lights.added]]\n[[lights.added]]\nwidth_deg = 3.0\n\
                    [[lights.added]]\nwidth_deg = 4.0\n[[lights.adjust]]\nlight = 2\n";
        let mut lights = Scene::from_lines(text).expect("valid").lights;
        assert_eq!(lights.missing_light(5), None);
        assert_eq!(lights.missing_light(4), Some(("lights.muted", 7)));
        assert_eq!(lights.missing_light(2), Some(("lights.adjust", 2)));
        lights.remove_added(1, 5);
        assert_eq!(
            (&lights.muted[..], &lights.solo[..]),
            (&[1, 5, 6][..], &[6][..])
        );
        assert_eq!(lights.added[1].width_deg, 4.0);
        lights.change_set("other".into(), 5, 10);
        assert_eq!(
            (&lights.muted[..], &lights.solo[..]),
            (&[10, 11][..], &[11][..])
        );
        assert!(lights.adjust.is_empty() && lights.added.len() == 2);
    }

    #[test]
    fn every_key_survives_the_file() {
        let text = "panorama = 'c.panorama'\nmap = 'maps/c.exr'\ntint = [1.0, 0.5, 0.0]\nmuted = [3]\nsolo = [1, 3, 4]\n\
                    [[lights.adjust]]\nlight = 4\nintensity = 3.0\n\
                    [[lights.added]]\nazimuth_deg = -60.0\nwidth_deg = 4.0\ncolor = [1.0, 0.9, 0.8]\n";
        let read = Scene::from_lines(text).expect("valid");
        let again = Scene::from_toml(&read.to_toml_string().expect("valid")).expect("valid");
        assert_eq!(again, read);
    }

    #[test]
    fn a_map_in_the_background_has_a_file() {
        let behind = "[render]\nbackground = 'panorama'\n";
        let error = Scene::from_lines(behind).expect_err("no file");
        for needle in ["lights.panorama is absent", ".panorama file", "line 4"] {
            assert!(error.to_string().contains(needle), "{error}");
        }
        let named = format!("panorama = 'sky.panorama'\n{behind}");
        let mut scene = Scene::from_lines(&named).expect("valid");
        assert_eq!(scene.render.background, Background::Panorama);
        assert_eq!(scene.seen_panorama_path(), Some("sky.panorama".into()));
        scene.render.background = Background::None;
        assert_eq!(scene.seen_panorama_path(), None);
        assert_eq!(scene.panorama_path(), Some("sky.panorama".into()));
        scene.lights.change_set("other.lights".into(), 1, 1);
        assert_eq!(scene.panorama_path(), None);
    }

    #[test]
    fn a_map_is_a_file_of_the_scene_and_of_its_set() {
        let mut scene = Scene::from_lines("map = 'maps/studio.exr'\n").expect("valid");
        scene.folder = "scenes".into();
        assert_eq!(
            scene.map_path(),
            Some("scenes/maps/studio.exr".into()),
            "seen from the scene's folder"
        );
        assert!(
            scene
                .file_paths()
                .contains(&"scenes/maps/studio.exr".into())
        );
        let error = Scene::from_lines("map = ''\n").expect_err("no name");
        assert!(error.to_string().contains("lights.map is \"\""), "{error}");
        scene.lights.change_set("other.lights".into(), 1, 1);
        assert_eq!(scene.map_path(), None, "it is of another set");
    }

    #[test]
    fn bad_lights_are_named() {
        for (text, needle) in [
            ("tint = [1.0, -1.0, 0.0]", "lights.tint"),
            ("muted = [2, 2]", "lights.muted is 2"),
            ("solo = [65536]", "lights.solo is 65536"),
            ("muted = [-1]", "-1"),
            (
                "[[lights.adjust]]\nlight = 1\nintensity = 1e7",
                "light 1: intensity",
            ),
            ("[[lights.adjust]]\nintensity = 1.0", "light"),
            (
                "[[lights.adjust]]\nlight = 1\n[[lights.adjust]]\nlight = 1",
                "lights.adjust is 1",
            ),
            (
                "[[lights.added]]\n[[lights.added]]\nwidth_deg = 91.0",
                "lights.added[1].width_deg is 91",
            ),
            ("[[lights.added]]\nwide = 1.0", "wide"),
            (
                &"[[lights.added]]\n".repeat(MAX_ADDED_LIGHTS + 1),
                "lights.added is 65, must be at most 64",
            ),
        ] {
            let error = Scene::from_lines(text).expect_err(text).to_string();
            assert!(error.contains(needle), "{text}: {error}");
        }
    }
}
