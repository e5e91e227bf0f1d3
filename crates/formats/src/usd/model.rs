//! What a layer of USD consists of, whichever encoding it comes in.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::str::FromStr;

use crate::error::{Error, Result};

/// Prims within prims, and variants within these: more is refused.
pub(super) const MAX_DEPTH: usize = 128;

/// A value of the file that is not decoded yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Value {
    /// Bytes of a text file.
    Text(Range<usize>),
    /// A value representation of a binary file.
    Rep(u64),
}

/// What a prim is there for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Specifier {
    /// `def`: it is there.
    Def,
    /// `over`: says something about a prim that another file has.
    #[default]
    Over,
    /// `class`: others inherit from it.
    Class,
}

/// An attribute of a prim.
#[derive(Debug, Default)]
pub(super) struct Property {
    /// Type as written, `point3f[]`.
    pub type_name: String,
    /// The value outside of time.
    pub default: Option<Value>,
    /// Values over time codes, which rise.
    pub samples: Vec<(f64, Value)>,
    /// Metadata.
    pub fields: BTreeMap<String, Value>,
}

/// A prim, or a variant of one.
#[derive(Debug, Default)]
pub(super) struct Prim {
    /// Last part of its path, or name of the variant.
    pub name: String,
    /// What it is there for.
    pub specifier: Specifier,
    /// `BasisCurves`; empty where none is written.
    pub type_name: String,
    /// Metadata, but for `choices`.
    pub fields: BTreeMap<String, Value>,
    /// Which variant is chosen of which set, the strongest opinion first.
    pub choices: Vec<Value>,
    /// Attributes by name.
    pub properties: BTreeMap<String, Property>,
    /// Variants of each set.
    pub variants: BTreeMap<String, Vec<Prim>>,
    /// The prims below, in order.
    pub children: Vec<Prim>,
}

/// How much may still be made of a file: a few bytes can stand for any number of equal values, and
/// many prims can share a value that is decoded for each.
#[derive(Debug)]
pub(super) struct Budget(Cell<u64>);

/// What may be decoded at least, bytes, however short the file is.
const LEAST_BUDGET: u64 = 64 << 20;
/// And as a multiple of the file's length. Files that programs write stay far below: points, most of
/// them, are not compressed, and decoded once.
const BUDGET_PER_BYTE: u64 = 32;
impl Budget {
    /// That of a file of so many bytes.
    pub fn of(length: usize) -> Self {
        Budget(Cell::new(LEAST_BUDGET + BUDGET_PER_BYTE * length as u64))
    }

    /// `n` values of `size` bytes are about to be made of what stands at `at`.
    pub fn spend(&self, n: u64, size: u64, at: u64) -> Result<()> {
        let left = n
            .checked_mul(size)
            .and_then(|bytes| self.0.get().checked_sub(bytes));
        match left {
            Some(left) => {
                self.0.set(left);
                Ok(())
            }
            None => Err(Error::invalid(
                "more values, or the same ones more often, than a file of this length can stand for",
                at,
            )),
        }
    }
}

/// What numbers are decoded to.
pub(super) trait Real: Copy + FromStr {
    /// Rounded to the nearest.
    fn from_f64(value: f64) -> Self;
    /// The same number.
    fn from_f32(value: f32) -> Self;
}

impl Real for f32 {
    fn from_f64(value: f64) -> f32 {
        value as f32
    }
    fn from_f32(value: f32) -> f32 {
        value
    }
}

impl Real for f64 {
    fn from_f64(value: f64) -> f64 {
        value
    }
    fn from_f32(value: f32) -> f64 {
        value.into()
    }
}

/// Numbers of a scalar, a tuple or an array of either.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Numbers<T> {
    /// Numbers in each tuple, 1 for scalars; of a quaternion the real part comes first.
    pub width: usize,
    /// The tuples one after another.
    pub data: Vec<T>,
}
