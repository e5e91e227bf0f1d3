//! Bounce light: what the proxies send back to the hair.
//!
//! At the nodes of a coarse grid around the hair, [`N_RAYS`] rays look for proxies. What they meet is summed up in
//! two lobes, one for the ground and one for all else: power, vector of power, and what the hair before it lets
//! pass. A point of the hair interpolates these, and is shaded with a spherical Gaussian light of each lobe's power
//! and mean direction, [`lobe_light`]. Here is what depends on strands and proxies alone, for both renderers.

use glam::Vec3;
use strandlight_scattering::closed_form::{
    P_2, TERM_GLOBAL, average_row, forward_table, sample_forward, sample_painted_forward,
};
use strandlight_scattering::random::GOLDEN_ANGLE;

use crate::beside::{Beside, Surface};
use crate::material::HairMaterial;
use crate::mesh::{MeshRays, MetMesh};
use crate::proxy::{
    GROUND, LIGHT_MAP_SIDE, ProxyRecord, entry_distance, from_unit, is_blocked_by, light_map_place,
    to_unit,
};
use crate::scene::{LightRecord, PreparedScene};
use crate::shadow_maps::NO_SLOT;
use crate::strands::Strands;
use crate::volume::Grid;

/// That of the ground, then that of all other proxies.
pub const N_LOBES: usize = 2;

/// Rays of a node.
pub const N_RAYS: usize = 48;

/// Nodes along the longest side of the grid, some 1 cm apart on a head.
pub const SIDE: u32 = 40;

/// No surface is met.
pub const NO_SURFACE: u32 = u32::MAX;

const NOTHING: BounceHit = BounceHit {
    surface: NO_SURFACE,
    distance: f32::INFINITY,
};

/// On a shorter way, cm, a ray that leaves a mesh meets the triangles beside.
const LEAST_WAY: f32 = 0.01;

/// Least concentration of a lobe's light: all but even.
const LEAST_KAPPA: f32 = 0.1;

/// And the largest: that of a few rays.
const MOST_KAPPA: f32 = 200.0;

/// How far beyond the surface that it meets hair counts for a ray, voxels of the shadow volume: strands that lie on
/// a surface are smeared over voxels on both sides of it.
pub const BEYOND: f32 = 1.0;

/// What a ray meets; mirrored by `BounceHit` in `shaders/pass/bounce.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct BounceHit {
    /// Index in [`Beside::surfaces`], or [`NO_SURFACE`].
    pub surface: u32,
    /// How far away, cm.
    pub distance: f32,
}

/// Sizes as the pass reads them; mirrored by `BounceLayout` in `shaders/pass/bounce.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct BounceLayout {
    /// Nodes that are used.
    pub n_nodes: u32,
    /// A bit for each proxy that is a ground.
    pub grounds: u32,
    /// Not used.
    pub pad: [u32; 2],
}

strandlight_scattering::mirrors! {
    BounceHit as "BounceHit" in "pass/bounce" { surface, distance }
    BounceLayout as "BounceLayout" in "pass/bounce" { n_nodes, grounds, pad }
}

/// Weights of the three shares of a shadow record, by channel, and 0: see [`passed_weights`].
pub type PassedWeights = [[f32; 4]; 3];

/// How much light a surface receives behind hair whose record has shares at three exponents: T_vol + d_f (T_f - T_vol),
/// what is unblocked and what the hair scatters forward, which goes on about as it came. T_f is that at 1 - a_f, between
/// the exponents linear in their logarithms; a_f is that of an inclination of 30 degrees.
pub fn passed_weights(scene: &PreparedScene) -> PassedWeights {
    let unblocked = [1.0, 0.0, 0.0, 0.0];
    if scene.terms() & TERM_GLOBAL == 0 {
        return [unblocked; 3];
    }
    let a_f = forward_average(&scene.hair, 0.5);
    let density = scene.densities[0];
    a_f.map(|a_f| {
        let p = (1.0 - a_f).clamp(P_2, 1.0);
        // The exponents are 4^0, 4^-1 and 4^-2.
        let at = -p.log2() / 2.0;
        let above = (at - 1.0).max(0.0);
        let between = at.min(1.0) - above;
        let unscattered = 1.0 - density * (between + above);
        [unscattered, density * between, density * above, 0.0]
    })
}

