//! Shadow maps that resolve fibres: how many each light gets, and from where.
//!
//! The shadow volume takes the strands within a voxel for a fog. That is right in the mean over all
//! points, but not for those that are seen: they lie where the hair happens to be open, and the
//! volume makes them some 20 % too dark, with shadows as coarse as its voxels. So the unblocked
//! share of a light comes from shadow maps along a few directions inside its lobe, more for a
//! light that carries more. A map holds, for every texel of the plane across the direction, the
//! height of the strand nearest to the light; a strand point is unblocked by as much of its
//! neighbourhood (half way to the points before and after it) as no other strand stands above.
//! What strands send on forward still comes from the volume.
//!
//! TT has an unblocked share of its own. It takes its light from directions about the line of sight,
//! where the hair behind the strand stands, and with the mean share wide lights shine through it 20 to 30 % too
//! bright. So a few more maps look along the line of sight, and TT's share of a light is the mean over the
//! directions of all maps, weighed by the light's radiance from there, by
//! [`through_kernel`](strandlight_scattering::closed_form::through_kernel), and by how
//! densely maps lie there: see [`Mixture`].
//!
//! Maps depend on strands and lights alone: an edit of the hair and another view need none.

use std::ops::Range;

use glam::Vec3;
use strandlight_formats::SrbfLight;
use strandlight_scattering::spherical_gaussian::solid_angle;

use crate::strands::Strands;
use crate::volume::{self, shifted_lobe_directions};

/// Texels along a map's side. Texels are wider than fibres, which cover as many texels as they
/// should in the mean; twice as many texels along a side change the error of single scattering from 7.9, 5.6, 6.8, 10.3 %
/// to 8.3, 5.6, 6.6, 10.1 % in four scenes, and cost half as much again.
pub const SHADOW_SIDE: u32 = 512;

/// Texels along a side for narrow lights, whose shadows are sharp, below a lambda: for suns a texel is as wide as a fibre on a
/// head of hair 30 cm wide. Four times as many for the others change their pictures' error by a thousandth of it.
const FINE_SIDES: [(f32, u32); 2] = [(NARROW_LAMBDA, 4096), (0.05, 2048)];

/// How many strands one above the other the texels of a map are drawn for at most, in the mean:
/// five times as many as a full head of hair has. Where there would be more the strands are wide
/// for the groom, and maps of fewer texels tell as much: see `map_side`.
pub const MAX_DEPTH_COMPLEXITY: f32 = 64.0;

/// Texels along a side below which strands that are wide for the groom do not bring a map, unless
/// there are so many of them that the work would not be bounded: as fine as the shadow volume.
const COARSE_SIDE: f32 = 64.0;

/// The shadows of lights with maps that are narrower than this, suns, are found along segments; others at
/// points. Wider ones throw no edges, and a map or two of each would only show more of its noise.
pub const NARROW_LAMBDA: f32 = 0.03;

/// Bytes of a point's two halves of segments in their light, on a device: four places each.
pub const BYTES_ALONG: usize = 32;

/// At most so many of them, the strongest: each takes three shadings of every point that it reaches.
const MAX_NARROW: u32 = 4;

pub use strandlight_formats::MAX_SHADOW_MAPS;

/// Lights with less than this share of the power of all get no map.
const LEAST_SHARE: f32 = 0.002;

/// A light of width lambda gets at most one map, and one more for every so much of lambda: closer
/// directions see the same shadows.
const LAMBDA_PER_MAP: f32 = 0.003;

/// Largest buffer that every adapter binds.
const MAX_BYTES: usize = 128 << 20;

/// Width of the lobe about the line of sight that maps for TT are drawn from.
pub(crate) const THROUGH_LAMBDA: f32 = 0.45;

/// Marks lights without maps.
pub const NO_SLOT: u32 = u32::MAX;

/// Lights whose shares fill a word of the visibility buffer, eight bits each.
pub const SLOTS_PER_WORD: u32 = 4;

/// Maps whose answers fill a word, eight bits each.
pub const MAPS_PER_WORD: u32 = 4;

