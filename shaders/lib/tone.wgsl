// From linear radiance to what a screen shows. Twin: crates/scene/src/tone.rs, which explains
// the curve.

const TONE_NONE: u32 = 0u;
const TONE_FILMIC: u32 = 1u;
const TONE_AGX: u32 = 2u;
const TONE_LUT: u32 = 3u;

// sRGB in 0..=1 of linear Rec.709 radiance (exposure already applied).
fn display(rgb: vec3f, tone_map: u32) -> vec3f {
    var mapped = rgb;
    if tone_map == TONE_FILMIC {
        mapped = filmic(rgb);
    } else if tone_map == TONE_AGX {
        mapped = agx(rgb);
    }
    let x = clamp(mapped, vec3f(0.0), vec3f(1.0));
    return vec3f(srgb_from_linear(x.x), srgb_from_linear(x.y), srgb_from_linear(x.z));
}

// Stephen Hill's fit of the ACES transforms, linear Rec.709 in and out.
fn filmic(rgb: vec3f) -> vec3f {
    let bounded = clamp(rgb * 1.8, vec3f(0.0), vec3f(1e6));
    // By columns.
    let into = mat3x3f(
        0.59719, 0.07600, 0.02840,
        0.35458, 0.90834, 0.13383,
        0.04823, 0.01566, 0.83777);
    let out_of = mat3x3f(
        1.60475, -0.10208, -0.00327,
        -0.53108, 1.10813, -0.07276,
        -0.07367, -0.00605, 1.07602);
    let v = into * bounded;
    let curved = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081);
    return clamp(out_of * curved, vec3f(0.0), vec3f(1.0));
}

// Benjamin Wrensch's fit of AgX, linear Rec.709 in and out.
fn agx(rgb: vec3f) -> vec3f {
    let bounded = clamp(rgb, vec3f(0.0), vec3f(1e6));
    // By columns.
    let into = mat3x3f(
        0.8424791, 0.042328242, 0.042375655,
        0.0784336, 0.8784686, 0.0784336,
        0.079223745, 0.07916613, 0.879143);
    let out_of = mat3x3f(
        1.196879, -0.052896857, -0.052971635,
        -0.09802088, 1.1519031, -0.09804345,
        -0.09902974, -0.09896118, 1.1510737);
    // Stops at which the curve begins and ends.
    let first = -12.47393;
    let last = 4.026069;
    let stops = clamp(log2(max(into * bounded, vec3f(1e-10))), vec3f(first), vec3f(last));
    let x = (stops - first) / (last - first);
    let above = (15.5 * x - 40.14) * x + 31.96;
    let curved = (((above * x - 6.868) * x + 0.4298) * x + 0.1191) * x - 0.00232;
    // The curve is made for a display of gamma 2.2.
    return pow(clamp(out_of * curved, vec3f(0.0), vec3f(1.0)), vec3f(2.2));
}

// The sRGB transfer curve (IEC 61966-2-1), 0..=1 to 0..=1.
fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.0031308 {
        return 12.92 * x;
    }
    return 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

// What is added to the levels of a pixel before they are rounded, within half a level.
fn dither(pixel: vec2u) -> f32 {
    let x = pixel.x & 7u;
    let y = (pixel.x ^ pixel.y) & 7u;
    // Bits of both by turns, the lowest first and highest.
    let rank = ((y & 1u) << 5u) | ((x & 1u) << 4u) | ((y & 2u) << 2u) | ((x & 2u) << 1u)
        | ((y & 4u) >> 1u) | (x >> 2u);
    return (f32(rank) - 31.5) / 64.0;
}

// The 8-bit levels of values in 0..=1 at a place with this dither.
fn level(value: vec4f, dither: f32) -> vec4f {
    return floor(clamp(value, vec4f(0.0), vec4f(1.0)) * 255.0 + dither + 0.5);
}
