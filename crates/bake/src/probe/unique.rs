//! JSON whose objects have every key once.

use std::fmt;

use serde::de::{self, Deserialize, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};

use super::keys::shortened;

/// A JSON value, read with an error where an object has a key twice. JSON leaves the meaning of
/// that open and [`Value`] keeps the last one, so that a slip would go unseen.
#[derive(Clone, Debug, PartialEq)]
pub struct Unique(pub Value);

impl<'de> Deserialize<'de> for Unique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Reader(&Path::Root).deserialize(deserializer).map(Unique)
    }
}

/// Where a value stands.
enum Path<'a> {
    Root,
    Key(&'a Path<'a>, &'a str),
    Item(&'a Path<'a>, usize),
}

impl fmt::Display for Path<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Path::Root => Ok(()),
            Path::Key(Path::Root, key) => f.write_str(&shortened(key)),
            Path::Key(parent, key) => write!(f, "{parent}.{}", shortened(key)),
            Path::Item(parent, ix) => write!(f, "{parent}[{ix}]"),
        }
    }
}

struct Reader<'a>(&'a Path<'a>);

impl<'de> DeserializeSeed<'de> for Reader<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Reader<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(item) = items.next_element_seed(Reader(&Path::Item(self.0, array.len())))? {
            array.push(item);
        }
        Ok(Value::Array(array))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            if object.contains_key(&key) {
                let path = Path::Key(self.0, &key);
                return Err(de::Error::custom(format_args!("key {path} is there twice")));
            }
            let value = entries.next_value_seed(Reader(&Path::Key(self.0, &key)))?;
            object.insert(key, value);
        }
        Ok(Value::Object(object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_value_reads() {
        let text =
            r#"{"a":[1,-2,3.5e300,null,true,"x\n",{"a":{}}],"b":"","c":18446744073709551615}"#;
        let Unique(value) = serde_json::from_str(text).unwrap();
        assert_eq!(value, serde_json::from_str::<Value>(text).unwrap());
    }

    #[test]
    fn a_key_twice_is_an_error_at_any_depth() {
        for (text, path) in [
            (r#"{"a":1,"a":1}"#, "key a is"),
            (r#"[{"b":{"c":1,"a":2,"\u0063":3}}]"#, "key [0].b.c is"),
        ] {
            let error = serde_json::from_str::<Unique>(text).unwrap_err();
            let message = format!("{path} there twice");
            assert!(error.to_string().contains(&message), "{error}");
        }
    }

    #[test]
    fn deep_nesting_is_an_error() {
        assert!(serde_json::from_str::<Unique>(&"[".repeat(100_000)).is_err());
    }
}
