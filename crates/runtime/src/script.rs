//! Edits, views and frames as a list in JSON: what a person does in the window, for a machine to
//! do.
//!
//! ```json
//! [
//!   {"set": {"hair.eta": 1.6, "camera.position": [0, 0, 60]}},
//!   {"stroke": {"brush": {"radius_cm": 2, "effect": {"dye": [0.1, 0.9, 2]}},
//!               "path": [[300, 200], [340, 260]]}},
//!   {"frame": "first", "samples": 64, "size": [720, 480]},
//!   {"undo": 1},
//!   {"frame": "second"}
//! ]
//! ```
//!
//! | step | does |
//! |---|---|
//! | `set` | sets values by the names of their keys in a scene file, as one step to undo |
//! | `stroke` | paints; see [`BrushStroke`] |
//! | `flood` | a [`Brush`] over all hair |
//! | `time` | seconds since the start of the motion |
//! | `undo`, `redo` | takes so many steps back, or does them again |
//! | `frame` | makes a picture; `samples` and `size` in place of the scene's |

use std::collections::BTreeSet;
use std::path::Path;

use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};
use strandlight_formats::{CameraSection, nearest};

use crate::error::{ScriptError, SessionError, StepError};
use crate::session::{Change, Session};
use crate::viewer::Viewer;
use strandlight_scene::Backend;
use strandlight_scene::budget::{MAX_SAMPLES, MAX_SECONDS, check_frame};
use strandlight_scene::paint::{Brush, BrushStroke, StrokePath};

/// Longest script.
pub const MAX_BYTES: u64 = 64 << 20;

/// Most frames of a script or a turntable.
pub const MAX_SCRIPT_FRAMES: u32 = 10_000;

/// A picture that a script asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// File name, perhaps without extension.
    pub name: String,
    /// Samples a pixel; the scene's if absent.
    pub samples: Option<u32>,
    /// Width and height; the scene's if absent.
    pub size: Option<[u32; 2]>,
}

/// One entry of a script.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Keys and their values.
    Set(Map<String, Value>),
    /// A stroke of a brush. Its path in pixels is one in a picture of the scene's size.
    Stroke(BrushStroke),
    /// A brush over all hair.
    Flood(Brush),
    /// Seconds since the start of the motion.
    Time(f64),
    /// Steps to take back.
    Undo(u32),
    /// Steps to do again.
    Redo(u32),
    /// A picture to make.
    Frame(Frame),
}

/// A list of steps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Script {
    /// In order.
    pub steps: Vec<Step>,
}

/// Why [`Script::run`] did not come to the end.
#[derive(Debug)]
pub enum Stopped<E> {
    /// A step failed.
    Script(ScriptError),
    /// A frame failed, as whoever draws them says.
    Frame(E),
}

/// A step as it stands in the file: one of the first seven.
#[derive(Default)]
struct Entry {
    set: Option<Map<String, Value>>,
    stroke: Option<BrushStroke>,
    flood: Option<Brush>,
    time: Option<f64>,
    undo: Option<u32>,
    redo: Option<u32>,
    frame: Option<String>,
    samples: Option<u32>,
    size: Option<[u32; 2]>,
}

impl Entry {
    const KEYS: [&str; 9] = [
        "set", "stroke", "flood", "time", "undo", "redo", "frame", "samples", "size",
    ];

    /// Key by key, so that each complaint names its key.
    fn from_json(entry: Value) -> Result<Entry, StepError> {
        let Value::Object(keys) = entry else {
            return Err(StepError::NoObject);
        };
        let mut step = Entry::default();
        for (key, value) in keys {
            let at = &*key;
            match at {
                "set" => step.set = Some(typed(at, value)?),
                "stroke" => step.stroke = Some(stroke(value)?),
                "flood" => step.flood = Some(brush(at, value)?),
                "time" => step.time = Some(typed(at, value)?),
                "undo" => step.undo = Some(typed(at, value)?),
                "redo" => step.redo = Some(typed(at, value)?),
                "frame" => step.frame = Some(typed(at, value)?),
                "samples" => step.samples = Some(typed(at, value)?),
                "size" => step.size = Some(typed(at, value)?),
                _ => return Err(unknown("", at, &Entry::KEYS)),
            }
        }
        Ok(step)
    }
}

/// `value` as what belongs to `key`.
fn typed<T: DeserializeOwned>(key: &str, value: Value) -> Result<T, StepError> {
    serde_json::from_value(value).map_err(|source| StepError::Value {
        key: key.to_owned(),
        source,
    })
}

