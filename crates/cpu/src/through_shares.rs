//! Unblocked shares of TT at visible points, eight maps at a time: what `shadow_map::through_shares`
//! computes one after the other.

use std::ops::Range;

use glam::Vec3;
use strandlight_scattering::closed_form::THROUGH_LEAST;
use strandlight_scattering::wide::prelude::*;
use strandlight_scattering::wide::{LANES, Simd, f32x8, sums, through_kernel};
use strandlight_scene::shadow_maps::{Mixture, ShadowPlan};
use strandlight_scene::strands::Strands;

use super::unblocked::{Unblocked, VisiblePoint};

/// The maps of all lights, and those of a line of sight.
#[derive(Clone, Copy)]
pub(super) struct Maps<'a> {
    pub plan: &'a ShadowPlan,
    pub of_lights: &'a Unblocked,
    /// May be that of the view before.
    pub through: &'a Through,
    /// By map of the lights: is it drawn? All are where there is none.
    pub are_drawn: Option<&'a [bool]>,
}

impl Maps<'_> {
    /// By slot, its maps that are drawn.
    pub fn drawn_of_slots(&self) -> Vec<Vec<u32>> {
        let mut of_slots = vec![Vec::new(); self.plan.n_slots as usize];
        for (map, view) in (0..).zip(&self.plan.views) {
            if self.is_drawn(map as usize) {
                of_slots[view.shadow_index as usize].push(map);
            }
        }
        of_slots
    }

    fn is_drawn(&self, map: usize) -> bool {
        self.are_drawn.is_none_or(|are_drawn| are_drawn[map])
    }
}

/// What maps along a line of sight say.
#[derive(Clone, Debug)]
pub(super) struct Through {
    pub maps: Unblocked,
    /// Where the eye looks.
    pub forward: [f32; 3],
}

/// Cosine of the angle that the line of sight may turn by until its maps serve drafts alone: 0.35 radians, less than the width
/// of the lobe that they lie in.
const NEAR: f32 = 0.939;

impl Through {
    /// Do the maps serve a first picture of an eye that looks this way?
    pub fn is_near(&self, forward: [f32; 3]) -> bool {
        Vec3::from(self.forward).dot(Vec3::from(forward)) > NEAR
    }
}

/// Finds TT's shares at points of a scene for an eye.
pub(super) struct ThroughShares<'a> {
    strands: &'a Strands,
    eye: Vec3,
    maps: Maps<'a>,
    /// Whole vectors of maps: x, y, z towards their light.
    towards: [Vec<f32>; 3],
    /// By slot, which of `weighed` are of it.
    weighed_of: Vec<Range<usize>>,
    weighed: Vec<Weighed>,
}

/// A vector of maps that count for a slot.
struct Weighed {
    /// The first of them.
    first: usize,
    weights: [f32; LANES],
}

/// Share of the largest weight of a slot up to which maps do not count: what they would add is a millionth at most, whatever
/// the kernel says of them and of the others.
const LEAST_WEIGHT: f32 = 1e-6 * THROUGH_LEAST;

/// What a thread finds shares in.
#[derive(Default)]
pub(super) struct Scratch {
    answers: Vec<f32>,
    kernel: Vec<f32>,
    /// By slot, 0..=1.
    pub shares: Vec<f32>,
}

