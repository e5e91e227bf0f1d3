//! What a picture was made from: names and values that are written into its file.
//!
//! No path and no time of day is among them, so that equal input gives equal bytes wherever and
//! whenever it is drawn.
//!
//! | name | value |
//! |---|---|
//! | `strandlight/version` | name and version of the program |
//! | `strandlight/scene` | hash of the scene with all that the command line says; its files count by their content |
//! | `strandlight/groom`, `strandlight/lights`, `strandlight/tables` | hashes of the files' bytes |
//! | `strandlight/lut` | hash of the LUT's bytes, if there is one |
//! | `strandlight/panorama` | hash of the panorama's bytes, if there is one |
//! | `strandlight/paint` | hash of the paint, if it is not the groom's own |
//! | `strandlight/time` | seconds since the start of the motion, if the hair moves |
//! | `strandlight/samples`, `strandlight/backend` | samples a pixel; what drew it |
//!
//! Hashes are those of [`strandlight_formats::content_hash`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use strandlight_formats::{Error, ProxySection, Scene, TablesSection, content_hash, tool_version};
use strandlight_scattering::closed_form::PaintTexel;

use crate::error::SceneError;
use crate::files::Files;
use crate::motion::Motion;
use crate::paint::{Paint, PaintedPoint};

/// Hash of the effective scene.
pub const SCENE: &str = "strandlight/scene";
/// Hash of the groom's file.
pub const GROOM: &str = "strandlight/groom";
/// Hash of the light set's file.
pub const LIGHTS: &str = "strandlight/lights";
/// Hash of the tables' file.
pub const TABLES: &str = "strandlight/tables";
/// Hash of the panorama's file, where it is the background.
pub const PANORAMA: &str = "strandlight/panorama";
/// Seconds since the start of the motion.
pub const TIME: &str = "strandlight/time";

/// What one picture was made from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Provenance {
    entries: Vec<(String, String)>,
}

impl Provenance {
    /// Names and values, in the order that they were given in.
    pub fn entries(&self) -> &[(String, String)] {
        &self.entries
    }

    /// The value of `name`.
    pub fn get(&self, name: &str) -> Option<&str> {
        let mut entries = self.entries.iter();
        let found = entries.find(|(known, _)| known == name);
        found.map(|(_, value)| &**value)
    }

    /// The same, drawn with so many samples a pixel by `backend`, whose number of threads does not
    /// matter.
    #[must_use]
    pub fn drawn(self, samples: u32, backend: &str) -> Provenance {
        let backend = match backend.split_once(':') {
            Some(("cpu", _)) => "cpu",
            _ => backend,
        };
        self.with("samples", samples).with("backend", backend)
    }

    /// The same and one more: `name` follows `strandlight/`.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Provenance {
        let name = format!("strandlight/{name}");
        self.entries.push((name, value.to_string()));
        self
    }
}

/// Records provenance; each file is read once, however many pictures are made of it.
#[derive(Clone, Debug)]
pub struct Recorder {
    files: Files,
    known: BTreeMap<PathBuf, String>,
}

impl Recorder {
    /// Of scenes whose files are among `files`.
    pub fn new(files: &Files) -> Recorder {
        Recorder {
            files: files.clone(),
            known: BTreeMap::new(),
        }
    }

    /// What a picture of `scene` is made from, `seconds` after the start of its motion.
    ///
    /// # Errors
    /// The first file that cannot be read, by name; a value outside its range.
    pub fn record(&mut self, scene: &Scene, seconds: f64) -> Result<Provenance, SceneError> {
        let groom = self.hash(&scene.groom_path())?;
        let lights = self.hash(&scene.lights_path())?;
        let tables = match scene.tables_path() {
            Some(path) => self.hash(&path)?,
            #[cfg(target_arch = "wasm32")]
            None => self.hash(crate::tables::DEFAULT_FILE.as_ref())?,
            #[cfg(not(target_arch = "wasm32"))]
            None => content_hash(strandlight_data::LEAN_TABLES),
        };
        // Files stand in it by what they hold, not by what they are called.
        let mut nameless = scene.clone();
        nameless.groom.file = (&groom).into();
        nameless.lights.file = (&lights).into();
        nameless.tables = Some(TablesSection {
            file: (&tables).into(),
        });
        for (ix, path) in scene.mesh_paths() {
            if let ProxySection::Mesh { mesh, .. } = &mut nameless.proxies[ix] {
                *mesh = self.hash(&path)?.into();
            }
        }
        let lut = match scene.lut_path() {
            Some(path) => Some(self.hash(&path)?),
            None => None,
        };
        nameless.render.lut = lut.as_ref().map(PathBuf::from);
        let panorama = match scene.seen_panorama_path() {
            Some(path) => Some(self.hash(&path)?),
            None => None,
        };
        nameless.lights.panorama = panorama.as_ref().map(PathBuf::from);
        // Ground truth alone is lit by it: who traces that adds it.
        nameless.lights.map = None;
        let motion = Motion::new(scene, &self.files);
        if let (Some(motion), Some(section)) = (&motion, &mut nameless.motion) {
            let mut frames = Vec::new();
            for path in motion.files_at(seconds) {
                frames.push(self.hash(path)?.into());
            }
            section.frames = frames;
        }
        let text = nameless.to_toml_string()?;
        let mut provenance = Provenance::default()
            .with("version", tool_version())
            .with("scene", content_hash(text.as_bytes()))
            .with("groom", groom)
            .with("lights", lights)
            .with("tables", tables);
        if let Some(lut) = lut {
            provenance = provenance.with("lut", lut);
        }
        if let Some(panorama) = panorama {
            provenance = provenance.with("panorama", panorama);
        }
        if motion.is_some() {
            provenance = provenance.with("time", seconds);
        }
        Ok(provenance)
    }

