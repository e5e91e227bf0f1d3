//! Named hair: the `[hair]` sections of `data/presets`, built into the program.
//!
//! A scene says `preset = "zinke-fig8-blond"` in its `[hair]`; keys beside it take precedence,
//! and what neither says has its default. The files note where each number was published and how
//! its unit and convention were converted.

use strandlight_data::PRESETS;
use toml::Table;

use crate::error::{Error, Result};
use crate::scene_hair::HairSection;

/// The names of all presets, sorted.
pub fn preset_names() -> impl Iterator<Item = &'static str> {
    PRESETS.iter().map(|(name, _)| *name)
}

impl HairSection {
    /// The hair that the preset `name` describes.
    ///
    /// # Errors
    /// `Value` if there is none of that name.
    pub fn preset(name: &str) -> Result<HairSection> {
        overlaid(name, Table::new())
    }

    /// This hair with the optics of the preset `name`; its thickness, model, modes and densities stay
    /// unless the preset has its own.
    ///
    /// # Errors
    /// `Value` if there is none of that name.
    pub fn with_preset(&self, name: &str) -> Result<HairSection> {
        let preset = HairSection::preset(name)?;
        let plain = HairSection::default();
        Ok(HairSection {
            diameter_cm: preset.diameter_cm.or(self.diameter_cm),
            taper: if preset.taper == plain.taper {
                self.taper
            } else {
                preset.taper
            },
            modes: if preset.modes == plain.modes {
                self.modes.clone()
            } else {
                preset.modes
            },
            model: if preset.model == plain.model {
                self.model
            } else {
                preset.model
            },
            density_forward: preset.density_forward.or(self.density_forward),
            density_back: preset.density_back.or(self.density_back),
            ..preset
        })
    }
}

