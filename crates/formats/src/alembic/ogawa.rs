//! The container: groups that point to data and to other groups.

use std::cell::Cell;

use crate::bytes::u32_at;
use crate::error::{Error, Result};

/// The bytes every finished file starts with, and two of a version.
pub(super) const MAGIC: &[u8] = b"Ogawa\xff";
/// Set in references to data.
pub(super) const IS_DATA: u64 = 1 << 63;
/// Bytes of magic, version and the position of the root.
pub(super) const HEADER_BYTES: usize = 16;

/// Nothing is read more often than this, times the length of the file: groups and data may be
/// pointed to any number of times, so that a short file could stand for more than any memory holds.
const MAX_USE: u64 = 32;
/// On top of that, so that small files may share as they like.
const SMALL_BYTES: u64 = 4 << 20;

/// A file, and how much may yet be read of it.
pub(super) struct Ogawa<'a> {
    bytes: &'a [u8],
    left: Cell<u64>,
}

/// References to data and groups.
#[derive(Clone, Copy)]
pub(super) struct Group<'a> {
    /// 8 bytes each.
    children: &'a [u8],
    /// Where in the file the group stands.
    pub offset: u64,
}

impl<'a> Group<'a> {
    /// Number of references.
    pub fn len(&self) -> usize {
        self.children.len() / 8
    }

    /// Reference `ix`, which `what` is.
    pub fn child(&self, ix: usize, what: impl FnOnce() -> String) -> Result<u64> {
        match self.children.get(8 * ix..8 * ix + 8) {
            Some(child) => Ok(u64_at(child, 0)),
            None => {
                let (n, what) = (self.len(), what());
                let what = format!("{what} is child {ix} of a group of {n}");
                Err(Error::invalid(what, self.offset))
            }
        }
    }
}

/// The u64 at `at`, which must lie inside.
pub(super) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | (u64::from(u32_at(bytes, at + 4)) << 32)
}

impl<'a> Ogawa<'a> {
    /// Checks the header. Answers the root group too.
    pub fn new(bytes: &'a [u8]) -> Result<(Self, Group<'a>)> {
        if !bytes.starts_with(b"Ogawa") {
            return Err(Error::invalid("file does not start with Ogawa", 0));
        }
        if bytes.len() < HEADER_BYTES {
            let what = format!("file ends within its {HEADER_BYTES}-byte header");
            return Err(Error::invalid(what, bytes.len() as u64));
        }
        if !bytes.starts_with(MAGIC) {
            let what = "the archive is unfinished: the program that wrote it did not close it";
            return Err(Error::invalid(what, 5));
        }
        let version = [bytes[6], bytes[7]];
        if version != [0, 1] {
            return Err(Error::UnsupportedVersion {
                file: Default::default(),
                kind: "Ogawa archive",
                found: u16::from_be_bytes(version).to_string(),
                known: 1,
            });
        }
        let length = bytes.len() as u64;
        let ogawa = Ogawa {
            bytes,
            left: Cell::new(length.saturating_mul(MAX_USE).saturating_add(SMALL_BYTES)),
        };
        let root = ogawa.group(u64_at(bytes, 8), || "the root".to_owned())?;
        Ok((ogawa, root))
    }

    /// Counts `n` bytes that are made of what stands at `offset`.
    pub fn spend(&self, n: u64, offset: u64) -> Result<()> {
        match self.left.get().checked_sub(n) {
            Some(left) => {
                self.left.set(left);
                Ok(())
            }
            None => {
                let what = format!(
                    "the file uses its data over and over, for more than {MAX_USE} times its length"
                );
                Err(Error::invalid(what, offset))
            }
        }
    }

    /// The group that `reference` points to: `what`.
    pub fn group(&self, reference: u64, what: impl Fn() -> String) -> Result<Group<'a>> {
        if reference & IS_DATA != 0 {
            let what = format!("{} is data, not a group", what());
            return Err(Error::invalid(what, reference & !IS_DATA));
        }
        let children = match reference {
            0 => &[][..],
            _ => self.block(reference, 8, &what)?,
        };
        self.spend(8 + children.len() as u64, reference)?;
        Ok(Group {
            children,
            offset: reference,
        })
    }

    /// The data that `reference` points to: `what`. With it, where they start.
    pub fn data(&self, reference: u64, what: impl Fn() -> String) -> Result<(&'a [u8], u64)> {
        let position = reference & !IS_DATA;
        if reference & IS_DATA == 0 {
            let what = format!("{} is a group, not data", what());
            return Err(Error::invalid(what, position));
        }
        let data = match position {
            0 => &[][..],
            _ => self.block(position, 1, &what)?,
        };
        self.spend(8 + data.len() as u64, position)?;
        Ok((data, position.saturating_add(8)))
    }

    /// A count at `position` and as many items of `item_bytes` behind it.
    fn block(
        &self,
        position: u64,
        item_bytes: u64,
        what: &impl Fn() -> String,
    ) -> Result<&'a [u8]> {
        let rest = usize::try_from(position)
            .ok()
            .and_then(|position| self.bytes.get(position..));
        let Some((count, rest)) = rest.and_then(|rest| rest.split_at_checked(8)) else {
            let length = self.bytes.len();
            let what = format!("{} lies beyond the file's {length} bytes", what());
            return Err(Error::invalid(what, position));
        };
        let count = u64_at(count, 0);
        let length = count.checked_mul(item_bytes);
        let block = length
            .and_then(|length| usize::try_from(length).ok())
            .and_then(|length| rest.get(..length));
        block.ok_or_else(|| {
            let (what, left) = (what(), rest.len());
            let items = match item_bytes {
                1 => "bytes".to_owned(),
                _ => format!("references of {item_bytes} bytes"),
            };
            let what = format!("{what} has {count} {items}, the file has {left} bytes left");
            Error::invalid(what, position)
        })
    }
}
