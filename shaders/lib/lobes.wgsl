// The lobes of TT and TRT as a fibre's textures hold them: rgba32uint, 16 numbers of 16 bits in
// two texels, read by textureLoad and mixed by hand.
// Twin: crates/scattering/src/closed_form/lobes.rs, which explains the layout.

// How the texels of one mode are placed and decoded.
struct LobeDecode {
    warp: f32,
    last: f32,
    lambda_scale: f32,
    amplitude_scale: f32,
    first_row: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

// The three lobes at one theta_d: widths, half offsets of the two pairs, amplitudes (RGB).
struct Lobes {
    lambda: vec3f,
    cos_half: vec2f,
    sin_half: vec2f,
    amplitude: array<vec3f, 3>,
}

// Two fractions between those of two words, 0..=1.
fn mix_fractions(low: u32, high: u32, fraction: f32) -> vec2f {
    return mix(unpack2x16unorm(low), unpack2x16unorm(high), fraction);
}

// Two 16 bit floats between those of two words.
fn mix_floats(low: u32, high: u32, fraction: f32) -> vec2f {
    return mix(unpack2x16float(low), unpack2x16float(high), fraction);
}

// The lobes at cos_theta_d >= 0.
fn sample_lobes(texture: texture_2d<u32>, decode: LobeDecode, cos_theta_d: f32) -> Lobes {
    let warp = decode.warp;
    let u = min((1.0 + warp) * cos_theta_d / (cos_theta_d + warp), 1.0);
    let at = u * decode.last;
    let first = min(floor(at), decode.last - 1.0);
    let fraction = at - first;
    let texel = vec2u(2u * u32(first), decode.first_row);
    let low_0 = textureLoad(texture, texel, 0);
    let low_1 = textureLoad(texture, texel + vec2u(1u, 0u), 0);
    let high_0 = textureLoad(texture, texel + vec2u(2u, 0u), 0);
    let high_1 = textureLoad(texture, texel + vec2u(3u, 0u), 0);
    let x = mix_fractions(low_0.x, high_0.x, fraction);
    let y = mix_fractions(low_0.y, high_0.y, fraction);
    let z = mix_fractions(low_0.z, high_0.z, fraction);
    let w = mix_fractions(low_0.w, high_0.w, fraction);
    // The low half of this word is a fraction: floats of it mean nothing.
    let a = mix_floats(low_0.w, high_0.w, fraction).y;
    let b = mix_floats(low_1.x, high_1.x, fraction);
    let c = mix_floats(low_1.y, high_1.y, fraction);
    let d = mix_floats(low_1.z, high_1.z, fraction);
    let e = mix_floats(low_1.w, high_1.w, fraction);
    let height = decode.amplitude_scale * u * u;
    return Lobes(
        decode.lambda_scale * vec3f(x, y.x),
        2.0 * vec2f(y.y, z.y) - 1.0,
        2.0 * vec2f(z.x, w.x) - 1.0,
        array<vec3f, 3>(
            height * vec3f(a, c.x, d.y),
            height * vec3f(b.x, c.y, e.x),
            height * vec3f(b.y, d.x, e.y),
        ),
    );
}
