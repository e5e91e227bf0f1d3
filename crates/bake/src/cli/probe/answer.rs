//! The answer to a query.

use serde_json::{Value, json};

/// The answer to a query: a number, or RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// One number.
    Number(f64),
    /// Linear RGB, where absorption enters.
    Rgb([f64; 3]),
}

impl serde::Serialize for Answer {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Answer::Number(value) => serializer.serialize_f64(*value),
            Answer::Rgb(rgb) => rgb.serialize(serializer),
        }
    }
}

impl Answer {
    /// The answer, if JSON can say it.
    pub fn finite(self) -> Result<Value, String> {
        let is_finite = match self {
            Answer::Number(value) => value.is_finite(),
            Answer::Rgb(rgb) => rgb.iter().all(|value| value.is_finite()),
        };
        if is_finite {
            Ok(json!(self))
        } else {
            Err("the value is not finite".to_owned())
        }
    }
}
