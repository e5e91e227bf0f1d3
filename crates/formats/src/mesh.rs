//! Triangle meshes that stand beside the hair: a head, a bust, a collar.

use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::provenance::tool_version;
use crate::validate::{finite, in_range, short_name};

/// Most triangles of a mesh.
pub const MAX_TRIANGLES: usize = 2_000_000;

/// Most vertices of a mesh: three for each of [`MAX_TRIANGLES`].
pub const MAX_VERTICES: usize = 3 * MAX_TRIANGLES;

/// Farthest coordinate, cm; that of grooms.
const MAX_COORDINATE: f64 = 1e5;

/// A triangle mesh, as a `.mesh` file.
///
/// Centimetres, right-handed, +Y up. Triangles wind counterclockwise where they are seen from
/// outside; normals point outwards.
///
/// ```
/// use strandlight_formats::{BakedFile, Mesh};
///
/// let mesh = Mesh::new(
///     vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
///     vec![[0, 1, 2]],
/// )?;
/// assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
/// assert_eq!(Mesh::from_bytes(&mesh.to_bytes()?)?, mesh);
/// # Ok::<(), strandlight_formats::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertices, cm, coordinates within 1e5.
    pub positions: Vec<[f32; 3]>,
    /// One unit vector (within 1e-4) for each vertex.
    pub normals: Vec<[f32; 3]>,
    /// Texture coordinates, one for each vertex; empty where the mesh has none.
    pub uvs: Vec<[f32; 2]>,
    /// Three vertices each, at least one triangle, at most [`MAX_TRIANGLES`].
    pub triangles: Vec<[u32; 3]>,
    /// Where it comes from.
    pub source: MeshSource,
}

/// Where a mesh comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSource {
    /// [`crate::content_hash`] of the source file's bytes; empty when generated.
    pub hash: String,
    /// Program that made the mesh.
    pub tool_version: String,
    /// Its parameters, as name and value, in order.
    pub parameters: Vec<(String, String)>,
}

impl Default for MeshSource {
    fn default() -> Self {
        MeshSource {
            hash: String::new(),
            tool_version: tool_version(),
            parameters: Vec::new(),
        }
    }
}

impl Mesh {
    /// A mesh with the normals that [`Mesh::smooth_normals`] makes, and without texture
    /// coordinates.
    ///
    /// # Errors
    /// As [`Mesh::validate`].
    pub fn new(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Result<Mesh> {
        let mut mesh = Mesh {
            normals: vec![[0.0, 1.0, 0.0]; positions.len()],
            positions,
            uvs: Vec::new(),
            triangles,
            source: MeshSource::default(),
        };
        mesh.validate()?;
        mesh.normals = mesh.smooth_normals();
        Ok(mesh)
    }

    /// For each vertex, the unit mean of the normals of the triangles around it, weighted by their
    /// areas. Vertices at the same place share theirs, so that seams of texture coordinates do not
    /// show. +Y where no triangle with an area is.
    ///
    /// # Panics
    /// Where a triangle names a vertex that is not there.
    pub fn smooth_normals(&self) -> Vec<[f32; 3]> {
        let corner = |ix: u32| self.positions[ix as usize].map(f64::from);
        let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let place = |ix: usize| place_bits(&self.positions[ix]);
        let mut sums: BTreeMap<[u32; 3], [f64; 3]> = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            let from = corner(a);
            let (u, v) = (minus(corner(b), from), minus(corner(c), from));
            // Twice the area long.
            let normal = [
                u[1] * v[2] - u[2] * v[1],
                u[2] * v[0] - u[0] * v[2],
                u[0] * v[1] - u[1] * v[0],
            ];
            for ix in [a, b, c] {
                let sum = sums.entry(place(ix as usize)).or_default();
                for (sum, part) in sum.iter_mut().zip(normal) {
                    *sum += part;
                }
            }
        }
        let normal = |ix: usize| {
            let sum = sums.get(&place(ix)).copied().unwrap_or_default();
            let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            match length > 1e-100 {
                true => sum.map(|x| (x / length) as f32),
                false => [0.0, 1.0, 0.0],
            }
        };
        (0..self.positions.len()).map(normal).collect()
    }

