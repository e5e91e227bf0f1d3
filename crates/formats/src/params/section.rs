//! Sections of a scene, and the parameters in them.

use strandlight_scattering::{HairParams, Parameter};

use super::field::{Field, Value};
use super::spec::{Absent, Group, Kind, Numbers, ParamSpec, Shape};
use crate::error::{Error, Result};

/// Where a section keeps a parameter; `None` where it has no place for it, as a ground has none
/// for radii.
pub(super) struct Place<S: 'static> {
    pub get: fn(&S) -> Option<&dyn Field>,
    pub get_mut: fn(&mut S) -> Option<&mut dyn Field>,
}

/// The place of a field of a section.
macro_rules! at {
    ($section:ident . $field:ident) => {
        crate::params::section::Place {
            get: |section: &$section| Some(&section.$field),
            get_mut: |section: &mut $section| Some(&mut section.$field),
        }
    };
}
pub(super) use at;

/// How a number of `[hair]` becomes one of [`HairParams`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Conversion {
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
    pub(super) model: Option<(Parameter, usize, Conversion)>,
}

/// The rows' builders: they are written as a table.
impl<S> Param<S> {
    pub(super) const fn new(
        key: &'static str,
        label: &'static str,
        kind: Kind,
        place: Place<S>,
    ) -> Self {
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

    pub(super) const fn numbers(
        key: &'static str,
        label: &'static str,
        shape: Shape,
        range: [f64; 2],
        place: Place<S>,
    ) -> Self {
        let numbers = Numbers::new(shape, range);
        Param::new(key, label, Kind::Numbers(numbers), place)
    }

    pub(super) const fn number(
        key: &'static str,
        label: &'static str,
        range: [f64; 2],
        place: Place<S>,
    ) -> Self {
        Param::numbers(key, label, Shape::Number, range, place)
    }

    pub(super) const fn with(mut self, numbers: Numbers) -> Self {
        match &mut self.spec.kind {
            Kind::Numbers(own) | Kind::ChoiceOrColor(_, own) => *own = numbers,
            _ => {}
        }
        self
    }

    pub(super) const fn own_numbers(&self) -> Numbers {
        match self.spec.numbers() {
            Some(numbers) => *numbers,
            None => Numbers::new(Shape::Number, [0.0, 0.0]),
        }
    }

    pub(super) const fn unit(self, unit: &'static str) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers { unit, ..numbers })
    }

    pub(super) const fn slider(self, min: f64, max: f64) -> Self {
        let numbers = self.own_numbers();
        let slider = Some([min, max]);
        self.with(Numbers { slider, ..numbers })
    }

    pub(super) const fn decimals(self, decimals: usize) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers {
            decimals,
            ..numbers
        })
    }

    pub(super) const fn logarithmic(self) -> Self {
        let numbers = self.own_numbers();
        self.with(Numbers {
            is_logarithmic: true,
            ..numbers
        })
    }

    pub(super) const fn symbol(mut self, symbol: &'static str) -> Self {
        self.spec.symbol = symbol;
        self
    }

    pub(super) const fn help(mut self, help: &'static str) -> Self {
        self.spec.help = help;
        self
    }

    pub(super) const fn absent(mut self, absent: Absent) -> Self {
        self.spec.absent = absent;
        self
    }

    pub(super) const fn group(mut self, group: Group) -> Self {
        self.spec.group = group;
        self
    }

    pub(super) const fn model(self, parameter: Parameter, conversion: Conversion) -> Self {
        self.model_at(parameter, 0, conversion)
    }

    pub(super) const fn model_at(
        mut self,
        parameter: Parameter,
        ix: usize,
        conversion: Conversion,
    ) -> Self {
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
