//! Light that arrives at the proxies. Twin of `shaders/pass/proxy_light.wgsl`.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::{UVec3, Vec3};
use rayon::prelude::*;
use strandlight_scattering::closed_form::{PackedRecord, irradiance, pass_through, unpack_record};
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

    /// Irradiance of a light of amplitude 1 behind the hair at the three exponents of its records, by surface; `packed` are its records by voxel,
    /// `voxels` the places of the voxels, and `maps` those of its directions where they are known.
    pub fn irradiance(
        &self,
        (beside, maps): (&Beside, &[HeightMaps]),
        grid: &Grid,
        (light, sweeps): (&LightRecord, &[[f32; 4]]),
        packed: &[PackedRecord],
        voxels: &Places,
    ) -> Vec<[f32; 3]> {
        // Black ones send nothing back whatever they receive.
        let is_black = |surface: &Surface| surface.albedo == [0.0; 3];
        if self.list.iter().all(is_black) {
            return vec![[0.0; 3]; self.list.len()];
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
        let mut n_open: Vec<AtomicU8> = Vec::new();
        n_open.resize_with(grid.n_voxels(), || AtomicU8::new(UNKNOWN));
        let from = From {
            grid,
            towards: &towards,
            packed,
            voxels,
            n_open: &n_open,
        };
        self.list
            .par_iter()
            .enumerate()
            .with_min_len(64)
            .map(|(ix, surface)| {
                if is_black(surface) {
                    return [0.0; 3];
                }
                let cos = surface.normal.dot(Vec3::from(light.direction));
                let open = irradiance(cos, light.lambda);
                let shares = from.share_of_light(surface, &self.places, ix, self.depths[ix]);
                shares.map(|share| open * share)
            })
            .collect()
    }
}

/// A light, and what it passes on its way to the proxies.
struct From<'a> {
    grid: &'a Grid,
    /// By direction of the light.
    towards: &'a [Towards<'a>],
    /// By voxel.
    packed: &'a [PackedRecord],
    voxels: &'a Places,
    /// By voxel, from how many directions light comes by the proxies; [`UNKNOWN`] until it is asked.
    n_open: &'a [AtomicU8],
}

/// More directions than a light has.
const UNKNOWN: u8 = u8::MAX;

impl From<'_> {
    /// How much of a light's irradiance in the open there is on `surface`, number `ix` of `places`, at three exponents.
    /// `depths` are those of the hair on the surface.
    fn share_of_light(
        &self,
        surface: &Surface,
        places: &Places,
        ix: usize,
        depths: [f32; 2],
    ) -> [f32; 3] {
        let mut inside = None;
        let (mut above, mut arriving) = (0.0, [0.0; 3]);
        for towards in self.towards {
            let d = towards.direction();
            let weight = surface.normal.dot(d).max(LEAST_COSINE);
            above += weight;
            if towards.is_behind_other(surface, places, ix) {
                continue;
            }
            let share_at = |position: Vec3| self.share_at(grid_position(self.grid, position));
            let shares = match self.grid.span_in_grid(surface.position, d, 0.5) {
                None => [1.0; 3],
                // The same place for all directions.
                Some([0.0, _]) => *inside.get_or_insert_with(|| {
                    let above = |(height, depth): (f32, f32)| {
                        let height = height * self.grid.h;
                        let [a, b, c] = share_at(surface.position + surface.normal * height)?;
                        let [a, b, c, _] = pass_through([a, b, c, 0.0], depth, 0.0);
                        Some([a, b, c])
                    };
                    let mut heights = HEIGHTS.into_iter().zip(depths);
                    heights.find_map(above).unwrap_or_default()
                }),
                Some([entry, _]) => share_at(surface.position + d * entry).unwrap_or_default(),
            };
            for (arriving, share) in arriving.iter_mut().zip(shares) {
                *arriving += weight * share;
            }
        }
        arriving.map(|arriving| arriving / above.max(LEAST_COSINE))
    }

    /// Directions of the light that no proxy blocks at a voxel.
    fn n_open(&self, voxel: UVec3) -> f32 {
        let ix = voxel_index(self.grid, voxel.to_array());
        let known = self.n_open[ix].load(Ordering::Relaxed);
        if known != UNKNOWN {
            return f32::from(known);
        }
        let centre = self.grid.centre(voxel.to_array());
        let is_open = |towards: &&Towards| !towards.is_blocked(self.voxels, ix, centre);
        // Some at most: `MAX_DIRECTIONS`.
        let n = self.towards.iter().filter(is_open).count() as u8;
        self.n_open[ix].store(n, Ordering::Relaxed);
        f32::from(n)
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
            let n_open = self.n_open(voxel);
            if n_open > 0.0 {
                let w = Vec3::select(offset.cmpeq(UVec3::ONE), f, 1.0 - f);
                let weight = w.x * w.y * w.z;
                let record = unpack_record(&self.packed[voxel_index(self.grid, voxel.to_array())]);
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
