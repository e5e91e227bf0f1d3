//! Files that can be opened, whatever they are: what a file is, hair of other programs as a groom,
//! and scenes made around a file that is no scene.
//!
//! Nothing here writes: what is made is held in memory ([`Files::hold`]) until the scene is saved.

use std::path::{Path, PathBuf};

use strandlight_data::{SAMPLE_GROOM, SAMPLE_LIGHTS, SAMPLE_MESH, SAMPLE_SCENE};
use strandlight_formats::{
    Background, BakedFile, Error, FileKind, Groom, ImportOptions, Kind, NoteKind, ProxySection,
    SNIFF_BYTES, Scene, SourceFile, StatedBy, UpAxis, read_start,
};

use crate::error::SessionError;
use crate::session::{Session, free_name};
use crate::work::{Scratch, Work, WorkError};
use strandlight_scene::SceneError;
use strandlight_scene::files::Files;

/// What a file is opened as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Openable {
    /// A scene, which takes the place of the one that is open.
    Scene,
    /// A groom.
    Groom,
    /// Hair of another program, which becomes a groom.
    Hair,
    /// A light set.
    Lights,
    /// An environment map, to which lights are fitted.
    Map,
    /// An environment map for the background.
    Panorama,
    /// A LUT for the display.
    Lut,
}

impl Openable {
    /// What it is, as a heading.
    pub fn name(self) -> &'static str {
        match self {
            Openable::Scene => "Scene",
            Openable::Groom | Openable::Hair => "Groom",
            Openable::Lights => "Light set",
            Openable::Map => "Map",
            Openable::Panorama => "Panorama",
            Openable::Lut => "LUT",
        }
    }
}

/// A file that cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CannotOpen {
    /// It cannot be read, or not as what it is.
    #[error(transparent)]
    File(#[from] Error),
    /// It is something else.
    #[error(
        "{name} is {what}; open a scene, hair, a light set, an HDR map, a panorama or a LUT{advice}"
    )]
    Kind {
        /// Name of the file.
        name: String,
        /// What it is, with its article.
        what: &'static str,
        /// What to do with such a file.
        advice: &'static str,
    },
    /// What `strandlight` was to make of it.
    #[error(transparent)]
    Work(#[from] WorkError),
    /// Nor a scene made around it.
    #[error(transparent)]
    Session(#[from] SessionError),
}

/// What the file at `path` is opened as, by its content.
///
/// # Errors
/// A file that cannot be read, or that is something else; it is named.
pub fn kind_of(path: &Path) -> Result<Openable, CannotOpen> {
    let is_called = |wanted: &str| {
        let extension = path.extension().unwrap_or_default();
        extension.eq_ignore_ascii_case(wanted)
    };
    // Broken ones are opened too: what is wrong with them is then said by line.
    if is_called("toml") {
        return Ok(Openable::Scene);
    }
    if path.is_dir() {
        return Err(cannot_open(path, "a folder", ""));
    }
    let start = read_start(path, SNIFF_BYTES as u64)?;
    let found = FileKind::of(&start);
    match found {
        FileKind::Scene => Ok(Openable::Scene),
        FileKind::Ours(Kind::Groom) => Ok(Openable::Groom),
        FileKind::Ours(Kind::Lights) => Ok(Openable::Lights),
        FileKind::Ours(Kind::Panorama) => Ok(Openable::Panorama),
        FileKind::Hair(_) => Ok(Openable::Hair),
        FileKind::Map(_) => Ok(Openable::Map),
        FileKind::Cube => Ok(Openable::Lut),
        // After long comments; what is wrong with it is said by line.
        FileKind::Text if is_called("cube") => Ok(Openable::Lut),
        FileKind::Ours(Kind::Mesh) => {
            let advice = "; a scene names meshes in [[proxy]]";
            Err(cannot_open(path, found.name(), advice))
        }
        FileKind::Picture(what) => {
            let advice = "; it holds no radiance to light a scene with";
            Err(cannot_open(path, what, advice))
        }
        other => Err(cannot_open(path, other.name(), "")),
    }
}

fn cannot_open(path: &Path, what: &'static str, advice: &'static str) -> CannotOpen {
    CannotOpen::Kind {
        name: name_of(path),
        what,
        advice,
    }
}

/// Hair of another program as a groom.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The groom.
    pub groom: Groom,
    /// Unit and axis that were taken, what was dropped, what seems wrong: a line each.
    pub notes: Vec<String>,
}