    /// How many edges border one triangle alone; none of a closed surface. Vertices at the same place count as one.
    ///
    /// # Panics
    /// Where a triangle names a vertex that is not there.
    pub fn open_edges(&self) -> usize {
        let mut by_place: Vec<([u32; 3], u32)> = (self.positions.iter().zip(0..))
            .map(|(position, ix)| (place_bits(position), ix))
            .collect();
        by_place.sort_unstable();
        // By vertex, the first one at its place.
        let mut first = vec![0; by_place.len()];
        for there in by_place.chunk_by(|a, b| a.0 == b.0) {
            for (_, ix) in there {
                first[*ix as usize] = there[0].1;
            }
        }
        let mut edges: Vec<[u32; 2]> = (self.triangles.iter())
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|ends| ends.map(|ix| first[ix as usize]))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .filter(|[a, b]| a != b)
            .collect();
        edges.sort_unstable();
        let same = edges.chunk_by(|a, b| a == b);
        same.filter(|edges| edges.len() == 1).count()
    }

    /// Lowest and highest coordinates of the vertices, cm.
    pub fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let start = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        self.positions.iter().fold(start, |(min, max), point| {
            let each = |pick: fn(f32, f32) -> f32, of: [f32; 3]| {
                std::array::from_fn(|axis| pick(of[axis], point[axis]))
            };
            (each(f32::min, min), each(f32::max, max))
        })
    }

    /// Checks the numbers of vertices and triangles, that coordinates are finite and within 1e5 cm,
    /// normals unit vectors within 1e-4, texture coordinates finite, and that triangles name
    /// vertices that there are.
    ///
    /// # Errors
    /// `Value` naming the first entry that breaks a promise.
    pub fn validate(&self) -> Result<()> {
        let n_vertices = self.positions.len();
        let count = |key: &str, n: usize, min: f64, max: usize| {
            in_range(format!("number of {key}"), n as f64, min, max as f64)
        };
        count("vertices", n_vertices, 3.0, MAX_VERTICES)?;
        count("triangles", self.triangles.len(), 1.0, MAX_TRIANGLES)?;
        let same = |key: &str, n: usize| match n == n_vertices {
            true => Ok(()),
            false => {
                let range = format!("{n_vertices}, one for each vertex");
                Err(Error::value(format!("number of {key}"), n, range))
            }
        };
        same("normals", self.normals.len())?;
        if !self.uvs.is_empty() {
            same("texture coordinates", self.uvs.len())?;
        }
        for (ix, position) in self.positions.iter().enumerate() {
            for &x in position {
                if !(-MAX_COORDINATE..=MAX_COORDINATE).contains(&f64::from(x)) {
                    let range = format!("within {MAX_COORDINATE} cm");
                    return Err(Error::value(format!("positions[{ix}]"), x, range));
                }
            }
        }
        for (ix, normal) in self.normals.iter().enumerate() {
            let squares = normal.map(|x| f64::from(x) * f64::from(x));
            let length = squares.iter().sum::<f64>().sqrt();
            if !(0.9999..=1.0001).contains(&length) {
                let range = "in 0.9999..=1.0001";
                return Err(Error::value(
                    format!("length of normals[{ix}]"),
                    length,
                    range,
                ));
            }
        }
        for (ix, uv) in self.uvs.iter().enumerate() {
            for &x in uv {
                finite(|| format!("uvs[{ix}]"), x)?;
            }
        }
        for (ix, triangle) in self.triangles.iter().enumerate() {
            for &vertex in triangle {
                if vertex as usize >= n_vertices {
                    let range = format!("below {n_vertices}, the number of vertices");
                    return Err(Error::value(format!("triangles[{ix}]"), vertex, range));
                }
            }
        }
        for (name, _) in &self.source.parameters {
            short_name("name of a parameter", name)?;
        }
        Ok(())
    }
}

