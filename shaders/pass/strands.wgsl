// Draws every segment as a ribbon of two triangles facing the camera; a ribbon thinner than a
// pixel takes a share of the samples, chosen so that every order of layers comes out right.
// Twin: crates/bake/src/cpu/raster.rs.
// #import lib/view
// #import lib/sampling

struct Pass {
    // 1/256 px
    jitter: vec2i,
    pass_ix: u32,
    pad: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> current: Pass;
@group(0) @binding(2) var<storage, read> segments: array<u32>;
@group(0) @binding(3) var<storage, read> edges: array<vec4i>;
@group(0) @binding(4) var<storage, read> depth_coverage: array<vec2f>;
@group(0) @binding(5) var<storage, read> radiance: array<vec4f>;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) segment: u32,
}

@vertex
fn ribbon(@builtin(vertex_index) vertex: u32) -> Corner {
    let segment = vertex / 6u;
    let corner = vertex % 6u;
    let first = segments[segment];
    let a = edges[first];
    var b = edges[first + 1u];
    let a_depth = depth_coverage[first];
    let b_depth = depth_coverage[first + 1u];
    var out: Corner;
    out.segment = segment;
    if a_depth.y < 0.0 || b_depth.y < 0.0 {
        // Outside of the depth range: clipped.
        out.position = vec4f(0.0, 0.0, 2.0, 1.0);
        return out;
    }
    // Where the strand turns back on the screen its edges change sides.
    let side_a = vec2f(a.xy - a.zw);
    let side_b = vec2f(b.xy - b.zw);
    if dot(side_a, side_b) < 0.0 {
        b = b.zwxy;
    }
    // Corners: left a, right a, left b; left b, right a, right b.
    var at = a.xy;
    var z = a_depth.x;
    if corner == 1u || corner == 4u {
        at = a.zw;
    } else if corner == 2u || corner == 3u {
        at = b.xy;
        z = b_depth.x;
    } else if corner == 5u {
        at = b.zw;
        z = b_depth.x;
    }
    let px = vec2f(at + current.jitter) * (1.0 / 256.0);
    let ndc = px / vec2f(view.size) * 2.0 - 1.0;
    out.position = vec4f(ndc.x, -ndc.y, z, 1.0);
    return out;
}

struct Covered {
    @location(0) color: vec4f,
    @builtin(sample_mask) mask: u32,
}

@fragment
fn cover(in: Corner) -> Covered {
    let first = segments[in.segment];
    let edges_a = edges[first];
    let edges_b = edges[first + 1u];
    let a = vec2f(edges_a.xy + edges_a.zw + 2 * current.jitter) * (1.0 / 512.0);
    let b = vec2f(edges_b.xy + edges_b.zw + 2 * current.jitter) * (1.0 / 512.0);
    // How far along the segment the middle of this pixel is.
    let along = b - a;
    let pixel = floor(in.position.xy);
    let t = clamp(dot(pixel + 0.5 - a, along) / max(dot(along, along), 1e-6), 0.0, 1.0);
    let alpha = mix(depth_coverage[first].y, depth_coverage[first + 1u].y, t);
    let key = coverage_key(in.segment, u32(pixel.x), u32(pixel.y));
    var out: Covered;
    out.color = vec4f(mix(radiance[first].rgb, radiance[first + 1u].rgb, t), 1.0);
    out.mask = coverage_mask(alpha, current.pass_ix, key);
    return out;
}
