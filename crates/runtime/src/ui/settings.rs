//! What the program remembers from one start to the next: files that were open, presets of one's own.
//! A page remembers nothing.

use std::path::{Path, PathBuf};

/// Most files that are remembered.
const MOST_RECENT: usize = 12;

/// What is remembered.
#[derive(Debug, Default)]
pub struct Settings {
    /// Files that were opened, the last first.
    recent: Vec<PathBuf>,
    /// Where that is kept; none where the system names no folder for it.
    folder: Option<PathBuf>,
}

impl Settings {
    /// What was remembered.
    pub fn read() -> Settings {
        Settings::read_from(state_folder())
    }

    fn read_from(folder: Option<PathBuf>) -> Settings {
        let file = folder.as_ref().map(|folder| folder.join("recent.json"));
        let text = file.and_then(|file| std::fs::read_to_string(file).ok());
        let recent = text.and_then(|text| serde_json::from_str::<Vec<PathBuf>>(&text).ok());
        Settings {
            recent: recent.unwrap_or_default(),
            folder,
        }
    }

    /// Files that were opened and are still there, the last first.
    pub fn recent(&self) -> impl Iterator<Item = &Path> {
        let recent = self.recent.iter().map(PathBuf::as_path);
        recent.filter(|path| path.exists())
    }

    /// Remembers that `path` was opened.
    pub fn opened(&mut self, path: &Path) {
        let Ok(path) = std::path::absolute(path) else {
            return;
        };
        // Another window may have remembered others meanwhile.
        let mut recent = Settings::read_from(self.folder.clone()).recent;
        recent.retain(|other| *other != path);
        recent.insert(0, path);
        recent.truncate(MOST_RECENT);
        self.recent = recent;
        if let (Some(folder), Ok(text)) = (&self.folder, serde_json::to_string(&self.recent)) {
            let _ = std::fs::create_dir_all(folder);
            // What cannot be remembered is no reason to say so.
            let _ = strandlight_formats::write_file(&folder.join("recent.json"), text.as_bytes());
        }
    }

    /// Forgets all files.
    pub fn forget(&mut self) {
        self.recent.clear();
        if let Some(folder) = &self.folder {
            let _ = std::fs::remove_file(folder.join("recent.json"));
        }
    }
}

/// A folder of the program's own below one that the system has for it: `variable` names that on
/// Linux, where it is `usual` in the home folder otherwise.
#[cfg(not(target_arch = "wasm32"))]
fn own_folder(variable: &str, usual: &str) -> Option<PathBuf> {
    let named = |name: &str| {
        let path = PathBuf::from(std::env::var_os(name)?);
        path.is_absolute().then_some(path)
    };
    let home = || named("HOME");
    let folder = if cfg!(windows) {
        named("LOCALAPPDATA").or_else(|| named("APPDATA"))?
    } else if cfg!(target_os = "macos") && named(variable).is_none() {
        home()?.join("Library/Application Support")
    } else {
        named(variable).or_else(|| Some(home()?.join(usual)))?
    };
    Some(folder.join("strandlight"))
}

#[cfg(target_arch = "wasm32")]
fn own_folder(_: &str, _: &str) -> Option<PathBuf> {
    None
}

fn state_folder() -> Option<PathBuf> {
    own_folder("XDG_STATE_HOME", ".local/state")
}

/// Where presets of one's own are.
pub fn presets_folder() -> Option<PathBuf> {
    Some(own_folder("XDG_CONFIG_HOME", ".config")?.join("presets"))
}

/// Where files are kept that can be made again: those of the sample.
#[cfg(not(target_arch = "wasm32"))]
pub fn cache_folder() -> Option<PathBuf> {
    own_folder("XDG_CACHE_HOME", ".cache")
}

/// The user's own folder.
pub fn home_folder() -> Option<PathBuf> {
    let variable = if cfg!(windows) { "USERPROFILE" } else { "HOME" };
    let home = PathBuf::from(std::env::var_os(variable)?);
    home.is_dir().then_some(home)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_remembered_the_last_first_and_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let state = || Settings::read_from(Some(at("state")));
        let mut settings = state();
        for name in ["a.toml", "b.toml", "gone.toml", "a.toml"] {
            std::fs::write(at(name), "").expect("written");
            settings.opened(&at(name));
        }
        std::fs::remove_file(at("gone.toml")).expect("removed");
        let known = |settings: &Settings| settings.recent().map(Path::to_owned).collect::<Vec<_>>();
        let wanted = [at("a.toml"), at("b.toml")];
        assert_eq!(known(&settings), wanted);
        // By another start too.
        assert_eq!(known(&state()), wanted);
        for ix in 0..20 {
            settings.opened(&at(&format!("{ix}.toml")));
        }
        assert_eq!(settings.recent.len(), MOST_RECENT);
        settings.forget();
        assert!(state().recent.is_empty());
    }
}
