// Draws every segment as a ribbon of two triangles facing the camera; a ribbon thinner than a
// pixel takes a share of the samples, chosen so that every order of layers comes out right. Bent segments and tips of
// close-ups come in pieces.
// Twin: crates/cpu/src/raster.rs.
// #import lib/view
// #import lib/sampling
// #if NARROW
// #import lib/along_segments
// #endif
// #if CLOSE_UP
// #import lib/piece
// #endif

struct Pass {
    // 1/256 px
    jitter: vec2i,
    pass_ix: u32,
    // Samples of the pass that count, the first ones.
    n_samples: u32,
    // Of wide strands: WidthProfile.even of lib/width_profile.
    even: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> current: Pass;
// Two vertices a point: the left edge and the right edge.
@group(0) @binding(2) var<storage, read> edges: array<vec2i>;
// By point: bits of depth, coverage here and at the next point; the segment that starts here.
@group(0) @binding(3) var<storage, read> depth_coverage: array<vec4u>;
@group(0) @binding(4) var<storage, read> spines: array<vec4f>;
@group(0) @binding(5) var<storage, read> radiance: array<vec4f>;
// #if NARROW
// Of narrow lights, [point][half].
@group(0) @binding(7) var<storage, read> along: array<vec4u>;
// #endif

// #if CLOSE_UP
@group(0) @binding(8) var<storage, read> pieces: array<Piece>;
// #endif

// #if HOSTED
// How the host of the pass projects.
struct Host {
    // Depth is depth.x + depth.y / d, where d cm is the depth along the line of sight.
    depth: vec2f,
    // What the projection moves the picture by, in halves of its sides, y upwards.
    shift: vec2f,
    // Upper left corner of the viewport, px.
    corner: vec2f,
    // From the radiance of the points to linear radiance.
    scale: f32,
    pad: f32,
}

@group(0) @binding(6) var<uniform> host: Host;
// #endif

// The viewport's side is a power of two, mostly 8192 px, with what is drawn of the picture in its
// middle: ribbons that cross the border need no clipping. See viewport_side in
// crates/render/src/passes/draw.rs.
override CLIP_PER_UNIT: f32 = 0.00000095367431640625;

struct Corner {
    @builtin(position) position: vec4f,
    // The segment's, from the first vertex of each triangle, so that fragments read no buffers.
    @location(0) @interpolate(flat, first) spine: vec4f,
    @location(1) @interpolate(flat, first) here: vec4f,
    @location(2) @interpolate(flat, first) next: vec4f,
    @location(3) @interpolate(flat, first) segment: u32,
// #if NARROW
    // On the segment's first half, and on its second.
    @location(4) @interpolate(flat, first) along_here: vec4u,
    @location(5) @interpolate(flat, first) along_next: vec4u,
// #endif
// #if WIDE
    // Half of the width here and at the next point, px; then the sides of the radiance, see pass/shade.
    @location(6) @interpolate(flat, first) wide: vec4f,
// #endif
// #if CLOSE_UP
    // The share of the segment's way where the spine begins, and how much of that way it is.
    @location(7) @interpolate(flat, first) part: vec2f,
// #endif
}

// What fragments need of a segment, or of its part with a spine of its own.
fn of_segment(first: u32, spine: vec4f) -> Corner {
    var out: Corner;
    let ends = depth_coverage[first];
    let next = min(first + 1u, view.n_points - 1u);
    out.spine = vec4f(spine.xy + vec2f(current.jitter) * (1.0 / 256.0), spine.zw);
    out.here = vec4f(radiance[first].rgb, bitcast<f32>(ends.y));
    out.next = vec4f(radiance[next].rgb, bitcast<f32>(ends.z));
    out.segment = ends.w;
// #if NARROW
    out.along_here = along[2u * first + 1u];
    out.along_next = along[min(2u * first + 2u, 2u * view.n_points - 1u)];
// #endif
// #if WIDE
    let here_across = vec2f(edges[2u * first] - edges[2u * first + 1u]);
    let next_across = vec2f(edges[2u * next] - edges[2u * next + 1u]);
    let half_widths = vec2f(length(here_across), length(next_across)) * (0.5 / 256.0);
    out.wide = vec4f(half_widths, radiance[first].w, radiance[next].w);
// #endif
// #if CLOSE_UP
    out.part = vec2f(0.0, 1.0);
// #endif
    return out;
}

// An edge in 1/256 px from the middle of the picture, at a depth in 0..1.
fn position(edge: vec2i, z: f32) -> vec4f {
// #if HOSTED
    let ndc = vec2f(edge) / (128.0 * vec2f(view.size)) * vec2f(1.0, -1.0);
    let depth = mix(view.near, view.far, z);
    return vec4f(ndc + host.shift, host.depth.x + host.depth.y / depth, 1.0);
// #else
    // From the middle of the picture to that of the part that is drawn.
    let moved = 256 * vec2i(view.origin) + 128 * vec2i(view.extent) - 128 * vec2i(view.size);
    let at = vec2f(edge + current.jitter - moved) * CLIP_PER_UNIT;
    return vec4f(at.x, -at.y, z, 1.0);
// #endif
}

@vertex
fn ribbon(@builtin(vertex_index) vertex: u32) -> Corner {
    let point = vertex / 2u;
    if point >= view.n_points {
        var out: Corner;
        out.position = vec4f(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    var out = of_segment(point, spines[point]);
    out.position = position(edges[vertex], bitcast<f32>(depth_coverage[point].x));
    return out;
}

// #if CLOSE_UP
// Six vertices a piece.
@vertex
fn piece(@builtin(vertex_index) vertex: u32) -> Corner {
    let piece = pieces[vertex / 6u];
    let middle = 0.5 * vec2f(view.size);
    let start = vec2f(piece.begin.xy + piece.begin.zw) * (1.0 / 512.0) + middle;
    let along = vec2f(piece.end.xy + piece.end.zw) * (1.0 / 512.0) + middle - start;
    var out = of_segment(piece.first, vec4f(start, along / max(dot(along, along), 1e-6)));
    let part = unpack2x16unorm(piece.part);
    out.part = vec2f(part.x, part.y - part.x);
    // As the corners of a segment: left, right, left at the end; right, right at the end, left at the end.
    let corner = vertex % 6u;
    let is_end = corner == 2u || corner >= 4u;
    let edges = select(piece.begin, piece.end, is_end);
    let is_right = corner == 1u || corner == 3u || corner == 4u;
    out.position = position(select(edges.xy, edges.zw, is_right), select(piece.depth.x, piece.depth.y, is_end));
    return out;
}
// #endif

struct Covered {
    @location(0) color: vec4f,
    @builtin(sample_mask) mask: u32,
}

@fragment
fn cover(in: Corner) -> Covered {
    // How far along the segment the middle of this pixel is.
// #if HOSTED
    let pixel = floor(in.position.xy - host.corner);
    let moved = 0.5 * host.shift * vec2f(view.size) * vec2f(1.0, -1.0);
// #else
    let pixel = floor(in.position.xy) + vec2f(view.origin);
    let moved = vec2f(0.0);
// #endif
    var t = clamp(dot(pixel + 0.5 - moved - in.spine.xy, in.spine.zw), 0.0, 1.0);
// #if CLOSE_UP
    t = in.part.x + in.part.y * t;
// #endif
    var value = mix(in.here, in.next, t);
// #if NARROW
    value += vec4f(along_segment(in.along_here, in.along_next, t), 0.0);
// #endif
// #if WIDE
    if max(in.wide.x, in.wide.y) > 0.5 * WIDE_PX {
        let along = in.spine.zw;
        let to = pixel + 0.5 - moved - in.spine.xy;
        let off = (along.x * to.y - along.y * to.x) / length(along);
        let across = clamp(off / mix(in.wide.x, in.wide.y, t), -1.0, 1.0);
        let mean = max((value.r + value.g + value.b) / 3.0, 1e-30);
        let side = clamp(mix(in.wide.z, in.wide.w, t) / mean, -1.0, 1.0);
        let second = 1.5 * across * across - 0.5;
        value *= vec4f(1.0 + side * across + current.even.rgb * second, 1.0);
    }
// #endif
    let key = coverage_key(in.segment, u32(pixel.x), u32(pixel.y));
    var out: Covered;
// #if HOSTED
    out.color = vec4f(value.rgb * host.scale, 1.0);
// #else
    out.color = vec4f(value.rgb, 1.0);
// #endif
    out.mask = coverage_mask(value.a, current.pass_ix, key);
    return out;
}
