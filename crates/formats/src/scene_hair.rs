//! `[hair]` of a scene: the fibres' optics.
//!
//! Ranges, units and help of every key are rows of [`params::HAIR`](crate::params::HAIR).

use serde::{Deserialize, Serialize};
use strandlight_scattering::{HairParams, Lobe, Model, PerLobe};

/// Concentrations of the two pigments of hair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Melanin {
    /// Of eumelanin, brown to black: 0.3 blond, 1.3 brown, 8 black.
    pub eumelanin: f64,
    /// Of pheomelanin, yellow to red.
    pub pheomelanin: f64,
}

/// Makes [`HairSection`], and [`HairFile`] with its keys as they stand in a file, of one list of
/// fields. The first three, of which `sigma_a` differs between the two, stand here.
macro_rules! hair_section {
    ($($(#[doc = $doc:literal])* $(#[serde($($serde:tt)*)])? $field:ident: $type:ty = $default:expr;)*) => {
        /// `[hair]`: Marschner's parameters, as his Table 1 gives them.
        ///
        /// Widths are *standard deviations* in degrees; Xu's bandwidths, which the code computes
        /// with, are sqrt(2) times that.
        ///
        /// The colour is given in one of three ways: `sigma_a`, `reflectance` or `melanin`. A file
        /// that gives two of them is refused.
        #[derive(Clone, Debug, Serialize, Deserialize)]
        #[serde(try_from = "HairFile", into = "HairFile")]
        pub struct HairSection {
            /// Name of the preset that the keys left out are taken from; see [`preset_names`].
            ///
            /// [`preset_names`]: crate::preset_names
            pub preset: Option<String>,
            /// Index of refraction.
            pub eta: f64,
            /// Absorption per fibre radius, linear RGB. Without effect, and not in the file, where
            /// `reflectance` or `melanin` is given.
            pub sigma_a: [f64; 3],
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        impl Default for HairSection {
            /// The hair of [`HairParams::default`].
            fn default() -> Self {
                let HairParams { eta, sigma_a, .. } = HairParams::default();
                HairSection { preset: None, eta, sigma_a, $($field: $default,)* }
            }
        }

        /// The keys as they stand in a file: those of [`HairSection`], and which of them gives the
        /// colour.
        #[derive(PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        struct HairFile {
            #[serde(skip_serializing_if = "Option::is_none")]
            preset: Option<String>,
            eta: f64,
            #[serde(skip_serializing_if = "Option::is_none")]
            sigma_a: Option<[f64; 3]>,
            $($(#[serde($($serde)*)])? $field: $type,)*
        }

        impl From<HairSection> for HairFile {
            fn from(hair: HairSection) -> HairFile {
                let is_other = hair.reflectance.is_some() || hair.melanin.is_some();
                HairFile {
                    preset: hair.preset,
                    eta: hair.eta,
                    sigma_a: (!is_other).then_some(hair.sigma_a),
                    $($field: hair.$field,)*
                }
            }
        }

        impl TryFrom<HairFile> for HairSection {
            type Error = String;

            fn try_from(file: HairFile) -> std::result::Result<HairSection, String> {
                file.check_color()?;
                Ok(HairSection {
                    preset: file.preset,
                    eta: file.eta,
                    sigma_a: file.sigma_a.unwrap_or(HairSection::default().sigma_a),
                    $($field: file.$field,)*
                })
            }
        }
    };
}

hair_section! {
    /// The fibre model; not in the file where it is Marschner's.
    #[serde(skip_serializing_if = "is_marschner")]
    model: Model = Model::Marschner;
    /// Colour of a whole head of such hair, linear RGB, from which the absorption is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    reflectance: Option<[f64; 3]> = None;
    /// Pigments, from which the absorption is found.
    #[serde(skip_serializing_if = "Option::is_none")]
    melanin: Option<Melanin> = None;
    /// Longitudinal shift alpha in theta_h.
    shift_deg: PerLobe<f64> = HairParams::DEFAULT_SHIFT_DEG;
    /// Standard deviation of the longitudinal lobe in theta_h.
    width_deg: PerLobe<f64> = HairParams::DEFAULT_WIDTH_DEG;
    /// Standard deviation of the blur of the TRT caustic.
    caustic_width_deg: f64 = HairParams::DEFAULT_CAUSTIC_WIDTH_DEG;
    /// Eccentricity of the cross section; 1 is circular.
    eccentricity: f64 = HairParams::default().eccentricity;
    /// Thickness of a fibre; if absent, the groom's attribute `diameter`, or else
    /// [`HairSection::DEFAULT_DIAMETER_CM`].
    #[serde(skip_serializing_if = "Option::is_none")]
    diameter_cm: Option<f64> = None;
    /// How much thinner strands are at the tip than at the root, as a share of the thickness
    /// there; without effect on a groom whose file gives a diameter per point. Not in the file
    /// where it is 0.
    #[serde(skip_serializing_if = "is_zero")]
    taper: f64 = 0.0;
    /// The modes to draw; at least one, none twice.
    modes: Vec<Lobe> = Lobe::ALL.to_vec();
    /// d_f, share of blocked light that is scattered on forward; if absent, the renderer's.
    #[serde(skip_serializing_if = "Option::is_none")]
    density_forward: Option<f64> = None;
    /// d_b, share of the hair behind a fibre that scatters light back; likewise.
    #[serde(skip_serializing_if = "Option::is_none")]
    density_back: Option<f64> = None;
    /// Factor on R; not in the file where it is 1.
    #[serde(skip_serializing_if = "is_one")]
    intensity_r: f64 = HairParams::default().intensity.r;
    /// Factor on TT; likewise.
    #[serde(skip_serializing_if = "is_one")]
    intensity_tt: f64 = HairParams::default().intensity.tt;
    /// Factor on TRT; likewise.
    #[serde(skip_serializing_if = "is_one")]
    intensity_trt: f64 = HairParams::default().intensity.trt;
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde calls it")]
fn is_marschner(value: &Model) -> bool {
    *value == Model::Marschner
}

impl PartialEq for HairSection {
    /// As their files would be: a `sigma_a` without effect makes no difference.
    fn eq(&self, other: &HairSection) -> bool {
        HairFile::from(self.clone()) == HairFile::from(other.clone())
    }
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

impl HairFile {
    /// Refuses a colour that is given twice.
    fn check_color(&self) -> std::result::Result<(), String> {
        let given: Vec<&str> = [
            self.sigma_a.map(|_| "hair.sigma_a"),
            self.reflectance.map(|_| "hair.reflectance"),
            self.melanin.map(|_| "hair.melanin"),
        ]
        .into_iter()
        .flatten()
        .collect();
        if given.len() > 1 {
            let names = given.join(" and ");
            return Err(format!("{names} both give the colour: keep one of them"));
        }
        Ok(())
    }
}

impl HairSection {
    /// Thickness of a human hair in cm, the default.
    pub const DEFAULT_DIAMETER_CM: f64 = 0.008;

    /// The keys that give the colour, each in its own way.
    pub const COLOR_KEYS: [&str; 3] = ["sigma_a", "reflectance", "melanin"];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Result;
    use crate::scene::Scene;

    fn scene(hair: &str) -> Result<Scene> {
        Scene::from_lines(&format!("[hair]\n{hair}"))
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
