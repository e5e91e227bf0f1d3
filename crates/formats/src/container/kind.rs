//! What every container starts with.

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
#[non_exhaustive]
pub enum Kind {
    /// `.tables`
    Tables,
    /// `.lights`
    Lights,
    /// `.groom`
    Groom,
    /// `.mesh`
    Mesh,
    /// `.panorama`
    Panorama,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 5] = [
        Kind::Tables,
        Kind::Lights,
        Kind::Groom,
        Kind::Mesh,
        Kind::Panorama,
    ];

    /// The four letters in the header.
    pub(crate) const fn tag(self) -> [u8; 4] {
        match self {
            Kind::Tables => *b"TABL",
            Kind::Lights => *b"LGHT",
            Kind::Groom => *b"GROM",
            Kind::Mesh => *b"MESH",
            Kind::Panorama => *b"PANO",
        }
    }

    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Kind::Tables => "tables file",
            Kind::Lights => "light set",
            Kind::Groom => "groom",
            Kind::Mesh => "mesh",
            Kind::Panorama => "panorama",
        }
    }

    /// The version this program writes; it reads every major up to this one.
    pub const fn version(self) -> (u16, u16) {
        match self {
            Kind::Tables | Kind::Mesh | Kind::Panorama => (1, 0),
            // 1.1 records the kind of the lights, and what a groom was imported from.
            Kind::Lights | Kind::Groom => (1, 1),
        }
    }

    /// The kind that the first bytes of a file announce, if it is one of ours.
    pub(crate) fn from_signature(start: &[u8]) -> Option<Kind> {
        let tag = start.strip_prefix(&MAGIC)?.get(..4)?;
        Kind::ALL.into_iter().find(|kind| kind.tag() == tag)
    }
}

/// Rounds up to the next multiple of [`ALIGNMENT`]; `None` when that overflows.
pub(crate) fn align(offset: u64) -> Option<u64> {
    offset.checked_next_multiple_of(ALIGNMENT)
}
