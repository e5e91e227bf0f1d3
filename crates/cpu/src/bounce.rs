//! Bounce light at the nodes of its grid. Twin of `shaders/pass/bounce.wgsl`.

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::{
    LEAST_SHARE, ShadowRecord, depth_of_share, pass_through,
};
use strandlight_scene::PreparedScene;
use strandlight_scene::bounce::{
    BEYOND, Bounce, BounceLayout, N_LOBES, NO_SURFACE, PassedWeights, lobe_light, lobe_of,
};
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::{Grid, extinction};

use super::interreflection::Interreflection;
use super::proxies::Proxies;
use super::voxelise::{grid_position, voxel_index};

/// What hair lets pass where there is none.
const OPEN: [f32; 4] = [1.0, 1.0, 1.0, 0.0];

/// Optical depth from which on a ray is not followed.
const MOST_DEPTH: f32 = 100.0;

/// Solid angle of a ray, sr.
const OF_RAY: f32 = 0.261_799_4;

/// A ray that meets a proxy.
#[derive(Clone, Copy)]
struct Passed {
    /// Its number among the rays of a node.
    ray: u32,
    /// Index of the surface it meets.
    surface: u32,
    /// What the hair before it lets pass: see [`pass_through`].
    here: [f32; 4],
}

/// Nodes whose rays are found at a time.
const NODES_AT_ONCE: usize = 512;

/// What rays from the nodes meet, and the hair before it: the same for lights of any colour and for any fibre.
pub(super) struct BounceRays {
    bounce: Bounce,
    layout: BounceLayout,
    /// Of the nodes that are found, one after the other, and where those of each end.
    passed: Vec<Passed>,
    ends: Vec<usize>,
    /// Rays between the proxies, where these light each other.
    between: Option<Interreflection>,
}

/// Of a lobe at a node: of the hair that its light passes, -ln of the three shares, whose interpolation holds on to
/// the exponential, and the sine of the inclination; its power, rgb, and 0; the sum of the channels times unit vectors to where they come from, and 0. Powers are times the view's radiance
/// scale.
type Lobe = [[f32; 4]; 3];

/// Bounce light at the nodes.
pub(super) struct BounceLight {
    grid: Grid,
    /// By voxel of the grid.
    nodes: Vec<[Lobe; N_LOBES]>,
}

impl BounceRays {
    /// Of `scene`, nothing found yet; `None` where nothing is sent back.
    pub fn new(scene: &PreparedScene) -> Option<BounceRays> {
        let bounce = Bounce::new(scene)?;
        let is_between = scene.has_interreflection();
        Some(BounceRays {
            between: is_between.then(|| Interreflection::new(&bounce)),
            layout: bounce.layout(),
            passed: Vec::new(),
            ends: Vec::with_capacity(bounce.nodes.len()),
            bounce,
        })
    }

    /// Finds what some more rays meet, and the hair of `volume` before it.
    pub fn step(&mut self, grid: &Grid, volume: &[[f32; 8]]) {
        let bounce = &self.bounce;
        if let Some(between) = self.between.as_mut().filter(|between| !between.is_found()) {
            between.step(bounce, |start, direction, distance| {
                // Hair may lie on the surface that it leaves, too.
                let before = BEYOND * grid.h;
                let start = start - before * direction;
                let distance = before + distance;
                let [_, _, passing, _] = pass_hair(grid, volume, start, direction, distance);
                passing
            });
            return;
        }
        let of_node = |node: &u32| {
            let start = bounce.start(*node);
            let rays = (0..).zip(&bounce.rays);
            let passed = rays.filter_map(|(ray, &direction)| {
                let hit = bounce.hit(start, direction);
                (hit.surface != NO_SURFACE).then(|| Passed {
                    ray,
                    surface: hit.surface,
                    here: pass_hair(grid, volume, start, direction, hit.distance),
                })
            });
            passed.collect()
        };
        let missing = &bounce.nodes[self.ends.len()..];
        let missing = &missing[..missing.len().min(NODES_AT_ONCE)];
        let found: Vec<Vec<Passed>> = missing.par_iter().map(of_node).collect();
        for passed in found {
            self.passed.extend(passed);
            self.ends.push(self.passed.len());
        }
        if self.ends.len() == bounce.nodes.len() {
            self.passed.shrink_to_fit();
            self.bounce.forget_meshes();
        }
    }

    /// Is it known of all rays?
    pub fn is_found(&self) -> bool {
        let is_between = self.between.as_ref().is_none_or(Interreflection::is_found);
        is_between && self.ends.len() == self.bounce.nodes.len()
    }

    /// Adds what `proxies`, in the light of the lights alone, send to each other.
    pub fn reflect(&self, passed: &PassedWeights, proxies: &mut Proxies) {
        if let Some(between) = self.between.as_ref().filter(|between| between.is_found()) {
            between.reflect(passed, proxies.at_surfaces_mut());
        }
    }

    /// The light where the surfaces send back so much, rgb times the view's radiance scale.
    pub fn light(&self, sent_back: &[[f32; 3]]) -> BounceLight {
        let of_node = |node: usize| {
            let first = node.checked_sub(1).map_or(0, |before| self.ends[before]);
            self.lobes(&self.passed[first..self.ends[node]], sent_back)
        };
        let lobes: Vec<_> = (0..self.ends.len()).into_par_iter().map(of_node).collect();
        let grid = self.bounce.grid;
        let mut nodes = vec![[Lobe::default(); N_LOBES]; grid.n_voxels()];
        for (node, lobes) in self.bounce.nodes.iter().zip(lobes) {
            nodes[*node as usize] = lobes;
        }
        BounceLight { grid, nodes }
    }

