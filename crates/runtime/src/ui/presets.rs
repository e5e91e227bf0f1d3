//! Presets of hair: those that ship, named for what they look like, and one's own, each a file.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use strandlight_formats::{HairSection, in_plain_words};

/// Presets that ship: the name that scenes have, what it looks like, and where it is from.
pub const SHIPPED: [(&str, &str, &str); 26] = [
    ("black", "Black", "Melanin, natural"),
    ("brown", "Brown", "Melanin, natural"),
    ("auburn", "Auburn", "Melanin, natural"),
    ("red", "Red", "Melanin, natural"),
    ("blond", "Blond", "Melanin, natural"),
    ("white", "White", "Melanin, natural"),
    (
        "zinke-fig8-light-blond",
        "Platinum blond",
        "Zinke 2008, Fig 8",
    ),
    ("zinke-fig8-blond", "Ash blond", "Zinke 2008, Fig 8"),
    ("zinke-fig8-brown", "Dark blond", "Zinke 2008, Fig 8"),
    ("zinke-fig8-red", "Chestnut", "Zinke 2008, Fig 8"),
    (
        "zinke-fig9-narrow",
        "Ash blond, glossy",
        "Zinke 2008, Fig 9",
    ),
    ("zinke-fig9-medium", "Ash blond, satin", "Zinke 2008, Fig 9"),
    ("zinke-fig9-wide", "Ash blond, matt", "Zinke 2008, Fig 9"),
    ("xu-fig10-a", "Light grey", "Xu 2011, Fig 10 a"),
    ("xu-fig10-b", "Grey", "Xu 2011, Fig 10 b"),
    ("xu-fig10-c", "Dark grey", "Xu 2011, Fig 10 c"),
    ("xu-fig10-d", "Light brown", "Xu 2011, Fig 10 d"),
    ("xu-fig10-e", "Copper", "Xu 2011, Fig 10 e"),
    ("xu-fig7-a", "Brown, soft sheen", "Xu 2011, Fig 7 a"),
    ("xu-fig7-b", "Brown, sharp highlights", "Xu 2011, Fig 7 b"),
    ("xu-fig7-c", "Brown, highlights apart", "Xu 2011, Fig 7 c"),
    ("xu-fig8-a", "Brown, medium gloss", "Xu 2011, Fig 8 a"),
    (
        "xu-fig8-b",
        "Brown, glossy, highlights apart",
        "Xu 2011, Fig 8 b",
    ),
    ("xu-fig9-a", "Dark, fine glints", "Xu 2011, Fig 9 a"),
    ("xu-fig9-b", "Dark, bright glints", "Xu 2011, Fig 9 b"),
    ("xu-fig9-c", "Dark, soft glints", "Xu 2011, Fig 9 c"),
];

/// What a preset looks like, in words; its own name where it does not ship.
pub fn label_of(name: &str) -> &str {
    let known = SHIPPED.iter().find(|(shipped, ..)| *shipped == name);
    known.map_or(name, |(_, label, _)| label)
}

/// Presets of one's own.
#[derive(Debug, Default)]
pub struct Presets {
    own: Vec<(String, HairSection)>,
    folder: Option<PathBuf>,
}

/// A file with a preset: the `[hair]` of a scene.
#[derive(Serialize, Deserialize)]
struct File {
    hair: HairSection,
}

impl Presets {
    /// Those that were saved.
    pub fn read() -> Presets {
        Presets::read_from(super::settings::presets_folder())
    }

    fn read_from(folder: Option<PathBuf>) -> Presets {
        let found = folder.as_deref().map(std::fs::read_dir);
        let mut own = Vec::new();
        for entry in found.into_iter().flatten().flatten().flatten() {
            let path = entry.path();
            if let Some(preset) = read(&path) {
                let stem = path.file_stem().unwrap_or_default();
                own.push((stem.to_string_lossy().into_owned(), preset));
            }
        }
        own.sort_by_key(|(name, _)| name.to_lowercase());
        Presets { own, folder }
    }

    /// Their names and what they are, by name.
    pub fn own(&self) -> &[(String, HairSection)] {
        &self.own
    }

    /// Would [`Presets::save`] replace a file?
    pub fn has_file(&self, name: &str) -> bool {
        let path = self.folder.as_ref().map(|folder| path_of(folder, name));
        path.is_some_and(|path| path.symlink_metadata().is_ok())
    }

