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
//! keep their meaning for ever. A file is written with the version of [`Kind::version`].

mod kind;
mod read;
mod record;
mod write;

pub use kind::{Kind, MAGIC};
pub use read::{Container, Section};
pub(crate) use record::encode_record;
pub(crate) use write::ContainerWriter;

#[cfg(target_endian = "big")]
compile_error!("bulk arrays are read and written in place: a little-endian machine is needed");
