//! Text layers, `.usda`.
//!
//! ```text
//! #usda 1.0
//! ( upAxis = "Y" )
//! def BasisCurves "hair" ( kind = "component" )
//! {
//!     point3f[] points = [(0, 0, 0), (0, 1, 0)]
//!     float[] widths = [0.01] ( interpolation = "constant" )
//!     float3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (1, 0, 0) }
//! }
//! ```
//!
//! What stands there without a meaning for hair is passed over, as long as its brackets match.

mod cursor;
mod values;

use cursor::Cursor;
pub(super) use values::{assets, numbers, strings};

use super::model::{MAX_DEPTH, Prim, Property, Specifier, Value};
use crate::error::Result;

/// First bytes of a text layer; the second is its name before USD was published.
pub(super) const SIGNATURES: [&[u8]; 2] = [b"#usda", b"#sdf 1"];

/// Parses a whole text: the root of its prims.
pub(super) fn parse(bytes: &[u8]) -> Result<Prim> {
    let mut parser = Parser {
        cursor: Cursor::new(bytes),
        depth: 0,
    };
    let mut root = Prim::default();
    if parser.cursor.eat(b'(') {
        parser.metadata(&mut root)?;
    }
    parser.contents(&mut root, None)?;
    Ok(root)
}

/// Words before a property that say how it is meant.
const MODIFIERS: [&str; 9] = [
    "custom", "uniform", "varying", "config", "add", "delete", "prepend", "append", "reorder",
];

struct Parser<'a> {
    cursor: Cursor<'a>,
    depth: usize,
}

