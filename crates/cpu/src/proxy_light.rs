//! Light that arrives at the proxies. Twin of `shaders/pass/proxy_light.wgsl`.

use glam::{UVec3, Vec3};
use rayon::prelude::*;
use strandlight_scattering::closed_form::{Irradiance, PackedRecord, pass_through, unpack_record};
use strandlight_scattering::wide::{LANES, Level, dispatch};
use strandlight_scene::beside::{Beside, HeightMaps, Places, Surface, Towards};
use strandlight_scene::bounce::BEYOND;
use strandlight_scene::scene::LightRecord;
use strandlight_scene::volume::{Grid, SELF_LIFT, extinction};

use super::voxelise::{grid_position, voxel_index};

/// What directions at or below the horizon weigh, so that there is a mean where all of them are.
const LEAST_COSINE: f32 = 1e-3;

/// How far above the surface records are looked up where none beside it sees the light, voxels: a
/// wide light is seen a little beyond the horizon of its middle.
const HIGHER: f32 = 3.0;

/// Where records are looked up above a surface, voxels: the first that has some.
const HEIGHTS: [f32; 2] = [SELF_LIFT, HIGHER];

/// Where light is found on the proxies of a scene.
pub(super) struct Surfaces {
    list: Vec<Surface>,
    places: Places,
    /// By surface, [`depth_on_surface`] from the lift and from [`HIGHER`].
    depths: Vec<[f32; 2]>,
}

impl Surfaces {
    /// Those of all that stands `beside` the hair of a shadow volume.
    pub fn new(beside: &Beside, grid: &Grid, volume: &[[f32; 8]]) -> Surfaces {
        let list = beside.surfaces();
        let depths = |surface: &Surface| {
            HEIGHTS.map(|height| {
                depth_on_surface(
                    (grid, volume),
                    surface.position,
                    surface.normal,
                    height * grid.h,
                )
            })
        };
        Surfaces {
            places: beside.places(list.len(), |ix| list[ix].position),
            depths: list.par_iter().map(depths).collect(),
            list,
        }
    }

    /// All of them, as in [`Beside::surfaces`].
    pub fn list(&self) -> &[Surface] {
        &self.list
    }

    /// Irradiance of a light of amplitude 1 behind the hair at the three exponents of its records, by surface. Of voxels are its
    /// records and [from how many directions](super::transmittance::Swept::n_open) it comes; `maps` are those of its directions
    /// where they are known.
    pub fn irradiance(
        &self,
        (beside, maps): (&Beside, &[HeightMaps]),
        grid: &Grid,
        (light, sweeps): (&LightRecord, &[[f32; 4]]),
        (packed, n_open): (&[PackedRecord], &[u8]),
    ) -> Vec<[f32; 3]> {
        // Black ones send nothing back whatever they receive.
        let is_black = |surface: &Surface| surface.albedo == [0.0; 3];
        let mut arriving = vec![[0.0; 3]; self.list.len()];
        if self.list.iter().all(is_black) {
            return arriving;
        }
        let first = light.first_sweep as usize;
        let directions = &sweeps[first..first + light.n_sweeps as usize];
        let towards_direction = |(k, d): (usize, &[f32; 4])| {
            let d = Vec3::from_slice(d);
            match maps.get(k) {
                Some(maps) => beside.towards_by(d, maps.clone()),
                None => beside.towards(d),
            }
        };
        let towards: Vec<Towards> = directions
            .par_iter()
            .enumerate()
            .map(|(k, d)| towards_direction((k, d)))
            .collect();
        let from = From {
            grid,
            towards: &towards,
            packed,
            n_open,
        };
        let open = Irradiance::new(light.lambda);
        let direction = Vec3::from(light.direction);
        let level = Level::new();
        let eights = arriving.par_chunks_mut(LANES).enumerate();
        eights.with_min_len(16).for_each(|(eight, arriving)| {
            let first = LANES * eight;
            let surfaces = &self.list[first..first + arriving.len()];
            let behind = |towards: &Towards| {
                dispatch!(level, simd => {
                    towards.are_behind_other(simd, surfaces, &self.places, first)
                })
            };
            let behind: Vec<u32> = towards.iter().map(behind).collect();
            for (lane, (arriving, surface)) in arriving.iter_mut().zip(surfaces).enumerate() {
                if !is_black(surface) {
                    let open = open.at(surface.normal.dot(direction));
                    let is_behind = behind.iter().map(|bits| bits >> lane & 1 == 1);
                    let shares = from.share_of_light(surface, is_behind, self.depths[first + lane]);
                    *arriving = shares.map(|share| open * share);
                }
            }
        });
        arriving
    }
}

/// A light, and what it passes on its way to the proxies.
struct From<'a> {
    grid: &'a Grid,
    /// By direction of the light.
    towards: &'a [Towards<'a>],
    /// By voxel.
    packed: &'a [PackedRecord],
    n_open: &'a [u8],
}

