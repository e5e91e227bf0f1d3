//! Checks of meshes.

use strandlight_formats::Mesh;

use super::lights::malformed_hash;
use super::line::Line;

/// What the format promises beyond what every reader checks.
pub fn checks(mesh: &Mesh) -> Vec<Line> {
    let n_triangles = mesh.triangles.len();
    vec![
        Line::held("invariants of the format", mesh.positions.len(), None),
        Line::held("triangles with an area", n_triangles, flat(mesh)),
        Line::held("normals on the outside", n_triangles, inside_out(mesh)),
        Line::held("hash of the source", 1, malformed_hash(&mesh.source.hash)),
    ]
}

/// The normal of triangle `ix`, twice its area long.
fn doubled_area(mesh: &Mesh, ix: usize) -> [f64; 3] {
    let [a, b, c] = mesh.triangles[ix].map(|ix| mesh.positions[ix as usize].map(f64::from));
    let [u, v] = [b, c].map(|to| [0, 1, 2].map(|axis: usize| to[axis] - a[axis]));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

fn flat(mesh: &Mesh) -> Option<String> {
    let is_flat = |ix: &usize| doubled_area(mesh, *ix) == [0.0; 3];
    let mut flat = (0..mesh.triangles.len()).filter(is_flat);
    let first = flat.next()?;
    let n = 1 + flat.count();
    Some(format!("triangle {first} has none, {n} in all"))
}

/// Triangles that wind against the normals of their corners: half of them would be a mesh inside
/// out; single ones are slips.
fn inside_out(mesh: &Mesh) -> Option<String> {
    let is_against = |ix: &usize| {
        let area = doubled_area(mesh, *ix);
        let corners = mesh.triangles[*ix].iter();
        let cos = corners.map(|&corner| {
            let normal = mesh.normals[corner as usize];
            (0..3)
                .map(|axis| area[axis] * f64::from(normal[axis]))
                .sum::<f64>()
        });
        cos.sum::<f64>() < 0.0
    };
    let n = (0..mesh.triangles.len()).filter(is_against).count();
    let n_triangles = mesh.triangles.len();
    (2 * n > n_triangles).then(|| match n {
        1 => format!("1 of {n_triangles} triangles winds against its normals"),
        _ => format!("{n} of {n_triangles} triangles wind against their normals"),
    })
}