/// `known` does not have `key`, which stands below `of`.
fn unknown(of: &str, key: &str, known: &'static [&'static str]) -> StepError {
    StepError::UnknownKey {
        key: format!("{of}{key}"),
        known,
        meant: nearest(key, known.iter().copied()),
    }
}

/// The brush at `key`, whose complaints name its own key.
fn brush(key: &str, value: Value) -> Result<Brush, StepError> {
    let keys: Map<String, Value> = typed(key, value)?;
    // Each of its keys may stand alone.
    for (name, value) in &keys {
        let alone = Map::from_iter([(name.clone(), value.clone())]);
        typed::<Brush>(&format!("{key}.{name}"), Value::Object(alone))?;
    }
    typed(key, Value::Object(keys))
}

/// A stroke, whose complaints name the key of the brush.
fn stroke(value: Value) -> Result<BrushStroke, StepError> {
    let Value::Object(keys) = &value else {
        return typed("stroke", value);
    };
    for (key, value) in keys {
        match (&**key, value) {
            ("brush", value) => drop(brush("stroke.brush", value.clone())?),
            ("path", path) => {
                if serde_json::from_value::<StrokePath>(path.clone()).is_err() {
                    return Err(StepError::StrokePath);
                }
                if path.as_array().is_some_and(Vec::is_empty) {
                    return Err(StepError::EmptyPath);
                }
            }
            _ => return Err(unknown("stroke.", key, &["brush", "path"])),
        }
    }
    typed("stroke", value)
}

impl Script {
    /// Parses and checks the bytes of a script's file.
    ///
    /// # Errors
    /// As [`Script::from_json`]; bytes that are not UTF-8.
    pub fn from_bytes(bytes: &[u8]) -> Result<Script, ScriptError> {
        let text = std::str::from_utf8(bytes).map_err(|_| ScriptError::NotText)?;
        Script::from_json(text)
    }

    /// Parses and checks a script.
    ///
    /// # Errors
    /// The first step that is not as it should be, by its number.
    pub fn from_json(text: &str) -> Result<Script, ScriptError> {
        let entries: Vec<Value> = serde_json::from_str(text)?;
        let mut names = BTreeSet::new();
        let mut steps = Vec::with_capacity(entries.len());
        for (ix, entry) in entries.into_iter().enumerate() {
            let read = step(entry, &mut names);
            steps.push(read.map_err(|source| ScriptError::Step { step: ix, source })?);
        }
        if names.len() > MAX_SCRIPT_FRAMES as usize {
            return Err(ScriptError::TooManyFrames {
                frames: names.len(),
                most: MAX_SCRIPT_FRAMES,
            });
        }
        Ok(Script { steps })
    }

    /// `n` frames of a full turn of `camera` about +Y through its target, the first of them the
    /// camera's own, called `0000`, `0001`, ...
    pub fn turntable(camera: &CameraSection, n: u32) -> Script {
        let steps = (0..n.min(MAX_SCRIPT_FRAMES)).flat_map(|ix| {
            let turned = turned(camera, std::f64::consts::TAU * f64::from(ix) / f64::from(n));
            let camera = json!({
                "position": turned.position,
                "target": turned.target,
                "up": turned.up,
                "fov_deg": turned.fov_deg,
            });
            let frame = Frame {
                name: format!("{ix:04}"),
                samples: None,
                size: None,
            };
            let camera = [("camera".to_owned(), camera)].into_iter().collect();
            [Step::Set(camera), Step::Frame(frame)]
        });
        Script {
            steps: steps.collect(),
        }
    }

    /// The frames.
    pub fn frames(&self) -> impl Iterator<Item = &Frame> {
        self.steps.iter().filter_map(|step| match step {
            Step::Frame(frame) => Some(frame),
            _ => None,
        })
    }

    /// Does the steps on a copy of `session`, without a renderer and up to the first stroke, so
    /// that errors are reported before anything is drawn.
    ///
    /// # Errors
    /// As [`Script::run`].
    pub fn check(&self, session: &Session) -> Result<(), ScriptError> {
        let mut session = session.clone();
        for (ix, step) in self.steps.iter().enumerate() {
            let done = match step {
                Step::Set(values) => session.set(values).map(drop),
                Step::Undo(n) => (0..*n).try_for_each(|_| undone(session.undo())),
                Step::Redo(n) => (0..*n).try_for_each(|_| redone(session.redo())),
                Step::Stroke(_) | Step::Flood(_) => break,
                Step::Time(_) | Step::Frame(_) => Ok(()),
            };
            done.map_err(|error| ScriptError::at(ix, error))?;
        }
        Ok(())
    }

