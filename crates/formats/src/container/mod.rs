//! The container that every binary file of ours shares.
//!
//! All numbers are little-endian. The file is, in this order:
//!
//! | bytes | what |
//! |---|---|
//! | 0..8 | magic [`MAGIC`] |
//! | 8..12 | kind, see [`Kind`] |
//! | 12..14, 14..16 | format version of the kind, major and minor, u16 |
//! | 16..20 | number of sections n, u32 |
//! | 20..24 | zero |
//! | 24..32 | length of the file, u64 |
//! | 32..40 | xxh3-64 of the directory |
//! | 40..56 | zero |
//! | 56..64 | xxh3-64 of bytes 0..56 |
//! | 64.. | directory: n entries of 32 bytes: tag (4 ASCII letters), index u32, offset u64, length u64, xxh3-64 of the section |
//! | then | the sections in the order of the directory, each starting at the next multiple of 64 |
//!
//! Every gap is zero and the last section ends the file, so each byte is either checked by a sum
//! or known in advance, and equal content gives equal bytes.
//!
//! **Versions.** Within a major version sections never change; a minor version only adds new
//! ones, which older readers skip. A newer major version is refused by name. The first 64 bytes
//! keep their meaning for ever.

mod read;
mod record;
mod write;

pub use read::{Container, Section};
pub(crate) use record::{decode_record, encode_record};
pub(crate) use write::ContainerWriter;

/// First bytes of a file; the line end shows damage by text-mode copying.
pub const MAGIC: [u8; 8] = *b"\x93STRND\r\n";

/// Bytes of the fixed header.
pub(crate) const HEADER_BYTES: u64 = 64;
/// Bytes of one directory entry.
pub(crate) const ENTRY_BYTES: u64 = 32;
/// Sections start at multiples of this: the largest alignment that GPU buffers and SIMD loads
/// ask for, and a cache line.
pub(crate) const ALIGNMENT: u64 = 64;
/// Most sections a file may have; a directory of 128 KiB. Our files have at most a few dozen.
pub(crate) const MAX_SECTIONS: u32 = 4096;

/// What a container holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `.tables`
    Tables,
    /// `.lights`
    Lights,
    /// `.groom`
    Groom,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 3] = [Kind::Tables, Kind::Lights, Kind::Groom];

    /// The four letters in the header.
    pub const fn tag(self) -> [u8; 4] {
        match self {
            Kind::Tables => *b"TABL",
            Kind::Lights => *b"LGHT",
            Kind::Groom => *b"GROM",
        }
    }

    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Tables => "tables file",
            Kind::Lights => "light set",
            Kind::Groom => "groom",
        }
    }

    /// The version this program writes; it reads every major up to this one.
    pub const fn version(self) -> (u16, u16) {
        match self {
            Kind::Tables | Kind::Lights | Kind::Groom => (1, 0),
        }
    }

    /// The kind that the first bytes of a file announce, if it is one of ours.
    pub fn of_bytes(start: &[u8]) -> Option<Kind> {
        let tag = start.strip_prefix(&MAGIC)?.get(..4)?;
        Kind::ALL.into_iter().find(|kind| kind.tag() == tag)
    }
}

/// Rounds up to the next multiple of [`ALIGNMENT`]; `None` when that overflows.
pub(crate) fn align(offset: u64) -> Option<u64> {
    offset.checked_next_multiple_of(ALIGNMENT)
}

#[cfg(target_endian = "big")]
compile_error!("bulk arrays are read and written in place: a little-endian machine is needed");
