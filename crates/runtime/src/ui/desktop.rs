//! The desktop's own file dialogs, where there are some: on Linux by the XDG portal. Elsewhere the
//! window lists files itself.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// Nobody has seen a dialog that was closed sooner: there was none.
pub const GLANCE: Duration = Duration::from_millis(300);

/// May there be dialogs? Where they turn out to be missing, the window's list takes their place.
pub fn has_dialogs() -> bool {
    if !cfg!(target_os = "linux") {
        return false;
    }
    // A portal is reached by the session's bus.
    let is_named = std::env::var_os("DBUS_SESSION_BUS_ADDRESS").is_some();
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    is_named || runtime.is_some_and(|runtime| runtime.join("bus").exists())
}

/// Asks for a file to open in the folder of `scene`; waits until it is chosen.
#[cfg(target_os = "linux")]
pub fn open(scene: &Path, extensions: &[String]) -> Option<PathBuf> {
    dialog("Open", scene)
        .add_filter("Scenes, hair, lights, maps, LUTs and photos", extensions)
        .add_filter("All files", &["*"])
        .pick_file()
}

/// Asks where `scene` is saved; waits until that is chosen.
#[cfg(target_os = "linux")]
pub fn save(scene: &Path) -> Option<PathBuf> {
    let name = scene.file_name().unwrap_or_default();
    dialog("Save scene as", scene)
        .set_file_name(name.to_string_lossy())
        .add_filter("Scenes", &["toml"])
        .save_file()
}

#[cfg(target_os = "linux")]
fn dialog(title: &str, scene: &Path) -> rfd::FileDialog {
    let dialog = rfd::FileDialog::new().set_title(title);
    match scene.parent().filter(|folder| folder.is_dir()) {
        Some(folder) => dialog.set_directory(folder),
        None => dialog,
    }
}

/// There is no dialog.
#[cfg(not(target_os = "linux"))]
pub fn open(_: &Path, _: &[String]) -> Option<PathBuf> {
    None
}

/// Nor to save.
#[cfg(not(target_os = "linux"))]
pub fn save(_: &Path) -> Option<PathBuf> {
    None
}
