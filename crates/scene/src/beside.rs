//! All that stands beside the hair, as the passes ask about it; those on the GPU by way of bits.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::wide::{LANES, Simd};

use crate::mesh::{HeightMap, MeshProxy, Placed};
use crate::proxy::{
    LIGHT_MAP_SIDE, Proxy, ProxyRecord, ProxyRecords, is_blocked, is_blocked_by, surface_normal,
    texel_position,
};
use crate::strands::Strands;
use crate::volume::Grid;

/// The proxies of a scene.
#[derive(Clone, Debug)]
pub struct Beside {
    records: ProxyRecords,
    meshes: Vec<MeshProxy>,
}

/// Where places lie to each mesh: asked once, for all lights.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// `[mesh][place]`.
    placed: Vec<Vec<Placed>>,
}

/// A place on a proxy that light is found at.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// In the world, cm.
    pub position: Vec3,
    /// Unit vector outwards.
    pub normal: Vec3,
    /// Share of light that it sends back, linear RGB.
    pub albedo: [f32; 3],
    own: Own,
}

/// Whose surface it is.
#[derive(Clone, Copy, Debug)]
enum Own {
    Proxy(usize),
    Mesh(usize),
}

impl Surface {
    /// Is it that of number `ix` of [`Beside::records`]?
    pub(crate) fn is_of_record(&self, ix: usize) -> bool {
        matches!(self.own, Own::Proxy(own) if own == ix)
    }

    /// Is it that of number `ix` of [`Beside::meshes`]?
    pub(crate) fn is_of_mesh(&self, ix: usize) -> bool {
        matches!(self.own, Own::Mesh(own) if own == ix)
    }
}

/// What stands before a light.
#[derive(Clone, Debug)]
pub struct Towards<'a> {
    records: &'a [ProxyRecord],
    direction: Vec3,
    maps: HeightMaps,
}

/// By mesh, what a light in some direction sees first of it.
pub type HeightMaps = Arc<[HeightMap]>;

impl Beside {
    /// The first [`MAX_PROXIES`](strandlight_formats::MAX_PROXIES) of `proxies`.
    pub fn new(proxies: &[Proxy], strands: &Strands) -> Beside {
        let proxies = &proxies[..proxies.len().min(strandlight_formats::MAX_PROXIES)];
        let meshes = proxies.iter().filter_map(|proxy| match proxy {
            Proxy::Mesh(mesh) => Some(mesh.clone()),
            _ => None,
        });
        Beside {
            records: ProxyRecords::new(proxies, strands),
            meshes: meshes.collect(),
        }
    }

    /// Nothing.
    pub fn none() -> Beside {
        Beside {
            records: bytemuck::Zeroable::zeroed(),
            meshes: Vec::new(),
        }
    }

    /// Is there nothing?
    pub fn is_empty(&self) -> bool {
        self.records.n == 0 && self.meshes.is_empty()
    }

    /// Those that are no meshes.
    pub fn records(&self) -> &ProxyRecords {
        &self.records
    }

    /// Those that are.
    pub fn meshes(&self) -> &[MeshProxy] {
        &self.meshes
    }

    /// Where `n` places of the world lie to the meshes.
    pub fn places(&self, n: usize, position: impl Fn(usize) -> Vec3 + Sync) -> Places {
        let of = |mesh: &MeshProxy| {
            let places = (0..n).into_par_iter().with_min_len(1024);
            places.map(|ix| mesh.place(position(ix))).collect()
        };
        Places {
            placed: self.meshes.iter().map(of).collect(),
        }
    }

    /// The middles of voxels, where they lie to the meshes.
    pub fn places_of_voxels(&self, grid: &Grid) -> Places {
        self.places(grid.n_voxels(), |ix| grid.centre(voxel(grid, ix)))
    }

