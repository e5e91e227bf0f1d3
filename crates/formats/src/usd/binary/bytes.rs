//! Reading a binary layer within its bounds.

use super::integers::{self, Width};
use super::lz4;
use crate::error::{Error, Result};
use crate::usd::model::Budget;

/// The bytes of a file, and how much may still be made of them.
#[derive(Debug)]
pub(super) struct Bytes<'a> {
    /// The file.
    pub all: &'a [u8],
    budget: Budget,
}

/// A place in the file.
#[derive(Clone, Debug)]
pub(super) struct Reader<'a> {
    file: &'a Bytes<'a>,
    /// Offset of the next byte.
    pub at: u64,
}

impl<'a> Bytes<'a> {
    /// With a budget by the length of `all`.
    pub fn new(all: &'a [u8]) -> Self {
        Bytes {
            all,
            budget: Budget::of(all.len()),
        }
    }

    /// `n` values of `size` bytes are about to be made of what stands at `at`.
    pub fn spend(&self, n: u64, size: u64, at: u64) -> Result<()> {
        self.budget.spend(n, size, at)
    }

    /// At `offset`.
    pub fn at(&'a self, offset: u64) -> Reader<'a> {
        Reader {
            file: self,
            at: offset,
        }
    }
}

impl<'a> Reader<'a> {
    /// The next `length` bytes.
    pub fn take(&mut self, length: u64) -> Result<&'a [u8]> {
        let end = self.at.checked_add(length);
        let range =
            end.and_then(|end| Some(usize::try_from(self.at).ok()?..usize::try_from(end).ok()?));
        let Some(taken) = range.and_then(|range| self.file.all.get(range)) else {
            let what = format!("{length} bytes, the file has {}", self.file.all.len());
            return Err(Error::invalid(what, self.at));
        };
        self.at += length;
        Ok(taken)
    }

    /// The next `N` bytes.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64)?);
        Ok(array)
    }

    /// The next u8.
    pub fn u8(&mut self) -> Result<u8> {
        Ok(self.array::<1>()?[0])
    }

    /// The next u32.
    pub fn u32(&mut self) -> Result<u32> {
        self.array().map(u32::from_le_bytes)
    }

    /// The next u64.
    pub fn u64(&mut self) -> Result<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// The next u64, the number of things of at least `size` bytes that follow.
    pub fn count(&mut self, size: u64) -> Result<u64> {
        let at = self.at;
        let n = self.u64()?;
        let left = self.file.all.len() as u64 - self.at;
        match n.checked_mul(size) {
            Some(bytes) if bytes <= left => Ok(n),
            _ => Err(Error::invalid(
                format!("{n} entries, {left} bytes are left"),
                at,
            )),
        }
    }

    /// Where the offset that comes next, from here, leads.
    pub fn jump(&mut self) -> Result<Reader<'a>> {
        let at = self.at;
        let offset = self.array().map(i64::from_le_bytes)?;
        match at.checked_add_signed(offset) {
            Some(to) => Ok(self.file.at(to)),
            None => Err(Error::invalid(format!("offset {offset}"), at)),
        }
    }

    /// A compressed block that comes with its length and makes at most `length` bytes.
    pub fn block(&mut self, length: u64) -> Result<Vec<u8>> {
        let n = self.count(1)?;
        let at = self.at;
        let block = self.take(n)?;
        // A byte of LZ4 stands for 255 at most.
        let most = length.min(n.saturating_mul(255));
        self.file.spend(most, 1, at)?;
        lz4::decompress(block, most as usize)
            .ok_or_else(|| Error::invalid("a damaged compressed block", at))
    }

    /// `n` compressed integers.
    pub fn integers(&mut self, n: u64, width: Width) -> Result<Vec<i64>> {
        let at = self.at;
        let most = integers::most_bytes(n, width);
        let Some(most) = most else {
            return Err(Error::invalid(format!("{n} integers"), at));
        };
        let bytes = self.block(most)?;
        // Before memory for them is asked for.
        if bytes.len() as u64 <= n / 4 {
            return Err(Error::invalid(format!("fewer integers than {n}"), at));
        }
        self.file.spend(n, 8, at)?;
        integers::decode(&bytes, n as usize, width)
            .ok_or_else(|| Error::invalid(format!("fewer integers than {n}"), at))
    }

    /// `n` compressed indices.
    pub fn indices(&mut self, n: u64) -> Result<Vec<u32>> {
        let integers = self.integers(n, Width::Bits32)?;
        Ok(integers.into_iter().map(|value| value as u32).collect())
    }
}
