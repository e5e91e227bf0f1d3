//! Headers of PLY files, and the numbers of their elements.

use crate::error::{Error, Result};
use crate::text_lines::{Line, count, double, lines};

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &[u8]) -> Option<Scalar> {
        Some(match name {
            b"char" | b"int8" => Scalar::I8,
            b"uchar" | b"uint8" => Scalar::U8,
            b"short" | b"int16" => Scalar::I16,
            b"ushort" | b"uint16" => Scalar::U16,
            b"int" | b"int32" => Scalar::I32,
            b"uint" | b"uint32" => Scalar::U32,
            b"float" | b"float32" => Scalar::F32,
            b"double" | b"float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub fn n_bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// The number in `bytes`, which are `n_bytes` long.
    fn value(self, bytes: &[u8], is_big: bool) -> f64 {
        let mut word = [0; 8];
        for (ix, &byte) in bytes.iter().enumerate() {
            word[if is_big { bytes.len() - 1 - ix } else { ix }] = byte;
        }
        let bits = u64::from_le_bytes(word);
        match self {
            Scalar::I8 => f64::from(bits as u8 as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as u16 as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as u32 as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        }
    }
}

/// A number of each item of an element, or a list of them.
#[derive(Debug)]
pub(super) struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// Type of the length, of a list.
    pub list: Option<Scalar>,
}

/// A table of the file.
#[derive(Debug)]
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    /// The index of the first property that is called one of `names`, and no list.
    pub fn property(&self, names: &[&str]) -> Option<usize> {
        names.iter().find_map(|name| {
            let mut properties = self.properties.iter();
            properties.position(|property| property.name == *name && property.list.is_none())
        })
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Bytes of it.
    pub length: usize,
}

pub(super) fn is_ply(start: &[u8]) -> bool {
    start.starts_with(b"ply\n") || start.starts_with(b"ply\r")
}

/// Does the header, as far as `start` has it, name faces?
pub(super) fn is_mesh(start: &[u8]) -> bool {
    lines(start)
        .take_while(|line| line.bytes != b"end_header")
        .any(|line| {
            let words: Vec<&[u8]> = line.words().take(3).collect();
            matches!(words[..], [b"element", b"face" | b"tristrips", n] if n != b"0")
        })
}

/// Most elements and properties that a header may have.
const MOST_ENTRIES: usize = 256;

impl Header {
    pub fn read(bytes: &[u8]) -> Result<Header> {
        if !is_ply(bytes) {
            return Err(Error::invalid("file does not start with ply", 0));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut n_entries = 0;
        let mut lines = lines(bytes).skip(1);
        for line in lines.by_ref() {
            let words: Vec<&[u8]> = line.words().collect();
            match words[..] {
                [b"end_header"] => {
                    let after = line.offset as usize + line.bytes.len();
                    let end = bytes[after..].iter().position(|&byte| byte == b'\n');
                    let length = end.map_or(bytes.len(), |end| after + end + 1);
                    let Some(encoding) = encoding else {
                        return Err(Error::invalid("the header has no format", line.offset));
                    };
                    return Ok(Header {
                        encoding,
                        elements,
                        length,
                    });
                }
                [b"format", name, _] => {
                    encoding = Some(match name {
                        b"ascii" => Encoding::Ascii,
                        b"binary_little_endian" => Encoding::LittleEndian,
                        b"binary_big_endian" => Encoding::BigEndian,
                        _ => return Err(line.is_not("a format of PLY")),
                    });
                }
                [b"comment" | b"obj_info", ..] | [] => {}
                [b"element", name, n] => {
                    let name = text(name);
                    if elements.iter().any(|element| element.name == name) {
                        return Err(line.is_not("an element of a new name"));
                    }
                    elements.push(Element {
                        name,
                        count: count(n).ok_or_else(|| line.is_not("an element"))?.into(),
                        properties: Vec::new(),
                    });
                    n_entries += 1;
                }
                [b"property", ref words @ ..] => {
                    let property = property(words).ok_or_else(|| line.is_not("a property"))?;
                    let Some(element) = elements.last_mut() else {
                        return Err(line.is_not("below an element"));
                    };
                    element.properties.push(property);
                    n_entries += 1;
                }
                _ => return Err(line.is_not("a line of a PLY header")),
            }
            if n_entries > MOST_ENTRIES {
                let what =
                    format!("the header has more than {MOST_ENTRIES} elements and properties");
                return Err(Error::invalid(what, line.offset));
            }
        }
        let what = "file ends within its header";
        Err(Error::invalid(what, bytes.len() as u64))
    }

    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

/// A name that can be shown.
fn text(name: &[u8]) -> String {
    let shown = |&byte: &u8| match byte.is_ascii_graphic() {
        true => char::from(byte),
        false => '?',
    };
    name.iter().map(shown).collect()
}

fn property(words: &[&[u8]]) -> Option<Property> {
    let (list, scalar, name) = match *words {
        [b"list", length, scalar, name] => (Some(Scalar::from_name(length)?), scalar, name),
        [scalar, name] => (None, scalar, name),
        _ => return None,
    };
    Some(Property {
        name: text(name),
        scalar: Scalar::from_name(scalar)?,
        list,
    })
}

/// The elements of a file behind its header, one after another.
pub(super) struct Body<'a> {
    encoding: Encoding,
    rest: &'a [u8],
    offset: u64,
}

impl<'a> Body<'a> {
    pub fn new(bytes: &'a [u8], header: &Header) -> Self {
        Body {
            encoding: header.encoding,
            rest: &bytes[header.length..],
            offset: header.length as u64,
        }
    }

    /// Reads past `element`; the numbers of each item, lists left out, go to `act`.
    pub fn element(
        &mut self,
        element: &Element,
        mut act: impl FnMut(u64, &[f64]) -> Result<()>,
    ) -> Result<()> {
        let least: usize = element.properties.iter().map(Property::least_bytes).sum();
        // Where an item takes no room, their number is no matter of the file's length.
        let in_text = self.encoding == Encoding::Ascii;
        let least = if in_text { 1 } else { least } as u64;
        if element.count.saturating_mul(least) > self.rest.len() as u64 || least == 0 {
            return Err(self.ends(element, 0));
        }
        let mut values = Vec::with_capacity(element.properties.len());
        for ix in 0..element.count {
            values.clear();
            match in_text {
                true => self.line(element, ix, &mut values)?,
                false => self.item(element, ix, &mut values)?,
            }
            act(ix, &values)?;
        }
        Ok(())
    }

    fn ends(&self, element: &Element, ix: u64) -> Error {
        let what = format!(
            "file ends after {ix} of {} items of element {}",
            element.count, element.name
        );
        Error::invalid(what, self.offset)
    }

    fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        self.offset += n as u64;
        Some(taken)
    }

    fn item(&mut self, element: &Element, ix: u64, values: &mut Vec<f64>) -> Result<()> {
        let is_big = self.encoding == Encoding::BigEndian;
        for property in &element.properties {
            let first = property.list.unwrap_or(property.scalar);
            let taken = self.take(first.n_bytes());
            let value = taken.ok_or_else(|| self.ends(element, ix))?;
            let value = first.value(value, is_big);
            if property.list.is_none() {
                // A list has no number in `values` that anyone asks for.
                values.push(value);
                continue;
            }
            values.push(0.0);
            // A negative length or one of no integer is as good as too long.
            let n_bytes = match value >= 0.0 && value.fract() == 0.0 {
                true => (value as usize).saturating_mul(property.scalar.n_bytes()),
                false => usize::MAX,
            };
            let skipped = self.take(n_bytes);
            skipped.ok_or_else(|| self.ends(element, ix))?;
        }
        Ok(())
    }

    fn line(&mut self, element: &Element, ix: u64, values: &mut Vec<f64>) -> Result<()> {
        let start = self.offset;
        let end = self.rest.iter().position(|&byte| byte == b'\n');
        let n = end.map_or(self.rest.len(), |end| end + 1);
        let taken = self.take(n).filter(|taken| !taken.is_empty());
        let line = Line {
            offset: start,
            bytes: taken
                .ok_or_else(|| self.ends(element, ix))?
                .trim_ascii_end(),
        };
        let mut words = line.words();
        let what = || format!("an item of element {}", element.name);
        let mut next = || {
            words
                .next()
                .and_then(double)
                .ok_or_else(|| line.is_not(&what()))
        };
        for property in &element.properties {
            let value = next()?;
            values.push(value);
            if property.list.is_some() {
                for _ in 0..value as u32 {
                    next()?;
                }
            }
        }
        Ok(())
    }
}

impl Property {
    fn least_bytes(&self) -> usize {
        self.list.unwrap_or(self.scalar).n_bytes()
    }
}
