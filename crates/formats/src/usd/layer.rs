//! One layer of USD, whichever encoding it comes in: a tree of prims with attributes whose values
//! are decoded when they are asked for.

use std::collections::{BTreeMap, HashMap};

use super::binary::Crate;
use super::model::{Budget, Numbers, Prim, Real, Specifier, Value};
use super::text;
use crate::error::Result;

/// What a value takes besides its numbers, about.
const VALUE_BYTES: u64 = 64;

/// A layer with all its prims.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    /// The root of all paths; its metadata are those of the layer.
    pub root: Prim,
    source: Source<'a>,
    budget: Budget,
}

/// What values are decoded from.
#[derive(Debug)]
pub(super) enum Source<'a> {
    /// All bytes of a text file.
    Text(&'a [u8]),
    /// A binary file.
    Crate(Box<Crate<'a>>),
}

impl<'a> Layer<'a> {
    /// A layer of a file of `length` bytes.
    pub fn new(root: Prim, source: Source<'a>, length: usize) -> Self {
        Layer {
            root,
            source,
            budget: Budget::of(length),
        }
    }

    /// `n` values of `size` bytes are about to be made of what is decoded.
    pub fn spend_on(&self, n: usize, size: usize) -> Result<()> {
        self.budget.spend(n as u64, size as u64, 0)
    }

    /// A value is about to be decoded.
    fn spend(&self, value: &Value) -> Result<()> {
        match value {
            Value::Text(range) => {
                let length = range.len() as u64 + VALUE_BYTES;
                self.budget.spend(length, 1, range.start as u64)
            }
            // Binary files count the numbers of arrays themselves.
            Value::Rep(_) => self.budget.spend(VALUE_BYTES, 1, 0),
        }
    }

    /// The numbers of `value`; `None` where it is blocked or holds something else.
    pub fn numbers<T: Real>(&self, value: &Value) -> Result<Option<Numbers<T>>> {
        self.spend(value)?;
        match (&self.source, value) {
            (Source::Text(bytes), Value::Text(range)) => text::numbers(bytes, range.clone()),
            (Source::Crate(file), Value::Rep(rep)) => file.numbers(*rep),
            _ => Ok(None),
        }
    }

    /// The strings or tokens of `value`; empty where it holds something else.
    pub fn strings(&self, value: &Value) -> Result<Vec<String>> {
        self.spend(value)?;
        match (&self.source, value) {
            (Source::Text(bytes), Value::Text(range)) => text::strings(bytes, range.clone()),
            (Source::Crate(file), Value::Rep(rep)) => file.strings(*rep),
            _ => Ok(Vec::new()),
        }
    }

    /// Is there nothing on purpose?
    pub fn is_blocked(&self, value: &Value) -> bool {
        match (&self.source, value) {
            (Source::Text(bytes), Value::Text(range)) => &bytes[range.clone()] == b"None",
            (Source::Crate(_), Value::Rep(rep)) => Crate::is_blocked(*rep),
            _ => true,
        }
    }

    /// The files that a list of references, payloads or layers names, and of prims of this file
    /// their paths; as written in text files, `@hair.usd@` or `</Hair>`.
    pub fn assets(&self, value: &Value) -> Result<Vec<String>> {
        self.spend(value)?;
        match (&self.source, value) {
            (Source::Text(bytes), Value::Text(range)) => text::assets(bytes, range.clone()),
            (Source::Crate(file), Value::Rep(rep)) => file.assets(*rep),
            _ => Ok(Vec::new()),
        }
    }

    /// Set and variant of each choice.
    fn selections(&self, value: &Value) -> Result<Vec<(String, String)>> {
        let flat = self.strings(value)?;
        let pairs = flat.chunks_exact(2);
        Ok(pairs.map(|p| (p[0].clone(), p[1].clone())).collect())
    }

    /// The first string of the field called `key`.
    pub fn word(&self, fields: &BTreeMap<String, Value>, key: &str) -> Result<Option<String>> {
        let Some(value) = fields.get(key) else {
            return Ok(None);
        };
        Ok(self.strings(value)?.into_iter().next())
    }

    /// The number of the field called `key`.
    pub fn number(&self, fields: &BTreeMap<String, Value>, key: &str) -> Result<Option<f64>> {
        let Some(value) = fields.get(key) else {
            return Ok(None);
        };
        let numbers = self.numbers::<f64>(value)?;
        Ok(numbers.and_then(|numbers| numbers.data.first().copied()))
    }

    /// Puts the chosen variants into their prims, whose own opinions are stronger. Answers how many
    /// sets have no variant chosen.
    pub fn select_variants(&mut self) -> Result<usize> {
        let mut root = std::mem::take(&mut self.root);
        let n_open = self.select_within(&mut root)?;
        self.root = root;
        Ok(n_open)
    }

    fn select_within(&self, prim: &mut Prim) -> Result<usize> {
        let mut n_open = 0;
        // Variants may have sets and choices of their own. What is taken out is never put back.
        while let Some((set, mut variants)) = self.chosen_set(prim, &mut n_open)? {
            let chosen = variants.iter().position(|variant| variant.name == set);
            if let Some(ix) = chosen {
                prim.add_weaker(variants.swap_remove(ix));
            }
        }
        for child in &mut prim.children {
            n_open += self.select_within(child)?;
        }
        Ok(n_open)
    }

    /// Takes a set of variants out of `prim`: the name of the variant, and all of them.
    fn chosen_set(
        &self,
        prim: &mut Prim,
        n_open: &mut usize,
    ) -> Result<Option<(String, Vec<Prim>)>> {
        if prim.variants.is_empty() {
            return Ok(None);
        }
        for choices in &prim.choices {
            for (set, choice) in self.selections(choices)? {
                if let Some(variants) = prim.variants.remove(&set) {
                    return Ok(Some((choice, variants)));
                }
            }
        }
        *n_open += prim.variants.len();
        prim.variants.clear();
        Ok(None)
    }
}

impl Prim {
    /// Adds what `weaker` says about the same prim, where this one says nothing.
    fn add_weaker(&mut self, weaker: Prim) {
        if self.specifier == Specifier::Over {
            self.specifier = weaker.specifier;
        }
        if self.type_name.is_empty() {
            self.type_name = weaker.type_name;
        }
        for (key, value) in weaker.fields {
            self.fields.entry(key).or_insert(value);
        }
        for (name, property) in weaker.properties {
            let own = self.properties.entry(name).or_default();
            if own.type_name.is_empty() {
                own.type_name = property.type_name;
            }
            // The stronger of two opinions, whether it is samples or a default, hides the other.
            if own.default.is_none() && own.samples.is_empty() {
                own.default = property.default;
                own.samples = property.samples;
            }
            for (key, value) in property.fields {
                own.fields.entry(key).or_insert(value);
            }
        }
        self.choices.extend(weaker.choices);
        for (set, variants) in weaker.variants {
            self.variants.entry(set).or_default().extend(variants);
        }
        // Weaker children come first, as USD orders them.
        let own = std::mem::take(&mut self.children);
        let mut own: Vec<Option<Prim>> = own.into_iter().map(Some).collect();
        let names = own.iter().flatten().zip(0usize..);
        let places: HashMap<String, usize> =
            names.map(|(child, ix)| (child.name.clone(), ix)).collect();
        for child in weaker.children {
            let stronger = places.get(&child.name).and_then(|&ix| own[ix].take());
            self.children.push(match stronger {
                Some(mut stronger) => {
                    stronger.add_weaker(child);
                    stronger
                }
                None => child,
            });
        }
        self.children.extend(own.into_iter().flatten());
    }
}
