// The lobes of TT and TRT as a fibre's textures hold them: rgba32uint, 16 numbers of 16 bits in
// two texels, read by textureLoad and mixed by hand.
// Twin: crates/scattering/src/closed_form/lobes.rs, which explains the layout.

// Share of texels that are even in cos(theta_d).
const EVEN_TEXELS: f32 = 0.4;

// How the texels of one mode are placed and decoded.
struct LobeDecode {
    warp: f32,
    last: f32,
    lambda_scale: f32,
    amplitude_scale: f32,
    first_row: u32,
    eta_first: f32,
    eta_scale: f32,
    last_row: f32,
}

// The three lobes at one theta_d: widths, half offsets of the two pairs, amplitudes (RGB).
struct Lobes {
    lambda: vec3f,
    cos_half: vec2f,
    sin_half: vec2f,
    amplitude: array<vec3f, 3>,
}

// Lobes about a direction: their sharpnesses, and the sines of half the azimuths from the nearer and the farther lobe
// of each pair to the direction.
struct LobeAngles {
    kappa: vec3f,
    near: vec2f,
    far: vec2f,
}

// sin_half and cos_half of half the azimuth from the lobes' common centre to the direction.
fn angles_to(lobes: Lobes, sin_half: f32, cos_half: f32) -> LobeAngles {
    let middle = sin_half * lobes.cos_half;
    let apart = cos_half * lobes.sin_half;
    return LobeAngles(2.0 / (lobes.lambda * lobes.lambda), middle - apart, middle + apart);
}

// Two fractions between those of two words, 0..=1.
fn mix_fractions(low: u32, high: u32, fraction: f32) -> vec2f {
    return mix(unpack2x16unorm(low), unpack2x16unorm(high), fraction);
}

// Two 16 bit floats between those of two words.
fn mix_floats(low: u32, high: u32, fraction: f32) -> vec2f {
    return mix(unpack2x16float(low), unpack2x16float(high), fraction);
}

// Where cos_theta_d >= 0 stands among the texels, 0..=1.
fn lobe_place(warp: f32, cos_theta_d: f32) -> f32 {
    let dense = (1.0 - EVEN_TEXELS) * (1.0 + warp) / (cos_theta_d + warp);
    return min(cos_theta_d * (dense + EVEN_TEXELS), 1.0);
}

// The 16 numbers between a texel and its right neighbour, fractions and floats yet to be scaled.
fn lobe_numbers(texture: texture_2d<u32>, texel: vec2u, fraction: f32) -> array<vec4f, 4> {
    let low_0 = textureLoad(texture, texel, 0);
    let low_1 = textureLoad(texture, texel + vec2u(1u, 0u), 0);
    let high_0 = textureLoad(texture, texel + vec2u(2u, 0u), 0);
    let high_1 = textureLoad(texture, texel + vec2u(3u, 0u), 0);
    return array<vec4f, 4>(
        vec4f(
            mix_fractions(low_0.x, high_0.x, fraction),
            mix_fractions(low_0.y, high_0.y, fraction),
        ),
        vec4f(
            mix_fractions(low_0.z, high_0.z, fraction),
            // The low half of this word is a fraction: floats of it mean nothing.
            mix_fractions(low_0.w, high_0.w, fraction).x,
            mix_floats(low_0.w, high_0.w, fraction).y,
        ),
        vec4f(
            mix_floats(low_1.x, high_1.x, fraction),
            mix_floats(low_1.y, high_1.y, fraction),
        ),
        vec4f(
            mix_floats(low_1.z, high_1.z, fraction),
            mix_floats(low_1.w, high_1.w, fraction),
        ),
    );
}

// The lobes of these numbers at u.
fn scaled_lobes(x: array<vec4f, 4>, decode: LobeDecode, u: f32) -> Lobes {
    let height = decode.amplitude_scale * u * u;
    return Lobes(
        decode.lambda_scale * x[0].xyz,
        2.0 * vec2f(x[0].w, x[1].y) - 1.0,
        2.0 * vec2f(x[1].x, x[1].z) - 1.0,
        array<vec3f, 3>(
            height * vec3f(x[1].w, x[2].z, x[3].y),
            height * vec3f(x[2].x, x[2].w, x[3].z),
            height * vec3f(x[2].y, x[3].x, x[3].w),
        ),
    );
}

// The lobes at cos_theta_d >= 0; eta is looked at where there are several rows.
fn sample_lobes(
    texture: texture_2d<u32>,
    decode: LobeDecode,
    eta: f32,
    cos_theta_d: f32,
) -> Lobes {
    let u = lobe_place(decode.warp, cos_theta_d);
    let at = u * decode.last;
    let first = min(floor(at), decode.last - 1.0);
    let fraction = at - first;
    let at_row = min(max((eta - decode.eta_first) * decode.eta_scale, 0.0), decode.last_row);
    let row = max(min(floor(at_row), decode.last_row - 1.0), 0.0);
    let weight = at_row - row;
    let texel = vec2u(2u * u32(first), decode.first_row + u32(row));
    let x = lobe_numbers(texture, texel, fraction);
    if decode.last_row > 0.0 {
        let y = lobe_numbers(texture, texel + vec2u(0u, 1u), fraction);
        let between = array<vec4f, 4>(
            mix(x[0], y[0], weight),
            mix(x[1], y[1], weight),
            mix(x[2], y[2], weight),
            mix(x[3], y[3], weight),
        );
        return scaled_lobes(between, decode, u);
    }
    return scaled_lobes(x, decode, u);
}

// As sample_lobes where one row is all there is, as of TT: software adapters execute both sides
// of a branch.
fn sample_row(texture: texture_2d<u32>, decode: LobeDecode, cos_theta_d: f32) -> Lobes {
    let u = lobe_place(decode.warp, cos_theta_d);
    let at = u * decode.last;
    let first = min(floor(at), decode.last - 1.0);
    let texel = vec2u(2u * u32(first), decode.first_row);
    return scaled_lobes(lobe_numbers(texture, texel, at - first), decode, u);
}