    /// Does every step on `viewer`, and `draw` for each frame.
    ///
    /// # Errors
    /// The first step that fails, by its number; what `draw` answers.
    pub fn run<B: Backend + ?Sized, E>(
        &self,
        viewer: &mut Viewer<B>,
        mut draw: impl FnMut(&mut Viewer<B>, &Frame) -> Result<(), E>,
    ) -> Result<(), Stopped<E>> {
        for (ix, step) in self.steps.iter().enumerate() {
            let done = match step {
                Step::Set(values) => viewer.set(values).map(drop),
                Step::Stroke(stroke) => viewer.stroke(stroke).map(drop).map_err(Into::into),
                Step::Flood(brush) => viewer.flood(brush).map(drop).map_err(Into::into),
                Step::Time(seconds) => viewer.set_time(*seconds).map_err(Into::into),
                Step::Undo(n) => (0..*n).try_for_each(|_| undone(viewer.undo()?)),
                Step::Redo(n) => (0..*n).try_for_each(|_| redone(viewer.redo()?)),
                Step::Frame(frame) => {
                    draw(viewer, frame).map_err(Stopped::Frame)?;
                    Ok(())
                }
            };
            done.map_err(|error| Stopped::Script(ScriptError::at(ix, error)))?;
        }
        Ok(())
    }
}

fn undone(change: Option<Change>) -> Result<(), SessionError> {
    change.map(drop).ok_or(SessionError::NothingToUndo)
}

fn redone(change: Option<Change>) -> Result<(), SessionError> {
    change.map(drop).ok_or(SessionError::NothingToRedo)
}

fn step(entry: Value, names: &mut BTreeSet<String>) -> Result<Step, StepError> {
    let entry = Entry::from_json(entry)?;
    let is_frame = entry.frame.is_some();
    let mut steps: Vec<Step> = [
        entry.set.map(Step::Set),
        entry.stroke.map(Step::Stroke),
        entry.flood.map(Step::Flood),
        entry.time.map(Step::Time),
        entry.undo.map(Step::Undo),
        entry.redo.map(Step::Redo),
        entry.frame.map(|name| {
            Step::Frame(Frame {
                name,
                samples: entry.samples,
                size: entry.size,
            })
        }),
    ]
    .into_iter()
    .flatten()
    .collect();
    let one = (steps.len() == 1).then(|| steps.pop()).flatten();
    let one = one.ok_or(StepError::NotOneStep)?;
    if !is_frame && (entry.samples.is_some() || entry.size.is_some()) {
        return Err(StepError::NoFrame);
    }
    match &one {
        Step::Frame(frame) => {
            check_name(&frame.name)?;
            let stem = Path::new(&frame.name).with_extension("");
            if !names.insert(stem.to_string_lossy().to_lowercase()) {
                return Err(StepError::SecondFrame(frame.name.clone()));
            }
            let samples = frame.samples.unwrap_or(4);
            if samples == 0 || samples > MAX_SAMPLES {
                return Err(StepError::Samples(samples));
            }
            let size = frame.size.unwrap_or([1, 1]);
            check_frame(size, samples)?;
        }
        Step::Stroke(BrushStroke { brush, .. }) | Step::Flood(brush) => brush.validate()?,
        Step::Time(seconds) if !(0.0..=MAX_SECONDS).contains(seconds) => {
            return Err(StepError::Time(*seconds));
        }
        _ => {}
    }
    Ok(one)
}

/// A frame's name is that of a file in the folder of the frames.
fn check_name(name: &str) -> Result<(), StepError> {
    let fine = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if (1..=128).contains(&name.len()) && name.chars().all(fine) && !name.starts_with('.') {
        return Ok(());
    }
    Err(StepError::FrameName(name.to_owned()))
}

