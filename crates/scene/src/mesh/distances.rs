//! How far places are from a mesh, below zero inside: on a grid, exact next to the surface.
//!
//! Farther away, nodes take the nearest point of the surface from their neighbours (Danielsson
//! 1980), which is a little too far here and there.

use glam::{IVec3, UVec3, Vec3};
use strandlight_formats::Mesh;

/// Nodes along the longest side of the mesh: about 5 mm apart on a bust. A node takes 4 bytes.
const SIDE: f32 = 96.0;

/// Nodes around the mesh on each side.
const MARGIN: f32 = 2.0;

/// Distances are exact at nodes this far from the box of a triangle, cells.
const BAND: f32 = 1.6;

/// Signed distances to a mesh, cm.
#[derive(Debug)]
pub struct Distances {
    origin: Vec3,
    cell: f32,
    dims: UVec3,
    nodes: Vec<f32>,
}

/// The nearest point of the surface known at a node.
#[derive(Clone, Copy)]
struct Nearest {
    point: Vec3,
    square: f32,
    /// Is the node on the side that normals point away from?
    is_inside: bool,
    is_exact: bool,
}

impl Distances {
    /// Of `mesh`.
    pub fn new(mesh: &Mesh) -> Distances {
        let (low, high) = mesh.bounds();
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let extent = high - low;
        let cell = (extent.max_element() / SIDE).max(1e-3);
        let dims = (extent / cell).ceil().as_uvec3() + 1 + 2 * MARGIN as u32;
        let mut distances = Distances {
            origin: low - MARGIN * cell,
            cell,
            dims,
            nodes: Vec::new(),
        };
        let unknown = Nearest {
            point: Vec3::INFINITY,
            square: f32::INFINITY,
            is_inside: false,
            is_exact: false,
        };
        let mut nearest = vec![unknown; dims.element_product() as usize];
        distances.find_near(mesh, &mut nearest);
        distances.spread(&mut nearest);
        distances.nodes = nearest
            .into_iter()
            .map(
                |Nearest {
                     square, is_inside, ..
                 }| {
                    let distance = square.sqrt();
                    if is_inside { -distance } else { distance }
                },
            )
            .collect();
        distances
    }

