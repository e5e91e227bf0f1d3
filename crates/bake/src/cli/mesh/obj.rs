//! Wavefront OBJ: vertices and faces; no materials.

use std::collections::HashMap;

use super::parts::Parts;

/// All faces of all objects, split into triangles.
pub fn read(mut bytes: &[u8]) -> Result<Parts, String> {
    let options = tobj::LoadOptions {
        triangulate: true,
        single_index: true,
        ignore_points: true,
        ignore_lines: true,
    };
    // Materials are not kept, so their files are not opened.
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), HashMap::default()));
    let (models, _) = tobj::load_obj_buf(&mut bytes, &options, no_materials)
        .map_err(|error| format!("not a readable OBJ file: {error}"))?;
    let mut parts = Parts::default();
    for tobj::Model { mesh, .. } in models {
        let first = parts.positions.len() as u32;
        let n_vertices = mesh.positions.len() / 3;
        parts
            .positions
            .extend_from_slice(mesh.positions.as_chunks().0);
        let normals = mesh.normals.as_chunks().0;
        let uvs = mesh.texcoords.as_chunks().0;
        match normals.len() == n_vertices {
            true => parts.normals.extend_from_slice(normals),
            false => parts.normals.resize(parts.positions.len(), [0.0; 3]),
        }
        match uvs.len() == n_vertices {
            true => {
                parts.has_uvs |= n_vertices > 0;
                parts.uvs.extend_from_slice(uvs);
            }
            false => parts.uvs.resize(parts.positions.len(), [0.0; 2]),
        }
        let triangles = mesh.indices.as_chunks::<3>().0.iter();
        parts
            .triangles
            .extend(triangles.map(|corners| corners.map(|ix| first.saturating_add(ix))));
    }
    Ok(parts)
}
