// Draws the proxies before the strands of a pass: one triangle over the picture for each; the
// samples whose rays meet the proxy are covered. Twin: crates/cpu/src/proxies.rs.
// #import lib/view
// #import lib/proxy

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
@group(0) @binding(2) var<uniform> proxies: Proxies;
// [proxy][row][column] (rgb, 0), times the view's radiance scale.
@group(0) @binding(3) var<storage, read> light_maps: array<vec4f>;

// Depths are kept off the far plane, which is the background.
const LARGEST_DEPTH: f32 = 0.9999999;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) proxy: u32,
}

@vertex
fn whole_picture(@builtin(vertex_index) vertex: u32, @builtin(instance_index) proxy: u32) -> Corner {
    let at = vec2f(f32(vertex & 1u), f32(vertex >> 1u)) * 4.0 - 1.0;
    return Corner(vec4f(at, 0.0, 1.0), proxy);
}

// Bilinear.
fn sent_back(proxy: u32, position: vec3f) -> vec3f {
    let texels = light_map_texels(proxies.list[proxy], proxy, position);
    let row_0 = mix(light_maps[texels.corners.x], light_maps[texels.corners.y], texels.f.x);
    let row_1 = mix(light_maps[texels.corners.z], light_maps[texels.corners.w], texels.f.x);
    return mix(row_0, row_1, texels.f.y).rgb;
}

// What the rays through the samples of a pixel meet.
struct Met {
    mask: u32,
    n: f32,
    // Sums of positions from the eye, cm.
    way: vec3f,
}

fn meet(before: Met, proxy: u32, at_px: vec2f, bit: u32) -> Met {
    let direction = ray_direction(view, at_px - vec2f(current.jitter) * (1.0 / 256.0));
    let distance = entry_distance(proxies.list[proxy], view.eye, direction);
    if distance <= 0.0 {
        return before;
    }
    return Met(before.mask | bit, before.n + 1.0, before.way + distance * direction);
}

struct Covered {
    @location(0) color: vec4f,
    @builtin(sample_mask) mask: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn cover_proxy(in: Corner) -> Covered {
    let pixel = floor(in.position.xy) + vec2f(view.origin);
    var met = Met(0u, 0.0, vec3f(0.0));
    met = meet(met, in.proxy, pixel + vec2f(96.0, 32.0) / 256.0, 1u);
    met = meet(met, in.proxy, pixel + vec2f(224.0, 96.0) / 256.0, 2u);
    met = meet(met, in.proxy, pixel + vec2f(32.0, 160.0) / 256.0, 4u);
    met = meet(met, in.proxy, pixel + vec2f(160.0, 224.0) / 256.0, 8u);
    if met.mask == 0u {
        discard;
    }
    let way = met.way / met.n;
    var out: Covered;
    out.color = vec4f(sent_back(in.proxy, view.eye + way), 1.0);
    out.mask = met.mask;
    let z = (dot(way, view.forward) - view.near) / (view.far - view.near);
    out.depth = clamp(z, 0.0, LARGEST_DEPTH);
    return out;
}
