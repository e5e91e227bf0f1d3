// Points of strands on the screen. Twin: crates/cpu/src/screen_point.rs.
// #import lib/view

// Samples draw strands at least this wide (px); thinner ones cover part of it.
const SAMPLED_WIDTH_PX: f32 = 1.0;

// A visibility list has them at least this wide (px). Wider ribbons would hide each other by chance where strands do not,
// and its places do not resolve narrower ones.
const LISTED_WIDTH_PX: f32 = 0.6;

// Largest screen coordinate in 1/256 px; f32 holds it exactly.
const MAX_SCREEN: f32 = 8388608.0;

struct ScreenPoint {
    // Where its middle is, px.
    at: vec2f,
    // Unit vector along the strand, root to tip.
    along: vec2f,
    // Half the width of the ribbon, px.
    half_width: f32,
    // 0..1 between the near and far planes.
    depth: f32,
    // Coverage of the ribbon; below zero: not drawn.
    coverage: f32,
}

// Projects a point (x, y, z, radius) with its tangent, for ribbons at least `least_width` px wide.
fn screen_point(view: View, point: vec4f, tangent: vec3f, least_width: f32) -> ScreenPoint {
    let screen = screen_position(view, point.xyz);
    let depth = screen.z;
    if depth < view.near {
        return ScreenPoint(vec2f(0.0), vec2f(0.0), 0.0, 0.0, -1.0);
    }
    // The tangent's image, up to a positive factor: d/ds of (x, y) / depth.
    let away = dot(tangent, view.forward);
    let from_middle = screen.xy - 0.5 * vec2f(view.size);
    let dx = view.focal_px * dot(tangent, view.right) - from_middle.x * away;
    let dy = -view.focal_px * dot(tangent, view.up) - from_middle.y * away;
    let size = sqrt(dx * dx + dy * dy);
    // A strand seen end on has no direction on the screen; any will do.
    var along = vec2f(0.0, -1.0);
    if size > 1e-6 * view.focal_px {
        along = vec2f(dx, dy) / size;
    }
    // The fibre's outline lies to both sides of it, across the plane through the eye and the strand, which the picture cuts at an
    // angle away from its middle.
    let across = (along.x * from_middle.y - along.y * from_middle.x) / view.focal_px;
    let width = 2.0 * point.w * view.focal_px / depth * sqrt(1.0 + across * across);
    let drawn = max(width, least_width);
    let z = (depth - view.near) / (view.far - view.near);
    return ScreenPoint(screen.xy, along, 0.5 * drawn, z, width / drawn);
}

// Left edge x, y, right edge x, y of a ribbon at a point, from the middle of the picture in 1/256 px: snapped, so that
// every rasteriser sees the same numbers.
fn edges_at(view: View, point: ScreenPoint) -> vec4i {
    let half_across = point.half_width * vec2f(-point.along.y, point.along.x);
    let snapped = round(vec4f(point.at + half_across, point.at - half_across) * 256.0);
    let kept = vec4i(clamp(snapped, vec4f(-MAX_SCREEN), vec4f(MAX_SCREEN)));
    // Exact: half of the picture is a whole number of units.
    return kept - 128 * vec4i(view.size.xyxy);
}
