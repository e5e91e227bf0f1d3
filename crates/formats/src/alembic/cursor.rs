//! Tables, read from front to end.

use super::ogawa::u64_at;
use crate::bytes::u32_at;
use crate::error::{Error, Result};

/// Bytes of a table, read from front to end.
pub(super) struct Cursor<'a, 'n> {
    bytes: &'a [u8],
    /// Where in the file they stand.
    pub offset: u64,
    /// What is read.
    name: &'n str,
}

impl<'a, 'n> Cursor<'a, 'n> {
    pub fn new(bytes: &'a [u8], offset: u64, name: &'n str) -> Self {
        Cursor {
            bytes,
            offset,
            name,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    fn take(&mut self, n: u32) -> Result<&'a [u8]> {
        let Some((taken, rest)) = self.bytes.split_at_checked(n as usize) else {
            let (name, left) = (self.name, self.bytes.len());
            let what = format!("{name} has {left} bytes left where {n} are needed");
            return Err(Error::invalid(what, self.offset));
        };
        self.bytes = rest;
        self.offset += u64::from(n);
        Ok(taken)
    }

    pub fn byte(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    pub fn word(&mut self) -> Result<u32> {
        Ok(u32_at(self.take(4)?, 0))
    }

    pub fn double(&mut self) -> Result<f64> {
        Ok(f64::from_bits(u64_at(self.take(8)?, 0)))
    }

    /// A number of 1, 2 or 4 bytes: `width` 0, 1 or 2.
    pub fn number(&mut self, width: u32) -> Result<u32> {
        Ok(match width {
            0 => u32::from(self.byte()?),
            1 => {
                let bytes = self.take(2)?;
                u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))
            }
            _ => self.word()?,
        })
    }

    pub fn text(&mut self, length: u32) -> Result<&'a str> {
        let start = self.offset;
        let bytes = self.take(length)?;
        std::str::from_utf8(bytes).map_err(|_| {
            let what = format!("{} has a name or text that is no UTF-8", self.name);
            Error::invalid(what, start)
        })
    }
}