    /// Where light is found: texels of the light maps, `[proxy][row][column]`, then vertices of the
    /// meshes.
    pub fn surfaces(&self) -> Vec<Surface> {
        let mut surfaces = Vec::new();
        for (own, proxy) in self.records.list().iter().enumerate() {
            for texel in 0..LIGHT_MAP_SIDE * LIGHT_MAP_SIDE {
                let texel = [texel % LIGHT_MAP_SIDE, texel / LIGHT_MAP_SIDE];
                let position = texel_position(proxy, texel);
                surfaces.push(Surface {
                    position,
                    normal: surface_normal(proxy, position),
                    albedo: proxy.albedo,
                    own: Own::Proxy(own),
                });
            }
        }
        for (own, mesh) in self.meshes.iter().enumerate() {
            let normals = mesh.shape.mesh.normals.iter();
            surfaces.extend((0..).zip(normals).map(|(ix, normal)| Surface {
                position: mesh.vertex(ix),
                normal: Vec3::from(*normal),
                albedo: mesh.albedo,
                own: Own::Mesh(own),
            }));
        }
        surfaces
    }

    /// What stands before a light in `direction`, a unit vector.
    pub fn towards(&self, direction: Vec3) -> Towards<'_> {
        let maps = self.meshes.iter().map(|mesh| mesh.height_map(direction));
        self.towards_by(direction, maps.collect())
    }

    /// The same, by the [`Towards::maps`] of this direction.
    pub fn towards_by(&self, direction: Vec3, maps: HeightMaps) -> Towards<'_> {
        Towards {
            records: self.records.list(),
            direction,
            maps,
        }
    }

    /// Which places at these positions lights in the first of `directions` do not reach, [`Towards::is_blocked`], a bit
    /// each: as many directions as there are threads, one at least.
    pub fn hidden_points(
        &self,
        directions: &[Vec3],
        positions: &[Vec3],
        places: &Places,
    ) -> Vec<Vec<u32>> {
        let n = directions.len().min(rayon::current_num_threads());
        let hidden = directions[..n].par_iter().map(|&direction| {
            let towards = self.towards(direction);
            bits(positions.len(), |ix| {
                towards.is_blocked(places, ix, positions[ix])
            })
        });
        hidden.collect()
    }

    /// What is hidden from lights in these directions: of surfaces at these places [`Towards::is_behind_other`],
    /// `[direction][surface]`, and of voxels [`Towards::is_blocked`], `[direction][voxel]`; a bit each, and whole words for
    /// each direction.
    pub fn hidden_along(
        &self,
        directions: &[[f32; 4]],
        (surfaces, of_surfaces): (&[Surface], &Places),
        (grid, of_voxels): (&Grid, &Places),
    ) -> (Vec<u32>, Vec<u32>) {
        let hidden = directions.par_iter().map(|direction| {
            let towards = self.towards(Vec3::from_slice(direction));
            let surfaces = bits(surfaces.len(), |ix| {
                towards.is_behind_other(&surfaces[ix], of_surfaces, ix)
            });
            let voxels = bits(grid.n_voxels(), |ix| {
                towards.is_blocked(of_voxels, ix, grid.centre(voxel(grid, ix)))
            });
            (surfaces, voxels)
        });
        let (surfaces, voxels): (Vec<_>, Vec<_>) = hidden.unzip();
        (surfaces.concat(), voxels.concat())
    }
}

impl Places {
    /// Place `ix` to a mesh.
    #[inline]
    pub fn at(&self, mesh: usize, ix: usize) -> Placed {
        self.placed[mesh][ix]
    }
}

