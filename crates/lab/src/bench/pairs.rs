//! Two builds of the program side by side, by what `strandlight bench frames --json` of each says.
//!
//! Runs are taken in the order this, other, other, this, so that what drifts on the machine drifts
//! for both.

use serde_json::{Value, json};

/// Why the document of a build cannot be compared.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its `bench frames --json` has another shape: {0}")]
pub struct ShapeError(String);

/// The same pictures of both builds.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedScene {
    /// Path of the scene.
    pub scene: String,
    /// Kinds of pictures that both have.
    pub frames: Vec<PairedFrame>,
}

/// One kind of picture; of arrays the first value is that of this build, the second that of the
/// other.
#[derive(Clone, Debug, PartialEq)]
pub struct PairedFrame {
    /// What was edited before.
    pub name: String,
    /// Milliseconds by the clock, means of two runs.
    pub milliseconds: [f64; 2],
    /// Seconds of all cores together, likewise, where the system tells.
    pub core_seconds: Option<[f64; 2]>,
}

impl PairedFrame {
    /// Milliseconds of the other build over ours: above 1, ours is faster.
    pub fn ratio(&self) -> Option<f64> {
        over(self.milliseconds)
    }

    /// The same of core-seconds.
    pub fn core_seconds_ratio(&self) -> Option<f64> {
        self.core_seconds.and_then(over)
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "name": self.name,
            "milliseconds": self.milliseconds,
            "milliseconds_ratio": self.ratio(),
            "core_seconds": self.core_seconds,
            "core_seconds_ratio": self.core_seconds_ratio(),
        })
    }
}

impl PairedScene {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        let frames: Vec<Value> = self.frames.iter().map(PairedFrame::to_json).collect();
        json!({ "scene": self.scene, "frames": frames })
    }
}

fn over([this, other]: [f64; 2]) -> Option<f64> {
    let ratio = other / this;
    ratio.is_finite().then_some(ratio)
}

/// What one run says of a kind of picture.
struct Frame {
    name: String,
    milliseconds: f64,
    core_seconds: Option<f64>,
}

/// Pairs two runs of either build, of the same scenes.
///
/// # Errors
/// A document of the other build without what is compared, or with other scenes. Documents of this
/// one are taken for right.
pub fn pair(this: [&Value; 2], other: [&Value; 2]) -> Result<Vec<PairedScene>, ShapeError> {
    let [ours, ours_again] = [scenes(this[0])?, scenes(this[1])?];
    let [others, others_again] = [scenes(other[0])?, scenes(other[1])?];
    if [ours_again.len(), others.len(), others_again.len()] != [ours.len(); 3] {
        return Err(ShapeError(format!(
            "{} scenes in place of {}",
            others.len(),
            ours.len()
        )));
    }
    let runs = ours.iter().zip(&ours_again);
    let of_other = others.iter().zip(&others_again);
    let pairs = runs.zip(of_other).map(|((a, a_again), (b, b_again))| {
        let frames = a.1.iter().filter_map(|frame| {
            let found = |frames: &'_ [Frame]| -> Option<(f64, Option<f64>)> {
                let found = frames.iter().find(|other| other.name == frame.name)?;
                Some((found.milliseconds, found.core_seconds))
            };
            let ours = mean(found(&a.1)?, found(&a_again.1)?);
            let others = mean(found(&b.1)?, found(&b_again.1)?);
            Some(PairedFrame {
                name: frame.name.clone(),
                milliseconds: [ours.0, others.0],
                core_seconds: ours.1.zip(others.1).map(|(ours, others)| [ours, others]),
            })
        });
        let frames: Vec<PairedFrame> = frames.collect();
        match frames.is_empty() {
            true => Err(ShapeError(format!("no `frames` of {} by our names", a.0))),
            false => Ok(PairedScene {
                scene: a.0.clone(),
                frames,
            }),
        }
    });
    pairs.collect()
}

fn mean(a: (f64, Option<f64>), b: (f64, Option<f64>)) -> (f64, Option<f64>) {
    let half = |a: f64, b: f64| 0.5 * (a + b);
    (half(a.0, b.0), a.1.zip(b.1).map(|(a, b)| half(a, b)))
}

