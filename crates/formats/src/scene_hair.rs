//! `[hair]` of a scene: the fibres' optics.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::validate::in_range;

/// A value in degrees for each mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PerModeDeg {
    /// Of R.
    pub r: f64,
    /// Of TT.
    pub tt: f64,
    /// Of TRT.
    pub trt: f64,
}

/// A scattering mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Surface reflection.
    #[serde(rename = "R")]
    R,
    /// Transmission.
    #[serde(rename = "TT")]
    Tt,
    /// One internal reflection.
    #[serde(rename = "TRT")]
    Trt,
}

/// Concentrations of the two pigments of hair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Melanin {
    /// Of eumelanin, brown to black, 0..=20: 0.3 blond, 1.3 brown, 8 black.
    pub eumelanin: f64,
    /// Of pheomelanin, yellow to red, 0..=20.
    pub pheomelanin: f64,
}

/// `[hair]`: Marschner's parameters, as his Table 1 gives them.
///
/// Widths are *standard deviations* in degrees; Xu's bandwidths, which the code computes with,
/// are sqrt(2) times that.
///
/// The colour is given in one of three ways: `sigma_a`, `reflectance` or `melanin`. A file that
/// gives two of them is refused.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "HairFile", into = "HairFile")]
pub struct HairSection {
    /// Name of the preset that the keys left out are taken from; see [`preset_names`].
    ///
    /// [`preset_names`]: crate::preset_names
    pub preset: Option<String>,
    /// Index of refraction, 1.0001..=3.
    pub eta: f64,
    /// Absorption per fibre radius, linear RGB, 0..=50. Without effect, and not in the file, where
    /// `reflectance` or `melanin` is given.
    pub sigma_a: [f64; 3],
    /// Colour of a whole head of such hair, linear RGB, 0..=1, from which the absorption is found.
    pub reflectance: Option<[f64; 3]>,
    /// Pigments, from which the absorption is found.
    pub melanin: Option<Melanin>,
    /// Longitudinal shift alpha in theta_h, -28..=28.
    pub shift_deg: PerModeDeg,
    /// Standard deviation of the longitudinal lobe in theta_h, 0.05..=60.
    pub width_deg: PerModeDeg,
    /// Standard deviation of the blur of the TRT caustic, 0.5..=60.
    pub caustic_width_deg: f64,
    /// Eccentricity of the cross section, 0.5..=2; 1 is circular.
    pub eccentricity: f64,
    /// Thickness of a fibre, 1e-5..=10; if absent, the groom's attribute `diameter`, or else
    /// [`HairSection::DEFAULT_DIAMETER_CM`].
    pub diameter_cm: Option<f64>,
    /// The modes to draw; at least one, none twice.
    pub modes: Vec<Mode>,
    /// d_f, share of blocked light that is scattered on forward, 0..=1; if absent, the renderer's.
    pub density_forward: Option<f64>,
    /// d_b, share of the hair behind a fibre that scatters light back, 0..=1; likewise.
    pub density_back: Option<f64>,
}

impl PartialEq for HairSection {
    /// As their files would be: a `sigma_a` without effect makes no difference.
    fn eq(&self, other: &HairSection) -> bool {
        HairFile::from(self.clone()) == HairFile::from(other.clone())
    }
}

/// The keys as they stand in a file: those of [`HairSection`], and which way the colour is given.
#[derive(PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct HairFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    preset: Option<String>,
    eta: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma_a: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reflectance: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    melanin: Option<Melanin>,
    shift_deg: PerModeDeg,
    width_deg: PerModeDeg,
    caustic_width_deg: f64,
    eccentricity: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    diameter_cm: Option<f64>,
    modes: Vec<Mode>,
    #[serde(skip_serializing_if = "Option::is_none")]
    density_forward: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    density_back: Option<f64>,
}

impl Default for HairFile {
    /// No colour, and what [`HairSection`] has for the rest.
    fn default() -> Self {
        HairFile {
            sigma_a: None,
            ..HairSection::default().into()
        }
    }
}

impl From<HairSection> for HairFile {
    fn from(hair: HairSection) -> HairFile {
        let other = hair.reflectance.is_some() || hair.melanin.is_some();
        HairFile {
            preset: hair.preset,
            eta: hair.eta,
            sigma_a: (!other).then_some(hair.sigma_a),
            reflectance: hair.reflectance,
            melanin: hair.melanin,
            shift_deg: hair.shift_deg,
            width_deg: hair.width_deg,
            caustic_width_deg: hair.caustic_width_deg,
            eccentricity: hair.eccentricity,
            diameter_cm: hair.diameter_cm,
            modes: hair.modes,
            density_forward: hair.density_forward,
            density_back: hair.density_back,
        }
    }
}

impl TryFrom<HairFile> for HairSection {
    type Error = String;

    fn try_from(file: HairFile) -> std::result::Result<HairSection, String> {
        let given: Vec<&str> = [
            file.sigma_a.map(|_| "hair.sigma_a"),
            file.reflectance.map(|_| "hair.reflectance"),
            file.melanin.map(|_| "hair.melanin"),
        ]
        .into_iter()
        .flatten()
        .collect();
        if given.len() > 1 {
            let names = given.join(" and ");
            return Err(format!("{names} both give the colour: keep one of them"));
        }
        Ok(HairSection {
            preset: file.preset,
            eta: file.eta,
            sigma_a: file.sigma_a.unwrap_or(HairSection::default().sigma_a),
            reflectance: file.reflectance,
            melanin: file.melanin,
            shift_deg: file.shift_deg,
            width_deg: file.width_deg,
            caustic_width_deg: file.caustic_width_deg,
            eccentricity: file.eccentricity,
            diameter_cm: file.diameter_cm,
            modes: file.modes,
            density_forward: file.density_forward,
            density_back: file.density_back,
        })
    }
}

