// The lobes of TT and TRT as a fibre's textures hold them: rgba32uint, 16 numbers of 16 bits in
// two texels, read by textureLoad and mixed by hand.
// Twin: crates/scattering/src/closed_form/lobes.rs, which explains the layout.

// How the texels of one mode are placed and decoded.
struct LobeDecode {
    offset: array<vec4f, 4>,
    scale: array<vec4f, 4>,
    warp: f32,
    last: f32,
    first_row: u32,
    padding: u32,
}

// The three lobes at one theta_d: widths, half offsets of the two pairs, amplitudes (RGB).
struct Lobes {
    lambda: vec3f,
    cos_half: vec2f,
    sin_half: vec2f,
    amplitude: array<vec3f, 3>,
}

// Four of the 16 numbers, 0..=65535.
fn unpack_numbers(texel: vec2u) -> vec4f {
    return vec4f(vec4u(texel.x & 0xffffu, texel.x >> 16u, texel.y & 0xffffu, texel.y >> 16u));
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
    let x = decode.offset[0] + decode.scale[0]
        * mix(unpack_numbers(low_0.xy), unpack_numbers(high_0.xy), fraction);
    let y = decode.offset[1] + decode.scale[1]
        * mix(unpack_numbers(low_0.zw), unpack_numbers(high_0.zw), fraction);
    let z = decode.offset[2] + decode.scale[2]
        * mix(unpack_numbers(low_1.xy), unpack_numbers(high_1.xy), fraction);
    let w = decode.offset[3] + decode.scale[3]
        * mix(unpack_numbers(low_1.zw), unpack_numbers(high_1.zw), fraction);
    let square = u * u;
    return Lobes(
        x.xyz,
        vec2f(x.w, y.y),
        vec2f(y.x, y.z),
        array<vec3f, 3>(
            square * vec3f(y.w, z.z, w.y),
            square * vec3f(z.x, z.w, w.z),
            square * vec3f(z.y, w.x, w.w),
        ),
    );
}