/// Reads hair of another program. Unit and axis are what the file says, or else a guess from the
/// shape of the hair, or else what its format has by convention.
///
/// # Errors
/// What cannot be read, by name.
pub fn import_hair(path: &Path) -> Result<Imported, Error> {
    let file = SourceFile::read(path)?;
    let plain = ImportOptions::default();
    let first = match file.import(&plain) {
        // In the usual unit it may be too large for a groom.
        Err(error @ Error::Value { .. }) => {
            let small = plain.clone().with_unit(0.01);
            file.import(&small).map_err(|_| error)
        }
        answer => answer,
    }?;
    let guesses = first.groom.guess_source();
    let mut options = plain;
    let mut why = ["the file says so"; 2];
    if first.unit_by != StatedBy::File {
        options.cm_per_unit = guesses.unit.map(|guess| guess.value.cm());
        why[0] = told(options.cm_per_unit.is_some());
    }
    if first.up_by != StatedBy::File {
        options.up = guesses.up.map(|guess| guess.value);
        why[1] = told(options.up.is_some());
    }
    let import = file.import(&options)?;
    let source = &import.groom.source;
    let mut notes = vec![format!(
        "{} cm a unit ({}), {} up ({})",
        source.cm_per_unit,
        why[0],
        UpAxis::name(source.up),
        why[1]
    )];
    let told_of = (import.notes.into_iter()).filter(|note| note.kind == NoteKind::Dropped);
    let dropped: Vec<String> = told_of.map(|note| note.text).collect();
    if !dropped.is_empty() {
        notes.push(format!("dropped: {}", dropped.join(", ")));
    }
    let groom = import.groom;
    notes.extend(groom.doubts(groom.diameter_range()));
    Ok(Imported { groom, notes })
}

fn told(is_guessed: bool) -> &'static str {
    match is_guessed {
        true => "guessed from its shape",
        false => "by convention of the format",
    }
}

/// A file beside `path` with another extension, under a name that no file on disk or in `files` has.
pub fn beside(path: &Path, extension: &str, files: &Files) -> PathBuf {
    free_name(&path.with_extension(extension), |path| files.exists(path))
}

/// Names beside `path` for a light set and its panorama, which no file on disk or in `files` has: the same but for the
/// extension, so that one is found by the other.
pub fn beside_map(path: &Path, files: &Files) -> [PathBuf; 2] {
    let panorama_of = |lights: &Path| lights.with_extension("panorama");
    let is_taken = |lights: &Path| files.exists(lights) || files.exists(&panorama_of(lights));
    let lights = free_name(&path.with_extension("lights"), is_taken);
    let panorama = panorama_of(&lights);
    [lights, panorama]
}

/// What `strandlight lights` makes of an environment map.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The light set, as a file.
    pub lights: Vec<u8>,
    /// The map for the background, as a file.
    pub panorama: Vec<u8>,
    /// How good the lights are, in words.
    pub figures: String,
}

/// Fits lights to an environment map by `strandlight lights`.
///
/// # Errors
/// No such program, or what it says.
pub fn fit_map(path: &Path, work: &Work) -> Result<Fitted, CannotOpen> {
    let scratch = Scratch::new().map_err(Error::from)?;
    let out = scratch.join("fitted.lights");
    let behind = scratch.join("fitted.panorama");
    let what = format!("fitting lights to {}", name_of(path));
    let (map, to) = (path.as_os_str(), out.as_os_str());
    let mut words = vec!["lights".as_ref(), map, "-o".as_ref(), to];
    words.extend(["--panorama".as_ref(), behind.as_os_str()]);
    let said = work.strandlight(&what, words)?;
    // `wrote FILE: light set, format 1.1, 40 lights (...), ...`
    let figures = said.rsplit_once("light set, ").map_or("", |(_, rest)| rest);
    Ok(Fitted {
        lights: Files::Disk.read(&out, u64::MAX)?,
        panorama: Files::Disk.read(&behind, u64::MAX)?,
        figures: figures.to_owned(),
    })
}