    /// Bytes that the nodes take.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..])
    }

    /// Way from node to node, cm.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    fn index(&self, node: UVec3) -> usize {
        (node.x + self.dims.x * (node.y + self.dims.y * node.z)) as usize
    }

    fn node(&self, node: UVec3) -> Vec3 {
        self.origin + node.as_vec3() * self.cell
    }

    /// The distance at a place, and the unit vector along which it grows; `None` off the grid,
    /// outside.
    pub fn at(&self, position: Vec3) -> Option<(f32, Vec3)> {
        let at = (position - self.origin) / self.cell;
        let last = (self.dims - 1).as_vec3();
        // Also false for NaN.
        if !(at.cmpge(Vec3::ZERO).all() && at.cmplt(last).all()) {
            return None;
        }
        let base = at.as_uvec3();
        let f = at - base.as_vec3();
        let first = self.index(base);
        let (row, slice) = (self.dims.x as usize, (self.dims.x * self.dims.y) as usize);
        let pair = |at: usize| [self.nodes[at], self.nodes[at + 1]];
        let [a, b] = [pair(first), pair(first + row)];
        let [c, d] = [pair(first + slice), pair(first + slice + row)];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let of_x = |pair: [f32; 2]| mix(pair[0], pair[1], f.x);
        let [ax, bx, cx, dx] = [a, b, c, d].map(of_x);
        let (low, high) = (mix(ax, bx, f.y), mix(cx, dx, f.y));
        let step = |pair: [f32; 2]| pair[1] - pair[0];
        let along_x = mix(mix(step(a), step(b), f.y), mix(step(c), step(d), f.y), f.z);
        let along_y = mix(bx - ax, dx - cx, f.z);
        let gradient = Vec3::new(along_x, along_y, high - low);
        Some((mix(low, high, f.z), gradient.normalize_or(Vec3::Y)))
    }

    /// Exact distances of the nodes around each triangle.
    fn find_near(&self, mesh: &Mesh, nearest: &mut [Nearest]) {
        for triangle in &mesh.triangles {
            let corners = triangle.map(|ix| Vec3::from(mesh.positions[ix as usize]));
            let normals = triangle.map(|ix| Vec3::from(mesh.normals[ix as usize]));
            let low = corners[0].min(corners[1]).min(corners[2]);
            let high = corners[0].max(corners[1]).max(corners[2]);
            let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let across = across.normalize_or_zero();
            let node_of = |place: Vec3| (place - self.origin) / self.cell;
            let first = (node_of(low) - BAND).ceil().max(Vec3::ZERO).as_uvec3();
            let last = (node_of(high) + BAND).floor().as_uvec3().min(self.dims - 1);
            for z in first.z..=last.z {
                for y in first.y..=last.y {
                    for x in first.x..=last.x {
                        let node = UVec3::new(x, y, z);
                        let place = self.node(node);
                        let own = &mut nearest[self.index(node)];
                        // Large triangles have many nodes about them that are nearer to others; a little more than is lost in rounding.
                        let off_plane = across.dot(place - corners[0]);
                        if 0.999 * off_plane * off_plane > own.square {
                            continue;
                        }
                        let shares = nearest_shares(corners, place);
                        let sum = |of: [Vec3; 3]| {
                            of[0] * shares[0] + of[1] * shares[1] + of[2] * shares[2]
                        };
                        let point = sum(corners);
                        let square = place.distance_squared(point);
                        if square < own.square {
                            *own = Nearest {
                                point,
                                square,
                                is_inside: (place - point).dot(sum(normals)) < 0.0,
                                is_exact: true,
                            };
                        }
                    }
                }
            }
        }
    }

    /// Hands nearest points on from node to node, in sweeps along and against the axes. The side is
    /// handed on with them: no way leads from one to the other but through exact nodes.
    fn spread(&self, nearest: &mut [Nearest]) {
        let dims = self.dims.as_ivec3();
        for round in 0..2 {
            for sweep in 0..8u32 {
                let forward = IVec3::new(1, 2, 4).map(|bit| 1 - 2 * (sweep as i32 & bit).signum());
                let turned = |n: i32, along: i32, ix: i32| if along > 0 { ix } else { n - 1 - ix };
                for iz in 0..dims.z {
                    for iy in 0..dims.y {
                        for ix in 0..dims.x {
                            let node = IVec3::new(
                                turned(dims.x, forward.x, ix),
                                turned(dims.y, forward.y, iy),
                                turned(dims.z, forward.z, iz),
                            );
                            self.take(nearest, node, forward);
                        }
                    }
                }
            }
            // One round reaches every node that is seen from the surface.
            if round == 0 && nearest.iter().all(|node| node.square.is_finite()) {
                break;
            }
        }
    }

    /// Takes from the neighbours behind a node what is nearer.
    fn take(&self, nearest: &mut [Nearest], node: IVec3, forward: IVec3) {
        let ix = self.index(node.as_uvec3());
        let mut own = nearest[ix];
        if own.is_exact {
            return;
        }
        let place = self.node(node.as_uvec3());
        for axis in [IVec3::X, IVec3::Y, IVec3::Z] {
            let other = node - forward * axis;
            if other.cmplt(IVec3::ZERO).any() || other.cmpge(self.dims.as_ivec3()).any() {
                continue;
            }
            let other = nearest[self.index(other.as_uvec3())];
            let square = place.distance_squared(other.point);
            if square < own.square {
                own = Nearest {
                    square,
                    is_exact: false,
                    ..other
                };
            }
        }
        nearest[ix] = own;
    }
}

/// What the nearest point of a triangle weighs its corners with (Ericson 2004, 5.1.5).
fn nearest_shares([a, b, c]: [Vec3; 3], place: Vec3) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let (from_a, from_b, from_c) = (place - a, place - b, place - c);
    let (d1, d2) = (ab.dot(from_a), ac.dot(from_a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (ab.dot(from_b), ac.dot(from_b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3).max(f32::MIN_POSITIVE);
        return [1.0 - t, t, 0.0];
    }
    let (d5, d6) = (ab.dot(from_c), ac.dot(from_c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6).max(f32::MIN_POSITIVE);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6)).max(f32::MIN_POSITIVE);
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if sum <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    [va / sum, vb / sum, vc / sum]
}