    fn lobes(&self, passed: &[Passed], sent_back: &[[f32; 3]]) -> [Lobe; N_LOBES] {
        let mut lobes = [Lobe::default(); N_LOBES];
        let mut depths = [0.0; N_LOBES];
        for ray in passed {
            let rgb = sent_back[ray.surface as usize].map(|radiance| radiance * OF_RAY);
            let all = rgb[0] + rgb[1] + rgb[2];
            let ix = lobe_of(&self.layout, ray.surface);
            let [record, power, vector] = &mut lobes[ix];
            for (sum, value) in record.iter_mut().zip(ray.here) {
                *sum += all * value;
            }
            for (sum, value) in power.iter_mut().zip(rgb) {
                *sum += value;
            }
            let direction = self.bounce.rays[ray.ray as usize];
            for (sum, value) in vector.iter_mut().zip(direction.to_array()) {
                *sum += all * value;
            }
            depths[ix] += all * depth_of_share(ray.here[2]);
        }
        for ([record, power, _], depth) in lobes.iter_mut().zip(depths) {
            let all = power[0] + power[1] + power[2];
            let sin_2 = record[3] / depth.max(1e-6 * all).max(1e-30);
            *record = match all > 0.0 {
                true => record.map(|sum| -(sum / all).max(LEAST_SHARE).ln()),
                false => [0.0; 4],
            };
            record[3] = sin_2.clamp(0.0, 1.0).sqrt();
        }
        lobes
    }
}

impl BounceLight {
    /// Bytes of what is known at the nodes.
    pub fn bytes(&self) -> u64 {
        size_of_val(&self.nodes[..]) as u64
    }

    /// The lights at a place, their amplitudes over `scale`, the view's radiance scale; and their records.
    #[inline(always)]
    pub fn lights_at(&self, position: Vec3, scale: f32) -> [(LightRecord, ShadowRecord); N_LOBES] {
        let g = grid_position(&self.grid, position);
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        let mut lobes = [Lobe::default(); N_LOBES];
        for corner in 0..8_u32 {
            let offset = [corner & 1, (corner >> 1) & 1, corner >> 2];
            let mut weight = 1.0;
            for (axis, offset) in offset.iter().enumerate() {
                weight *= if *offset == 1 { f[axis] } else { 1.0 - f[axis] };
            }
            let node = [base.x + offset[0], base.y + offset[1], base.z + offset[2]];
            let numbers = self.nodes[voxel_index(&self.grid, node)].as_flattened();
            let sums = lobes.as_flattened_mut().as_flattened_mut();
            for (sum, number) in sums.iter_mut().zip(numbers.as_flattened()) {
                *sum += weight * number;
            }
        }
        lobes.map(
            |[[a, b, c, sin_theta], [red, green, blue, _], [x, y, z, _]]| {
                let rgb = [red, green, blue].map(|power| power / scale);
                let record = ShadowRecord {
                    shares: [a, b, c].map(|depth: f32| (-depth).exp()),
                    sin_theta,
                };
                (lobe_light(rgb, Vec3::new(x, y, z) / scale), record)
            },
        )
    }
}

/// What hair lets pass on `distance` cm from `start`, to a surface on which hair may lie.
fn pass_hair(
    grid: &Grid,
    volume: &[[f32; 8]],
    start: Vec3,
    direction: Vec3,
    distance: f32,
) -> [f32; 4] {
    let Some([entry, exit]) = grid.span_in_grid(start, direction, 0.0) else {
        return OPEN;
    };
    let exit = exit.min(distance + BEYOND * grid.h);
    if exit <= entry {
        return OPEN;
    }
    let origin = Vec3::from(grid.origin);
    let n = ((exit - entry) / grid.h).ceil();
    let step = (exit - entry) / n;
    let last = Vec3::from(grid.dims.map(|n| n as f32 - 1.0));
    let (mut depth, mut sin_2_depth) = (0.0, 0.0);
    for ix in 0..n as u32 {
        let position = start + direction * (entry + (ix as f32 + 0.5) * step);
        let at = ((position - origin) / grid.h)
            .floor()
            .clamp(Vec3::ZERO, last);
        let voxel = &volume[voxel_index(grid, at.as_uvec3().to_array())];
        let [sigma_t, sin_2] = extinction(voxel, direction);
        depth += sigma_t * step;
        sin_2_depth += sigma_t * step * sin_2;
        if depth > MOST_DEPTH {
            break;
        }
    }
    let [a, b, c, _] = pass_through(OPEN, depth, 0.0);
    [a, b, c, sin_2_depth]
}

#[cfg(test)]
mod tests {
    use super::super::voxelise::even_layer;
    use super::*;

    /// Strands that lie on a surface are in voxels below it as well, and are before what it sends back.
    #[test]
    fn hair_that_is_smeared_below_a_surface_counts() {
        let (grid, volume) = even_layer(4);
        let start = Vec3::new(1.0, 3.0, 1.0);
        // The surface is where the hair ends.
        let [share, ..] = pass_hair(&grid, &volume, start, Vec3::NEG_Y, 1.0);
        let expected = (-BEYOND * grid.h * 6.0_f32.sqrt()).exp();
        assert!((share - expected).abs() < 1e-3, "{share} {expected}");
        let above = pass_hair(&grid, &volume, start, Vec3::NEG_Y, 0.4);
        assert_eq!(above, OPEN);
    }
}
