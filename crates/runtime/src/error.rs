//! What can go wrong with a document and with a script.

use std::path::PathBuf;

use strandlight_formats::{did_you_mean, in_plain_words};
use strandlight_scene::budget::{FrameError, MAX_SAMPLES, MAX_SECONDS};
pub use strandlight_scene::keys::KeyError;
use strandlight_scene::keys::SetError;
use strandlight_scene::paint::BrushError;
use strandlight_scene::{RenderError, SceneError};

/// A document that cannot be opened, changed, shown or saved.
///
/// As with [`SceneError`], the text is the whole story, and
/// [`source`](std::error::Error::source) leads to its causes one by one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// Its scene cannot be read, prepared or written.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A key that the scene does not have, or a value of another kind.
    #[error("{key}: {source}{}", hint(source))]
    Key {
        /// The key as it was given.
        key: String,
        /// What is wrong with it.
        source: KeyError,
    },
    /// The scene would be written over a file that it is made of.
    #[error(
        "{}: is the {what} of this scene; choose another name, such as {}",
        path.display(),
        path.with_extension("toml").display()
    )]
    TargetIsSource {
        /// The file.
        path: PathBuf,
        /// What the scene has it for.
        what: &'static str,
    },
    /// No step to take back.
    #[error("there is no step to undo")]
    NothingToUndo,
    /// No step to do again.
    #[error("there is no step to redo")]
    NothingToRedo,
    /// The renderer cannot draw it.
    #[error(transparent)]
    Render(RenderError),
}

impl From<strandlight_formats::Error> for SessionError {
    fn from(error: strandlight_formats::Error) -> Self {
        SessionError::Scene(error.into())
    }
}

impl From<RenderError> for SessionError {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Scene(error) => SessionError::Scene(error),
            error => SessionError::Render(error),
        }
    }
}

impl From<SetError> for SessionError {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Key { key, source } => SessionError::Key { key, source },
            SetError::Scene(error) => error.into(),
        }
    }
}

/// A script that cannot be read, or a step of it that cannot be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScriptError {
    /// Not UTF-8.
    #[error("not a script: it is not text")]
    NotText,
    /// Not a list in JSON.
    #[error("not a list of steps: {}", in_plain_words(.0))]
    Json(#[from] serde_json::Error),
    /// A step that is not as it should be.
    #[error("step {step}: {source}")]
    Step {
        /// Its number, from 0.
        step: usize,
        /// What is wrong with it.
        source: StepError,
    },
    /// Too many frames.
    #[error("{frames} frames; at most {most}")]
    TooManyFrames {
        /// Frames asked for.
        frames: usize,
        /// The most there may be.
        most: u32,
    },
    /// The document refuses what a step does to it.
    #[error("step {step}: {source}")]
    Session {
        /// Number of the step, from 0.
        step: usize,
        /// What the document refuses.
        source: Box<SessionError>,
    },
    /// The renderer failed.
    #[error("step {step}: {source}")]
    Render {
        /// Number of the step that was done, from 0.
        step: usize,
        /// How it failed.
        source: RenderError,
    },
}

impl ScriptError {
    pub(crate) fn at(step: usize, error: SessionError) -> ScriptError {
        match error {
            SessionError::Render(source) => ScriptError::Render { step, source },
            source => ScriptError::Session {
                step,
                source: Box::new(source),
            },
        }
    }
}

/// What is wrong with a step of a script.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// Not an object.
    #[error("must be an object like {{\"undo\": 1}}")]
    NoObject,
    /// A value of another kind than its key has.
    #[error("{key}: {}{}", in_plain_words(source), hint(source))]
    Value {
        /// The key.
        key: String,
        /// What is wrong with its value.
        source: serde_json::Error,
    },
    /// A key that steps do not have.
    #[error(
        "{key}: unknown key, must be one of {}{}",
        known.join(", "),
        meant.map_or(String::new(), |name| format!("; did you mean {name}?"))
    )]
    UnknownKey {
        /// The key, with those it stands below.
        key: String,
        /// The keys there are.
        known: &'static [&'static str],
        /// The one of them that looks most like it, if any does.
        meant: Option<&'static str>,
    },
    /// The path of a stroke is no list of points.
    #[error("stroke.path: must be a list of points [x_px, y_px], or [x, y, z] in cm")]
    StrokePath,
    /// A stroke that goes nowhere.
    #[error("stroke.path is [], must have a point")]
    EmptyPath,
    /// A brush that cannot be used.
    #[error(transparent)]
    Brush(#[from] BrushError),
    /// Nothing to do, or several things.
    #[error("must be one of set, stroke, flood, time, undo, redo and frame")]
    NotOneStep,
    /// `samples` or `size` without a frame.
    #[error("samples and size belong to a frame")]
    NoFrame,
    /// A frame that cannot be the name of a file.
    #[error("frame {0:?}: must be 1 to 128 ASCII letters, digits, -, _ and dots, and no path")]
    FrameName(String),
    /// A name that another frame has.
    #[error("there is a frame {0} already")]
    SecondFrame(String),
    /// Samples out of range.
    #[error("samples is {0}, must be in 1..={MAX_SAMPLES}")]
    Samples(u32),
    /// A size that no picture has.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A time out of range.
    #[error("time is {0}, must be in 0..={MAX_SECONDS}")]
    Time(f64),
}

