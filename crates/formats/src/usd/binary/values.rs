//! Values of a binary layer, decoded where they are needed.

use super::bytes::Reader;
use super::file::Crate;
use super::integers::Width;
use super::scalars::{Scalar, Shape, inlined, layout};
use crate::error::{Error, Result};
use crate::usd::model::{Numbers, Real, Value};

/// Compressed arrays of fewer values are not.
const LEAST_COMPRESSED: u64 = 16;

/// Types by their numbers.
mod types {
    pub const STRING: u8 = 10;
    pub const TOKEN: u8 = 11;
    pub const ASSET: u8 = 12;
    pub const TOKEN_LIST: u8 = 32;
    pub const STRING_LIST: u8 = 33;
    pub const PATH_LIST: u8 = 34;
    pub const REFERENCE_LIST: u8 = 35;
    pub const TOKENS: u8 = 41;
    pub const CHOICES: u8 = 45;
    pub const SAMPLES: u8 = 46;
    pub const PAYLOAD: u8 = 47;
    pub const DOUBLES: u8 = 48;
    pub const STRINGS: u8 = 50;
    pub const BLOCK: u8 = 51;
    pub const PAYLOAD_LIST: u8 = 55;
    pub const ANIMATION_BLOCK: u8 = 60;
}

/// A value representation, taken apart.
#[derive(Clone, Copy, Debug)]
struct Rep {
    is_array: bool,
    is_inlined: bool,
    is_compressed: bool,
    /// An edit of an array, not one.
    is_edit: bool,
    type_number: u8,
    payload: u64,
}

impl Rep {
    fn new(bits: u64) -> Self {
        Rep {
            is_array: bits >> 63 & 1 != 0,
            is_inlined: bits >> 62 & 1 != 0,
            is_compressed: bits >> 61 & 1 != 0,
            is_edit: bits >> 60 & 1 != 0,
            type_number: (bits >> 48) as u8,
            payload: bits & ((1 << 48) - 1),
        }
    }
}

