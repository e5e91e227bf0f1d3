//! Triangles as the readers of meshes find them.

use std::path::PathBuf;

use strandlight_formats::{Mesh, UpAxis};

/// Longest file that is imported, and most of the files beside it, bytes.
pub const MAX_BYTES: u64 = 1 << 30;

/// All triangles of a file, in its unit and axes.
#[derive(Default)]
pub struct Parts {
    pub positions: Vec<[f32; 3]>,
    /// One for each vertex, of any length; zero where the file has none.
    pub normals: Vec<[f32; 3]>,
    /// One for each vertex.
    pub uvs: Vec<[f32; 2]>,
    pub has_uvs: bool,
    pub triangles: Vec<[u32; 3]>,
    /// Files beside it that were read as well.
    pub files: Vec<PathBuf>,
}

fn length(v: [f32; 3]) -> f64 {
    let squares = v.map(|x| f64::from(x) * f64::from(x));
    squares.iter().sum::<f64>().sqrt()
}

impl Parts {
    /// The mesh in centimetres, y up.
    pub fn mesh(mut self, cm: f64, up: UpAxis, notes: &mut Vec<String>) -> Result<Mesh, String> {
        let turn = |[x, y, z]: [f32; 3]| match up {
            UpAxis::X => [-y, x, z],
            UpAxis::Y => [x, y, z],
            UpAxis::Z => [x, z, -y],
        };
        for position in &mut self.positions {
            *position = turn(position.map(|x| (f64::from(x) * cm) as f32));
        }
        let n_before = self.triangles.len();
        let positions = &self.positions;
        self.triangles.retain(|corners| {
            // What names no vertex, or NaN, is for the checks to refuse.
            let Some(corners) = corners_of(positions, *corners) else {
                return true;
            };
            length(doubled_area(corners)) != 0.0
        });
        let n_dropped = n_before - self.triangles.len();
        if n_dropped > 0 {
            notes.push(format!(
                "{n_dropped} of {n_before} triangles were left out: they are without an area"
            ));
        }
        if self.triangles.is_empty() {
            return Err("it has no triangles".to_owned());
        }
        let mut mesh =
            Mesh::new(self.positions, self.triangles).map_err(|error| error.to_string())?;
        // Does the winding agree with the normals that the file has?
        let own: Vec<[f32; 3]> = self.normals.into_iter().map(turn).collect();
        let agrees = |mesh: &Mesh| {
            let of = |corners: &[u32; 3]| {
                let found = corners_of(&mesh.positions, *corners);
                let area = found.map_or([0.0; 3], doubled_area);
                let normals = corners.map(|ix| own[ix as usize]);
                let along = |axis: usize| {
                    f64::from(area[axis]) * normals.iter().map(|n| f64::from(n[axis])).sum::<f64>()
                };
                (0..3).map(along).sum::<f64>()
            };
            mesh.triangles.iter().map(of).sum::<f64>() >= 0.0
        };
        if !agrees(&mesh) {
            notes.push("triangles wind against their normals: turned over".to_owned());
            for triangle in &mut mesh.triangles {
                triangle.swap(1, 2);
            }
            mesh.normals = mesh.smooth_normals();
        }
        let n_vertices = own.len();
        let mut n_made = 0;
        for (normal, own) in mesh.normals.iter_mut().zip(own) {
            let long = length(own);
            if long > 1e-6 && long.is_finite() {
                *normal = own.map(|x| (f64::from(x) / long) as f32);
            } else {
                n_made += 1;
            }
        }
        if n_made > 0 {
            notes.push(format!(
                "smooth normals were made for {n_made} of {n_vertices} vertices"
            ));
        }
        if self.has_uvs {
            mesh.uvs = self.uvs;
        }
        mesh.validate().map_err(|error| error.to_string())?;
        Ok(mesh)
    }
}

fn corners_of(positions: &[[f32; 3]], corners: [u32; 3]) -> Option<[[f32; 3]; 3]> {
    let [a, b, c] = corners.map(|ix| positions.get(ix as usize).copied());
    Some([a?, b?, c?])
}

/// The normal of a triangle, twice its area long.
fn doubled_area([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
    let [u, v] =
        [b, c].map(|to| [0, 1, 2].map(|axis: usize| f64::from(to[axis]) - f64::from(a[axis])));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
    .map(|x| x as f32)
}