/// Places along the strand around a point where a map is looked up; its answer is which are lit, a bit each from the
/// root on.
pub const N_PLACES: u32 = 8;

/// One map; mirrored by `ShadowView` in `shaders/pass/shadow_map.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShadowView {
    /// Unit vector along the map's rows.
    pub right: [f32; 3],
    /// Texels in a centimetre.
    pub texels_per_cm: f32,
    /// Unit vector along the map's columns.
    pub up: [f32; 3],
    /// Heights lie within +-this, cm.
    pub reach: f32,
    /// Unit vector towards the light.
    pub towards: [f32; 3],
    /// Share of the light that comes from this direction.
    pub weight: f32,
    /// Middle of the map, cm.
    pub centre: [f32; 3],
    /// Texels along a side.
    pub side: u32,
    /// Row of the visibility buffer that this direction adds to, or [`NO_SLOT`].
    pub shadow_index: u32,
    /// Bit 0: the first of its slot; bit 1: the last.
    pub ends: u32,
    /// Segments to cast.
    pub n_segments: u32,
    /// Points to light.
    pub n_points: u32,
    /// Where in their strata the places along a strand lie, 0..1.
    pub offset: f32,
    /// Its place among all maps, those of the line of sight last.
    pub map_index: u32,
    /// Not used.
    pub pad: [u32; 2],
}

strandlight_scattering::mirrors! {
    ShadowView as "ShadowView" in "pass/shadow_map" {
        right, texels_per_cm, up, reach, towards, weight, centre, side, shadow_index, ends, n_segments,
        n_points, offset, map_index, pad,
    }
}

/// [`ShadowView::ends`]: the first of its slot.
pub const FIRST_OF_SLOT: u32 = 1;
/// [`ShadowView::ends`]: the last of its slot.
pub const LAST_OF_SLOT: u32 = 2;

/// The maps of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShadowPlan {
    /// The maps, those of a light one after the other.
    pub views: Vec<ShadowView>,
    /// By light: its row of the visibility buffer, or [`NO_SLOT`].
    pub slots: Vec<u32>,
    /// Number of rows.
    pub n_slots: u32,
    /// By row: direction and width of its light, and how many maps it has.
    lobes: Vec<Lobe>,
    /// Maps along the line of sight, and one of them in any direction.
    through: Option<(u32, ShadowView)>,
    /// Are there few enough points for light along segments?
    has_room_along: bool,
}

/// A lobe of directions that maps are drawn from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lobe {
    axis: Vec3,
    lambda: f32,
    n_maps: u32,
}

impl Lobe {
    /// Its spherical Gaussian.
    fn radiance(&self, towards: Vec3) -> f64 {
        let lambda = f64::from(self.lambda);
        (-f64::from(self.axis.distance_squared(towards)) / (lambda * lambda)).exp()
    }

    /// Its maps in a unit of solid angle.
    fn density(&self, towards: Vec3) -> f64 {
        f64::from(self.n_maps) * self.radiance(towards) / solid_angle(f64::from(self.lambda))
    }
}

/// All maps of a view taken together: which directions they look in, and what each counts for each
/// light with maps.
///
/// A light's integral over directions is estimated from the maps of all lights and those of the line of
/// sight: sum of f G_j / q, with q the density of all of them (balance heuristic). Weighed by f = kernel
/// times unblocked, over f = kernel, that is TT's share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mixture {
    /// By map: unit vector towards the light.
    pub towards: Vec<[f32; 3]>,
    /// `[slot][map]`: G_j / q.
    pub weights: Vec<f32>,
}

