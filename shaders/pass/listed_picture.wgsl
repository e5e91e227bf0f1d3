// The picture of a visibility list that `pass/listed_pixels` made: the list of each pixel times the radiance of its points,
// and what the surfaces behind the hair send back. Twin: crates/cpu/src/frame/resolve.rs.
// #import lib/view
// #import lib/visible_list
// #if NARROW
// #import lib/along_segments
// #endif
// #if PROXIES
// #import lib/proxy
// #endif

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> list: ListLayout;
// Row by row.
@group(0) @binding(8) var<storage, read_write> pixels: array<Pixel>;
// Three words for each entry: the first point, where in the ribbon it is, see `packed_place` of `pass/listed_pixels`, and its
// weight.
@group(0) @binding(10) var<storage, read_write> hits: array<u32>;
@group(0) @binding(14) var<storage, read> radiance: array<vec4f>;
// Sum of one sample.
@group(0) @binding(15) var<storage, read_write> picture: array<vec4f>;
// #if NARROW
// Of narrow lights, [point][half].
@group(0) @binding(16) var<storage, read> along: array<vec4u>;
// #endif
// #if PROXIES
@group(0) @binding(17) var<uniform> proxies: Proxies;
// #endif
// [pixel], those with the largest weight of their kind.
@group(0) @binding(18) var<storage, read_write> behind: array<array<SeenSurface, N_BEHIND>>;
// [proxy][row][column], then [surface] of meshes: (rgb, 0), times the view's radiance scale.
@group(0) @binding(19) var<storage, read> light_maps: array<vec4f>;
// #if MESHES
@group(0) @binding(23) var<storage, read> triangles: array<Triangle>;
// #endif

// #if NARROW
fn light_along(first: u32, t: f32) -> vec3f {
    return along_segment(along[2u * first + 1u], along[2u * first + 2u], t);
}
// #else
fn light_along(first: u32, t: f32) -> vec3f {
    return vec3f(0.0);
}
// #endif

// Radiance of an entry.
fn radiance_of(first: u32, place: u32) -> vec3f {
    let t = f32(place & 65535u) / 65535.0;
    let across = f32(extractBits(i32(place), 16u, 8u)) / 127.0;
    let across_2 = f32(place >> 24u) / 255.0;
    let a = radiance[first];
    let b = radiance[first + 1u];
    let rgb = mix(a.rgb, b.rgb, t) + light_along(first, t);
    // All zeros where there are no wide strands.
    let mean = max((rgb.r + rgb.g + rgb.b) / 3.0, 1e-30);
    let side = clamp(mix(a.w, b.w, t) / mean, -1.0, 1.0);
    return rgb * (1.0 + side * across + list.even.rgb * (1.5 * across_2 - 0.5));
}

// #if NARROW
fn is_lit_along(first: u32) -> bool {
    return any(along[2u * first + 1u] != vec4u(0u)) && any(along[2u * first + 2u] != vec4u(0u));
}
// #else
fn is_lit_along(first: u32) -> bool {
    return false;
}
// #endif

// Were both ends of a segment lit? Points that were not are black.
fn is_lit(first: u32) -> bool {
    let are_lit = any(radiance[first].rgb != vec3f(0.0)) && any(radiance[first + 1u].rgb != vec3f(0.0));
    return are_lit || is_lit_along(first);
}

// #if MESHES
// Linear over the triangle, at a place of the picture.
fn sent_back_by_triangle(triangle: u32, at: vec2f) -> vec3f {
    let seen_triangle = triangles[triangle];
    let from_picture_middle = at - 0.5 * vec2f(view.size);
    var sum = vec3f(0.0);
    var shares = 0.0;
    for (var ix = 0u; ix < 3u; ix++) {
        // A place beside the triangle is taken for one on its edge.
        let at_place = seen_triangle.sides[ix].x + dot(seen_triangle.sides[ix].yz, from_picture_middle);
        let side = max(sign(seen_triangle.depth) * at_place, 0.0);
        sum += side * light_maps[seen_triangle.corners[ix]].rgb;
        shares += side;
    }
    return sum / max(shares, 1e-30);
}
// #else
fn sent_back_by_triangle(triangle: u32, at: vec2f) -> vec3f {
    return vec3f(0.0);
}
// #endif

// #if PROXIES
fn sent_back(surface: u32, middle: vec2f, position: vec3f) -> vec3f {
    if surface >= proxies.n {
        return sent_back_by_triangle(surface - proxies.n, middle);
    }
    let texels = light_map_texels(proxies.list[surface], surface, position);
    let row_0 = mix(light_maps[texels.corners.x], light_maps[texels.corners.y], texels.f.x);
    let row_1 = mix(light_maps[texels.corners.z], light_maps[texels.corners.w], texels.f.x);
    return mix(row_0, row_1, texels.f.y).rgb;
}

// What the surfaces of a pixel with this middle add to its sums: rgb and coverage.
fn radiance_behind(pixel: u32, middle: vec2f) -> vec4f {
    var sum = vec4f(0.0);
    for (var ix = 0u; ix < N_BEHIND; ix++) {
        let found = behind[pixel][ix];
        if found.weight > 0.0 {
            let at = middle + unpack2x16snorm(found.moved);
            let direction = ray_direction(view, at);
            let way = found.depth / dot(direction, view.forward);
            sum += found.weight * vec4f(sent_back(found.surface, at, view.eye + way * direction), 1.0);
        }
    }
    return sum;
}
// #else
fn radiance_behind(pixel: u32, middle: vec2f) -> vec4f {
    return vec4f(0.0);
}
// #endif

// A thread for each pixel of the band.
@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    let at = vec2u(id.x, list.first_row + id.y);
    if at.x >= view.extent.x || at.y >= list.end_row {
        return;
    }
    let pixel = at.x + view.extent.x * at.y;
    let end = atomicLoad(&pixels[pixel].next);
    var sum = vec4f(0.0);
    var of_lit = vec4f(0.0);
    for (var ix = 1u; ix <= pixels[pixel].n_entries; ix++) {
        let entry = 3u * (end - ix);
        let weight = bitcast<f32>(hits[entry + 2u]);
        let one = weight * vec4f(radiance_of(hits[entry], hits[entry + 1u]), 1.0);
        sum += one;
        if list.is_draft != 0u && is_lit(hits[entry]) {
            of_lit += one;
        }
    }
    if of_lit.a > 0.0 {
        // What was lit stands for what was not.
        sum = of_lit * (sum.a / of_lit.a);
    } else if list.is_draft != 0u && all(sum.rgb == vec3f(0.0)) {
        // It is not there yet.
        sum = vec4f(0.0);
    }
    picture[pixel] = sum + radiance_behind(pixel, vec2f(view.origin + at) + 0.5);
}