impl Towards<'_> {
    /// Unit vector to the light.
    pub fn direction(&self) -> Vec3 {
        self.direction
    }

    /// What it knows of the meshes, for [`Beside::towards_by`].
    pub fn maps(&self) -> &HeightMaps {
        &self.maps
    }

    /// Whether a proxy stands between the light and `position`, which is number `ix` of `places`.
    #[inline]
    pub fn is_blocked(&self, places: &Places, ix: usize, position: Vec3) -> bool {
        is_blocked(self.records, position, self.direction) || self.is_hidden(places, ix, None)
    }

    /// [`Towards::is_blocked`] of eight places with these numbers, a bit each.
    #[inline(always)]
    pub fn are_blocked<S: Simd>(
        &self,
        simd: S,
        places: &Places,
        ix: [usize; LANES],
        position: impl Fn(usize) -> Vec3,
    ) -> u32 {
        let mut blocked = 0;
        if !self.records.is_empty() {
            for lane in 0..LANES {
                let is_blocked = is_blocked(self.records, position(lane), self.direction);
                blocked |= u32::from(is_blocked) << lane;
            }
        }
        for (map, placed) in self.maps.iter().zip(&places.placed) {
            let [a, b, c, d, e, f, g, h] = ix;
            let [a, b, c, d] = [&placed[a], &placed[b], &placed[c], &placed[d]];
            let [e, f, g, h] = [&placed[e], &placed[f], &placed[g], &placed[h]];
            blocked |= map.hidden(simd, [a, b, c, d, e, f, g, h], 0);
        }
        blocked
    }

    /// [`Towards::is_behind_other`] of at most eight `surfaces` from number `first` of `places` on, a bit each.
    #[inline(always)]
    pub fn are_behind_other<S: Simd>(
        &self,
        simd: S,
        surfaces: &[Surface],
        places: &Places,
        first: usize,
    ) -> u32 {
        let mut behind = 0;
        if !self.records.is_empty() {
            for (lane, surface) in surfaces.iter().enumerate() {
                behind |= u32::from(self.is_behind_record(surface)) << lane;
            }
        }
        for (mesh, (map, placed)) in self.maps.iter().zip(&places.placed).enumerate() {
            let mut eight = [&placed[first]; LANES];
            let mut are_own = 0;
            for (lane, surface) in surfaces.iter().enumerate() {
                eight[lane] = &placed[first + lane];
                are_own |= u32::from(surface.is_of_mesh(mesh)) << lane;
            }
            behind |= map.hidden(simd, eight, are_own);
        }
        behind
    }

    /// Whether another proxy stands before `surface`, which is number `ix` of `places`, or another
    /// part of its own mesh.
    #[inline]
    pub fn is_behind_other(&self, surface: &Surface, places: &Places, ix: usize) -> bool {
        self.is_behind_record(surface) || self.is_hidden(places, ix, Some(surface))
    }

    /// Whether another proxy that is no mesh does.
    fn is_behind_record(&self, surface: &Surface) -> bool {
        let mut others = self.records.iter().enumerate();
        others.any(|(ix, proxy)| {
            !surface.is_of_record(ix) && is_blocked_by(proxy, surface.position, self.direction)
        })
    }

    /// Whether a mesh does; of that on whose `surface` the place is, only what stands above it.
    #[inline]
    fn is_hidden(&self, places: &Places, ix: usize, surface: Option<&Surface>) -> bool {
        let mut maps = self.maps.iter().enumerate();
        maps.any(|(mesh, map)| {
            let placed = places.at(mesh, ix);
            match surface.is_some_and(|surface| surface.is_of_mesh(mesh)) {
                true => placed.is_hidden_above(map, self.direction),
                false => placed.is_hidden(map, self.direction),
            }
        })
    }
}

/// The voxel with this number in their order.
fn voxel(grid: &Grid, ix: usize) -> [u32; 3] {
    let ([n_x, n_y, _], ix) = (grid.dims, ix as u32);
    [ix % n_x, ix / n_x % n_y, ix / (n_x * n_y)]
}

