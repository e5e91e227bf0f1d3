//! Every parameter of a scene, once: key, label, symbol, unit, range, default, help, and how it is
//! read and set.
//!
//! - [`HAIR`], [`LIGHTS`], [`ADJUST`], [`CAMERA`], [`RENDER`], [`MOTION`], [`WIND`], [`ELLIPSOID`],
//!   [`GROUND`]: a [`Section`] of a scene with its [`Param`]s.
//! - [`ParamSpec`]: what is said of a parameter; [`SECTIONS`] lists them without the types of the
//!   sections.
//! - [`reference_markdown`]: the tables of the scene reference.
//!
//! Scenes are checked against these rows, the viewer's panel is laid out from them, and the tests
//! of invalid values walk through them. The ranges of the model itself, in radians, are those of
//! [`Parameter::range`].
//!
//! ```
//! use strandlight_formats::{HairSection, params::{HAIR, Value}};
//!
//! let mut hair = HairSection::default();
//! let eta = HAIR.param("eta").expect("a row");
//! assert_eq!(eta.get(&hair), Some(Value::Number(1.55)));
//! assert!(eta.set(&mut hair, Some(Value::Number(9.0))).is_err());
//! ```

mod field;
mod hair;
mod lights;
mod motion;
mod picture;
mod reference;
#[cfg(test)]
mod tests;

use strandlight_scattering::{HairParams, Parameter};

use crate::error::{Error, Result};
use crate::light_set::MAX_LIGHTS;
use crate::scene_motion::MAX_FRAMES;
use crate::validate::in_range;

pub use field::{Field, Value};
pub use hair::HAIR;
pub use lights::{ADJUST, LIGHTS};
pub use motion::{ELLIPSOID, GROUND, MOTION, WIND};
pub use picture::{CAMERA, GROOM, RENDER, TABLES};
pub use reference::reference_markdown;

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
    const fn new(shape: Shape, [min, max]: [f64; 2]) -> Numbers {
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
    /// What it does, to somebody who has not read the papers.
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

/// A section without its type: what is said of it and of its parameters.
pub trait SectionSpec {
    /// See [`Section::name`].
    fn name(&self) -> &'static str;
    /// See [`Section::heading`].
    fn heading(&self) -> &'static str;
    /// See [`Section::kind`].
    fn kind(&self) -> Option<&'static str>;
    /// See [`Section::help`].
    fn help(&self) -> &'static str;
    /// Its parameters, each with its value in the plain section.
    fn specs(&self) -> Vec<(&'static ParamSpec, Option<Value>)>;
}

impl<S> SectionSpec for Section<S> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn heading(&self) -> &'static str {
        self.heading
    }

    fn kind(&self) -> Option<&'static str> {
        self.kind
    }

    fn help(&self) -> &'static str {
        self.help
    }

    fn specs(&self) -> Vec<(&'static ParamSpec, Option<Value>)> {
        let plain = (self.plain)();
        let params = self.params.iter();
        params
            .map(|param| (&param.spec, param.get(&plain)))
            .collect()
    }
}

/// Every section of a scene, in the order of the reference.
pub const SECTIONS: [&dyn SectionSpec; 11] = [
    &GROOM, &LIGHTS, &ADJUST, &TABLES, &HAIR, &CAMERA, &RENDER, &MOTION, &WIND, &ELLIPSOID, &GROUND,
];

/// The keys of all parameters, such as `hair.eta`.
pub fn keys() -> impl Iterator<Item = String> {
    SECTIONS.into_iter().flat_map(|section| {
        let specs = section.specs().into_iter();
        specs.map(|(spec, _)| format!("{}.{}", section.name(), spec.key))
    })
}

/// Where a section keeps a parameter; `None` where it has no place for it, as a ground has none
/// for radii.
struct Place<S: 'static> {
    get: fn(&S) -> Option<&dyn Field>,
    get_mut: fn(&mut S) -> Option<&mut dyn Field>,
}

/// The place of a field of a section.
macro_rules! at {
    ($section:ident . $field:ident) => {
        crate::params::Place {
            get: |section: &$section| Some(&section.$field),
            get_mut: |section: &mut $section| Some(&mut section.$field),
        }
    };
}
use at;

/// How a number of `[hair]` becomes one of [`HairParams`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Conversion {
    /// As it is.
    Same,
    /// From degrees.
    Degrees,
    /// From a standard deviation in degrees to Xu's width.
    StdDevDegrees,
}

impl Conversion {
    fn convert(self, value: f64) -> f64 {
        match self {
            Conversion::Same => value,
            Conversion::Degrees => value.to_radians(),
            Conversion::StdDevDegrees => value.to_radians() * std::f64::consts::SQRT_2,
        }
    }
}

/// One parameter of the section `S`.
pub struct Param<S: 'static> {
    /// What is said of it.
    pub spec: ParamSpec,
    place: Place<S>,
    /// The parameter of the model that it sets, from which of its numbers on, and how.
    model: Option<(Parameter, usize, Conversion)>,
}

