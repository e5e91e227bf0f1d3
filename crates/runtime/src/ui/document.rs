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
        /// The files that were looked at, as they were then.
        seen: HashMap<PathBuf, Seen>,
        next_poll: Instant,
        pictures: u32,
    }

    /// A file when it was last looked at.
    struct Seen {
        /// [`Session::time_read`] then: once the session has read or written the file since, that counts.
        read: Option<Option<SystemTime>>,
        /// When it was written.
        time: SystemTime,
    }

    impl Document {
        /// The files of `session`, as it has read them.
        pub fn new(session: &Session) -> Self {
            let mut document = Document {
                path: PathBuf::new(),
                name: String::new(),
                seen: HashMap::new(),
                next_poll: Instant::now() + POLL,
                pictures: 0,
            };
            document.saved(session);
            document
        }

        /// The scene was saved, perhaps under another name.
        pub fn saved(&mut self, session: &Session) {
            self.path = session.path().to_owned();
            self.name = match self.path.file_name() {
                Some(name) => name.to_string_lossy().into_owned(),
                None => "scene".to_owned(),
            };
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

        /// Has a file of the scene changed since `session` read or wrote it, and since that was last answered? Looks once a
        /// second.
        pub fn poll(&mut self, now: Instant, session: &Session) -> bool {
            if now < self.next_poll {
                return false;
            }
            self.next_poll = now + POLL;
            let mut is_changed = false;
            for path in watched(session) {
                // A file that is being replaced is not there for a moment.
                let Some(time) = session.files().modified(&path) else {
                    continue;
                };
                let read = session.time_read(&path);
                let seen = self.seen.get(&path).filter(|seen| seen.read == read);
                is_changed |= match seen {
                    Some(seen) => seen.time != time,
                    // One that was not read yet has nothing to be other than.
                    None => read.is_some_and(|read| read != Some(time)),
                };
                self.seen.insert(path, Seen { read, time });
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

    #[cfg(test)]
    mod tests {
        use super::*;
        use crate::session::tests::saving::{files_in, touch};

        #[test]
        fn each_change_of_a_file_is_told_once() {
            let folder = tempfile::tempdir().expect("a folder");
            let at = |name: &str| folder.path().join(name);
            files_in(folder.path(), "");
            let mut session = Session::open(&at("a.toml")).expect("readable");
            // The picture is prepared meanwhile.
            touch(&at("b.lights"), 5);
            let mut document = Document::new(&session);
            let mut now = Instant::now();
            let mut poll = |document: &mut Document, session: &Session| {
                now += 2 * POLL;
                document.poll(now, session)
            };
            assert!(poll(&mut document, &session));
            assert!(!poll(&mut document, &session), "it was told");
            session.reload().expect("readable");
            assert!(!poll(&mut document, &session));
            // What is saved is no change, what others write before it is.
            let edited = session.edit("eta", |scene| scene.hair.eta = 1.7);
            edited.expect("valid");
            touch(&at("a.groom"), 5);
            session.save().expect("written");
            document.saved(&session);
            assert!(poll(&mut document, &session));
            session.reload().expect("readable");
            assert!(!poll(&mut document, &session));
            // So is what is written after an edit has read it.
            let edited = session.edit("hair", |scene| scene.groom.file = "taller.groom".into());
            edited.expect("readable");
            touch(&at("taller.groom"), 5);
            assert!(poll(&mut document, &session));
        }
    }
}

#[cfg(target_arch = "wasm32")]
mod web {
    use std::path::Path;

    use web_time::Instant;

    use crate::session::Session;
    use crate::ui::snapshot::{self, SnapshotError};
    use crate::viewer::Viewer;

    /// A scene that came with a page.
    pub struct Document {
        path: String,
        pictures: u32,
    }

    impl Document {
        /// The files of `session`, which no other program changes.
        pub fn new(session: &Session) -> Self {
            Document {
                path: session.path().display().to_string(),
                pictures: 0,
            }
        }

        /// The scene may have another name now.
        pub fn saved(&mut self, session: &Session) {
            self.path = session.path().display().to_string();
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
        pub fn poll(&mut self, _: Instant, _: &Session) -> bool {
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
