//! Light that proxies send to each other. Twin of `reflect` in `shaders/pass/bounce.wgsl`.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;
use strandlight_scattering::closed_form::shares_of_ray;
use strandlight_scene::bounce::{Bounce, PassedWeights};
use strandlight_scene::interreflection::{MOST_RAYS, N_ROUNDS, SurfaceRays};

/// Places whose rays are found at a time.
const PLACES_AT_ONCE: usize = 1024;

/// A ray from a place that meets another.
#[derive(Clone, Copy)]
struct Met {
    /// Index of the place it meets.
    surface: u32,
    /// What the hair before it lets pass at the smallest exponent.
    passing: f32,
}

/// What rays from the places on proxies meet of each other, and the hair before it: the same for lights of any colour and for
/// any fibre.
pub(super) struct Interreflection {
    rays: SurfaceRays,
    /// By place, of those that are found, which of `met` its rays meet.
    ranges: Vec<Range<u32>>,
    met: Vec<Met>,
}

impl Interreflection {
    /// Nothing found yet.
    pub fn new(bounce: &Bounce) -> Interreflection {
        let rays = SurfaceRays::new(bounce, MOST_RAYS);
        Interreflection {
            ranges: Vec::with_capacity(rays.surfaces.len()),
            met: Vec::new(),
            rays,
        }
    }

    /// Is it known of all places?
    pub fn is_found(&self) -> bool {
        self.ranges.len() == self.rays.surfaces.len()
    }

    /// Finds what the rays of some more places meet. `passing` is what hair lets pass at the smallest exponent from a position in a
    /// direction on a distance.
    pub fn step(&mut self, bounce: &Bounce, passing: impl Fn(Vec3, Vec3, f32) -> f32 + Sync) {
        let rays = &self.rays;
        let first = self.ranges.len();
        let end = rays.surfaces.len().min(first + PLACES_AT_ONCE);
        let of_place = |ix: usize| -> Vec<Met> {
            let start = rays.surfaces[ix].position;
            let met = rays.met(bounce, ix).into_iter().map(|met| Met {
                surface: met.surface,
                passing: passing(start, met.direction, met.distance),
            });
            met.collect()
        };
        let of_places: Vec<_> = (first..end).into_par_iter().map(of_place).collect();
        for of_place in of_places {
            let first = self.met.len() as u32;
            self.met.extend(of_place);
            self.ranges.push(first..self.met.len() as u32);
        }
    }

    /// Adds what arrives from others to what the places send back of the lights, rgb.
    pub fn reflect(&self, passed: &PassedWeights, sent_back: &mut [[f32; 3]]) {
        let direct = sent_back.to_vec();
        for _ in 0..N_ROUNDS {
            let before = sent_back.to_vec();
            let places = sent_back.par_iter_mut().enumerate().with_min_len(256);
            places.for_each(|(ix, sent_back)| {
                let arriving = self.arriving(ix, passed, &before);
                let albedo = self.rays.surfaces[ix].albedo;
                *sent_back = [0, 1, 2]
                    .map(|channel| direct[ix][channel] + albedo[channel] * arriving[channel]);
            });
        }
    }

    /// Irradiance of place `ix`, over pi, by what others send back.
    fn arriving(&self, ix: usize, passed: &PassedWeights, before: &[[f32; 3]]) -> [f32; 3] {
        let mut arriving = [0.0; 3];
        let Range { start, end } = self.ranges[ix].clone();
        for met in &self.met[start as usize..end as usize] {
            let [at_1, at_p_1, at_p_2] = shares_of_ray(met.passing);
            let sent = before[met.surface as usize];
            for channel in 0..3 {
                let [a, b, c, _] = passed[channel];
                let share = a * at_1 + b * at_p_1 + c * at_p_2;
                arriving[channel] += share * sent[channel];
            }
        }
        arriving.map(|sum| sum * self.rays.weight())
    }
}