/// The rows' builders: they are written as a table.
impl<S> Param<S> {
    const fn new(key: &'static str, label: &'static str, kind: Kind, place: Place<S>) -> Self {
        let spec = ParamSpec {
            key,
            label,
            symbol: "",
            help: "",
            kind,
            absent: Absent::Default,
            group: Group::Main,
        };
        Param {
            spec,
            place,
            model: None,
        }
    }

    const fn numbers(
        key: &'static str,
        label: &'static str,
        shape: Shape,
        range: [f64; 2],
        place: Place<S>,
    ) -> Self {
        let numbers = Numbers::new(shape, range);
        Param::new(key, label, Kind::Numbers(numbers), place)
    }

    const fn number(
        key: &'static str,
        label: &'static str,
        range: [f64; 2],
        place: Place<S>,
    ) -> Self {
        Param::numbers(key, label, Shape::Number, range, place)
    }

    const fn with(mut self, numbers: Numbers) -> Self {
        match &mut self.spec.kind {
            Kind::Numbers(own) | Kind::ChoiceOrColor(_, own) => *own = numbers,
            _ => {}
        }
        self
    }

    const fn own_numbers(&self) -> Numbers {
        match self.spec.numbers() {
            Some(numbers) => *numbers,
            None => Numbers::new(Shape::Number, [0.0, 0.0]),
        }
    }

    const fn unit(self, unit: &'static str) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers { unit, ..numbers })
    }

    const fn slider(self, min: f64, max: f64) -> Self {
        let numbers = self.own_numbers();
        let slider = Some([min, max]);
        self.with(Numbers { slider, ..numbers })
    }

    const fn decimals(self, decimals: usize) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers {
            decimals,
            ..numbers
        })
    }

    const fn logarithmic(self) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers {
            is_logarithmic: true,
            ..numbers
        })
    }

    const fn symbol(mut self, symbol: &'static str) -> Self {
        self.spec.symbol = symbol;
        self
    }

    const fn help(mut self, help: &'static str) -> Self {
        self.spec.help = help;
        self
    }

    const fn absent(mut self, absent: Absent) -> Self {
        self.spec.absent = absent;
        self
    }

    const fn group(mut self, group: Group) -> Self {
        self.spec.group = group;
        self
    }

    const fn model(self, parameter: Parameter, conversion: Conversion) -> Self {
        self.model_at(parameter, 0, conversion)
    }

    const fn model_at(mut self, parameter: Parameter, ix: usize, conversion: Conversion) -> Self {
        self.model = Some((parameter, ix, conversion));
        self
    }
}

impl<S> Param<S> {
    /// Its value in `section`; `None` where it is absent.
    pub fn get(&self, section: &S) -> Option<Value> {
        (self.place.get)(section)?.get()
    }

    /// Checks and sets its value in `section`; `None` takes an optional one away.
    ///
    /// # Errors
    /// A value outside its range or of another kind, or one that this section has no place for.
    /// Nothing is changed then.
    pub fn set(&self, section: &mut S, value: Option<Value>) -> Result<()> {
        let key = self.spec.key;
        if let Some(value) = &value {
            self.spec.check(key, value)?;
        }
        let shown = value.as_ref().map_or("absent".to_owned(), Value::to_string);
        let is_set = (self.place.get_mut)(section).is_some_and(|field| field.set(value));
        match is_set {
            true => Ok(()),
            false => Err(Error::value(key, shown, self.spec.accepted())),
        }
    }

    /// Sets the numbers of the model that follow from it alone.
    pub(crate) fn put_in_model(&self, section: &S, model: &mut HairParams) {
        let (Some((parameter, first, conversion)), Some(value)) = (self.model, self.get(section))
        else {
            return;
        };
        let mut values = parameter.get(model);
        for (to, from) in values[first..].iter_mut().zip(value.numbers()) {
            *to = conversion.convert(from);
        }
        parameter.set(model, values);
    }
}

/// A section of a scene.
pub struct Section<S: 'static> {
    /// What its keys begin with, e.g. `hair`.
    pub name: &'static str,
    /// Its heading in a file, e.g. `[hair]`.
    pub heading: &'static str,
    /// The word at its key `kind`, where sections of this name are of several kinds.
    pub kind: Option<&'static str>,
    /// What it is for, and what holds without it.
    pub help: &'static str,
    /// Its parameters.
    pub params: &'static [Param<S>],
    /// The section of a file that says nothing but what it must.
    pub plain: fn() -> S,
}

impl<S> Section<S> {
    /// The parameter called `key`.
    pub fn param(&self, key: &str) -> Option<&'static Param<S>> {
        self.params.iter().find(|param| param.spec.key == key)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// `Value` naming the first key whose value is not accepted.
    pub fn validate(&self, section: &S) -> Result<()> {
        self.validate_as(section, |key| format!("{}.{key}", self.name))
    }

    /// Checks every value, keys being named as `name` has them.
    pub(crate) fn validate_as(&self, section: &S, name: impl Fn(&str) -> String) -> Result<()> {
        for param in self.params {
            if let Some(value) = param.get(section) {
                param.spec.check(&name(param.spec.key), &value)?;
            }
        }
        Ok(())
    }
}
