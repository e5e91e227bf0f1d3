//! Shadow maps for the lights that make hard shadows: which lights get them, and from where.
//!
//! The shadow volume blurs shadows over its voxels, some dozens of strands wide. A light that is
//! narrow and strong shows that; it gets shadow maps that resolve single fibres, one for each of a
//! few directions inside its lobe. A map holds, for every texel of the plane across the direction,
//! the height of the strand nearest to the light. A strand point is unblocked by as much of its
//! neighbourhood (half way to the points before and after it) as no strand of the map stands above.
//!
//! Maps depend on strands and lights alone, so an edit of the hair needs none.

use glam::Vec3;
use strandlight_formats::SrbfLight;

use crate::strands::Strands;
use crate::volume::{lobe_directions, solid_angle};

/// Texels along a map's side: on a head of hair 30 cm wide a texel is as wide as a fibre.
pub const SHADOW_SIDE: u32 = 4096;

/// Maps of a scene unless it says otherwise.
pub const DEFAULT_SHADOW_MAPS: u32 = 16;

/// Lights wider than this get none: within their lobes shadows of fibres run together, and a dozen
/// binary samples err by more than the volume does.
pub const SHADOW_LAMBDA: f32 = 0.3;

/// Lights with less than this share of the power of all get none.
pub const SHADOW_SHARE: f32 = 0.02;

/// One direction for every so much of lambda, at least one and at most [`MAX_DIRECTIONS`].
const LAMBDA_PER_DIRECTION: f32 = 0.04;
const MAX_DIRECTIONS: u32 = 8;

/// Largest buffer of answers, as every adapter binds it.
const MAX_BYTES: usize = 128 << 20;

/// Marks lights without maps in [`ShadowPlan::slots`].
pub const NO_SLOT: u32 = u32::MAX;

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
    /// Row of the answers that this direction adds to.
    pub slot: u32,
    /// Texels along a side.
    pub side: u32,
    /// Segments to cast.
    pub n_segments: u32,
    /// Points to light.
    pub n_points: u32,
    /// Where in their strata the places along a strand lie, 0..1.
    pub offset: f32,
}

/// The maps of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShadowPlan {
    /// The maps, those of a light one after the other.
    pub views: Vec<ShadowView>,
    /// By light: its row of the answers, or [`NO_SLOT`].
    pub slots: Vec<u32>,
    /// Number of rows.
    pub n_slots: u32,
}

impl ShadowPlan {
    /// At most `budget` maps for `lights`, the most powerful first.
    pub fn new(lights: &[SrbfLight], strands: &Strands, budget: u32) -> ShadowPlan {
        let power: Vec<f32> = lights
            .iter()
            .map(|light| light.rgb.iter().copied().fold(0.0, f32::max) * solid_angle(light.lambda))
            .collect();
        let total: f32 = power.iter().sum();
        let mut order: Vec<usize> = (0..lights.len())
            .filter(|&ix| lights[ix].lambda <= SHADOW_LAMBDA && power[ix] >= SHADOW_SHARE * total)
            .collect();
        order.sort_by(|&a, &b| power[b].total_cmp(&power[a]).then(a.cmp(&b)));
        let n_points = strands.points.len();
        let most_slots = (MAX_BYTES / (4 * n_points.max(1))) as u32;
        let mut plan = ShadowPlan {
            slots: vec![NO_SLOT; lights.len()],
            ..ShadowPlan::default()
        };
        for ix in order {
            let left = budget.saturating_sub(plan.views.len() as u32);
            if left == 0 || plan.n_slots == most_slots {
                break;
            }
            let wanted = (lights[ix].lambda / LAMBDA_PER_DIRECTION).ceil() as u32;
            let directions =
                lobe_directions(&lights[ix], wanted.clamp(1, MAX_DIRECTIONS).min(left));
            let weight = 1.0 / directions.len() as f32;
            for (k, &direction) in directions.iter().enumerate() {
                plan.views.push(ShadowView {
                    slot: plan.n_slots,
                    weight,
                    offset: (k as f32 + 0.5) * weight,
                    ..ShadowView::towards(direction, strands)
                });
            }
            plan.slots[ix] = plan.n_slots;
            plan.n_slots += 1;
        }
        plan
    }
}

impl ShadowView {
    /// The map of one direction, on its own.
    pub fn towards(direction: [f32; 3], strands: &Strands) -> ShadowView {
        let towards = Vec3::from(direction).normalize_or(Vec3::Y);
        let (right, up) = towards.any_orthonormal_pair();
        // Refined curves swing out a little beyond the groom's points.
        let reach = 1.1 * strands.radius + 1e-3;
        ShadowView {
            right: right.to_array(),
            texels_per_cm: 0.5 * SHADOW_SIDE as f32 / reach,
            up: up.to_array(),
            reach,
            towards: towards.to_array(),
            weight: 1.0,
            centre: strands.centre.to_array(),
            slot: 0,
            side: SHADOW_SIDE,
            n_segments: strands.segments.len() as u32,
            n_points: strands.points.len() as u32,
            offset: 0.5,
        }
    }
}
