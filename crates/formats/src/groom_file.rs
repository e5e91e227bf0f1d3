//! The `.groom` file, version 1.
//!
//! | section | content |
//! |---|---|
//! | `META` | record, [`Meta`] |
//! | `OFFS` | `strand_offsets`, u32 |
//! | `PNTS` | points, 3 f32 each, cm |
//! | `ATTR i` | data of attribute i, f32 |
//! | `SRCN` | 1.1: name of the format that the groom was imported from, ASCII; only if it was |
//! | `SRCD` | 1.1: what that format keeps, see [`Original`]; only with `SRCN` |
//!
//! Version 1.0 knew one such format, `hair`, and kept its data in two sections, now joined:
//!
//! | section | content |
//! |---|---|
//! | `HAIR` | 128 bytes |
//! | `SNGL` | 36 bytes for each strand of a single point; only with `HAIR` |

use std::io::{Read, Seek};

use serde::{Deserialize, Serialize};

use crate::baked_file::BakedFile;
use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom, GroomSource, Original, UpAxis};

#[derive(Serialize, Deserialize)]
struct Meta {
    n_strands: u32,
    n_points: u32,
    cm_per_unit: f64,
    up: UpAxis,
    hash: String,
    tool_version: String,
    parameters: Vec<(String, String)>,
    attributes: Vec<AttributeMeta>,
}

#[derive(Serialize, Deserialize)]
struct AttributeMeta {
    name: String,
    domain: Domain,
    components: u32,
}

const META: [u8; 4] = *b"META";
const OFFSETS: [u8; 4] = *b"OFFS";
const POINTS: [u8; 4] = *b"PNTS";
const ATTRIBUTE: [u8; 4] = *b"ATTR";
const SOURCE_NAME: [u8; 4] = *b"SRCN";
const SOURCE_DATA: [u8; 4] = *b"SRCD";
/// Of version 1.0.
const HAIR: [u8; 4] = *b"HAIR";
/// Of version 1.0.
const SINGLES: [u8; 4] = *b"SNGL";

/// How large a groom is, as its file says before anything of it is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GroomHeader {
    /// Number of strands.
    pub n_strands: u32,
    /// Number of points of all strands.
    pub n_points: u32,
    /// Bytes of the groom in memory: what its sections hold.
    pub bytes: u64,
}

impl GroomHeader {
    /// Reads the record and the directory of a `.groom` file, and no array of it.
    ///
    /// # Errors
    /// Any of [`Error`].
    pub fn read<R: Read + Seek>(file: &mut Container<R>) -> Result<Self> {
        let meta: Meta = file.read_record(META)?;
        Ok(GroomHeader {
            n_strands: meta.n_strands,
            n_points: meta.n_points,
            bytes: file.sections().iter().map(|section| section.length).sum(),
        })
    }
}

impl BakedFile for Groom {
    const KIND: Kind = Kind::Groom;

    fn from_container<R: Read + Seek>(file: Container<R>) -> Result<Self> {
        read_groom(file)
    }

    fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let meta = Meta {
            // Offsets are u32, so both numbers fit.
            n_strands: self.n_strands() as u32,
            n_points: self.points.len() as u32,
            cm_per_unit: self.source.cm_per_unit,
            up: self.source.up,
            hash: self.source.hash.clone(),
            tool_version: self.source.tool_version.clone(),
            parameters: self.source.parameters.clone(),
            attributes: self
                .attributes
                .iter()
                .map(|attribute| AttributeMeta {
                    name: attribute.name.clone(),
                    domain: attribute.domain,
                    components: attribute.components,
                })
                .collect(),
        };
        let mut file = ContainerWriter::new(Kind::Groom);
        file.section(META, 0, encode_record(&meta)?);
        file.section(OFFSETS, 0, bytemuck::cast_slice(&self.strand_offsets));
        file.section(POINTS, 0, bytemuck::cast_slice(&self.points));
        for (ix, attribute) in (0u32..).zip(&self.attributes) {
            file.section(ATTRIBUTE, ix, bytemuck::cast_slice(&attribute.data));
        }
        if let Some(original) = &self.source.original {
            file.section(SOURCE_NAME, 0, original.format.as_bytes());
            file.section(SOURCE_DATA, 0, &original.data);
        }
        file.finish()
    }
}

fn read_groom<R: Read + Seek>(mut file: Container<R>) -> Result<Groom> {
    let meta: Meta = file.read_record(META)?;
    let strand_offsets: Vec<u32> = file.read_array(OFFSETS, 0)?;
    let points: Vec<[f32; 3]> = file.read_array(POINTS, 0)?;
    if strand_offsets.len() as u64 != u64::from(meta.n_strands) + 1
        || points.len() as u64 != u64::from(meta.n_points)
    {
        return Err(Error::invalid(
            "number of strands or points differs from the record",
            file.require(META, 0)?.offset,
        ));
    }
    let mut attributes = Vec::new();
    for (ix, attribute) in (0u32..).zip(meta.attributes) {
        attributes.push(Attribute {
            name: attribute.name,
            domain: attribute.domain,
            components: attribute.components,
            data: file.read_array(ATTRIBUTE, ix)?,
        });
    }
    let original = read_original(&mut file)?;
    file.check_unread()?;
    let groom = Groom {
        points,
        strand_offsets,
        attributes,
        source: GroomSource {
            cm_per_unit: meta.cm_per_unit,
            up: meta.up,
            hash: meta.hash,
            tool_version: meta.tool_version,
            parameters: meta.parameters,
            original,
        },
    };
    groom.validate()?;
    Ok(groom)
}

fn read_original<R: Read + Seek>(file: &mut Container<R>) -> Result<Option<Original>> {
    if let Some(section) = file.find(SOURCE_NAME, 0) {
        let format = String::from_utf8(file.read_array(SOURCE_NAME, 0)?);
        return Ok(Some(Original {
            format: format
                .map_err(|_| Error::invalid("name of the format is no text", section.offset))?,
            data: file.read_array(SOURCE_DATA, 0)?,
        }));
    }
    if file.find(HAIR, 0).is_none() {
        return Ok(None);
    }
    let mut data: Vec<u8> = file.read_array(HAIR, 0)?;
    data.extend(file.read_array::<u8>(SINGLES, 0)?);
    let format = "hair".to_owned();
    Ok(Some(Original { format, data }))
}