/// a_f of the fibre at the sine of an inclination. Where the averages of hair that is not painted are not there, it is by those of painted
/// hair at its absorption.
fn forward_average(hair: &HairMaterial, sin_theta: f32) -> [f32; 3] {
    if hair.paint().is_none() || !hair.averages().is_empty() {
        return sample_forward(&forward_table(hair.averages()), sin_theta).0;
    }
    let optics = hair.optics();
    let averages = optics.painted.averages.view();
    let row = average_row(averages.decode, optics.fibre.sigma_a, 1.0, 1.0);
    sample_painted_forward(&averages, &row, sin_theta).0
}

/// Nodes and rays of a scene.
pub struct Bounce {
    /// The centres of its voxels are the nodes.
    pub grid: Grid,
    /// The nodes that look-ups at points of the hair read, by their index.
    pub nodes: Vec<u32>,
    /// Unit vectors, the same from all nodes.
    pub rays: Vec<Vec3>,
    beside: Beside,
    meshes: Vec<MeshRays>,
    /// Of each mesh, in [`Beside::surfaces`].
    first_vertices: Vec<u32>,
}

impl Bounce {
    /// Of `scene`; `None` where there are no proxies or all are black.
    pub fn new(scene: &PreparedScene) -> Option<Bounce> {
        if !scene.has_bounce() {
            return None;
        }
        let beside = scene.beside();
        let grid = Grid::with_side(&scene.strands, SIDE);
        let mut first = beside.records().n * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE;
        let mut first_vertices = Vec::new();
        for mesh in beside.meshes() {
            first_vertices.push(first);
            first += mesh.shape.mesh.positions.len() as u32;
        }
        Some(Bounce {
            nodes: used(&grid, &scene.strands),
            grid,
            rays: rays().collect(),
            meshes: beside.meshes().iter().map(MeshRays::new).collect(),
            first_vertices,
            beside,
        })
    }

    /// As the pass reads them.
    pub fn layout(&self) -> BounceLayout {
        let proxies = self.beside.records().list().iter().enumerate();
        let grounds = proxies.filter(|(_, proxy)| proxy.kind == GROUND);
        BounceLayout {
            n_nodes: self.nodes.len() as u32,
            grounds: grounds.map(|(ix, _)| 1 << ix).sum(),
            pad: [0; 2],
        }
    }

    /// Where the rays of node `ix` start: the node, or where it is inside a proxy, the surface.
    pub fn start(&self, ix: u32) -> Vec3 {
        let [n_x, n_y, _] = self.grid.dims;
        let node = [ix % n_x, ix / n_x % n_y, ix / (n_x * n_y)];
        let mut start = self.grid.centre(node);
        for proxy in self.beside.records().list() {
            let unit = to_unit(proxy, start);
            if proxy.kind == GROUND {
                if unit.y < 0.0 {
                    start.y -= unit.y;
                }
            } else if unit.length_squared() < 1.0 {
                start = from_unit(proxy, unit.normalize_or(Vec3::Y));
            }
        }
        for mesh in self.beside.meshes() {
            start = mesh.place(start).position + mesh.offset;
        }
        start
    }

    /// Where light is found on the proxies: [`Beside::surfaces`].
    pub fn surfaces(&self) -> Vec<Surface> {
        self.beside.surfaces()
    }

    /// What a ray from `start` meets first.
    pub fn hit(&self, start: Vec3, direction: Vec3) -> BounceHit {
        self.first_hit(start, direction, None)
    }

