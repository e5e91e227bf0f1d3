//! The keys of a query, read by hand so that every message names the whole path of a key, its
//! value, and what is accepted.

use std::ops::RangeInclusive;

use serde_json::{Map, Value};

/// Longest value that a message quotes, in characters.
const MAX_QUOTED: usize = 60;

/// An object of a query: all its keys are known, and each is read by its name.
pub struct Keys<'a> {
    /// Path of the object, empty for the query itself.
    path: String,
    object: &'a Map<String, Value>,
}

impl<'a> Keys<'a> {
    /// The query itself, which may have the keys `known`.
    pub fn from_query(object: &'a Map<String, Value>, known: &[&str]) -> Result<Keys<'a>, String> {
        Keys::new(String::new(), object, known)
    }

    fn new(
        path: String,
        object: &'a Map<String, Value>,
        known: &[&str],
    ) -> Result<Keys<'a>, String> {
        let keys = Keys { path, object };
        match object.keys().find(|key| !known.contains(&key.as_str())) {
            Some(key) => {
                let (place, known) = (keys.place(), known.join(", "));
                let key = shortened(key);
                Err(format!("{place}unknown field `{key}`, expected {known}"))
            }
            None => Ok(keys),
        }
    }

    /// `hair.shift: ` before what is said about an object, nothing for the query itself.
    fn place(&self) -> String {
        match self.path.as_str() {
            "" => String::new(),
            path => format!("{path}: "),
        }
    }

    /// The whole path of `key`.
    fn path_of(&self, key: &str) -> String {
        match self.path.as_str() {
            "" => key.to_owned(),
            path => format!("{path}.{key}"),
        }
    }

    fn get(&self, key: &str) -> Result<&'a Value, String> {
        let missing = || format!("{}missing field `{key}`", self.place());
        self.object.get(key).ok_or_else(missing)
    }

    /// Is there a value for `key`? `null` stands for none.
    fn has(&self, key: &str) -> bool {
        self.object.get(key).is_some_and(|value| !value.is_null())
    }

    /// `key` by `read`, or nothing if it is not there.
    pub fn optional<T>(
        &self,
        key: &str,
        read: impl FnOnce(&Self, &str) -> Result<T, String>,
    ) -> Result<Option<T>, String> {
        self.has(key).then(|| read(self, key)).transpose()
    }

    /// The object at `key`, which may have the keys `known`.
    pub fn object(&self, key: &str, known: &[&str]) -> Result<Keys<'a>, String> {
        match self.get(key)? {
            Value::Object(object) => Keys::new(self.path_of(key), object, known),
            other => {
                let accepted = format!("an object with {}", known.join(", "));
                Err(refused(&self.path_of(key), other, &accepted))
            }
        }
    }

    /// The text at `key`.
    pub fn text(&self, key: &str, accepted: &str) -> Result<&'a str, String> {
        let value = self.get(key)?;
        let path = self.path_of(key);
        value
            .as_str()
            .ok_or_else(|| refused(&path, value, accepted))
    }

    /// What `parse` makes of the text at `key`; `accepted` says which texts it takes.
    pub fn named<T>(
        &self,
        key: &str,
        accepted: &str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, String> {
        let text = self.text(key, accepted)?;
        parse(text).ok_or_else(|| refused(&self.path_of(key), &Value::from(text), accepted))
    }

    /// The number at `key`, which must lie in `range`.
    pub fn number(&self, key: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
        number(&self.path_of(key), self.get(key)?, &range)
    }

    /// As [`Keys::number`], for three of them.
    pub fn rgb(&self, key: &str, range: RangeInclusive<f64>) -> Result<[f64; 3], String> {
        let (path, value) = (self.path_of(key), self.get(key)?);
        match value.as_array().map(Vec::as_slice) {
            Some([r, g, b]) => Ok([
                number(&format!("{path}[0]"), r, &range)?,
                number(&format!("{path}[1]"), g, &range)?,
                number(&format!("{path}[2]"), b, &range)?,
            ]),
            _ => {
                let (low, high) = range.into_inner();
                let accepted = format!("a list of 3 numbers in {low}..={high}");
                Err(refused(&path, value, &accepted))
            }
        }
    }

    /// The whole number at `key`, which must be one of `accepted`.
    pub fn whole(&self, key: &str, accepted: &[u32]) -> Result<u32, String> {
        let value = self.get(key)?;
        let found = value.as_u64().and_then(|found| u32::try_from(found).ok());
        found
            .filter(|found| accepted.contains(found))
            .ok_or_else(|| {
                let accepted: Vec<String> = accepted.iter().map(u32::to_string).collect();
                let accepted = format!("one of {}", accepted.join(", "));
                refused(&self.path_of(key), value, &accepted)
            })
    }
}

/// `value` as a number of `range`. Messages have it as `{:?}`, which writes 1e300 and 1e-300 with
/// an exponent.
fn number(path: &str, value: &Value, range: &RangeInclusive<f64>) -> Result<f64, String> {
    let (low, high) = (range.start(), range.end());
    let Some(found) = value.as_f64() else {
        let accepted = format!("a number in {low}..={high}");
        return Err(refused(path, value, &accepted));
    };
    if range.contains(&found) {
        Ok(found)
    } else {
        Err(format!("{path} is {found:?}, outside {low}..={high}"))
    }
}

fn refused(path: &str, value: &Value, accepted: &str) -> String {
    let value = shortened(&value.to_string());
    format!("{path} is {value}, must be {accepted}")
}

/// `text`, cut where it is too long for a message.
pub fn shortened(text: &str) -> String {
    match text.char_indices().nth(MAX_QUOTED) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