/// What tells places apart: -0 is at the place of 0.
fn place_bits(position: &[f32; 3]) -> [u32; 3] {
    position.map(|x| (x + 0.0).to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of half width 1 whose faces share corners.
    fn cube() -> Mesh {
        let corner = |ix: u32| [0, 1, 2].map(|axis| if ix >> axis & 1 == 1 { 1.0 } else { -1.0 });
        let faces: [[u32; 4]; 6] = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        Mesh::new(
            (0..8).map(corner).collect(),
            faces.into_iter().flat_map(halves).collect(),
        )
        .expect("valid")
    }

    #[test]
    fn normals_point_outwards_and_are_shared_at_one_place() {
        let cube = cube();
        for (position, normal) in cube.positions.iter().zip(&cube.normals) {
            let cos: f32 = (0..3)
                .map(|axis| position[axis] * normal[axis])
                .sum::<f32>()
                / 3f32.sqrt();
            // Two triangles of one face meet at some corners, one at others.
            assert!(cos > 0.9, "{position:?} {normal:?}");
        }
        // Every triangle with vertices of its own, one of which lies at -0: the same normals.
        let of = |list: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let corners = cube.triangles.iter().flatten();
            corners.map(|&ix| list[ix as usize]).collect()
        };
        let lone = (0..12).map(|ix| [3 * ix, 3 * ix + 1, 3 * ix + 2]).collect();
        let split = Mesh::new(of(&cube.positions), lone).expect("valid");
        assert_eq!(split.normals, of(&cube.normals));
        let (min, max) = cube.bounds();
        assert_eq!((min, max), ([-1.0; 3], [1.0; 3]));
        let flat = |z: f32| {
            let corners = vec![[0.0, 0.0, z], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
            Mesh::new(corners, vec![[0, 1, 2]]).expect("valid").normals
        };
        assert_eq!(flat(-0.0), flat(0.0));
        // Without an area, up.
        let line = Mesh::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).expect("valid");
        assert_eq!(line.normals[0], [0.0, 1.0, 0.0]);
    }

    #[test]
    fn open_edges_are_those_of_one_triangle() {
        let mut cube = cube();
        assert_eq!(cube.open_edges(), 0);
        // A square hole.
        cube.triangles.truncate(10);
        assert_eq!(cube.open_edges(), 4);
        // Every triangle with vertices of its own: the places count.
        let corners = cube.triangles.iter().flatten();
        let positions = corners.map(|&ix| cube.positions[ix as usize]).collect();
        let lone = (0..10).map(|ix| [3 * ix, 3 * ix + 1, 3 * ix + 2]).collect();
        let split = Mesh::new(positions, lone).expect("valid");
        assert_eq!(split.open_edges(), 4);
    }

    #[test]
    fn what_breaks_a_promise_is_named() {
        type Break = fn(&mut Mesh);
        let breaks: [(Break, &str); 9] = [
            (|mesh| mesh.positions.truncate(2), "number of vertices"),
            (|mesh| mesh.triangles.clear(), "number of triangles"),
            (|mesh| mesh.normals.truncate(7), "number of normals"),
            (|mesh| mesh.uvs.push([0.0; 2]), "texture coordinates"),
            (|mesh| mesh.positions[3][1] = f32::NAN, "positions[3]"),
            (|mesh| mesh.positions[3][1] = 2e5, "positions[3]"),
            (|mesh| mesh.normals[2] = [0.0; 3], "normals[2]"),
            (|mesh| mesh.uvs = vec![[0.0, f32::INFINITY]; 8], "uvs[0]"),
            (|mesh| mesh.triangles[4][2] = 8, "triangles[4] is 8"),
        ];
        for (change, key) in breaks {
            let mut mesh = cube();
            change(&mut mesh);
            let error = mesh.validate().expect_err(key).to_string();
            assert!(error.contains(key), "{error}");
        }
        let new = |triangles| Mesh::new(vec![[0.0; 3]; 3], triangles);
        assert!(new(vec![[0, 1, 3]]).is_err(), "before its normals are made");
    }
}
