//! Values of parameters, and the types of fields that hold them.

use std::fmt;
use std::path::PathBuf;

use strandlight_scattering::{Lobe, Model, PerLobe};

use crate::scene::{Background, LutInput, Scattering, ToneMap};

/// A value of any parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A colour, a vector, or a number for each mode.
    Vector([f64; 3]),
    /// Numbers, as many as there are.
    Numbers(Vec<f64>),
    /// A word or the name of a file.
    Text(String),
    /// Words or names of files.
    Texts(Vec<String>),
}

impl Value {
    /// Its numbers.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Value::Number(value) => vec![*value],
            Value::Vector(values) => values.to_vec(),
            Value::Numbers(values) => values.clone(),
            Value::Text(_) | Value::Texts(_) => Vec::new(),
        }
    }

    /// Its number `ix`.
    pub fn number(&self, ix: usize) -> Option<f64> {
        self.numbers().get(ix).copied()
    }

    /// The value with another number `ix`; as it is where it has none.
    #[must_use]
    pub fn with_number(mut self, ix: usize, value: f64) -> Value {
        let values = match &mut self {
            Value::Number(own) => std::slice::from_mut(own),
            Value::Vector(values) => &mut values[..],
            Value::Numbers(values) => &mut values[..],
            Value::Text(_) | Value::Texts(_) => &mut [],
        };
        if let Some(own) = values.get_mut(ix) {
            *own = value;
        }
        self
    }
}

impl fmt::Display for Value {
    /// As a scene file has it; a number for each mode as a list.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(value) => write!(f, "{value}"),
            Value::Vector(values) => write!(f, "{values:?}"),
            Value::Numbers(values) => {
                let values: Vec<String> = values.iter().map(f64::to_string).collect();
                write!(f, "[{}]", values.join(", "))
            }
            Value::Text(text) => write!(f, "{text:?}"),
            Value::Texts(texts) => write!(f, "{texts:?}"),
        }
    }
}

/// A field of a section that a parameter is kept in.
pub trait Field {
    /// Its value; `None` where there is none.
    fn get(&self) -> Option<Value>;

    /// Sets it; answers whether that could be: the value is of this kind, and `None` only for
    /// fields that may be absent.
    fn set(&mut self, value: Option<Value>) -> bool;
}

/// Fields that are always there, between their type and a value.
trait Plain: Sized {
    fn to_value(&self) -> Value;
    fn from_value(value: Value) -> Option<Self>;
}

impl<T: Plain> Field for T {
    fn get(&self) -> Option<Value> {
        Some(self.to_value())
    }

    fn set(&mut self, value: Option<Value>) -> bool {
        let read = value.and_then(T::from_value);
        let is_read = read.is_some();
        if let Some(read) = read {
            *self = read;
        }
        is_read
    }
}

impl<T: Plain> Field for Option<T> {
    fn get(&self) -> Option<Value> {
        self.as_ref().map(T::to_value)
    }

    fn set(&mut self, value: Option<Value>) -> bool {
        match value.map(T::from_value) {
            None => *self = None,
            Some(Some(read)) => *self = Some(read),
            Some(None) => return false,
        }
        true
    }
}

impl Plain for f64 {
    fn to_value(&self) -> Value {
        Value::Number(*self)
    }

    fn from_value(value: Value) -> Option<f64> {
        match value {
            Value::Number(value) => Some(value),
            _ => None,
        }
    }
}

/// `value` as a whole number.
fn whole(value: f64) -> Option<u32> {
    (value == value.trunc() && (0.0..=f64::from(u32::MAX)).contains(&value)).then_some(value as u32)
}

impl Plain for u32 {
    fn to_value(&self) -> Value {
        Value::Number(f64::from(*self))
    }

    fn from_value(value: Value) -> Option<u32> {
        f64::from_value(value).and_then(whole)
    }
}

impl Plain for [f64; 3] {
    fn to_value(&self) -> Value {
        Value::Vector(*self)
    }

    fn from_value(value: Value) -> Option<[f64; 3]> {
        match value {
            Value::Vector(values) => Some(values),
            _ => None,
        }
    }
}

