//! The `.mesh` file, version 1.
//!
//! | section | content |
//! |---|---|
//! | `META` | record, [`Meta`] |
//! | `PNTS` | positions, 3 f32 each, cm |
//! | `NRML` | normals, 3 f32 each |
//! | `TRIS` | triangles, 3 u32 each |
//! | `UVCO` | texture coordinates, 2 f32 each; only if there are any |

use std::io::{Read, Seek};

use serde::{Deserialize, Serialize};

use crate::baked_file::BakedFile;
use crate::container::{Container, ContainerWriter, Kind, encode_record};
use crate::error::{Error, Result};
use crate::mesh::{Mesh, MeshSource};

#[derive(Serialize, Deserialize)]
struct Meta {
    n_vertices: u32,
    n_triangles: u32,
    hash: String,
    tool_version: String,
    parameters: Vec<(String, String)>,
}

const META: [u8; 4] = *b"META";
const POSITIONS: [u8; 4] = *b"PNTS";
const NORMALS: [u8; 4] = *b"NRML";
const TRIANGLES: [u8; 4] = *b"TRIS";
const UVS: [u8; 4] = *b"UVCO";

impl BakedFile for Mesh {
    const KIND: Kind = Kind::Mesh;

    fn from_container<R: Read + Seek>(mut file: Container<R>) -> Result<Self> {
        let meta: Meta = file.read_record(META)?;
        let positions: Vec<[f32; 3]> = file.read_array(POSITIONS, 0)?;
        let normals = file.read_array(NORMALS, 0)?;
        let triangles: Vec<[u32; 3]> = file.read_array(TRIANGLES, 0)?;
        let uvs: Vec<[f32; 2]> = match file.find(UVS, 0) {
            Some(_) => file.read_array(UVS, 0)?,
            None => Vec::new(),
        };
        if positions.len() as u64 != u64::from(meta.n_vertices)
            || triangles.len() as u64 != u64::from(meta.n_triangles)
        {
            return Err(Error::invalid(
                "number of vertices or triangles differs from the record",
                file.require(META, 0)?.offset,
            ));
        }
        if let (true, Some(section)) = (uvs.is_empty(), file.find(UVS, 0)) {
            return Err(Error::invalid(
                "texture coordinates are empty",
                section.offset,
            ));
        }
        file.check_unread()?;
        let mesh = Mesh {
            positions,
            normals,
            uvs,
            triangles,
            source: MeshSource {
                hash: meta.hash,
                tool_version: meta.tool_version,
                parameters: meta.parameters,
            },
        };
        mesh.validate()?;
        Ok(mesh)
    }

    fn to_bytes(&self) -> Result<Vec<u8>> {
        self.validate()?;
        let meta = Meta {
            // Both were checked to be some millions at most.
            n_vertices: self.positions.len() as u32,
            n_triangles: self.triangles.len() as u32,
            hash: self.source.hash.clone(),
            tool_version: self.source.tool_version.clone(),
            parameters: self.source.parameters.clone(),
        };
        let mut file = ContainerWriter::new(Kind::Mesh);
        file.section(META, 0, encode_record(&meta)?);
        file.section(POSITIONS, 0, bytemuck::cast_slice(&self.positions));
        file.section(NORMALS, 0, bytemuck::cast_slice(&self.normals));
        file.section(TRIANGLES, 0, bytemuck::cast_slice(&self.triangles));
        if !self.uvs.is_empty() {
            file.section(UVS, 0, bytemuck::cast_slice(&self.uvs));
        }
        file.finish()
    }
}
