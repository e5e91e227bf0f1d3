//! Interreflection: light that proxies send to each other.
//!
//! From every place at which light is found on them rays go out, spread by their cosine to its normal, so that each stands
//! for as much of the light that arrives. What the places that they meet send back arrives at this one, less what the hair
//! between takes. Here is what depends on proxies alone, for both renderers.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use strandlight_scattering::random::GOLDEN_ANGLE;

use crate::beside::Surface;
use crate::bounce::{Bounce, NO_SURFACE};

/// Rays from a place.
pub const N_RAYS: usize = 48;

/// How often light goes from proxy to proxy: an even number, as the pass on the device writes to and fro.
pub const N_ROUNDS: usize = 4;

const _: () = assert!(N_ROUNDS.is_multiple_of(2));

/// Most rays in all: where there are many places, each has fewer.
pub const MOST_RAYS: usize = 4 << 20;

/// What a ray from a place meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetSurface {
    /// Index in [`Bounce::surfaces`].
    pub surface: u32,
    /// Unit vector along the ray.
    pub direction: Vec3,
    /// How far away, cm.
    pub distance: f32,
}

/// A place that light from others arrives at; mirrored by `ReflectingSurface` in `shaders/pass/bounce.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ReflectingSurface {
    /// In the world, cm.
    pub position: [f32; 3],
    /// First of what its rays meet.
    pub first: u32,
    /// What a ray stands for: the albedo over the number of rays, linear RGB.
    pub weight: [f32; 3],
    /// How many of its rays meet something.
    pub n: u32,
}

strandlight_scattering::mirrors! {
    ReflectingSurface as "ReflectingSurface" in "pass/bounce" { position, first, weight, n }
}

/// The rays from the places of a scene.
pub struct SurfaceRays {
    /// [`Bounce::surfaces`].
    pub surfaces: Vec<Surface>,
    /// About a normal along z.
    directions: Vec<Vec3>,
}

impl SurfaceRays {
    /// Those of all that `bounce` has, at most so many in all, or one a place.
    pub fn new(bounce: &Bounce, most: usize) -> SurfaceRays {
        let surfaces = bounce.surfaces();
        let n = (most.min(MOST_RAYS) / surfaces.len().max(1)).clamp(1, N_RAYS);
        let direction = |ix: usize| {
            let square = (ix as f32 + 0.5) / n as f32;
            let (sin, cos) = (GOLDEN_ANGLE as f32 * ix as f32).sin_cos();
            let r = square.sqrt();
            Vec3::new(r * cos, r * sin, (1.0 - square).sqrt())
        };
        SurfaceRays {
            directions: (0..n).map(direction).collect(),
            surfaces,
        }
    }

    /// Do rays meet the same as those of `other`?
    pub fn meet_the_same_as(&self, other: &SurfaceRays) -> bool {
        let key = |surface: &Surface| (surface.position, surface.normal, is_black(surface));
        self.directions.len() == other.directions.len()
            && (self.surfaces.iter().map(key)).eq(other.surfaces.iter().map(key))
    }

    /// The share of the light of an even sky that a ray stands for.
    pub fn weight(&self) -> f32 {
        1.0 / self.directions.len() as f32
    }

    /// [`ReflectingSurface::weight`].
    pub fn weight_of(&self, surface: &Surface) -> [f32; 3] {
        surface.albedo.map(|albedo| albedo * self.weight())
    }

    /// What the rays from place `ix` meet that sends light back; nothing where the place itself sends none.
    pub fn met(&self, bounce: &Bounce, ix: usize) -> Vec<MetSurface> {
        let surface = &self.surfaces[ix];
        if is_black(surface) {
            return Vec::new();
        }
        let turn = frame_of(surface.normal);
        let met = self.directions.iter().filter_map(|&direction| {
            let direction = turn * direction;
            let hit = bounce.hit_from(surface, direction);
            let is_met = hit.surface != NO_SURFACE;
            (is_met && !is_black(&self.surfaces[hit.surface as usize])).then_some(MetSurface {
                surface: hit.surface,
                direction,
                distance: hit.distance,
            })
        });
        met.collect()
    }

    /// All places, and what their rays meet.
    pub fn all_met(&self, bounce: &Bounce) -> (Vec<ReflectingSurface>, Vec<MetSurface>) {
        let of_place = (0..self.surfaces.len()).into_par_iter();
        let of_place: Vec<_> = of_place.map(|ix| self.met(bounce, ix)).collect();
        let mut first = 0;
        let places = self.surfaces.iter().zip(&of_place).map(|(surface, met)| {
            let place = ReflectingSurface {
                position: surface.position.to_array(),
                first,
                weight: self.weight_of(surface),
                n: met.len() as u32,
            };
            first += place.n;
            place
        });
        (places.collect(), of_place.concat())
    }
}

/// Turns z to `normal`. It changes steadily with that but at +-x, where the ears of a head are, so that no seam of two
/// sets of rays is seen.
fn frame_of(normal: Vec3) -> Mat3 {
    let x = normal.cross(Vec3::X).normalize_or(Vec3::Y);
    Mat3::from_cols(x, normal.cross(x), normal)
}

fn is_black(surface: &Surface) -> bool {
    surface.albedo == [0.0; 3]
}
