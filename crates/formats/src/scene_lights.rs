//! `[lights]` of a scene: the environment, and what is changed of it light by light.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// `[lights]`; ranges are those of [`params::LIGHTS`](crate::params::LIGHTS).
///
/// Lights are named by their place in the light set's file, from 0. A light sends out the set's
/// amplitude times `intensity` and `tint`, and times those of its own entry of `adjust`; nothing
/// where it is muted or others are solo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightsSection {
    /// A `.lights` file.
    pub file: PathBuf,
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
            intensity: 1.0,
            rotate_deg: 0.0,
            tint: white(),
            muted: Vec::new(),
            solo: Vec::new(),
            adjust: Vec::new(),
        }
    }

    /// Does light `ix` of the set shine: neither muted nor left out of those that are solo?
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

    /// The largest number of a light that is named, with the key that names it.
    pub fn largest_light(&self) -> Option<(&'static str, u32)> {
        let of = |key, lights: &[u32]| lights.iter().copied().max().map(|ix| (key, ix));
        let adjusted: Vec<u32> = self.adjust.iter().map(|own| own.light).collect();
        [
            of("lights.muted", &self.muted),
            of("lights.solo", &self.solo),
            of("lights.adjust", &adjusted),
        ]
        .into_iter()
        .flatten()
        .max_by_key(|(_, ix)| *ix)
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
    use crate::scene::Scene;

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
        assert_eq!(lights.largest_light(), Some(("lights.adjust", 4)));
        let plain = LightsSection::new("b");
        assert_eq!(plain.factor(7), [1.0; 3]);
        assert_eq!(plain.largest_light(), None);
        let mut changed = plain;
        changed.adjust_mut(7).tint = [0.5; 3];
        changed.adjust_mut(7).intensity = 4.0;
        assert_eq!(changed.factor(7), [2.0; 3]);
        assert_eq!(changed.adjust.len(), 1);
    }

    #[test]
    fn every_key_survives_the_file() {
        let text = "tint = [1.0, 0.5, 0.0]\nmuted = [3]\nsolo = [1, 3, 4]\n\
                    [[lights.adjust]]\nlight = 4\nintensity = 3.0\n";
        let read = Scene::from_lines(text).expect("valid");
        let again = Scene::from_toml(&read.to_toml_string().expect("valid")).expect("valid");
        assert_eq!(again, read);
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
        ] {
            let error = Scene::from_lines(text).expect_err(text).to_string();
            assert!(error.contains(needle), "{text}: {error}");
        }
    }
}
