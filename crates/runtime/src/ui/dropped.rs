//! Files that are dropped on the window.

use std::path::Path;

use super::questions::name_of;

/// What a dropped file is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// A scene, which is opened.
    Scene,
    /// A groom for the scene that is open.
    Groom,
    /// A light set for the scene that is open.
    Lights,
}

/// A file that is none of these.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{name}: cannot be dropped here; drop a scene (.toml), groom (.groom) or light set \
     (.lights){advice}"
)]
pub struct CannotDrop {
    /// Name of the file.
    pub name: String,
    /// What to do with such a file.
    pub advice: &'static str,
}

/// What the file at `path` is, by its name.
///
/// # Errors
/// One line that names the file and says what can be dropped.
pub fn kind_of(path: &Path) -> Result<Dropped, CannotDrop> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let advice = match extension.to_lowercase().as_str() {
        "toml" => return Ok(Dropped::Scene),
        "groom" => return Ok(Dropped::Groom),
        "lights" => return Ok(Dropped::Lights),
        "hair" => "; convert it with `strandlight groom import`",
        "exr" | "hdr" => "; fit a light set to it with `strandlight lights`",
        _ => "",
    };
    Err(CannotDrop {
        name: name_of(path),
        advice,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_name_and_others_are_refused_by_name() {
        for (name, kind) in [
            ("/a b/scene.toml", Dropped::Scene),
            ("Long.GROOM", Dropped::Groom),
            ("studio.lights", Dropped::Lights),
        ] {
            assert_eq!(kind_of(Path::new(name)), Ok(kind), "{name}");
        }
        for (name, needle) in [
            ("/tmp/notes.txt", "notes.txt: "),
            ("/tmp/folder", "folder: "),
            ("model.hair", "groom import"),
            ("studio.EXR", "strandlight lights"),
            ("", "(.toml)"),
        ] {
            let error = kind_of(Path::new(name)).unwrap_err().to_string();
            assert!(error.contains(needle), "{name}: {error}");
        }
    }
}
