//! The answer to a query.

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
    /// Its numbers: one, or three.
    pub fn values(&self) -> &[f64] {
        match self {
            Answer::Number(value) => std::slice::from_ref(value),
            Answer::Rgb(rgb) => rgb,
        }
    }

    /// The answer, if it is one: JSON cannot say what is not finite.
    pub(super) fn finite(self) -> Result<Answer, String> {
        match self.values().iter().all(|value| value.is_finite()) {
            true => Ok(self),
            false => Err("the value is not finite".to_owned()),
        }
    }
}