/// The camera, turned about +Y through its target by `angle` radians, counter-clockwise seen from
/// above.
fn turned(camera: &CameraSection, angle: f64) -> CameraSection {
    let (sin, cos) = angle.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [cos * x + sin * z, y, cos * z - sin * x];
    let from_target = std::array::from_fn(|ix| camera.position[ix] - camera.target[ix]);
    let offset = turn(from_target);
    CameraSection {
        position: std::array::from_fn(|ix| camera.target[ix] + offset[ix]),
        up: turn(camera.up),
        ..camera.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_every_kind_are_read() {
        let script = Script::from_json(
            r#"[{"set": {"hair.eta": 1.6}}, {"time": 0.5},
                {"stroke": {"path": [[1, 2], [3, 4]]}}, {"undo": 2}, {"redo": 1},
                {"flood": {"effect": "blur", "strength": 0.5}},
                {"frame": "a", "samples": 8, "size": [20, 10]}, {"frame": "b.exr"}]"#,
        )
        .expect("valid");
        assert_eq!(script.steps.len(), 8);
        assert_eq!(script.steps[3], Step::Undo(2));
        let names: Vec<&str> = script.frames().map(|frame| frame.name.as_str()).collect();
        assert_eq!(names, ["a", "b.exr"]);
    }

    #[test]
    fn faults_are_named_with_their_step() {
        for (text, needle) in [
            ("{}", "not a list"),
            (
                r#"[{"undo": 1}, {"stroke": {"path": []}}]"#,
                "step 1: stroke.path is [], must have a point",
            ),
            (
                r#"[{"flood": {"mask": {"from": 0.9, "to": 0.1}}}]"#,
                "step 0: brush: mask.from = 0.9 must be in 0..=0.1",
            ),
            ("[{}]", "step 0: must be one of"),
            (
                r#"[{"undo": 1}, {"undo": 1, "redo": 1}]"#,
                "step 1: must be one of",
            ),
            (r#"[{"undo": -1}]"#, "step 0"),
            (r#"[{"colour": 1}]"#, "step 0: colour: unknown key"),
            (r#"[{"fame": "a"}]"#, "step 0: fame: unknown key"),
            (r#"[{"fame": "a"}]"#, "did you mean frame?"),
            (r#"[{"undo": "x"}]"#, "step 0: undo: invalid type"),
            (r#"[{"time": "x"}]"#, "expected a number"),
            (r#"[{"set": 3}]"#, "step 0: set: invalid type"),
            (r#"[{"undo": 1}, 3]"#, "step 1: must be an object"),
            (r#"[{"stroke": 3}]"#, "step 0: stroke: invalid type"),
            (
                r#"[{"stroke": {"brush": {}}}]"#,
                "stroke: missing field `path`",
            ),
            (
                r#"[{"stroke": {"brush": {"strength": "x"}, "path": []}}]"#,
                "step 0: stroke.brush.strength: invalid type",
            ),
            (
                r#"[{"stroke": {"brush": {"strenght": 1}, "path": []}}]"#,
                "did you mean strength?",
            ),
            (
                r#"[{"stroke": {"path": [[1]]}}]"#,
                "stroke.path: must be a list",
            ),
            (
                r#"[{"flood": {"effect": "smudge"}}]"#,
                "step 0: flood.effect: unknown variant",
            ),
            (r#"[{"flood": []}]"#, "step 0: flood"),
            (r#"[{"stroke": {"pth": []}}]"#, "stroke.pth: unknown key"),
            (r#"[{"undo": 1, "samples": 4}]"#, "belong to a frame"),
            (r#"[{"frame": "../a"}]"#, "no path"),
            (r#"[{"frame": ".hidden"}]"#, "no path"),
            (r#"[{"frame": ""}]"#, "no path"),
            (r#"[{"frame": "fünf"}]"#, "128 ASCII letters"),
            (r#"[{"frame": "a"}, {"frame": "A.png"}]"#, "already"),
            (r#"[{"frame": "a", "samples": 0}]"#, "samples is 0"),
            (r#"[{"frame": "a", "size": [0, 4]}]"#, "0x4"),
            (r#"[{"time": -1}]"#, "time is -1"),
        ] {
            let error = Script::from_json(text).expect_err(text).to_string();
            assert!(error.contains(needle), "{text}: {error}");
        }
    }

    #[test]
    fn a_turntable_turns_once_about_its_target() {
        let camera = CameraSection {
            position: [3.0, 2.0, 5.0],
            target: [1.0, 1.0, 1.0],
            up: [0.0, 1.0, 0.0],
            fov_deg: 30.0,
        };
        let script = Script::turntable(&camera, 4);
        assert_eq!(script.frames().count(), 4);
        let Step::Set(first) = &script.steps[0] else {
            panic!("a view comes first")
        };
        assert_eq!(first["camera"]["position"], json!([3.0, 2.0, 5.0]));
        let half = turned(&camera, std::f64::consts::PI);
        for (found, expected) in half.position.into_iter().zip([-1.0, 2.0, -3.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
        // Counter-clockwise from above: from +Z towards +X, as the environment turns.
        let quarter = turned(
            &CameraSection {
                position: [0.0, 0.0, 1.0],
                target: [0.0; 3],
                ..camera
            },
            std::f64::consts::FRAC_PI_2,
        );
        assert!((quarter.position[0] - 1.0).abs() < 1e-12);
    }
}