impl Parser<'_> {
    /// What stands in a prim, up to `end`.
    fn contents(&mut self, prim: &mut Prim, end: Option<u8>) -> Result<()> {
        loop {
            self.cursor.skip_blank();
            match (self.cursor.peek(), end) {
                (None, None) => return Ok(()),
                (None, Some(_)) => return self.cursor.fault("`}` is missing at the end"),
                (next, end) if next == end => {
                    self.cursor.at += 1;
                    return Ok(());
                }
                _ => {}
            }
            let word = self.cursor.name();
            let specifier = match word {
                "def" => Specifier::Def,
                "over" => Specifier::Over,
                "class" => Specifier::Class,
                "variantSet" => {
                    self.variant_set(prim)?;
                    continue;
                }
                _ => {
                    self.property(prim, word)?;
                    continue;
                }
            };
            let mut child = Prim {
                specifier,
                type_name: self.cursor.name().to_owned(),
                name: self.cursor.string()?,
                ..Prim::default()
            };
            self.body(&mut child)?;
            prim.children.push(child);
        }
    }

    /// Metadata and contents of a prim or variant.
    fn body(&mut self, prim: &mut Prim) -> Result<()> {
        if self.depth == MAX_DEPTH {
            let what = format!("more than {MAX_DEPTH} prims within prims");
            return self.cursor.fault(what);
        }
        self.depth += 1;
        if self.cursor.eat(b'(') {
            self.metadata(prim)?;
        }
        self.cursor.expect(b'{', "before the contents of a prim")?;
        self.contents(prim, Some(b'}'))?;
        self.depth -= 1;
        Ok(())
    }

    /// `"name" = { "variant" { ... } ... }`
    fn variant_set(&mut self, prim: &mut Prim) -> Result<()> {
        let name = self.cursor.string()?;
        self.cursor
            .expect(b'=', "after the name of a variant set")?;
        self.cursor.expect(b'{', "before the variants of a set")?;
        let mut variants = Vec::new();
        while !self.cursor.eat(b'}') {
            let mut variant = Prim {
                name: self.cursor.string()?,
                ..Prim::default()
            };
            self.body(&mut variant)?;
            variants.push(variant);
        }
        prim.variants.entry(name).or_default().extend(variants);
        Ok(())
    }

    /// An attribute or relationship that starts with `word`.
    fn property(&mut self, prim: &mut Prim, word: &str) -> Result<()> {
        let mut word = word;
        while MODIFIERS.contains(&word) {
            word = self.cursor.name();
        }
        if word.is_empty() {
            return self.cursor.fault("neither a prim nor a property");
        }
        let order = ["nameChildren", "rootPrims", "properties"];
        if order.contains(&word) && self.cursor.eat(b'=') {
            return self.cursor.skip_value().map(drop);
        }
        let mut type_name = word.to_owned();
        if self.cursor.eat(b'[') {
            self.cursor.expect(b']', "after `[` of a type")?;
            type_name += "[]";
        }
        let full_name = self.cursor.name();
        if full_name.is_empty() {
            return self
                .cursor
                .fault(format!("a name is missing after `{word}`"));
        }
        let (name, part) = full_name.split_once('.').unwrap_or((full_name, ""));
        // Nothing is asked of relationships.
        if word == "rel" {
            return self.rest_of_property(&mut Property::default(), "rel");
        }
        let property = prim.properties.entry(name.to_owned()).or_default();
        property.type_name = type_name;
        self.rest_of_property(property, part)
    }

    /// What follows the name of a property, `part` of it.
    fn rest_of_property(&mut self, property: &mut Property, part: &str) -> Result<()> {
        if self.cursor.eat(b'=') {
            match part {
                "timeSamples" => property.samples = self.samples()?,
                _ => {
                    let value = self.cursor.skip_value()?;
                    if part.is_empty() {
                        property.default = Some(Value::Text(value));
                    }
                }
            }
        }
        if self.cursor.eat(b'(') {
            let mut holder = Prim::default();
            self.metadata(&mut holder)?;
            property.fields.append(&mut holder.fields);
        }
        Ok(())
    }

    /// `{ 1: value, 2: None }`, sorted; of equal times the last.
    fn samples(&mut self) -> Result<Vec<(f64, Value)>> {
        self.cursor.expect(b'{', "before samples over time")?;
        let mut samples: Vec<(f64, Value)> = Vec::new();
        while !self.cursor.eat(b'}') {
            let start = self.cursor.clone();
            let word = self.cursor.skip_value()?;
            let time = std::str::from_utf8(&self.cursor.bytes[word]).unwrap_or_default();
            let time = time.parse::<f64>().ok().filter(|time| time.is_finite());
            let Some(time) = time else {
                return start.fault("a time is not a number");
            };
            self.cursor.expect(b':', "after a time")?;
            samples.push((time, Value::Text(self.cursor.skip_value()?)));
            self.cursor.eat(b',');
        }
        samples.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        samples.reverse();
        samples.dedup_by(|(a, _), (b, _)| a == b);
        samples.reverse();
        Ok(samples)
    }

    /// `key = value` up to `)`, into the fields of `prim`.
    fn metadata(&mut self, prim: &mut Prim) -> Result<()> {
        while !self.cursor.eat(b')') {
            if let Some(b'"' | b'\'') = self.cursor.peek() {
                // A comment.
                self.cursor.string()?;
                continue;
            }
            let mut key = self.cursor.name();
            let is_deleted = key == "delete";
            if MODIFIERS.contains(&key) {
                key = self.cursor.name();
            }
            if key.is_empty() {
                return self.cursor.fault("neither a key nor `)`");
            }
            self.cursor.expect(b'=', "after the key of metadata")?;
            let value = self.metadata_value()?;
            match key {
                _ if is_deleted => {}
                "variants" => prim.choices.push(value),
                _ => {
                    prim.fields.entry(key.to_owned()).or_insert(value);
                }
            }
        }
        Ok(())
    }

    /// A value, and behind a file or path a path and `(offset = 1)`.
    fn metadata_value(&mut self) -> Result<Value> {
        let mut range = self.cursor.skip_value()?;
        if matches!(self.cursor.bytes[range.start], b'@' | b'<') {
            for next in [b'<', b'('] {
                self.cursor.skip_blank();
                if self.cursor.peek() == Some(next) {
                    range.end = self.cursor.skip_value()?.end;
                }
            }
        }
        Ok(Value::Text(range))
    }
}

#[cfg(test)]
mod tests;