impl Plain for PerLobe<f64> {
    fn to_value(&self) -> Value {
        Value::Vector([self.r, self.tt, self.trt])
    }

    fn from_value(value: Value) -> Option<PerLobe<f64>> {
        let [r, tt, trt] = <[f64; 3]>::from_value(value)?;
        Some(PerLobe { r, tt, trt })
    }
}

impl Plain for Vec<u32> {
    fn to_value(&self) -> Value {
        Value::Numbers(self.iter().copied().map(f64::from).collect())
    }

    fn from_value(value: Value) -> Option<Vec<u32>> {
        match value {
            Value::Numbers(values) => values.into_iter().map(whole).collect(),
            _ => None,
        }
    }
}

impl Plain for [u32; 2] {
    fn to_value(&self) -> Value {
        self.to_vec().to_value()
    }

    fn from_value(value: Value) -> Option<[u32; 2]> {
        Vec::from_value(value)?.try_into().ok()
    }
}

impl Plain for String {
    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }

    fn from_value(value: Value) -> Option<String> {
        match value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }
}

impl Plain for PathBuf {
    fn to_value(&self) -> Value {
        Value::Text(self.to_string_lossy().into_owned())
    }

    fn from_value(value: Value) -> Option<PathBuf> {
        String::from_value(value).map(PathBuf::from)
    }
}

/// The texts of a list.
fn texts<T>(value: Value, read: impl Fn(String) -> Option<T>) -> Option<Vec<T>> {
    match value {
        Value::Texts(texts) => texts.into_iter().map(read).collect(),
        _ => None,
    }
}

impl Plain for Vec<PathBuf> {
    fn to_value(&self) -> Value {
        let names = self.iter().map(|file| file.to_string_lossy().into_owned());
        Value::Texts(names.collect())
    }

    fn from_value(value: Value) -> Option<Vec<PathBuf>> {
        texts(value, |name| Some(PathBuf::from(name)))
    }
}

impl Plain for Vec<Lobe> {
    fn to_value(&self) -> Value {
        Value::Texts(self.iter().map(|mode| mode.name().to_owned()).collect())
    }

    fn from_value(value: Value) -> Option<Vec<Lobe>> {
        texts(value, |name| Lobe::from_name(&name))
    }
}

impl Plain for Model {
    fn to_value(&self) -> Value {
        Value::Text(self.name().to_owned())
    }

    fn from_value(value: Value) -> Option<Model> {
        String::from_value(value).and_then(|name| Model::from_name(&name))
    }
}

impl Plain for Scattering {
    fn to_value(&self) -> Value {
        Value::Text(self.name().to_owned())
    }

    fn from_value(value: Value) -> Option<Scattering> {
        let name = String::from_value(value)?;
        Scattering::ALL.into_iter().find(|term| term.name() == name)
    }
}

impl Plain for ToneMap {
    fn to_value(&self) -> Value {
        Value::Text(self.name().to_owned())
    }

    fn from_value(value: Value) -> Option<ToneMap> {
        let name = String::from_value(value)?;
        ToneMap::ALL.into_iter().find(|curve| curve.name() == name)
    }
}

impl Plain for LutInput {
    fn to_value(&self) -> Value {
        Value::Text(self.name().to_owned())
    }

    fn from_value(value: Value) -> Option<LutInput> {
        let name = String::from_value(value)?;
        LutInput::ALL.into_iter().find(|input| input.name() == name)
    }
}

impl Plain for Background {
    fn to_value(&self) -> Value {
        match self {
            Background::Lights => Value::Text("lights".to_owned()),
            Background::Panorama => Value::Text("panorama".to_owned()),
            Background::None => Value::Text("none".to_owned()),
            Background::Color(rgb) => Value::Vector(rgb.map(f64::from)),
        }
    }

    fn from_value(value: Value) -> Option<Background> {
        match value {
            Value::Text(text) if text == "lights" => Some(Background::Lights),
            Value::Text(text) if text == "panorama" => Some(Background::Panorama),
            Value::Text(text) if text == "none" => Some(Background::None),
            Value::Vector(rgb) => Some(Background::Color(rgb.map(|x| x as f32))),
            _ => None,
        }
    }
}
