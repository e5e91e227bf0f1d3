//! Points of strands on the screen, for ribbons in 1/256 px and for the visibility list. Twin:
//! `shaders/lib/screen_point.wgsl`.

use glam::Vec3;
use strandlight_scene::camera::{ViewUniform, screen_position};

/// Samples draw strands at least this wide (px); thinner ones cover part of it.
pub(super) const SAMPLED_WIDTH_PX: f32 = 1.0;

/// A visibility list has them at least this wide (px). Wider ribbons would hide each other by chance where strands do not,
/// and its places do not resolve narrower ones.
pub(super) const LISTED_WIDTH_PX: f32 = 0.6;

/// Largest screen coordinate in 1/256 px; f32 holds it exactly.
const MAX_SCREEN: f32 = 8_388_608.0;

/// A point of a strand on the screen, as it is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ScreenPoint {
    /// Where its middle is, px.
    pub at: [f32; 2],
    /// Unit vector along the strand, root to tip.
    pub along: [f32; 2],
    /// Half the width of the ribbon, px.
    pub half_width: f32,
    /// 0..1 between the near and far planes.
    pub depth: f32,
    /// Coverage of the ribbon; below zero: not drawn.
    pub coverage: f32,
    /// Is it the last one of a strand? Where nobody said so it is not.
    pub is_tip: bool,
}

/// Projects a point (x, y, z, radius) with its tangent, for ribbons at least `least_width` px wide.
pub(super) fn screen_point(
    view: &ViewUniform,
    point: &[f32; 4],
    tangent: &[f32; 4],
    least_width: f32,
) -> ScreenPoint {
    let [x, y, depth] = screen_position(view, Vec3::new(point[0], point[1], point[2]));
    if depth < view.near {
        return ScreenPoint {
            coverage: -1.0,
            ..ScreenPoint::default()
        };
    }
    // The tangent's image, up to a positive factor: d/ds of (x, y) / depth.
    let tangent = Vec3::new(tangent[0], tangent[1], tangent[2]);
    let away = tangent.dot(Vec3::from(view.forward));
    let dx = view.focal_px * tangent.dot(Vec3::from(view.right))
        - (x - 0.5 * view.size[0] as f32) * away;
    let dy =
        -view.focal_px * tangent.dot(Vec3::from(view.up)) - (y - 0.5 * view.size[1] as f32) * away;
    let size = (dx * dx + dy * dy).sqrt();
    // A strand seen end on has no direction on the screen; any will do.
    let mut along = [0.0, -1.0];
    if size > 1e-6 * view.focal_px {
        along = [dx / size, dy / size];
    }
    let width = 2.0 * point[3] * view.focal_px / depth;
    let drawn = width.max(least_width);
    ScreenPoint {
        at: [x, y],
        along,
        half_width: 0.5 * drawn,
        depth: (depth - view.near) / (view.far - view.near),
        coverage: width / drawn,
        is_tip: false,
    }
}

/// Left edge x, y, right edge x, y of a ribbon at a point in 1/256 px: snapped, so that every rasteriser sees the same
/// numbers.
pub(super) fn edges_at(point: &ScreenPoint) -> [i32; 4] {
    let ([x, y], half) = (point.at, point.half_width);
    let across = [-point.along[1], point.along[0]];
    let snap = |x: f32| (x * 256.0).round_ties_even().clamp(-MAX_SCREEN, MAX_SCREEN) as i32;
    [
        snap(x + half * across[0]),
        snap(y + half * across[1]),
        snap(x - half * across[0]),
        snap(y - half * across[1]),
    ]
}
