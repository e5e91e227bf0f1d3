//! What is said of a parameter.

use super::field::Value;
use crate::error::{Error, Result};
use crate::light_set::MAX_LIGHTS;
use crate::scene_motion::MAX_FRAMES;
use crate::validate::in_range;

/// What the numbers of a parameter are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One number.
    Number,
    /// One whole number.
    Whole,
    /// Width and height, whole numbers.
    Size,
    /// A linear RGB colour.
    Rgb,
    /// A point or a direction.
    Vector,
    /// One number for each of R, TT and TRT.
    PerLobe,
}

impl Shape {
    /// What the key of each number ends in, as messages name it.
    pub const fn suffixes(self) -> &'static [&'static str] {
        match self {
            Shape::Number | Shape::Whole => &[""],
            Shape::Size => &["", ""],
            Shape::Rgb | Shape::Vector => &["", "", ""],
            Shape::PerLobe => &[".r", ".tt", ".trt"],
        }
    }

    /// What the label of each number ends in.
    pub const fn label_suffixes(self) -> &'static [&'static str] {
        match self {
            Shape::Number | Shape::Whole => &[""],
            Shape::Size => &[" width", " height"],
            Shape::Rgb => &[" red", " green", " blue"],
            Shape::Vector => &[" x", " y", " z"],
            Shape::PerLobe => &[" R", " TT", " TRT"],
        }
    }

    /// How many numbers.
    pub const fn len(self) -> usize {
        self.suffixes().len()
    }

    /// Never.
    pub const fn is_empty(self) -> bool {
        false
    }
}

/// Numbers of a parameter, all of the same range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers {
    /// What they are.
    pub shape: Shape,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Their unit, empty where they have none.
    pub unit: &'static str,
    /// What a slider covers; the rest of the range can be typed.
    pub slider: Option<[f64; 2]>,
    /// Digits after the point that are shown.
    pub decimals: usize,
    /// A slider moves by factors.
    pub is_logarithmic: bool,
}

impl Numbers {
    pub(super) const fn new(shape: Shape, [min, max]: [f64; 2]) -> Numbers {
        Numbers {
            shape,
            min,
            max,
            unit: "",
            slider: None,
            decimals: match shape {
                Shape::Whole | Shape::Size => 0,
                _ => 2,
            },
            is_logarithmic: false,
        }
    }

    /// The unit as it stands after a number: nothing for those that take a phrase, such as "per
    /// fibre radius".
    pub fn unit_suffix(&self) -> String {
        match self.unit {
            "" | "°" => self.unit.to_owned(),
            phrase if phrase.contains(' ') => String::new(),
            unit => format!(" {unit}"),
        }
    }
}

