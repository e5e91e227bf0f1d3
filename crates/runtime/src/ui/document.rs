//! The scene as a file: its name, changes of it on disk, and pictures saved beside it.

#[cfg(not(target_arch = "wasm32"))]
mod native {
    use std::collections::{HashMap, HashSet};
    use std::path::{Path, PathBuf};
    use std::time::{Duration, SystemTime};

    use web_time::Instant;

    use crate::session::Session;
    use crate::ui::snapshot::{self, SnapshotError};
    use crate::viewer::Viewer;

    /// How often the files are looked at.
    const POLL: Duration = Duration::from_secs(1);

    /// The files of the open scene.
    pub struct Document {
        path: PathBuf,
        name: String,
        /// When files were written that the scene names, or has named since it was saved or read.
        seen: HashMap<PathBuf, Option<SystemTime>>,
        next_poll: Instant,
        pictures: u32,
    }

    impl Document {
        /// The files of `viewer`'s scene as they are now.
        pub fn new(viewer: &Viewer) -> Self {
            let mut document = Document {
                path: PathBuf::new(),
                name: String::new(),
                seen: HashMap::new(),
                next_poll: Instant::now() + POLL,
                pictures: 0,
            };
            document.saved(viewer);
            document
        }

        /// The scene's files were written or read just now.
        pub fn saved(&mut self, viewer: &Viewer) {
            let session = viewer.session();
            self.path = session.path().to_owned();
            self.name = match self.path.file_name() {
                Some(name) => name.to_string_lossy().into_owned(),
                None => "scene".to_owned(),
            };
            let seen = watched(session).map(|path| {
                let time = modified(&path);
                (path, time)
            });
            self.seen = seen.collect();
        }

        /// The name of the scene's file.
        pub fn name(&self) -> &str {
            &self.name
        }

        /// The name of the scene's file after that of its folder.
        pub fn name_in_folder(&self) -> String {
            let whole = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
            let folder = whole.parent().and_then(Path::file_name);
            match folder {
                Some(folder) => format!("{}/{}", folder.to_string_lossy(), self.name),
                None => self.name.clone(),
            }
        }

        /// The path of the scene's file, from the root.
        pub fn path_text(&self) -> String {
            let whole = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
            whole.display().to_string()
        }

        /// The next free name of a picture beside the scene.
        pub fn next_picture(&self) -> String {
            self.free_picture(self.pictures).0.display().to_string()
        }

        /// The next free name of a picture after so many, and its number.
        fn free_picture(&self, mut pictures: u32) -> (PathBuf, u32) {
            let stem = Path::new(&self.name).file_stem().unwrap_or_default();
            let stem = stem.to_string_lossy();
            loop {
                pictures += 1;
                let path = self
                    .path
                    .with_file_name(format!("{stem}-{pictures:03}.png"));
                if !path.exists() {
                    return (path, pictures);
                }
            }
        }

        /// When to look at the files again.
        pub fn next_poll(&self) -> Option<Instant> {
            Some(self.next_poll)
        }

        /// Has a file of `viewer`'s scene changed since it was last read or written? Looks once a second.
        pub fn poll(&mut self, now: Instant, viewer: &Viewer) -> bool {
            if now < self.next_poll {
                return false;
            }
            self.next_poll = now + POLL;
            let mut is_changed = false;
            for path in watched(viewer.session()) {
                // A file that is being replaced is not there for a moment.
                let Some(time) = modified(&path) else {
                    continue;
                };
                // What an edit has named was read then.
                let seen = self.seen.insert(path, Some(time));
                is_changed |= seen.is_some_and(|seen| seen != Some(time));
            }
            is_changed
        }

        /// Writes the picture as it is shown to the next free name beside the scene; answers that.
        ///
        /// # Errors
        /// The device's or the system's word.
        pub fn screenshot(&mut self, viewer: &Viewer) -> Result<String, SnapshotError> {
            let png = snapshot::png(viewer)?;
            let (path, pictures) = self.free_picture(self.pictures);
            self.pictures = pictures;
            match strandlight_formats::write_file(&path, &png) {
                Ok(()) => Ok(path.display().to_string()),
                Err(source) => Err(SnapshotError::Write { path, source }),
            }
        }
    }

    /// The files that are looked at: all but frames of a motion, which may be very many.
    fn watched(session: &Session) -> impl Iterator<Item = PathBuf> {
        let frames: HashSet<PathBuf> = session.scene().frame_paths().into_iter().collect();
        let paths = session.file_paths().into_iter();
        paths.filter(move |path| !frames.contains(path))
    }

    fn modified(path: &Path) -> Option<SystemTime> {
        std::fs::metadata(path).ok()?.modified().ok()
    }
}

#[cfg(target_arch = "wasm32")]
mod web {
    use std::path::Path;

    use web_time::Instant;

    use crate::ui::snapshot::{self, SnapshotError};
    use crate::viewer::Viewer;

    /// A scene that came with a page.
    pub struct Document {
        path: String,
        pictures: u32,
    }

    impl Document {
        /// The files of `viewer`'s scene, which no other program changes.
        pub fn new(viewer: &Viewer) -> Self {
            Document {
                path: viewer.session().path().display().to_string(),
                pictures: 0,
            }
        }

        /// The scene may have another name now.
        pub fn saved(&mut self, viewer: &Viewer) {
            self.path = viewer.session().path().display().to_string();
        }

        /// The name of the scene's file.
        pub fn name(&self) -> &str {
            self.path.rsplit('/').next().unwrap_or_default()
        }

        /// The same: a page shows where it is.
        pub fn name_in_folder(&self) -> String {
            self.name().to_owned()
        }

        /// A name for the next picture.
        pub fn next_picture(&self) -> String {
            "picture.png".to_owned()
        }

        /// The path of the scene's file, seen from the page.
        pub fn path_text(&self) -> String {
            self.path.clone()
        }

        /// Never.
        pub fn next_poll(&self) -> Option<Instant> {
            None
        }

        /// Never.
        pub fn poll(&mut self, _: Instant, _: &Viewer) -> bool {
            false
        }

        /// Offers the picture as it is shown as a file to keep, as soon as the device has sent it;
        /// answers its name.
        ///
        /// # Errors
        /// None now; a browser that refuses says so in its console.
        pub fn screenshot(&mut self, viewer: &Viewer) -> Result<String, SnapshotError> {
            self.pictures += 1;
            let stem = Path::new(self.name()).file_stem().unwrap_or_default();
            let name = format!("{}-{:03}.png", stem.to_string_lossy(), self.pictures);
            let file = name.clone();
            snapshot::png_later(viewer, move |png| {
                let offered = png.and_then(|png| Ok(crate::page::download(&file, &png)?));
                if let Err(error) = offered {
                    web_sys::console::error_1(&error.to_string().into());
                }
            });
            Ok(name)
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
pub use native::Document;
#[cfg(target_arch = "wasm32")]
pub use web::Document;