/// The preset `name` with the keys of `own` laid over it.
pub(crate) fn overlaid(name: &str, own: Table) -> Result<HairSection> {
    let text = PRESETS
        .iter()
        .find(|(other, _)| *other == name)
        .map(|(_, text)| *text)
        .ok_or_else(|| {
            let names: Vec<&str> = preset_names().collect();
            Error::value("hair.preset", name, format!("one of {}", names.join(", ")))
        })?;
    let broken = |error: toml::de::Error| Error::value("hair.preset", name, error.to_string());
    let mut file: Table = text.parse().map_err(broken)?;
    let mut hair = match file.remove("hair") {
        Some(toml::Value::Table(hair)) => hair,
        _ => Table::new(),
    };
    // Another way to give the colour takes the place of the preset's.
    let colors = HairSection::COLOR_KEYS;
    if colors.iter().any(|key| own.contains_key(*key)) {
        hair.retain(|key, _| !colors.contains(&key));
    }
    hair.extend(own);
    hair.insert("preset".to_owned(), name.into());
    hair.try_into().map_err(broken)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use strandlight_scattering::PerLobe;

    fn scene(hair: &str) -> Result<Scene> {
        Scene::from_lines(&format!("[hair]\n{hair}"))
    }

    #[test]
    fn every_preset_is_valid_and_says_where_it_is_from() {
        let mut last = "";
        for (name, text) in PRESETS {
            assert!(*name > last, "{name} is out of order");
            last = name;
            assert!(text.starts_with("# "), "{name}");
            let hair = HairSection::preset(name).expect(name);
            assert_eq!(hair.preset.as_deref(), Some(*name));
            let scene = scene(&format!("preset = '{name}'")).expect(name);
            assert_eq!(scene.hair, hair, "{name}");
            // A preset's keys are all of the section's, and nothing else is in the file.
            let file: Table = text.parse().expect(name);
            assert_eq!(file.keys().collect::<Vec<_>>(), ["hair"], "{name}");
            let written = scene.to_toml_string().expect(name);
            let again = Scene::from_toml(&written).expect(name);
            assert_eq!(again, scene, "{name}");
        }
        assert!(PRESETS.len() >= 20);
    }

    #[test]
    fn the_folder_holds_these_presets_and_no_other() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/presets");
        let mut found: Vec<String> = std::fs::read_dir(folder)
            .expect("part of the project")
            .map(|entry| entry.expect("readable").file_name())
            .filter_map(|name| Some(name.to_str()?.strip_suffix(".toml")?.to_owned()))
            .collect();
        found.sort();
        assert_eq!(found, preset_names().collect::<Vec<_>>());
    }

    #[test]
    fn a_scene_overrides_its_preset() {
        let hair = scene("preset = 'zinke-fig9-wide'\neta = 1.6\nsigma_a = [1.0, 2.0, 3.0]")
            .expect("valid")
            .hair;
        assert_eq!((hair.eta, hair.sigma_a), (1.6, [1.0, 2.0, 3.0]));
        assert_eq!(hair.width_deg.trt, 30.0);
        assert_eq!(hair.shift_deg, HairSection::default().shift_deg);
        let error = scene("preset = 'purple'").expect_err("no such preset");
        let text = error.to_string();
        assert!(
            text.contains("purple") && text.contains("zinke-fig8-blond"),
            "{text}"
        );
        // Faults beside a preset are reported with their place.
        let error = scene("preset = 'blond'\ncolour = 1").expect_err("no such key");
        assert!(error.to_string().contains("line 8"), "{error}");
        let error = scene("preset = 'blond'\neta = 9.0").expect_err("out of range");
        assert!(error.to_string().contains("hair.eta"), "{error}");
    }

    /// The numbers as the papers print them, in the papers' units.
    #[test]
    fn published_numbers_are_converted_as_documented() {
        let hair = |name: &str| HairSection::preset(name).expect("a preset");
        for (name, sigma_a) in [
            ("zinke-fig8-light-blond", [0.03, 0.07, 0.15]),
            ("zinke-fig8-blond", [0.15, 0.2, 0.3]),
            ("zinke-fig8-brown", [0.2, 0.3, 0.5]),
            ("zinke-fig8-red", [0.3, 0.6, 1.2]),
            ("xu-fig10-a", [0.36; 3]),
            ("xu-fig10-b", [0.55; 3]),
            ("xu-fig10-c", [1.0; 3]),
            ("xu-fig10-d", [0.27, 0.39, 0.65]),
            ("xu-fig10-e", [0.23, 0.42, 0.42]),
        ] {
            assert_eq!(hair(name).sigma_a, sigma_a, "{name}");
        }
        for (name, [r, tt, trt]) in [
            ("zinke-fig9-narrow", [4.0, 5.0, 7.5]),
            ("zinke-fig9-medium", [8.0, 10.0, 15.0]),
            ("zinke-fig9-wide", [16.0, 20.0, 30.0]),
        ] {
            assert_eq!(hair(name).width_deg, PerLobe { r, tt, trt }, "{name}");
        }
        // w_c is a bandwidth in radians: sqrt(2) standard deviations.
        for (name, eta, w_c) in [
            ("xu-fig9-a", 1.54, 0.06_f64),
            ("xu-fig9-b", 1.65, 0.06),
            ("xu-fig9-c", 1.65, 0.20),
        ] {
            let found = hair(name);
            assert_eq!(found.eta, eta, "{name}");
            let back = found.caustic_width_deg.to_radians() * 2.0_f64.sqrt();
            assert!((back - w_c).abs() < 1e-6, "{name}: {back}");
        }
        // Xu's coupling of the modes.
        for name in
            preset_names().filter(|name| name.starts_with("xu-fig7") || name.starts_with("xu-fig8"))
        {
            let HairSection {
                shift_deg: a,
                width_deg: b,
                ..
            } = hair(name);
            assert_eq!((a.tt, a.trt), (-a.r / 2.0, -1.5 * a.r), "{name}");
            assert_eq!((b.tt, b.trt), (b.r / 2.0, 2.0 * b.r), "{name}");
            assert!(
                (-10.0..=-5.0).contains(&a.r) && (5.0..=10.0).contains(&b.r),
                "{name}"
            );
        }
        // Melanin: concentrations of eumelanin and pheomelanin.
        for (name, e, p) in [
            ("white", 0.02, 0.0),
            ("blond", 0.3, 0.0),
            ("red", 0.1, 0.9),
            ("auburn", 0.5, 0.5),
            ("brown", 1.3, 0.0),
            ("black", 8.0, 0.0),
        ] {
            let published = [[0.419, 0.187], [0.697, 0.4], [1.37, 1.05]];
            for (found, [of_e, of_p]) in hair(name).sigma_a.into_iter().zip(published) {
                let expected = e * of_e + p * of_p;
                assert!(
                    (found - expected).abs() <= 5.1e-5,
                    "{name}: {found} {expected}"
                );
            }
        }
    }
}