/// Path and pictures of each scene.
fn scenes(document: &Value) -> Result<Vec<(String, Vec<Frame>)>, ShapeError> {
    let missing = |what: &str| ShapeError(format!("no {what}"));
    let scenes = document["scenes"].as_array();
    let scene = |scene: &Value| {
        let path = scene["scene"].as_str().ok_or_else(|| missing("`scene`"))?;
        let frames = scene["frames"].as_array();
        let frames = frames.ok_or_else(|| missing("`frames`"))?.iter();
        let frame = |frame: &Value| {
            let name = frame["name"].as_str();
            let milliseconds = frame["milliseconds"].as_f64();
            Ok(Frame {
                name: name.ok_or_else(|| missing("`name` of a frame"))?.to_owned(),
                milliseconds: milliseconds.ok_or_else(|| missing("`milliseconds` of a frame"))?,
                core_seconds: frame["core_seconds"].as_f64(),
            })
        };
        Ok((
            path.to_owned(),
            frames.map(frame).collect::<Result<_, _>>()?,
        ))
    };
    let scenes = scenes.ok_or_else(|| missing("`scenes`"))?;
    scenes.iter().map(scene).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(frames: &[(&str, f64, Option<f64>)]) -> Value {
        let frame = |&(name, milliseconds, core_seconds): &(&str, f64, Option<f64>)| json!({ "name": name, "milliseconds": milliseconds, "core_seconds": core_seconds });
        let frames: Vec<Value> = frames.iter().map(frame).collect();
        json!({ "scenes": [{ "scene": "a.toml", "frames": frames }] })
    }

    #[test]
    fn ratios_are_those_of_numbers_by_hand() {
        let this = [
            run(&[
                ("view", 10.0, Some(0.01)),
                ("widths", 1.0, Some(0.0)),
                ("new", 1.0, None),
            ]),
            run(&[
                ("view", 30.0, Some(0.03)),
                ("widths", 1.0, Some(0.0)),
                ("new", 1.0, None),
            ]),
        ];
        let other = [
            run(&[
                ("widths", 5.0, Some(0.1)),
                ("view", 50.0, Some(0.04)),
                ("old", 1.0, None),
            ]),
            run(&[
                ("widths", 7.0, Some(0.1)),
                ("view", 70.0, Some(0.08)),
                ("old", 1.0, None),
            ]),
        ];
        let paired = pair(this.each_ref(), other.each_ref()).expect("the same shape");
        assert_eq!(paired.len(), 1);
        let [view, widths] = &paired[0].frames[..] else {
            panic!("{paired:?}");
        };
        assert_eq!((view.milliseconds, view.ratio()), ([20.0, 60.0], Some(3.0)));
        let ratio = view.core_seconds_ratio().expect("measured");
        assert!((ratio - 3.0).abs() < 1e-12, "{view:?}");
        assert_eq!(widths.ratio(), Some(6.0));
        assert_eq!(widths.core_seconds_ratio(), None);
    }

    #[test]
    fn other_shapes_are_refused() {
        let ours = run(&[("view", 1.0, None)]);
        let others = [
            json!({}),
            json!({ "frames": [] }),
            json!({ "scenes": [] }),
            json!({ "scenes": [{ "frames": [] }] }),
            json!({ "scenes": [{ "scene": "a.toml" }] }),
            json!({ "scenes": [{ "scene": "a.toml", "frames": [{ "name": "view" }] }] }),
            json!({ "scenes": [{ "scene": "a.toml", "frames": [{ "milliseconds": 1.0 }] }] }),
            run(&[("from the side", 1.0, None)]),
        ];
        for other in others {
            let refused = |other: [&Value; 2]| pair([&ours; 2], other).expect_err("another shape");
            let text = refused([&other; 2]).to_string();
            assert!(
                text.contains("another shape: ") && !text.contains('\n'),
                "{text}"
            );
            // The second run counts as well.
            refused([&ours, &other]);
        }
    }
}
