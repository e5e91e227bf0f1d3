//! Reading containers: the directory at once, sections when asked for.

use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::xxh3_64;

use super::kind::{ALIGNMENT, ENTRY_BYTES, HEADER_BYTES, Kind, MAGIC, MAX_SECTIONS, align};
use super::record::decode_record;
use crate::error::{Error, FileName, Result};
use crate::input::{Input, open_file};
use crate::sniff::{FileKind, SNIFF_BYTES};

/// One entry of the directory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    /// Four ASCII letters.
    pub tag: [u8; 4],
    /// Distinguishes sections of one tag.
    pub index: u32,
    /// First byte in the file.
    pub offset: u64,
    /// Bytes.
    pub length: u64,
    /// xxh3-64 of the bytes.
    pub checksum: u64,
}

impl Section {
    /// Tag and index as text, e.g. `DATA 2`.
    pub fn name(&self) -> String {
        format!("{} {}", self.tag.escape_ascii(), self.index)
    }
}

/// An opened container. Opening reads and checks header and directory; a section is read, and
/// its checksum checked, when asked for, and no other is touched.
#[derive(Debug)]
pub struct Container<R> {
    source: R,
    kind: Kind,
    version: (u16, u16),
    file_bytes: u64,
    sections: Vec<Section>,
    /// Which sections have been read.
    seen: Vec<bool>,
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

impl Container<Input> {
    /// Opens the file or pipe at `path`, which must be of `kind`.
    ///
    /// # Errors
    /// See [`Container::new`]; the path is named.
    pub fn open(path: &Path, kind: Kind) -> Result<Self> {
        open_file(path)
            .and_then(|(file, length)| Container::new(file, length, kind))
            .map_err(|error| error.in_file(path))
    }
}

impl<'a> Container<Cursor<&'a [u8]>> {
    /// Opens a container in memory.
    ///
    /// # Errors
    /// See [`Container::new`].
    pub fn from_bytes(bytes: &'a [u8], kind: Kind) -> Result<Self> {
        Container::new(Cursor::new(bytes), bytes.len() as u64, kind)
    }
}

impl<R: Read + Seek> Container<R> {
    /// Opens a container of `kind` in `source`, which holds `file_bytes` bytes.
    ///
    /// # Errors
    /// `NotThisKind`, `UnsupportedVersion`, `Invalid` for anything damaged, `Io`.
    pub fn new(mut source: R, file_bytes: u64, kind: Kind) -> Result<Self> {
        let mut header = [0u8; HEADER_BYTES as usize];
        let start = header
            .len()
            .min(usize::try_from(file_bytes).unwrap_or(usize::MAX));
        source.seek(SeekFrom::Start(0))?;
        source.read_exact(&mut header[..start])?;
        if Kind::from_signature(&header[..start]) != Some(kind) {
            return Err(wrong_kind(&mut source, &header[..start], kind));
        }
        if file_bytes < HEADER_BYTES {
            return Err(Error::invalid("file ends within its header", file_bytes));
        }
        if u64_at(&header, 56) != xxh3_64(&header[..56]) {
            return Err(Error::invalid("header is damaged: wrong checksum", 56));
        }
        let version = (u16_at(&header, 12), u16_at(&header, 14));
        if version.0 > kind.version().0 {
            return Err(Error::UnsupportedVersion {
                file: FileName::default(),
                kind: kind.name(),
                found: format!("{}.{}", version.0, version.1),
                known: kind.version().0,
            });
        }
        if version.0 == 0 {
            return Err(Error::invalid("format version 0 never existed", 12));
        }
        if header[20..24]
            .iter()
            .chain(&header[40..56])
            .any(|&byte| byte != 0)
        {
            return Err(Error::invalid("reserved header bytes are not zero", 20));
        }
        let declared_bytes = u64_at(&header, 24);
        if declared_bytes != file_bytes {
            return Err(Error::invalid(
                format!("file has {file_bytes} bytes, its header says {declared_bytes}"),
                24,
            ));
        }
        let n_sections = u32_at(&header, 16);
        let directory_end = HEADER_BYTES + ENTRY_BYTES * u64::from(n_sections);
        if n_sections > MAX_SECTIONS || directory_end > file_bytes {
            return Err(Error::invalid(
                format!("{n_sections} sections cannot fit in the file"),
                16,
            ));
        }
        let mut directory = vec![0u8; (directory_end - HEADER_BYTES) as usize];
        source.read_exact(&mut directory)?;
        if u64_at(&header, 32) != xxh3_64(&directory) {
            return Err(Error::invalid("directory is damaged: wrong checksum", 32));
        }
        let sections = parse_directory(&directory, directory_end, file_bytes)?;
        let mut container = Container {
            source,
            kind,
            version,
            file_bytes,
            seen: vec![false; sections.len()],
            sections,
        };
        let first = container
            .sections
            .first()
            .map_or(file_bytes, |section| section.offset);
        container.check_gap(directory_end, first)?;
        Ok(container)
    }

    /// What the container holds.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Format version found in the file, major and minor.
    pub fn version(&self) -> (u16, u16) {
        self.version
    }

    /// Length of the file.
    pub fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    /// The directory, in file order.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The section `(tag, index)`, if there is one.
    pub fn find(&self, tag: [u8; 4], index: u32) -> Option<Section> {
        self.sections
            .iter()
            .copied()
            .find(|section| (section.tag, section.index) == (tag, index))
    }

