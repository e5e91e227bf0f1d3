// What all passes of a frame need of each segment: which corners its two triangles join, the line
// along its middle, and its coverage. Segments that no pass can see get triangles without area.
// Twin: Ribbon in crates/cpu/src/raster/ribbons.rs.
// #import lib/view
// #import lib/ribbon

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> chunk: Chunk;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
@group(0) @binding(3) var<storage, read> edges: array<vec4i>;
// Bits of the depth, of the coverage here and at the segment's other end; the segment.
@group(0) @binding(4) var<storage, read_write> depth_coverage: array<vec4u>;
// By first point: where the middle starts (px from the upper left corner), and the direction
// along it over its length, so that a product gives the share of the way.
@group(0) @binding(5) var<storage, read_write> spines: array<vec4f>;
// Six a segment of the chunk. Vertex 2 p is the left edge of point p, 2 p + 1 the right one.
@group(0) @binding(6) var<storage, read_write> corners: array<u32>;

@compute @workgroup_size(256)
fn ribbons(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= chunk.n_segments {
        return;
    }
    let segment = chunk.first_segment + id.x;
    let first = segments[segment];
    let a = edges[first];
    let b = edges[first + 1u];
    let coverage = bitcast<f32>(depth_coverage[first].y);
    let next_coverage = bitcast<f32>(depth_coverage[first + 1u].y);
    let at = 6u * id.x;
    if coverage < 0.0 || next_coverage < 0.0 || !in_picture(view, a, b, 0) {
        // A vertex behind the last: in the middle of the picture, so that nothing is clipped.
        for (var corner = 0u; corner < 6u; corner++) {
            corners[at + corner] = 2u * view.n_points;
        }
        return;
    }
    let middle = 0.5 * vec2f(view.size);
    let start = vec2f(a.xy + a.zw) * (1.0 / 512.0) + middle;
    let along = vec2f(b.xy + b.zw) * (1.0 / 512.0) + middle - start;
    spines[first] = vec4f(start, along / max(dot(along, along), 1e-6));
    depth_coverage[first].z = bitcast<u32>(next_coverage);
    depth_coverage[first].w = segment;
    // Where the strand turns back on the screen its edges change sides.
    let side_a = vec2f(a.xy - a.zw);
    let side_b = vec2f(b.xy - b.zw);
    let turned = select(0u, 1u, dot(side_a, side_b) < 0.0);
    let left_a = 2u * first;
    let right_a = left_a + 1u;
    let left_b = left_a + 2u + turned;
    let right_b = left_a + 3u - turned;
    // Both triangles start at the first point: its vertices carry the segment.
    corners[at] = left_a;
    corners[at + 1u] = right_a;
    corners[at + 2u] = left_b;
    corners[at + 3u] = right_a;
    corners[at + 4u] = right_b;
    corners[at + 5u] = left_b;
}
