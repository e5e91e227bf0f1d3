//! Reading, checking and writing scene files.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::{Error, FileName, Result};
use crate::input::{STANDARD_STREAM, folder_of, read_file, read_start};
use crate::params;
use crate::plain_words::in_plain_words;
use crate::preset::overlaid;
use crate::scene::{Background, GroomSection, RenderSection, Scene};
use crate::scene_check;
use crate::scene_hair::HairSection;
use crate::scene_lights::LightsSection;
use crate::scene_place::{key_at, line_of};
use crate::scene_proxy::ProxySection;
use crate::scene_variation::VariationSection;
use crate::sniff::{FileKind, SNIFF_BYTES};
use crate::suggest::did_you_mean;

impl Scene {
    /// Newest scene format version.
    pub const VERSION: u32 = 1;

    /// Longest scene file; one fills about a kilobyte.
    pub const MAX_BYTES: u64 = 1 << 20;

    /// A scene of two files and defaults for all else.
    pub fn new(groom: impl Into<PathBuf>, lights: impl Into<PathBuf>) -> Self {
        Scene {
            version: Scene::VERSION,
            groom: GroomSection { file: groom.into() },
            lights: LightsSection::new(lights),
            tables: None,
            hair: HairSection::default(),
            variation: VariationSection::default(),
            camera: None,
            render: RenderSection::default(),
            proxies: Vec::new(),
            motion: None,
            folder: PathBuf::new(),
        }
    }

    /// Reads and checks a scene file. The files it names are not opened.
    ///
    /// # Errors
    /// Any of [`Error`], naming the path, and the key where a value is to blame.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = read_file(path, Scene::MAX_BYTES).map_err(|error| match error {
            // A groom or a map in a scene's place is too long, and that is not what is wrong.
            Error::Value { .. } => known_start(path).err().unwrap_or(error),
            error => error,
        })?;
        Scene::from_bytes(&bytes, path)
    }

    /// Decodes and checks the bytes of the scene file at `path`, which is not opened.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let decode = || {
            check_start(bytes)?;
            let text = std::str::from_utf8(bytes).map_err(|error| {
                Error::invalid("not a scene: not UTF-8 text", error.valid_up_to() as u64)
            })?;
            let mut scene = Scene::from_toml(text)?;
            scene.folder = folder_of(path);
            Ok(scene)
        };
        decode().map_err(|error: Error| error.in_file(path))
    }

    /// Parses and checks the text of a scene file.
    ///
    /// # Errors
    /// `Syntax`, `Value` or `UnsupportedVersion`, with the line in `text`.
    pub fn from_toml(text: &str) -> Result<Self> {
        check_version(text)?;
        Scene::from_text(text).map_err(|error| error.at_line(|key| line_of(text, key)))
    }

    fn from_text(text: &str) -> Result<Self> {
        let mut scene: Scene = toml::from_str(text).map_err(|error| syntax_error(text, &error))?;
        if let Some(name) = &scene.hair.preset {
            // Read once more as a plain table: which keys were written, and which left out?
            let mut file: toml::Table = text.parse().map_err(|error| syntax_error(text, &error))?;
            let own = match file.remove("hair") {
                Some(toml::Value::Table(own)) => own,
                _ => toml::Table::new(),
            };
            scene.hair = overlaid(name, own)?;
        }
        scene.validate()?;
        Ok(scene)
    }

    /// The text of a scene file. Relative paths stay relative.
    ///
    /// # Errors
    /// `Value` when a value is outside its range or a path is not UTF-8.
    pub fn to_toml_string(&self) -> Result<String> {
        self.validate()?;
        toml::to_string(self).map_err(|error| Error::value("scene", error, "expressible in TOML"))
    }

    /// `file` as seen from the scene file's folder; here `-` is a name like any other.
    pub fn resolve(&self, file: &Path) -> PathBuf {
        if file == Path::new(STANDARD_STREAM) {
            return self.folder.join(".").join(file);
        }
        self.folder.join(file)
    }

    /// The groom's path.
    pub fn groom_path(&self) -> PathBuf {
        self.resolve(&self.groom.file)
    }

    /// The light set's path.
    pub fn lights_path(&self) -> PathBuf {
        self.resolve(&self.lights.file)
    }

    /// The path of the panorama, if there is one.
    pub fn panorama_path(&self) -> Option<PathBuf> {
        let panorama = self.lights.panorama.as_ref();
        panorama.map(|panorama| self.resolve(panorama))
    }

    /// The path of the panorama where it is the background: nothing else reads it.
    pub fn seen_panorama_path(&self) -> Option<PathBuf> {
        match self.render.background {
            Background::Panorama => self.panorama_path(),
            _ => None,
        }
    }

    /// The path of the map that ground truth is lit by, if there is one.
    pub fn map_path(&self) -> Option<PathBuf> {
        self.lights.map.as_ref().map(|map| self.resolve(map))
    }

    /// Paths of the grooms that the hair moves through.
    pub fn frame_paths(&self) -> Vec<PathBuf> {
        let frames = self.motion.iter().flat_map(|motion| &motion.frames);
        frames.map(|file| self.resolve(file)).collect()
    }

    /// Numbers, from 0, and paths of the proxies that are meshes.
    pub fn mesh_paths(&self) -> Vec<(usize, PathBuf)> {
        let proxies = self.proxies.iter().enumerate();
        let paths = proxies.filter_map(|(ix, proxy)| match proxy {
            ProxySection::Mesh { mesh, .. } => Some((ix, self.resolve(mesh))),
            _ => None,
        });
        paths.collect()
    }

    /// The tables' path; `None` stands for the bundled tables.
    pub fn tables_path(&self) -> Option<PathBuf> {
        self.tables
            .as_ref()
            .map(|tables| self.resolve(&tables.file))
    }

    /// The path of the LUT, if there is one.
    pub fn lut_path(&self) -> Option<PathBuf> {
        self.render.lut.as_ref().map(|lut| self.resolve(lut))
    }

    /// Paths of all files that the scene names.
    pub fn file_paths(&self) -> Vec<PathBuf> {
        let mut paths = vec![self.groom_path(), self.lights_path()];
        paths.extend(self.tables_path());
        paths.extend(self.panorama_path());
        paths.extend(self.map_path());
        paths.extend(self.lut_path());
        paths.extend(self.frame_paths());
        paths.extend(self.mesh_paths().into_iter().map(|(_, path)| path));
        paths
    }

    /// Checks every value against its documented range.
    ///
    /// # Errors
    /// `Value` naming key, value and range.
    pub fn validate(&self) -> Result<()> {
        if self.version != Scene::VERSION {
            return Err(Error::value(
                "version",
                self.version,
                Scene::VERSION.to_string(),
            ));
        }
        params::GROOM.validate(&self.groom)?;
        if let Some(tables) = &self.tables {
            params::TABLES.validate(tables)?;
        }
        self.lights.validate()?;
        self.hair.validate()?;
        self.variation.validate(&self.hair)?;
        if let Some(camera) = &self.camera {
            camera.validate()?;
        }
        scene_check::proxies(&self.proxies)?;
        if let Some(motion) = &self.motion {
            motion.validate()?;
        }
        params::RENDER.validate(&self.render)?;
        scene_check::background(self)
    }
}