    /// Like [`Container::find`], but a missing section is an error.
    ///
    /// # Errors
    /// `Invalid` naming the section.
    pub(crate) fn require(&self, tag: [u8; 4], index: u32) -> Result<Section> {
        self.find(tag, index).ok_or_else(|| {
            Error::invalid(
                format!("section {} {index} is missing", tag.escape_ascii()),
                HEADER_BYTES,
            )
        })
    }

    /// Reads section `(tag, index)` as an array.
    ///
    /// # Errors
    /// `Invalid` if it is missing, damaged, or no whole number of `T`; `Io`.
    pub(crate) fn read_array<T: bytemuck::Pod>(
        &mut self,
        tag: [u8; 4],
        index: u32,
    ) -> Result<Vec<T>> {
        let section = self.require(tag, index)?;
        let item_bytes = size_of::<T>().max(1) as u64;
        if section.length % item_bytes != 0 {
            return Err(Error::invalid(
                format!(
                    "section {} has {} bytes, no multiple of {item_bytes}",
                    section.name(),
                    section.length
                ),
                section.offset,
            ));
        }
        // The directory lies within the file, so this allocates no more than the file is long.
        let n_items = usize::try_from(section.length / item_bytes)
            .map_err(|_| Error::invalid("section is too long for this machine", section.offset))?;
        let mut items = vec![T::zeroed(); n_items];
        self.source.seek(SeekFrom::Start(section.offset))?;
        self.source
            .read_exact(bytemuck::cast_slice_mut(&mut items))?;
        if xxh3_64(bytemuck::cast_slice(&items)) != section.checksum {
            return Err(Error::invalid(
                format!("section {} is damaged: wrong checksum", section.name()),
                section.offset,
            ));
        }
        let end = section.offset + section.length;
        let same = |other: &Section| (other.tag, other.index) == (tag, index);
        if let Some(ix) = self.sections.iter().position(same) {
            self.seen[ix] = true;
            let next = self.sections.get(ix + 1);
            self.check_gap(end, next.map_or(self.file_bytes, |next| next.offset))?;
        }
        Ok(items)
    }

    /// Reads section `(tag, 0)` as a record.
    pub(crate) fn read_record<T: DeserializeOwned>(&mut self, tag: [u8; 4]) -> Result<T> {
        let section = self.require(tag, 0)?;
        if section.length > 1 << 20 {
            return Err(Error::invalid(
                "record is larger than 1 MiB",
                section.offset,
            ));
        }
        decode_record(&self.read_array::<u8>(tag, 0)?, section.offset)
    }

    /// Reads and checks the sections that were not asked for, so that a full read checks the
    /// whole file: those of later minor versions.
    pub(crate) fn check_unread(&mut self) -> Result<()> {
        for ix in 0..self.sections.len() {
            if !self.seen[ix] {
                let Section { tag, index, .. } = self.sections[ix];
                self.read_array::<u8>(tag, index)?;
            }
        }
        Ok(())
    }

    /// Checks that the fill between sections, less than [`ALIGNMENT`] bytes, is zero.
    fn check_gap(&mut self, start: u64, end: u64) -> Result<()> {
        let mut gap = [0u8; ALIGNMENT as usize];
        let gap = &mut gap[..(end - start) as usize];
        self.source.seek(SeekFrom::Start(start))?;
        self.source.read_exact(gap)?;
        match gap.iter().position(|&byte| byte != 0) {
            Some(at) => Err(Error::invalid(
                "fill between sections is not zero",
                start + at as u64,
            )),
            None => Ok(()),
        }
    }
}

/// Why a file that starts with `start`, not as `kind` does, cannot be read.
fn wrong_kind<R: Read + Seek>(source: &mut R, start: &[u8], kind: Kind) -> Error {
    if (1..12).contains(&start.len()) && start.starts_with(&MAGIC[..start.len().min(8)]) {
        return Error::invalid("file ends within its header", start.len() as u64);
    }
    // Text needs more than a header to be distinguished.
    let mut more = Vec::new();
    let read = source
        .seek(SeekFrom::Start(0))
        .and_then(|_| source.take(SNIFF_BYTES as u64).read_to_end(&mut more));
    match read {
        Ok(_) => Error::not_this_kind(kind.name(), FileKind::of(&more).describe()),
        Err(error) => error.into(),
    }
}

fn parse_directory(bytes: &[u8], directory_end: u64, file_bytes: u64) -> Result<Vec<Section>> {
    let mut sections: Vec<Section> = Vec::with_capacity(bytes.len() / ENTRY_BYTES as usize);
    let mut end = directory_end;
    for (entry_ix, entry) in bytes.chunks_exact(ENTRY_BYTES as usize).enumerate() {
        let at = HEADER_BYTES + ENTRY_BYTES * entry_ix as u64;
        let section = Section {
            tag: [entry[0], entry[1], entry[2], entry[3]],
            index: u32_at(entry, 4),
            offset: u64_at(entry, 8),
            length: u64_at(entry, 16),
            checksum: u64_at(entry, 24),
        };
        let section_end = section.offset.checked_add(section.length);
        if align(end) != Some(section.offset) || section_end.is_none_or(|end| end > file_bytes) {
            return Err(Error::invalid(
                format!("section {} lies outside its place", section.name()),
                at,
            ));
        }
        end = section.offset + section.length;
        sections.push(section);
    }
    if end != file_bytes {
        return Err(Error::invalid("bytes after the last section", end));
    }
    let mut ids: Vec<_> = sections
        .iter()
        .map(|section| (section.tag, section.index))
        .collect();
    ids.sort_unstable();
    if ids.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err(Error::invalid(
            "two sections have the same name",
            HEADER_BYTES,
        ));
    }
    Ok(sections)
}
