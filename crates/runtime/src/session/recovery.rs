//! Work that was not saved, kept in a file of its own when the program is ended from outside.

use std::path::{Path, PathBuf};

use super::{Session, free_name};
use crate::error::SessionError;

/// What comes after the scene's name in that of its recovery file.
const ENDING: &str = "-recovery";

/// Recovery files of one scene that are looked for.
const MOST: u32 = 100;

impl Session {
    /// Writes the document to a new file beside the scene, or in the working folder for one that was never saved; where nothing
    /// can be written there, in the folder for temporary files. Answers that file. No other is replaced, and the document stays
    /// as it is.
    ///
    /// # Errors
    /// What cannot be written, by name.
    pub fn write_recovery(&self) -> Result<PathBuf, SessionError> {
        let written = self.write_recovery_to(&self.recovery_folder());
        written.or_else(|error| {
            let elsewhere = self.write_recovery_to(&std::env::temp_dir());
            elsewhere.map_err(|_| error)
        })
    }

    fn write_recovery_to(&self, folder: &Path) -> Result<PathBuf, SessionError> {
        let is_taken = |path: &Path| self.files.exists(path) || path.symlink_metadata().is_ok();
        let path = free_name(&folder.join(self.recovery_name(1)), is_taken);
        self.save_copy(&path)?;
        Ok(path)
    }

    /// The last recovery file of this scene, unless the scene was written since.
    pub fn newer_recovery(&self) -> Option<PathBuf> {
        let folder = self.recovery_folder();
        let path = |ix| folder.join(self.recovery_name(ix));
        let written = (1..=MOST).filter_map(|ix| Some((self.files.modified(&path(ix))?, ix)));
        let (time, last) = written.max()?;
        let of_scene = self.files.modified(&self.path);
        of_scene
            .is_none_or(|of_scene| of_scene <= time)
            .then(|| path(last))
    }

    fn recovery_folder(&self) -> PathBuf {
        match self.is_unsaved() {
            true => std::env::current_dir().unwrap_or_default(),
            false => self.path.parent().map(Path::to_owned).unwrap_or_default(),
        }
    }

    /// As [`free_name`] numbers them.
    fn recovery_name(&self, ix: u32) -> String {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        match ix {
            1 => format!("{stem}{ENDING}.toml"),
            ix => format!("{stem}{ENDING}-{ix}.toml"),
        }
    }
}
