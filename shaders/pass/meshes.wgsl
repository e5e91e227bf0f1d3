// Draws the triangles of meshes before the strands of a pass, in the light of their vertices.
// Twin: crates/cpu/src/triangles.rs, which asks rays instead.
// #import lib/view

struct Pass {
    // 1/256 px
    jitter: vec2i,
    pass_ix: u32,
    // Samples of the pass that count, the first ones.
    n_samples: u32,
    even: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> current: Pass;
// [surface] position, normal, albedo
@group(0) @binding(2) var<storage, read> surfaces: array<array<vec4f, 3>>;
// [triangle][corner]: which surface.
@group(0) @binding(3) var<storage, read> corners: array<u32>;
// [surface] (rgb, 0), times the view's radiance scale.
@group(0) @binding(4) var<storage, read> light_maps: array<vec4f>;

// Depths are kept off the far plane, which is the background.
const LARGEST_DEPTH: f32 = 0.9999999;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(perspective, centroid) color: vec3f,
    // Along the line of sight, cm.
    @location(1) @interpolate(perspective, centroid) depth: f32,
}

@vertex
fn corner_of_triangle(@builtin(vertex_index) vertex: u32) -> Corner {
    let surface = corners[vertex];
    let from_eye = surfaces[surface][0].xyz - view.eye;
    let depth = dot(from_eye, view.forward);
    let across = vec2f(dot(from_eye, view.right), -dot(from_eye, view.up));
    // Times the depth, px from the upper left corner of the part that is drawn.
    let middle = 0.5 * vec2f(view.size) - vec2f(view.origin) + vec2f(current.jitter) * (1.0 / 256.0);
    let at = view.focal_px * across + middle * depth;
    let clip = 2.0 * at / vec2f(view.extent) - depth;
    // The hair alone decides near and far plane; nothing is cut off there.
    return Corner(vec4f(clip.x, -clip.y, 0.5 * depth, depth), light_maps[surface].rgb, depth);
}

struct Covered {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn cover_triangle(in: Corner) -> Covered {
    let z = (in.depth - view.near) / (view.far - view.near);
    return Covered(vec4f(in.color, 1.0), clamp(z, 0.0, LARGEST_DEPTH));
}
