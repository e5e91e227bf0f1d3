//! Meshes.

use std::path::Path;

use serde::Serialize;
use strandlight_formats::{BakedFile, Kind, Mesh, counted};

use super::super::Failure;
use super::parts::{Bounds, as_map, parameters, version};

#[derive(Serialize)]
pub(super) struct MeshInfo {
    kind: &'static str,
    format_version: String,
    vertices: usize,
    triangles: usize,
    has_uvs: bool,
    bounds: Bounds,
    /// Extents of the bounds.
    size: [f32; 3],
    /// Of bounds and size.
    unit: &'static str,
    source_hash: String,
    #[serde(serialize_with = "as_map")]
    parameters: Vec<(String, String)>,
    tool_version: String,
}

pub(super) fn mesh(path: &Path) -> Result<MeshInfo, Failure> {
    let format_version = version(path, Kind::Mesh)?;
    let mesh = Mesh::read(path).map_err(Failure::input)?;
    let (min, max) = mesh.bounds();
    Ok(MeshInfo {
        kind: "mesh",
        format_version,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        has_uvs: !mesh.uvs.is_empty(),
        bounds: Bounds { min, max },
        size: [0, 1, 2].map(|axis| max[axis] - min[axis]),
        unit: "cm",
        source_hash: mesh.source.hash,
        parameters: mesh.source.parameters,
        tool_version: mesh.source.tool_version,
    })
}

pub(super) fn text_of_mesh(info: &MeshInfo) -> Vec<String> {
    let (Bounds { min, max }, size) = (&info.bounds, info.size);
    let mut lines = vec![
        format!("mesh {}", info.format_version),
        format!(
            "{} vertices, {}, {} texture coordinates",
            info.vertices,
            counted(info.triangles, "triangle", "triangles"),
            if info.has_uvs { "with" } else { "no" }
        ),
        format!("bounds {min:.2?} to {max:.2?} cm"),
        format!("size {:.2} x {:.2} x {:.2} cm", size[0], size[1], size[2]),
    ];
    if !info.source_hash.is_empty() {
        lines.push(format!("source: hash {}", info.source_hash));
    }
    lines.extend(parameters(&info.parameters, &info.tool_version));
    lines
}