    /// What a ray that leaves `surface` meets first.
    pub fn hit_from(&self, surface: &Surface, direction: Vec3) -> BounceHit {
        self.first_hit(surface.position, direction, Some(surface))
    }

    /// Frees what rays are followed through, once all that will be are.
    pub fn forget_meshes(&mut self) {
        self.meshes = Vec::new();
    }

    fn first_hit(&self, start: Vec3, direction: Vec3, left: Option<&Surface>) -> BounceHit {
        let mut nearest = NOTHING;
        for (ix, proxy) in self.beside.records().list().iter().enumerate() {
            // It is convex.
            let is_left = left.is_some_and(|surface| surface.is_of_record(ix));
            if is_left || !is_blocked_by(proxy, start, direction) {
                continue;
            }
            // None where the start is on it.
            let distance = entry_distance(proxy, start, direction).max(0.0);
            if distance < nearest.distance {
                let texel = texel_at(proxy, start + distance * direction);
                let surface = ix as u32 * LIGHT_MAP_SIDE * LIGHT_MAP_SIDE + texel;
                nearest = BounceHit { surface, distance };
            }
        }
        let meshes = self.meshes.iter().zip(&self.first_vertices);
        for (ix, (mesh, first)) in meshes.enumerate() {
            let is_left = left.is_some_and(|surface| surface.is_of_mesh(ix));
            let (distance, vertex) = match mesh.met(start, direction) {
                None => continue,
                // It goes below the surface that it leaves.
                Some(MetMesh::Here { .. }) if is_left => return NOTHING,
                Some(MetMesh::At { distance, .. }) if is_left && distance < LEAST_WAY => {
                    return NOTHING;
                }
                // The triangle is below it.
                Some(MetMesh::Here { position, normal }) => {
                    let above = position + 0.05 * normal;
                    match mesh.seen(above, -normal) {
                        Some((t, triangle)) => {
                            (0.0, nearest_corner(mesh, triangle, above - t * normal))
                        }
                        None => continue,
                    }
                }
                Some(MetMesh::At {
                    from,
                    distance,
                    triangle,
                }) => {
                    let position = from + distance * direction;
                    (distance, nearest_corner(mesh, triangle, position))
                }
            };
            if distance < nearest.distance {
                let surface = first + vertex;
                nearest = BounceHit { surface, distance };
            }
        }
        nearest
    }
}

/// Which lobe a surface counts for.
pub fn lobe_of(layout: &BounceLayout, surface: u32) -> usize {
    let proxy = surface / (LIGHT_MAP_SIDE * LIGHT_MAP_SIDE);
    1 - ((layout.grounds >> proxy.min(31)) & 1) as usize
}