    /// Saves `hair` as `name`, over an older one of that name.
    ///
    /// # Errors
    /// One line: a name that is no file's, or what the system answers.
    pub fn save(&mut self, name: &str, hair: &HairSection) -> Result<(), String> {
        let name = name.trim();
        let is_file = |c: char| !c.is_control() && !r#"/\:*?"<>|"#.contains(c);
        if name.is_empty() || name.starts_with('.') || !name.chars().all(is_file) {
            return Err("A preset needs a name that a file can have.".to_owned());
        }
        let Some(folder) = &self.folder else {
            return Err("There is no folder for presets here.".to_owned());
        };
        let path = path_of(folder, name);
        let cannot = |error: &dyn std::fmt::Display| {
            format!("{}: cannot be written: {error}", path.display())
        };
        let text = to_text(hair).map_err(|error| cannot(&error))?;
        std::fs::create_dir_all(folder).map_err(|error| cannot(&error))?;
        strandlight_formats::write_file(&path, text.as_bytes()).map_err(|error| cannot(&error))?;
        *self = Presets::read_from(self.folder.take());
        Ok(())
    }

    /// Removes one.
    pub fn remove(&mut self, name: &str) {
        if let Some(folder) = &self.folder {
            let _ = std::fs::remove_file(path_of(folder, name));
        }
        *self = Presets::read_from(self.folder.take());
    }
}

/// The file of the preset `name`.
fn path_of(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{}.toml", name.trim()))
}

fn read(path: &Path) -> Option<HairSection> {
    let is_toml = path.extension()?.eq_ignore_ascii_case("toml");
    let text = is_toml.then(|| std::fs::read_to_string(path).ok())??;
    from_text(&text).ok()
}

/// Hair as a preset has it: the `[hair]` of a scene. It stands by itself, and says nothing of how thick
/// the hair is.
///
/// # Errors
/// In words; none but bugs.
pub fn to_text(hair: &HairSection) -> Result<String, String> {
    let hair = HairSection {
        preset: None,
        diameter_cm: None,
        ..hair.clone()
    };
    toml::to_string(&File { hair }).map_err(|error| error.to_string())
}

/// The hair of a text, be it a preset or a whole scene.
///
/// # Errors
/// What is wrong, in one line.
pub fn from_text(text: &str) -> Result<HairSection, String> {
    let first = |error: toml::de::Error| in_plain_words(error.message());
    let file: File = toml::from_str(text).map_err(first)?;
    Ok(file.hair)
}

/// `hair` with the optics of `preset`; its thickness and taper stay.
pub fn dressed(hair: &HairSection, preset: &HairSection) -> HairSection {
    HairSection {
        diameter_cm: hair.diameter_cm,
        taper: hair.taper,
        ..preset.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_that_ships_has_a_label_of_its_own() {
        let mut shipped: Vec<&str> = SHIPPED.iter().map(|(name, ..)| *name).collect();
        shipped.sort_unstable();
        let names: Vec<&str> = strandlight_formats::preset_names().collect();
        assert_eq!(shipped, names);
        let mut labels: Vec<&str> = SHIPPED.iter().map(|(_, label, _)| *label).collect();
        labels.sort_unstable();
        labels.dedup();
        assert_eq!(labels.len(), SHIPPED.len());
    }

    #[test]
    fn ones_own_are_saved_read_and_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = || Presets::read_from(Some(folder.path().join("presets")));
        let mut presets = at();
        let hair = HairSection {
            eta: 1.7,
            diameter_cm: Some(0.01),
            ..HairSection::preset("blond").expect("it ships")
        };
        presets.save(" Gold, thin ", &hair).expect("saved");
        let [(name, saved)] = presets.own() else {
            panic!("{:?}", presets.own());
        };
        assert_eq!(name, "Gold, thin");
        assert_eq!((saved.eta, saved.sigma_a), (1.7, hair.sigma_a));
        assert_eq!((&saved.preset, saved.diameter_cm), (&None, None));
        // It changes the look, not how thick the hair is.
        let thick = HairSection {
            diameter_cm: Some(0.02),
            ..HairSection::default()
        };
        let dressed = dressed(&thick, saved);
        assert_eq!((dressed.eta, dressed.diameter_cm), (1.7, Some(0.02)));
        assert_eq!(at().own().len(), 1, "by another start too");
        for bad in ["", "  ", "a/b", "..", "a\nb"] {
            assert!(presets.save(bad, &hair).is_err(), "{bad:?}");
        }
        presets.remove("Gold, thin");
        assert!(at().own().is_empty());
    }
}
