//! Binary layers, `.usdc`, versions 0.0.1 to 0.13: "crate" files.
//!
//! All numbers are little-endian. A file starts with `PXR-USDC`, 8 bytes for the version and the
//! offset (i64) of a table of sections, each a name of 16 bytes, offset and length (i64):
//!
//! | section | what |
//! |---|---|
//! | `TOKENS` | words, ended by zeros |
//! | `STRINGS` | of each string its token, u32 |
//! | `FIELDS` | of each field the token of its name and its value |
//! | `FIELDSETS` | lists of fields, ended by -1 |
//! | `PATHS` | a tree of paths: of each its parent and the token of its last part |
//! | `SPECS` | of each prim, attribute and so on its path, its fields and its kind |
//!
//! From 0.4 on sections are compressed: integers by [`integers`], then by [`lz4`]. A value is 64
//! bits: its type (bits 48..56), whether it is an array (63), stands in the value itself (62), is
//! compressed (61); and 48 bits of payload, the value or its offset.

mod bytes;
mod file;
mod integers;
mod lz4;
mod path;
mod scalars;
mod sections;
mod tree;
mod values;

use bytes::Bytes;
pub(super) use file::Crate;

use super::model::Prim;
use crate::error::{Error, Result};

/// First bytes.
pub(super) const SIGNATURE: &[u8] = b"PXR-USDC";
/// Newest version that is read; the second number tells.
const NEWEST: (u8, u8) = (0, 13);

/// Reads the tables of a whole file: the root of its prims, and what values are decoded from.
pub(super) fn parse(all: &[u8]) -> Result<(Prim, Crate<'_>)> {
    let bytes = Bytes::new(all);
    let version = version(all)?;
    let sections = sections::read(&bytes, version)?;
    let sections::Sections {
        tokens,
        strings,
        fields,
        field_sets,
        paths,
        specs,
    } = sections;
    let file = Crate {
        bytes,
        version,
        tokens,
        strings,
        paths,
    };
    let root = tree::build(&file, &fields, &field_sets, &specs)?;
    Ok((root, file))
}

fn version(all: &[u8]) -> Result<(u8, u8)> {
    match all.get(8..11) {
        Some(&[major, minor, patch]) if (major, minor) <= NEWEST && (minor, patch) > (0, 0) => {
            Ok((minor, patch))
        }
        Some(&[major, minor, _]) => Err(Error::UnsupportedVersion {
            file: Default::default(),
            kind: "binary USD file",
            found: format!("{major}.{minor}"),
            known: NEWEST.0.into(),
        }),
        _ => Err(Error::invalid("a header of 88 bytes is missing", 0)),
    }
}
