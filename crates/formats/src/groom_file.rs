//! The `.groom` file, version 1.
//!
//! | section | content |
//! |---|---|
//! | `META` | record, [`Meta`] |
//! | `OFFS` | `strand_offsets`, u32 |
//! | `PNTS` | points, 3 f32 each, cm |
//! | `ATTR i` | data of attribute i, f32 |
//! | `HAIR` | the 128 bytes of the header; only for grooms from `.hair` files |
//! | `SNGL` | strands of a single point, 9 words each: strand u32, position, thickness, transparency, colour f32; only with `HAIR` |

use std::io::{Read, Seek};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::groom::{Attribute, Domain, Groom, GroomSource, HairOriginal, SinglePoint, UpAxis};
use crate::write::write_file;

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
const HAIR: [u8; 4] = *b"HAIR";
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

impl Groom {
    /// Reads a `.groom` file.
    ///
    /// # Errors
    /// Any of [`Error`], naming the path.
    pub fn read(path: &Path) -> Result<Self> {
        Container::open(path, Kind::Groom)
            .and_then(read_groom)
            .map_err(|error| error.in_file(path))
    }

    /// Reads the groom that an opened container holds.
    ///
    /// # Errors
    /// Any of [`Error`].
    pub fn from_container<R: Read + Seek>(file: Container<R>) -> Result<Self> {
        read_groom(file)
    }

    /// Decodes a `.groom` file in memory.
    ///
    /// # Errors
    /// Any of [`Error`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        read_groom(Container::from_bytes(bytes, Kind::Groom)?)
    }

    /// Validates and writes, whole or not at all; answers the number of bytes written.
    ///
    /// # Errors
    /// `Value` when the groom breaks a promise, `Io`; the path is named.
    pub fn write(&self, path: &Path) -> Result<u64> {
        let bytes = self.to_bytes().map_err(|error| error.in_file(path))?;
        write_file(path, &bytes).map_err(|error| Error::from(error).in_file(path))?;
        Ok(bytes.len() as u64)
    }

    /// The bytes of the file. Equal grooms give equal bytes.
    ///
    /// # Errors
    /// `Value` when the groom breaks a promise.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
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
        if let Some(hair) = &self.source.hair {
            file.section(HAIR, 0, &hair.header);
            let singles: Vec<[u32; 9]> = hair.single_points.iter().map(words).collect();
            file.section(SINGLES, 0, bytemuck::cast_slice(&singles).to_vec());
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
    let hair: Option<HairOriginal> = match file.find(HAIR, 0) {
        Some(_) => Some(HairOriginal {
            header: file.read_array(HAIR, 0)?,
            single_points: file
                .read_array::<[u32; 9]>(SINGLES, 0)?
                .iter()
                .map(from_words)
                .collect(),
        }),
        None => None,
    };
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
            hair,
        },
    };
    groom.validate()?;
    Ok(groom)
}

fn words(single: &SinglePoint) -> [u32; 9] {
    let ([x, y, z], [r, g, b]) = (single.position, single.color);
    let [x, y, z, t, o, r, g, b] =
        [x, y, z, single.thickness, single.transparency, r, g, b].map(f32::to_bits);
    [single.strand, x, y, z, t, o, r, g, b]
}

fn from_words(&[strand, x, y, z, t, o, r, g, b]: &[u32; 9]) -> SinglePoint {
    SinglePoint {
        strand,
        position: [x, y, z].map(f32::from_bits),
        thickness: f32::from_bits(t),
        transparency: f32::from_bits(o),
        color: [r, g, b].map(f32::from_bits),
    }
}