/// The light of a lobe of power `rgb`, the sum of whose channels times unit vectors to where it comes from is
/// `vector`. Its mean cosine is that of the lobe: kappa is that of a von Mises-Fisher distribution (Banerjee et al.
/// 2005, within 2 %), and lambda = sqrt(2 / kappa).
pub fn lobe_light(rgb: [f32; 3], vector: Vec3) -> LightRecord {
    let all = rgb[0] + rgb[1] + rgb[2];
    let length = vector.length();
    let mean = (length / all.max(1e-30)).min(0.99);
    let square = mean * mean;
    let kappa = (mean * (3.0 - square) / (1.0 - square)).clamp(LEAST_KAPPA, MOST_KAPPA);
    let solid_angle = std::f32::consts::TAU * (1.0 - (-2.0 * kappa).exp()) / kappa;
    let direction = match length > 0.0 {
        true => vector / length,
        false => Vec3::Y,
    };
    LightRecord {
        direction: direction.to_array(),
        lambda: (2.0 / kappa).sqrt(),
        rgb: rgb.map(|power| power / solid_angle),
        power: rgb[0].max(rgb[1]).max(rgb[2]),
        solid_angle,
        shadow_index: NO_SLOT,
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Spread evenly.
fn rays() -> impl Iterator<Item = Vec3> {
    (0..N_RAYS).map(|ix| {
        let y = 1.0 - 2.0 * (ix as f32 + 0.5) / N_RAYS as f32;
        let (sin, cos) = (GOLDEN_ANGLE as f32 * ix as f32).sin_cos();
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * cos, y, r * sin)
    })
}

/// The nodes that look-ups at points of the hair read; all where the strands have room to move in.
fn used(grid: &Grid, strands: &Strands) -> Vec<u32> {
    let points = strands.points.iter().map(|point| Vec3::from_slice(point));
    let low = points.clone().fold(Vec3::INFINITY, Vec3::min);
    let high = points.fold(Vec3::NEG_INFINITY, Vec3::max);
    let room = (low - strands.bounds.0).max(strands.bounds.1 - high);
    if room.max_element() > 0.5 * grid.h {
        return (0..grid.n_voxels() as u32).collect();
    }
    let mut is_used = vec![false; grid.n_voxels()];
    let [n_x, n_y, n_z] = grid.dims.map(|n| n as usize);
    let origin = Vec3::from(grid.origin);
    for point in &strands.points {
        let at = ((Vec3::from_slice(point) - origin) / grid.h - 0.5).max(Vec3::ZERO);
        let [x, y, z] = at.to_array().map(|at| at as usize);
        for corner in 0..8 {
            let x = (x + (corner & 1)).min(n_x - 1);
            let y = (y + (corner >> 1 & 1)).min(n_y - 1);
            let z = (z + (corner >> 2)).min(n_z - 1);
            is_used[x + n_x * (y + n_y * z)] = true;
        }
    }
    (0..)
        .zip(is_used)
        .filter(|(_, is)| *is)
        .map(|(ix, _)| ix)
        .collect()
}

/// The texel of its light map that a place on a proxy is in.
fn texel_at(proxy: &ProxyRecord, position: Vec3) -> u32 {
    let last = LIGHT_MAP_SIDE - 1;
    // Casts saturate.
    let [x, y] = light_map_place(proxy, position).map(|at| (at as u32).min(last));
    x + y * LIGHT_MAP_SIDE
}

fn nearest_corner(mesh: &MeshRays, triangle: usize, position: Vec3) -> u32 {
    let corners = mesh.proxy().corners(triangle);
    let squares = corners.map(|corner| corner.distance_squared(position));
    let mut nearest = 0;
    for ix in 1..3 {
        if squares[ix] < squares[nearest] {
            nearest = ix;
        }
    }
    mesh.proxy().shape.mesh.triangles[triangle][nearest]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_have_the_power_and_the_mean_direction_of_what_rays_meet() {
        // All around, a half, and a cone.
        for (least, mean) in [(-1.0, 0.0), (0.0, 0.5), (0.7, 0.85)] {
            let met: Vec<Vec3> = rays().filter(|ray| -ray.y >= least).collect();
            let vector: Vec3 = met.iter().sum();
            let n = met.len() as f32;
            let light = lobe_light([0.5 * n, 0.3 * n, 0.2 * n], vector);
            assert!((light.rgb[0] * light.solid_angle / (0.5 * n) - 1.0).abs() < 1e-5);
            assert_eq!(light.power, 0.5 * n);
            let kappa = 2.0 / (light.lambda * light.lambda);
            // Of a von Mises-Fisher distribution.
            let cos = 1.0 / kappa.tanh() - 1.0 / kappa;
            println!("{least}: lambda {}, mean cosine {cos}", light.lambda);
            assert!((cos - mean).abs() < 0.04, "{least}: {cos}");
            assert!(
                mean == 0.0 || light.direction[1] < -0.99,
                "{:?}",
                light.direction
            );
        }
        let nothing = lobe_light([0.0; 3], Vec3::ZERO);
        assert_eq!((nothing.power, nothing.rgb), (0.0, [0.0; 3]));
    }
}