/// What was meant instead, where `error` lets one guess.
fn hint(error: &dyn std::error::Error) -> String {
    did_you_mean(&error.to_string()).map_or(String::new(), |hint| format!("; {hint}"))
}

#[cfg(test)]
mod tests {
    use std::error::Error;
    use std::io;
    use std::path::Path;

    use serde_json::json;
    use strandlight_formats::Scene;

    use super::*;
    use crate::Session;
    use crate::script::Script;
    use crate::session::with_key;

    /// The causes of `error`, one by one.
    fn causes<'a>(error: &'a dyn Error) -> impl Iterator<Item = &'a (dyn Error + 'static)> {
        std::iter::successors(error.source(), |&error| error.source())
    }

    #[test]
    fn a_missing_file_leads_to_what_the_system_answered() {
        let error = Session::open(Path::new("not/there.toml")).expect_err("no such file");
        let SessionError::Scene(SceneError::Format(formats)) = &error else {
            panic!("{error:?}");
        };
        assert_eq!(formats.path(), Some(Path::new("not/there.toml")));
        let system = causes(&error).find_map(|cause| cause.downcast_ref::<io::Error>());
        let system = system.expect("the system's answer");
        assert_eq!(system.kind(), io::ErrorKind::NotFound);
        assert_eq!(error.to_string(), format!("not/there.toml: {system}"));
    }

    #[test]
    fn a_key_is_told_from_its_value() {
        let scene = Scene::new("a.groom", "a.lights");
        let error = with_key(&scene, "hair.sigma_a.3", &json!(1.0)).expect_err("no such entry");
        assert!(
            matches!(
                &error,
                SessionError::Key { key, source: KeyError::Entry { length: 3, .. } } if key == "hair.sigma_a.3"
            ),
            "{error:?}"
        );
        let error = with_key(&scene, "hair.eta", &json!(9.0)).expect_err("too large");
        assert!(
            matches!(
                &error,
                SessionError::Scene(SceneError::Format(strandlight_formats::Error::Value { key, .. }))
                    if key == "hair.eta"
            ),
            "{error:?}"
        );
    }

    #[test]
    fn a_script_says_which_step_failed_and_why() {
        let not_text = Script::from_bytes(b"[\xff]").expect_err("no text");
        assert_eq!(not_text.to_string(), "not a script: it is not text");
        let script = |text| Script::from_json(text).expect_err(text);
        let error = script(r#"[{"undo": 1}, {"frame": "a", "size": [0, 4]}]"#);
        assert!(
            matches!(
                error,
                ScriptError::Step {
                    step: 1,
                    source: StepError::Frame(FrameError::Size {
                        width: 0,
                        height: 4
                    })
                }
            ),
            "{error:?}"
        );
        let error = script(r#"[{"stroke": {"brusch": {}}}]"#);
        assert_eq!(
            error.to_string(),
            "step 0: stroke.brusch: unknown key, must be one of brush, path; did you mean brush?"
        );
        let step = causes(&error).next().expect("a cause");
        assert!(matches!(
            step.downcast_ref(),
            Some(StepError::UnknownKey { .. })
        ));
        assert_eq!(format!("step 0: {step}"), error.to_string());
    }

    #[test]
    fn errors_can_leave_their_thread() {
        fn check<T: Error + Send + Sync + 'static>() {}
        check::<SessionError>();
        check::<ScriptError>();
    }
}