impl From<'_> {
    /// How much of a light's irradiance in the open there is on `surface` at three exponents, where it `is_behind` others by
    /// direction. `depths` are those of the hair on the surface.
    fn share_of_light(
        &self,
        surface: &Surface,
        is_behind: impl Iterator<Item = bool>,
        depths: [f32; 2],
    ) -> [f32; 3] {
        let mut inside = None;
        let (mut above, mut arriving) = (0.0, [0.0; 3]);
        for (towards, is_behind) in self.towards.iter().zip(is_behind) {
            let d = towards.direction();
            let weight = surface.normal.dot(d).max(LEAST_COSINE);
            above += weight;
            if is_behind {
                continue;
            }
            let share_at = |position: Vec3| self.share_at(grid_position(self.grid, position));
            // The same place for all directions.
            let shares =
                inside.unwrap_or_else(|| match self.grid.span_in_grid(surface.position, d, 0.5) {
                    None => [1.0; 3],
                    Some([0.0, _]) => {
                        let above = |(height, depth): (f32, f32)| {
                            let height = height * self.grid.h;
                            let [a, b, c] = share_at(surface.position + surface.normal * height)?;
                            let [a, b, c, _] = pass_through([a, b, c, 0.0], depth, 0.0);
                            Some([a, b, c])
                        };
                        let mut heights = HEIGHTS.into_iter().zip(depths);
                        *inside.insert(heights.find_map(above).unwrap_or_default())
                    }
                    Some([entry, _]) => share_at(surface.position + d * entry).unwrap_or_default(),
                });
            for (arriving, share) in arriving.iter_mut().zip(shares) {
                *arriving += weight * share;
            }
        }
        arriving.map(|arriving| arriving / above.max(LEAST_COSINE))
    }

    /// Shares that hair leaves of the light at three exponents, by its records around `g`. They hold the mean over all
    /// directions, none coming through proxies, and each voxel has a horizon of its own: voxels count
    /// by the directions that are open there, those without any not at all.
    fn share_at(&self, g: Vec3) -> Option<[f32; 3]> {
        let base = g.as_uvec3();
        let f = g - base.as_vec3();
        let (mut sums, mut weights) = ([0.0; 3], 0.0);
        for corner in 0..8_u32 {
            let offset = UVec3::new(corner & 1, (corner >> 1) & 1, corner >> 2);
            let voxel = base + offset;
            let ix = voxel_index(self.grid, voxel.to_array());
            let n_open = f32::from(self.n_open[ix]);
            if n_open > 0.0 {
                let w = Vec3::select(offset.cmpeq(UVec3::ONE), f, 1.0 - f);
                let weight = w.x * w.y * w.z;
                let record = unpack_record(&self.packed[ix]);
                for (sum, share) in sums.iter_mut().zip(record.shares) {
                    *sum += weight * share * (self.towards.len() as f32 / n_open);
                }
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sums.map(|sum| (sum / f32::max(weights, 1e-20)).min(1.0)))
    }
}

/// Optical depth along the normal of the hair on a surface, from `height` cm above it: strands that lie on it are
/// smeared over voxels on both sides of it.
fn depth_on_surface(
    (grid, volume): (&Grid, &[[f32; 8]]),
    position: Vec3,
    normal: Vec3,
    height: f32,
) -> f32 {
    let distance = height + BEYOND * grid.h;
    let n = (distance / grid.h).ceil();
    let part = distance / n;
    let dims = Vec3::from(grid.dims.map(|n| n as f32));
    let mut depth = 0.0;
    for ix in 0..n as u32 {
        let position = position + normal * (height - (ix as f32 + 0.5) * part);
        let voxel = ((position - Vec3::from(grid.origin)) / grid.h).floor();
        if voxel.cmpge(Vec3::ZERO).all() && voxel.cmplt(dims).all() {
            let voxel = &volume[voxel_index(grid, voxel.as_uvec3().to_array())];
            depth += part * extinction(voxel, normal)[0];
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::super::voxelise::even_layer;
    use super::*;

    /// Hair that lies on a surface is in the voxels above and below it, and is before the surface.
    #[test]
    fn hair_on_a_surface_covers_it() {
        let (grid, volume) = even_layer(5);
        let on = |y: f32, height: f32| {
            let position = Vec3::new(1.0, y, 1.0);
            depth_on_surface((&grid, &volume), position, Vec3::Y, height)
        };
        // Hair along 0.25 cm above the surface and BEYOND below it.
        let expected = (0.25 + BEYOND * grid.h) * 6.0_f32.sqrt();
        assert!((on(2.0, 0.25) / expected - 1.0).abs() < 1e-5);
        // Above the hair, and beside the volume.
        assert_eq!(on(3.25, 0.25), 0.0);
        assert_eq!(on(-9.0, 0.25), 0.0);
    }
}