impl HairSection {
    /// Thickness of a human hair in cm where nobody says otherwise.
    pub const DEFAULT_DIAMETER_CM: f64 = 0.008;

    /// The keys that give the colour, each in its own way.
    pub const COLOR_KEYS: [&str; 3] = ["sigma_a", "reflectance", "melanin"];
}

impl Default for HairSection {
    /// Brown hair, in the middle of Marschner's Table 1.
    fn default() -> Self {
        HairSection {
            preset: None,
            eta: 1.55,
            sigma_a: [0.26, 0.42, 0.83],
            reflectance: None,
            melanin: None,
            shift_deg: PerModeDeg {
                r: -7.0,
                tt: 3.5,
                trt: 10.5,
            },
            width_deg: PerModeDeg {
                r: 7.0,
                tt: 3.5,
                trt: 14.0,
            },
            caustic_width_deg: 6.0,
            eccentricity: 1.0,
            diameter_cm: None,
            modes: vec![Mode::R, Mode::Tt, Mode::Trt],
            density_forward: None,
            density_back: None,
        }
    }
}

impl HairSection {
    pub(crate) fn validate(&self) -> Result<()> {
        in_range("hair.eta", self.eta, 1.0001, 3.0)?;
        for value in self.sigma_a {
            in_range("hair.sigma_a", value, 0.0, 50.0)?;
        }
        if let (Some(_), Some(melanin)) = (self.reflectance, self.melanin) {
            let range = "absent where hair.reflectance is given";
            return Err(Error::value("hair.melanin", format!("{melanin:?}"), range));
        }
        for value in self.reflectance.into_iter().flatten() {
            in_range("hair.reflectance", value, 0.0, 1.0)?;
        }
        if let Some(melanin) = self.melanin {
            in_range("hair.melanin.eumelanin", melanin.eumelanin, 0.0, 20.0)?;
            in_range("hair.melanin.pheomelanin", melanin.pheomelanin, 0.0, 20.0)?;
        }
        for (mode, value) in [
            ("r", self.shift_deg.r),
            ("tt", self.shift_deg.tt),
            ("trt", self.shift_deg.trt),
        ] {
            in_range(format!("hair.shift_deg.{mode}"), value, -28.0, 28.0)?;
        }
        for (mode, value) in [
            ("r", self.width_deg.r),
            ("tt", self.width_deg.tt),
            ("trt", self.width_deg.trt),
        ] {
            in_range(format!("hair.width_deg.{mode}"), value, 0.05, 60.0)?;
        }
        in_range("hair.caustic_width_deg", self.caustic_width_deg, 0.5, 60.0)?;
        in_range("hair.eccentricity", self.eccentricity, 0.5, 2.0)?;
        for (key, density) in [
            ("hair.density_forward", self.density_forward),
            ("hair.density_back", self.density_back),
        ] {
            if let Some(density) = density {
                in_range(key, density, 0.0, 1.0)?;
            }
        }
        if let Some(diameter) = self.diameter_cm {
            in_range("hair.diameter_cm", diameter, 1e-5, 10.0)?;
        }
        let repeated = (1..self.modes.len()).any(|ix| self.modes[..ix].contains(&self.modes[ix]));
        if self.modes.is_empty() || repeated {
            let names = format!("{:?}", self.modes);
            return Err(Error::value(
                "hair.modes",
                names,
                "some of R, TT, TRT, each once",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn scene(hair: &str) -> Result<Scene> {
        Scene::of_lines(&format!("[hair]\n{hair}"))
    }

    #[test]
    fn the_colour_is_given_in_one_of_three_ways() {
        for text in [
            "sigma_a = [1.0, 2.0, 3.0]",
            "reflectance = [0.1, 0.2, 0.0]",
            "melanin = { eumelanin = 1.3 }",
            "preset = 'blond'\nmelanin = { pheomelanin = 1.3, eumelanin = 0.2 }",
            "preset = 'blond'\nreflectance = [0.1, 0.2, 0.3]",
            "preset = 'blond'",
        ] {
            let read = scene(text).expect(text);
            let file = read.to_toml_string().expect("valid");
            let ways = HairSection::COLOR_KEYS;
            let written = ways.iter().filter(|key| file.contains(*key)).count();
            assert_eq!(written, 1, "{text}:\n{file}");
            assert_eq!(Scene::from_toml(&file).expect("valid"), read, "{file}");
        }
        let hair = scene("reflectance = [0.1, 0.2, 0.3]").expect("valid").hair;
        assert_eq!(hair.reflectance, Some([0.1, 0.2, 0.3]));
        for (text, needles) in [
            (
                "sigma_a = [1.0, 2.0, 3.0]\nreflectance = [0.1, 0.2, 0.3]",
                ["hair.sigma_a", "hair.reflectance"],
            ),
            (
                "preset = 'red'\nmelanin = {}\nreflectance = [0.1, 0.2, 0.3]",
                ["hair.melanin", "hair.reflectance"],
            ),
            ("reflectance = [0.1, 0.2, 1.1]", ["hair.reflectance", "1.1"]),
            ("melanin = { eumelanin = 21.0 }", ["eumelanin", "21"]),
            ("melanin = { eumelamin = 1.0 }", ["eumelamin", "line 7"]),
        ] {
            let error = scene(text).expect_err(text).to_string();
            assert!(
                needles.iter().all(|needle| error.contains(needle)),
                "{text}: {error}"
            );
        }
    }
}
