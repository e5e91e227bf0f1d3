// Opaque, matte things beside the hair: ellipsoids, and a ground. Twin: crates/scene/src/proxy.rs.

struct Proxy {
    // Rows of the map from world space to where the ellipsoid is the unit sphere, the shift in w.
    // Of the ground: x and z over the width of its light map, y the height above it in cm.
    to_unit: array<vec4f, 3>,
    // Rows of the map back.
    from_unit: array<vec4f, 3>,
    albedo: vec3f,
    // GROUND or not.
    kind: u32,
}

struct Proxies {
    list: array<Proxy, 8>,
    n: u32,
    pad_0: u32,
    pad_1: u32,
    pad_2: u32,
}

const GROUND: u32 = 1u;
// Texels along each side of a proxy's light map.
const LIGHT_MAP_SIDE: u32 = 128u;
// What entry_distance answers where nothing is hit.
const NO_HIT: f32 = -1.0;

fn to_unit(proxy: Proxy, position: vec3f) -> vec3f {
    let p = vec4f(position, 1.0);
    return vec3f(dot(proxy.to_unit[0], p), dot(proxy.to_unit[1], p), dot(proxy.to_unit[2], p));
}

fn turned_to_unit(proxy: Proxy, direction: vec3f) -> vec3f {
    return vec3f(dot(proxy.to_unit[0].xyz, direction), dot(proxy.to_unit[1].xyz, direction),
        dot(proxy.to_unit[2].xyz, direction));
}

fn from_unit(proxy: Proxy, unit: vec3f) -> vec3f {
    let p = vec4f(unit, 1.0);
    return vec3f(dot(proxy.from_unit[0], p), dot(proxy.from_unit[1], p), dot(proxy.from_unit[2], p));
}

// Whether the proxy stands before a light in `direction`. Points inside it count as if they lay on
// its surface.
fn is_blocked_by(proxy: Proxy, position: vec3f, direction: vec3f) -> bool {
    if proxy.kind == GROUND {
        return direction.y < 0.0;
    }
    let q = to_unit(proxy, position);
    let e = turned_to_unit(proxy, direction);
    let b = dot(q, e);
    return b < 0.0 && b * b > dot(e, e) * (dot(q, q) - 1.0);
}

// Distance along a unit direction to the surface, from outside; NO_HIT where there is none.
fn entry_distance(proxy: Proxy, origin: vec3f, direction: vec3f) -> f32 {
    let q = to_unit(proxy, origin);
    let e = turned_to_unit(proxy, direction);
    if proxy.kind == GROUND {
        return select(NO_HIT, q.y / max(-e.y, 1e-20), q.y > 0.0 && e.y < 0.0);
    }
    let b = dot(q, e);
    let a = dot(e, e);
    // Not q^2 - 1: the part of q across the ray, which does not cancel far away.
    let across = q - e * (b / a);
    let square = (1.0 - dot(across, across)) * a;
    let is_hit = dot(q, q) > 1.0 && b < 0.0 && square > 0.0;
    return select(NO_HIT, (-b - sqrt(max(square, 0.0))) / a, is_hit);
}

// Unit normal, outwards, at a point on the surface.
fn surface_normal(proxy: Proxy, position: vec3f) -> vec3f {
    if proxy.kind == GROUND {
        return vec3f(0.0, 1.0, 0.0);
    }
    let q = to_unit(proxy, position);
    return normalize(proxy.to_unit[0].xyz * q.x + proxy.to_unit[1].xyz * q.y
        + proxy.to_unit[2].xyz * q.z);
}

// The point of the surface in the middle of a texel of the light map. Rows go from the top of an
// ellipsoid to its bottom, columns around it; the ground's go to infinity on all sides.
fn texel_position(proxy: Proxy, texel: vec2u) -> vec3f {
    let at = (vec2f(texel) + 0.5) / f32(LIGHT_MAP_SIDE);
    if proxy.kind == GROUND {
        let w = 2.0 * at - 1.0;
        let far = w / (1.0 - abs(w));
        return from_unit(proxy, vec3f(far.x, 0.0, far.y));
    }
    let azimuth = 6.2831855 * at.x;
    let polar = 3.1415927 * at.y;
    let unit = vec3f(sin(polar) * sin(azimuth), cos(polar), sin(polar) * cos(azimuth));
    return from_unit(proxy, unit);
}

// The place of a point of the surface in the light map, texels from the corner.
fn light_map_place(proxy: Proxy, position: vec3f) -> vec2f {
    let q = to_unit(proxy, position);
    if proxy.kind == GROUND {
        let w = q.xz / (1.0 + abs(q.xz));
        return (0.5 * w + 0.5) * f32(LIGHT_MAP_SIDE);
    }
    let azimuth = atan2(q.x, q.z) / 6.2831855;
    let polar = acos(clamp(q.y / length(q), -1.0, 1.0)) / 3.1415927;
    return vec2f(azimuth - floor(azimuth), polar) * f32(LIGHT_MAP_SIDE);
}

// The texels of all light maps between which a point of the surface lies.
struct LightMapTexels {
    // Left and right of the upper row, then of the lower.
    corners: vec4u,
    // From the left to the right ones, and from the upper to the lower, 0..=1.
    f: vec2f,
}

fn light_map_texel(proxy: Proxy, ix: u32, column: i32, row: i32) -> u32 {
    let side = i32(LIGHT_MAP_SIDE);
    // Around an ellipsoid; the ground's outermost texels are far away.
    var x = clamp(column, 0, side - 1);
    if proxy.kind != GROUND {
        x = (column + side) % side;
    }
    let y = clamp(row, 0, side - 1);
    return u32(i32(ix) * side * side + y * side + x);
}

// Those of proxy `ix`.
fn light_map_texels(proxy: Proxy, ix: u32, position: vec3f) -> LightMapTexels {
    let at = light_map_place(proxy, position) - 0.5;
    let base = floor(at);
    let x = i32(base.x);
    let y = i32(base.y);
    let corners = vec4u(
        light_map_texel(proxy, ix, x, y),
        light_map_texel(proxy, ix, x + 1, y),
        light_map_texel(proxy, ix, x, y + 1),
        light_map_texel(proxy, ix, x + 1, y + 1),
    );
    return LightMapTexels(corners, at - base);
}
