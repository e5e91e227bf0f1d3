// Where the ribbon's two edges are on the screen at every point. Twin: crates/cpu/src/project.rs.
// #import lib/view
// #import lib/screen_point

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> points: array<vec4f>;
@group(0) @binding(2) var<storage, read> tangents: array<vec4f>;
// Left edge x, y, right edge x, y from the middle of the picture in 1/256 px.
@group(0) @binding(3) var<storage, read_write> edges: array<vec4i>;
// Bits of the depth in 0..1 between the near and far planes, and of the coverage; below zero: not
// drawn. The other two words belong to `pass/ribbons`.
@group(0) @binding(4) var<storage, read_write> depth_coverage: array<vec4u>;

@compute @workgroup_size(256)
fn project(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= view.n_points {
        return;
    }
    let point = screen_point(view, points[id.x], tangents[id.x].xyz, SAMPLED_WIDTH_PX);
    depth_coverage[id.x] = bitcast<vec4u>(vec4f(point.depth, point.coverage, 0.0, 0.0));
    edges[id.x] = select(edges_at(view, point), vec4i(0), point.coverage < 0.0);
}
