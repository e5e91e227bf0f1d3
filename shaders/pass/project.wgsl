// Where the ribbon's two edges are on the screen at every point, snapped to 1/256 pixel so that
// every rasteriser sees the same numbers. Twin: crates/cpu/src/project.rs.
// #import lib/view

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> tangents: array<vec4f>;
// Left edge x, y, right edge x, y from the middle of the picture in 1/256 px.
@group(0) @binding(3) var<storage, read_write> edges: array<vec4i>;
// Bits of the depth in 0..1 between the near and far planes, and of the coverage; below zero: not
// drawn. The other two words belong to `pass/ribbons`.
@group(0) @binding(4) var<storage, read_write> depth_coverage: array<vec4u>;

// Strands are drawn at least this wide (px); thinner ones cover part of it.
const MIN_WIDTH_PX: f32 = 1.0;

// Largest screen coordinate in 1/256 px; f32 holds it exactly.
const MAX_SCREEN: f32 = 8388608.0;

@compute @workgroup_size(256)
fn project(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.n_points {
        return;
    }
    let point = points[id.x];
    let screen = screen_position(view, point.xyz);
    let depth = screen.z;
    if depth < view.near {
        edges[id.x] = vec4i(0);
        depth_coverage[id.x] = bitcast<vec4u>(vec4f(0.0, -1.0, 0.0, 0.0));
        return;
    }
    // The tangent's image, up to a positive factor: d/ds of (x, y) / depth.
    let tangent = tangents[id.x].xyz;
    let away = dot(tangent, view.forward);
    let dx = view.focal_px * dot(tangent, view.right) - (screen.x - 0.5 * f32(view.size.x)) * away;
    let dy = -view.focal_px * dot(tangent, view.up) - (screen.y - 0.5 * f32(view.size.y)) * away;
    let size = sqrt(dx * dx + dy * dy);
    // A strand seen end on has no sideways direction; any will do.
    var across = vec2f(1.0, 0.0);
    if size > 1e-6 * view.focal_px {
        across = vec2f(-dy, dx) / size;
    }
    let width = 2.0 * point.w * view.focal_px / depth;
    let drawn = max(width, MIN_WIDTH_PX);
    let half_width = 0.5 * drawn * across;
    let snapped = round(vec4f(screen.xy + half_width, screen.xy - half_width) * 256.0);
    let kept = vec4i(clamp(snapped, vec4f(-MAX_SCREEN), vec4f(MAX_SCREEN)));
    // Exact: half of the picture is a whole number of units.
    edges[id.x] = kept - 128 * vec4i(view.size.xyxy);
    let z = (depth - view.near) / (view.far - view.near);
    depth_coverage[id.x] = bitcast<vec4u>(vec4f(z, width / drawn, 0.0, 0.0));
}