impl ShadowPlan {
    /// About `budget` maps for `lights`, shared out by power; a light that gets one at all may
    /// make it a few more.
    pub fn new(lights: &[SrbfLight], strands: &Strands, budget: u32) -> ShadowPlan {
        let power: Vec<f32> = lights
            .iter()
            .map(|light| volume::largest(volume::power(light)))
            .collect();
        let total: f32 = power.iter().sum();
        let mut order: Vec<usize> = (0..lights.len())
            .filter(|&ix| budget > 0 && power[ix] > 0.0 && power[ix] >= LEAST_SHARE * total)
            .collect();
        order.sort_by(|&a, &b| power[b].total_cmp(&power[a]).then(a.cmp(&b)));
        let words = MAX_BYTES / (4 * strands.points.len().max(1));
        // Two rows of words for shares, and answers in a buffer of their own.
        order.truncate(words / 2 * SLOTS_PER_WORD as usize);
        let most_maps = words * MAPS_PER_WORD as usize;
        let n_through = (budget / 6).clamp(4, 64);
        order.truncate(most_maps.saturating_sub(n_through as usize));
        let any = ShadowView::towards([0.0, 1.0, 0.0], strands);
        let mut plan = ShadowPlan {
            slots: vec![NO_SLOT; lights.len()],
            has_room_along: strands.points.len() <= MAX_BYTES / BYTES_ALONG,
            ..ShadowPlan::default()
        };
        for (n_before, &ix) in order.iter().enumerate() {
            let light = &lights[ix];
            let useful = 1 + (light.lambda / LAMBDA_PER_MAP).min(1e6) as u32;
            let k = (budget as f32 * (power[ix] / total)).round() as u32;
            // Every light after it gets one.
            let n_after = order.len() - n_before - 1 + n_through as usize;
            let left = most_maps.saturating_sub(plan.views.len() + n_after);
            let k = k.clamp(1, useful).min(left as u32);
            // Lights with a map or two look elsewhere each.
            let shift = (0.5 + 0.618_034 * (1 + n_before) as f64).fract();
            let first = plan.views.len() as u32;
            plan.views
                .extend(views_of(light, k, shift, (n_before as u32, first), &any));
            plan.slots[ix] = n_before as u32;
            plan.lobes.push(Lobe {
                axis: Vec3::from(light.direction).normalize_or(Vec3::Y),
                lambda: light.lambda,
                n_maps: k,
            });
        }
        if !order.is_empty() {
            plan.n_slots = order.len() as u32;
            plan.through = Some((n_through, any));
        }
        plan
    }

    /// By map of the lights: does a first picture need it? It does with one in two of a light, and all fine ones and those for shadows
    /// along segments.
    pub fn maps_for_first(&self) -> Vec<bool> {
        let is_needed = |(map, view): (u32, &ShadowView)| {
            let slot = view.shadow_index;
            let lobes = &self.lobes[..=slot as usize];
            let n_maps = lobes[slot as usize].n_maps;
            let end: u32 = lobes.iter().map(|lobe| lobe.n_maps).sum();
            // Those with odd ranks in place of even ones, of one light in two, were no better.
            let rank = map + n_maps - end;
            rank.is_multiple_of(2)
                || view.side > SHADOW_SIDE
                || !self.maps_along_segments(slot).is_empty()
        };
        (0..).zip(&self.views).map(is_needed).collect()
    }

    /// Maps along the line of sight of an eye that looks along `forward`.
    pub fn through(&self, forward: [f32; 3]) -> Vec<ShadowView> {
        let Some((k, any)) = &self.through else {
            return Vec::new();
        };
        let lobe = SrbfLight {
            direction: forward,
            lambda: THROUGH_LAMBDA,
            rgb: [1.0; 3],
        };
        let mut views = views_of(&lobe, *k, 0.5, (NO_SLOT, self.views.len() as u32), any);
        for view in &mut views {
            // They write no share.
            view.ends = FIRST_OF_SLOT;
        }
        views
    }

    /// Are its maps along any line of sight those of another plan? They do not depend on where the lights are.
    pub fn has_through_of(&self, other: &ShadowPlan) -> bool {
        self.through == other.through
    }

    /// All maps together with those of an eye that looks along `forward`.
    pub fn mixture(&self, forward: [f32; 3]) -> Mixture {
        self.mixture_of(forward, |_| true)
    }

