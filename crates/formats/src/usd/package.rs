//! Packages, `.usdz`: zip archives whose entries are stored as they are. The first is the root
//! layer.
//!
//! An entry starts with `PK\3\4`; its method (u16) is at byte 8, its length (u32) at 18 and 22, the
//! lengths of its name and of the extra field (u16) at 26 and 28; name, extra field and data follow
//! from byte 30 on.

use crate::bytes::u32_at;
use crate::error::{Error, Result};

/// First bytes of a zip archive.
const SIGNATURE: &[u8] = b"PK\x03\x04";
/// Bytes of an entry before its name.
const HEADER_BYTES: usize = 30;
/// Endings of the names of layers.
const ENDINGS: [&[u8]; 3] = [b".usd", b".usda", b".usdc"];

struct Header<'a> {
    name: &'a [u8],
    method: u16,
    flags: u16,
    lengths: [u32; 2],
    data: usize,
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// The first entry; `None` where `start` is no zip archive, or ends before the name does.
fn first(start: &[u8]) -> Option<Header<'_>> {
    if !start.starts_with(SIGNATURE) || start.len() < HEADER_BYTES {
        return None;
    }
    let [name, extra] = [26, 28].map(|at| usize::from(u16_at(start, at)));
    Some(Header {
        name: start.get(HEADER_BYTES..HEADER_BYTES + name)?,
        method: u16_at(start, 8),
        flags: u16_at(start, 6),
        lengths: [u32_at(start, 18), u32_at(start, 22)],
        data: HEADER_BYTES + name + extra,
    })
}

/// Is it a zip archive, and its first entry a layer by its name?
pub(super) fn is_package(start: &[u8]) -> bool {
    first(start).is_some_and(|header| {
        let name = header.name.to_ascii_lowercase();
        ENDINGS.iter().any(|ending| name.ends_with(ending))
    })
}

/// The bytes of the root layer.
pub(super) fn root_layer(bytes: &[u8]) -> Result<&[u8]> {
    let Some(header) = first(bytes) else {
        return Err(Error::invalid("the first entry of the package is cut", 0));
    };
    let name = String::from_utf8_lossy(header.name);
    if header.method != 0 || header.flags & 1 != 0 {
        let what = format!("{name} is compressed or encrypted, entries of .usdz files are not");
        return Err(Error::invalid(what, 8));
    }
    let [stored, length] = header.lengths;
    // Bit 3: lengths come after the data, which no writer of packages does.
    if stored != length || stored == u32::MAX || (header.flags & 8 != 0 && stored == 0) {
        return Err(Error::invalid(
            format!("length of {name}: {stored} and {length}"),
            18,
        ));
    }
    let end = header.data.checked_add(length as usize);
    match end.and_then(|end| bytes.get(header.data..end)) {
        Some(layer) => Ok(layer),
        None => Err(Error::invalid(
            format!("{name} takes {length} bytes, the file has {}", bytes.len()),
            header.data as u64,
        )),
    }
}