/// A bit for each of `n`, the lowest of a word first.
fn bits(n: usize, is_set: impl Fn(usize) -> bool + Sync) -> Vec<u32> {
    let word = |word: usize| {
        let of_word = 32 * word..n.min(32 * (word + 1));
        of_word.fold(0, |bits, ix| bits | u32::from(is_set(ix)) << (ix % 32))
    };
    let words = (0..n.div_ceil(32)).into_par_iter().with_min_len(64);
    words.map(word).collect()
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use strandlight_scattering::wide::{Level, dispatch};

    use super::*;
    use crate::mesh::MeshShape;
    use crate::mesh::tests::{ellipsoid, unit};

    #[test]
    fn an_ellipsoid_of_triangles_hides_what_an_ellipsoid_hides() {
        let radii = Vec3::new(7.5, 11.5, 9.5);
        let offset = Vec3::new(1.0, -2.0, 3.0);
        let exact = Proxy::Ellipsoid {
            centre: offset,
            radii,
            turn: Quat::IDENTITY,
            albedo: [0.5; 3],
        };
        let mesh = Proxy::Mesh(MeshProxy {
            shape: Arc::new(MeshShape::new(ellipsoid(radii, 64))),
            offset,
            albedo: [0.5; 3],
        });
        let [exact, mesh] = [exact, mesh].map(|proxy| Beside::new(&[proxy], &Strands::default()));
        assert!(mesh.records().n == 0 && exact.meshes().is_empty());
        // Inside, on the surface, and outside. Deep inside, the nearest point of the surface is
        // another than the one that the ellipsoid takes.
        for (r, most) in [
            (0.9, 0.02),
            (0.97, 0.01),
            (1.0, 0.02),
            (1.05, 0.02),
            (1.5, 0.01),
        ] {
            let position = |ix: usize| offset + radii * r * unit(ix as u32);
            let places = [&exact, &mesh].map(|beside| beside.places(400, position));
            let (mut n_hidden, mut n_wrong) = (0, 0);
            for direction in (0..400).step_by(13).map(unit) {
                let towards = [&exact, &mesh].map(|beside| beside.towards(direction));
                for ix in 0..400 {
                    let [wanted, found] = [0, 1]
                        .map(|of: usize| towards[of].is_blocked(&places[of], ix, position(ix)));
                    let eight = std::array::from_fn(|lane| (ix + 7 * lane) % 400);
                    for (of, is_blocked) in [wanted, found].into_iter().enumerate() {
                        let blocked = dispatch!(Level::new(), simd => {
                            let position = |lane: usize| position(eight[lane]);
                            towards[of].are_blocked(simd, &places[of], eight, position)
                        });
                        assert_eq!(blocked & 1 == 1, is_blocked, "{of} {ix}");
                        let last = (eight[7], position(eight[7]));
                        let last = towards[of].is_blocked(&places[of], last.0, last.1);
                        assert_eq!(blocked >> 7 == 1, last, "{of} {ix}");
                    }
                    n_hidden += u32::from(wanted);
                    n_wrong += u32::from(found != wanted);
                }
            }
            let wrong = n_wrong as f32 / (31.0 * 400.0);
            println!("at {r}: {n_hidden} hidden, {wrong} wrong");
            assert!(wrong < most && n_hidden > 500, "{r}: {wrong}");
        }
    }

    /// On surfaces of two meshes and of an ellipsoid before them, eight at a time, of both meshes too.
    #[test]
    fn eight_surfaces_are_behind_others_as_one_is() {
        let mesh = |n: u32, offset: Vec3| {
            Proxy::Mesh(MeshProxy {
                shape: Arc::new(MeshShape::new(ellipsoid(Vec3::new(7.0, 9.0, 8.0), n))),
                offset,
                albedo: [0.5; 3],
            })
        };
        let meshes = [mesh(10, Vec3::ZERO), mesh(9, Vec3::new(-12.0, 3.0, 2.0))];
        let ball = Proxy::Ellipsoid {
            centre: Vec3::new(10.0, 0.0, 0.0),
            radii: Vec3::splat(4.0),
            turn: Quat::IDENTITY,
            albedo: [0.5; 3],
        };
        let [first, second] = meshes;
        let beside = Beside::new(&[ball, first, second], &Strands::default());
        let surfaces = beside.surfaces();
        let mut eights = surfaces.chunks(LANES);
        let are_of_both =
            |eight: &[Surface]| [0, 1].map(|mesh| eight.iter().any(|of| of.is_of_mesh(mesh)));
        assert!(eights.any(|eight| are_of_both(eight) == [true; 2]));
        let places = beside.places(surfaces.len(), |ix| surfaces[ix].position);
        let (mut n_behind, mut n_own) = ([0; 2], [0; 2]);
        for direction in (0..400).step_by(17).map(unit) {
            let towards = beside.towards(direction);
            for (eight, of_eight) in surfaces.chunks(LANES).enumerate() {
                let first = LANES * eight;
                let found = dispatch!(Level::new(), simd => {
                    towards.are_behind_other(simd, of_eight, &places, first)
                });
                for (lane, surface) in of_eight.iter().enumerate() {
                    let is_behind = towards.is_behind_other(surface, &places, first + lane);
                    assert_eq!(
                        found >> lane & 1 == 1,
                        is_behind,
                        "{direction} {first} {lane}"
                    );
                    let own = usize::from(!surface.is_of_record(0));
                    n_behind[own] += u32::from(is_behind);
                    n_own[own] += 1;
                }
            }
        }
        // Some of either are, and most are not.
        for own in [0, 1] {
            assert!(
                n_behind[own] > 0 && n_behind[own] < n_own[own] / 2,
                "{n_behind:?} {n_own:?}"
            );
        }
    }
}