fn name_of(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Opens any file: a scene, or a scene made around a groom, hair of another program, a light set, an
/// environment map, a panorama or a LUT, with what is built in for the rest. Such a scene is called after the file and was
/// never saved.
///
/// # Errors
/// A file that cannot be read or is of no such kind.
pub fn open(path: &Path, work: &Work) -> Result<Session, CannotOpen> {
    let files = Files::over_disk();
    let kind = kind_of(path)?;
    if kind == Openable::Scene {
        return Ok(Session::open_in(path, files)?);
    }
    let whole = std::path::absolute(path).map_err(Error::from)?;
    let (groom, lights) = match kind {
        Openable::Lut => (None, None),
        Openable::Panorama => {
            let lights = whole.with_extension("lights");
            (None, files.exists(&lights).then_some(lights))
        }
        Openable::Groom => (Some(whole.clone()), None),
        Openable::Hair => {
            let groom = beside(&whole, "groom", &files);
            files.hold(&groom, import_hair(&whole)?.groom.to_bytes()?);
            (Some(groom), None)
        }
        Openable::Map => {
            let [lights, panorama] = beside_map(&whole, &files);
            let fitted = fit_map(&whole, work)?;
            files.hold(&lights, fitted.lights);
            files.hold(&panorama, fitted.panorama);
            (None, Some(lights))
        }
        Openable::Lights | Openable::Scene => (None, Some(whole.clone())),
    };
    let lut = (kind == Openable::Lut).then(|| whole.clone());
    let panorama = match kind {
        Openable::Panorama => Some(whole.clone()),
        _ => lights
            .as_deref()
            .and_then(|lights| panorama_of(lights, &files)),
    };
    // Whoever opens a map wants to see it.
    let is_seen = matches!(kind, Openable::Panorama | Openable::Map);
    let lit = Lit {
        lights,
        panorama,
        is_seen,
        map: (kind == Openable::Map).then(|| whole.clone()),
    };
    Ok(around(&whole, groom, lit, lut, files)?)
}

/// The panorama of a light set: the one beside it that is called the same, if there is one.
pub fn panorama_of(lights: &Path, files: &Files) -> Option<PathBuf> {
    let panorama = lights.with_extension("panorama");
    files.exists(&panorama).then_some(panorama)
}

/// What a scene is lit by, and what is behind its hair.
#[derive(Default)]
struct Lit {
    lights: Option<PathBuf>,
    panorama: Option<PathBuf>,
    /// Is the panorama the background?
    is_seen: bool,
    /// The map that the lights were fitted to.
    map: Option<PathBuf>,
}

/// A scene around a groom, a light set, a panorama, a LUT or none of them, called after `path`.
///
/// # Errors
/// What cannot be read or drawn, by name.
fn around(
    path: &Path,
    groom: Option<PathBuf>,
    lit: Lit,
    lut: Option<PathBuf>,
    files: Files,
) -> Result<Session, SessionError> {
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let made = |name: &str, bytes: Vec<u8>| {
        let path = free_name(&folder.join(name), |path| files.exists(path));
        files.hold(&path, bytes);
        path
    };
    let groom = match groom {
        Some(groom) => groom,
        None => made("plain.groom", crate::plain_hair::groom().to_bytes()?),
    };
    let lights = lit
        .lights
        .unwrap_or_else(|| made("studio.lights", SAMPLE_LIGHTS.to_owned()));
    let name = |path: PathBuf| match path.strip_prefix(&folder) {
        Ok(below) => below.to_owned(),
        Err(_) => path,
    };
    let mut scene = Scene::new(name(groom), name(lights));
    scene.render.lut = lut.map(name);
    scene.lights.panorama = lit.panorama.map(name);
    scene.lights.map = lit.map.map(name);
    if lit.is_seen && scene.lights.panorama.is_some() {
        scene.render.background = Background::Panorama;
    }
    scene.hair = scene.hair.with_preset("brown")?;
    let scene_path = beside(path, "toml", &files);
    files.hold(&scene_path, scene.to_toml_string()?.into_bytes());
    Session::open_in(&scene_path, files).map_err(|error| of_file(error, path))
}

/// What is wrong with a scene that was made around the file at `path`: there is no scene yet that could be named.
fn of_file(error: SessionError, path: &Path) -> SessionError {
    let SessionError::Scene(SceneError::InFile { source, .. }) = error else {
        return error;
    };
    SessionError::Scene(match *source {
        // It names the file that it is about.
        SceneError::Key { source, .. } if matches!(*source, SceneError::Format(_)) => *source,
        other => other.in_file(path),
    })
}

/// The bundled sample as a scene of the folder `home` that was never saved. Its hair and head are
/// made by `strandlight`, once, and kept in the folder `cache`.
///
/// # Errors
/// No such program, or what it says.
pub fn sample(cache: &Path, home: &Path, work: &Work) -> Result<Session, CannotOpen> {
    let files = Files::over_disk();
    let mut scene = Scene::from_toml(SAMPLE_SCENE)?;
    // Those built in are the same.
    scene.tables = None;
    let meshes = scene.proxies.iter_mut().filter_map(|proxy| match proxy {
        ProxySection::Mesh { mesh, .. } => Some(mesh),
        _ => None,
    });
    let lines = [(SAMPLE_GROOM, &mut scene.groom.file)];
    for (line, file) in lines
        .into_iter()
        .chain(meshes.map(|mesh| (SAMPLE_MESH, mesh)))
    {
        let kept = cache.join(&*file);
        if !kept.is_file() {
            std::fs::create_dir_all(cache).map_err(|error| Error::from(error).in_file(cache))?;
            let words = line.split(' ').map(|word| match word.strip_prefix('@') {
                Some(_) => kept.clone().into_os_string(),
                None => word.into(),
            });
            work.strandlight("the sample scene", words)?;
        }
        hold(&files, home, file, Files::Disk.read(&kept, u64::MAX)?);
    }
    hold(
        &files,
        home,
        &mut scene.lights.file,
        SAMPLE_LIGHTS.to_owned(),
    );
    let mut path = PathBuf::from("sample.toml");
    hold(
        &files,
        home,
        &mut path,
        scene.to_toml_string()?.into_bytes(),
    );
    Ok(Session::open_in(&home.join(path), files)?)
}

/// Keeps a file in memory for the folder `home`, under a name that is free there.
fn hold(files: &Files, home: &Path, file: &mut PathBuf, bytes: Vec<u8>) {
    let held = free_name(&home.join(&*file), |path| files.exists(path));
    files.hold(&held, bytes);
    *file = PathBuf::from(held.file_name().unwrap_or_default());
}

/// A scene with plain hair and the built-in lights, for want of anything else, that was never saved.
///
/// # Errors
/// None but bugs.
pub fn plain(home: &Path) -> Result<Session, CannotOpen> {
    let path = home.join("plain.groom");
    Ok(around(
        &path,
        None,
        Lit::default(),
        None,
        Files::over_disk(),
    )?)
}

#[cfg(test)]
mod tests {
    use strandlight_formats::{ExportOptions, LightSet, Panorama, groom_format};

    use super::*;

    /// A folder with hair of another program, a groom and a light set.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let groom = crate::plain_hair::groom();
        for name in ["hair", "abc"] {
            let format = groom_format(match name {
                "abc" => "alembic",
                name => name,
            });
            let format = format.expect("it is in the table");
            let export = groom
                .export(format, &ExportOptions::default())
                .expect("written");
            std::fs::write(at(&format!("head.{name}")), export.bytes).expect("written");
        }
        groom.write(&at("head.groom")).expect("written");
        std::fs::write(at("studio.lights"), SAMPLE_LIGHTS).expect("written");
        folder
    }

    fn panorama() -> Panorama {
        Panorama::from_pixels(4, &[[1.0, 0.5, 0.25]; 8]).expect("valid")
    }

    #[test]
    fn a_panorama_comes_with_its_light_set_and_is_saved_with_it() {
        let folder = folder();
        let (work, at) = (Work::default(), |name: &str| folder.path().join(name));
        let plain = open(&at("studio.lights"), &work).expect("opened");
        assert_eq!(plain.scene().lights.panorama, None);
        panorama().write(&at("studio.panorama")).expect("written");
        let lit = open(&at("studio.lights"), &work).expect("opened");
        let scene = lit.scene();
        assert_eq!(scene.lights.panorama, Some("studio.panorama".into()));
        assert_eq!(scene.render.background, Background::Lights);
        assert!(
            lit.panorama().is_none(),
            "it is not seen, so it is not read"
        );
        let mut seen = open(&at("studio.panorama"), &work).expect("opened");
        assert_eq!(seen.scene().lights.file, Path::new("studio.lights"));
        assert_eq!(seen.scene().render.background, Background::Panorama);
        let found = seen.panorama().expect("it is read").radiance(glam::Vec3::Y);
        assert!((found[0] - 1.0).abs() < 1e-3 && (found[2] - 0.25).abs() < 1e-3);

        // Both in memory: written under one name, which is free for both, and found from elsewhere.
        let files = seen.files().clone();
        let [lights, behind] = beside_map(&at("studio.hdr"), &files);
        assert!(lights.ends_with("studio-2.lights") && behind.ends_with("studio-2.panorama"));
        files.hold(&lights, SAMPLE_LIGHTS);
        files.hold(&behind, panorama().to_bytes().expect("valid"));
        let names_of = [&lights, &behind].map(|path| seen.path_in_scene(path));
        let [file, map] = names_of;
        seen.edit("Light set", |scene| {
            (scene.lights.file, scene.lights.panorama) = (file, Some(map));
        })
        .expect("edited");
        let below = at("below");
        std::fs::create_dir(&below).expect("made");
        std::fs::write(below.join("studio-2.lights"), "").expect("written");
        seen.save_as(&below.join("mine.toml")).expect("saved");
        let there = names(&below);
        assert!(there.contains(&"studio-2-2.lights".to_owned()), "{there:?}");
        assert!(
            there.contains(&"studio-2-2.panorama".to_owned()),
            "{there:?}"
        );
        let again = Session::open(&below.join("mine.toml")).expect("it is whole");
        assert_eq!(again.panorama().map(|it| it.map.width()), Some(4));
        // What was undone leads to where it was.
        seen.undo();
        assert_eq!(
            seen.scene().lights.panorama,
            Some("../studio.panorama".into())
        );
        seen.redo();
        assert_eq!(
            seen.scene().lights.panorama,
            Some("studio-2-2.panorama".into())
        );
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("a folder").flatten();
        let mut names: Vec<String> = entries
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn files_are_known_by_what_is_in_them() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("studio.exr"), strandlight_data::SAMPLE_MAP).expect("written");
        std::fs::write(at("scene.txt"), SAMPLE_SCENE).expect("written");
        std::fs::write(at("broken.toml"), "version = \n[").expect("written");
        std::fs::write(at("look.txt"), "LUT_1D_SIZE 2\n0 0 0\n1 1 1\n").expect("written");
        std::fs::write(at("BROKEN.CUBE"), "0 0 0\n# no size\nx\n").expect("written");
        panorama().write(&at("sky.panorama")).expect("written");
        // The name says nothing.
        std::fs::rename(at("head.abc"), at("head.txt")).expect("renamed");
        for (name, kind) in [
            ("studio.exr", Openable::Map),
            ("scene.txt", Openable::Scene),
            ("broken.toml", Openable::Scene),
            ("look.txt", Openable::Lut),
            ("BROKEN.CUBE", Openable::Lut),
            ("head.txt", Openable::Hair),
            ("head.hair", Openable::Hair),
            ("head.groom", Openable::Groom),
            ("studio.lights", Openable::Lights),
            ("sky.panorama", Openable::Panorama),
        ] {
            assert_eq!(kind_of(&at(name)).expect(name), kind, "{name}");
        }
        std::fs::write(at("notes.txt"), "about hair").expect("written");
        std::fs::write(at("photo.png"), b"\x89PNG\r\n\x1a\n").expect("written");
        std::fs::write(at("empty"), "").expect("written");
        for (name, needle) in [
            ("notes.txt", "some other text"),
            ("photo.png", "no radiance"),
            ("empty", "empty"),
            ("gone.groom", "gone.groom"),
            ("", "a folder"),
        ] {
            let error = kind_of(&at(name)).expect_err(name).to_string();
            assert!(error.contains(needle), "{name}: {error}");
        }
    }

    #[test]
    fn a_scene_around_a_lone_file_is_written_with_all_its_files_when_it_is_saved() {
        let folder = folder();
        let before = names(folder.path());
        let work = Work::default();
        let mut session = open(&folder.path().join("head.hair"), &work).expect("opened");
        assert!(session.is_unsaved() && !session.is_modified());
        // The groom's name is taken by another file, and so are the lights'.
        assert!(session.scene().groom_path().ends_with("head-2.groom"));
        assert!(session.scene().lights_path().ends_with("studio-2.lights"));
        assert_eq!(session.groom().points, crate::plain_hair::groom().points);
        assert_eq!(names(folder.path()), before, "nothing is written unasked");
        let below = folder.path().join("below");
        std::fs::create_dir(&below).expect("made");
        let path = below.join("mine.toml");
        let saved = session.save_as(&path).expect("saved");
        assert_eq!(saved.files.len(), 3);
        assert!(!session.is_unsaved());
        assert_eq!(
            names(&below),
            ["head-2.groom", "mine.toml", "studio-2.lights"]
        );
        let again = Session::open(&path).expect("it is whole");
        assert_eq!(again.groom().points, session.groom().points);
        assert_eq!(again.scene().hair.preset.as_deref(), Some("brown"));
        // Saving again writes the scene alone.
        assert_eq!(session.save().expect("saved").files, [path]);

        // A light set alone has plain hair, a groom alone the built-in lights.
        let lights = open(&folder.path().join("studio.lights"), &work).expect("opened");
        assert!(lights.groom().n_strands() > 1000);
        let path = folder.path().join("look.cube");
        std::fs::write(&path, "LUT_1D_SIZE 2\n0 0 0\n0.5 1 1\n").expect("written");
        let look = open(&path, &work).expect("opened");
        assert_eq!(look.scene().render.lut, Some("look.cube".into()));
        let shown = look.prepared().expect("drawable").display;
        assert_eq!(shown.display([1e9; 3]), [0.5, 1.0, 1.0]);
        let groom = open(&folder.path().join("head.groom"), &work).expect("opened");
        let known = LightSet::from_bytes(SAMPLE_LIGHTS).expect("a light set");
        assert_eq!(groom.light_set().lights, known.lights);
        assert!(groom.scene().groom_path().ends_with("head.groom"));
    }

    #[test]
    fn a_groom_in_memory_is_an_edit_that_undo_and_saving_know() {
        let folder = folder();
        let work = Work::default();
        let mut session = open(&folder.path().join("head.groom"), &work).expect("opened");
        session.save().expect("saved");
        let foreign = folder.path().join("head.abc");
        let imported = import_hair(&foreign).expect("imported");
        assert!(imported.notes[0].contains("up"), "{:?}", imported.notes);
        let held = beside(&foreign, "groom", session.files());
        session
            .files()
            .hold(&held, imported.groom.to_bytes().expect("encoded"));
        let file = session.path_in_scene(&held);
        session
            .edit("Groom", |scene| scene.groom.file = file)
            .expect("edited");
        assert!(session.is_modified() && !held.exists());
        session.undo();
        assert!(!session.is_modified());
        session.redo();
        session.save().expect("saved");
        assert!(held.is_file() && !session.is_modified());
        let path = session.path().to_owned();
        assert_eq!(
            Session::open(&path).expect("whole").scene().groom_path(),
            held
        );
        // What is undone now is the groom of before.
        session.undo();
        assert!(session.scene().groom_path().ends_with("head.groom"));
    }

    #[test]
    fn a_map_needs_the_program_that_fits_lights() {
        let folder = folder();
        let map = folder.path().join("studio.exr");
        std::fs::write(&map, strandlight_data::SAMPLE_MAP).expect("written");
        let work = Work::default();
        work.stop();
        let error = open(&map, &work).expect_err("it was stopped");
        assert!(
            matches!(error, CannotOpen::Work(WorkError::Stopped)),
            "{error}"
        );
    }

    #[test]
    fn a_file_that_is_broken_is_named_and_no_scene_around_it() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        let whole = std::fs::read(at("head.groom")).expect("read");
        std::fs::write(at("cut.groom"), &whole[..whole.len() / 2]).expect("written");
        let lights = &SAMPLE_LIGHTS[..SAMPLE_LIGHTS.len() / 2];
        std::fs::write(at("cut.lights"), lights).expect("written");
        for name in ["cut.groom", "cut.lights"] {
            let error = open(&at(name), &Work::default())
                .expect_err(name)
                .to_string();
            let start = at(name).display().to_string();
            assert!(error.starts_with(&start), "{error}");
            assert!(!error.contains("cut.toml"), "{error}");
        }
    }
}