    /// What a frame of a document is made from: `size` and `samples` may differ from the scene's, and
    /// `drawn` samples from those where a visibility list takes their place; `paint` is there where it
    /// is not the groom's own.
    ///
    /// # Errors
    /// As [`Recorder::record`].
    pub fn record_frame(
        &mut self,
        scene: &Scene,
        paint: Option<&Paint>,
        seconds: f64,
        size: [u32; 2],
        [samples, drawn]: [u32; 2],
        backend: &str,
    ) -> Result<Provenance, SceneError> {
        let mut scene = scene.clone();
        scene.render.size = size;
        scene.render.samples = samples;
        let mut provenance = self.record(&scene, seconds)?;
        if let Some(paint) = paint {
            let texels: Vec<PaintTexel> = paint.points.iter().map(PaintedPoint::texel).collect();
            provenance = provenance.with("paint", content_hash(bytemuck::cast_slice(&texels)));
        }
        Ok(provenance.drawn(drawn, backend))
    }

    fn hash(&mut self, path: &Path) -> Result<String, Error> {
        if let Some(known) = self.known.get(path) {
            return Ok(known.clone());
        }
        let hash = self.files.hash(path)?;
        self.known.insert(path.to_owned(), hash.clone());
        Ok(hash)
    }
}

#[cfg(test)]
mod tests {
    use strandlight_formats::{MotionSection, Scene};

    use super::*;

    fn files() -> Files {
        Files::in_memory([
            ("a.groom", b"hair".to_vec()),
            ("b.groom", b"hair".to_vec()),
            ("c.groom", b"other hair".to_vec()),
            ("a.lights", b"lights".to_vec()),
            ("a.cube", b"look".to_vec()),
            ("b.cube", b"look".to_vec()),
            ("a.panorama", b"map".to_vec()),
        ])
    }

    fn recorded(scene: &Scene, seconds: f64) -> Provenance {
        let recorded = Recorder::new(&files()).record(scene, seconds);
        recorded.expect("all files are there")
    }

    #[test]
    fn what_decides_the_picture_is_recorded_and_names_of_files_are_not() {
        let scene = Scene::new("a.groom", "a.lights");
        let first = recorded(&scene, 0.0);
        assert_eq!(first.get(GROOM), Some(&*content_hash(b"hair")));
        assert_eq!(first.get(LIGHTS), Some(&*content_hash(b"lights")));
        assert_eq!(first, recorded(&scene, 7.0), "nothing moves");
        assert_eq!(first, recorded(&Scene::new("b.groom", "./a.lights"), 0.0));
        let other = recorded(&Scene::new("c.groom", "a.lights"), 0.0);
        assert!(other.get(GROOM) != first.get(GROOM) && other.get(SCENE) != first.get(SCENE));
        let mut edited = scene.clone();
        edited.hair.eta = 1.6;
        let edited = recorded(&edited, 0.0);
        assert!(edited.get(GROOM) == first.get(GROOM) && edited.get(SCENE) != first.get(SCENE));
        let mut shown = scene.clone();
        shown.render.lut = Some("a.cube".into());
        let through = recorded(&shown, 0.0);
        assert_eq!(
            through.get("strandlight/lut"),
            Some(&*content_hash(b"look"))
        );
        assert_ne!(through.get(SCENE), first.get(SCENE));
        shown.render.lut = Some("b.cube".into());
        assert_eq!(through, recorded(&shown, 0.0));
        let mut behind = scene.clone();
        behind.lights.panorama = Some("x.panorama".into());
        behind.lights.map = Some("x.exr".into());
        assert_eq!(first, recorded(&behind, 0.0), "it is not seen");
        behind.lights.panorama = Some("a.panorama".into());
        behind.render.background = strandlight_formats::Background::Panorama;
        let hash = content_hash(b"map");
        assert_eq!(
            recorded(&behind, 0.0).get("strandlight/panorama"),
            Some(&*hash)
        );
        let missing = Recorder::new(&files()).record(&Scene::new("x.groom", "a.lights"), 0.0);
        let missing = missing.expect_err("not there").to_string();
        assert!(missing.contains("x.groom"), "{missing}");
    }

    #[test]
    fn of_a_sequence_the_frames_of_the_time_count() {
        let mut scene = Scene::new("a.groom", "a.lights");
        scene.motion = Some(MotionSection {
            frames: ["a.groom", "b.groom", "c.groom", "c.groom"]
                .map(PathBuf::from)
                .to_vec(),
            fps: Some(1.0),
            ..MotionSection::default()
        });
        let at = |seconds| recorded(&scene, seconds);
        assert_eq!(at(0.5).get(TIME), Some("0.5"));
        assert_eq!(at(0.0).get(SCENE), at(0.5).get(SCENE), "equal frames");
        assert_ne!(at(0.5).get(SCENE), at(1.5).get(SCENE));
    }
}