impl<'a> ThroughShares<'a> {
    /// By `maps` of `strands`, seen from `eye`.
    pub fn new(strands: &'a Strands, eye: [f32; 3], maps: Maps<'a>) -> ThroughShares<'a> {
        let forward = maps.through.forward;
        let Mixture { towards, weights } = maps.plan.mixture_of(forward, |map| maps.is_drawn(map));
        let n = towards.len();
        let n_row = n.next_multiple_of(LANES);
        let axis = |axis: usize| {
            let mut numbers: Vec<f32> = towards.iter().map(|towards| towards[axis]).collect();
            numbers.resize(n_row, 0.0);
            numbers
        };
        let (mut weighed_of, mut weighed) = (Vec::new(), Vec::new());
        for row in weights.chunks_exact(n.max(1)) {
            let start = weighed.len();
            let least = LEAST_WEIGHT * row.iter().copied().fold(0.0, f32::max);
            for (ix, some) in row.chunks(LANES).enumerate() {
                if some.iter().any(|weight| *weight > least) {
                    let mut weights = [0.0; LANES];
                    weights[..some.len()].copy_from_slice(some);
                    let first = ix * LANES;
                    weighed.push(Weighed { first, weights });
                }
            }
            weighed_of.push(start..weighed.len());
        }
        ThroughShares {
            strands,
            eye: Vec3::from(eye),
            maps,
            towards: [0, 1, 2].map(axis),
            weighed_of,
            weighed,
        }
    }

    /// Fills [`Scratch::shares`] with those at a visible point.
    #[inline(always)]
    pub fn find<S: Simd>(&self, simd: S, at: VisiblePoint, scratch: &mut Scratch) {
        let Scratch {
            answers,
            kernel,
            shares,
        } = scratch;
        let n_row = self.towards[0].len();
        answers.clear();
        answers.extend(self.maps.of_lights.answers(at));
        answers.extend(self.maps.through.maps.answers(at));
        answers.resize(n_row, 0.0);
        kernel.resize(n_row, 0.0);
        let [u, v, w] = self.strands.frame(at.point);
        let position = Vec3::from_slice(&self.strands.points[at.point]);
        let eye = (self.eye - position).normalize_or_zero();
        let eye = [u.dot(eye), v.dot(eye), w.dot(eye)];
        let [x, y, z] = &self.towards;
        for first in (0..n_row).step_by(LANES) {
            let range = first..first + LANES;
            let x = f32x8::from_slice(simd, &x[range.clone()]);
            let y = f32x8::from_slice(simd, &y[range.clone()]);
            let z = f32x8::from_slice(simd, &z[range.clone()]);
            let along_u = x * u.x + y * u.y + z * u.z;
            let along_v = x * v.x + y * v.y + z * v.z;
            let along_w = x * w.x + y * w.y + z * w.z;
            let found = through_kernel([along_u, along_v, along_w], eye);
            found.store_slice(&mut kernel[range.clone()]);
            let lit = f32x8::from_slice(simd, &answers[range.clone()]);
            (lit * found).store_slice(&mut answers[range]);
        }
        shares.clear();
        for slots in self.weighed_of.chunks(LANES) {
            let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
            let (mut unblocked, mut all) = ([zero; LANES], [zero; LANES]);
            for (slot, range) in slots.iter().enumerate() {
                for Weighed { first, weights } in &self.weighed[range.clone()] {
                    let range = *first..first + LANES;
                    let weights = f32x8::load_array_ref(simd, weights);
                    let kernel = f32x8::from_slice(simd, &kernel[range.clone()]);
                    all[slot] = weights.mul_add(kernel, all[slot]);
                    let answers = f32x8::from_slice(simd, &answers[range]);
                    unblocked[slot] = weights.mul_add(answers, unblocked[slot]);
                }
            }
            let all = sums(all);
            let found = (sums(unblocked) / all).min(1.0);
            let found = all.simd_gt(0.0).select(found, one);
            shares.extend_from_slice(&<[f32; LANES]>::from(found)[..slots.len()]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use strandlight_formats::SrbfLight;
    use strandlight_scattering::wide::{Level, dispatch};
    use strandlight_scene::beside::Beside;
    use strandlight_scene::shadow_maps::{ShadowView, unblocked_share};

    use super::super::shadow_map::shadow_maps;
    use super::super::unblocked::{Casting, StripOrder};
    use super::*;

    #[test]
    fn shares_are_those_of_one_map_after_the_other() {
        let mut points = Vec::new();
        let n = 300;
        for ix in 0..n {
            let turn = 2.4 * ix as f32;
            let along = Vec3::new(turn.cos(), 0.3 * (ix % 3) as f32, turn.sin());
            let middle = Vec3::new((1.7 * turn).sin(), (0.9 * turn).cos(), (1.3 * turn).sin());
            points.extend([-1.0, -0.2, 0.7].map(|t| (middle + along * t).to_array()));
        }
        let offsets: Vec<u32> = (0..=n).map(|ix| 3 * ix as u32).collect();
        let strands = Strands::new(&points, &offsets, |_, _| 0.05, true).expect("valid");
        let lights: Vec<SrbfLight> = (0..5)
            .map(|ix| SrbfLight {
                direction: Vec3::new(ix as f32 - 2.0, 0.4, 1.0).normalize().to_array(),
                lambda: [0.02, 0.4, 1.5][ix % 3],
                rgb: [1.0; 3],
            })
            .collect();
        let plan = ShadowPlan::new(&lights, &strands, 30);
        let forward = Vec3::new(0.1, -0.2, -1.0).normalize();
        let eye = (forward * -9.0).to_array();
        let forward = forward.to_array();
        let words = shadow_maps(&strands, &plan, (eye, forward));
        let order = Arc::new(StripOrder::new(&strands));
        let cast = |views: Vec<ShadowView>| {
            let are_first = vec![true; views.len()];
            let mut casting = Casting::new((views, are_first), (&strands, &order), None);
            while !casting.step(&Beside::none()) {}
            casting.finish()
        };
        let maps = Maps {
            plan: &plan,
            of_lights: &cast(plan.views.clone()),
            through: &Through {
                maps: cast(plan.through(forward)),
                forward,
            },
            are_drawn: None,
        };
        let through = ThroughShares::new(&strands, eye, maps);
        let mut scratch = Scratch::default();
        let mut apart = 0.0_f32;
        for point in 0..strands.points.len() {
            let at = VisiblePoint { place: 0, point };
            dispatch!(Level::new(), simd => through.find(simd, at, &mut scratch));
            for slot in 0..plan.n_slots {
                let found = scratch.shares[slot as usize];
                let exact =
                    |is_tt| unblocked_share(&words, strands.points.len(), slot, is_tt, point);
                assert!((found - exact(true)).abs() < 0.6 / 255.0, "{slot} {point}");
                apart = apart.max((found - exact(false)).abs());
            }
        }
        assert!(apart > 0.2, "TT's shares are the same as the others'");
    }
}
