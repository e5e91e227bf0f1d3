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
    let from_middle = [x - 0.5 * view.size[0] as f32, y - 0.5 * view.size[1] as f32];
    let dx = view.focal_px * tangent.dot(Vec3::from(view.right)) - from_middle[0] * away;
    let dy = -view.focal_px * tangent.dot(Vec3::from(view.up)) - from_middle[1] * away;
    let size = (dx * dx + dy * dy).sqrt();
    // A strand seen end on has no direction on the screen; any will do.
    let mut along = [0.0, -1.0];
    if size > 1e-6 * view.focal_px {
        along = [dx / size, dy / size];
    }
    // The fibre's outline lies to both sides of it, across the plane through the eye and the strand, which the picture cuts at an
    // angle away from its middle.
    let across = (along[0] * from_middle[1] - along[1] * from_middle[0]) / view.focal_px;
    let width = 2.0 * point[3] * view.focal_px / depth * (1.0 + across * across).sqrt();
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

#[cfg(test)]
mod tests {
    use strandlight_scene::Camera;
    use strandlight_scene::camera::view_uniform;
    use strandlight_scene::strands::Strands;

    use super::*;

    #[test]
    fn ribbons_reach_from_outline_to_outline_of_fibres_all_over_the_picture() {
        let (radius, length) = (0.01_f32, 20.0);
        let points = [[-length, -length, 0.0], [length, length, 0.0]];
        let strands = Strands::new(&points, &[0, 2], |_, _| 2.0 * radius, true).expect("a strand");
        let camera = Camera {
            eye: Vec3::new(0.0, 0.0, 60.0),
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_y: 1.4,
        };
        let view = view_uniform(&camera, &strands, [1200, 800], 1.0);
        let mut widest = 1.0_f32;
        for ix in 1..400 {
            let of = |factor: f32| (factor * ix as f32).sin();
            let middle = Vec3::new(70.0 * of(1.1), 45.0 * of(2.3), 12.0 * of(3.7));
            let tangent = Vec3::new(of(5.1), of(7.9), of(0.7)).normalize();
            let point = [middle.x, middle.y, middle.z, radius];
            let drawn = screen_point(&view, &point, &tangent.extend(1.0).to_array(), 0.0);
            // The eye sees a thin fibre's outline across the plane through it and the strand.
            let across = (middle - camera.eye).cross(tangent).normalize();
            let [left, right] = [-radius, radius].map(|r| {
                let [x, y, _] = screen_position(&view, middle + across * r);
                -drawn.along[1] * (x - drawn.at[0]) + drawn.along[0] * (y - drawn.at[1])
            });
            let outline = 0.5 * (right - left).abs();
            assert!(
                (drawn.half_width / outline - 1.0).abs() < 2e-3,
                "{middle}, {tangent}: {} px, {outline} px",
                drawn.half_width
            );
            let in_middle = radius * view.focal_px / (60.0 - middle.z);
            widest = widest.max(outline / in_middle);
        }
        assert!(widest > 1.3, "{widest}");
    }
}
