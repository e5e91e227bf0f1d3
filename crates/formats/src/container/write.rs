//! Writing containers.

use xxhash_rust::xxh3::xxh3_64;

use super::kind::{ALIGNMENT, ENTRY_BYTES, HEADER_BYTES, Kind, MAGIC, MAX_SECTIONS};
use crate::error::{Error, Result};

/// Collects sections and lays them out.
pub(crate) struct ContainerWriter<'a> {
    kind: Kind,
    sections: Vec<([u8; 4], u32, std::borrow::Cow<'a, [u8]>)>,
}

impl<'a> ContainerWriter<'a> {
    /// An empty container of `kind`.
    pub fn new(kind: Kind) -> Self {
        ContainerWriter {
            kind,
            sections: Vec::new(),
        }
    }

    /// Appends a section; `(tag, index)` must not repeat.
    pub fn section(
        &mut self,
        tag: [u8; 4],
        index: u32,
        bytes: impl Into<std::borrow::Cow<'a, [u8]>>,
    ) -> &mut Self {
        self.sections.push((tag, index, bytes.into()));
        self
    }

    /// The file.
    ///
    /// # Errors
    /// More than [`MAX_SECTIONS`] sections.
    pub fn finish(&self) -> Result<Vec<u8>> {
        if self.sections.len() > MAX_SECTIONS as usize {
            let range = format!("at most {MAX_SECTIONS}");
            return Err(Error::value(
                "number of sections",
                self.sections.len(),
                range,
            ));
        }
        let directory_end = HEADER_BYTES + ENTRY_BYTES * self.sections.len() as u64;
        let mut directory = Vec::new();
        let mut end = directory_end;
        let mut offsets = Vec::new();
        for (tag, index, bytes) in &self.sections {
            // Lengths are those of slices in memory, so this cannot overflow.
            let offset = end.next_multiple_of(ALIGNMENT);
            end = offset + bytes.len() as u64;
            offsets.push(offset);
            directory.extend_from_slice(tag);
            directory.extend_from_slice(&index.to_le_bytes());
            directory.extend_from_slice(&offset.to_le_bytes());
            directory.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
            directory.extend_from_slice(&xxh3_64(bytes).to_le_bytes());
        }

        let (major, minor) = self.kind.version();
        let mut file = Vec::with_capacity(end as usize);
        file.extend_from_slice(&MAGIC);
        file.extend_from_slice(&self.kind.tag());
        file.extend_from_slice(&major.to_le_bytes());
        file.extend_from_slice(&minor.to_le_bytes());
        file.extend_from_slice(&(self.sections.len() as u32).to_le_bytes());
        file.extend_from_slice(&[0; 4]);
        file.extend_from_slice(&end.to_le_bytes());
        file.extend_from_slice(&xxh3_64(&directory).to_le_bytes());
        file.extend_from_slice(&[0; 16]);
        let header_sum = xxh3_64(&file);
        file.extend_from_slice(&header_sum.to_le_bytes());
        file.extend_from_slice(&directory);
        for ((_, _, bytes), offset) in self.sections.iter().zip(offsets) {
            file.resize(offset as usize, 0);
            file.extend_from_slice(bytes);
        }
        Ok(file)
    }
}