impl Crate<'_> {
    /// Is there nothing on purpose?
    pub fn is_blocked(bits: u64) -> bool {
        matches!(
            Rep::new(bits).type_number,
            types::BLOCK | types::ANIMATION_BLOCK
        )
    }

    /// See [`Layer::numbers`](crate::usd::model::Layer::numbers).
    pub fn numbers<T: Real>(&self, bits: u64) -> Result<Option<Numbers<T>>> {
        let rep = Rep::new(bits);
        let Some((scalar, width, shape)) = layout(rep.type_number) else {
            return Ok(None);
        };
        if rep.is_edit {
            return Ok(None);
        }
        let mut data = if rep.is_array {
            self.array(rep, scalar, width)?
        } else if rep.is_inlined {
            inlined(rep.payload, scalar, width, shape)
        } else {
            let mut reader = self.bytes.at(rep.payload);
            self.scalars(&mut reader, scalar, width as u64)?
        };
        if shape == Shape::Quaternion {
            // The real part is stored last.
            data.chunks_exact_mut(4).for_each(|q| q.rotate_right(1));
        }
        Ok(Some(Numbers { width, data }))
    }

    /// `n` numbers as they are.
    fn scalars<T: Real>(&self, reader: &mut Reader, scalar: Scalar, n: u64) -> Result<Vec<T>> {
        let at = reader.at;
        let size = scalar.bytes();
        let Some(length) = n.checked_mul(size) else {
            return Err(Error::invalid(format!("{n} numbers"), at));
        };
        let bytes = reader.take(length)?;
        self.bytes.spend(n, size, at)?;
        let numbers = bytes.chunks_exact(size as usize);
        Ok(numbers.map(|number| scalar.decode(number)).collect())
    }

    fn array<T: Real>(&self, rep: Rep, scalar: Scalar, width: usize) -> Result<Vec<T>> {
        if rep.payload == 0 {
            return Ok(Vec::new());
        }
        let mut reader = self.bytes.at(rep.payload);
        if self.version < (5, 0) {
            // The number of dimensions, always 1.
            reader.u32()?;
        }
        let n = match self.version < (7, 0) {
            true => reader.u32()?.into(),
            false => reader.u64()?,
        };
        if !rep.is_compressed || n < LEAST_COMPRESSED || width != 1 {
            let Some(n) = n.checked_mul(width as u64) else {
                return Err(Error::invalid(format!("{n} values"), rep.payload));
            };
            return self.scalars(&mut reader, scalar, n);
        }
        let wide = match scalar {
            Scalar::I64 | Scalar::U64 => Width::Bits64,
            _ => Width::Bits32,
        };
        let real = |value: i64| match scalar {
            Scalar::U32 => T::from_f64((value as u32).into()),
            Scalar::U64 => T::from_f64(value as u64 as f64),
            _ => T::from_f64(value as f64),
        };
        if !matches!(scalar, Scalar::Half | Scalar::Float | Scalar::Double) {
            let integers = reader.integers(n, wide)?;
            return Ok(integers.into_iter().map(real).collect());
        }
        match reader.u8()? {
            b'i' => {
                let integers = reader.integers(n, Width::Bits32)?;
                Ok(integers.into_iter().map(real).collect())
            }
            b't' => {
                let length = reader.u32()?.into();
                let table: Vec<T> = self.scalars(&mut reader, scalar, length)?;
                let indices = reader.indices(n)?;
                let find = |ix: u32| table.get(ix as usize).copied();
                let numbers: Option<Vec<T>> = indices.into_iter().map(find).collect();
                numbers.ok_or_else(|| {
                    Error::invalid("an index beyond its table of numbers", rep.payload)
                })
            }
            other => Err(Error::invalid(
                format!("numbers compressed by {other}"),
                rep.payload,
            )),
        }
    }

    /// The word with this index.
    pub(super) fn token(&self, ix: u32) -> Result<&str> {
        match self.tokens.get(ix as usize) {
            Some(token) => Ok(token),
            None => {
                let n = self.tokens.len();
                Err(Error::invalid(format!("token {ix} of {n}"), 0))
            }
        }
    }

    fn string(&self, ix: u32) -> Result<&str> {
        match self.strings.get(ix as usize) {
            Some(&token) => self.token(token),
            None => {
                let n = self.strings.len();
                Err(Error::invalid(format!("string {ix} of {n}"), 0))
            }
        }
    }

    /// See [`Layer::strings`](crate::usd::model::Layer::strings).
    pub fn strings(&self, bits: u64) -> Result<Vec<String>> {
        let rep = Rep::new(bits);
        let mut reader = self.bytes.at(rep.payload);
        let is_string = matches!(
            rep.type_number,
            types::STRING | types::STRINGS | types::STRING_LIST | types::CHOICES
        );
        let word = |ix: u32| match is_string {
            true => self.string(ix).map(str::to_owned),
            false => self.token(ix).map(str::to_owned),
        };
        let n = match rep.type_number {
            types::TOKEN | types::STRING | types::ASSET if rep.is_array => {
                if rep.payload == 0 {
                    return Ok(Vec::new());
                }
                if self.version < (5, 0) {
                    reader.u32()?;
                }
                match self.version < (7, 0) {
                    true => reader.u32()?.into(),
                    false => reader.count(4)?,
                }
            }
            types::TOKEN | types::STRING | types::ASSET => {
                let string = word(rep.payload as u32)?;
                self.bytes.spend(1, 24 + string.len() as u64, reader.at)?;
                return Ok(vec![string]);
            }
            types::TOKENS | types::STRINGS => reader.count(4)?,
            types::CHOICES => 2 * reader.count(8)?,
            types::TOKEN_LIST | types::STRING_LIST => match list(&mut reader)? {
                true => reader.count(4)?,
                false => 0,
            },
            _ => return Ok(Vec::new()),
        };
        let at = reader.at;
        let mut strings = Vec::new();
        for _ in 0..n {
            let string = word(reader.u32()?)?;
            self.bytes.spend(1, 24 + string.len() as u64, at)?;
            strings.push(string);
        }
        Ok(strings)
    }

    /// Times and values of samples, times rising.
    pub(super) fn samples(&self, bits: u64) -> Result<Vec<(f64, Value)>> {
        let rep = Rep::new(bits);
        if rep.type_number != types::SAMPLES {
            return Ok(Vec::new());
        }
        let mut reader = self.bytes.at(rep.payload);
        let mut after_times = reader.jump()?;
        let times_rep = Rep::new(after_times.u64()?);
        let mut times_reader = self.bytes.at(times_rep.payload);
        let times: Vec<f64> = if times_rep.type_number != types::DOUBLES {
            return Err(Error::invalid("times are not numbers", after_times.at - 8));
        } else {
            let n = times_reader.count(8)?;
            self.scalars(&mut times_reader, Scalar::Double, n)?
        };
        let mut values = after_times.jump()?;
        let n = values.count(8)?;
        let mut rising = times.windows(2).all(|pair| pair[0] < pair[1]);
        rising &= times.iter().all(|time| time.is_finite());
        if n != times.len() as u64 || !rising {
            return Err(Error::invalid(
                "times do not rise, or lack values",
                values.at,
            ));
        }
        self.bytes.spend(n, 40, values.at)?;
        let sample = |time| Ok((time, Value::Rep(values.u64()?)));
        times.into_iter().map(sample).collect()
    }

    /// See [`Layer::assets`](crate::usd::model::Layer::assets).
    pub fn assets(&self, bits: u64) -> Result<Vec<String>> {
        let rep = Rep::new(bits);
        let mut reader = self.bytes.at(rep.payload);
        match rep.type_number {
            types::STRINGS => {
                let files = self.strings(bits)?;
                Ok(files.into_iter().map(|file| format!("@{file}@")).collect())
            }
            types::PAYLOAD => Ok(vec![self.target(&mut reader)?]),
            // The first of the list is enough: what follows each varies in length.
            types::PAYLOAD_LIST | types::REFERENCE_LIST => match list(&mut reader)? {
                true if reader.u64()? > 0 => Ok(vec![self.target(&mut reader)?]),
                _ => Ok(Vec::new()),
            },
            types::PATH_LIST => match list(&mut reader)? {
                true if reader.u64()? > 0 => Ok(vec![self.path(reader.u32()?)?]),
                _ => Ok(Vec::new()),
            },
            _ => Ok(Vec::new()),
        }
    }

    /// What a reference or payload names.
    fn target(&self, reader: &mut Reader) -> Result<String> {
        let file = self.string(reader.u32()?)?;
        match file.is_empty() {
            true => self.path(reader.u32()?),
            false => Ok(format!("@{file}@")),
        }
    }

    /// A path of prims as text.
    fn path(&self, ix: u32) -> Result<String> {
        let mut parts = Vec::new();
        let mut next = Some(ix);
        while let Some(path) = next.and_then(|ix| self.paths.get(ix as usize)) {
            if path.parent.is_some() && !path.is_property {
                parts.push(self.token(path.token)?);
            }
            if parts.len() > 2 * crate::usd::model::MAX_DEPTH {
                break;
            }
            next = path.parent;
        }
        parts.reverse();
        Ok(format!("</{}>", parts.join("/")))
    }
}

/// Passes the header of a list of edits; answers whether items that are set or added follow first.
fn list(reader: &mut Reader) -> Result<bool> {
    // Items set, added, put before, put behind; not those deleted or ordered.
    Ok(reader.u8()? & 0b110_0110 != 0)
}