    /// The same of those maps of the lights alone that are `drawn`, by their index: the others weigh nothing.
    pub fn mixture_of(&self, forward: [f32; 3], is_drawn: impl Fn(usize) -> bool) -> Mixture {
        let through = self.through(forward);
        let maps = || self.views.iter().chain(&through);
        let are_drawn: Vec<bool> = (0..self.views.len())
            .map(is_drawn)
            .chain(through.iter().map(|_| true))
            .collect();
        let mut drawn = self.lobes.clone();
        for lobe in &mut drawn {
            lobe.n_maps = 0;
        }
        for (view, is_drawn) in self.views.iter().zip(&are_drawn) {
            drawn[view.shadow_index as usize].n_maps += u32::from(*is_drawn);
        }
        let of_sight = Lobe {
            axis: Vec3::from(forward).normalize_or(Vec3::Y),
            lambda: THROUGH_LAMBDA,
            n_maps: through.len() as u32,
        };
        let lobes = || drawn.iter().chain([&of_sight]);
        let density = |view: &ShadowView| -> f64 {
            let towards = Vec3::from(view.towards);
            lobes().map(|lobe| lobe.density(towards)).sum()
        };
        let densities: Vec<f64> = maps().map(density).collect();
        let weights = self.lobes.iter().flat_map(|lobe| {
            let of_map = |((view, density), is_drawn): ((&ShadowView, &f64), &bool)| {
                let radiance = lobe.radiance(Vec3::from(view.towards));
                if radiance > 0.0 && *is_drawn {
                    (radiance / density) as f32
                } else {
                    0.0
                }
            };
            let maps = maps().zip(&densities).zip(&are_drawn);
            maps.map(of_map).collect::<Vec<f32>>()
        });
        Mixture {
            weights: weights.collect(),
            towards: maps().map(|view| view.towards).collect(),
        }
    }

    /// All maps, those of the line of sight included.
    pub fn n_maps(&self) -> usize {
        self.views.len() + self.through.map_or(0, |(k, _)| k as usize)
    }

    /// Words of the visibility buffer, `[shadow_index / 4][mode][point]`, eight bits a slot from the
    /// lowest up: shares of all modes but TT, then of TT.
    pub fn n_words(&self, n_points: usize) -> usize {
        2 * self.n_slots.div_ceil(SLOTS_PER_WORD) as usize * n_points
    }

    /// Maps of the light with this slot if its shadows are found along segments, by
    /// [`ShadowView::map_index`]; else none.
    pub fn maps_along_segments(&self, slot: u32) -> Range<u32> {
        let is_narrow = |lobe: &&Lobe| self.has_room_along && lobe.lambda < NARROW_LAMBDA;
        let Some(lobe) = self.lobes.get(slot as usize).filter(is_narrow) else {
            return 0..0;
        };
        // Slots are in the order of power.
        let before = &self.lobes[..slot as usize];
        if before.iter().filter(is_narrow).count() >= MAX_NARROW as usize {
            return 0..0;
        }
        let first = before.iter().map(|lobe| lobe.n_maps).sum();
        first..first + lobe.n_maps
    }

    /// Words of the answers of all maps, `[map_index / 4][point]`, eight bits a map from the lowest up:
    /// which of [`N_PLACES`] are lit.
    pub fn n_answer_words(&self, n_points: usize) -> usize {
        self.n_maps().div_ceil(MAPS_PER_WORD as usize) * n_points
    }
}

/// `k` maps of one light, from the slot and the map index of the first on.
fn views_of(
    light: &SrbfLight,
    k: u32,
    shift: f64,
    (shadow_index, first_map): (u32, u32),
    any: &ShadowView,
) -> Vec<ShadowView> {
    let directions = shifted_lobe_directions(light, k, shift);
    let fine = FINE_SIDES.iter().find(|(least, _)| light.lambda < *least);
    let side = match fine {
        Some((_, fine)) if any.side == SHADOW_SIDE => *fine,
        _ => any.side,
    };
    let view = |(n, &direction): (u32, &[f32; 3])| {
        let first = if n == 0 { FIRST_OF_SLOT } else { 0 };
        let last = if n + 1 == k { LAST_OF_SLOT } else { 0 };
        ShadowView {
            side,
            texels_per_cm: any.texels_per_cm * side as f32 / any.side as f32,
            shadow_index,
            map_index: first_map + n,
            ends: first | last,
            weight: 1.0 / k as f32,
            offset: (n as f32 + 0.5) / k as f32,
            ..any.turned(direction)
        }
    };
    (0..k).zip(&directions).map(view).collect()
}

