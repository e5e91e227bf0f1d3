//! Whether a mesh has an outside: then what looks at it from there sees front faces alone.

use strandlight_formats::Mesh;

/// Do triangles of `mesh` meet two by two at all of their edges, and wind counterclockwise seen from outside? Vertices at the same
/// place count as one. Of parts that do not touch each must be so by itself; a hollow, which winds the other way, is none.
pub(super) fn is_closed(mesh: &Mesh) -> bool {
    let vertex_of = at_their_places(&mesh.positions);
    let mut parts = Parts::new(vertex_of.len());
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    let corners = || {
        let triangles = mesh.triangles.iter();
        let triangles = triangles.map(|corners| corners.map(|ix| vertex_of[ix as usize]));
        // Others have no surface.
        triangles.filter(|[a, b, c]| a != b && b != c && c != a)
    };
    for [a, b, c] in corners() {
        edges.extend([[a, b], [b, c], [c, a]]);
        parts.join(a, b);
        parts.join(b, c);
    }
    edges.sort_unstable();
    let is_twice = edges.windows(2).any(|pair| pair[0] == pair[1]);
    let has_other = |[a, b]: &[u32; 2]| edges.binary_search(&[*b, *a]).is_ok();
    if edges.is_empty() || is_twice || !edges.iter().all(has_other) {
        return false;
    }
    let mut volumes = vec![0.0; vertex_of.len()];
    for corners in corners() {
        let [a, b, c] = corners.map(|ix| {
            let position = glam::Vec3::from(mesh.positions[ix as usize]);
            position.as_dvec3()
        });
        volumes[parts.of(corners[0]) as usize] += a.dot(b.cross(c));
    }
    volumes.iter().all(|volume| *volume >= 0.0)
}

/// By vertex: the first one at the same place.
fn at_their_places(positions: &[[f32; 3]]) -> Vec<u32> {
    // Zero has two signs.
    let place = |ix: u32| positions[ix as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&ix| (place(ix), ix));
    let mut first = vec![0; positions.len()];
    for same in order.chunk_by(|a, b| place(*a) == place(*b)) {
        for &ix in same {
            first[ix as usize] = same[0];
        }
    }
    first
}

/// Sets of vertices that are joined.
struct Parts {
    /// By vertex: another one of its set, or itself.
    next: Vec<u32>,
}

impl Parts {
    fn new(n: usize) -> Parts {
        Parts {
            next: (0..n as u32).collect(),
        }
    }

    /// The vertex that stands for the set of another.
    fn of(&mut self, mut vertex: u32) -> u32 {
        while self.next[vertex as usize] != vertex {
            let next = self.next[vertex as usize];
            self.next[vertex as usize] = self.next[next as usize];
            vertex = next;
        }
        vertex
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.next[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::tests::ellipsoid;
    use super::*;

    fn joined(meshes: &[Mesh]) -> Mesh {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for mesh in meshes {
            let first = positions.len() as u32;
            positions.extend(&mesh.positions);
            triangles.extend(mesh.triangles.iter().map(|ix| ix.map(|ix| ix + first)));
        }
        Mesh::new(positions, triangles).expect("valid")
    }

    #[test]
    fn a_mesh_with_an_outside_is_closed() {
        // Its poles are many vertices at one place.
        let ball = ellipsoid(Vec3::new(1.0, 2.0, 1.0), 8);
        assert!(is_closed(&ball));
        let moved = |by: f32| {
            let mut mesh = ball.clone();
            mesh.positions.iter_mut().for_each(|at| at[0] += by);
            mesh
        };
        assert!(is_closed(&joined(&[moved(9.0), ball.clone(), moved(0.5)])));
        let mut apart = ball.clone();
        apart.triangles.clear();
        apart.positions.clear();
        for corners in &ball.triangles {
            let first = apart.positions.len() as u32;
            (apart.positions).extend(corners.map(|ix| ball.positions[ix as usize]));
            apart.triangles.push([first, first + 1, first + 2]);
        }
        assert!(is_closed(&apart), "no vertex is shared");
    }

    #[test]
    fn holes_sheets_and_inner_sides_are_not() {
        let ball = ellipsoid(Vec3::ONE, 8);
        let mut open = ball.clone();
        open.triangles.swap_remove(40);
        assert!(!is_closed(&open));
        let mut inside_out = ball.clone();
        inside_out.triangles.iter_mut().for_each(|ix| ix.swap(0, 1));
        assert!(!is_closed(&inside_out));
        assert!(!is_closed(&joined(&[ball.clone(), inside_out])));
        let mut one_turned = ball.clone();
        one_turned.triangles[40].swap(0, 1);
        assert!(!is_closed(&one_turned));
        let mut sheet = ball;
        sheet.triangles.truncate(1);
        assert!(!is_closed(&sheet));
    }
}
