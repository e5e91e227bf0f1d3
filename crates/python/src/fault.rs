//! What goes wrong, on its way to `strandlight.Error`.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use strandlight_bake::grooms::{EditError, GrowError};
use strandlight_bake::lights::FitError;
use strandlight_bake::probe::ProbeError;
use strandlight_formats::Error;
use strandlight_images::MapError;
use strandlight_scene::keys::SetError;
use strandlight_scene::{RenderError, SceneError};

/// Why something was not done; made without Python, raised with it.
#[derive(Debug)]
pub struct Fault {
    message: String,
    path: Option<PathBuf>,
    kind: &'static str,
}

/// What the functions here answer before Python sees it.
pub type Outcome<T> = Result<T, Fault>;

impl Fault {
    /// A value that cannot be used.
    pub fn value(message: impl Into<String>) -> Fault {
        Fault::new("value", message)
    }

    /// Something else; the kinds are those of `strandlight.Error`.
    pub fn new(kind: &'static str, message: impl Into<String>) -> Fault {
        let message: String = message.into();
        // One line, whatever a library put into its message.
        let lines = message.lines().map(str::trim);
        let lines: Vec<&str> = lines.filter(|line| !line.is_empty()).collect();
        Fault {
            message: lines.join(" "),
            path: None,
            kind,
        }
    }

    /// The same about the file at `path`, which the message names.
    pub fn of_file(mut self, path: &Path) -> Fault {
        self.path = Some(path.to_owned());
        self
    }

    /// The same about something in the file at `path`, which the message does not name yet; another
    /// file that it is about stays its path.
    pub fn in_file(mut self, path: &Path) -> Fault {
        self.message = format!("{}: {}", path.display(), self.message);
        self.path.get_or_insert_with(|| path.to_owned());
        self
    }

    /// The Python exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        static ERROR: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        match ERROR.import(py, "strandlight._error", "Error") {
            Ok(class) => {
                let path = self.path.map(|path| path.display().to_string());
                PyErr::from_type(class.clone(), (self.message, path, self.kind))
            }
            Err(error) => error,
        }
    }
}

fn kind_of(error: &Error) -> &'static str {
    match error {
        Error::Io { .. } => "io",
        Error::NotThisKind { .. } => "format",
        Error::UnsupportedVersion { .. } => "version",
        Error::Invalid { .. } => "damaged",
        Error::Syntax { .. } => "syntax",
        _ => "value",
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Fault {
        let fault = Fault::new(kind_of(&error), error.to_string());
        match error.path() {
            Some(path) => fault.of_file(path),
            None => fault,
        }
    }
}

/// The file that a scene's error is about, and its kind.
fn of_scene(error: &SceneError) -> (Option<&Path>, &'static str) {
    match error {
        SceneError::Format(error) => (error.path(), kind_of(error)),
        SceneError::InFile { path, source } => {
            let (inner, kind) = of_scene(source);
            (inner.or(Some(path)), kind)
        }
        SceneError::Key { source, .. } | SceneError::BuiltIn { source, .. } => of_scene(source),
        SceneError::Frame(_) | SceneError::Material(_) => (None, "value"),
        _ => (None, "scene"),
    }
}

impl From<SceneError> for Fault {
    fn from(error: SceneError) -> Fault {
        let (path, kind) = of_scene(&error);
        let fault = Fault::new(kind, error.to_string());
        match path {
            Some(path) => fault.of_file(path),
            None => fault,
        }
    }
}

impl From<RenderError> for Fault {
    fn from(error: RenderError) -> Fault {
        match error {
            RenderError::Scene(error) => error.into(),
            RenderError::Frame(error) => Fault::value(error.to_string()),
            error => Fault::new("render", error.to_string()),
        }
    }
}

impl From<MapError> for Fault {
    fn from(error: MapError) -> Fault {
        let message = error.to_string();
        match error {
            MapError::Read(error) => error.into(),
            MapError::File { path, .. } => Fault::new("map", message).of_file(&path),
            _ => Fault::new("map", message),
        }
    }
}

impl From<FitError> for Fault {
    fn from(error: FitError) -> Fault {
        let kind = match &error {
            FitError::Count(_) => "value",
            _ => "map",
        };
        Fault::new(kind, error.to_string())
    }
}

impl From<GrowError> for Fault {
    fn from(error: GrowError) -> Fault {
        Fault::value(error.to_string())
    }
}

impl From<EditError> for Fault {
    fn from(error: EditError) -> Fault {
        match error {
            EditError::Groom(error) => error.into(),
            error => Fault::value(error.to_string()),
        }
    }
}

impl From<SetError> for Fault {
    fn from(error: SetError) -> Fault {
        match error {
            SetError::Scene(error) => error.into(),
            error => Fault::value(error.to_string()),
        }
    }
}

impl From<ProbeError> for Fault {
    fn from(error: ProbeError) -> Fault {
        Fault::new("tables", error.to_string())
    }
}