/// Refuses what is known to be another kind of file. An empty file is a scene without its keys.
fn check_start(start: &[u8]) -> Result<()> {
    match FileKind::of(start) {
        FileKind::Scene | FileKind::Empty => Ok(()),
        found if found.is_known() => Err(Error::not_this_kind("scene", found.describe())),
        _ => Ok(()),
    }
}

/// [`check_start`] of the file at `path`.
fn known_start(path: &Path) -> Result<()> {
    let start = read_start(path, SNIFF_BYTES as u64)?;
    check_start(&start).map_err(|error| error.in_file(path))
}

/// Refuses a later version before its unknown keys are complained about.
fn check_version(text: &str) -> Result<()> {
    #[derive(Deserialize)]
    struct Version {
        version: Option<i64>,
    }
    match toml::from_str::<Version>(text) {
        Ok(Version {
            version: Some(found),
        }) if found > i64::from(Scene::VERSION) => Err(Error::UnsupportedVersion {
            file: FileName::default(),
            kind: "scene",
            found: found.to_string(),
            known: Scene::VERSION as u16,
        }),
        // Anything else is answered by the full parse.
        _ => Ok(()),
    }
}

/// Which proxy does not parse.
fn first_wrong_proxy(text: &str) -> Option<usize> {
    let scene: toml::Table = toml::from_str(text).ok()?;
    let proxies = scene.get("proxy")?.as_array()?;
    let is_wrong = |proxy: &toml::Value| ProxySection::deserialize(proxy.clone()).is_err();
    proxies.iter().position(is_wrong)
}

fn syntax_error(text: &str, error: &toml::de::Error) -> Error {
    let span = error.span().unwrap_or_default();
    let start = span.start.min(text.len());
    let before = &text.as_bytes()[..start];
    let line_start = before
        .iter()
        .rposition(|&byte| byte == b'\n')
        .map_or(0, |at| at + 1);
    let message = in_plain_words(error.message().replace('\n', " "));
    let hint = did_you_mean(&message).map_or(String::new(), |hint| format!("; {hint}"));
    let key = key_at(text, &span);
    // Of all proxies the parser names the first.
    if key.as_deref() == Some("proxy[0]")
        && let Some(ix) = first_wrong_proxy(text)
        && let Some(line) = line_of(text, &format!("proxy[{ix}]"))
    {
        return Error::Syntax {
            file: FileName::default(),
            line,
            column: 1,
            what: format!("proxy[{ix}]: {message}{hint}"),
        };
    }
    let what = match key {
        Some(key) => format!("{key}: {message}{hint}"),
        None => message + &hint,
    };
    Error::Syntax {
        file: FileName::default(),
        line: before.iter().filter(|&&byte| byte == b'\n').count() + 1,
        column: String::from_utf8_lossy(&before[line_start..])
            .chars()
            .count()
            + 1,
        what,
    }
}
