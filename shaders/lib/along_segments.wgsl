// Single scattering of narrow lights along segments: at eight places about every point, four on the half of
// the segment before it and four on that after it, from the root on.
// Twin: crates/cpu/src/along_segments.rs, which says why.

// Places about a point, and on a half.
const N_PLACES: u32 = 8u;
const HALF: u32 = 4u;

// Square of the length below which the sum of two tangents, or of two normals across that, has no direction.
const LEAST_NORMAL: f32 = 1e-6;

// Bits of the mantissas of packed radiance, and how far its exponent is off.
const MANTISSA_BITS: i32 = 9;
const EXPONENT_BIAS: i32 = 15;

// An answer of a map, whose places lie evenly over both halves of the given lengths together, at the
// places about a point.
fn even_halves(answer: u32, before: f32, after: f32) -> u32 {
    if before == after {
        return answer;
    }
    let middle = f32(N_PLACES) * before / (before + after);
    var lit = 0u;
    for (var place = 0u; place < N_PLACES; place++) {
        let is_after = place >= HALF;
        let start = select(0.0, middle, is_after);
        let length = select(middle, f32(N_PLACES) - middle, is_after);
        let share = (f32(place % HALF) + 0.5) / f32(HALF);
        let source = min(u32(start + length * share), N_PLACES - 1u);
        lit |= ((answer >> source) & 1u) << place;
    }
    return lit;
}

// Three numbers, none below 0, with one exponent: right to 1e-3 of the largest.
fn pack_radiance(rgb: vec3f) -> u32 {
    let largest = clamp(max(max(rgb.r, rgb.g), rgb.b), 0.0, 65000.0);
    if largest < 1e-7 {
        return 0u;
    }
    // So that the largest mantissa, rounded, stays below 2^9.
    let exponent = max(i32(floor(log2(largest * 1.002))), -EXPONENT_BIAS - 1) + 1;
    let scale = ldexp(1.0, MANTISSA_BITS - exponent);
    let mantissas = vec3u(clamp(rgb * scale + 0.5, vec3f(0.0), vec3f(511.0)));
    let bits = u32(exponent + EXPONENT_BIAS) << 27u;
    return mantissas.r | (mantissas.g << 9u) | (mantissas.b << 18u) | bits;
}

fn unpack_radiance(bits: u32) -> vec3f {
    let mantissas = vec3f(vec3u(bits, bits >> 9u, bits >> 18u) & vec3u(511u));
    return mantissas * ldexp(1.0, i32(bits >> 27u) - EXPONENT_BIAS - MANTISSA_BITS);
}

// Radiance at share `t` of the way from a point to the next, by the half after that and the half before this.
fn along_segment(first: vec4u, second: vec4u, t: f32) -> vec3f {
    let place = min(u32(t * f32(N_PLACES)), N_PLACES - 1u);
    if place < HALF {
        return unpack_radiance(first[place]);
    }
    return unpack_radiance(second[place - HALF]);
}