/// Texels along the side of a map of `strands`: [`SHADOW_SIDE`], or fewer, so that drawing it
/// costs no more than [`MAX_DEPTH_COMPLEXITY`] times [`SHADOW_SIDE`]^2 texels and one for each
/// texel of a strand's length, however wide the strands are.
///
/// The strands' area over the map's is how often a texel is drawn; it does not depend on the number
/// of texels. Up to [`MAX_DEPTH_COMPLEXITY`] every map has all of its texels, beyond it none is a
/// fine one.
fn map_side(strands: &Strands, reach: f32) -> u32 {
    // Whatever is wider than the map is cut off at its border.
    let widest = 2.0 * std::f32::consts::SQRT_2 * reach;
    let area_of = |&first: &u32| {
        let [a, b] = [0, 1].map(|next| &strands.points[first as usize + next]);
        let length = Vec3::from_slice(a).distance(Vec3::from_slice(b));
        f64::from(length * (a[3] + b[3]).min(widest))
    };
    let area = match strands.max_diameter <= widest {
        true => strands.area,
        false => strands.segments.iter().map(area_of).sum(),
    };
    let complexity = (area / f64::from(2.0 * reach).powi(2)) as f32;
    if complexity <= MAX_DEPTH_COMPLEXITY {
        return SHADOW_SIDE;
    }
    // In proportion, since wider strands also need fewer texels to be resolved; but within the
    // bound in any case.
    let over = MAX_DEPTH_COMPLEXITY / complexity;
    let wanted = (over * SHADOW_SIDE as f32).max(COARSE_SIDE);
    wanted.min(over.sqrt() * SHADOW_SIDE as f32).max(1.0) as u32
}

/// The word of `shadow_index` at `point` in the visibility buffer of `n_points` points, of TT or of the
/// other modes, and its lowest bit there.
pub fn share_place(n_points: usize, shadow_index: u32, is_tt: bool, point: usize) -> (usize, u32) {
    let row = 2 * (shadow_index / SLOTS_PER_WORD) as usize + usize::from(is_tt);
    (row * n_points + point, 8 * (shadow_index % SLOTS_PER_WORD))
}

/// The unblocked share of `shadow_index` at `point` in the visibility buffer of `n_points` points, of TT
/// or of the other modes.
pub fn unblocked_share(
    visibility: &[u32],
    n_points: usize,
    shadow_index: u32,
    is_tt: bool,
    point: usize,
) -> f32 {
    let (word, bit) = share_place(n_points, shadow_index, is_tt, point);
    (visibility[word] >> bit & 255) as f32 / 255.0
}

impl ShadowView {
    /// The map of one direction, on its own.
    pub fn towards(direction: [f32; 3], strands: &Strands) -> ShadowView {
        // Refined curves swing out a little beyond the groom's points.
        let reach = 1.1 * strands.radius + 1e-3;
        let side = map_side(strands, reach);
        let view = ShadowView {
            right: [0.0; 3],
            texels_per_cm: 0.5 * side as f32 / reach,
            up: [0.0; 3],
            reach,
            towards: [0.0; 3],
            weight: 1.0,
            centre: strands.centre.to_array(),
            side,
            shadow_index: 0,
            ends: FIRST_OF_SLOT | LAST_OF_SLOT,
            n_segments: strands.segments.len() as u32,
            n_points: strands.points.len() as u32,
            offset: 0.5,
            map_index: 0,
            pad: [0; 2],
        };
        view.turned(direction)
    }