/// One of several words: as files have it, as the panel shows it, and what it does.
pub type Word = (&'static str, &'static str, &'static str);

/// What a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Numbers in a range.
    Numbers(Numbers),
    /// One of these words.
    Choice(&'static [Word]),
    /// Some of these words, each once, at least one.
    Choices(&'static [Word]),
    /// One of these words, or a colour.
    ChoiceOrColor(&'static [Word], Numbers),
    /// Numbers of lights of the set, each once.
    Lights,
    /// The name of a file.
    File,
    /// Names of files.
    Files,
    /// The name of a preset.
    Preset,
}

/// What holds where a key is not in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Absent {
    /// The file is refused.
    Refused,
    /// The section's default.
    Default,
    /// This number. The section itself does not hold it.
    Number(f64),
    /// What these words say.
    Words(&'static str),
}

/// What is said of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamSpec {
    /// Key below its section, as files, `--set` and scripts have it.
    pub key: &'static str,
    /// Short name for people.
    pub label: &'static str,
    /// Symbol in the papers, empty where there is none.
    pub symbol: &'static str,
    /// What it does, in words that need no paper.
    pub help: &'static str,
    /// What it takes.
    pub kind: Kind,
    /// What holds without it.
    pub absent: Absent,
    /// Rows of one group stand together in the panel.
    pub group: Group,
}

/// What stands together in the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Everything of the section that is in no other group.
    Main,
    /// The colour of the hair.
    Color,
    /// The lobes of the modes.
    Lobes,
}

impl ParamSpec {
    /// Its numbers, if it has any.
    pub const fn numbers(&self) -> Option<&Numbers> {
        match &self.kind {
            Kind::Numbers(numbers) | Kind::ChoiceOrColor(_, numbers) => Some(numbers),
            _ => None,
        }
    }

    /// Checks `value`, called `key` in messages.
    ///
    /// # Errors
    /// `Value`, naming the key of the number or word that is wrong.
    pub fn check(&self, key: &str, value: &Value) -> Result<()> {
        let in_numbers = |numbers: &Numbers, values: &[f64]| {
            let suffixes = numbers.shape.suffixes();
            values
                .iter()
                .zip(suffixes)
                .try_for_each(|(&value, suffix)| {
                    in_range(format!("{key}{suffix}"), value, numbers.min, numbers.max)
                })
        };
        let among = |words: &[Word], text: &str| words.iter().any(|(word, ..)| *word == text);
        match (self.kind, value) {
            (Kind::Numbers(numbers) | Kind::ChoiceOrColor(_, numbers), value)
                if !matches!(value, Value::Text(_) | Value::Texts(_)) =>
            {
                in_numbers(&numbers, &value.numbers())
            }
            (Kind::Choice(words) | Kind::ChoiceOrColor(words, _), Value::Text(text))
                if among(words, text) =>
            {
                Ok(())
            }
            (Kind::Choices(words), Value::Texts(texts)) => {
                let is_once = |ix: usize| !texts[..ix].contains(&texts[ix]);
                let is_known = texts.iter().all(|text| among(words, text));
                match !texts.is_empty() && is_known && (0..texts.len()).all(is_once) {
                    true => Ok(()),
                    false => {
                        let shown = format!("[{}]", texts.join(", "));
                        Err(Error::value(key, shown, self.accepted()))
                    }
                }
            }
            (Kind::Lights, Value::Numbers(lights)) => {
                let is_bad = |at: usize| {
                    lights[at] >= MAX_LIGHTS as f64 || lights[..at].contains(&lights[at])
                };
                match (0..lights.len()).find(|&at| is_bad(at)) {
                    Some(at) => Err(Error::value(key, lights[at], self.accepted())),
                    None => Ok(()),
                }
            }
            (Kind::File, Value::Text(name)) if !name.is_empty() => Ok(()),
            (Kind::File, Value::Text(_)) => Err(Error::value(key, "\"\"", self.accepted())),
            (Kind::Files, Value::Texts(names)) if names.len() > MAX_FRAMES => {
                let most = format!("at most {MAX_FRAMES} files");
                Err(Error::value(key, names.len(), most))
            }
            (Kind::Files, Value::Texts(names)) => match names.iter().any(String::is_empty) {
                true => Err(Error::value(key, "\"\"", self.accepted())),
                false => Ok(()),
            },
            (Kind::Preset, Value::Text(_)) => Ok(()),
            (_, value) => Err(Error::value(key, value, self.accepted())),
        }
    }

    /// What it takes, in words.
    pub fn accepted(&self) -> String {
        let words = |words: &[Word]| {
            let words: Vec<&str> = words.iter().map(|(word, ..)| *word).collect();
            words.join(", ")
        };
        match self.kind {
            Kind::Numbers(numbers) => numbers.accepted(),
            Kind::Choice(of) => format!("one of {}", words(of)),
            Kind::Choices(of) => format!("some of {}, each once", words(of)),
            Kind::ChoiceOrColor(of, numbers) => {
                format!("one of {}, or {}", words(of), numbers.accepted())
            }
            Kind::Lights => format!("lights of the set, 0..={}, each once", MAX_LIGHTS - 1),
            Kind::File => "the name of a file".to_owned(),
            Kind::Files => "names of files".to_owned(),
            Kind::Preset => "the name of a preset".to_owned(),
        }
    }
}

impl Numbers {
    /// The range in words.
    fn accepted(&self) -> String {
        format!("in {}..={}", self.min, self.max)
    }
}