    /// The same map of another direction.
    fn turned(&self, direction: [f32; 3]) -> ShadowView {
        let towards = Vec3::from(direction).normalize_or(Vec3::Y);
        let (right, up) = towards.any_orthonormal_pair();
        ShadowView {
            right: right.to_array(),
            up: up.to_array(),
            towards: towards.to_array(),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sun and two wide lights over hair.
    fn plan() -> ShadowPlan {
        let points = [[-5.0, -5.0, -5.0], [5.0, 5.0, 5.0]].repeat(300);
        let offsets: Vec<u32> = (0..=300).map(|ix| 2 * ix).collect();
        let strands = Strands::new(&points, &offsets, |_, _| 0.008, true).expect("valid");
        let light = |direction: [f32; 3], lambda: f32, rgb: f32| SrbfLight {
            direction,
            lambda,
            rgb: [rgb; 3],
        };
        let lights = [
            light([0.0, 1.0, 0.0], 0.7, 1.0),
            light([0.0, 0.0, 1.0], 0.02, 600.0),
            light([0.8, 0.6, 0.0], 0.9, 0.3),
        ];
        ShadowPlan::new(&lights, &strands, 30)
    }

    #[test]
    fn a_first_picture_needs_half_of_the_maps_and_all_of_suns() {
        let plan = plan();
        let are_needed = plan.maps_for_first();
        for slot in 0..plan.n_slots {
            let of_slot: Vec<bool> = (plan.views.iter().zip(&are_needed))
                .filter(|(view, _)| view.shadow_index == slot)
                .map(|(_, is_needed)| *is_needed)
                .collect();
            let n = of_slot.iter().filter(|is_needed| **is_needed).count();
            assert!(of_slot.len() > 2, "{slot}");
            match plan.maps_along_segments(slot).is_empty() {
                true => assert!(n.abs_diff(of_slot.len() - n) <= 1, "{slot}: {of_slot:?}"),
                false => assert_eq!(n, of_slot.len(), "{slot}"),
            }
            assert!(!of_slot.windows(2).any(|pair| pair == [false; 2]), "{slot}");
        }
    }

    /// A light's weights are the sum over maps of G / q: an estimate of its solid angle, by few maps as by many.
    #[test]
    fn maps_that_are_drawn_stand_for_all() {
        let plan = plan();
        let forward = [0.0, 0.0, -1.0];
        let first = plan.maps_for_first();
        let (all, some) = (
            plan.mixture(forward),
            plan.mixture_of(forward, |map| first[map]),
        );
        let n = all.towards.len();
        for (slot, (all, some)) in (all.weights.chunks(n))
            .zip(some.weights.chunks(n))
            .enumerate()
        {
            for (map, is_first) in first.iter().enumerate() {
                assert!(*is_first || some[map] == 0.0, "{slot} {map}");
            }
            let [of_all, of_some] = [all, some].map(|weights| weights.iter().sum::<f32>());
            assert!(
                (of_some / of_all - 1.0).abs() < 0.2,
                "{slot}: {of_some} {of_all}"
            );
        }
    }

    #[test]
    fn narrow_lights_have_fine_maps_on_thin_hair_alone() {
        let side = |lambda: f32, diameter: f32| {
            let points = [[-5.0, -5.0, -5.0], [5.0, 5.0, 5.0]].repeat(300);
            let offsets: Vec<u32> = (0..=300).map(|ix| 2 * ix).collect();
            let strands = Strands::new(&points, &offsets, |_, _| diameter, true).expect("valid");
            let light = SrbfLight {
                direction: [0.0, 1.0, 0.0],
                lambda,
                rgb: [1.0; 3],
            };
            let plan = ShadowPlan::new(&[light], &strands, 4);
            assert!(!plan.views.is_empty());
            plan.views[0].side
        };
        for (lambda, expected) in [
            (0.01, 4096),
            (0.029, 4096),
            (0.03, 2048),
            (0.049, 2048),
            (0.05, 512),
            (1.0, 512),
        ] {
            assert_eq!(side(lambda, 0.008), expected, "{lambda}");
        }
        assert!(side(0.01, 5.0) < 512);
    }
}
